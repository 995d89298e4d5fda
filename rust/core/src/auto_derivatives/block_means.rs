//! Means of 3, 9, 27 … neighbouring samples, for windows that are many times longer.
//!
//! The means lie on grids that are the same from both ends of a record, each grid within the finer ones. Every mean belongs to the sample at its
//! centre. The mean of a polynomial is a polynomial in the mean's number, so nothing that a window could follow is lost
//! ([`crate::auto_derivatives::deconvolution`]). What is lost is some of what the samples within a mean say of high degrees.

use std::ops::Range;

use crate::auto_derivatives::symmetric_grid::Blocks;
use crate::error::Error;
use crate::exec::memory;
use crate::record::samples::{Samples, is_usable};

/// Longer records are looked at by means, and in stretches.
pub(crate) const WHOLE: usize = 1 << 16;

/// Samples of a mean of the next grid, over those of a mean of this one.
pub(crate) const COARSER: usize = 3;

/// Means that half a window has, at least. Then the variance of an acceleration of order 14 is at most 2.7 % larger than without means, and
/// that of order 8 less than 1 %.
const LEAST_IN_HALF: usize = 48;

/// Means that are made at a time.
const TOGETHER: usize = 1 << 12;

/// Where the means of so many samples lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Grid {
    /// Samples of a mean, an odd number, and so from one mean to the next.
    pub(crate) step: usize,
    /// The sample of the first.
    pub(crate) first: usize,
    pub(crate) count: usize,
}

impl Grid {
    pub(crate) fn new(samples: usize, step: usize) -> Self {
        let begin = Blocks::new(samples, step).first_whole();
        Self { step, first: begin + step / 2, count: samples.saturating_sub(begin) / step }
    }

    /// The sample of a mean.
    pub(crate) fn sample(self, mean: usize) -> usize {
        self.first + mean * self.step
    }

    /// The means that belong to some of the samples.
    pub(crate) fn means(self, samples: &Range<usize>) -> Range<usize> {
        let mean = |sample: usize| {
            let distance = sample.saturating_sub(self.first);
            // Samples themselves are common, and divisions slow.
            if self.step == 1 { distance } else { distance.div_ceil(self.step) }.min(self.count)
        };
        mean(samples.start)..mean(samples.end)
    }
}

/// Samples of the means that a window of some half-width is made of.
pub(crate) fn step_for(half: usize) -> usize {
    let mut step = 1;
    while half >= LEAST_IN_HALF * COARSER * step {
        step *= COARSER;
    }
    step
}

/// The same of windows at an end, where high degrees change faster.
pub(crate) fn step_at_end(half: usize) -> usize {
    (step_for(half) / COARSER).max(1)
}

/// The mean of some samples; NaN where one of them is unusable. A constant is exactly its mean.
pub(crate) fn mean(samples: &[f64]) -> f64 {
    let centre = samples[samples.len() / 2];
    let sum: f64 = samples.iter().map(|value| value - centre).sum();
    if samples.iter().all(|&value| is_usable(value)) { centre + sum / samples.len() as f64 } else { f64::NAN }
}

/// A record and its means.
pub(crate) struct BlockMeans<'a> {
    record: &'a dyn Samples,
    /// Finest first.
    levels: Vec<Level>,
}

struct Level {
    grid: Grid,
    means: Vec<f64>,
}

impl Samples for Level {
    fn len(&self) -> usize {
        self.means.len()
    }

    fn read(&self, first: usize, into: &mut [f64]) {
        self.means.as_slice().read(first, into);
    }
}

impl<'a> BlockMeans<'a> {
    /// Takes the means that windows up to some half-width are made of.
    ///
    /// # Errors
    /// If there is not the memory.
    pub(crate) fn new(record: &'a dyn Samples, longest: usize) -> Result<Self, Error> {
        let mut all = Self { record, levels: Vec::new() };
        let mut step = COARSER;
        while step <= step_for(longest) {
            let level = all.next(Grid::new(record.len(), step))?;
            all.levels.push(level);
            step *= COARSER;
        }
        Ok(all)
    }

    /// The means of a grid from those of the last.
    fn next(&self, grid: Grid) -> Result<Level, Error> {
        memory::ask_for_numbers(grid.count)?;
        let finer_step = grid.step / COARSER;
        let (finer, below) = (self.of(finer_step), Grid::new(self.record.len(), finer_step));
        let begin = below.means(&(grid.first - finer_step..grid.first)).start;
        let mut means = Vec::with_capacity(grid.count);
        let mut parts = vec![0.0; COARSER * TOGETHER];
        for first in (0..grid.count).step_by(TOGETHER) {
            let parts = &mut parts[..COARSER * TOGETHER.min(grid.count - first)];
            finer.read(begin + COARSER * first, parts);
            means.extend(parts.chunks_exact(COARSER).map(mean));
        }
        Ok(Level { grid, means })
    }

    /// The record.
    pub(crate) fn record(&self) -> &'a dyn Samples {
        self.record
    }

    /// Samples of the longest means of which so many samples hold so many; one where the record is not long.
    pub(crate) fn coarsest(&self, length: usize, least: usize) -> usize {
        if self.record.len() <= WHOLE {
            return 1;
        }
        let most = length / least;
        self.levels.iter().map(|level| level.grid.step).filter(|&step| step <= most).max().unwrap_or(1)
    }

    /// The means of so many samples; those of one are the record.
    pub(crate) fn of(&self, step: usize) -> &dyn Samples {
        if let Some(level) = self.levels.iter().find(|level| level.grid.step == step) {
            return level;
        }
        debug_assert_eq!(step, 1, "no window is longer than means were made for");
        self.record
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_lie_in_one_another_and_are_the_same_from_both_ends() {
        for samples in [1000, 1001, 1002, 1003, 9999] {
            let record: Vec<f64> = (0..samples).map(|i| (i as f64 * 0.37).sin()).collect();
            let turned: Vec<f64> = record.iter().rev().copied().collect();
            let (record, turned) = (record.as_slice(), turned.as_slice());
            let means = BlockMeans::new(&record, 3000).expect("little memory");
            let backwards = BlockMeans::new(&turned, 3000).expect("little memory");
            for step in [3, 9, 27] {
                let (grid, finer) = (Grid::new(samples, step), Grid::new(samples, step / 3));
                let (mut own, mut other) = (vec![0.0; grid.count], vec![0.0; grid.count]);
                means.of(step).read(0, &mut own);
                backwards.of(step).read(0, &mut other);
                other.reverse();
                for (place, (mean, turned)) in own.iter().zip(&other).enumerate() {
                    let centre = grid.sample(place);
                    assert_eq!((centre - finer.first) % finer.step, 0);
                    let part = &record[centre - step / 2..=centre + step / 2];
                    assert!((mean - part.iter().sum::<f64>() / step as f64).abs() < 4.0 * f64::EPSILON);
                    assert!((mean - turned).abs() < 4.0 * f64::EPSILON);
                }
                let last = grid.sample(grid.count - 1);
                assert_eq!(grid.first, samples - 1 - last);
            }
        }
    }
}
