//! A jump, and the data in which jumps are searched.

use crate::record::samples::Samples;
use crate::regression::constants::Expected;
use crate::regression::problem::Problem;
use crate::regression::window_length::Scale;
use crate::simd::instructions::Instructions;

/// Places of a jump that are less probable are ignored.
pub(crate) const UNLIKELY: f64 = 1e-3;

/// A jump of the windowed coefficients, or of constants.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Jump {
    /// The first sample after it.
    pub(crate) sample: usize,
    /// The probability that it has happened by each sample from `first` on.
    pub(crate) first: usize,
    pub(crate) happened: Vec<f64>,
    /// Whether constants jump, beside which the windowed coefficients may, too.
    pub(crate) of_constants: bool,
}

impl Jump {
    /// Whether neither end of the places that were tried is likely.
    pub(crate) fn is_between_ends(&self) -> bool {
        let before_last = self.happened.iter().nth_back(1).copied().unwrap_or(0.0);
        self.happened.first().is_some_and(|&first| first < UNLIKELY) && before_last > 1.0 - UNLIKELY
    }
}

/// The data in which jumps are searched.
pub(crate) struct JumpSearch<'a> {
    /// The rows minus the contribution of the constants.
    pub(crate) problem: &'a Problem<'a>,
    /// All rows, also those over jumps that are known, and their right-hand side without constants.
    pub(crate) whole: &'a Problem<'a>,
    pub(crate) rhs: &'a [f64],
    /// The factors of the windowed coefficients, sample by sample.
    pub(crate) signals: &'a [&'a dyn Samples],
    /// The test function at its samples.
    pub(crate) function: &'a [f64],
    /// Sample of the first row, and samples from one to the next.
    pub(crate) first: usize,
    pub(crate) stride: usize,
    /// Rows that belong to one time; then there is a signal for each of them, unknown by unknown.
    pub(crate) group: usize,
    pub(crate) expected: Expected,
    /// The factor on all variances.
    pub(crate) inflation: f64,
    /// All lengths of windows, and those used to search jumps.
    pub(crate) scales: &'a [Scale],
    pub(crate) lengths: &'a [Scale],
    pub(crate) instructions: Instructions,
}

impl JumpSearch<'_> {
    /// The first row of the times from a sample on.
    pub(crate) fn row_from(&self, sample: usize) -> usize {
        row_from(sample, (self.first, self.stride, self.group))
    }
}

/// The first row of the times from a sample on: the first time is a sample, the next is so many samples later, and so many rows belong to each.
pub(crate) fn row_from(sample: usize, (first, stride, group): (usize, usize, usize)) -> usize {
    sample.saturating_sub(first).div_ceil(stride) * group
}

/// A line for every windowed coefficient: value at a row and growth per row.
pub(crate) type Lines = Vec<[f64; 2]>;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::jumps::simulated::{HALF, SAMPLES, searched, spring};

    #[test]
    fn a_jump_that_may_be_at_an_end_of_its_places_is_not_between_them() {
        let jump = |happened: &[f64]| Jump { sample: 7, first: 5, happened: happened.to_vec(), of_constants: true };
        assert!(jump(&[1e-4, 0.3, 0.9999, 1.0]).is_between_ends());
        assert!(!jump(&[0.01, 0.3, 0.9999, 1.0]).is_between_ends());
        assert!(!jump(&[1e-4, 0.3, 0.99, 1.0]).is_between_ends());
        assert!(!jump(&[1.0]).is_between_ends() && !jump(&[]).is_between_ends());
    }

    #[test]
    fn rows_from_a_sample_on_are_those_whose_time_is_not_before_it() {
        let spring = spring(|_| 10.0);
        searched(&spring, |search| {
            for (stride, group) in [(1, 1), (2, 1), (5, 1), (2, 3)] {
                let search = JumpSearch { stride, group, ..*search };
                let before = |sample: usize| (0..SAMPLES).take_while(|time| HALF + time * stride < sample).count();
                for sample in 0..100 {
                    assert_eq!(search.row_from(sample), group * before(sample), "sample {sample} of {stride}");
                }
            }
        });
    }
}
