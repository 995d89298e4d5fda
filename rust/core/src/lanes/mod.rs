//! Many windows side by side, one per lane: the layout of their samples and the output of their results.

pub(crate) mod interleaved;
pub(crate) mod lists;
pub(crate) mod output;
pub(crate) mod store;
pub(crate) mod tile;

pub use output::Elements;
