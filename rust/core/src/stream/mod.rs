//! Streams: the batch's numbers while a record goes on, in constant memory and with a fixed delay.

pub(crate) mod constants;
pub(crate) mod correlated_rows;
pub(crate) mod incomplete_polynomials;
pub(crate) mod polynomials;
pub(crate) mod rolling;
pub(crate) mod rows;
pub(crate) mod windowed;

pub use constants::{ConstantState, ConstantStream};
pub use correlated_rows::CorrelatedStream;
pub use incomplete_polynomials::{IncompleteState, IncompleteStream, StreamedGaps};
pub use polynomials::{PolynomialState, PolynomialStream};
pub use rolling::{RollingState, RollingStream};
pub use windowed::{
    NextSamples, Parameters, RowsState, StreamedMotion, StreamedSamples, WindowedState, WindowedStream,
};
