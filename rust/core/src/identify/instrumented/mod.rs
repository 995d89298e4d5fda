//! Identification with an instrument: a channel that no noise of the others reaches.

pub(crate) mod constancy;
pub(crate) mod explained;
pub(crate) mod record;
pub(crate) mod strong_windows;
pub(crate) mod two_stage_rows;
pub(crate) mod waves;
