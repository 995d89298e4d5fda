//! The weak form: rows of the equation of motion as dot products of the channels with the kernels of a test function.

pub(crate) mod angle_noise;
pub(crate) mod coverage;
pub(crate) mod filter_bank;
pub(crate) mod test_function;
pub(crate) mod test_function_choice;
pub(crate) mod weak_rows;

pub use test_function::TestFunction;
