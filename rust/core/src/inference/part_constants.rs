//! The constants of a part of the record, and their variances.

use std::ops::Range;

use crate::regression::constants::{Expected, pool};
use crate::regression::fit::Fit;
use crate::regression::problem::Problem;
use crate::regression::row_covariance::RowCovariance;
use crate::regression::solved::is_determined;
use crate::simd::instructions::Instructions;

/// Where the variance of the noise is known from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NoiseFrom {
    /// The highest frequencies of the channels.
    Channels,
    /// What the equations leave, or the step that a channel was rounded to: it need not be white.
    Equations,
}

/// The noise that a test compares with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TestNoise<'a> {
    pub(crate) expected: Expected,
    pub(crate) covariance: &'a RowCovariance,
    /// What variances are multiplied by.
    pub(crate) inflation: f64,
    pub(crate) from: NoiseFrom,
    /// Equations whose rows take turns.
    pub(crate) equations: usize,
}

/// The constants of some rows, and their variances; `None` if the rows do not determine them.
pub(crate) type Estimate = Option<(Vec<f64>, Vec<f64>)>;

/// The constants of some rows, from the windows that lie within them or as if there were no others, and their variances.
pub(crate) fn estimate(
    problem: &Problem<'_>,
    fit: &Fit,
    TestNoise { expected, covariance, inflation, .. }: TestNoise<'_>,
    rows: Range<usize>,
    instructions: Instructions,
) -> Estimate {
    let constants = problem.layout.constant;
    let windows = within(fit, rows.clone());
    let (values, covariance) = if windows.is_empty() {
        alone(problem, rows, expected, covariance, instructions)?
    } else {
        let pooled = pool(&fit.full, windows.clone(), expected, instructions)?;
        let of_windows = fit.covariance_of(problem, windows, &pooled, covariance);
        (pooled.values, of_windows)
    };
    let variances: Vec<f64> = (0..constants).map(|i| inflation * covariance[i * constants + i]).collect();
    Some((values, variances))
}

/// The constants of some rows as if there were no others, and their covariance: in windows as long as they are, or in the longest that jumps
/// leave of them.
fn alone(
    problem: &Problem<'_>,
    rows: Range<usize>,
    expected: Expected,
    covariance: &RowCovariance,
    instructions: Instructions,
) -> Option<(Vec<f64>, Vec<f64>)> {
    let jumps = problem.jumps_of(&rows);
    let part = problem.part(&rows, &jumps);
    let shortened = [1, 2, 4].map(|part| rows.len() / part);
    let enough = shortened.into_iter().filter(|&length| length > problem.layout.regressors());
    let mut fits = enough.filter_map(|length| Fit::in_rows(&part, length, expected, instructions));
    let fit = fits.find(|fit| (0..fit.full.len()).any(|window| is_determined(&fit.full, window)))?;
    let covariance = fit.covariance_of(&part, 0..fit.full.len(), &fit.pooled, &covariance.beginning_at(rows.start));
    Some((fit.pooled.values, covariance))
}

/// Windows that lie within some rows.
fn within(fit: &Fit, rows: Range<usize>) -> Range<usize> {
    let (step, span) = (fit.step, fit.span);
    let place = |row: isize| {
        let block = row.div_euclid(step.cast_signed()) - fit.full.first;
        usize::try_from(block).unwrap_or(0)
    };
    let first = place((rows.start + step).cast_signed() - 1);
    let end = place(rows.end.cast_signed() - span.cast_signed() + step.cast_signed()).min(fit.full.len());
    first..end.max(first)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::simulated::{CONSTANTS, model, rows, white};

    #[test]
    fn a_part_tells_constants_from_windows_within_it_or_as_if_it_were_alone() {
        let rows = rows(1600, |time| [1.0 + 0.01 * time, 0.01], 0.1);
        let problem = model().problem(&rows, &rows.rhs, 0.0, None);
        let fit = Fit::in_rows(&problem, 64, white(0.01), Instructions::Scalar).expect("constants");
        let covariance = &RowCovariance::by_distance(vec![0.01]);
        let noise =
            TestNoise { expected: white(0.01), covariance, inflation: 4.0, from: NoiseFrom::Channels, equations: 1 };
        let of = |part: Range<usize>| estimate(&problem, &fit, noise, part, Instructions::Scalar);
        // Longer than a window, and shorter.
        for part in [400..800, 400..440] {
            assert_eq!(within(&fit, part.clone()).is_empty(), part.len() < 64);
            let (values, variances) = of(part.clone()).expect("constants");
            for ((value, variance), constant) in values.iter().zip(variances).zip(CONSTANTS) {
                // White regressors of variance one; twice that for what windows take.
                let by_noise = 0.01 / part.len() as f64;
                assert!((3.0 * by_noise..8.0 * by_noise).contains(&variance), "{part:?} {variance}");
                assert!((value - constant).powi(2) < 16.0 * by_noise, "{part:?} {value}");
            }
        }
        assert!(of(400..402).is_none());
    }
}
