//! Terms that the equations of masses may lack: dry friction and a spring that hardens, each as one more constant of its equation, beside
//! everything that was estimated and each other.

use std::sync::Arc;

use crate::equation::rows::Regressor;
use crate::equation::terms::BuiltInTerm;
use crate::error::Error;
use crate::identify::merged::decided::MergedFit;
use crate::identify::merged::session::MergedSession;
use crate::identify::merged::shown::{NoiseOfRows, SHOWN};
use crate::identify::merged::system::Multiplied;
use crate::identify::weak::friction::{Sliding, expected_sign};
use crate::identify::weak::shown_noise::MORE;
use crate::inference::missing_terms::{Missing, Suspect};
use crate::noise::spectrum::bridge;
use crate::record::samples::read_around;
use crate::regression::fit::Fit;
use crate::regression::problem::Correlated;
use crate::regression::residuals::residuals;
use crate::weak_form::weak_rows::TermSamples;

/// What may be lacking: functions of the velocity of a mass and of its angle.
const NAMES: [&str; 2] = ["coulomb", "cubic"];
/// The part of the mean square of an equation's torque that a term must have: what windows cannot follow looks like a little of anything.
const LEAST_PART: f64 = 1e-4;
/// Columns whose cosine is as large are of one term, which was given.
const SAME: f64 = 0.9;

/// Terms that are suspected.
#[derive(Default)]
pub(crate) struct SuspectedTerms {
    /// With the equation of each.
    pub(crate) each: Vec<(usize, Suspect)>,
    /// The fit beside them, if there are any.
    pub(crate) beside: Option<Fit>,
}

/// A term that may be missing in an equation, and its column among the regressors.
pub(crate) struct PossibleTerm {
    equation: usize,
    missing: Missing,
    pub(crate) column: usize,
}

