//! The equation of motion: its terms and its rows.

pub(crate) mod motion;
pub(crate) mod rows;
pub(crate) mod terms;

pub use motion::{Coefficient, Measured, Motion, Term};
pub use terms::{BUILT_IN_TERMS, BuiltInTerm};
