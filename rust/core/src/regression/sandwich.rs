//! Covariance of the constant unknowns where the noise of rows is correlated: the sandwich estimator.

use std::ops::Range;

use crate::regression::problem::Problem;
use crate::regression::row_covariance::RowCovariance;
use crate::regression::solved::Solved;

/// The influence of every row within some windows on a constant: a column of `X̃`, so that the constants are `N⁻¹ X̃ᵀ b`.
///
/// `step` and `span` are the rows from one window to the next and the rows of a window, `centre` where each is solved.
pub(crate) fn influence(
    problem: &Problem<'_>,
    (full, windows): (&Solved, Range<usize>),
    weights: &[f64],
    [step, span]: [usize; 2],
    centre: impl Fn(usize) -> f64,
    constant: usize,
) -> Vec<f64> {
    let layout = problem.layout;
    let (fields, q) = (full.fields, layout.windowed);
    let (rows, blocks) = (problem.rows(), span / step);
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
    column
}

/// Covariance of the constants, row by row: `N⁻¹ X̃ᵀ Γ X̃ N⁻¹`.
pub(crate) fn sandwich(influence: &[Vec<f64>], inverse: &[f64], covariance: &RowCovariance) -> Vec<f64> {
    let middle = (0..influence.len()).flat_map(|constant| products(influence, constant, covariance));
    between(&middle.collect::<Vec<_>>(), inverse, influence.len())
}

/// A row of `X̃ᵀ Γ X̃`, for one constant.
pub(crate) fn products(influence: &[Vec<f64>], constant: usize, covariance: &RowCovariance) -> Vec<f64> {
    let noisy = covariance.times(&influence[constant]);
    influence.iter().map(|other| other.iter().zip(&noisy).map(|(a, b)| a * b).sum()).collect()
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
