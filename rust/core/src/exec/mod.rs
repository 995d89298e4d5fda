//! Long calls: threads, stages with progress and cancellation, memory that a caller decides about.

pub(crate) mod huge_pages;
pub(crate) mod memory;
pub(crate) mod pool;
pub(crate) mod stages;

pub use pool::{Watch, part_of, workers};
