//! Channels with common times that are not uniform, brought onto a uniform grid by splines.
//!
//! Times are in periods of the grid from its first sample on. The record is cut into stretches on a grid of absolute sample numbers; each is interpolated
//! with so many samples before and after it that their ends do not matter (the influence of a sample on the spline falls by 0.54 a sample at order 7 and
//! faster below), so memory does not grow with the record and the numbers do not depend on threads. Stretches of a block are solved side by side.

use std::num::NonZeroUsize;
use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::{Piece, Watch, map};
use crate::irregular::spline::Splines;
use crate::record::samples::is_usable;
use crate::simd::instructions::Instructions;
use crate::simd::vectors::MOST_LANES;

/// Samples of a stretch, and those around it that its spline passes through too.
const STRETCH: usize = 1 << 10;
const AROUND: usize = 128;

/// Samples of a block: as many stretches as the longest vector has lanes.
const BLOCK: usize = STRETCH * MOST_LANES;

/// Periods by which a sample may be off the grid and still be the grid's own.
const SAME: f64 = 1e-9;

/// How channels are brought onto a grid.
#[derive(Clone, Debug)]
pub struct Resampling {
    /// Time of every sample in periods of the grid, from its first sample on; increasing.
    pub times: Vec<f64>,
    /// Samples of the grid.
    pub grid: usize,
    /// Order of the splines: 1, 3, 5 or 7.
    pub order: usize,
    /// The longest step between samples, in periods, that a spline goes over. Longer ones are gaps: nothing is known there.
    pub bridged: f64,
    /// Whether nothing is known beside samples that are missing, either.
    pub propagate: bool,
}

/// Samples of the grid that one block gives, of every channel.
struct Block {
    first: usize,
    channels: Vec<Vec<f64>>,
}

/// Samples that a spline passes through, channels that have all of them, and places among the wanted times that lie between them.
struct SplinedPart {
    samples: Vec<usize>,
    channels: Vec<usize>,
    wanted: Range<usize>,
}

impl SplinedPart {
    /// What parts that are solved side by side have in common.
    fn kind(&self) -> (&[usize], usize) {
        (&self.channels, self.samples.len())
    }
}

impl Resampling {
    /// The channels at the samples of the grid, NaN where nothing is known.
    ///
    /// # Errors
    /// If the watch cancels.
    pub fn onto_grid(
        &self,
        channels: &[&[f64]],
        workers: NonZeroUsize,
        watch: &mut Watch<'_>,
    ) -> Result<Vec<Vec<f64>>, Error> {
        let work = |samples: Range<usize>, (): &mut ()| self.block(&samples, channels);
        let blocks = map(self.blocks(), workers, || (), work, watch)?;
        let mut found = vec![vec![f64::NAN; self.grid]; channels.len()];
        for block in blocks {
            for (found, part) in found.iter_mut().zip(block.channels) {
                found[block.first..block.first + part.len()].copy_from_slice(&part);
            }
        }
        Ok(found)
    }

    /// The channels at any times, which increase, NaN where nothing is known: of a short record, whose splines pass through all of it.
    #[must_use]
    pub fn at(&self, channels: &[&[f64]], wanted: &[f64]) -> Vec<Vec<f64>> {
        let mut parts = Vec::new();
        self.add_parts(&(0..self.times.len()), channels, (wanted, 0..wanted.len()), &mut parts);
        self.interpolate(parts, channels, wanted)
    }

    /// Parts of the record that are interpolated one by one.
    pub(crate) fn blocks(&self) -> Vec<Piece<Range<usize>>> {
        let samples = self.times.len();
        let ranges = (0..samples).step_by(BLOCK).map(|first| first..samples.min(first + BLOCK));
        ranges.map(|range| Piece { size: range.len(), content: range }).collect()
    }

