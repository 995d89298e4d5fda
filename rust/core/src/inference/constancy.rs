//! A test of whether a constant coefficient is the same in all parts of the record.
//!
//! Each constant is estimated separately in eight blocks of the record. If it does not change, the squared differences
//! between the blocks, over the variances that the noise explains, follow a χ² distribution (Wald's test).

use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::Piece;
use crate::exec::stages::Stages;
use crate::regression::constants::{Expected, pool};
use crate::regression::fit::Fit;
use crate::regression::problem::Problem;
use crate::regression::row_covariance::RowCovariance;
use crate::simd::instructions::Instructions;

/// Blocks that a record is cut into.
const BLOCKS: usize = 8;

/// Probability below which a difference is significant: once in 2000 records.
pub const NO_CHANCE: f64 = 5e-4;

/// The result of the test of one constant.
#[derive(Clone, Debug, PartialEq)]
pub struct Test {
    /// Probability that a constant coefficient differs as much between the blocks.
    pub probability: f64,
    /// Standard deviation between the blocks beyond what noise explains, over the mean.
    pub spread: f64,
}

/// Tests every constant of a fit; the result is `None` if the blocks do not determine it. `inflation` multiplies the variances.
pub(crate) fn test(
    problem: &Problem<'_>,
    fit: &Fit,
    expected: Expected,
    covariance: &RowCovariance,
    inflation: f64,
    instructions: Instructions,
    stages: &mut Stages<'_, '_>,
) -> Result<Vec<Option<Test>>, Error> {
    let rows = problem.rows();
    let constants = problem.layout.constant;
    let (step, span) = (fit.step, fit.span);
    let estimate = |block: usize, (): &mut ()| {
        let (first, end) = (block * rows / BLOCKS, (block + 1) * rows / BLOCKS);
        let windows = within(fit, first..end, step, span);
        if windows.is_empty() {
            return None;
        }
        let pooled = pool(&fit.full, windows.clone(), expected, instructions)?;
        let variances = fit.covariance_of(problem, windows, &pooled, covariance);
        let variances: Vec<f64> = (0..constants).map(|i| inflation * variances[i * constants + i]).collect();
        Some((pooled.values, variances))
    };
    let blocks = (0..BLOCKS).map(|block| Piece { size: rows.div_ceil(BLOCKS), content: block });
    let estimates = stages.map(blocks.collect(), || (), estimate)?;
    let estimates: Vec<_> = estimates.into_iter().flatten().collect();
    let tests = (0..constants)
        .map(|constant| {
            let parts: Vec<(f64, f64)> =
                estimates.iter().map(|(values, variances)| (values[constant], variances[constant])).collect();
            compare(&parts)
        })
        .collect();
    Ok(tests)
}

/// Windows that lie within some rows.
fn within(fit: &Fit, rows: Range<usize>, step: usize, span: usize) -> Range<usize> {
    let place = |row: isize| {
        let block = row.div_euclid(step.cast_signed()) - fit.full.first;
        usize::try_from(block).unwrap_or(0)
    };
    let first = place((rows.start + step).cast_signed() - 1);
    let end = place(rows.end.cast_signed() - span.cast_signed() + step.cast_signed()).min(fit.full.len());
    first..end.max(first)
}

/// Compares estimates of the same number, each with its variance.
fn compare(parts: &[(f64, f64)]) -> Option<Test> {
    let usable: Vec<(f64, f64)> =
        parts.iter().copied().filter(|(value, variance)| value.is_finite() && *variance > 0.0).collect();
    if usable.len() < 2 {
        return None;
    }
    let mut variances: Vec<f64> = usable.iter().map(|(_, variance)| *variance).collect();
    let middle = variances.len() / 2;
    // A block with an accidentally small variance must not decide alone.
    let least = 0.5 * *variances.select_nth_unstable_by(middle, f64::total_cmp).1;
    let weight = |variance: f64| 1.0 / variance.max(least);
    let total: f64 = usable.iter().map(|(_, variance)| weight(*variance)).sum();
    let mean = usable.iter().map(|(value, variance)| weight(*variance) * value).sum::<f64>() / total;
    let squares: f64 = usable.iter().map(|(value, variance)| weight(*variance) * (value - mean).powi(2)).sum();
    let freedom = usable.len() - 1;
    let scatter = usable.iter().map(|(value, _)| (value - mean).powi(2)).sum::<f64>() / freedom as f64;
    let noise = usable.iter().map(|(_, variance)| variance).sum::<f64>() / usable.len() as f64;
    let spread = (scatter - noise).max(0.0).sqrt() / mean.abs();
    Some(Test { probability: chi_squared_beyond(squares, freedom), spread })
}

/// The probability that a χ² variable exceeds a value.
pub(crate) fn chi_squared_beyond(value: f64, freedom: usize) -> f64 {
    let (mut sum, mut term) = (0.0, 0.0);
    let half = value / 2.0;
    // Adding two degrees of freedom adds a density; begin with one or two.
    let mut k = if freedom % 2 == 0 { 2 } else { 1 };
    while k < freedom {
        term = if term == 0.0 {
            if k == 1 { (2.0 * value / std::f64::consts::PI).sqrt() * (-half).exp() } else { half * (-half).exp() }
        } else {
            term * value / k as f64
        };
        sum += term;
        k += 2;
    }
    sum + if freedom % 2 == 0 { (-half).exp() } else { complementary_error(half.sqrt()) }
}

/// `erfc(x)` for `x ≥ 0`, by its power series near zero and its continued fraction beyond.
fn complementary_error(x: f64) -> f64 {
    if x < 2.0 {
        let (mut sum, mut term) = (x, x);
        for n in 1..60 {
            term *= -x * x / f64::from(n);
            sum += term / f64::from(2 * n + 1);
        }
        1.0 - sum * std::f64::consts::FRAC_2_SQRT_PI
    } else {
        let fraction = (1..60).rev().fold(0.0, |fraction, n| f64::from(n) / 2.0 / (x + fraction));
        (-x * x).exp() / (std::f64::consts::PI.sqrt() * (x + fraction))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probabilities_are_those_of_the_tables() {
        for (value, freedom, expected) in [
            (3.841_459, 1, 0.05),
            (5.991_465, 2, 0.05),
            (14.067_14, 7, 0.05),
            (24.321_89, 7, 0.001),
            (12.591_59, 6, 0.05),
        ] {
            let found = chi_squared_beyond(value, freedom);
            assert!((found / expected - 1.0).abs() < 1e-5, "{value} {freedom}: {found}");
        }
        assert!((complementary_error(3.0) / 2.209_049_699_858_544e-5 - 1.0).abs() < 1e-12);
    }
}
