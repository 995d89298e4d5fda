//! Covariance of the constant unknowns where the noise of rows is correlated: the sandwich estimator.

use std::borrow::Cow;
use std::ops::Range;

use crate::regression::problem::Problem;
use crate::regression::row_covariance::RowCovariance;
use crate::regression::solved::Solved;

/// The influence of every row within some windows on a constant: a column of `X̃`, so that the constants are `N⁻¹ X̃ᵀ b`.
///
/// `step` and `span` are the rows from one window to the next and the rows of a window, `centre` where each is solved. In a single window over
/// all rows, without unknowns of its own, it is the constant's regressor.
pub(crate) fn influence<'a>(
    problem: &Problem<'a>,
    (full, windows): (&Solved, Range<usize>),
    weights: &[f64],
    [step, span]: [usize; 2],
    centre: impl Fn(usize) -> f64,
    constant: usize,
) -> Cow<'a, [f64]> {
    let layout = problem.layout;
    let (fields, q) = (full.fields, layout.windowed);
    let (rows, blocks) = (problem.rows(), span / step);
    let is_one = full.first == 0 && windows == (0..1) && blocks * step >= rows;
    if is_one && q == 0 && weights == [1.0] {
        return Cow::Borrowed(problem.constants[constant]);
    }
    let first_block = full.first + windows.start.cast_signed();
    let row =
        |block: usize| usize::try_from((first_block + block.cast_signed()) * step.cast_signed()).unwrap_or(0).min(rows);
    let reached = row(0)..row(windows.len() + blocks).max(row(0));
    let mut column = vec![0.0; reached.len()];
    // Sums over windows from the first on: weights, then by regressor the part at the window's centre, its rate, and the rate times
    // the centre. The windows over a block are a stretch of them.
    let width = 1 + 3 * q;
    let mut sums = vec![0.0; (windows.len() + 1) * width];
    for (place, window) in windows.clone().enumerate() {
        let weight = weights[place];
        let (before, after) = sums[place * width..(place + 2) * width].split_at_mut(width);
        after.copy_from_slice(before);
        after[0] += weight;
        for regressor in 0..q {
            let value = weight * full.field(fields.solution(regressor, constant))[window];
            let rate =
                if layout.linear { weight * full.field(fields.solution(q + regressor, constant))[window] } else { 0.0 };
            let parts = [value, rate, rate * centre(window)];
            after[1 + 3 * regressor..][..3].iter_mut().zip(parts).for_each(|(sum, part)| *sum += part);
        }
    }
    let mut taken = vec![0.0; width];
    for block in 0..windows.len() + blocks - 1 {
        let covering = block.saturating_sub(blocks - 1)..(block + 1).min(windows.len());
        let first = (first_block + block.cast_signed()) * step.cast_signed();
        let Ok(first) = usize::try_from(first) else { continue };
        for (index, taken) in taken.iter_mut().enumerate() {
            *taken = sums[covering.end * width + index] - sums[covering.start * width + index];
        }
        let last = (first + step).min(rows);
        for (row, influence) in (first..last).zip(column.get_mut(first - reached.start..).unwrap_or_default()) {
            let mut value = taken[0] * problem.constants[constant][row];
            for (regressor, part) in taken[1..].chunks_exact(3).enumerate() {
                let at_row = part[0] + problem.period * (row as f64 * part[1] - part[2]);
                value -= at_row * problem.windowed[regressor][row];
                if layout.linear {
                    value -= part[1] * problem.companions[regressor][row];
                }
            }
            *influence = value;
        }
    }
    Cow::Owned(column)
}

/// Covariance of the constants, row by row: `N⁻¹ X̃ᵀ Γ X̃ N⁻¹`.
pub(crate) fn sandwich<C: AsRef<[f64]>>(influence: &[C], inverse: &[f64], covariance: &RowCovariance) -> Vec<f64> {
    let middle = (0..influence.len()).flat_map(|constant| products(influence, constant, covariance));
    between(&middle.collect::<Vec<_>>(), inverse, influence.len())
}

/// A row of `X̃ᵀ Γ X̃`, for one constant.
pub(crate) fn products<C: AsRef<[f64]>>(influence: &[C], constant: usize, covariance: &RowCovariance) -> Vec<f64> {
    covariance.products(influence, influence[constant].as_ref())
}

/// The product `inverse · middle · inverse` of square matrices, made symmetric.
pub(crate) fn between(middle: &[f64], inverse: &[f64], size: usize) -> Vec<f64> {
    let product = |a: &[f64], b: &[f64]| -> Vec<f64> {
        let entry = |i: usize, j: usize| (0..size).map(|k| a[i * size + k] * b[k * size + j]).sum();
        (0..size * size).map(|index| entry(index / size, index % size)).collect()
    };
    let result = product(&product(inverse, middle), inverse);
    (0..size * size).map(|index| f64::midpoint(result[index], result[index % size * size + index / size])).collect()
}

