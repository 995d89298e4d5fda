//! Identification in weak form: test function, decisions, report.

pub(crate) mod angle_zero;
pub(crate) mod below_filter;
pub(crate) mod choice;
pub(crate) mod decide;
pub(crate) mod decided;
pub(crate) mod form;
pub(crate) mod found;
pub(crate) mod freed;
pub(crate) mod friction;
pub(crate) mod jumps;
pub(crate) mod jumps_of_constants;
pub(crate) mod lag;
pub(crate) mod limits;
pub(crate) mod options;
pub(crate) mod outside_mask;
pub(crate) mod pulses;
pub(crate) mod report;
pub(crate) mod scan;
pub(crate) mod session;
pub(crate) mod shown_noise;
pub(crate) mod swings;
pub(crate) mod torque_jumps;
pub(crate) mod weighting;
pub(crate) mod windows;
