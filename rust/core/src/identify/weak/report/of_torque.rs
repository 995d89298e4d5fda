//! Tests of what the torque itself tells: is its sensor linear, and is the machine between both sensors rigid?
//!
//! A sensor that shows `T + aT² + bT³`, and a coupling that bends, whose resonance `ω₀` is above the motion and leaves `T + T″/ω₀²` at most, change
//! parameters by what they add to the torque, which windows and residuals hardly show. Their factors are asked beside everything else that may be missing,
//! all at once.

use std::ops::Range;

use crate::error::Error;
use crate::identify::scanned::OTHER_CONSTANT;
use crate::identify::weak::decided::Decided;
use crate::identify::weak::report::filter::{UNSURE, shared_noise};
use crate::identify::weak::session::Session;
use crate::inference::missing_terms::{Missing, Suspect};
use crate::regression::fit::Fit;
use crate::regression::limits::{NEGLIGIBLE, NOISE_MODEL_FAILS};
use crate::regression::model::Model;
use crate::regression::problem::Problem;
use crate::regression::residuals::residuals;
use crate::regression::row_covariance::RowCovariance;
use crate::weak_form::weak_rows::WeakRows;

/// The least part of the torque's mean square that powers of it must have to be said: half a percent of the torque. Rounding of an angle beside a
/// torque without noise is seen as a quarter of a percent.
const LEAST_OF_POWERS: f64 = 2.5e-5;

/// From how many times the half-width on another test function is asked.
const WIDER: usize = 2;

