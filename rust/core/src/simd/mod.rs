//! SIMD vectors, with instructions chosen at run time.

pub(crate) mod aligned;
pub(crate) mod f64x8;
pub(crate) mod instructions;
pub(crate) mod unroll;
pub(crate) mod vectors;

pub use instructions::Instructions;
