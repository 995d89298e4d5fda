//! Tests of terms missing from the equation, beside everything that was estimated.

use std::ops::Range;
use std::sync::Arc;

use crate::equation::rows::Regressor;
use crate::equation::terms::BUILT_IN_TERMS;
use crate::error::Error;
use crate::identify::weak::decided::Decided;
use crate::identify::weak::lag::Followed;
use crate::identify::weak::report::errors::Errors;
use crate::identify::weak::session::Session;
use crate::inference::missing_terms::{CONSPICUOUS, JudgedTerm, Missing, Suspect};
use crate::record::derived::Interpolated;
use crate::regression::fit::Fit;
use crate::regression::limits::NEGLIGIBLE;
use crate::regression::problem::Correlated;
use crate::regression::subsample::{holds, more_stretches_of_rows, stretches_of_rows, thinned_column, thinned_rows};
use crate::weak_form::weak_rows::{Record, TermSamples, WeakRows};

/// Where next to nothing is left to explain, a lag is none that is below a fifth of what a drive makes that holds each torque for a sample.
const LEAST_LAG: f64 = 0.1;

/// What may have been left out, and what unknowns change by with every sample that the torque is later.
#[derive(Default)]
pub(crate) struct Suspected {
    pub(crate) each: Vec<Suspect>,
    pub(crate) with_lag: Vec<(usize, f64)>,
}

