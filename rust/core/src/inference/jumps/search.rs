//! Where a windowed coefficient jumps.
//!
//! A window over a jump describes neither side, so windows should end there. A jump is suspected at rows where the window before and
//! the window after differ. It is placed between two samples by the rows that reach over it: with `k₋` and `k₊` the lines
//! on both sides, they are predicted by
//!
//! ```text
//! Σ_{t<τ} φ(t - c) θ(t) k₋(t) + Σ_{t≥τ} φ(t - c) θ(t) k₊(t),
//! ```
//!
//! and `τ` minimises the sum of squares. It is accepted if this is significantly smaller than what the same windows leave when they predict
//! the rows between them without a jump.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::Piece;
use crate::exec::stages::Stages;
use crate::inference::jumps::jump::{Jump, JumpSearch, Lines, UNLIKELY, row_from};
use crate::inference::jumps::placement::JumpPlace;
use crate::inference::jumps::shared_windows::SharedWindows;
use crate::inference::windows_around::Around;
use crate::regression::sides::Sides;
use crate::regression::window_length::{Cells, SHORTEST_ALONE, Scale};

/// Squared difference between the windows before and after a row, over its variance, above which a jump is searched.
const SUSPECTED: f64 = 36.0;

/// Least reduction of the sum of squares by a jump, over the noise of one independent row.
const SIGNIFICANT: f64 = 40.0;

/// Largest share of the sum of squares that a jump may leave: a steep slope is no jump.
const LEFT: f64 = 0.5;

/// Windows that hold a jump follow it in part: so much more is left of the rows without them.
const CONSPICUOUS: f64 = 2.0;

/// Rounds of placing a jump and taking the windows beside it again.
const ROUNDS: usize = 4;

/// The share of a test function that may reach over a jump unnoticed.
const UNNOTICED: f64 = 1e-4;

