//! Identification in strong form: rows from derivatives, one a sample.

pub(crate) mod constant;
pub(crate) mod general;
pub(crate) mod rows;
pub(crate) mod scatter;
pub(crate) mod streaming;
pub(crate) mod windowed;