impl Session<'_, '_, '_> {
    /// What the torque tells beside all that may be missing, whose regressors are some of the rows'; the fit comes with its right-hand side and its error
    /// of prediction. Where the test function was made narrower than those that agree with it, the widest of these contradicts what it tells: noise is
    /// less there, and windows are longer.
    pub(crate) fn of_torque(
        &mut self,
        weak: &WeakRows,
        decided: &Decided,
        fitted: (&Fit, &[f64], f64),
        regressors: Range<usize>,
        candidates: &[Missing],
    ) -> Result<Vec<Suspect>, Error> {
        let told = self.of_torque_in(weak, decided, fitted, (regressors, candidates), &[])?;
        let mut suspects: Vec<_> = told.into_iter().map(|(suspect, _)| suspect).collect();
        let widest = self.scan.widest().unwrap_or(0);
        let is_wider = self.scan.moved && widest >= WIDER * weak.function.half_width() && decided.jumps.is_empty();
        let doubted: Vec<_> = suspects.iter().filter(|one| one.is_conspicuous()).map(|one| one.missing).collect();
        if !is_wider || doubted.is_empty() {
            return Ok(suspects);
        }
        let model = decided.ordered();
        let mut wide = self.chosen_with(widest, &model)?;
        let fitted = self.fit_first(&wide, &model)?;
        let Some(fit) = &fitted.fit else { return Ok(suspects) };
        let more = self.regressors_of(candidates, &wide.weak, None)?;
        let rows = &mut wide.weak.rows;
        let first = rows.regressors.len();
        rows.regressors.extend(more);
        rows.clear_unusable();
        let (rhs, regressors) = (rows.rhs.clone(), first..rows.regressors.len());
        for (other, is_little) in
            self.of_torque_in(&wide.weak, &fitted, (fit, &rhs, fitted.error), (regressors, candidates), &doubted)?
        {
            let is_other =
                |one: &Suspect| (one.value - other.value).abs() > OTHER_CONSTANT * one.error.hypot(other.error);
            let place = suspects.iter().position(|one| one.missing == other.missing && is_other(one));
            match place {
                Some(place) if is_little => drop(suspects.remove(place)),
                Some(place) => suspects[place] = other,
                None => {}
            }
        }
        Ok(suspects)
    }

    /// The same with the test function of these rows, and whether each is too little to be said: of what is doubted, or of what is not too little.
    fn of_torque_in(
        &mut self,
        weak: &WeakRows,
        decided: &Decided,
        (fit, rhs, error): (&Fit, &[f64], f64),
        (regressors, candidates): (Range<usize>, &[Missing]),
        doubted: &[Missing],
    ) -> Result<Vec<(Suspect, bool)>, Error> {
        let rows = &weak.rows;
        let (known, expected) = self.covariance(weak, self.parameters(&decided.model, fit));
        let model = decided.ordered();
        let count = model.constant.len();
        let model = Model { constant: model.constant.iter().copied().chain(regressors.clone()).collect(), ..model };
        let problem = model.problem(rows, rhs, self.noise[0], None);
        let Some(beside) = fit.again(&problem, expected, self.options.instructions, &mut self.stages)? else {
            return Ok(Vec::new());
        };
        let (left, usable) = residuals(&problem, &beside, &mut self.stages)?;
        let shown = RowCovariance::of_residuals(&left, &usable, 4 * weak.reach());
        if error.min(shown.variance() / known.variance()) > NOISE_MODEL_FAILS {
            // Equations that leave too much beside all of these lack something else.
            return Ok(Vec::new());
        }
        let covariance = if shown.variance() > known.variance() { shown } else { known };
        let problem = Problem { correlated: Some(model.correlated(rows, &covariance, &mut self.stages)?), ..problem };
        let shared = shared(weak, &regressors, candidates, expected.torque.min(covariance.variance()));
        let lag = candidates.iter().position(|&one| one == Missing::Lag);
        let mut suspects = Vec::new();
        for (place, &missing) in candidates.iter().enumerate().filter(|(_, missing)| missing.is_of_torque()) {
            let value = beside.pooled.values[count + place];
            let least = if missing == Missing::Resonance { NEGLIGIBLE } else { LEAST_OF_POWERS };
            let is_little = value * value * rows.mean_square_of(regressors.start + place) < least * rows.mean_square();
            let is_asked = if doubted.is_empty() { !is_little } else { doubted.contains(&missing) };
            if !is_asked {
                continue;
            }
            let variance = beside.variance_of(&problem, count + place, &covariance, &mut self.stages)?;
            let mut suspect = Suspect { missing, value, error: variance.sqrt() };
            if suspect.is_conspicuous() {
                // The torque's noise is in both sides.
                let white = beside.covariance(&problem, &RowCovariance::white(), &mut self.stages)?;
                let row = &white[(count + place) * problem.layout.constant + count..][..candidates.len()];
                let by_noise = rows.len() as f64 * row.iter().zip(&shared).map(|(one, other)| one * other).sum::<f64>();
                suspect.value -= by_noise;
                suspect.error += UNSURE * by_noise.abs();
                if let (Missing::Resonance, Some(lag)) = (missing, lag) {
                    // A torque that is late has half its lag's square of the second derivative.
                    let variance = beside.variance_of(&problem, count + lag, &covariance, &mut self.stages)?;
                    let lag = beside.pooled.values[count + lag];
                    suspect.value += lag * lag / 2.0;
                    suspect.error += lag.abs() * variance.sqrt();
                }
            }
            suspects.push((suspect, is_little));
        }
        Ok(suspects)
    }
}

/// The covariance of a row's noise with that of each regressor.
fn shared(weak: &WeakRows, regressors: &Range<usize>, candidates: &[Missing], torque: f64) -> Vec<f64> {
    let scale: f64 = weak.torque.iter().sum();
    let mean = |column: &[f64]| column.iter().sum::<f64>() / (scale * weak.rows.len() as f64);
    let square = candidates.iter().position(|&one| one == Missing::TorqueSquare);
    let squares = square.map_or(0.0, |place| mean(&weak.rows.regressors[regressors.start + place].value));
    let of = |missing: &Missing| match missing {
        Missing::Resonance => -shared_noise(weak, torque),
        // The slopes of both powers, in the mean.
        Missing::TorqueSquare => 2.0 * mean(&weak.rows.rhs) * torque,
        Missing::TorqueCube => 3.0 * squares * torque,
        Missing::Term(_) | Missing::Lag => 0.0,
    };
    candidates.iter().map(of).collect()
}
