//! Where a windowed coefficient jumps.

pub(crate) mod jump;
pub(crate) mod placement;
pub(crate) mod search;
