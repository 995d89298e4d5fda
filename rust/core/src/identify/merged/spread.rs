//! How much trials differ from what they are taken to share.
//!
//! What is left of the rows of one trial is regressed on the columns of its elements: by so much the elements of that trial differ from
//! those of all. Windowed elements differ by one number each, the same at all times. What the noise of the angles adds to products of columns, and to those
//! with what is left, is taken off, as in the fit of all trials: it would be a difference of every trial.

use faer::Mat;
use faer::linalg::solvers::{DenseSolveCore, Llt};

use crate::identify::merged::decided::MergedFit;
use crate::identify::merged::session::MergedSession;
use crate::identify::merged::shared::{LeftShared, NoiseInProducts};
use crate::identify::merged::shown::NoiseOfRows;
use crate::inference::window_averaging::Averages;
use crate::regression::block_products::dot;
use crate::regression::row_covariance::RowCovariance;

/// Rows of a trial that an element takes at least.
const ROWS_OF_AN_ELEMENT: usize = 4;

impl MergedSession<'_, '_, '_> {
    /// By how much every element of each trial differs from that of all trials, with its standard error: by the element, constants last, then
    /// by trial. Not numbers where a trial does not tell.
    pub(crate) fn spread(
        &self,
        fitted: &MergedFit,
        averages: &Averages,
        shared: &LeftShared,
        noise: &NoiseOfRows,
    ) -> Vec<Vec<(f64, f64)>> {
        let (trials, equations, group) = (self.merged.trials.len(), self.merged.equations(), self.all.group);
        let (model, tracks) = (&fitted.model, &averages.values);
        let elements: Vec<usize> = model.windowed.iter().chain(&model.constant).copied().collect();
        let mut spread = vec![vec![(f64::NAN, f64::NAN); trials]; elements.len()];
        if trials < 2 {
            return vec![Vec::new(); elements.len()];
        }
        let rows = &self.all.rows;
        let constants = &fitted.fit.pooled.values;
        let covariance = noise.covariance.of_one_record(group, equations);
        // Times and equations of one trial, and where its windows end among these.
        let (own, span) = (rows.len() / group * equations, fitted.fit.span / group * equations);
        let NoiseInProducts { columns: in_columns, torque: in_torque } = self.noise_in_products(&elements);
        for trial in 0..trials {
            let of_trial = |place: usize| place / equations * group + trial * equations + place % equations;
            let known = |row: usize| rows.usable[row] && tracks.iter().all(|track| track[row].is_finite());
            let places: Vec<usize> = (0..own).filter(|&place| known(of_trial(place))).collect();
            let rows: Vec<usize> = places.iter().map(|&place| of_trial(place)).collect();
            if rows.len() < ROWS_OF_AN_ELEMENT * elements.len() {
                continue;
            }
            let column = |element: usize| &self.all.rows.regressors[element].value;
            let size = elements.len();
            let scale: Vec<f64> = elements
                .iter()
                .map(|&one| rows.iter().map(|&row| column(one)[row].powi(2)).sum::<f64>().sqrt().max(f64::MIN_POSITIVE))
                .collect();
            let at = |place: usize, row: usize| column(elements[place])[row] / scale[place];
            let count = rows.len() as f64;
            let normal = Mat::<f64>::from_fn(size, size, |i, j| {
                let sum: f64 = rows.iter().map(|&row| at(i, row) * at(j, row)).sum();
                sum - count * in_columns[i][j] / (scale[i] * scale[j])
            });
            let Ok(factor) = Llt::new(normal.as_ref(), faer::Side::Lower) else { continue };
            let inverse = factor.inverse();
            let mean = |place: usize| match tracks.get(place) {
                Some(track) => rows.iter().map(|&row| track[row]).sum::<f64>() / count,
                None => constants[place - tracks.len()],
            };
            let means: Vec<f64> = (0..size).map(mean).collect();
            let moments: Vec<f64> =
                (0..size).map(|i| rows.iter().map(|&row| at(i, row) * shared.left[row]).sum()).collect();
            let of_noise: Vec<f64> =
                (0..size).map(|i| count * (in_torque[i] - dot(&in_columns[i], &means)) / scale[i]).collect();
            for (place, spread) in spread.iter_mut().enumerate() {
                let solved = |moments: &[f64]| (0..size).map(|i| inverse[(place, i)] * moments[i]).sum::<f64>();
                let noisy = solved(&of_noise);
                let value = solved(&moments) - noisy;
                // What every row moves the value by, and the covariance of the rows.
                let mut moved = vec![0.0; own];
                for (&own, &row) in places.iter().zip(&rows) {
                    moved[own] = (0..size).map(|i| inverse[(place, i)] * at(i, row)).sum();
                }
                let mut variance = noise.inflation * quadratic(&moved, &covariance);
                for (&one, square) in model.windowed.iter().zip(&shared.errors).filter(|(_, square)| **square > 0.0) {
                    let of_rows = moved.iter().enumerate();
                    let moved: Vec<f64> = of_rows.map(|(own, moved)| moved * column(one)[of_trial(own)]).collect();
                    variance += square * over_windows(&moved, span);
                }
                // Weights need not be those of the angles' noise.
                variance += if self.all.rows.roots.is_empty() { 0.0 } else { noisy * noisy };
                spread[trial] = (value / scale[place], variance.max(0.0).sqrt() / scale[place]);
            }
        }
        spread
    }
}

/// The variance of a sum over rows of errors of one, which two rows share as far as windows over them overlap.
fn over_windows(rows: &[f64], span: usize) -> f64 {
    let span = span.clamp(1, rows.len().max(1));
    let (mut window, mut squares) = (0.0, 0.0);
    for row in 0..rows.len() + span {
        window += rows.get(row).copied().unwrap_or(0.0);
        window -= row.checked_sub(span).map_or(0.0, |first| rows[first]);
        squares += window * window;
    }
    squares / span as f64
}

/// A column times the covariance of the rows times the column.
fn quadratic(column: &[f64], covariance: &RowCovariance) -> f64 {
    covariance.times(column).iter().zip(column).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_one_window_add_up_and_those_of_others_do_not() {
        let (count, span): (usize, usize) = (40, 8);
        let shared = |apart: usize| span.saturating_sub(apart) as f64 / span as f64;
        let pairs = (0..count).flat_map(|one| (0..count).map(move |other| shared(one.abs_diff(other))));
        assert!((over_windows(&vec![1.0; count], span) - pairs.sum::<f64>()).abs() < 1e-9);
        assert!((over_windows(&[3.0, 0.0, 0.0, 4.0], 1) - 25.0).abs() < 1e-12);
        assert!(over_windows(&[], 3).abs() < 1e-12);
    }
}
