//! What is said of a record once it is decided what changes.

pub(crate) mod at_rows;
pub(crate) mod errors;
pub(crate) mod missing_terms;
pub(crate) mod record;
pub(crate) mod tracks;