    /// Samples of the grid from the first time of a block to the first of the next.
    fn places(&self, samples: &Range<usize>) -> Range<usize> {
        let after = |time: f64| {
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "at least zero, at most the grid"
            )]
            let place = (time - SAME).ceil().max(0.0).min(self.grid as f64) as usize;
            place
        };
        let begin = if samples.start == 0 { after(self.times[0]) } else { after(self.times[samples.start]) };
        let end = self.times.get(samples.end).map(|&time| after(time));
        let last = self.times.last().map_or(0, |&time| after(time + 2.0 * SAME + f64::EPSILON).min(self.grid));
        begin..end.unwrap_or(last.max(begin))
    }

    /// The stretches of a block, and the samples that the spline of each passes through: as many of all of them where the record is long enough.
    pub(crate) fn stretches(&self, block: &Range<usize>) -> impl Iterator<Item = (Range<usize>, Range<usize>)> {
        let (end, total) = (block.end, self.times.len());
        block.clone().step_by(STRETCH).map(move |first| {
            let length = STRETCH + 2 * AROUND;
            let begin = first.saturating_sub(AROUND).min(total.saturating_sub(length));
            (first..end.min(first + STRETCH), begin..total.min(begin + length))
        })
    }

    fn block(&self, samples: &Range<usize>, channels: &[&[f64]]) -> Block {
        let places = self.places(samples);
        let wanted: Vec<f64> = places.clone().map(|place| place as f64).collect();
        let mut parts = Vec::new();
        for (stretch, around) in self.stretches(samples) {
            let own = self.places(&stretch);
            let own = own.start - places.start..own.end - places.start;
            self.add_parts(&around, channels, (&wanted, own), &mut parts);
        }
        Block { first: places.start, channels: self.interpolate(parts, channels, &wanted) }
    }

    /// Adds the splines through some samples, for some of the wanted times.
    fn add_parts(
        &self,
        around: &Range<usize>,
        channels: &[&[f64]],
        (wanted, own): (&[f64], Range<usize>),
        parts: &mut Vec<SplinedPart>,
    ) {
        let whole = |channel: &&[f64]| channel[around.clone()].iter().all(|&value| is_usable(value));
        let (together, alone): (Vec<usize>, Vec<usize>) =
            (0..channels.len()).partition(|&place| whole(&channels[place]));
        let groups = std::iter::once(together).filter(|group| !group.is_empty());
        for group in groups.chain(alone.into_iter().map(|one| vec![one])) {
            let usable: Vec<usize> = around.clone().filter(|&sample| is_usable(channels[group[0]][sample])).collect();
            for part in self.parts(&usable) {
                let samples = &usable[part];
                let (begin, end) = (self.times[samples[0]] - SAME, self.times[samples[samples.len() - 1]] + SAME);
                let among = &wanted[own.clone()];
                let inside = among.partition_point(|&at| at < begin)..among.partition_point(|&at| at <= end);
                if !inside.is_empty() {
                    let wanted = own.start + inside.start..own.start + inside.end;
                    parts.push(SplinedPart { samples: samples.to_vec(), channels: group.clone(), wanted });
                }
            }
        }
    }

    /// Parts of the samples that are there between which nothing is known.
    fn parts(&self, usable: &[usize]) -> Vec<Range<usize>> {
        let mut parts = Vec::new();
        let mut begin = 0;
        for place in 1..=usable.len() {
            let apart = usable.get(place).is_none_or(|&sample| {
                let before = usable[place - 1];
                self.times[sample] - self.times[before] > self.bridged || (self.propagate && sample - before > 1)
            });
            if apart {
                parts.push(begin..place);
                begin = place;
            }
        }
        parts
    }

    /// The channels at some times, by splines through the samples of some parts.
    fn interpolate(&self, mut parts: Vec<SplinedPart>, channels: &[&[f64]], wanted: &[f64]) -> Vec<Vec<f64>> {
        let mut found = vec![vec![f64::NAN; wanted.len()]; channels.len()];
        let instructions = Instructions::current();
        parts.sort_by(|one, other| one.kind().cmp(&other.kind()));
        let alike = parts.chunk_by(|one, other| one.kind() == other.kind());
        for parts in alike.flat_map(|parts| parts.chunks(instructions.lanes())) {
            let times = taken(parts, &self.times);
            let splines = Splines::new(&slices(&times), self.order, instructions);
            let of_channel = |channel: &usize| {
                let values = taken(parts, channels[*channel]);
                let coefficients = splines.coefficients(&slices(&values));
                (values, coefficients)
            };
            let (values, coefficients): (Vec<_>, Vec<_>) = parts[0].channels.iter().map(of_channel).unzip();
            for (place, (part, times)) in parts.iter().zip(&times).enumerate() {
                let inside = |&at: &f64| at.clamp(times[0], times[times.len() - 1]);
                let at: Vec<f64> = wanted[part.wanted.clone()].iter().map(inside).collect();
                let coefficients: Vec<&[f64]> = coefficients.iter().map(|parts| parts[place].as_slice()).collect();
                let splined = splines.values(place, &coefficients, &at);
                for ((channel, splined), values) in part.channels.iter().zip(&splined).zip(&values) {
                    let found = &mut found[*channel][part.wanted.clone()];
                    found.copy_from_slice(splined);
                    keep_samples((times, &values[place]), &wanted[part.wanted.clone()], found);
                }
            }
        }
        found
    }
}

