//! Cross-validation of window lengths: how well each predicts rows that it does not contain.

use crate::error::Error;
use crate::exec::stages::Stages;
use crate::regression::constants::Expected;
use crate::regression::fit::Fit;
use crate::regression::predictor::{Predictor, without_constants};
use crate::regression::problem::Problem;
use crate::regression::window_length::Scale;
use crate::simd::instructions::Instructions;

/// Squared errors over the noise variance are clipped to this, so that single rows do not dominate.
const MOST: f64 = 9.0;

/// A fit in windows of one length and its cross-validation error.
#[derive(Clone, Debug)]
pub(crate) struct Validated {
    pub(crate) fit: Fit,
    /// Mean squared error of the rows over the noise's variance.
    pub(crate) error: f64,
}

/// Fits a problem in windows of every length and returns their cross-validation errors, in the order of the lengths.
/// Lengths whose constants are not determined are left out.
pub(crate) fn validate(
    problem: &Problem<'_>,
    scales: &[Scale],
    expected: Expected,
    instructions: Instructions,
    stages: &mut Stages<'_, '_>,
) -> Result<Vec<Validated>, Error> {
    let rows = problem.rows();
    let inside = problem.inside();
    // The same rows for all lengths, so that they are compared on equal terms.
    let start =
        scales.iter().map(|scale| scale.full_rows(rows).start).max().unwrap_or(0).min(inside.start + inside.len() / 4);
    let end = scales
        .iter()
        .map(|scale| scale.full_rows(rows).end)
        .min()
        .unwrap_or(rows)
        .max(inside.start + 3 * inside.len() / 4);
    let mut validated = Vec::new();
    for &scale in scales {
        if let Some(fit) = Fit::with_leave_gap_out(problem, scale, expected, instructions, stages)? {
            let error = error(problem, scale, &fit, start..end, expected.variance);
            validated.push(Validated { fit, error });
        }
    }
    Ok(validated)
}

/// The fit with the smallest error, or `None` if none predicts any row.
pub(crate) fn best(validated: &[Validated]) -> Option<&Validated> {
    validated.iter().filter(|one| one.error.is_finite()).min_by(|a, b| a.error.total_cmp(&b.error))
}

/// Mean squared error, over the noise's variance, of predicting rows from the windows on both sides of them.
pub(crate) fn error(
    problem: &Problem<'_>,
    scale: Scale,
    fit: &Fit,
    rows: std::ops::Range<usize>,
    variance: f64,
) -> f64 {
    let Some(leave_gap_out) = &fit.leave_gap_out else { return f64::NAN };
    let rhs = without_constants(problem, &fit.pooled.values);
    let predictor = Predictor::new(leave_gap_out, &fit.pooled.values);
    let (mut sum, mut count) = (0.0, 0.0);
    for row in rows.filter(|&row| problem.usable[row]) {
        let cell = scale.cell(row);
        let Some(place) = predictor.place(cell) else { continue };
        let later = (row as f64 - scale.centres(cell)[1]) * problem.period;
        let error = rhs[row] - predictor.predict(problem, place, row, later);
        sum += (error * error / variance).min(MOST);
        count += 1.0;
    }
    if count > 0.0 { sum / count } else { f64::INFINITY }
}
