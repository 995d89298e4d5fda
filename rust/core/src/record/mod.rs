//! Samples of a record, known by absolute number: read, derived from other channels, delayed, held in memory, in parts of a long record.

pub(crate) mod buffer;
pub(crate) mod delayed;
pub(crate) mod derived;
pub(crate) mod samples;
pub(crate) mod subsample;

pub use samples::Samples;
