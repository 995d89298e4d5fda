//! Tests of terms missing from the equation, beside everything that was estimated.

use std::ops::Range;
use std::sync::Arc;

use crate::equation::rows::Regressor;
use crate::equation::terms::BUILT_IN_TERMS;
use crate::error::Error;
use crate::identify::weak::decided::Decided;
use crate::identify::weak::lag::Followed;
use crate::identify::weak::report::doubted::{Doubted, StepRows};
use crate::identify::weak::report::errors::Errors;
use crate::identify::weak::session::Session;
use crate::inference::missing_terms::{CONSPICUOUS, JudgedTerm, Missing, Suspect};
use crate::record::derived::{Interpolated, Shifted};
use crate::regression::fit::Fit;
use crate::regression::limits::NEGLIGIBLE;
use crate::regression::problem::Correlated;
use crate::regression::subsample::{holds, more_stretches_of_rows, stretches_of_rows, thinned_column, thinned_rows};
use crate::weak_form::weak_rows::{Record, TermSamples, WeakRows, mean};

/// Where next to nothing is left to explain, a lag is none that is below a fifth of what a drive makes that holds each torque for a sample.
const LEAST_LAG: f64 = 0.1;

/// A lag of so few samples is told only where a parameter changes by this part of it: both channels of a recorder are a hundredth of a sample apart, sums
/// over samples leave as much of integrals, and errors hold it.
const LEAST_TOLD: f64 = 0.02;
const LEAST_CHANGE: f64 = 0.01;

/// Standard errors from which on a term or a lag may be there, though it is not worth a word yet: little friction is much of a damping beside it.
const MAY_BE_THERE: f64 = 3.0;

/// What may have been left out, and what unknowns change by with every sample that the torque is later.
#[derive(Default)]
pub(crate) struct Suspected {
    pub(crate) each: Vec<Suspect>,
    pub(crate) with_lag: Vec<(usize, f64)>,
    /// What the constants, those that change slowly first, would change by: with the lag, and with the most conspicuous term, if they may be there.
    pub(crate) changes: Vec<Vec<f64>>,
}

/// What may be there, and what the constants would change by with it.
#[derive(Default)]
struct Changes {
    lag: Option<(Suspect, Vec<f64>)>,
    term: Option<(Suspect, Vec<f64>)>,
}

impl Changes {
    /// Takes a suspect, if it may be there and, of two terms, the more conspicuous: both may have one cause.
    fn add(&mut self, suspect: Suspect, by: Vec<f64>) {
        let certainty = |one: &Suspect| (one.value / one.error).abs();
        let place = if suspect.missing == Missing::Lag { &mut self.lag } else { &mut self.term };
        let before = place.as_ref().map_or(MAY_BE_THERE, |(before, _)| certainty(before));
        if certainty(&suspect) > before {
            *place = Some((suspect, by));
        }
    }

    /// All of them, of so many constants. A lag's is that of its rate alone: fast motion that passes the test function turns by about so many radians in the
    /// lag as there are half-widths in it, and `e^x - 1` is more than `x`.
    fn finish(self, half_width: f64, constants: usize) -> Vec<Vec<f64>> {
        let of_lag = self.lag.map(|(suspect, mut by)| {
            let turn = (suspect.value / half_width).abs().clamp(f64::MIN_POSITIVE, 1.0);
            for one in &mut by {
                *one *= turn.exp_m1() / turn;
            }
            by
        });
        let all = of_lag.into_iter().chain(self.term.map(|(_, by)| by));
        let all = all.inspect(|by| debug_assert_eq!(by.len(), constants, "constants"));
        all.filter(|by| by.iter().all(|one| one.is_finite())).collect()
    }
}

/// Rows of a record, or of some stretches of it, with what may be missing.
struct RowsToJudge {
    weak: WeakRows,
    rhs: Vec<f64>,
    /// The first regressor that may be missing, and the one after the last.
    first: usize,
    end: usize,
    /// How what varies slowly follows each, where that is known; nothing of what the torque tells.
    followed: Vec<Option<Follows>>,
    are_some: bool,
}

/// What varies slowly follows a regressor by, and which regressor it makes of that, if it does.
struct Follows {
    by: Vec<f64>,
    regressor: Option<usize>,
}

