//! Torques that are late, and what else moves, such as a base: each with its own rate as one more constant, beside everything that was
//! estimated.

use std::sync::Arc;

use crate::equation::motion::Coefficient;
use crate::equation::rows::Regressor;
use crate::error::Error;
use crate::identify::merged::decided::MergedFit;
use crate::identify::merged::session::MergedSession;
use crate::identify::merged::shown::NoiseOfRows;
use crate::identify::merged::system::{Entry, Multiplied};
use crate::inference::missing_terms::{JudgedTerm, Missing, Suspect};
use crate::regression::problem::Correlated;
use crate::weak_form::weak_rows::{Record, TermSamples, WeakRows};

/// A lag of an angle, in samples, up to which it is none: windows that are too long for what they follow leave as much.
const LEAST_LAG: f64 = 0.05;

impl MergedSession<'_, '_, '_> {
    /// By how many samples the torque of every equation seems to be late, and every angle that no equation is of: angles before torques.
    pub(crate) fn late_channels(
        &mut self,
        fitted: &MergedFit,
        noise: &NoiseOfRows,
        correlated: &Arc<Correlated>,
    ) -> Result<Vec<(usize, Suspect)>, Error> {
        if self.merged.trials.iter().any(|trial| trial.position.is_some()) {
            return Ok(Vec::new());
        }
        let equations: Vec<usize> = (0..self.merged.equations()).filter(|&one| !self.is_silent(one)).collect();
        let angles: Vec<usize> =
            (self.merged.equations()..self.merged.channels()).filter(|&one| self.pulls_springs(one)).collect();
        let first = self.all.rows.regressors.len();
        for &equation in &equations {
            let rate = self.rate_of_torque(equation)?;
            self.all.rows.regressors.push(rate);
        }
        for &angle in &angles {
            let rate = self.rate_of_angle(angle);
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
        // A torque stands on the other side of the equation.
        let of_torques = equations.into_iter().map(|equation| (self.merged.channels() + equation, -samples));
        let channels = of_torques.chain(angles.into_iter().map(|angle| (angle, samples)));
        let late =
            factors?.unwrap_or_default().into_iter().zip(channels).map(|((value, error), (channel, samples))| {
                (channel, Suspect { missing: Missing::Lag, value: samples * value, error: samples.abs() * error })
            });
        let torques = self.merged.channels();
        Ok(late.filter(|(channel, late)| *channel >= torques || late.value.abs() > LEAST_LAG).collect())
    }

    /// What an angle is multiplied with: elements, where they appear, and their values about.
    fn entries_of(&self, angle: usize) -> impl Iterator<Item = (Entry, usize, f64)> {
        let each = self.merged.elements.iter().zip(&self.parameters);
        each.flat_map(move |(element, &value)| {
            element.entries.iter().filter(move |_| value != 0.0).filter_map(move |entry| match entry.of {
                Multiplied::Motion { channel, coefficient } if channel == angle => Some((*entry, coefficient, value)),
                _ => None,
            })
        })
    }

    /// Whether an angle enters through springs, beside which dampers may lie, and accelerates no mass.
    fn pulls_springs(&self, angle: usize) -> bool {
        let coefficients: Vec<usize> = self.entries_of(angle).map(|(_, coefficient, _)| coefficient).collect();
        coefficients.contains(&2) && !coefficients.contains(&0)
    }

    /// What an angle adds to the equations with its rate in its place.
    fn rate_of_angle(&self, angle: usize) -> Regressor {
        let rows = &self.all.rows;
        let (equations, group, length) = (self.merged.equations(), self.all.group, self.all.kernels.values[0].len());
        let mut value = vec![0.0; rows.len()];
        let mut noise = rows.regressors[0].noise.each_ref().map(|kernel| vec![0.0; kernel.len()]);
        let share = 1.0 / (equations as f64).sqrt();
        for (Entry { equation, factor, .. }, coefficient, parameter) in self.entries_of(angle) {
            let factor = self.weights.equations[equation] * factor * parameter;
            let rate = Multiplied::Motion { channel: angle, coefficient: coefficient - 1 };
            for (number, trial) in self.trials.iter().enumerate() {
                let inner = number * equations + equation;
                for (time, rate) in trial.regressor(rate).value.iter().enumerate() {
                    let row = time * group + inner;
                    if row < rows.len() && rows.usable[row] {
                        value[row] += factor * rate;
                    }
                }
            }
            let first = (equation * self.weights.angles.len() + angle) * length;
            for (noise, columns) in noise.iter_mut().zip(&self.weights.angles[angle]) {
                let column = &columns[coefficient - 1];
                noise[first..first + length].iter_mut().zip(column).for_each(|(sum, k)| *sum += share * factor * k);
            }
        }
        Regressor { companion: vec![0.0; rows.len()], value, noise }
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
