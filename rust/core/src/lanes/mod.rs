//! Many windows side by side, one a lane: how samples are laid out for them, and how their results are written.

pub(crate) mod interleaved;
pub(crate) mod output;
pub(crate) mod store;
pub(crate) mod tile;

pub use output::Elements;
