//! The windowed stiffness row by row, as the regressor of the angle at which the spring is relaxed.

use crate::equation::rows::{Regressor, Rows};
use crate::regression::fit::Fit;
use crate::regression::model::Model;
use crate::regression::predictor::Predictor;

/// The regressor of the stiffness.
pub(crate) const STIFFNESS: usize = 2;

/// What the spring's zero multiplies: in `K (θ - θ₀)` minus the stiffness.
#[derive(Clone, Debug)]
pub(crate) struct SpringColumn {
    /// By row, also where a row is no equation.
    stiffness: Vec<f64>,
}

impl SpringColumn {
    /// The stiffness of the windows nearest to each of so many rows; `None` if none is windowed or no window determines it.
    pub(crate) fn new(model: &Model, fit: &Fit, rows: usize, period: f64) -> Option<Self> {
        let unknown = model.windowed.iter().position(|&one| one == STIFFNESS)?;
        let predictor = Predictor::new(&fit.full, &fit.pooled.values);
        let determined: Vec<usize> =
            (fit.full.first..).take(fit.full.len()).filter_map(|window| predictor.place(window)).collect();
        let first = *determined.first()?;
        // The first determined window that is no earlier than the nearest: both move on with the rows.
        let mut next = 0;
        let mut nearest = |row: usize| {
            let wanted = fit.nearest(row);
            while determined.get(next).is_some_and(|&window| window < wanted) {
                next += 1;
            }
            let around = [next.checked_sub(1), Some(next)].into_iter().flatten();
            let around = around.filter_map(|place| determined.get(place).copied());
            around.min_by_key(|place| place.abs_diff(wanted)).unwrap_or(first)
        };
        let at = |row: usize| {
            let place = nearest(row);
            // Beyond a window its line says nothing.
            let half = fit.span as f64 / 2.0;
            let later = (row as f64 - fit.centre(place)).clamp(-half, half) * period;
            predictor.value(place, unknown, later)
        };
        Some(Self { stiffness: (0..rows).map(at).collect() })
    }

    /// The stiffness, by row.
    pub(crate) fn stiffness(&self) -> &[f64] {
        &self.stiffness
    }

    /// The regressor, in rows of which some are equations.
    pub(crate) fn regressor(&self, rows: &Rows) -> Regressor {
        let value = |(row, stiffness): (usize, &f64)| if rows.usable[row] { -stiffness * rows.root(row) } else { 0.0 };
        let value: Vec<f64> = self.stiffness.iter().enumerate().map(value).collect();
        Regressor { companion: vec![0.0; value.len()], value, noise: Default::default() }
    }
}
