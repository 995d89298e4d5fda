//! Jumps of windowed coefficients.

pub(crate) mod jump;
pub(crate) mod placement;
pub(crate) mod search;
pub(crate) mod shared_windows;
#[cfg(test)]
pub(crate) mod simulated;
