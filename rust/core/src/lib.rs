#![doc = include_str!("../README.md")]

pub mod auto_derivatives;
pub mod equation;
mod error;
pub mod exec;
pub mod identify;
pub mod inference;
pub mod irregular;
pub mod lanes;
pub mod least_squares;
pub mod local_polynomials;
pub mod noise;
pub mod record;
pub mod regression;
pub mod response;
pub mod simd;
mod status;
pub mod stream;
pub mod weak_form;

pub use error::Error;
pub use identify::builder::identify;
pub use status::Status;
