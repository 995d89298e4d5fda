//! Samples of windows that share a basis, a group of them in each lane: time, sample, and what its polynomial leaves of the sample.

use std::ops::Range;

use crate::irregular::window_places::{PlacedWindow, WindowGroup};
use crate::local_polynomials::chebyshev_factor::ChebyshevFactor;
use crate::local_polynomials::chebyshev_sums::{ChebyshevSums, MOST, TakenOff};
use crate::local_polynomials::kept_digits::tails_of;
use crate::simd::aligned::{Aligned, OnLines};
use crate::simd::vectors::{Lanes, MOST_LANES};

/// Samples that are added at once, so that none waits for the one before.
const AT_ONCE: usize = 4;

/// Memory of one thread.
#[derive(Debug, Default)]
pub(crate) struct GroupSamples {
    /// From -1 to 1 over all windows of a group.
    pub(crate) times: Aligned,
    /// Minus the reference.
    pub(crate) samples: Aligned,
    pub(crate) left: Aligned,
    /// Samples of each lane's group, and of its first window.
    all: [usize; MOST_LANES],
    first: [usize; MOST_LANES],
    pub(crate) references: [f64; MOST_LANES],
}

/// Samples that enter windows, and samples that leave them, as places within the groups.
#[allow(clippy::large_enum_variant, reason = "there is one at a time, on the stack")]
pub(crate) enum Moves {
    /// The same in all lanes.
    Alike([Range<usize>; 2]),
    /// By lane.
    Apart([[Range<usize>; MOST_LANES]; 2]),
}

/// Sums over the window that each lane is at.
pub(crate) struct SlidSums<S: Lanes> {
    /// Of polynomials, and of what is left of the samples.
    pub(crate) left: ChebyshevSums<S>,
    /// Squares of what is left, and the largest that they were.
    pub(crate) square: S::f64s,
    pub(crate) peak: S::f64s,
    /// Samples and their squares.
    pub(crate) level: S::f64s,
    pub(crate) energy: S::f64s,
    /// The polynomial that was taken off, of the highest order.
    pub(crate) coefficients: OnLines<S::f64s, MOST>,
    /// Squares of the sums of its coefficients' magnitudes, each from one on.
    pub(crate) tails: OnLines<S::f64s, MOST>,
}

impl WindowGroup {
    /// The middle of all windows, and one over their half length.
    pub(crate) fn scale(&self) -> (f64, f64) {
        (f64::midpoint(self.from, self.to), 2.0 / (self.to - self.from))
    }
}

impl GroupSamples {
    /// Reads the samples of a group into each lane.
    #[inline(always)]
    pub(crate) fn read<S: Lanes>(
        &mut self,
        simd: S,
        times: &[f64],
        record: &[f64],
        placed: &[PlacedWindow],
        groups: &[WindowGroup],
    ) {
        let lanes = S::F64_LANES;
        let range =
            |group: &WindowGroup| placed[group.windows.start].samples.start..placed[group.windows.end - 1].samples.end;
        let longest = groups.iter().map(|group| range(group).len()).max().unwrap_or(0);
        let rows = longest.next_multiple_of(AT_ONCE);
        if self.times.len() < rows * lanes {
            for column in [&mut self.times, &mut self.samples, &mut self.left] {
                *column = Aligned::zeros(rows * lanes);
            }
        }
        // Where a lane has no sample there are zeros, which change no sum.
        let full =
            if groups.len() < lanes { 0 } else { groups.iter().map(|group| range(group).len()).min().unwrap_or(0) };
        for column in [&mut self.times, &mut self.samples] {
            column[full * lanes..rows * lanes].fill(0.0);
        }
        (self.all, self.first) = ([0; MOST_LANES], [0; MOST_LANES]);
        // So many rows are made of squares of samples, which are turned.
        let turned = full / lanes * lanes;
        let mut begins = [0; MOST_LANES];
        let (mut middles, mut scales) = ([0.0; MOST_LANES], [0.0; MOST_LANES]);
        for (lane, group) in groups.iter().enumerate() {
            let range = range(group);
            let (middle, scale) = group.scale();
            // Every window of the group holds this sample: if it is an outlier, only windows that hold the outlier lose digits.
            let reference = record[range.start + range.len() / 2];
            self.references[lane] = reference;
            self.all[lane] = range.len();
            self.first[lane] = placed[group.windows.start].samples.len();
            (begins[lane], middles[lane], scales[lane]) = (range.start, middle, scale);
            let rest = range.start + turned..range.end;
            let columns =
                [&mut self.times, &mut self.samples].map(|column| column[turned * lanes..].chunks_exact_mut(lanes));
            let [times_of, samples_of] = columns;
            for ((time, sample), (at, value)) in
                times_of.zip(samples_of).zip(times[rest.clone()].iter().zip(&record[rest]))
            {
                time[lane] = (at - middle) * scale;
                sample[lane] = value - reference;
            }
        }
        let (middle, scale) = (simd.load(&middles, 0), simd.load(&scales, 0));
        let reference = simd.load(&self.references, 0);
        for row in (0..turned).step_by(lanes) {
            let mut squares = [[middle; MOST_LANES]; 2];
            for (square, column) in squares.iter_mut().zip([times, record]) {
                for (values, begin) in square.iter_mut().zip(begins).take(lanes) {
                    *values = simd.load(column, begin + row);
                }
                simd.transpose(&mut square[..lanes]);
            }
            let [times_of, samples_of] = squares;
            for (place, (time, sample)) in times_of.into_iter().zip(samples_of).enumerate().take(lanes) {
                let at = (row + place) * lanes;
                simd.store(&mut self.times, at, simd.mul_f64s(simd.sub_f64s(time, middle), scale));
                simd.store(&mut self.samples, at, simd.sub_f64s(sample, reference));
            }
        }
    }

