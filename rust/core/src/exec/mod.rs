//! Long calls: threads, stages with progress and cancellation, memory for long results.

pub(crate) mod huge_pages;
pub(crate) mod pool;
pub(crate) mod stages;

pub use pool::{Watch, workers};
