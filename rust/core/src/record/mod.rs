//! Samples of a record, addressed by absolute sample number.

pub(crate) mod buffer;
pub(crate) mod delayed;
pub(crate) mod derived;
pub(crate) mod placed;
pub(crate) mod retained;
pub(crate) mod samples;
pub(crate) mod subsample;

pub use placed::Placed;
pub use samples::Samples;