/// The numbers of the samples of some parts.
fn taken(parts: &[SplinedPart], of: &[f64]) -> Vec<Vec<f64>> {
    parts.iter().map(|part| part.samples.iter().map(|&sample| of[sample]).collect()).collect()
}

fn slices(lists: &[Vec<f64>]) -> Vec<&[f64]> {
    lists.iter().map(Vec::as_slice).collect()
}

/// What was sampled at the wanted times stays as it is, to the last bit.
fn keep_samples((times, values): (&[f64], &[f64]), wanted: &[f64], found: &mut [f64]) {
    let mut place = 0;
    for (&time, &value) in times.iter().zip(values) {
        while wanted.get(place).is_some_and(|&own| own < time - SAME) {
            place += 1;
        }
        if wanted.get(place).is_some_and(|own| (own - time).abs() <= SAME) {
            found[place] = value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn resampled(resampling: &Resampling, channel: &[f64], workers: usize) -> Vec<f64> {
        let workers = NonZeroUsize::new(workers).unwrap();
        resampling.onto_grid(&[channel], workers, &mut |_, _| true).unwrap().remove(0)
    }

    fn jittered(samples: u32) -> Vec<f64> {
        (0..samples).map(|place| f64::from(place) + 0.15 * (2.9 * f64::from(place)).sin()).collect()
    }

    #[test]
    fn blocks_and_threads_change_nothing() {
        let times = jittered(40_000);
        let samples: Vec<f64> = times.iter().map(|time| (0.02 * time).sin() + 0.3 * (7.7 * time).sin()).collect();
        let grid = times.len() - 1;
        for order in [1, 3, 5, 7] {
            let whole = Resampling { times: times.clone(), grid, order, bridged: 3.0, propagate: false };
            let found = resampled(&whole, &samples, 1);
            assert_eq!(found, resampled(&whole, &samples, 3));
            // A spline through all samples at once.
            let splines = Splines::new(&[&times], order, Instructions::current());
            let at: Vec<f64> = (0..grid).map(|place| (place as f64).max(times[0])).collect();
            let expected = splines.values(0, &[&splines.coefficients(&[&samples])[0]], &at).remove(0);
            for (one, other) in found.iter().zip(&expected) {
                assert!((one - other).abs() < 1e-12, "order {order}: {one} {other}");
            }
        }
    }

    #[test]
    fn any_times_are_as_those_of_the_grid() {
        let times = jittered(500);
        let samples: Vec<f64> = times.iter().map(|time| (0.1 * time).sin()).collect();
        let resampling = Resampling { times, grid: 499, order: 5, bridged: 3.0, propagate: false };
        let quarters: Vec<f64> = (0..1992).map(|place| f64::from(place) / 4.0).collect();
        let found = resampling.at(&[&samples], &quarters).remove(0);
        let grid = resampled(&resampling, &samples, 1);
        for (place, (value, time)) in found.iter().zip(&quarters).enumerate() {
            assert!((value - (0.1 * time).sin()).abs() < 1e-6, "{time}: {value}");
            assert!(place % 4 > 0 || value.to_bits() == grid[place / 4].to_bits(), "{time}: {value}");
        }
    }

    #[test]
    fn gaps_stay_gaps_and_samples_on_the_grid_stay_as_they_are() {
        let kept: Vec<usize> = (0..1000).filter(|place| !(300..320).contains(place) && *place != 500).collect();
        let times: Vec<f64> = kept.iter().map(|&place| place as f64).collect();
        let samples: Vec<f64> = times.iter().map(|time| (0.1 * time).sin()).collect();
        let mut resampling = Resampling { times, grid: 1000, order: 5, bridged: 3.0, propagate: false };
        let found = resampled(&resampling, &samples, 1);
        for (&place, value) in kept.iter().zip(&samples) {
            assert_eq!(found[place].to_bits(), value.to_bits());
        }
        assert!(found[300..320].iter().all(|value| value.is_nan()));
        assert!((found[500] - 50.0_f64.sin()).abs() < 1e-6);
        // A sample that is there but missing is as one that is not.
        let mut holed = samples;
        holed[100] = f64::NAN;
        let bridged = resampled(&resampling, &holed, 1);
        assert!((bridged[100] - 10.0_f64.sin()).abs() < 1e-6);
        resampling.propagate = true;
        let kept = resampled(&resampling, &holed, 1);
        assert!(kept[100].is_nan() && kept[99].to_bits() == bridged[99].to_bits());
    }
}
