//! Samples whose times are not uniform: splines that bring channels onto a uniform grid, what that does to noise, and polynomials in windows.

pub(crate) mod passed_noise;
pub(crate) mod resampling;
pub(crate) mod shared_buffers;
pub(crate) mod shared_windows;
pub(crate) mod spline;
pub(crate) mod window_alone;
pub(crate) mod window_estimates;
pub(crate) mod window_fit;
pub(crate) mod window_places;

pub use passed_noise::{MOST_RECORDS, gain, passed_noise};
pub use resampling::Resampling;
pub use window_estimates::{WindowFit, WindowFits};
pub use window_fit::FEWEST;
pub use window_places::WindowSpan;
