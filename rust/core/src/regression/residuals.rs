//! Residuals of a fit, row by row.

use crate::error::Error;
use crate::exec::stages::Stages;
use crate::regression::fit::Fit;
use crate::regression::predictor::{Predictor, without_constants};
use crate::regression::problem::Problem;
use crate::regression::solved::is_determined;

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
