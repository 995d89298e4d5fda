//! Identification from rows that are merged: of repeated trials that share their parameters, and of coupled masses.

pub(crate) mod across;
pub(crate) mod blurred;
pub(crate) mod choice;
pub(crate) mod colour;
pub(crate) mod decided;
pub(crate) mod defects;
pub(crate) mod fading;
pub(crate) mod fitted;
pub(crate) mod followed;
pub(crate) mod form;
pub(crate) mod found;
pub(crate) mod freed;
pub(crate) mod interleaved;
pub(crate) mod jumps;
pub(crate) mod lags;
pub(crate) mod possible_terms;
pub(crate) mod report;
pub(crate) mod scan;
pub(crate) mod session;
pub(crate) mod shared;
pub(crate) mod shown;
pub(crate) mod silent;
pub(crate) mod spread;
pub(crate) mod suspected_terms;
pub(crate) mod swings;
pub(crate) mod system;
