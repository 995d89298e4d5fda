//! Samples that hold one and the same value in place of a reading that failed, as 0 or -999: the channel jumps there, and comes back.
//!
//! A torque that acts may do so as well, as one that is switched does. But then its other values repeat, or are another one after the pause, or pauses
//! are long. And a channel that is clipped stays at its extremes; but it comes near them as well, or stays at both.

use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::Watch;
use crate::noise::defects::{Defect, defects};
use crate::noise::median::median;
use crate::noise::quantisation::quantisation_step;
use crate::noise::walk::each_part;
use crate::record::samples::{Samples, is_usable};
use crate::record::subsample::stretches;

/// Samples that say what a usual change is, in so many stretches.
const MOST_SAMPLES: usize = 1 << 17;
const STRETCHES: usize = 64;

/// A jump, in usual changes, and in changes just before it.
const JUMPS: f64 = 6.0;
const SUDDEN: f64 = 4.0;

/// How many jumps there are to a value at least, and by what part of the jump the channel may be elsewhere when it comes back, and how often it must.
const FEWEST: usize = 4;
const BACK: f64 = 0.5;
const MOSTLY: f64 = 0.75;

/// One over the part of the jumps as often as which a channel that is clipped comes to its extreme without one.
const GRAZES: usize = 4;

/// One over the part of the samples from which on a pause belongs to what the machine does.
const SELDOM: usize = 10;

/// Values that a channel jumps to which are looked at.
const MOST_JUMPS: usize = 1 << 16;

/// A stretch of one value between others.
struct Pause {
    places: Range<usize>,
    /// What stands before and after it.
    sides: [f64; 2],
}

/// How many samples of the angle and of the torque hold one value in place of a reading. Costs two walks over the record.
///
/// # Errors
/// If the watch cancels.
pub fn unread_counts(angle: &dyn Samples, torque: &dyn Samples, watch: &mut Watch<'_>) -> Result<[usize; 2], Error> {
    Ok([unread(angle, watch)?.len(), unread(torque, watch)?.len()])
}

/// The samples at which a channel was not read, in order. Costs two walks over the record.
///
/// # Errors
/// If the watch cancels.
pub(crate) fn unread(channel: &dyn Samples, watch: &mut Watch<'_>) -> Result<Vec<usize>, Error> {
    let Some(usual) = usual_change(channel) else { return Ok(Vec::new()) };
    let Some(value) = jumped_to(channel, JUMPS * usual, watch)? else { return Ok(Vec::new()) };
    // A channel that was not rounded has a value twice only where it was not read.
    let is_rare = quantisation_step(channel) == 0.0;
    let (mut places, mut sudden, mut back) = (Vec::new(), 0, 0);
    let (pauses, [least, most]) = pauses(channel, value, watch)?;
    let (is_extreme, count) = (value <= least || value >= most, pauses.len());
    for pause in pauses {
        let jumps = pause.sides.map(|side| (side - value).abs());
        let is_jump = jumps.map(|jump| jump > JUMPS * usual);
        if is_jump == [true; 2] {
            sudden += 1;
            back += usize::from((pause.sides[0] - pause.sides[1]).abs() < BACK * jumps[0].max(jumps[1]));
        }
        if is_rare || is_jump != [false; 2] {
            places.extend(pause.places);
        }
    }
    let is_no_reading =
        sudden >= FEWEST && back as f64 >= MOSTLY * sudden as f64 && SELDOM * places.len() <= channel.len();
    let is_clipped = || is_extreme && (count - sudden > sudden / GRAZES || stays_at_both(channel));
    Ok(if is_no_reading && !is_clipped() { places } else { Vec::new() })
}

/// The median change from one sample to the next of those that change.
fn usual_change(channel: &dyn Samples) -> Option<f64> {
    let mut changes = Vec::new();
    let mut samples = Vec::new();
    for places in stretches(channel.len(), MOST_SAMPLES, STRETCHES) {
        samples.resize(places.len(), 0.0);
        channel.read(places.start, &mut samples);
        let pairs = samples.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        changes.extend(pairs.filter(|&change| change > 0.0 && is_usable(change)));
    }
    median(&mut changes)
}

/// The value that a channel jumps to most often, if it does often enough.
fn jumped_to(channel: &dyn Samples, jump: f64, watch: &mut Watch<'_>) -> Result<Option<f64>, Error> {
    let mut values = Vec::new();
    let mut before = [f64::NAN; 2];
    each_usable(channel, watch, |_, value| {
        let [last, change] = [before[1], (before[1] - before[0]).abs()];
        let by = (value - last).abs();
        if by > jump && by > SUDDEN * change && values.len() < MOST_JUMPS {
            values.push(value);
        }
        before = [last, value];
    })?;
    values.sort_unstable_by(f64::total_cmp);
    let most = values.chunk_by(|one, other| one == other).max_by_key(Samples::len);
    Ok(most.filter(|equal| equal.len() >= FEWEST).map(|equal| equal[0]))
}