impl JumpSearch<'_> {
    /// The jumps of the record, in order: known ones, placed again, and new ones. `errors` are the residuals of the rows.
    pub(crate) fn find(&self, errors: &[f64], known: &[Jump], stages: &mut Stages<'_, '_>) -> Result<Vec<Jump>, Error> {
        let room = self.apart() / self.group * self.stride;
        let samples = self.first * 2 + (self.problem.rows() / self.group - 1) * self.stride;
        let conspicuous = self.conspicuous(errors);
        let places = known.len() + conspicuous.len();
        let shared = SharedWindows::new(self.problem, self.scales, places, self.instructions);
        let pieces = known.iter().map(|jump| Piece { size: room, content: jump });
        let again = stages.map(pieces.collect(), || (), |jump: &Jump, (): &mut ()| self.again(jump, room, &shared))?;
        let mut jumps: BTreeMap<usize, Jump> = again.into_iter().map(|jump| (jump.sample, jump)).collect();
        let pieces = conspicuous.into_iter().map(|rows| Piece { size: rows.len() * self.stride, content: rows });
        let new = stages.map(pieces.collect(), || (), |rows: Range<usize>, (): &mut ()| self.within(&rows, &shared))?;
        for jump in new.into_iter().flatten() {
            let near = jump.sample.saturating_sub(room)..jump.sample + room;
            if jumps.range(near).next().is_none() && jump.sample >= room && jump.sample + room <= samples {
                jumps.insert(jump.sample, jump);
            }
        }
        Ok(jumps.into_values().collect())
    }

    /// Places a known jump again. It moves by less than a quarter of the least distance between jumps.
    fn again(&self, jump: &Jump, room: usize, shared: &SharedWindows<'_>) -> Jump {
        if jump.of_constants {
            // What the constants do is not seen in what they leave.
            return jump.clone();
        }
        let row = self.row_from(jump.sample);
        let solved = self.solve(&(row..row + 1), shared);
        let windows = around(&solved);
        let placed = windows.iter().rev().find_map(|windows| self.placed(windows, jump.sample));
        let near = placed.map(|(placed, _)| placed).filter(|placed| 4 * placed.sample.abs_diff(jump.sample) < room);
        near.unwrap_or_else(|| jump.clone())
    }

    /// The jumps in some rows, the most conspicuous first.
    fn within(&self, rows: &Range<usize>, shared: &SharedWindows<'_>) -> Vec<Jump> {
        let solved = self.solve(rows, shared);
        let windows = around(&solved);
        let mut suspected = self.suspected(&windows, rows);
        suspected.sort_by(|a, b| b.0.total_cmp(&a.0));
        let (mut looked, mut jumps) = (BTreeSet::new(), Vec::new());
        for (_, row, scale) in suspected {
            let near = row.saturating_sub(self.apart() / 2)..=row + self.apart() / 2;
            if looked.range(near).next().is_some() {
                continue;
            }
            looked.insert(row);
            jumps.extend(self.place(&windows[scale], row, shared));
        }
        jumps
    }

    /// Stretches of rows whose residuals are large enough for a jump to be accepted there.
    fn conspicuous(&self, errors: &[f64]) -> Vec<Range<usize>> {
        let reach = 2 * (self.function.len() / 2).div_ceil(self.stride) * self.group;
        let least = SIGNIFICANT * self.noise(0.0, 1.0) / CONSPICUOUS;
        let mut found: Vec<Range<usize>> = Vec::new();
        let mut sum = 0.0;
        for row in 0..errors.len() + reach {
            sum += errors.get(row).map_or(0.0, |error| error * error);
            sum -= row.checked_sub(2 * reach + 1).map_or(0.0, |row| errors[row] * errors[row]);
            let Some(middle) = row.checked_sub(reach) else { continue };
            if sum < least {
                continue;
            }
            match found.last_mut() {
                Some(last) if last.end + self.apart() >= middle => last.end = middle + 1,
                _ => found.push(middle..middle + 1),
            }
        }
        found
    }

    /// Windows of every length before and after some rows.
    fn solve<'s>(&self, rows: &Range<usize>, shared: &'s SharedWindows<'_>) -> Vec<(Scale, Cow<'s, Cells>)> {
        let solve = |&scale: &Scale| {
            let all = scale.one_sided_cells(self.problem.rows());
            let reach = self.function.len() / self.stride * self.group;
            let first = scale.cell(rows.start.saturating_sub(reach)).max(all.start).min(all.end);
            let end = (scale.cell(rows.end + reach) + 1).min(all.end).max(first);
            (scale, shared.of(scale, &(first..end), Sides { one: true, both: false }))
        };
        self.lengths.iter().map(solve).collect()
    }

    /// Least distance between jumps, in rows, so that a one-sided window fits between them.
    fn apart(&self) -> usize {
        (SHORTEST_ALONE + 4 * self.function.len() / 2 / self.stride) * self.group
    }

    /// Rows where the windows before and after differ most: the difference, the row, and the index of the length.
    fn suspected(&self, windows: &[Around<'_>], rows: &Range<usize>) -> Vec<(f64, usize, usize)> {
        let mut found = Vec::new();
        for (scale, windows) in windows.iter().enumerate() {
            let mut best: Option<(f64, usize)> = None;
            for row in rows.clone() {
                let differs = self.differs(windows, row).unwrap_or(0.0);
                if differs > SUSPECTED {
                    if best.is_none_or(|best| differs > best.0) {
                        best = Some((differs, row));
                    }
                } else if let Some((differs, row)) = best.take() {
                    found.push((differs, row, scale));
                }
            }
            found.extend(best.map(|(differs, row)| (differs, row, scale)));
        }
        found
    }

    /// The squared difference between the windows before and after a row, over its variance, for the coefficient that
    /// differs most.
    fn differs(&self, windows: &Around<'_>, row: usize) -> Option<f64> {
        let before = windows.at_row(self.problem, row, 0)?;
        let after = windows.at_row(self.problem, row, 2)?;
        let squared = (0..self.problem.layout.windowed).map(|unknown| {
            let difference = after.value(unknown) - before.value(unknown);
            difference * difference / (self.inflation * (after.variance(unknown) + before.variance(unknown)))
        });
        Some(squared.fold(0.0, f64::max))
    }

    /// Places a jump near a row, or returns `None` if there is none.
    fn place(&self, windows: &Around<'_>, row: usize, shared: &SharedWindows<'_>) -> Option<Jump> {
        let (jump, (over, left)) = self.placed(windows, self.first + row / self.group * self.stride)?;
        self.is_significant(&over, left, shared).then_some(jump)
    }

    /// Places a jump near a sample. Returns it with the rows over which residuals are summed, and their sum of squares.
    fn placed(&self, windows: &Around<'_>, sample: usize) -> Option<(Jump, (Range<usize>, f64))> {
        let rows = self.problem.rows();
        let half = self.function.len() / 2;
        let reach = half.div_ceil(self.stride) * self.group;
        let (mut tau, mut round) = (sample, 0);
        loop {
            // The first row after the jump.
            let row = self.row_from(tau).clamp(1, rows - 1);
            let lines = [self.lines(windows, row, 0)?, self.lines(windows, row - 1, 2)?];
            let candidates = tau.saturating_sub(half)..tau + half + 1;
            let over = row.saturating_sub(2 * reach)..(row + 2 * reach).min(rows);
            let place = JumpPlace { lines: &lines, row, over: &over, candidates: &candidates };
            let left = self.left(&place)?;
            let best = (0..left.len()).min_by(|&a, &b| left[a].total_cmp(&left[b]))?;
            let next = candidates.start + best;
            if next.abs_diff(tau) <= self.stride / 2 || round == ROUNDS {
                let jump = self.jump_or_ramp(&place, &left, best);
                return Some((jump, (over, left[best])));
            }
            (tau, round) = (next, round + 1);
        }
    }

    /// The lines of the window before or after a row.
    fn lines(&self, windows: &Around<'_>, row: usize, which: usize) -> Option<Lines> {
        let window = windows.at_row(self.problem, row, which)?;
        let line = |unknown| [window.value(unknown), window.slope(unknown) * self.problem.period];
        Some((0..self.problem.layout.windowed).map(line).collect())
    }

    /// Whether a jump is significant: windows of no length may predict the rows around it nearly as well without one.
    fn is_significant(&self, over: &Range<usize>, left: f64, shared: &SharedWindows<'_>) -> bool {
        let rows: Vec<usize> = over.clone().filter(|&row| self.whole.usable[row]).collect();
        let noise = self.noise(left, rows.len() as f64);
        // Short windows follow steep slopes, so they reject most candidates.
        let mut tried = false;
        let beaten = |without: f64| (without - left) / noise < SIGNIFICANT || left > LEFT * without;
        for without in self.scales.iter().filter_map(|scale| self.without(*scale, over, &rows, shared)) {
            if beaten(without) {
                return false;
            }
            tried = true;
        }
        tried
    }

    /// The sum of squares that windows of one length leave in the rows between them, or `None` if they do not reach all rows.
    fn without(&self, scale: Scale, over: &Range<usize>, rows: &[usize], shared: &SharedWindows<'_>) -> Option<f64> {
        let all = scale.one_sided_cells(self.problem.rows());
        let cells = scale.cell(over.start).max(all.start)..(scale.cell(over.end) + 1).min(all.end);
        if cells.is_empty() {
            return None;
        }
        let cells = shared.of(scale, &cells, Sides { one: false, both: true });
        let windows = Around::new(scale, &cells, &[]);
        let error = |&row: &usize| {
            let window = windows.at_row(self.problem, row, 1)?;
            Some((self.rhs[row] - window.predict(self.whole, row)).powi(2))
        };
        rows.iter().map(error).sum()
    }

    /// The variance of one independent row: from the sum of squares, at least that of the noise.
    pub(crate) fn noise(&self, left: f64, count: f64) -> f64 {
        self.expected.variance_inflation * (self.inflation * self.expected.variance).max(left / count)
    }

    /// A jump with the probability of each of its places.
    pub(crate) fn jump(&self, left: &[f64], best: usize, first: usize, count: f64) -> Jump {
        let noise = self.noise(left[best], count);
        let weights: Vec<f64> = left.iter().map(|one| (-(one - left[best]) / (2.0 * noise)).exp()).collect();
        let total: f64 = weights.iter().sum();
        let happened = weights.iter().scan(0.0, |sum, weight| {
            *sum += weight / total;
            Some(*sum)
        });
        Jump { sample: first + best, first, happened: happened.collect(), of_constants: false }
    }
}

