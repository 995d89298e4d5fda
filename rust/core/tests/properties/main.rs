//! Properties of what the core offers. One program: the core is linked once.

mod basis;
mod columns;
mod cutting;
mod local_polynomials;
mod noise;
mod random;
mod rolling;
mod streams;
mod test_function;
