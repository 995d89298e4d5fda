//! Identification of time-varying inertia, damping and stiffness from a recorded angle and torque, and on the way the
//! differentiation of noisy recordings with a polynomial order chosen in every window.

mod aligned;
pub mod basis;
mod coefficients;
pub mod criterion;
mod double_double;
mod ends;
pub mod error;
mod finish;
pub mod identification;
pub mod local_polynomials;
pub mod motion;
pub mod noise;
pub mod output;
pub mod parallel;
mod pool;
mod projection;
pub mod rolling;
pub mod samples;
pub mod selection;
pub mod shared_parameters;
mod simd;
pub mod status;
mod stretch;
mod strips;
mod sweep;
mod tile;
mod triangle;
mod walk;
mod window;
mod write;

pub use basis::Basis;
pub use criterion::Criterion;
pub use ends::End;
pub use error::Error;
pub use identification::{Identified, identify_constant, identify_windowed};
pub use local_polynomials::{Estimates, LocalPolynomials, Options, Order};
pub use motion::{Coefficient, Motion, Term};
pub use output::Elements;
pub use rolling::{Equations, Regressions, RollingLeastSquares};
pub use samples::Samples;
pub use selection::Selection;
pub use shared_parameters::SharedParameters;
pub use simd::Instructions;
pub use status::Status;
