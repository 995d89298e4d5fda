//! The weights of candidates at any place: linear between the centres of blocks.

use std::ops::Range;

use crate::auto_derivatives::block_means::{BlockMeans, Grid};
use crate::auto_derivatives::candidate_weights::{AverageScratch, Refinement};

/// Where the estimates of one record go. Slices that are empty are not wanted.
#[derive(Debug)]
pub(crate) struct DerivativeOutputs<'a> {
    pub(crate) values: &'a mut [f64],
    pub(crate) errors: &'a mut [f64],
    pub(crate) order: &'a mut [u8],
}

/// The weights of all candidates in some blocks.
pub(crate) struct LocalWeights<'a> {
    /// The first of the blocks.
    pub(crate) first: usize,
    pub(crate) candidates: usize,
    pub(crate) logarithms: &'a [f64],
    pub(crate) biases: &'a [f64],
    pub(crate) weights: &'a [f64],
    /// Candidates that have any weight.
    pub(crate) used: Vec<bool>,
}

/// A place between the centres of two blocks.
#[derive(Clone, Copy)]
pub(crate) struct Between {
    pub(crate) low: usize,
    pub(crate) high: usize,
    /// From the first centre, in blocks, and from one place to the next.
    pub(crate) distance: f64,
    pub(crate) advance: f64,
}

impl LocalWeights<'_> {
    /// The weight of a candidate at a place, and by how much it grows in a block.
    pub(crate) fn weight(&self, candidate: usize, place: Between) -> (f64, f64) {
        self.line(self.weights, candidate, place)
    }

    /// The same of its squared bias.
    pub(crate) fn bias(&self, candidate: usize, place: Between) -> (f64, f64) {
        self.line(self.biases, candidate, place)
    }

    /// The numbers of all candidates at the centres beside a place.
    pub(crate) fn beside<'b>(&self, numbers: &'b [f64], place: &Between) -> [&'b [f64]; 2] {
        [place.low, place.high].map(|block| &numbers[(block - self.first) * self.candidates..][..self.candidates])
    }

    fn line(&self, numbers: &[f64], candidate: usize, place: Between) -> (f64, f64) {
        let of = |block: usize| numbers[(block - self.first) * self.candidates + candidate];
        let growth = of(place.high) - of(place.low);
        (of(place.low) + growth * place.distance, growth)
    }

    /// The sum of a candidate's weights.
    pub(crate) fn total(&self, candidate: usize) -> f64 {
        self.weights[candidate..].iter().step_by(self.candidates).sum()
    }

    /// Whether any candidate of each bank is used.
    pub(crate) fn banks<'b>(&'b self, of: &'b Refinement) -> impl Iterator<Item = bool> + use<'b> {
        (0..of.banks.len()).map(|bank| self.used[of.candidates_of(bank)].contains(&true))
    }
}

impl Refinement {
    /// Calls for all means of a part of a grid that lie between the same centres of blocks.
    pub(crate) fn between_centres(&self, grid: Grid, means: Range<usize>, mut with: impl FnMut(Range<usize>, Between)) {
        let length = self.blocks.length;
        let mut first = means.start;
        while first < means.end {
            let sample = grid.sample(first);
            let (low, high, distance) = self.blocks.between(sample);
            // Before the first centre and beyond the last one weights stay as they are.
            let until = self.blocks.next_centre(sample);
            let end = (first + (until - sample).div_ceil(grid.step)).min(means.end);
            let advance = if low == high { 0.0 } else { grid.step as f64 / length as f64 };
            with(first..end, Between { low, high, distance, advance });
            first = end;
        }
    }

    /// Fills the rows of a bank at its own means around some samples. Returns the first mean, and one of its rows.
    pub(crate) fn fill_own(
        &self,
        means: &BlockMeans<'_>,
        bank: usize,
        around: &Range<usize>,
        scratch: &mut AverageScratch,
    ) -> (usize, usize) {
        let (own, grid) = (self.candidates_of(bank), self.grid(bank));
        let (_, centres) = self.banks[bank].places(self.samples, grid, &grid.means(around));
        let AverageScratch { banks, projected, rows, firsts, .. } = scratch;
        firsts[bank] = centres.start;
        if centres.is_empty() {
            rows[own.clone()].iter_mut().for_each(Vec::clear);
        } else {
            let estimates = self.banks[bank].estimates(means, centres.clone(), 1, &mut banks[bank], projected);
            rows[own.clone()].iter_mut().zip(estimates).for_each(|(row, estimates)| std::mem::swap(row, estimates));
        }
        (centres.start, own.start)
    }
}
