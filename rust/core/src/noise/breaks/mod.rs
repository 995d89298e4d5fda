//! Breaks of an angle: places at which a recorder lost samples and left no gap.

pub(crate) mod search;
pub(crate) mod shift;
pub(crate) mod step;
pub(crate) mod windows;