impl Session<'_, '_, '_> {
    /// Looks for what may have been left out. The right-hand side and the windowed regressors times the covariance are those of all rows.
    pub(crate) fn suspects(
        &mut self,
        weak: &mut WeakRows,
        decided: &Decided,
        fit: &Fit,
        (mut rhs, correlated): (Vec<f64>, Arc<Correlated>),
        errors: &Errors,
    ) -> Result<Suspected, Error> {
        let mut candidates = self.candidates();
        // A term hardly matters where next to nothing is left for it to explain. A lag does: next to nothing of the torque may be much of the damping.
        let is_explained = errors.is_explained(&weak.rows);
        candidates.retain(|one| !is_explained || *one == Missing::Lag);
        if !self.options.diagnose || candidates.is_empty() {
            return Ok(Suspected::default());
        }
        let stretches = stretches_to_judge(weak, decided, fit);
        let more = self.regressors_of(&candidates, weak, stretches.as_deref())?;
        let lag = match candidates.iter().position(|one| *one == Missing::Lag) {
            Some(place) => self.lag_beside_slow(weak, &more[place], stretches.as_deref(), decided)?,
            None => None,
        };
        if let Some(stretches) = &stretches {
            (weak.rows, rhs) = (thinned_rows(&weak.rows, stretches), thinned_column(&rhs, stretches));
        }
        let first = weak.rows.regressors.len();
        weak.rows.regressors.extend(more);
        let rate = weak.rows.regressors.len();
        let followed = lag.map(|Followed { left, by }| {
            weak.rows.regressors.push(Regressor { value: left, ..weak.rows.regressors[rate - 1].clone() });
            by
        });
        weak.rows.clear_unusable();
        // What the torque tells is told beside a lag that may be missing, not beside one that was found; another record's may be another.
        let found_lag = usize::from(self.options.found_lag && candidates.last() == Some(&Missing::Lag));
        let apart = candidates.iter().take_while(|missing| !missing.is_beside_torque()).count();
        let mut suspects = Vec::new();
        if !is_explained {
            let (beside, regressors) =
                (&candidates[apart..candidates.len() - found_lag], first + apart..rate - found_lag);
            suspects = self.of_torque(weak, decided, (fit, &rhs, errors.error), regressors, beside)?;
        }
        if decided.white.is_some() {
            weak.rows = decided.as_white(std::mem::take(&mut weak.rows), &mut self.stages)?;
            rhs.clone_from(&weak.rows.rhs);
        }
        let correlated = if stretches.is_none() && decided.white.is_none() {
            correlated
        } else {
            decided.model.correlated(&weak.rows, &errors.covariance, &mut self.stages)?
        };
        let (mut with_lag, unknowns) = (Vec::new(), self.unknowns());
        for (place, missing) in candidates.iter().enumerate().filter(|(_, missing)| !missing.is_of_torque()) {
            let is_lag = *missing == Missing::Lag;
            if is_lag && followed.is_none() {
                continue;
            }
            let place = if is_lag { rate } else { first + place };
            let judged = JudgedTerm {
                rows: &weak.rows,
                model: &decided.model,
                rhs: &rhs,
                noise: self.noise[0],
                fit,
                covariance: &errors.covariance,
                correlated: &correlated,
                expected: errors.expected,
                inflation: errors.inflation,
                instructions: self.options.instructions,
            };
            let found = judged.factors_and_changes(&[place], &mut self.stages)?;
            let Some((factors, changes)) = found else { continue };
            let (value, error) = factors[0];
            // A term that is next to nothing of the torque need not be there; a lag is little of it, and much of the damping.
            let share = value * value * weak.rows.mean_square_of(place);
            if !is_lag && share < NEGLIGIBLE * weak.rows.mean_square() {
                continue;
            }
            let unit = if is_lag { -1.0 / self.options.delta } else { 1.0 };
            if is_explained && (unit * value).abs() < LEAST_LAG && value.abs() > CONSPICUOUS * error {
                // What sums over samples leave of integrals.
                continue;
            }
            suspects.push(Suspect { missing: *missing, value: unit * value, error: unit.abs() * error });
            if let (true, Some(by)) = (is_lag, &followed) {
                // What varies slowly comes first.
                let changes = by.iter().map(|by| -by).chain(changes.iter().copied());
                let all = decided.ordered().constant.into_iter().zip(changes.map(|one| one / unit));
                with_lag = all.filter(|(one, _)| unknowns.contains(one)).collect();
            }
        }
        Ok(Suspected { each: suspects, with_lag })
    }

    /// What is left of the torque's rate where what varies slowly follows it, in the rows of some stretches or in all.
    fn lag_beside_slow(
        &mut self,
        weak: &WeakRows,
        rate: &Regressor,
        stretches: Option<&[Range<usize>]>,
        decided: &Decided,
    ) -> Result<Option<Followed>, Error> {
        let Some(stretches) = stretches.filter(|_| decided.found.is_some()) else {
            return self.beside_slow(&weak.rows, &rate.value, decided);
        };
        // Curves are over the whole record.
        let whole = self.regressors_of(&[Missing::Lag], weak, None)?;
        let followed = self.beside_slow(&weak.rows, &whole[0].value, decided)?;
        Ok(followed.map(|Followed { left, by }| Followed { left: thinned_column(&left, stretches), by }))
    }

    /// The regressors of what may be missing, in all rows or in those of some stretches.
    pub(crate) fn regressors_of(
        &mut self,
        candidates: &[Missing],
        weak: &WeakRows,
        stretches: Option<&[Range<usize>]>,
    ) -> Result<Vec<Regressor>, Error> {
        let (velocity, samples) = (weak.plain_column(1), self.record.angle.len());
        let velocity = Interpolated { values: &velocity, first: weak.first, stride: weak.stride, samples };
        let Record { angle, torque, .. } = self.record;
        let mapped: Vec<_> = candidates.iter().map(|missing| missing.samples(angle, &velocity, torque)).collect();
        let terms = candidates.iter().zip(&mapped).map(|(missing, mapped)| match (missing, mapped) {
            (Missing::Lag, _) => TermSamples::TorqueRate,
            (Missing::Resonance, _) => TermSamples::TorqueCurvature,
            (Missing::Term(_), Some(mapped)) => TermSamples::Given(mapped),
            (_, Some(mapped)) => TermSamples::OfTorque(mapped),
            (_, None) => TermSamples::One,
        });
        // Each is added to the constants.
        let (terms, constant) = (terms.collect(), [true; 3]);
        let record = Record { terms, constant, constant_terms: true, ..self.record.clone() };
        let (function, delta, workers) = (weak.function, self.options.delta, self.stages.workers);
        let more = self.stages.stage(|watch| WeakRows::build(&record, function, delta, stretches, workers, watch))?;
        Ok(more.rows.regressors.into_iter().skip(3).collect())
    }

    /// What may be missing: what the equation does not hold already, first that beside which the torque tells nothing.
    fn candidates(&self) -> Vec<Missing> {
        let terms = BUILT_IN_TERMS.iter().filter(|term| term.looked_for).map(Missing::Term);
        // Rows of derivatives reach out of a mask, beside which other equations hold; behind a lag a filter is looked for. Noise of an angle that was fused
        // or integrated falls of itself, as behind a filter.
        let resonance = self.record.mask.is_none() && self.record.lag == 0.0 && self.record.noise.is_none();
        let of_torque =
            resonance.then_some(Missing::Resonance).into_iter().chain([Missing::TorqueSquare, Missing::TorqueCube]);
        let all = terms.chain(of_torque).chain(std::iter::once(Missing::Lag));
        let mut all: Vec<_> = all.filter(|missing| !self.options.not_missing.contains(missing)).collect();
        all.sort_by_key(Missing::is_beside_torque);
        all
    }
}

/// The rows of a long record that what may be missing is judged by.
pub(crate) fn stretches_to_judge(weak: &WeakRows, decided: &Decided, fit: &Fit) -> Option<Vec<Range<usize>>> {
    match fit.scale {
        Some(scale) => stretches_of_rows(weak.rows.len()).filter(|_| holds(scale)),
        None if decided.model.windowed.is_empty() => more_stretches_of_rows(weak.rows.len()),
        None => None,
    }
}