    /// Weights, times, samples and what is left of them of a row that moves in all lanes, if there is one more.
    #[inline(always)]
    fn row<S: Lanes>(&self, simd: S, range: &Range<usize>, place: usize, sign: f64) -> [S::f64s; 4] {
        if place >= range.len() {
            return [simd.splat_f64s(0.0); 4];
        }
        let at = (range.start + place) * S::F64_LANES;
        let (times, samples) = (simd.load(&self.times, at), simd.load(&self.samples, at));
        [simd.splat_f64s(sign), times, samples, simd.load(&self.left, at)]
    }

    /// The same where other samples move in each lane.
    #[inline(always)]
    fn gathered<S: Lanes>(
        &self,
        simd: S,
        ranges: &[Range<usize>; MOST_LANES],
        place: usize,
        sign: f64,
    ) -> [S::f64s; 4] {
        let mut columns = [[0.0; MOST_LANES]; 4];
        for (lane, range) in ranges.iter().enumerate().take(S::F64_LANES) {
            if place < range.len() {
                let at = (range.start + place) * S::F64_LANES + lane;
                columns[0][lane] = sign;
                columns[1][lane] = self.times[at];
                columns[2][lane] = self.samples[at];
                columns[3][lane] = self.left[at];
            }
        }
        let mut row = [simd.splat_f64s(0.0); 4];
        for (values, column) in row.iter_mut().zip(&columns) {
            *values = simd.load(column, 0);
        }
        row
    }

    /// Sums over each lane's first window, from which the polynomial that fits all of the group best was taken off.
    #[inline(always)]
    pub(crate) fn begin<S: Lanes>(&mut self, simd: S, degrees: usize, factor: &mut ChebyshevFactor<S>) -> SlidSums<S> {
        // Up to the least of these, samples belong to the first window of every lane.
        let least = self.first[..S::F64_LANES].iter().copied().min().unwrap_or(0);
        let (first, all) = (counts(&self.first), counts(&self.all));
        let (first, all) = (simd.load(&first, 0), simd.load(&all, 0));
        let zero = simd.splat_f64s(0.0);
        let mut sums = ChebyshevSums::zero(simd);
        let (mut energy, mut at) = (zero, 0);
        let end = self.first.iter().max().map_or(0, |first| first.next_multiple_of(AT_ONCE));
        while at < end {
            let (times, samples) = (rows(simd, &self.times, at), rows(simd, &self.samples, at));
            let weights = all_before(simd, at, (least, first));
            sums.add(simd, degrees, &times, &weights, &samples);
            for n in 0..AT_ONCE {
                let weighted = simd.mul_f64s(samples[n], weights[n]);
                energy = simd.mul_add_f64s(weighted, samples[n], energy);
            }
            at += AT_ONCE;
        }
        let (moments, level) = (sums.moments.clone(), sums.products.0[0]);
        let lanes = self.first.iter().zip(&self.all).filter(|(_, all)| **all > 0);
        let mut at = lanes.map(|(first, _)| *first).min().unwrap_or(0) / AT_ONCE * AT_ONCE;
        let end = self.all.iter().max().map_or(0, |all| all.next_multiple_of(AT_ONCE));
        while at < end {
            let (times, samples) = (rows(simd, &self.times, at), rows(simd, &self.samples, at));
            let mut weights = [zero; AT_ONCE];
            for (n, weight) in weights.iter_mut().enumerate() {
                *weight = simd.sub_f64s(before(simd, at + n, all), before(simd, at + n, first));
            }
            sums.add(simd, degrees, &times, &weights, &samples);
            at += AT_ONCE;
        }
        factor.decompose(simd, degrees, &sums.moments.0, &sums.products.0, &[zero; MOST]);
        let coefficients = factor.solve(simd, degrees);
        let mut off = TakenOff::new(simd, coefficients);
        for at in (0..end).step_by(AT_ONCE) {
            let times = rows(simd, &self.times, at);
            let mut samples = rows(simd, &self.samples, at);
            let weights = all_before(simd, at, (least, first));
            off.take_off(simd, degrees, &times, &weights, &mut samples);
            for (n, sample) in samples.into_iter().enumerate() {
                simd.store(&mut self.left, (at + n) * S::F64_LANES, sample);
            }
        }
        let TakenOff { coefficients, products, square, .. } = off;
        let tails = tails_of(simd, degrees, &coefficients.0);
        SlidSums { left: ChebyshevSums { moments, products }, square, peak: square, level, energy, coefficients, tails }
    }
}

