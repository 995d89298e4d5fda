//! Samples whose times are not uniform: splines that bring channels onto a uniform grid, what that does to noise, and polynomials in windows.

pub(crate) mod own_basis;
pub(crate) mod passed_noise;
pub(crate) mod resampling;
pub(crate) mod spline;
pub(crate) mod window_fit;

pub use passed_noise::{gain, passed_noise};
pub use resampling::Resampling;
pub use window_fit::{FEWEST, WindowFit, WindowFits, WindowSpan};
