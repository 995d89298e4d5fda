//! What all trials share of a windowed element, and by how much it is wrong.
//!
//! Where windows follow too slowly, or the test function is wider than what changes, the same is left in all trials: along the element's column at one time,
//! more than across it. Noise leaves as much along as across, and trials that differ leave nothing along.

use crate::identify::merged::decided::MergedFit;
use crate::identify::merged::session::MergedSession;
use crate::inference::window_averaging::Averages;
use crate::noise::median::median;
use crate::regression::block_products::dot;
use crate::regression::predictor::without_constants;

/// Standard deviations beyond which more is left along than chance leaves.
const NO_CHANCE: f64 = 3.3;

/// What the noise of the angles makes of products in a row: of two columns, and of a column with the torque.
pub(crate) struct NoiseInProducts {
    pub(crate) columns: Vec<Vec<f64>>,
    pub(crate) torque: Vec<f64>,
}

/// What is left of every row beside the constants and the windowed elements, and the squared errors that these have in all trials.
pub(crate) struct LeftShared {
    pub(crate) left: Vec<f64>,
    pub(crate) errors: Vec<f64>,
}

/// Means over times and equations of squares that are left.
struct LeftAlong {
    along: f64,
    across: f64,
    /// Of an element's column, summed over the rows of a time.
    column: f64,
    times: f64,
}

impl MergedSession<'_, '_, '_> {
    pub(crate) fn noise_in_products(&self, elements: &[usize]) -> NoiseInProducts {
        let rows = &self.all.rows;
        let entering = |element: usize| &rows.regressors[element].noise[0];
        NoiseInProducts {
            columns: elements
                .iter()
                .map(|&one| elements.iter().map(|&other| dot(entering(one), entering(other))).collect())
                .collect(),
            torque: elements.iter().map(|&one| dot(entering(one), &rows.rhs_noise)).collect(),
        }
    }

    pub(crate) fn left_shared(&self, fitted: &MergedFit, averages: &Averages) -> LeftShared {
        let left = self.left_beside(fitted, averages);
        LeftShared { errors: self.shared_errors(fitted, averages, &left), left }
    }

    /// What is left of every row beside the constants and the windowed elements; not a number where these are not known.
    fn left_beside(&self, fitted: &MergedFit, averages: &Averages) -> Vec<f64> {
        let (model, rows) = (&fitted.model, &self.all.rows);
        let problem = model.problem(rows, &rows.rhs, 1.0, None);
        let mut left = without_constants(&problem, &fitted.fit.pooled.values);
        for (&one, (track, slope)) in model.windowed.iter().zip(averages.values.iter().zip(&averages.slopes)) {
            let regressor = &rows.regressors[one];
            for (row, left) in left.iter_mut().enumerate() {
                *left -= track[row] * regressor.value[row] + slope[row] * regressor.companion[row];
            }
        }
        left
    }

    /// The mean squared error that windowed elements have in all trials, beyond that of noise, as what is left shows it; zero where it may be chance.
    fn shared_errors(&self, fitted: &MergedFit, averages: &Averages, left: &[f64]) -> Vec<f64> {
        let of = |(&element, errors): (&usize, &Vec<f64>)| {
            let Some(LeftAlong { along, across, column, times }) = self.left_along(element, left) else { return 0.0 };
            // What is followed of the noise is along, too, and that much less is left of it there.
            let own =
                median(&mut errors.iter().map(|error| error * error).filter(|one| one.is_finite()).collect::<Vec<_>>());
            let beyond = along - across + own.unwrap_or(0.0) * column;
            let chance = NO_CHANCE * (2.0 * fitted.expected.variance_inflation / times).sqrt() * across;
            if beyond > chance { beyond / column } else { 0.0 }
        };
        fitted.model.windowed.iter().zip(&averages.errors).map(of).collect()
    }

    /// What is left of the rows of one time along a windowed element, over what is left across it: the largest of all elements, zero where there are no
    /// trials to compare.
    pub(crate) fn left_in_common(&self, fitted: &MergedFit, left: &[f64]) -> f64 {
        let ratio = |&element: &usize| self.left_along(element, left).map_or(0.0, |left| left.along / left.across);
        fitted.model.windowed.iter().map(ratio).fold(0.0, f64::max)
    }

    /// What is left along the column of an element and across it; `None` without trials to compare.
    fn left_along(&self, element: usize, left: &[f64]) -> Option<LeftAlong> {
        if self.merged.trials.len() < 2 {
            return None;
        }
        let rows = &self.all.rows;
        let value = &rows.regressors[element].value;
        let (mut along, mut across, mut column, mut times, mut others) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for first in (0..rows.len()).step_by(self.all.group) {
            let all = first..(first + self.all.group).min(rows.len());
            let used = || all.clone().filter(|&row| rows.usable[row] && left[row].is_finite());
            let squares: f64 = used().map(|row| value[row].powi(2)).sum();
            let count = used().count();
            if count < 2 || squares <= 0.0 {
                continue;
            }
            let common = used().map(|row| value[row] * left[row]).sum::<f64>().powi(2) / squares;
            across += used().map(|row| left[row].powi(2)).sum::<f64>() - common;
            (along, column) = (along + common, column + squares);
            (times, others) = (times + 1.0, others + (count - 1) as f64);
        }
        let found = LeftAlong { along: along / times, across: across / others, column: column / times, times };
        Some(found).filter(|found| found.across > 0.0)
    }
}
