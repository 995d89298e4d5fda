//! Least squares of given rows: in sliding windows, and over a whole record.

pub(crate) mod bandwidth;
pub(crate) mod correlated;
pub(crate) mod error_scale;
pub(crate) mod fading;
pub(crate) mod givens_factor;
pub(crate) mod kernel;
pub(crate) mod one_by_one;
pub(crate) mod plan;
pub(crate) mod rolling;
pub(crate) mod rounds;
pub(crate) mod row_fits;
pub(crate) mod row_products;
pub(crate) mod row_times;
pub(crate) mod side_by_side;
pub(crate) mod sliding_sums;
pub(crate) mod solutions;
pub(crate) mod span_factors;
pub(crate) mod span_walk;
pub(crate) mod spans;
pub(crate) mod stacked_qr;
pub(crate) mod window_summary;

pub use plan::{Alignment, Equations, HALF_OF_THE_DIGITS, Regressions, RollingLeastSquares};
pub use row_times::RowTimes;
pub use spans::Spans;
pub use stacked_qr::{SharedParameters, Summary};
