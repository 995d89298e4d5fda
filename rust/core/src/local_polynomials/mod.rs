//! Local polynomials: a fit in every window, its order chosen by a criterion, and the derivatives of the fit.

pub(crate) mod apart;
pub(crate) mod basis;
pub(crate) mod boundary;
pub(crate) mod coefficients;
pub(crate) mod criterion;
pub(crate) mod double_double;
pub(crate) mod engine;
pub(crate) mod estimates;
pub(crate) mod evaluate;
pub(crate) mod incomplete;
pub(crate) mod kernels;
pub(crate) mod mirrored_kernels;
pub(crate) mod neighbour_sums;
pub(crate) mod off_centre;
pub(crate) mod options;
pub(crate) mod order_average;
pub(crate) mod order_selection;
pub(crate) mod order_shares;
pub(crate) mod pieces;
pub(crate) mod plan;
pub(crate) mod records;
pub(crate) mod short_windows;
pub(crate) mod side_by_side;
pub(crate) mod single_window;
pub(crate) mod sliding_projection;
pub(crate) mod span;
pub(crate) mod tables;

pub use basis::Basis;
pub use boundary::End;
pub use criterion::Criterion;
pub use estimates::Estimates;
pub use incomplete::{Incomplete, IncompleteEstimate, parts_of};
pub use options::{HIGHEST_ORDER, Order, PolynomialOptions, Selection};
pub use plan::LocalPolynomials;