impl Session<'_, '_, '_> {
    /// Looks for what may have been left out. The windowed regressors times the covariance are those of all rows.
    pub(crate) fn suspects(
        &mut self,
        all: &WeakRows,
        decided: &Decided,
        fit: &Fit,
        correlated: Arc<Correlated>,
        errors: &Errors,
    ) -> Result<Suspected, Error> {
        let mut candidates = self.candidates();
        // What the torque tells hardly matters where next to nothing is left for it to explain. A term or a lag does: that may be much of the damping.
        let is_explained = errors.is_explained(&all.rows);
        candidates.retain(|one| !(is_explained && one.is_of_torque()));
        if !self.options.diagnose || candidates.is_empty() {
            return Ok(Suspected::default());
        }
        let RowsToJudge { mut weak, mut rhs, first, end, followed, are_some } =
            self.rows_to_judge(all, decided, fit, &candidates)?;
        // What the torque tells is told beside a lag that may be missing, not beside one that was found; another record's may be another.
        let found_lag = usize::from(self.options.found_lag.is_some() && candidates.last() == Some(&Missing::Lag));
        let apart = candidates.iter().take_while(|missing| !missing.is_beside_torque()).count();
        let mut suspects = Vec::new();
        if !is_explained {
            let (beside, regressors) =
                (&candidates[apart..candidates.len() - found_lag], first + apart..end - found_lag);
            suspects = self.of_torque(&weak, decided, (fit, &rhs, errors.error), regressors, beside)?;
        }
        if decided.white.is_some() {
            weak.rows = decided.as_white(std::mem::take(&mut weak.rows), &mut self.stages)?;
            rhs.clone_from(&weak.rows.rhs);
        }
        let correlated = if !are_some && decided.white.is_none() {
            correlated
        } else {
            decided.model.correlated(&weak.rows, &errors.covariance, &mut self.stages)?
        };
        let (mut with_lag, mut changes, unknowns) = (Vec::new(), Changes::default(), self.unknowns());
        let resisting = of_velocity(&candidates, &followed, first);
        let steps = step_rows(&weak, (&candidates, first), decided);
        for (place, missing) in candidates.iter().enumerate().filter(|(_, missing)| !missing.is_of_torque()) {
            let is_lag = *missing == Missing::Lag;
            let Some(follows) = &followed[place] else { continue };
            // What varies slowly has taken a part of what is missing. It is judged beside what follows it: where the curve is hardly told, it follows
            // anything, and what it is wrong by looks like a lag.
            let place = first + place;
            let regressors: Vec<usize> = follows.regressor.into_iter().chain([place]).collect();
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
            let found = judged.factors_and_changes(&regressors, &mut self.stages)?;
            let Some((factors, mut by_one)) = found else { continue };
            let Some((value, error)) = factors.last().copied() else { continue };
            let share_that_follows = follows.regressor.and_then(|_| by_one.pop()).unwrap_or(0.0);
            let unit = if is_lag { -1.0 / self.options.delta } else { 1.0 };
            if is_lag && is_explained && (unit * value).abs() < LEAST_LAG && value.abs() > CONSPICUOUS * error {
                // What sums over samples leave of integrals.
                continue;
            }
            let suspect = Suspect { missing: *missing, value: unit * value, error: unit.abs() * error };
            // What varies slowly comes first.
            let by_one: Vec<f64> = follows.by.iter().map(|by| share_that_follows * by).chain(by_one).collect();
            if is_lag {
                let each = decided.ordered().constant.into_iter().zip(by_one.iter().map(|one| one / unit));
                with_lag = each.filter(|(one, _)| unknowns.contains(one)).collect();
            }
            let by_suspect: Vec<f64> = by_one.into_iter().map(|one| value * one).collect();
            let is_told = !is_lag || suspect.value.abs() >= LEAST_TOLD || matters(&by_suspect, fit, decided);
            changes.add(suspect, by_suspect);
            if !is_told {
                continue;
            }
            let doubted = Doubted { suspect, regressors: &regressors, unit, rows: steps };
            let suspect = match suspect.is_conspicuous() {
                true if is_lag => self.agreed_lag(&judged, doubted, &resisting)?,
                true => self.agreed(&judged, doubted)?,
                false => suspect,
            };
            // A term that is next to nothing of the torque, or has next to nothing left to explain, need not be there; a lag is little of it, and much of
            // the damping.
            let share = value * value * weak.rows.mean_square_of(place);
            if is_lag || !(is_explained || share < NEGLIGIBLE * weak.rows.mean_square()) {
                suspects.push(suspect);
            }
        }
        let changes = changes.finish(all.function.half_width() as f64, decided.ordered().constant.len());
        Ok(Suspected { each: suspects, with_lag, changes })
    }

    /// The rows beside which what may be missing is judged, whose last regressors it is.
    fn rows_to_judge(
        &mut self,
        all: &WeakRows,
        decided: &Decided,
        fit: &Fit,
        candidates: &[Missing],
    ) -> Result<RowsToJudge, Error> {
        let stretches = stretches_to_judge(all, decided, fit);
        let more = self.regressors_of(candidates, all, stretches.as_deref())?;
        let beside = self.each_beside_slow(all, (candidates, &more), stretches.as_deref(), decided)?;
        let rhs = decided.rhs(&all.rows);
        let (rows, rhs) = match &stretches {
            Some(stretches) => (thinned_rows(&all.rows, stretches), thinned_column(rhs, stretches)),
            None => (all.rows.clone(), rhs.to_vec()),
        };
        let mut weak = all.with(rows);
        let first = weak.rows.regressors.len();
        weak.rows.regressors.extend(more);
        let end = weak.rows.regressors.len();
        let mut followed = Vec::new();
        for (place, one) in beside.into_iter().enumerate() {
            followed.push(one.map(|Followed { left, by }| {
                let regressor = (!by.is_empty()).then_some(weak.rows.regressors.len());
                if regressor.is_some() {
                    let one = &weak.rows.regressors[first + place];
                    let value = one.value.iter().zip(left).map(|(value, left)| value - left).collect();
                    let (companion, noise) = (one.companion.clone(), one.noise.clone());
                    weak.rows.regressors.push(Regressor { value, companion, noise });
                }
                Follows { by, regressor }
            }));
        }
        weak.rows.clear_unusable();
        Ok(RowsToJudge { weak, rhs, first, end, followed, are_some: stretches.is_some() })
    }

    /// What is left of each that may be missing where what varies slowly follows it, in the rows of some stretches or in all.
    fn each_beside_slow(
        &mut self,
        weak: &WeakRows,
        (candidates, more): (&[Missing], &[Regressor]),
        stretches: Option<&[Range<usize>]>,
        decided: &Decided,
    ) -> Result<Vec<Option<Followed>>, Error> {
        // Curves are over the whole record.
        let stretches = stretches.filter(|_| decided.found.is_some());
        let mut each = Vec::new();
        for (&missing, regressor) in candidates.iter().zip(more) {
            let one = if missing.is_of_torque() {
                None
            } else if let Some(stretches) = stretches {
                let whole = self.regressors_of(&[missing], weak, None)?;
                let followed = self.beside_slow(&weak.rows, &whole[0].value, decided)?;
                followed.map(|Followed { left, by }| Followed { left: thinned_column(&left, stretches), by })
            } else {
                self.beside_slow(&weak.rows, &regressor.value, decided)?
            };
            each.push(one);
        }
        Ok(each)
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
        // Powers of a torque that has a mean are the torque itself, mostly, which is like whatever windows do not follow.
        let torque = Shifted { channel: self.record.torque, zero: self.torque_zero() };
        let angle = self.record.angle;
        let mapped: Vec<_> = candidates.iter().map(|missing| missing.samples(angle, &velocity, &torque)).collect();
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

    /// What powers of the torque are taken from: its mean beside an offset, which holds the rest of them with what all parameters share.
    pub(crate) fn torque_zero(&self) -> f64 {
        let has_offset = self.record.terms.iter().any(|term| matches!(term, TermSamples::One));
        if has_offset { mean(self.record.torque) } else { 0.0 }
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

/// Whether constants or what varies slowly change by a part that matters with a lag.
fn matters(changes: &[f64], fit: &Fit, decided: &Decided) -> bool {
    let slow = decided.found.iter().flat_map(|found| &found.varying.values).map(|values| mean_size(values));
    let sizes = slow.chain(fit.pooled.values.iter().map(|value| value.abs()));
    let each = decided.ordered().constant.into_iter().zip(sizes).zip(changes);
    each.into_iter().any(|((unknown, size), change)| unknown < 3 && change.abs() > LEAST_CHANGE * size)
}

fn mean_size(values: &[f64]) -> f64 {
    let sizes = values.iter().map(|value| value.abs()).filter(|size| size.is_finite());
    let (count, sum) = sizes.fold((0.0, 0.0), |(count, sum), size| (count + 1.0, sum + size));
    sum / count
}

/// The rows that are judged by, and what steps of the torque move them by.
pub(crate) fn step_rows<'a>(
    weak: &'a WeakRows,
    (candidates, first): (&[Missing], usize),
    decided: &Decided,
) -> StepRows<'a> {
    let rate = candidates.iter().position(|&one| one == Missing::Lag);
    let column = |place: usize| weak.rows.regressors[first + place].value.as_slice();
    StepRows { weak, rate: rate.map(column), are_white: decided.white.is_some() }
}