/// The covariance of two unknowns, of which the first `windowed` ones depend on `constants` others that come after them: the covariance of
/// their `own`, for given constants, and what the constants pass on to them.
pub(crate) fn joint_covariance(
    [one, other]: [usize; 2],
    [windowed, constants]: [usize; 2],
    own: impl Fn(usize, usize) -> f64,
    sensitive: impl Fn(usize, usize) -> f64,
    between: impl Fn(usize, usize) -> f64,
) -> f64 {
    let to = |unknown: usize, constant: usize| -> f64 {
        (0..constants).map(|k| sensitive(unknown, k) * between(k, constant)).sum()
    };
    match (one.checked_sub(windowed), other.checked_sub(windowed)) {
        (Some(one), Some(other)) => between(one, other),
        (Some(constant), None) => to(other, constant),
        (None, Some(constant)) => to(one, constant),
        (None, None) => {
            let passed_on: f64 = (0..constants)
                .flat_map(|i| (0..constants).map(move |j| (i, j)))
                .map(|(i, j)| sensitive(one, i) * sensitive(other, j) * between(i, j))
                .sum();
            own(one, other) + passed_on
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::fit::Fit;
    use crate::regression::simulated::{assert_near, model, random, rows, staged, white};
    use crate::regression::window_length::Scale;
    use crate::simd::instructions::Instructions;

    /// A fit in windows that overlap.
    fn fitted(problem: &Problem<'_>) -> Fit {
        let scale = Scale::all(problem.rows(), 3)[6];
        let fit = staged(|stages| Fit::new(problem, Some(scale), white(0.01), Instructions::Scalar, stages));
        fit.expect("constants")
    }

    #[test]
    fn constants_are_what_rows_move_them_by() {
        let mut rows = rows(300, |time| [time.sin(), time.cos()], 0.1);
        rows.exclude([17, 100, 101].into_iter());
        let problem = model().problem(&rows, &rows.rhs, 0.0, None);
        let fit = fitted(&problem);
        let columns: Vec<_> =
            (0..2).map(|one| fit.influence(&problem, &(0..fit.full.len()), &fit.pooled.weights, one)).collect();
        let moved: Vec<f64> =
            columns.iter().map(|column| column.iter().zip(&rows.rhs).map(|(a, b)| a * b).sum()).collect();
        for constant in 0..2 {
            let found: f64 = (0..2).map(|other| fit.pooled.inverse[2 * constant + other] * moved[other]).sum();
            assert_near(found, fit.pooled.values[constant], 1e-11);
        }
    }

    #[test]
    fn the_covariance_is_what_correlated_noise_of_the_rows_makes() {
        let rows = rows(60, |_| [1.0, 0.0], 0.0);
        let problem = model().problem(&rows, &rows.rhs, 0.0, None);
        let fit =
            staged(|stages| Fit::new(&problem, None, white(1.0), Instructions::Scalar, stages)).expect("constants");
        let columns: Vec<_> = (0..2).map(|one| fit.influence(&problem, &(0..1), &fit.pooled.weights, one)).collect();
        let covariance = RowCovariance::by_distance(vec![1.0, 0.4, -0.2]);
        let found = sandwich(&columns, &fit.pooled.inverse, &covariance);
        // Row by row: what each moves the constants by, times the covariance of two rows.
        let weight = |constant: usize, row: usize| -> f64 {
            (0..2).map(|other| fit.pooled.inverse[2 * constant + other] * columns[other][row]).sum()
        };
        for (one, other) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let mut expected = 0.0;
            for i in 0..60_usize {
                for j in 0..60_usize {
                    let lag = covariance.lags.get(i.abs_diff(j)).copied().unwrap_or(0.0);
                    expected += weight(one, i) * lag * weight(other, j);
                }
            }
            assert_near(found[2 * one + other], expected, 1e-12);
        }
        let independent = sandwich(&columns, &fit.pooled.inverse, &RowCovariance::white());
        for (found, expected) in independent.iter().zip(&fit.pooled.inverse) {
            assert_near(*found, *expected, 1e-12);
        }
    }

    #[test]
    fn what_depends_on_constants_inherits_their_covariance() {
        // Two windowed unknowns and two constants: x = own - S β.
        let own = [[2.0, 0.5], [0.5, 1.0]];
        let between = [[4.0, 1.0], [1.0, 3.0]];
        let sensitive = [[0.3, -1.0], [2.0, 0.7]];
        let joint = |one, other| {
            joint_covariance([one, other], [2, 2], |i, j| own[i][j], |i, j| sensitive[i][j], |i, j| between[i][j])
        };
        let passed =
            |one: usize, constant: usize| -> f64 { (0..2).map(|k| sensitive[one][k] * between[k][constant]).sum() };
        for one in 0..2 {
            for other in 0..2 {
                assert_eq!(joint(2 + one, 2 + other), between[one][other]);
                assert_near(joint(one, 2 + other), passed(one, other), 1e-15);
                assert_near(joint(2 + other, one), passed(one, other), 1e-15);
                let both: f64 = (0..2).map(|k| passed(one, k) * sensitive[other][k]).sum();
                assert_near(joint(one, other), own[one][other] + both, 1e-15);
            }
        }
        assert_eq!(random(1, 3), random(1, 3));
    }
}
