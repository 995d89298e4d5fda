//! The angle at which the spring is relaxed, where it is not the encoder's zero.

pub(crate) mod contradiction;
pub(crate) mod first_guess;
pub(crate) mod outcome;
pub(crate) mod search;
pub(crate) mod spring;
pub(crate) mod windowed_offset;
