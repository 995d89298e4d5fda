//! The sum of squares that a jump leaves, for each sample at which it may lie; eight neighbouring rows side by side.

use std::ops::Range;

use crate::inference::jumps::jump::{JumpSearch, Lines};
use crate::record::samples::all_usable;
use crate::simd::f64x8::{Packet, WIDTH};
use crate::simd::vectors::{Kernel, Lanes, dispatch};

/// The candidates for a jump: a line before it, whose origin is `row`, and a line after it, whose origin is the row before.
pub(crate) struct JumpPlace<'a> {
    pub(crate) lines: &'a [Lines; 2],
    pub(crate) row: usize,
    /// Rows over which its residuals are summed.
    pub(crate) over: &'a Range<usize>,
    /// Samples before which it may lie.
    pub(crate) candidates: &'a Range<usize>,
}

impl JumpSearch<'_> {
    /// The residual sum of squares of the rows for a jump before each candidate, or `None` if too few rows are usable.
    pub(crate) fn left(&self, place: &JumpPlace<'_>) -> Option<Vec<f64>> {
        let (length, over) = (self.function.len(), place.over);
        let begin = self.begin(over.start);
        let present = (over.len() - 1) * self.stride + length;
        // The last rows side by side need not all be there; what they read is zero.
        let padded = (over.len().next_multiple_of(WIDTH) - 1) * self.stride + length;
        let mut signals = Vec::new();
        for signal in self.signals {
            let mut samples = vec![0.0; padded];
            signal.read(begin, &mut samples[..present]);
            signals.push(samples);
        }
        let samples_of = |row: usize| (row - over.start) * self.stride..(row - over.start) * self.stride + length;
        let used = over.clone().filter(|&row| self.whole.usable[row]);
        let whole = signals.iter().all(|samples| all_usable(samples));
        let usable = |row: usize| whole || signals.iter().all(|samples| all_usable(&samples[samples_of(row)]));
        if 2 * used.clone().count() < over.len() || !used.clone().all(usable) {
            return None;
        }
        Some(dispatch(self.instructions, PlacementKernel { search: self, place, signals: &signals }))
    }

    /// The first sample of a row.
    fn begin(&self, row: usize) -> usize {
        self.first + row * self.stride - self.function.len() / 2
    }
}

struct PlacementKernel<'a, 'b> {
    search: &'a JumpSearch<'b>,
    place: &'a JumpPlace<'a>,
    signals: &'a [Vec<f64>],
}

impl Kernel for PlacementKernel<'_, '_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn run<S: Lanes>(self, _simd: S) -> Vec<f64> {
        let Self { search, place: JumpPlace { lines: [before, after], row, over, candidates }, signals } = self;
        let (function, stride) = (search.function, search.stride);
        let length = function.len();
        let per_sample = 1.0 / stride as f64;
        let mut left = vec![0.0; candidates.len()];
        // What is left of a row where the line before the jump holds for so many of its samples: first what each sample changes.
        let mut errors = vec![Packet::ZERO; length + 1];
        for first in (over.start..over.end).step_by(WIDTH) {
            let offset = (first - over.start) * stride;
            // Rows from the row of the jump to the first sample of the first row.
            let origin = (search.begin(first) as f64 - (search.first + row * stride) as f64) * per_sample;
            errors.fill(Packet::ZERO);
            let mut total = Packet::ZERO;
            for (unknown, samples) in signals.iter().enumerate() {
                let ([from, rise], [to, growth]) = (before[unknown], after[unknown]);
                let change = [Packet::splat(to + growth - from), Packet::splat(growth - rise)];
                let held = [Packet::splat(to + growth), Packet::splat(growth)];
                let mut later = Packet::splat(origin);
                for (lane, later) in later.0.iter_mut().enumerate() {
                    *later += lane as f64;
                }
                for (index, (factor, error)) in function.iter().zip(&mut errors[1..]).enumerate() {
                    let weight =
                        Packet::splat(*factor) * Packet::gather(samples, (offset + index).cast_signed(), stride);
                    let now = later + Packet::splat(index as f64 * per_sample);
                    total += weight * (held[0] + now * held[1]);
                    *error += weight * (change[0] + now * change[1]);
                }
            }
            errors[0] = Packet::gather(search.rhs, first.cast_signed(), 1) - total;
            let mut sum = Packet::ZERO;
            for error in &mut errors {
                sum += *error;
                *error = sum * sum;
            }
            for lane in 0..WIDTH {
                let one = first + lane;
                if one < over.end && search.whole.usable[one] {
                    add(&errors, lane, search.begin(one), candidates, &mut left);
                }
            }
        }
        left
    }
}

/// Adds the squares of one row, whose samples begin at `begin`, to the candidates before its samples, within them and behind.
#[inline(always)]
fn add(squares: &[Packet], lane: usize, begin: usize, candidates: &Range<usize>, left: &mut [f64]) {
    let length = squares.len() - 1;
    let within = |candidate: usize| (candidate.max(begin) - begin).min(length);
    let (first, last) = (within(candidates.start), within(candidates.end));
    let (before, rest) = left.split_at_mut((begin + first).clamp(candidates.start, candidates.end) - candidates.start);
    let (inside, behind) = rest.split_at_mut(last - first);
    for left in before {
        *left += squares[0].0[lane];
    }
    for (left, square) in inside.iter_mut().zip(&squares[first..]) {
        *left += square.0[lane];
    }
    for left in behind {
        *left += squares[length].0[lane];
    }
}
