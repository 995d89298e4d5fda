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
        if self.group > 1 {
            return self.left_of_groups(place);
        }
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

    /// The same where several rows belong to one time, each with signals of its own.
    fn left_of_groups(&self, place: &JumpPlace<'_>) -> Option<Vec<f64>> {
        let JumpPlace { candidates, .. } = place;
        let mut left = vec![0.0; candidates.len()];
        self.each_row(place, |begin, errors| {
            for (left, candidate) in left.iter_mut().zip((*candidates).clone()) {
                *left += errors[candidate.saturating_sub(begin).min(errors.len() - 1)].powi(2);
            }
        })?;
        Some(left)
    }

    /// Hands over the first sample of every row, and what is left of it where the line before the jump holds for so many of its samples: none, one, and so
    /// on. `None` if too few rows are usable.
    pub(crate) fn each_row(&self, place: &JumpPlace<'_>, mut take: impl FnMut(usize, &[f64])) -> Option<()> {
        let JumpPlace { lines: [before, after], row, over, .. } = place;
        let (length, group, per_sample) = (self.function.len(), self.group, self.group as f64 / self.stride as f64);
        let used = || (*over).clone().filter(|&row| self.whole.usable[row]);
        if 2 * used().count() < over.len() {
            return None;
        }
        let (mut samples, mut errors) = (vec![0.0; length], vec![0.0; length + 1]);
        for one in used() {
            let begin = self.first + one / group * self.stride - length / 2;
            // The middle of a group lies at its sample.
            let origin = (begin as f64 - self.first as f64) * per_sample + (group as f64 - 1.0) / 2.0 - *row as f64;
            errors.fill(0.0);
            let mut total = 0.0;
            let root = self.whole.root(one);
            for (unknown, (&[from, rise], &[to, growth])) in before.iter().zip(after).enumerate() {
                self.signals[unknown * group + one % group].read(begin, &mut samples);
                if !all_usable(&samples) {
                    return None;
                }
                for (index, (factor, sample)) in self.function.iter().zip(&samples).enumerate() {
                    let (weight, now) = (factor * sample * root, origin + index as f64 * per_sample);
                    let later = to + (now + 1.0) * growth;
                    total += weight * later;
                    errors[index + 1] += weight * (later - from - now * rise);
                }
            }
            errors[0] = self.rhs[one] - total;
            let mut sum = 0.0;
            for error in &mut errors {
                sum += *error;
                *error = sum;
            }
            take(begin, &errors);
        }
        Some(())
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
            let mut root = Packet::ZERO;
            for (lane, root) in root.0.iter_mut().enumerate() {
                *root = search.whole.root(first + lane);
            }
            for (unknown, samples) in signals.iter().enumerate() {
                let ([from, rise], [to, growth]) = (before[unknown], after[unknown]);
                let change = [root * Packet::splat(to + growth - from), root * Packet::splat(growth - rise)];
                let held = [root * Packet::splat(to + growth), root * Packet::splat(growth)];
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::jumps::simulated::{DEVIATION, HALF, STRIDE, Spring, searched, spring};

    const JUMP: usize = 1500;

    /// What is left where the spring is one line before a candidate and another one after it, sample by sample.
    fn slowly(spring: &Spring, place: &JumpPlace<'_>, candidate: usize) -> f64 {
        let [before, after] = place.lines;
        let left = |row: usize| {
            let sum = |k: usize| {
                let sample = row * STRIDE + k;
                let later = (sample as f64 - (HALF + place.row * STRIDE) as f64) / STRIDE as f64;
                let early = before[0][0] + before[0][1] * later;
                let late = after[0][0] + after[0][1] * (later + 1.0);
                spring.function[k] * spring.angle[sample] * if sample < candidate { early } else { late }
            };
            spring.rows.rhs[row] - (0..=2 * HALF).map(sum).sum::<f64>()
        };
        place.over.clone().filter(|&row| spring.rows.usable[row]).map(|row| left(row).powi(2)).sum()
    }

    #[test]
    fn every_candidate_leaves_what_its_samples_leave_one_by_one() {
        let mut spring = spring(|sample| if sample < JUMP { 10.0 } else { 13.0 });
        let row = (JUMP - HALF).div_ceil(STRIDE);
        spring.rows.exclude([row - 3].into_iter());
        let lines = [vec![[10.1, 0.01]], vec![[12.8, -0.02]]];
        let (over, candidates) = (row - 11..row + 12, JUMP - 30..JUMP + 31);
        let place = JumpPlace { lines: &lines, row, over: &over, candidates: &candidates };
        let found = searched(&spring, |search| search.left(&place)).expect("usable rows");
        for (candidate, found) in candidates.clone().zip(&found) {
            let expected = slowly(&spring, &place, candidate);
            assert!((found - expected).abs() < 1e-10 * (1.0 + expected), "{candidate}: {found}, not {expected}");
        }
    }

    #[test]
    fn the_true_lines_leave_the_noise_where_the_jump_is() {
        let spring = spring(|sample| if sample < JUMP { 10.0 } else { 13.0 });
        let row = (JUMP - HALF).div_ceil(STRIDE);
        let lines = [vec![[10.0, 0.0]], vec![[13.0, 0.0]]];
        let (over, candidates) = (row - 12..row + 12, JUMP - 20..JUMP + 20);
        let place = JumpPlace { lines: &lines, row, over: &over, candidates: &candidates };
        let left = searched(&spring, |search| search.left(&place)).expect("usable rows");
        let best = (0..left.len()).min_by(|&a, &b| left[a].total_cmp(&left[b])).expect("candidates");
        assert!((candidates.start + best).abs_diff(JUMP) <= 1);
        // 24 squares of even noise: their mean scatters by √(0.8 / 24).
        assert!(left[JUMP - candidates.start] < 24.0 * DEVIATION * DEVIATION * (1.0 + 4.0 * (0.8_f64 / 24.0).sqrt()));
    }

    #[test]
    fn a_jump_among_missing_rows_is_not_placed() {
        let mut spring = spring(|_| 10.0);
        spring.rows.exclude(700..720);
        let lines = [vec![[10.0, 0.0]], vec![[10.0, 0.0]]];
        let candidates = 1400..1440;
        let left = |over: Range<usize>| {
            let place = JumpPlace { lines: &lines, row: 710, over: &over, candidates: &candidates };
            searched(&spring, |search| search.left(&place)).is_some()
        };
        assert!(!left(695..725));
        assert!(left(675..725));
    }
}
