//! Residuals of a fit, row by row.

use crate::error::Error;
use crate::exec::stages::Stages;
use crate::noise::median::{MEDIAN_OF_SQUARES, median};
use crate::regression::fit::Fit;
use crate::regression::predictor::{Predictor, without_constants};
use crate::regression::problem::Problem;
use crate::regression::solved::is_determined;

/// The variance of the usual one of some rows, whatever a few of them are like; nothing without rows.
pub(crate) fn usual_variance(left: &[f64], rows: &[bool]) -> Option<f64> {
    let mut squares: Vec<f64> = left.iter().zip(rows).filter(|(_, row)| **row).map(|(left, _)| left * left).collect();
    median(&mut squares).map(|square| square / MEDIAN_OF_SQUARES)
}

/// The residual of every row and whether the fit determines it; zero where it does not.
pub(crate) fn residuals(
    problem: &Problem<'_>,
    fit: &Fit,
    stages: &mut Stages<'_, '_>,
) -> Result<(Vec<f64>, Vec<bool>), Error> {
    let mut left = without_constants(problem, &fit.pooled.values);
    let windowed = problem.layout.windowed > 0;
    if windowed {
        let predictor = Predictor::new(&fit.full, &fit.pooled.values);
        stages.fill([&mut left], |rows, columns| {
            for (row, left) in rows.zip(&mut *columns[0]).filter(|(row, _)| problem.usable[*row]) {
                let place = fit.nearest(row);
                let later = (row as f64 - fit.centre(place)) * problem.period;
                let determined = is_determined(&fit.full, place);
                *left = if determined { *left - predictor.predict(problem, place, row, later) } else { 0.0 };
            }
        })?;
    }
    let says = |(row, usable): (usize, &bool)| *usable && (!windowed || is_determined(&fit.full, fit.nearest(row)));
    let usable = problem.usable.iter().enumerate().map(says).collect();
    Ok((left, usable))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::simulated::{model, rows, staged, white};
    use crate::simd::instructions::Instructions;

    #[test]
    fn nothing_is_left_of_rows_that_follow_lines_and_all_of_the_noise_of_others() {
        for deviation in [0.0, 0.1] {
            let mut rows = rows(600, |time| [1.0 + 0.01 * time, 0.01], deviation);
            rows.exclude([0, 30, 31].into_iter());
            let problem = model().problem(&rows, &rows.rhs, 0.0, None);
            let fit = Fit::in_rows(&problem, 80, white(0.01), Instructions::Scalar).expect("constants");
            let (left, usable) = staged(|stages| residuals(&problem, &fit, stages));
            assert_eq!(usable, rows.usable);
            assert!((0..600).filter(|&row| !usable[row]).all(|row| left[row] == 0.0));
            let mean = left.iter().map(|left| left * left).sum::<f64>() / 597.0;
            // Two unknowns in 80 rows; squares of even noise scatter by √0.8.
            let (expected, scatter) =
                (deviation * deviation * 78.0 / 80.0, deviation * deviation * (0.8_f64 / 597.0).sqrt());
            assert!((mean - expected).abs() <= 4.0 * scatter + 1e-20, "{mean}");
        }
    }

    #[test]
    fn rows_whose_window_holds_too_few_equations_say_nothing() {
        let mut rows = rows(400, |_| [1.0, 0.0], 0.1);
        rows.exclude((100..200).filter(|row| row % 40 != 0));
        let problem = model().problem(&rows, &rows.rhs, 0.0, None);
        let fit = Fit::in_rows(&problem, 40, white(0.01), Instructions::Scalar).expect("constants");
        let (left, usable) = staged(|stages| residuals(&problem, &fit, stages));
        assert!(!usable[160] && left[160] == 0.0);
        assert!(usable[20] && usable[380]);
    }
}
