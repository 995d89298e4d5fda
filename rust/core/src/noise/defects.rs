//! What a recorder did to a channel: clipped, held, interpolated or wrapped samples, recognised by their repeats, extremes and straight lines.

use crate::record::samples::{Samples, is_usable};
use crate::record::subsample::stretches;

/// Samples of a long record that are looked at, in so many stretches.
const MOST_SAMPLES: usize = 1 << 20;
const STRETCHES: usize = 8;

/// Samples in a row at an extreme, such runs, and samples in them, from which on a channel may be clipped.
const RUN: usize = 3;
const FEWEST_RUNS: usize = 3;
const FEWEST_CLIPPED: usize = 20;

/// A motion that turns round or comes to rest slows down before; one that is clipped arrives with at least this part of its typical speed, or jumps by so
/// many typical changes.
const ARRIVES: f64 = 0.2;
const JUMPS: f64 = 2.0;

/// Steps finer than the typical change by this factor show that.
const FINE: f64 = 2.0;

/// The longest hold that is looked for, the part of the changes that must come in its beat, and how many changes and how often there must be.
const LONGEST_HOLD: usize = 50;
const IN_BEAT: f64 = 0.99;
const FEWEST_CHANGES: usize = 50;
const CHANGES_OF_HOLDS: f64 = 0.5;

/// Samples lie on a straight line if they bend by no more than so many roundings of the largest value.
const STRAIGHT: f64 = 16.0;

/// A wrapped angle jumps by nearly its whole range, and changes by less than this part of it elsewhere.
const WHOLE: f64 = 0.8;
const STEADY: f64 = 0.1;
const FEWEST_JUMPS: usize = 2;

/// What was done to a channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Defect {
    /// Samples lie at the smallest or largest value.
    Clipped {
        /// The part of the samples that does.
        part: f64,
        /// These values, infinite where no run of samples lies at one.
        limits: [f64; 2],
    },
    /// This part of the samples lies at the smallest or largest value, and equations with them are left out.
    LeftOut(f64),
    /// Every value stands for so many samples.
    Held(usize),
    /// Samples lie on straight lines from one to the next but so many.
    Interpolated(usize),
    /// The angle jumps by so much.
    Wrapped(f64),
    /// The angle jumps between two samples at so many places, where samples were lost.
    Broken(usize),
    /// It is filtered by more than the lag that is given explains, which changes constants by up to this part of them.
    Filtered(f64),
}

/// A lag lies so many standard errors and more on one side of a limit.
const SURE: f64 = 4.0;
/// Steps that a recorder makes are late by half of what they hold, those of a drive by nothing: the limit between both, of what is held.
const BETWEEN: f64 = 0.25;

impl Defect {
    /// Whether the motion says that a torque which is held acts as it is recorded, with a lag in samples and its standard error: one that its
    /// recorder holds is late by half of that, and this one is not.
    pub(crate) fn acts_in_steps(&self, late: f64, error: f64) -> bool {
        matches!(*self, Self::Held(count) if late + SURE * error < BETWEEN * (count - 1) as f64)
    }

    /// The limits that it is about.
    pub(crate) fn limits(&self) -> Option<[f64; 2]> {
        match self {
            Self::Clipped { limits, .. } => Some(*limits),
            _ => None,
        }
    }

    /// What it is called.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Clipped { .. } => "clipped",
            Self::LeftOut(_) => "left out",
            Self::Held(_) => "held",
            Self::Interpolated(_) => "interpolated",
            Self::Wrapped(_) => "wrapped",
            Self::Broken(_) => "broken",
            Self::Filtered(_) => "filtered",
        }
    }

    /// Says that clipped samples are left out.
    pub(crate) fn leave_out(&mut self) {
        if let Self::Clipped { part, .. } = *self {
            *self = Self::LeftOut(part);
        }
    }

    /// Whether the channel is doubtful: what is broken is left out of the equations.
    #[must_use]
    pub fn is_doubtful(&self) -> bool {
        !matches!(self, Self::Broken(_))
    }

    /// How much of it there is: a part of the samples or of the constants, samples, the angle's unit or places.
    #[must_use]
    #[allow(clippy::cast_precision_loss, reason = "a few samples or places")]
    pub fn amount(&self) -> f64 {
        match *self {
            Self::Clipped { part: amount, .. }
            | Self::LeftOut(amount)
            | Self::Wrapped(amount)
            | Self::Filtered(amount) => amount,
            Self::Held(count) | Self::Interpolated(count) | Self::Broken(count) => count as f64,
        }
    }
}

/// A channel whose samples at its limits are missing.
pub(crate) struct Within<'a> {
    pub(crate) channel: &'a dyn Samples,
    pub(crate) limits: [f64; 2],
}

