//! A jump, and what jumps are looked for in.

use crate::record::samples::Samples;
use crate::regression::constants::Expected;
use crate::regression::problem::Problem;
use crate::regression::window_length::Scale;
use crate::simd::instructions::Instructions;

/// A place of a jump that is less probable does not count.
pub(crate) const UNLIKELY: f64 = 1e-3;

/// A jump of what is windowed.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Jump {
    /// The first sample after it.
    pub(crate) sample: usize,
    /// The probability that it has happened at the samples from `first` on.
    pub(crate) first: usize,
    pub(crate) happened: Vec<f64>,
}

/// What jumps are looked for in.
pub(crate) struct JumpSearch<'a> {
    /// Rows once the constants are known.
    pub(crate) problem: &'a Problem<'a>,
    /// All rows, also those over jumps that are known, and their right-hand side without constants.
    pub(crate) whole: &'a Problem<'a>,
    pub(crate) rhs: &'a [f64],
    /// What the windowed coefficients multiply, sample by sample.
    pub(crate) signals: &'a [&'a dyn Samples],
    /// The test function at its samples.
    pub(crate) function: &'a [f64],
    /// Sample of the first row, and samples from one to the next.
    pub(crate) first: usize,
    pub(crate) stride: usize,
    pub(crate) expected: Expected,
    /// What variances are multiplied by.
    pub(crate) inflation: f64,
    /// All lengths of windows, and those that jumps are looked for with.
    pub(crate) scales: &'a [Scale],
    pub(crate) lengths: &'a [Scale],
    pub(crate) instructions: Instructions,
}

/// A line for every windowed coefficient: value at a row and growth per row.
pub(crate) type Lines = Vec<[f64; 2]>;
