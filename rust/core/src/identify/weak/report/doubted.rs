//! What stands of a term or a lag that seems to be missing where equations are wrong by more than noise.

use crate::error::Error;
use crate::identify::weak::session::Session;
use crate::inference::missing_terms::{JudgedTerm, Suspect, of_blocks};
use crate::record::samples::Samples;
use crate::weak_form::weak_rows::WeakRows;

/// A difference of the torque so many times those before and after it is a step between two samples.
const ALONE: f64 = 4.0;

/// The variance of a place that may be anywhere between two samples.
const ANYWHERE: f64 = 1.0 / 12.0;

/// A lag of which less is left beside what resists the motion is none.
const MOST: f64 = 0.5;

/// Standard errors of what is left of it that must be gone.
const BEYOND_CHANCE: f64 = 2.0;

/// A suspect and the regressors that it is judged by, itself the last.
#[derive(Clone, Copy)]
pub(crate) struct Doubted<'a> {
    pub(crate) suspect: Suspect,
    pub(crate) regressors: &'a [usize],
    /// The suspect over its coefficient.
    pub(crate) unit: f64,
    pub(crate) rows: StepRows<'a>,
}

/// Rows whose right-hand sides steps of the torque move.
#[derive(Clone, Copy)]
pub(crate) struct StepRows<'a> {
    pub(crate) weak: &'a WeakRows,
    /// The column of the torque's rate among them, if it is there.
    pub(crate) rate: Option<&'a [f64]>,
    /// Whether they were made white.
    pub(crate) are_white: bool,
}

impl Session<'_, '_, '_> {
    /// A conspicuous suspect with an error that does not rest on noise alone: blocks of the record must agree on it, and steps of the torque may have been
    /// anywhere between two samples.
    pub(crate) fn agreed(&mut self, judged: &JudgedTerm<'_>, doubted: Doubted<'_>) -> Result<Suspect, Error> {
        let (mut suspect, unit) = (doubted.suspect, doubted.unit.abs());
        if let Some(rows) = judged.in_rows(doubted.regressors, &mut self.stages)? {
            let steps = self.by_steps(&rows.by, doubted.rows);
            suspect.error = suspect.error.max(unit * rows.error_of_blocks()).hypot(unit * steps);
        }
        Ok(suspect)
    }

    /// The same of a lag. Friction that is smooth looks like one: it turns a part of what moves fast. Beside terms of the velocity, whose regressors come
    /// first, a true one is what it was.
    pub(crate) fn agreed_lag(
        &mut self,
        judged: &JudgedTerm<'_>,
        doubted: Doubted<'_>,
        resisting: &[usize],
    ) -> Result<Suspect, Error> {
        let (unit, mut suspect) = (doubted.unit, self.agreed(judged, doubted)?);
        if resisting.is_empty() || !suspect.is_conspicuous() {
            return Ok(suspect);
        }
        let beside: Vec<usize> = resisting.iter().chain(doubted.regressors).copied().collect();
        let found = judged.factors(&beside, &mut self.stages)?.and_then(|each| each.last().copied());
        if let Some((value, error)) = found {
            let (left, gone) = (unit * value, (suspect.value - unit * value).abs());
            if left / suspect.value < MOST && gone > BEYOND_CHANCE * unit.abs() * error {
                suspect.error = suspect.error.max(gone);
            }
        }
        Ok(suspect)
    }

    /// By how much a coefficient may be wrong since each step of the torque may have been anywhere between two samples, from what rows move it by.
    pub(crate) fn by_steps(&self, by: &[f64], rows: StepRows<'_>) -> f64 {
        let TorqueSteps { each, part } = steps(self.record.torque);
        let StepRows { weak, rate, are_white } = rows;
        if each.is_empty() {
            return 0.0;
        }
        let is_whole = by.len() == WeakRows::count(weak.function, self.record.torque.len());
        let squares = if are_white || self.record.weights.is_some() || !is_whole {
            // Rows are no test functions of the torque: what its rate tells in as many of them as share a sample is that of a step.
            let Some(rate) = rate else { return 0.0 };
            (of_blocks(by, rate, 2 * weak.reach()) * part * self.options.delta).powi(2)
        } else {
            each.iter().map(|&(place, height)| (height * self.moved_by_step(by, weak, place)).powi(2)).sum()
        };
        (squares * ANYWHERE).sqrt()
    }

    /// What steps of the torque leave of its second derivative, in s²: each is known to the variance of its place, half of which sums over samples add and
    /// half the places themselves.
    pub(crate) fn spread_of_steps(&self) -> f64 {
        steps(self.record.torque).part * ANYWHERE * self.options.delta.powi(2)
    }

    /// What a coefficient changes by where a step of one after a sample comes a sample earlier.
    fn moved_by_step(&self, by: &[f64], weak: &WeakRows, place: usize) -> f64 {
        let (stride, kernel) = (weak.stride, &weak.torque);
        #[allow(clippy::cast_possible_truncation, reason = "a lag of a few samples")]
        let Some(place) = place.checked_add_signed(-(self.record.lag.round() as isize)) else { return 0.0 };
        let first = (place + 2).saturating_sub(kernel.len()).div_ceil(stride);
        let last = (place / stride + 1).min(by.len()).max(first);
        let between = |row: usize| {
            let at = place - row * stride;
            0.5 * kernel.get(at..=at + 1).map_or(0.0, |two| two[0] + two[1])
        };
        (first..last).map(|row| by[row] * between(row)).sum()
    }
}

