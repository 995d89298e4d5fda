//! Torques that are late: each with its own rate as one more constant, beside everything that was estimated.

use std::sync::Arc;

use crate::equation::motion::Coefficient;
use crate::equation::rows::Regressor;
use crate::error::Error;
use crate::identify::merged::decided::MergedFit;
use crate::identify::merged::session::MergedSession;
use crate::identify::merged::shown::NoiseOfRows;
use crate::inference::missing_terms::{JudgedTerm, Missing, Suspect};
use crate::regression::problem::Correlated;
use crate::weak_form::weak_rows::{Record, TermSamples, WeakRows};

impl MergedSession<'_, '_, '_> {
    /// By how many samples the torque of every equation seems to be late.
    pub(crate) fn late_torques(
        &mut self,
        fitted: &MergedFit,
        noise: &NoiseOfRows,
        correlated: &Arc<Correlated>,
    ) -> Result<Vec<(usize, Suspect)>, Error> {
        if self.merged.trials.iter().any(|trial| trial.position.is_some()) {
            return Ok(Vec::new());
        }
        let equations: Vec<usize> = (0..self.merged.equations()).filter(|&one| !self.is_silent(one)).collect();
        let first = self.all.rows.regressors.len();
        for &equation in &equations {
            let rate = self.rate_of_torque(equation)?;
            self.all.rows.regressors.push(rate);
        }
        let rows = &self.all.rows;
        let judged = JudgedTerm {
            rows,
            model: &fitted.model,
            rhs: &rows.rhs,
            noise: 1.0,
            fit: &fitted.fit,
            covariance: &noise.covariance,
            correlated,
            expected: noise.expected,
            inflation: noise.inflation,
            instructions: self.options.instructions,
        };
        let rates: Vec<usize> = (first..rows.regressors.len()).collect();
        let factors = judged.factors(&rates, &mut self.stages);
        self.all.rows.regressors.truncate(first);
        let samples = 1.0 / self.options.delta;
        let late = factors?.unwrap_or_default().into_iter().zip(equations).map(|((value, error), equation)| {
            (equation, Suspect { missing: Missing::Lag, value: -samples * value, error: samples * error })
        });
        Ok(late.collect())
    }

    /// The rate of the torque of an equation, in its rows.
    fn rate_of_torque(&mut self, equation: usize) -> Result<Regressor, Error> {
        let (rows, equations, group) = (self.all.rows.len(), self.merged.equations(), self.all.group);
        let (function, delta, workers) = (self.all.function, self.options.delta, self.stages.workers);
        let mut value = vec![0.0; rows];
        for (number, trial) in self.merged.trials.iter().enumerate() {
            let record = Record {
                angle: trial.angles[equation.min(trial.angles.len() - 1)],
                torque: trial.torques[equation],
                noise: None,
                coefficients: [Coefficient::Unknown; 3],
                constant: [true; 3],
                terms: vec![TermSamples::TorqueRate],
                constant_terms: true,
                lag: 0.0,
                angle_zero: 0.0,
                mask: trial.mask,
                weights: trial.weights,
            };
            let weak = self.stages.stage(|watch| WeakRows::build(&record, function, delta, None, workers, watch))?;
            let weight = self.weights.equations[equation];
            for (time, rate) in weak.rows.regressors[3].value.iter().enumerate() {
                let row = time * group + number * equations + equation;
                if row < rows && self.all.rows.usable[row] {
                    value[row] = weight * rate;
                }
            }
        }
        // The noise of angles does not enter.
        let noise = self.all.rows.regressors[0].noise.each_ref().map(|kernel| vec![0.0; kernel.len()]);
        Ok(Regressor { companion: vec![0.0; rows], value, noise })
    }
}
