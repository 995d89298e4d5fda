//! A single window, projected directly: for the ends of a record and for the values of the criterion.

use crate::local_polynomials::basis::Basis;
use crate::local_polynomials::sliding_projection::ROUNDING;
use crate::record::samples::is_usable;

/// The projection of one window.
#[derive(Clone, Debug)]
pub(crate) struct Window {
    /// The sample at the centre, which was subtracted from all samples.
    pub(crate) reference: f64,
    /// Projections on the orthonormal polynomials.
    pub(crate) coefficients: Vec<f64>,
    /// Residual sum of squares of every order.
    pub(crate) residuals: Vec<f64>,
    /// The floor of the residuals, from rounding or quantisation.
    pub(crate) floor: f64,
}

impl Window {
    /// Projects a window, or returns `None` if it holds an unusable sample. Residuals are at least `floor`.
    pub(crate) fn project(basis: &Basis, samples: &[f64], floor: f64) -> Option<Self> {
        if !samples.iter().all(|&value| is_usable(value)) {
            return None;
        }
        let (length, degrees) = (basis.length(), basis.degrees());
        let reference = samples[length / 2];
        let odd = length % 2;
        let mirrored = |row: usize| {
            (samples[length / 2 + row] - reference, samples[(length - odd) / 2 + odd - 1 - row] - reference)
        };
        let mut coefficients = vec![0.0; degrees];
        for (row, q) in basis.rows().enumerate() {
            let (right, left) = mirrored(row);
            let parts = if odd == 1 && row == 0 { [right, 0.0] } else { [right + left, right - left] };
            for (j, (coefficient, value)) in coefficients.iter_mut().zip(q).enumerate() {
                *coefficient += value * parts[j % 2];
            }
        }
        let (mut residual, mut energy) = (0.0, 0.0);
        for (row, q) in basis.rows().enumerate() {
            let (right, left) = mirrored(row);
            let mut parts = [0.0; 2];
            for (j, (coefficient, value)) in coefficients.iter().zip(q).enumerate() {
                parts[j % 2] += coefficient * value;
            }
            residual += (right - parts[0] - parts[1]).powi(2);
            energy += right * right;
            if odd == 0 || row > 0 {
                residual += (left - parts[0] + parts[1]).powi(2);
                energy += left * left;
            }
        }
        let mut residuals = vec![residual; degrees];
        for order in (0..degrees - 1).rev() {
            residuals[order] = residuals[order + 1] + coefficients[order + 1].powi(2);
        }
        Some(Self { reference, coefficients, residuals, floor: floor.max(ROUNDING * energy) })
    }

    /// The order whose residual, multiplied by its weight, is the smallest; the lowest of several.
    pub(crate) fn best(&self, weights: &[f64]) -> usize {
        let score = |order: usize| self.residuals[order].max(self.floor) * weights[order];
        (0..self.residuals.len()).fold(0, |best, order| if score(order) < score(best) { order } else { best })
    }
}