impl Samples for Within<'_> {
    fn len(&self) -> usize {
        self.channel.len()
    }

    fn read(&self, first: usize, into: &mut [f64]) {
        self.channel.read(first, into);
        let [least, most] = self.limits;
        for value in into.iter_mut().filter(|value| **value <= least || **value >= most) {
            *value = f64::NAN;
        }
    }
}

/// What was done to a channel, as far as its samples tell. Costs one look at up to a million samples.
pub(crate) fn defects(channel: &dyn Samples) -> Vec<Defect> {
    let part = |range: std::ops::Range<usize>| {
        let mut values = vec![0.0; range.len()];
        channel.read(range.start, &mut values);
        values
    };
    let parts: Vec<Vec<f64>> = stretches(channel.len(), MOST_SAMPLES, STRETCHES).map(part).collect();
    let usable = || parts.iter().flatten().copied().filter(|&value| is_usable(value));
    let [least, most] = [usable().fold(f64::INFINITY, f64::min), usable().fold(f64::NEG_INFINITY, f64::max)];
    if most <= least || most.is_nan() || least.is_nan() || most == f64::NEG_INFINITY {
        return Vec::new();
    }
    let parts: Vec<&[f64]> = parts.iter().map(Vec::as_slice).collect();
    let largest = most.abs().max(least.abs());
    let found =
        [wrapped(&parts, most - least), held(&parts), interpolated(&parts, largest), clipped(&parts, [least, most])];
    found.into_iter().flatten().collect()
}

/// The changes from sample to sample, of usable ones.
fn changes<'a>(parts: &'a [&'a [f64]]) -> impl Iterator<Item = f64> + 'a {
    let pairs = parts.iter().flat_map(|part| part.windows(2));
    pairs.map(|pair| pair[1] - pair[0]).filter(|change| change.is_finite())
}

fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0_f64), |(sum, count), value| (sum + value * value, count + 1.0));
    (sum / count.max(1.0)).sqrt()
}

fn clipped(parts: &[&[f64]], extremes: [f64; 2]) -> Option<Defect> {
    let finest = changes(parts).map(f64::abs).filter(|&change| change > 0.0).fold(f64::INFINITY, f64::min);
    let typical = root_mean_square(changes(parts));
    if typical < FINE * finest {
        return None;
    }
    let (mut count, mut arrivals) = (0, Vec::new());
    let mut limits = [f64::NEG_INFINITY, f64::INFINITY];
    for part in parts {
        for (extreme, limit) in extremes.into_iter().zip(&mut limits) {
            let mut place = 0;
            while let Some(first) = part[place..].iter().position(|&value| value == extreme).map(|next| place + next) {
                let end =
                    part[first..].iter().position(|&value| value != extreme).map_or(part.len(), |run| first + run);
                if end - first >= RUN {
                    *limit = extreme;
                    count += end - first;
                    if first >= 2 {
                        let jump = (extreme - part[first - 1]).abs();
                        let before = (part[first - 1] - part[first - 2]).abs();
                        arrivals.push(if jump > JUMPS * typical { jump } else { before });
                    }
                }
                place = end;
            }
        }
    }
    arrivals.sort_by(f64::total_cmp);
    let arrival = arrivals.get(arrivals.len() / 2).copied().unwrap_or(0.0);
    let samples = parts.iter().fold(0, |samples, part| samples + part.len());
    let is_clipped = arrivals.len() >= FEWEST_RUNS && count >= FEWEST_CLIPPED && arrival > ARRIVES * typical;
    is_clipped.then(|| Defect::Clipped { part: count as f64 / samples as f64, limits })
}

fn held(parts: &[&[f64]]) -> Option<Defect> {
    let samples = parts.iter().fold(0, |samples, part| samples + part.len());
    let still = changes(parts).filter(|&change| change == 0.0).count();
    if 3 * still < samples {
        return None;
    }
    beat(parts, 2, |pair| pair[0] != pair[1]).map(Defect::Held)
}

/// Whether a channel was drawn in straight lines between samples that were recorded: all others have no second difference.
fn interpolated(parts: &[&[f64]], largest: f64) -> Option<Defect> {
    let rounding = STRAIGHT * f64::EPSILON * largest;
    let bends = |three: &[f64]| (three[0] - 2.0 * three[1] + three[2]).abs() > rounding;
    let samples = parts.iter().fold(0, |samples, part| samples + part.len());
    let moves = |three: &&[f64]| (three[1] - three[0]).abs() > rounding;
    let straight = parts.iter().flat_map(|part| part.windows(3)).filter(moves).filter(|three| !bends(three)).count();
    if 3 * straight < samples {
        return None;
    }
    beat(parts, 3, bends).map(Defect::Interpolated)
}