/// Changes of a torque from one sample to the next that stand alone: the sample before each and its height, and which part of all changes they are, as
/// squares: nothing where it moves smoothly, all of it where it is constant between steps.
struct TorqueSteps {
    each: Vec<(usize, f64)>,
    part: f64,
}

fn steps(torque: &dyn Samples) -> TorqueSteps {
    let mut values = vec![0.0; torque.len()];
    torque.read(0, &mut values);
    let changes: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let (mut each, mut alone, mut all) = (Vec::new(), 0.0, 0.0);
    for (place, around) in changes.windows(3).enumerate() {
        if !around.iter().all(|change| change.is_finite()) {
            continue;
        }
        let square = around[1] * around[1];
        all += square;
        if around[1].abs() > ALONE * around[0].abs().max(around[2].abs()) {
            alone += square;
            each.push((place + 1, around[1]));
        }
    }
    TorqueSteps { each, part: if all > 0.0 { alone / all } else { 0.0 } }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_changes_between_two_samples_alone_is_a_step() {
        let part = |value: fn(usize) -> f64| {
            let values: Vec<f64> = (0..1000).map(value).collect();
            steps(&values.as_slice()).part
        };
        assert!(part(|at| if at / 50 % 2 == 0 { 1.0 } else { -1.0 }) == 1.0);
        assert!(part(|at| (0.05 * at as f64).sin()) < 1e-3);
        assert!(part(|_| 2.0) == 0.0);
        // Half of the squares are those of a sine whose greatest change is a tenth: a thousand of a two-hundredth.
        let both = part(|at| 2.0 * (0.05 * at as f64).sin() + if at < 500 { 0.0 } else { 5.0_f64.sqrt() });
        assert!((both - 0.5).abs() < 0.1, "{both}");
    }

    #[test]
    fn steps_are_found_at_the_samples_before_them() {
        let values: Vec<f64> = (0..100).map(|at| if at < 40 { 1.0 } else { -2.0 }).collect();
        assert_eq!(steps(&values.as_slice()).each, [(39, -3.0)]);
    }

    #[test]
    fn missing_samples_tell_nothing() {
        let mut values = vec![0.0; 100];
        (values[30], values[60]) = (f64::NAN, f64::INFINITY);
        let found = steps(&values.as_slice());
        assert!(found.part == 0.0 && found.each.is_empty());
    }
}