/// Some rows of a column.
#[inline(always)]
fn rows<S: Lanes>(simd: S, column: &Aligned, at: usize) -> [S::f64s; AT_ONCE] {
    let mut rows = [simd.splat_f64s(0.0); AT_ONCE];
    for (n, row) in rows.iter_mut().enumerate() {
        *row = simd.load(column, (at + n) * S::F64_LANES);
    }
    rows
}

/// One where a row lies before the end, zero where it does not, of some rows; all lie before the least end up to that.
#[inline(always)]
fn all_before<S: Lanes>(simd: S, at: usize, (least, end): (usize, S::f64s)) -> [S::f64s; AT_ONCE] {
    // No closure: one that is not inlined is compiled without the instructions that were chosen.
    let mut weights = [simd.splat_f64s(1.0); AT_ONCE];
    if at + AT_ONCE > least {
        for (n, weight) in weights.iter_mut().enumerate() {
            *weight = before(simd, at + n, end);
        }
    }
    weights
}

/// One where a row lies before the end, zero where it does not.
#[inline(always)]
fn before<S: Lanes>(simd: S, row: usize, end: S::f64s) -> S::f64s {
    let inside = simd.less_than_f64s(simd.splat_f64s(row as f64), end);
    simd.select_f64s(inside, simd.splat_f64s(1.0), simd.splat_f64s(0.0))
}

fn counts(counts: &[usize; MOST_LANES]) -> [f64; MOST_LANES] {
    counts.map(|count| count as f64)
}

impl<S: Lanes> SlidSums<S> {
    /// Moves each lane's window.
    #[inline(always)]
    pub(crate) fn slide(&mut self, simd: S, degrees: usize, from: &GroupSamples, moves: &Moves) {
        let most = match moves {
            Moves::Alike(moves) => moves.iter().map(ExactSizeIterator::len).max(),
            Moves::Apart(moves) => moves.iter().flatten().map(ExactSizeIterator::len).max(),
        };
        let (most, signs) = (most.unwrap_or(0), [1.0, -1.0]);
        for place in 0..most {
            let mut columns = [[simd.splat_f64s(0.0); 2]; 4];
            for side in 0..2 {
                let [weights, times, samples, left] = match moves {
                    Moves::Alike(moves) => from.row(simd, &moves[side], place, signs[side]),
                    Moves::Apart(moves) => from.gathered(simd, &moves[side], place, signs[side]),
                };
                (columns[0][side], columns[1][side], columns[2][side], columns[3][side]) =
                    (weights, times, samples, left);
            }
            let [weights, times, samples, left] = columns;
            self.left.add(simd, degrees, &times, &weights, &left);
            for side in 0..2 {
                let weighted = simd.mul_f64s(weights[side], samples[side]);
                self.level = simd.add_f64s(self.level, weighted);
                self.energy = simd.mul_add_f64s(weighted, samples[side], self.energy);
                let weighted = simd.mul_f64s(weights[side], left[side]);
                self.square = simd.mul_add_f64s(weighted, left[side], self.square);
            }
        }
        self.peak = simd.max_f64s(self.peak, self.square);
    }
}