/// Every how many samples something is seen in some neighbours: in one beat, and often; the largest such number.
fn beat(parts: &[&[f64]], neighbours: usize, is_seen: impl Fn(&[f64]) -> bool) -> Option<usize> {
    let samples = parts.iter().fold(0, |samples, part| samples + part.len());
    (2..=LONGEST_HOLD).rev().find(|&hold| {
        let (mut all, mut in_beat) = (0, 0);
        for part in parts {
            let mut beats = vec![0; hold];
            for (place, _) in part.windows(neighbours).enumerate().filter(|(_, neighbours)| is_seen(neighbours)) {
                beats[place % hold] += 1;
            }
            all += beats.iter().sum::<usize>();
            in_beat += beats.into_iter().max().unwrap_or(0);
        }
        let often = all as f64 >= CHANGES_OF_HOLDS * samples as f64 / hold as f64;
        all >= FEWEST_CHANGES && often && in_beat as f64 >= IN_BEAT * all as f64
    })
}

fn wrapped(parts: &[&[f64]], range: f64) -> Option<Defect> {
    let jumps: Vec<f64> = changes(parts).map(f64::abs).filter(|&change| change >= WHOLE * range).collect();
    let elsewhere = changes(parts).filter(|change| change.abs() < WHOLE * range);
    let steady = root_mean_square(elsewhere) < STEADY * range;
    let mean = jumps.iter().sum::<f64>() / jumps.len().max(1) as f64;
    (jumps.len() >= FEWEST_JUMPS && steady).then_some(Defect::Wrapped(mean))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hold_that_is_not_late_acts_in_steps() {
        for (late, error, acts) in [(-0.5, 0.1, true), (2.0, 0.1, false), (0.0, 0.3, false), (0.0, f64::NAN, false)] {
            assert_eq!(Defect::Held(5).acts_in_steps(late, error), acts, "{late}");
            assert!(!Defect::Interpolated(5).acts_in_steps(late, error));
        }
    }

    fn wave(sample: usize) -> f64 {
        (sample as f64 * 0.02).sin() + 0.3 * (sample as f64 * 0.053).sin()
    }

    fn of(value: impl Fn(usize) -> f64) -> Vec<Defect> {
        let values: Vec<f64> = (0..5000).map(value).collect();
        defects(&values.as_slice())
    }

    #[test]
    fn a_good_channel_has_no_defects() {
        assert_eq!(of(wave), []);
        // An encoder dwells at turning points, a machine at rest.
        assert_eq!(of(|sample| (wave(sample) * 1000.0).round() / 1000.0), []);
        assert_eq!(of(|sample| (wave(sample) * 5.0).round() / 5.0), []);
        assert_eq!(of(|sample| wave(sample.clamp(400, 2500))), []);
        assert_eq!(of(|_| 1.0), []);
        // A machine that turns at one speed, and one that is driven to and fro at one.
        assert_eq!(of(|sample| 0.1 * sample as f64), []);
        assert_eq!(of(|sample| (0.01 * (sample % 400) as f64 - 2.0).abs()), []);
        assert_eq!(of(|_| f64::NAN), []);
    }

    #[test]
    fn what_was_done_to_a_channel_is_recognised() {
        let found = of(|sample| wave(sample).clamp(-1.0, 1.0));
        let [Defect::Clipped { part, limits }] = found[..] else { panic!("{found:?}") };
        assert!(part > 0.05 && part < 0.5 && limits == [-1.0, 1.0], "{found:?}");
        let found = of(|sample| wave(sample).min(1.0));
        let [Defect::Clipped { limits, .. }] = found[..] else { panic!("{found:?}") };
        assert_eq!(limits, [f64::NEG_INFINITY, 1.0]);
        // A torque in steps jumps to its limits.
        let steps = |sample: usize| 2.0 * wave(sample / 40 * 371);
        let found = of(|sample| {
            steps(sample).clamp(-1.5, 1.5) + 1e-3 * wave(sample * 17).min(0.0) * f64::from(steps(sample).abs() < 1.5)
        });
        assert!(found.iter().any(|one| matches!(one, Defect::Clipped { .. })), "{found:?}");
        let (values, mut read) = ([0.5, 1.0, -2.0, 1.5], [0.0; 3]);
        Within { channel: &values.as_slice(), limits }.read(1, &mut read);
        assert!(read[0].is_nan() && read[1] == -2.0 && read[2].is_nan(), "{read:?}");
        assert_eq!(of(|sample| wave(sample / 5 * 5)), [Defect::Held(5)]);
        for every in [2, 5, 50] {
            let line = |sample: usize| {
                let (before, part) = (sample / every * every, (sample % every) as f64 / every as f64);
                wave(before) * (1.0 - part) + wave(before + every) * part
            };
            assert_eq!(of(line), [Defect::Interpolated(every)]);
        }
        let found = of(|sample| (sample as f64 * 0.01).rem_euclid(1.0));
        assert!(matches!(found[..], [Defect::Wrapped(jump)] if (jump - 0.99).abs() < 0.01), "{found:?}");
    }
}
