//! Torques that are late, and what else moves, such as a base: each with its own rate as one more constant, beside everything that was
//! estimated, and what else moves with itself as another, since its gain may be wrong.

use std::sync::Arc;

use crate::equation::motion::Coefficient;
use crate::equation::rows::Regressor;
use crate::error::Error;
use crate::identify::merged::decided::MergedFit;
use crate::identify::merged::session::MergedSession;
use crate::identify::merged::shown::NoiseOfRows;
use crate::identify::merged::system::{Entry, Multiplied};
use crate::inference::missing_terms::{Missing, Suspect};
use crate::regression::fit::Fit;
use crate::regression::model::Model;
use crate::regression::problem::Correlated;
use crate::weak_form::weak_rows::{Record, TermSamples, WeakRows};

/// A lag of an angle, in samples, up to which it is none: windows that are too long for what they follow leave as much.
const LEAST_LAG: f64 = 0.05;
/// A part that such an angle lacks up to which it lacks none.
const LEAST_GAIN: f64 = 0.005;
/// So many standard errors, and such a part of itself, an element changes beside a channel that is suspected to be another one.
const OTHER_BY: f64 = 2.0;
const OTHER: f64 = 0.02;

/// Channels that are suspected.
#[derive(Default)]
pub(crate) struct SuspectedChannels {
    pub(crate) each: Vec<(usize, Suspect)>,
    /// The fit beside those that are conspicuous, if any.
    pub(crate) beside: Option<Fit>,
}

