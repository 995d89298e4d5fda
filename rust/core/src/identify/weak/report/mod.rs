//! The report of one record after all decisions.

pub(crate) mod at_rows;
pub(crate) mod beside_lag;
pub(crate) mod doubted;
pub(crate) mod errors;
pub(crate) mod explained;
pub(crate) mod filter;
pub(crate) mod missing_terms;
pub(crate) mod of_torque;
pub(crate) mod record;
pub(crate) mod tracks;
pub(crate) mod window_sums;