/// Whether a channel is clipped at its smallest and at its largest value.
fn stays_at_both(channel: &dyn Samples) -> bool {
    let limits = defects(channel).iter().find_map(Defect::limits);
    limits.is_some_and(|limits| limits.iter().all(|limit| limit.is_finite()))
}

/// The stretches in which a channel holds a value, that other values surround, and the smallest and largest of these.
fn pauses(channel: &dyn Samples, value: f64, watch: &mut Watch<'_>) -> Result<(Vec<Pause>, [f64; 2]), Error> {
    let mut found: Vec<Pause> = Vec::new();
    let mut extremes = [f64::INFINITY, f64::NEG_INFINITY];
    let (mut before, mut first) = (f64::NAN, None);
    each_usable(channel, watch, |place, sample| {
        if sample == value {
            first = first.or(Some(place));
            return;
        }
        if let Some(begin) = first.take().filter(|_| is_usable(before)) {
            found.push(Pause { places: begin..place, sides: [before, sample] });
        }
        extremes = [extremes[0].min(sample), extremes[1].max(sample)];
        before = sample;
    })?;
    Ok((found, extremes))
}

/// Does something with every usable sample, in order.
fn each_usable(channel: &dyn Samples, watch: &mut Watch<'_>, mut work: impl FnMut(usize, f64)) -> Result<(), Error> {
    each_part(channel, 0, watch, |first, samples| {
        let usable = samples.iter().enumerate().filter(|(_, value)| is_usable(**value));
        usable.for_each(|(k, &value)| work(first + k, value));
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::quantisation::tests::uniform;

    const SAMPLES: usize = 8000;

    fn found(channel: &[f64]) -> Vec<usize> {
        unread(&channel, &mut |_, _| true).unwrap()
    }

    /// A slow motion, and noise.
    fn moving(noise: f64) -> Vec<f64> {
        let motion = |n: usize| (0.05 * n as f64).sin() + 0.6 * (0.017 * n as f64).sin();
        uniform(SAMPLES).iter().enumerate().map(|(n, white)| motion(n) + noise * white).collect()
    }

    #[test]
    fn what_jumps_to_one_value_and_back_was_not_read() {
        for (value, length) in [(0.0, 1), (0.0, 5), (-999.0, 3), (0.3, 8)] {
            let mut channel = moving(0.02);
            let first = |count: usize| 300 + 371 * count;
            (0..20).for_each(|count| channel[first(count)..first(count) + length].fill(value));
            let places = found(&channel);
            assert_eq!(places.len(), 20 * length, "{value} {length}");
            assert!(places.iter().all(|&place| channel[place] == value && (place - 300) % 371 < length));
        }
    }

    #[test]
    fn a_channel_that_is_clipped_was_read() {
        // Levels of a torque, with noise.
        let noise = uniform(SAMPLES);
        let level = |n: usize| 4.0 * noise[n / 100 * 7 % SAMPLES];
        let steps: Vec<f64> = (0..SAMPLES).map(|n| level(n) + 0.05 * noise[n]).collect();
        assert_eq!(found(&steps), [0; 0]);
        for limits in [[-1.85, 1.85], [-1.85, f64::INFINITY]] {
            let clipped: Vec<f64> = steps.iter().map(|value| value.clamp(limits[0], limits[1])).collect();
            assert!(clipped.contains(&limits[0]));
            assert_eq!(found(&clipped), [0; 0], "{limits:?}");
        }
    }

    #[test]
    fn what_a_machine_does_was_read() {
        assert_eq!(found(&moving(0.02)), [0; 0]);
        assert_eq!(found(&moving(0.0)), [0; 0]);
        let rounded: Vec<f64> = moving(0.1).iter().map(|value| (20.0 * value).round() / 20.0).collect();
        assert_eq!(found(&rounded), [0; 0]);
        let switched: Vec<f64> = (0..SAMPLES).map(|n| if n % 100 < 30 { 0.0 } else { 1.0 }).collect();
        assert_eq!(found(&switched), [0; 0]);
        let bursts: Vec<f64> =
            moving(0.0).iter().enumerate().map(|(n, value)| if n % 1000 < 500 { *value } else { 0.0 }).collect();
        assert_eq!(found(&bursts), [0; 0]);
        let wrapped: Vec<f64> = (0..SAMPLES).map(|n| f64::from(u8::try_from(n * 3 % 256).unwrap())).collect();
        assert_eq!(found(&wrapped), [0; 0]);
        assert_eq!(found(&[1.0; 5]), [0; 0]);
        assert_eq!(found(&[]), [0; 0]);
    }
}
