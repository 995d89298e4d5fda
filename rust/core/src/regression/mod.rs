//! Regression with windowed and constant unknowns, corrected for the noise of the regressors.

pub(crate) mod block_fit;
pub(crate) mod block_products;
pub(crate) mod block_scatter;
pub(crate) mod block_sums;
pub(crate) mod centred_windows;
pub(crate) mod constants;
pub(crate) mod dyadic_kernels;
pub(crate) mod dyadic_windows;
pub(crate) mod fit;
pub(crate) mod layout;
pub(crate) mod limits;
pub(crate) mod magnitudes;
pub(crate) mod model;
pub(crate) mod newey_west;
pub(crate) mod noise_correction;
pub(crate) mod predictor;
pub(crate) mod problem;
pub(crate) mod residuals;
pub(crate) mod row_covariance;
pub(crate) mod row_neighbours;
pub(crate) mod sandwich;
pub(crate) mod sides;
#[cfg(test)]
pub(crate) mod simulated;
pub(crate) mod solve;
pub(crate) mod solved;
pub(crate) mod subsample;
pub(crate) mod summary;
pub(crate) mod summary_table;
pub(crate) mod tapered_sums;
pub(crate) mod two_stage;
pub(crate) mod whitening;
pub(crate) mod window_length;

pub use limits::{HARDLY_TOLD_APART, NEGATIVE_BEYOND, NOISE_MODEL_FAILS, OFTEN};
