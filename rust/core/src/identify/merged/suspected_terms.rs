//! Terms that the equations of masses seem to lack, each as one more constant beside everything that was estimated and each other.

use std::sync::Arc;

use crate::error::Error;
use crate::identify::merged::decided::MergedFit;
use crate::identify::merged::possible_terms::{FRICTION, MotionOf, PossibleTerm};
use crate::identify::merged::session::MergedSession;
use crate::identify::merged::shown::{NoiseOfRows, SHOWN};
use crate::identify::weak::shown_noise::MORE;
use crate::inference::missing_terms::{CONSPICUOUS, Suspect};
use crate::regression::fit::Fit;
use crate::regression::problem::Correlated;
use crate::regression::residuals::residuals;

/// The part of the mean square of an equation's torque that a term must have: what windows cannot follow looks like a little of anything.
const LEAST_PART: f64 = 1e-4;

/// Standard errors below which a candidate is hardly more than nothing.
const PERHAPS: f64 = 2.0;

/// Terms that are suspected.
#[derive(Default)]
pub(crate) struct SuspectedTerms {
    pub(crate) each: Vec<SuspectedTerm>,
    /// The fit beside them, if there are any.
    pub(crate) beside: Option<Fit>,
}

/// A term that equations seem to lack.
#[derive(Clone, Copy, Debug)]
pub struct SuspectedTerm {
    /// What it is a function of.
    pub motion: MotionOf,
    /// What it is, and how large.
    pub suspect: Suspect,
}

impl MergedSession<'_, '_, '_> {
    /// Terms that the equations seem to lack.
    pub(crate) fn suspected_terms(
        &mut self,
        fitted: &MergedFit,
        noise: &NoiseOfRows,
        correlated: &Arc<Correlated>,
    ) -> Result<SuspectedTerms, Error> {
        let first = self.all.rows.regressors.len();
        let mut candidates = self.candidates()?;
        let rows = &self.all.rows;
        let judged = noise.judged(rows, fitted, correlated, self.options.instructions);
        let mut factors = judged.factors(&columns(&candidates), &mut self.stages)?.unwrap_or_default();
        while let Some(stand) = standing(&factors) {
            let mut stands = stand.into_iter();
            candidates.retain(|_| stands.next().unwrap_or(false));
            factors = judged.factors(&columns(&candidates), &mut self.stages)?.unwrap_or_default();
        }
        let told: Vec<(&PossibleTerm, Suspect)> = candidates
            .iter()
            .zip(factors)
            .map(|(one, (value, error))| (one, Suspect { missing: one.missing, value, error }))
            .filter(|(one, suspect)| {
                suspect.is_conspicuous() && !drives(suspect) && self.part_of(one, suspect.value) > LEAST_PART
            })
            .collect();
        let columns: Vec<usize> = told.iter().map(|(one, _)| one.column).collect();
        let mut found = SuspectedTerms::default();
        if let Some((problem, fit)) = judged.beside(&columns, &mut self.stages)? {
            let without = fitted.model.problem(rows, &rows.rhs, 1.0, Some(correlated));
            let left = sum_of_squares(&residuals(&problem, &fit, &mut self.stages)?);
            // What is left and may be no noise looks like a little of anything.
            let most = if fitted.error > MORE { SHOWN } else { 1.0 };
            if left < most * sum_of_squares(&residuals(&without, &fitted.fit, &mut self.stages)?) {
                found.each =
                    told.into_iter().map(|(one, suspect)| SuspectedTerm { motion: one.motion, suspect }).collect();
                found.beside = Some(fit);
            }
        }
        self.all.rows.regressors.truncate(first);
        Ok(found)
    }

    /// The mean square of a term with a factor over that of the torque, in the rows of its equations.
    fn part_of(&self, one: &PossibleTerm, factor: f64) -> f64 {
        let (rows, equations) = (&self.all.rows, self.merged.equations());
        let of = self.equations_of(one.motion);
        let values = rows.regressors[one.column].value.iter().zip(&rows.rhs).zip(&rows.usable).enumerate();
        let theirs =
            values.filter(|(row, (_, usable))| **usable && of.iter().any(|(equation, _)| row % equations == *equation));
        let (term, torque) = theirs.fold((0.0, 0.0), |(term, torque), (_, ((value, rhs), _))| {
            (term + (factor * value).powi(2), torque + rhs * rhs)
        });
        term / torque
    }
}

/// Which candidates stay beside each other; `None` if all do. All that are hardly more than nothing go at once, then the least of those that are not
/// conspicuous, one by one: of two that are alike, as with a base that hardly moves, neither is known beside the other.
fn standing(factors: &[(f64, f64)]) -> Option<Vec<bool>> {
    let sizes: Vec<f64> = factors.iter().map(|(value, error)| value.abs() / error).collect();
    let nothing = sizes.iter().any(|size| size.is_nan() || *size < PERHAPS);
    let least = sizes.iter().copied().fold(f64::INFINITY, f64::min);
    match (nothing, least < CONSPICUOUS) {
        (true, _) => Some(sizes.iter().map(|size| *size >= PERHAPS).collect()),
        (false, true) => Some(sizes.iter().map(|size| *size > least).collect()),
        (false, false) => None,
    }
}

fn columns(candidates: &[PossibleTerm]) -> Vec<usize> {
    candidates.iter().map(|one| one.column).collect()
}

/// Whether a term would be a friction that drives the motion, and so is none.
fn drives(suspect: &Suspect) -> bool {
    suspect.missing.name() == FRICTION && suspect.value < 0.0
}

pub(crate) fn sum_of_squares((left, usable): &(Vec<f64>, Vec<bool>)) -> f64 {
    left.iter().zip(usable).filter(|(_, usable)| **usable).map(|(left, _)| left * left).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_of_what_is_not_conspicuous_goes_first_and_what_is_nothing_at_once() {
        assert_eq!(
            standing(&[(9.0, 1.0), (1.9, 1.0), (-3.0, 1.0), (f64::NAN, 1.0)]),
            Some(vec![true, false, true, false])
        );
        assert_eq!(standing(&[(9.0, 1.0), (4.0, 1.0), (-3.0, 1.0)]), Some(vec![true, true, false]));
        assert_eq!(standing(&[(9.0, 1.0), (-5.0, 1.0)]), None);
        assert_eq!(standing(&[]), None);
    }
}
