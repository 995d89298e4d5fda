//! Identification in strong form: one row per sample, from estimated derivatives.

pub(crate) mod beside_gaps;
pub(crate) mod constant;
pub(crate) mod general;
pub(crate) mod parts;
pub(crate) mod rows;
pub(crate) mod scan;
pub(crate) mod scatter;
pub(crate) mod streaming;
pub(crate) mod windowed;
