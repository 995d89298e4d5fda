//! Whether the constants are told apart by the motion or only by noise.
//!
//! A motion at a single frequency makes the regressors of inertia and stiffness proportional. Only the noise of the
//! angle is not proportional, so the equations look the better conditioned the noisier the angle is. Therefore the
//! weakest combination of the regressors, after the windowed unknowns are eliminated, is compared with what noise of
//! the known variance would leave of it.

use std::ops::Range;

use crate::equation::rows::Rows;
use crate::error::Error;
use crate::exec::pool::ranges;
use crate::exec::stages::Stages;
use crate::regression::fit::Fit;
use crate::regression::model::Model;
use crate::regression::problem::Problem;
use crate::regression::solved::sensitivity;

/// Remainder below which a combination is mostly noise, in units of what noise alone leaves: at two there is as much signal as noise.
const MOSTLY_NOISE: f64 = 2.0;

/// Whether the weakest combination of constants is mostly noise. It is given by its entries for columns of norm one. `variance` is that
/// of the angle's noise.
pub(crate) fn is_mostly_noise(
    problem: &Problem<'_>,
    rows: &Rows,
    model: &Model,
    fit: &Fit,
    weakest: &[f64],
    variance: f64,
    stages: &mut Stages<'_, '_>,
) -> Result<bool, Error> {
    if variance == 0.0 || weakest.is_empty() {
        return Ok(false);
    }
    let norm = |column: &[f64]| column.iter().map(|value| value * value).sum::<f64>().sqrt();
    let parts: Vec<f64> = weakest.iter().zip(&problem.constants).map(|(part, column)| part / norm(column)).collect();
    let regressors: Vec<usize> = model.constant.iter().chain(&model.windowed).copied().collect();
    let kernel = |index: usize| &rows.regressors[regressors[index]].noise[0];
    let product = |i: usize, j: usize| -> f64 { kernel(i).iter().zip(kernel(j)).map(|(a, b)| a * b).sum() };
    let size = regressors.len();
    let gram: Vec<f64> = (0..size * size).map(|index| product(index / size, index % size)).collect();
    let windowed = model.windowed.len();
    let noise_of = |factors: &[f64]| -> f64 {
        (0..size * size).map(|index| factors[index / size] * factors[index % size] * gram[index]).sum()
    };
    let of = |rows: Range<usize>, (): &mut ()| {
        let (mut left, mut noise) = (0.0, 0.0);
        let mut factors = vec![0.0; size];
        factors[..parts.len()].copy_from_slice(&parts);
        // Constants alone have the same noise in every row.
        let everywhere = noise_of(&factors);
        for row in rows.filter(|&row| problem.usable[row]) {
            if windowed > 0 {
                let place = fit.nearest(row);
                let later = (row as f64 - fit.centre(place)) * problem.period;
                for (unknown, factor) in factors[parts.len()..].iter_mut().enumerate() {
                    *factor = parts
                        .iter()
                        .enumerate()
                        .map(|(c, part)| part * sensitivity(&fit.full, place, unknown, c, later))
                        .sum();
                }
            }
            let constants = parts.iter().zip(&problem.constants).map(|(part, column)| part * column[row]);
            let others =
                factors[parts.len()..].iter().zip(&problem.windowed).map(|(factor, column)| factor * column[row]);
            left += constants.chain(others).sum::<f64>().powi(2);
            noise += if windowed > 0 { noise_of(&factors) } else { everywhere };
        }
        [left, noise]
    };
    let sums = stages.map(ranges(problem.rows()), || (), of)?;
    let [left, noise] = sums.iter().fold([0.0, 0.0], |[a, b], [c, d]| [a + c, b + d]);
    Ok(left < MOSTLY_NOISE * variance * noise)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::constants::weakest;
    use crate::regression::simulated::{model, random, rows, staged, white};
    use crate::simd::instructions::Instructions;

    const ROWS: usize = 600;

    /// Whether two constants whose regressors differ by some signal, and by noise of deviation 0.1 that each has of its own, are told apart
    /// by noise only.
    fn is_noise(signal: f64, variance: f64, windowed: bool) -> bool {
        let mut rows = rows(ROWS, |_| [1.0, 0.0], 0.1);
        let (common, own) = (random(20, ROWS), random(21, ROWS));
        for (index, regressor) in rows.regressors.iter_mut().enumerate().skip(1) {
            let noise = random(30 + index as u64, ROWS);
            let different = if index == 1 { signal } else { -signal };
            regressor.value = (0..ROWS).map(|row| common[row] + different * own[row] + 0.1 * noise[row]).collect();
            let mut kernel = vec![0.0; 3];
            kernel[index] = 0.1;
            regressor.noise = [kernel, vec![0.0; 3]];
        }
        let mut model = model();
        if !windowed {
            (model.windowed, model.linear) = (Vec::new(), false);
        }
        let problem = model.problem(&rows, &rows.rhs, 0.0, None);
        let fit = if windowed {
            Fit::in_rows(&problem, 80, white(0.01), Instructions::Scalar)
        } else {
            staged(|stages| Fit::new(&problem, None, white(0.01), Instructions::Scalar, stages))
        };
        let fit = fit.expect("constants");
        let weakest = weakest(&fit.full, &fit.pooled.weights);
        staged(|stages| is_mostly_noise(&problem, &rows, &model, &fit, &weakest, variance, stages))
    }

    #[test]
    fn what_only_noise_tells_apart_is_mostly_noise() {
        for windowed in [false, true] {
            assert!(is_noise(0.0, 1.0, windowed));
            // As much signal as noise is where the line is drawn.
            assert!(is_noise(0.06, 1.0, windowed));
            assert!(!is_noise(0.15, 1.0, windowed));
            assert!(!is_noise(1.0, 1.0, windowed));
        }
    }

    #[test]
    fn without_noise_nothing_is() {
        assert!(!is_noise(0.0, 0.0, false));
        // Noise that is said to be a tenth of what there is leaves nine tenths to be explained.
        assert!(!is_noise(0.0, 0.1, false));
    }
}
