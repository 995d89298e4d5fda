//! Jumps of windowed coefficients and of constants.

pub(crate) mod constants;
pub(crate) mod free_lines;
pub(crate) mod jump;
pub(crate) mod placement;
pub(crate) mod pulses;
pub(crate) mod ramps;
pub(crate) mod search;
pub(crate) mod shared_windows;
#[cfg(test)]
pub(crate) mod simulated;