fn around<'a>(solved: &'a [(Scale, Cow<'_, Cells>)]) -> Vec<Around<'a>> {
    solved.iter().map(|(scale, cells)| Around::new(*scale, cells, &[])).collect()
}

/// Rows whose test function reaches over a jump, wherever it may be.
pub(crate) fn rows_over(
    jumps: &[Jump],
    function: &[f64],
    times: (usize, usize, usize),
    rows: usize,
) -> impl Iterator<Item = usize> {
    let mut beyond = 0.0;
    let unnoticed = function.iter().take_while(|&&value| {
        beyond += value;
        beyond < UNNOTICED
    });
    let reach = function.len() / 2 - unnoticed.count();
    let over: Vec<Range<usize>> = jumps
        .iter()
        .map(|jump| {
            let place = |part: f64| jump.first + jump.happened.partition_point(|&happened| happened < part);
            let (early, late) = (place(UNLIKELY).min(jump.sample), place(1.0 - UNLIKELY).max(jump.sample));
            let row = |sample: usize| row_from(sample, times).min(rows);
            row(early.saturating_sub(reach))..row(late + reach)
        })
        .collect();
    over.into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::jumps::simulated::{HALF, STRIDE, Spring, searched, spring};
    use crate::regression::fit::Fit;
    use crate::regression::residuals::residuals;
    use crate::regression::simulated::staged;

    /// The jumps that are found in a spring, some being known.
    fn found(spring: &Spring, known: &[Jump]) -> Vec<Jump> {
        searched(spring, |search| {
            let scale = search.lengths.last().copied();
            let fit = staged(|stages| Fit::new(search.problem, scale, search.expected, search.instructions, stages));
            let (errors, _) = staged(|stages| residuals(search.problem, &fit.expect("windows"), stages));
            staged(|stages| search.find(&errors, known, stages))
        })
    }

    fn samples(jumps: &[Jump]) -> Vec<usize> {
        jumps.iter().map(|jump| jump.sample).collect()
    }

    #[test]
    fn jumps_are_found_where_they_are_and_known_ones_stay() {
        let stiffness = |sample: usize| match sample {
            0..1000 => 10.0,
            1000..2000 => 13.0,
            _ => 11.0 + 2e-4 * sample as f64,
        };
        let spring = spring(stiffness);
        let jumps = found(&spring, &[]);
        assert_eq!(jumps.len(), 2, "{:?}", samples(&jumps));
        for (jump, true_place) in jumps.iter().zip([1000, 2000]) {
            assert!(jump.sample.abs_diff(true_place) <= STRIDE, "{}", jump.sample);
            // A probability that grows from nothing to one, and passes a half beside the place.
            assert!(jump.happened.is_sorted() && jump.happened[0] < 1e-3);
            assert!((jump.happened[jump.happened.len() - 1] - 1.0).abs() < 1e-9);
            let half = jump.first + jump.happened.partition_point(|&happened| happened < 0.5);
            assert!(half.abs_diff(jump.sample) <= STRIDE);
        }
        assert_eq!(samples(&found(&spring, &jumps)), samples(&jumps));
    }

    #[test]
    fn none_is_found_where_none_is() {
        assert!(found(&spring(|_| 10.0), &[]).is_empty());
        // A slope that windows follow.
        assert!(found(&spring(|sample| 10.0 + 1e-3 * sample as f64), &[]).is_empty());
    }

    #[test]
    fn rows_over_a_jump_are_those_whose_test_function_reaches_it() {
        let function = spring(|_| 1.0).function;
        let certain =
            |sample: usize| Jump { sample, first: sample - 1, happened: vec![0.0, 1.0, 1.0], of_constants: false };
        let over: Vec<usize> = rows_over(&[certain(500)], &function, (HALF, STRIDE, 1), 400).collect();
        for row in 0..400 {
            // Row r reads the samples from 2 r to 2 r + 24; the jump lies between samples 499 and 500.
            let before: f64 = (0..function.len()).filter(|k| row * STRIDE + k < 500).map(|k| function[k]).sum();
            let less = before.min(1.0 - before);
            assert!(less < UNNOTICED || over.contains(&row), "{row}: {less}");
            assert!(less > UNNOTICED || !over.contains(&row), "{row}: {less}");
        }
        // Where the place is uncertain, all rows that may reach over it.
        let happened = (0..40).map(|k| f64::from(k) / 39.0).collect();
        let uncertain = Jump { sample: 500, first: 480, happened, of_constants: false };
        let wide: Vec<usize> = rows_over(&[uncertain], &function, (HALF, STRIDE, 1), 400).collect();
        assert!(wide.len() > over.len() + 15 && over.iter().all(|row| wide.contains(row)));
    }
}
