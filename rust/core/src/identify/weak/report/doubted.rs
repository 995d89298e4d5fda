//! What stands of a term or a lag that seems to be missing where equations are wrong by more than noise.

use crate::error::Error;
use crate::identify::weak::session::Session;
use crate::inference::missing_terms::{JudgedTerm, Suspect};
use crate::record::samples::Samples;

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
    /// Rows that share a sample.
    pub(crate) reach: usize,
}

impl Session<'_, '_, '_> {
    /// A conspicuous suspect with an error that does not rest on noise alone: blocks of the record must agree on it.
    pub(crate) fn agreed(
        &mut self,
        judged: &JudgedTerm<'_>,
        Doubted { mut suspect, regressors, unit, .. }: Doubted<'_>,
    ) -> Result<Suspect, Error> {
        if let Some(rows) = judged.in_rows(regressors, &mut self.stages)? {
            suspect.error = suspect.error.max(unit.abs() * rows.error_of_blocks());
        }
        Ok(suspect)
    }

    /// The same of a lag. Where the torque steps between two samples it may have been anywhere between them, and friction that is smooth looks like a lag:
    /// it turns a part of what moves fast. Beside terms of the velocity, whose regressors come first, a true one is what it was.
    pub(crate) fn agreed_lag(
        &mut self,
        judged: &JudgedTerm<'_>,
        doubted: Doubted<'_>,
        resisting: &[usize],
    ) -> Result<Suspect, Error> {
        let (unit, regressors) = (doubted.unit, doubted.regressors);
        let Some(rows) = judged.in_rows(regressors, &mut self.stages)? else { return Ok(doubted.suspect) };
        let last = regressors.last().map_or(&[][..], |&rate| &judged.rows.regressors[rate].value);
        let steps = rows.shares_of_blocks(last, 2 * doubted.reach) * stepping(self.record.torque) * ANYWHERE.sqrt();
        let mut suspect = doubted.suspect;
        suspect.error = suspect.error.max(unit.abs() * rows.error_of_blocks()).hypot(steps);
        if resisting.is_empty() || !suspect.is_conspicuous() {
            return Ok(suspect);
        }
        let beside: Vec<usize> = resisting.iter().chain(regressors).copied().collect();
        let found = judged.factors(&beside, &mut self.stages)?.and_then(|each| each.last().copied());
        if let Some((value, error)) = found {
            let (left, gone) = (unit * value, (suspect.value - unit * value).abs());
            if left / suspect.value < MOST && gone > BEYOND_CHANCE * unit.abs() * error {
                suspect.error = suspect.error.max(gone);
            }
        }
        Ok(suspect)
    }
}

/// The part of the torque's changes from sample to sample, as squares, that stand alone: nothing where it moves smoothly, all of it where it is constant
/// between steps.
fn stepping(torque: &dyn Samples) -> f64 {
    let mut values = vec![0.0; torque.len()];
    torque.read(0, &mut values);
    let changes: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let (mut alone, mut all) = (0.0, 0.0);
    for around in changes.windows(3).filter(|around| around.iter().all(|change| change.is_finite())) {
        let square = around[1] * around[1];
        all += square;
        if around[1].abs() > ALONE * around[0].abs().max(around[2].abs()) {
            alone += square;
        }
    }
    if all > 0.0 { alone / all } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_changes_between_two_samples_alone_is_a_step() {
        let part = |value: fn(usize) -> f64| {
            let values: Vec<f64> = (0..1000).map(value).collect();
            stepping(&values.as_slice())
        };
        assert!(part(|at| if at / 50 % 2 == 0 { 1.0 } else { -1.0 }) == 1.0);
        assert!(part(|at| (0.05 * at as f64).sin()) < 1e-3);
        assert!(part(|_| 2.0) == 0.0);
        // Half of the squares are those of a sine whose greatest change is a tenth: a thousand of a two-hundredth.
        let both = part(|at| 2.0 * (0.05 * at as f64).sin() + if at < 500 { 0.0 } else { 5.0_f64.sqrt() });
        assert!((both - 0.5).abs() < 0.1, "{both}");
    }

    #[test]
    fn missing_samples_tell_nothing() {
        let mut values = vec![0.0; 100];
        (values[30], values[60]) = (f64::NAN, f64::INFINITY);
        assert!(stepping(&values.as_slice()) == 0.0);
    }
}
