//! A test of whether a model identified inside a mask holds for the rows outside it.
//!
//! The constants are estimated from the rows outside alone and compared with those from inside, each with its standard error (Chow 1960);
//! if no unknown is windowed, the residuals are compared as well.

use crate::error::Error;
use crate::identify::weak::decided::Decided;
use crate::identify::weak::session::Session;
use crate::inference::slowly_varying;
use crate::regression::constants::Expected;
use crate::regression::fit::Fit;
use crate::regression::limits::NOISE_MODEL_FAILS;
use crate::regression::row_covariance::RowCovariance;
use crate::weak_form::weak_rows::{Record, WeakRows};

/// A constant differs where it does by more than so many standard errors.
const CONSPICUOUS: f64 = 5.0;

/// What the rows outside a mask say.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outside {
    /// Constants that differ from those inside: which unknown, the value outside, and the standard error of the difference.
    pub differing: Vec<(usize, f64, f64)>,
    /// Mean square of the residuals over that inside the mask, or `None` if an unknown is windowed.
    pub left: Option<f64>,
    /// The rows.
    pub(crate) rows: Vec<usize>,
}

impl Outside {
    /// Whether the model fails there.
    #[must_use]
    pub fn fails(&self) -> bool {
        !self.differing.is_empty() || self.left.is_some_and(|left| left > NOISE_MODEL_FAILS)
    }
}

/// What was found inside the mask, and how errors are made.
pub(crate) struct Inside<'a> {
    pub(crate) decided: &'a Decided,
    pub(crate) fit: &'a Fit,
    /// Constants without those that change slowly, and their variances.
    pub(crate) constants: &'a [f64],
    pub(crate) variances: &'a [f64],
    pub(crate) covariance: &'a RowCovariance,
    pub(crate) expected: Expected,
    /// What variances are multiplied by.
    pub(crate) inflation: f64,
}

impl Session<'_, '_, '_> {
    /// Tests the rows outside the mask. Returns `None` if there is no mask, or no row on one side of it.
    pub(crate) fn outside_mask(&mut self, weak: &WeakRows, inside: &Inside<'_>) -> Result<Option<Outside>, Error> {
        if self.record.mask.is_none() {
            return Ok(None);
        }
        let record = Record { mask: None, ..self.record.clone() };
        let (function, delta, workers) = (weak.function, self.options.delta, self.stages.workers);
        let mut rows = self.stages.stage(|watch| WeakRows::build(&record, function, delta, None, workers, watch))?.rows;
        // Rows over a jump are inside all the same.
        let within = &inside.decided.whole.as_ref().unwrap_or(&weak.rows).usable;
        rows.usable.iter_mut().zip(within).for_each(|(usable, inside)| *usable &= !inside);
        rows.jumps.clone_from(&weak.rows.jumps);
        let outside: Vec<usize> = (0..rows.len()).filter(|&row| rows.usable[row]).collect();
        if outside.is_empty() {
            return Ok(None);
        }
        let Inside { decided, fit, constants, variances, covariance, expected, inflation } = *inside;
        if let Some(found) = &decided.found {
            rows.rhs = slowly_varying::without(&rows, &rows.rhs, &decided.slow, &found.varying);
        }
        if let Some(spring) = &decided.spring {
            let regressor = spring.regressor(&rows);
            rows.regressors.push(regressor);
        }
        rows.clear_unusable();
        let rows = decided.as_white(rows, &mut self.stages)?;
        let model = &decided.model;
        let correlated = model.correlated(&rows, covariance, &mut self.stages)?;
        let problem = model.problem(&rows, &rows.rhs, self.noise[0], Some(&correlated));
        let left = model.windowed.is_empty().then(|| {
            let inner = decided.rows(&weak.rows);
            let inner = model.problem(inner, decided.rhs(inner), self.noise[0], None);
            let square = |problem: &crate::regression::problem::Problem<'_>| {
                let count = problem.usable.iter().filter(|usable| **usable).count() as f64;
                let left = crate::regression::predictor::without_constants(problem, constants);
                left.iter().map(|value| value * value).sum::<f64>() / count
            };
            square(&problem) / square(&inner)
        });
        let mut differing = Vec::new();
        if let Some(other) = fit.again(&problem, expected, self.options.instructions, &mut self.stages)? {
            let own = other.covariance(&problem, covariance, &mut self.stages)?;
            let count = model.constant.len();
            for (place, &unknown) in model.constant.iter().enumerate() {
                let value = other.pooled.values[place];
                let error = (inflation * own[place * (count + 1)] + variances[place]).sqrt();
                if (value - constants[place]).abs() > CONSPICUOUS * error {
                    differing.push((unknown, value, error));
                }
            }
        }
        Ok(Some(Outside { differing, left, rows: outside }))
    }
}
