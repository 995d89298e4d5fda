//! How much trials differ from what they are taken to share.
//!
//! What is left of the rows of one trial is regressed on the columns of its elements: by so much the elements of that trial differ from
//! those of all. Windowed elements differ by one number each, the same at all times.

use faer::Mat;
use faer::linalg::solvers::{DenseSolveCore, Llt};

use crate::identify::merged::decided::MergedFit;
use crate::identify::merged::session::MergedSession;
use crate::identify::merged::shown::NoiseOfRows;
use crate::regression::predictor::without_constants;
use crate::regression::row_covariance::RowCovariance;

/// Rows of a trial that an element takes at least.
const ROWS_OF_AN_ELEMENT: usize = 4;

impl MergedSession<'_, '_, '_> {
    /// By how much every element of each trial differs from that of all trials, with its standard error: by the element, constants last, then
    /// by trial. Not numbers where a trial does not tell.
    pub(crate) fn spread(&self, fitted: &MergedFit, tracks: &[Vec<f64>], noise: &NoiseOfRows) -> Vec<Vec<(f64, f64)>> {
        let (trials, equations, group) = (self.merged.trials.len(), self.merged.equations(), self.all.group);
        let model = &fitted.model;
        let elements: Vec<usize> = model.windowed.iter().chain(&model.constant).copied().collect();
        let mut spread = vec![vec![(f64::NAN, f64::NAN); trials]; elements.len()];
        if trials < 2 {
            return vec![Vec::new(); elements.len()];
        }
        let rows = &self.all.rows;
        let problem = model.problem(rows, &rows.rhs, 1.0, None);
        let left = without_constants(&problem, &fitted.fit.pooled.values);
        for trial in 0..trials {
            let mine = |row: &usize| row % group / equations == trial && rows.usable[*row];
            let known = |row: &usize| tracks.iter().all(|track| track[*row].is_finite());
            let rows: Vec<usize> = (0..rows.len()).filter(mine).filter(known).collect();
            if rows.len() < ROWS_OF_AN_ELEMENT * elements.len() {
                continue;
            }
            let column = |element: usize| &self.all.rows.regressors[element].value;
            let residual = |row: usize| {
                let windowed = model.windowed.iter().zip(tracks).map(|(&one, track)| track[row] * column(one)[row]);
                left[row] - windowed.sum::<f64>()
            };
            let size = elements.len();
            let scale: Vec<f64> = elements
                .iter()
                .map(|&one| rows.iter().map(|&row| column(one)[row].powi(2)).sum::<f64>().sqrt().max(f64::MIN_POSITIVE))
                .collect();
            let at = |place: usize, row: usize| column(elements[place])[row] / scale[place];
            let normal = Mat::<f64>::from_fn(size, size, |i, j| rows.iter().map(|&row| at(i, row) * at(j, row)).sum());
            let Ok(factor) = Llt::new(normal.as_ref(), faer::Side::Lower) else { continue };
            let inverse = factor.inverse();
            let moments: Vec<f64> =
                (0..size).map(|i| rows.iter().map(|&row| at(i, row) * residual(row)).sum()).collect();
            for (place, spread) in spread.iter_mut().enumerate() {
                let value: f64 = (0..size).map(|i| inverse[(place, i)] * moments[i]).sum();
                // What every row moves the value by, and the covariance of the rows.
                let mut moved = vec![0.0; self.all.rows.len()];
                for &row in &rows {
                    moved[row] = (0..size).map(|i| inverse[(place, i)] * at(i, row)).sum();
                }
                let error = (noise.inflation * quadratic(&moved, &noise.covariance)).max(0.0).sqrt();
                spread[trial] = (value / scale[place], error / scale[place]);
            }
        }
        spread
    }
}

/// A column times the covariance of the rows times the column.
fn quadratic(column: &[f64], covariance: &RowCovariance) -> f64 {
    covariance.times(column).iter().zip(column).map(|(a, b)| a * b).sum()
}
