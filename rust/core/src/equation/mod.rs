//! The equation of motion: what stands in it, and its rows.

pub(crate) mod motion;
pub(crate) mod rows;

pub use motion::{Coefficient, Motion, Term};
