//! Jumps of windowed coefficients.

pub(crate) mod jump;
pub(crate) mod placement;
pub(crate) mod search;
#[cfg(test)]
pub(crate) mod simulated;