impl MergedSession<'_, '_, '_> {
    /// By how many samples the torque of every equation seems to be late, and every angle that no equation is of, and the part of itself that such an angle
    /// seems to lack: angles before torques.
    pub(crate) fn suspected_channels(
        &mut self,
        fitted: &MergedFit,
        noise: &NoiseOfRows,
        correlated: &Arc<Correlated>,
    ) -> Result<SuspectedChannels, Error> {
        if self.merged.trials.iter().any(|trial| trial.position.is_some()) {
            return Ok(SuspectedChannels::default());
        }
        let equations: Vec<usize> = (0..self.merged.equations()).filter(|&one| !self.is_silent(one)).collect();
        let angles: Vec<usize> =
            (self.merged.equations()..self.merged.channels()).filter(|&one| self.pulls_springs(one)).collect();
        let first = self.all.rows.regressors.len();
        for &equation in &equations {
            let rate = self.column_of(equation, &vec![TermSamples::TorqueRate; self.merged.trials.len()])?;
            self.all.rows.regressors.push(rate);
        }
        for derivative in [1, 0] {
            for &angle in &angles {
                let rate = self.derivative_of_angle(angle, derivative);
                self.all.rows.regressors.push(rate);
            }
        }
        let rows = &self.all.rows;
        let judged = noise.judged(rows, fitted, correlated, self.options.instructions);
        let each: Vec<usize> = (first..rows.regressors.len()).collect();
        let factors = match judged.factors(&each, &mut self.stages) {
            // Rates alone may be determined.
            Ok(None) => judged.factors(&each[..equations.len() + angles.len()], &mut self.stages),
            found => found,
        };
        let (samples, torques) = (1.0 / self.options.delta, self.merged.channels());
        // A torque stands on the other side of the equation.
        let of_torques = equations.into_iter().map(|equation| (torques + equation, Missing::Lag, -samples));
        let late = angles.iter().map(|&angle| (angle, Missing::Lag, samples));
        let lacking = angles.iter().map(|&angle| (angle, Missing::Gain, 1.0));
        let channels = of_torques.chain(late).chain(lacking);
        let found = factors?.unwrap_or_default().into_iter().zip(channels);
        let found = found.map(|((value, error), (channel, missing, unit))| {
            (channel, Suspect { missing, value: unit * value, error: unit.abs() * error })
        });
        let is_told = |(_, (channel, suspect)): &(usize, (usize, Suspect))| {
            let least = if suspect.missing == Missing::Gain { LEAST_GAIN } else { LEAST_LAG };
            *channel >= torques || suspect.value.abs() > least
        };
        let told: Vec<(usize, (usize, Suspect))> = each.into_iter().zip(found).filter(is_told).collect();
        let conspicuous = told.iter().filter(|(_, (_, suspect))| suspect.is_conspicuous());
        let conspicuous: Vec<usize> = conspicuous.map(|(column, _)| *column).collect();
        let beside = judged.beside(&conspicuous, &mut self.stages)?.map(|(_, fit)| fit);
        self.all.rows.regressors.truncate(first);
        Ok(SuspectedChannels { each: told.into_iter().map(|(_, one)| one).collect(), beside })
    }

    /// Whether coefficients are others in a fit beside channels that are suspected: by more than the errors of windowed ones, by row, and the covariance
    /// of constants allow.
    pub(crate) fn are_others(&self, fitted: &MergedFit, beside: &Fit, errors: &[Vec<f64>], covariance: &[f64]) -> bool {
        let Model { windowed, constant, .. } = &fitted.model;
        let mean = |errors: &Vec<f64>| {
            let there = errors.iter().filter(|error| error.is_finite());
            let (sum, count) = there.fold((0.0, 0.0), |(sum, count), error| (sum + error, count + 1.0));
            sum / count
        };
        let of_windowed =
            (0..windowed.len()).map(|one| [fitted.fit.median(one), beside.median(one), mean(&errors[one])]);
        let of_constants = (0..constant.len()).map(|one| {
            let error = covariance[one * (constant.len() + 1)].max(0.0).sqrt();
            [fitted.fit.pooled.values[one], beside.pooled.values[one], error]
        });
        let each = windowed.iter().chain(constant).zip(of_windowed.chain(of_constants));
        let is_other = |(&element, [one, other, error]): (&usize, [f64; 3])| {
            let change = (other - one).abs();
            self.merged.elements[element].is_of_motion() && change > OTHER_BY * error && change > OTHER * one.abs()
        };
        each.into_iter().any(is_other)
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

    /// What an angle adds to the equations with a derivative of it in its place: 0 itself, 1 its rate.
    fn derivative_of_angle(&self, angle: usize, derivative: usize) -> Regressor {
        let rows = &self.all.rows;
        let (equations, group, length) = (self.merged.equations(), self.all.group, self.all.kernels.values[0].len());
        let mut value = vec![0.0; rows.len()];
        let mut noise = rows.regressors[0].noise.each_ref().map(|kernel| vec![0.0; kernel.len()]);
        let share = 1.0 / (equations as f64).sqrt();
        for (Entry { equation, factor, .. }, coefficient, parameter) in self.entries_of(angle) {
            let factor = self.weights.equations[equation] * factor * parameter;
            let derived = Multiplied::Motion { channel: angle, coefficient: coefficient - derivative };
            for (number, trial) in self.trials.iter().enumerate() {
                let inner = number * equations + equation;
                for (time, derived) in trial.regressor(derived).value.iter().enumerate() {
                    let row = time * group + inner;
                    if row < rows.len() && rows.usable[row] {
                        value[row] += factor * derived;
                    }
                }
            }
            let first = (equation * self.weights.angles.len() + angle) * length;
            for (noise, columns) in noise.iter_mut().zip(&self.weights.angles[angle]) {
                let column = &columns[coefficient - derivative];
                noise[first..first + length].iter_mut().zip(column).for_each(|(sum, k)| *sum += share * factor * k);
            }
        }
        Regressor { companion: vec![0.0; rows.len()], value, noise }
    }

    /// What a term adds to the torque of an equation, in its rows: by trial, what it is.
    pub(crate) fn column_of(&mut self, equation: usize, terms: &[TermSamples<'_>]) -> Result<Regressor, Error> {
        let each: Vec<Vec<TermSamples<'_>>> = terms.iter().map(|term| vec![*term]).collect();
        Ok(self.columns_of(equation, &each)?.pop().unwrap_or_default())
    }

    /// The same of several terms of every trial, with one walk along the samples.
    pub(crate) fn columns_of(
        &mut self,
        equation: usize,
        terms: &[Vec<TermSamples<'_>>],
    ) -> Result<Vec<Regressor>, Error> {
        let (rows, equations, group) = (self.all.rows.len(), self.merged.equations(), self.all.group);
        let (function, delta, workers) = (self.all.function, self.options.delta, self.stages.workers);
        let mut values = vec![vec![0.0; rows]; terms.first().map_or(0, Vec::len)];
        for (number, (trial, terms)) in self.merged.trials.iter().zip(terms).enumerate() {
            let record = Record {
                angle: trial.angles[equation.min(trial.angles.len() - 1)],
                torque: trial.torques[equation],
                noise: None,
                coefficients: [Coefficient::Unknown; 3],
                constant: [true; 3],
                terms: terms.clone(),
                constant_terms: true,
                lag: 0.0,
                angle_zero: 0.0,
                mask: trial.mask,
                weights: trial.weights,
            };
            let weak = self.stages.stage(|watch| WeakRows::build(&record, function, delta, None, workers, watch))?;
            let weight = self.weights.equations[equation];
            for (value, regressor) in values.iter_mut().zip(&weak.rows.regressors[3..]) {
                for (time, term) in regressor.value.iter().enumerate() {
                    let row = time * group + number * equations + equation;
                    if row < rows && self.all.rows.usable[row] {
                        value[row] = weight * term;
                    }
                }
            }
        }
        // The noise of angles hardly enters, if at all.
        let noise = self.all.rows.regressors[0].noise.each_ref().map(|kernel| vec![0.0; kernel.len()]);
        let of = |value| Regressor { companion: vec![0.0; rows], value, noise: noise.clone() };
        Ok(values.into_iter().map(of).collect())
    }
}