impl MergedSession<'_, '_, '_> {
    /// Terms that the equations seem to lack: not where trials are aligned on a phase, and in equations of masses that a torque acts on and a spring holds.
    pub(crate) fn suspected_terms(
        &mut self,
        fitted: &MergedFit,
        noise: &NoiseOfRows,
        correlated: &Arc<Correlated>,
    ) -> Result<SuspectedTerms, Error> {
        let first = self.all.rows.regressors.len();
        let candidates = self.candidates()?;
        let rows = &self.all.rows;
        let judged = noise.judged(rows, fitted, correlated, self.options.instructions);
        let columns: Vec<usize> = candidates.iter().map(|one| one.column).collect();
        let factors = if columns.is_empty() { None } else { judged.factors(&columns, &mut self.stages)? };
        let told: Vec<(&PossibleTerm, Suspect)> = candidates
            .iter()
            .zip(factors.unwrap_or_default())
            .map(|(one, (value, error))| (one, Suspect { missing: one.missing, value, error }))
            .filter(|(one, suspect)| {
                suspect.is_conspicuous() && !drives(suspect) && self.part_of(one, suspect.value) > LEAST_PART
            })
            .collect();
        let columns: Vec<usize> = told.iter().map(|(one, _)| one.column).collect();
        let beside = if columns.is_empty() { None } else { judged.beside(&columns, &mut self.stages)? };
        let mut found = SuspectedTerms::default();
        if let Some((problem, fit)) = beside {
            let without = fitted.model.problem(rows, &rows.rhs, 1.0, Some(correlated));
            let left = sum_of_squares(&residuals(&problem, &fit, &mut self.stages)?);
            // What is left and may be no noise looks like a little of anything.
            let most = if fitted.error > MORE { SHOWN } else { 1.0 };
            if left < most * sum_of_squares(&residuals(&without, &fitted.fit, &mut self.stages)?) {
                found.each = told.into_iter().map(|(one, suspect)| (one.equation, suspect)).collect();
                found.beside = Some(fit);
            }
        }
        self.all.rows.regressors.truncate(first);
        Ok(found)
    }

    /// Adds the columns of what may be missing, and says what they are.
    pub(crate) fn candidates(&mut self) -> Result<Vec<PossibleTerm>, Error> {
        let mut candidates = Vec::new();
        if self.merged.trials.iter().any(|trial| trial.position.is_some()) {
            return Ok(candidates);
        }
        for equation in 0..self.merged.equations() {
            if self.is_silent(equation) || !self.has_spring(equation) {
                continue;
            }
            for missing in NAMES.iter().filter_map(|name| BuiltInTerm::named(name)) {
                let samples = self.samples_of(equation, missing)?;
                let samples: Vec<&[f64]> = samples.iter().map(Vec::as_slice).collect();
                let terms: Vec<_> = samples.iter().map(|one| TermSamples::Given(one)).collect();
                let regressor = self.column_of(equation, &terms)?;
                if !self.is_given(equation, &regressor) {
                    candidates.push(PossibleTerm {
                        equation,
                        missing: Missing::Term(missing),
                        column: self.all.rows.regressors.len(),
                    });
                    self.all.rows.regressors.push(regressor);
                }
            }
        }
        Ok(candidates)
    }

    /// Whether the angle of an equation's mass pulls a spring in it.
    fn has_spring(&self, equation: usize) -> bool {
        let mut entries = self.merged.elements.iter().flat_map(|element| &element.entries);
        entries.any(|entry| {
            entry.equation == equation && entry.of == Multiplied::Motion { channel: equation, coefficient: 2 }
        })
    }

    /// A term of the angle or the velocity of an equation's mass at every sample, by trial.
    fn samples_of(&mut self, equation: usize, term: &'static BuiltInTerm) -> Result<Vec<Vec<f64>>, Error> {
        let (delta, workers, instructions) = (self.options.delta, self.stages.workers, self.options.instructions);
        let mut all = Vec::new();
        for trial in &self.merged.trials {
            let mut angle = vec![0.0; trial.angles[equation].len()];
            read_around(trial.angles[equation], 0, &mut angle);
            if term.name != NAMES[0] {
                all.push(angle.into_iter().map(|angle| angle.powi(3)).collect());
                continue;
            }
            // Equations near a gap ask for the direction there, too.
            bridge(&mut angle);
            let angle = angle.as_slice();
            let sliding = self.stages.stage(|watch| Sliding::of(&angle, (delta, instructions), workers, watch))?;
            let signs = sliding.velocity.iter().zip(&sliding.errors).map(|(&one, &error)| expected_sign(one, error));
            // At rest friction may be anything.
            all.push(signs.map(|sign| if sign.is_nan() { 0.0 } else { sign }).collect());
        }
        Ok(all)
    }

    /// Whether one of the terms of an equation is nearly a multiple of a column.
    fn is_given(&self, equation: usize, column: &Regressor) -> bool {
        let (equations, group) = (self.merged.equations(), self.all.group);
        let entries = self.merged.elements.iter().flat_map(|element| &element.entries);
        let terms = entries.filter(|entry| entry.equation == equation && matches!(entry.of, Multiplied::Term(_)));
        terms.into_iter().any(|entry| {
            let (mut both, mut own, mut other) = (0.0, 0.0, 0.0);
            for (number, trial) in self.trials.iter().enumerate() {
                for (time, term) in trial.regressor(entry.of).value.iter().enumerate() {
                    let row = time * group + number * equations + equation;
                    if let Some(value) = column.value.get(row).filter(|value| **value != 0.0) {
                        both += value * term;
                        own += value * value;
                        other += term * term;
                    }
                }
            }
            both.abs() > SAME * (own * other).sqrt()
        })
    }

    /// The mean square of a term with a factor over that of the torque, in the rows of its equation.
    fn part_of(&self, one: &PossibleTerm, factor: f64) -> f64 {
        let (rows, equations) = (&self.all.rows, self.merged.equations());
        let values = rows.regressors[one.column].value.iter().zip(&rows.rhs).zip(&rows.usable).enumerate();
        let of_equation = values.filter(|(row, (_, usable))| **usable && row % equations == one.equation);
        let (term, torque) = of_equation.fold((0.0, 0.0), |(term, torque), (_, ((value, rhs), _))| {
            (term + (factor * value).powi(2), torque + rhs * rhs)
        });
        term / torque
    }
}

/// Whether a term would be a friction that drives the motion, and so is none.
fn drives(suspect: &Suspect) -> bool {
    suspect.missing.name() == NAMES[0] && suspect.value < 0.0
}

pub(crate) fn sum_of_squares((left, usable): &(Vec<f64>, Vec<bool>)) -> f64 {
    left.iter().zip(usable).filter(|(_, usable)| **usable).map(|(left, _)| left * left).sum()
}
