//! Rows of the equation of motion in weak form: products of channels with the derivatives of a test function.

pub(crate) mod coverage;
pub(crate) mod filter_bank;
pub(crate) mod test_function;
pub(crate) mod test_function_choice;
pub(crate) mod weak_rows;

pub use test_function::TestFunction;
