//! What resampling does to noise: white noise of variance one, taken at a record's own times and brought onto the grid as its channels are.
//!
//! A spline is not the same filter everywhere, so noise that was white has another density on the grid: at low frequencies more, where samples lie close,
//! and less at high ones. The noise of a resampled channel is what it shows in the highest degrees of short windows, over what white noise of variance one
//! shows there after it went the same way. Rows of the weak form see low frequencies: there its density is that variance times
//!
//! ```text
//! gain = Σ w_i² / samples of the grid,    w_i the weights of the samples in the integral of the spline, in periods.
//! ```

use std::num::NonZeroUsize;
use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::{Watch, map};
use crate::irregular::resampling::Resampling;
use crate::irregular::spline::Splines;
use crate::noise::channel::shown;
use crate::noise::passed::{PassedNoise, Shown};
use crate::simd::instructions::Instructions;

/// Samples of noise that tell what it shows to about one percent.
const ENOUGH: usize = 1 << 17;

/// The most records of noise that are taken the way of a record's channels.
pub const MOST_RECORDS: usize = 8;

/// Takes white noise of variance one the way of a record's channels: as many records as tell it well, and at most so many.
///
/// # Errors
/// If the watch cancels.
pub fn passed_noise(
    resampling: &Resampling,
    most: usize,
    instructions: Instructions,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<PassedNoise, Error> {
    let samples = resampling.times.len();
    let records = (ENOUGH / samples.max(1)).min(most).clamp(1, MOST_RECORDS);
    let noises: Vec<Vec<f64>> = (0..records).map(|record| white(record, samples)).collect();
    let slices: Vec<&[f64]> = noises.iter().map(Vec::as_slice).collect();
    let passed = resampling.onto_grid(&slices, workers, watch)?;
    let shown: Vec<Shown> = passed.iter().map(|record| shown(&record.as_slice(), None, instructions)).collect();
    Ok(PassedNoise { shown: Shown::mean(&shown), gain: gain(resampling, workers, watch)? })
}

/// The density at low frequencies of white noise of variance one, where a uniform grid leaves one.
///
/// # Errors
/// If the watch cancels.
pub fn gain(resampling: &Resampling, workers: NonZeroUsize, watch: &mut Watch<'_>) -> Result<f64, Error> {
    let sums = map(resampling.blocks(), workers, || (), |block, (): &mut ()| squares(resampling, &block), watch)?;
    let (squares, length) = sums.iter().fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d));
    Ok(if length > 0.0 { squares / length } else { 1.0 })
}

/// The squares of a block's weights, and the periods that it covers.
fn squares(resampling: &Resampling, block: &Range<usize>) -> (f64, f64) {
    let (times, instructions) = (&resampling.times, Instructions::current());
    // Samples between which a spline goes, of those around a stretch.
    let mut parts: Vec<(Range<usize>, Range<usize>)> = Vec::new();
    for (stretch, around) in resampling.stretches(block) {
        let mut begin = around.start;
        for end in around.start + 1..=around.end {
            if end == around.end || times[end] - times[end - 1] > resampling.bridged {
                parts.push((stretch.clone(), begin..end));
                begin = end;
            }
        }
    }
    parts.sort_by_key(|(_, part)| part.len());
    let (mut squares, mut length) = (0.0, 0.0);
    let alike = parts.chunk_by(|(_, one), (_, other)| one.len() == other.len());
    for parts in alike.flat_map(|parts| parts.chunks(instructions.lanes())) {
        let lists: Vec<&[f64]> = parts.iter().map(|(_, part)| &times[part.clone()]).collect();
        let weights = Splines::new(&lists, resampling.order, instructions).weights();
        for (((stretch, part), times), weights) in parts.iter().zip(lists).zip(weights) {
            let own = stretch.start.clamp(part.start, part.end)..stretch.end.clamp(part.start, part.end);
            for place in own.start - part.start..own.end - part.start {
                squares += weights[place] * weights[place];
                let (before, after) = (times[place.saturating_sub(1)], times[(place + 1).min(times.len() - 1)]);
                length += (after - before) / 2.0;
            }
        }
    }
    (squares, length)
}

/// Independent numbers of variance one, the same in every call.
fn white(record: usize, samples: usize) -> Vec<f64> {
    let number = |sample: usize| {
        // SplitMix64 of the sample's number.
        let mut bits = (sample as u64 * MOST_RECORDS as u64 + record as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^= bits >> 31;
        3.0_f64.sqrt() * ((bits >> 11) as f64 / (1_u64 << 52) as f64 - 1.0)
    };
    (0..samples).map(number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::channel::variance_after;

    fn passed(jitter: f64, order: usize) -> (Resampling, PassedNoise) {
        let shift = white(7, 30_000);
        let times: Vec<f64> =
            shift.iter().enumerate().map(|(place, shift)| place as f64 + jitter * shift / 12.0_f64.sqrt()).collect();
        let resampling = Resampling { times, grid: 29_998, order, bridged: 3.0, propagate: false };
        let passed =
            passed_noise(&resampling, MOST_RECORDS, Instructions::current(), NonZeroUsize::MIN, &mut |_, _| true)
                .unwrap();
        (resampling, passed)
    }

    #[test]
    fn uniform_times_pass_noise_as_it_is() {
        assert!((passed(0.0, 5).1.gain - 1.0).abs() < 1e-3);
    }

    /// Straight lines weigh a sample by half the distance of its neighbours: the mean square is 1 + j²/24 with a jitter of j steps.
    #[test]
    fn the_gain_of_straight_lines_is_known() {
        let gain = passed(0.8, 1).1.gain;
        assert!((gain - (1.0 + 0.64 / 24.0)).abs() < 1e-3, "{gain}");
    }

    /// 30 000 samples tell a variance to 3 %, as in the tests of noise without resampling.
    #[test]
    fn the_noise_of_a_resampled_channel_is_found_again() {
        for (jitter, order) in [(0.3, 5), (0.9, 3), (0.9, 1)] {
            let (resampling, passed) = passed(jitter, order);
            let own: Vec<f64> = white(6, 30_000).iter().map(|value| 0.1 * value).collect();
            let record = resampling.onto_grid(&[&own], NonZeroUsize::MIN, &mut |_, _| true).unwrap().remove(0);
            let found = variance_after(Some(&passed), &record.as_slice(), None, Some(0.0), Instructions::current());
            assert!((found / (0.01 * passed.gain) - 1.0).abs() < 0.08, "{jitter} {order}: {found}");
        }
    }
}