/// The regressors of terms of the velocity, and of what follows them.
fn of_velocity(candidates: &[Missing], followed: &[Option<Follows>], first: usize) -> Vec<usize> {
    let is_of_velocity = |one: &Missing| matches!(one, Missing::Term(term) if term.is_of_velocity());
    let each = candidates.iter().zip(followed).enumerate().filter(|(_, (one, _))| is_of_velocity(one));
    let regressors = |(place, (_, follows)): (usize, (&Missing, &Option<Follows>))| {
        let by = follows.as_ref().map(|follows| follows.regressor.into_iter().chain([first + place]));
        by.into_iter().flatten().collect::<Vec<_>>()
    };
    each.flat_map(regressors).collect()
}

/// The rows of a long record that what may be missing is judged by.
pub(crate) fn stretches_to_judge(weak: &WeakRows, decided: &Decided, fit: &Fit) -> Option<Vec<Range<usize>>> {
    match fit.scale {
        Some(scale) => stretches_of_rows(weak.rows.len()).filter(|_| holds(scale)),
        None if decided.model.windowed.is_empty() => more_stretches_of_rows(weak.rows.len()),
        None => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HALF_WIDTH: f64 = 10.0;

    fn changes(of: &[(Missing, f64, Vec<f64>)]) -> Vec<Vec<f64>> {
        let mut changes = Changes::default();
        for (missing, value, by) in of {
            changes.add(Suspect { missing: *missing, value: *value, error: 1.0 }, by.clone());
        }
        changes.finish(HALF_WIDTH, 2)
    }

    #[test]
    fn the_lag_and_the_most_conspicuous_term_change_constants() {
        let term = |place: usize| Missing::Term(&BUILT_IN_TERMS[place]);
        let (little, much) = (vec![1.0, 0.0], vec![0.0, -3.0]);
        let of_terms = changes(&[(term(0), 6.0, little.clone()), (term(1), -9.0, much.clone())]);
        assert_eq!(of_terms, std::slice::from_ref(&much));
        assert_eq!(changes(&[(term(0), 2.9, little.clone()), (Missing::Lag, f64::NAN, much.clone())]), [[0.0; 2]; 0]);
        // As much again as half of the part of the half-width, and a sixth of its square, and so on.
        let of_lag = changes(&[(Missing::Lag, -5.0, little.clone()), (Missing::Lag, -8.0, little.clone())]);
        assert!((of_lag[0][0] - 0.8_f64.exp_m1() / 0.8).abs() < 4.0 * f64::EPSILON, "{of_lag:?}");
        let both = changes(&[(Missing::Lag, 1e-9 * HALF_WIDTH, little.clone()), (term(0), 6.0, much.clone())]);
        assert_eq!(both, [much]);
        let longest = changes(&[(Missing::Lag, 1e3, little)]);
        assert!((longest[0][0] - 1.0_f64.exp_m1()).abs() < 4.0 * f64::EPSILON, "{longest:?}");
    }

    #[test]
    fn what_is_not_known_changes_nothing() {
        assert_eq!(changes(&[(Missing::Lag, 6.0, vec![1.0, f64::NAN])]), [[0.0; 2]; 0]);
    }
}
