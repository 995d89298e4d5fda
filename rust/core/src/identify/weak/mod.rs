//! Identification in weak form: test function, decisions, report.

pub(crate) mod decide;
pub(crate) mod lag;
pub(crate) mod outside_mask;
pub(crate) mod report;
pub(crate) mod session;
