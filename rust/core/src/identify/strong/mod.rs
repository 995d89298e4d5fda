//! Identification in strong form: rows from derivatives, one a sample.

pub(crate) mod general;
pub(crate) mod scatter;
pub(crate) mod streaming;
