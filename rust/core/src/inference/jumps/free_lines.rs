//! Where constants jump, beside windowed coefficients that follow a line of their own on either side: the sum of squares that is left.
//!
//! Lines that were fitted away from the jump and extrapolated to it are wrong by more than a small jump leaves. So they are free for every place that is
//! tried: rows far from it are products of columns, and rows over it are divided sample by sample.

use std::ops::Range;

use crate::equation::rows::Rows;
use crate::inference::jumps::constants::explained;
use crate::inference::jumps::jump::{JumpSearch, Lines};
use crate::inference::jumps::placement::JumpPlace;
use crate::regression::block_products::{Products, ROWS_OF_AN_UNKNOWN};
use crate::regression::model::Model;

/// What some rows say of the lines that windowed coefficients follow, beside given constants: the value at the middle and the growth over half of the rows,
/// coefficient by coefficient.
pub(crate) struct OfLines {
    /// Products of the columns of the lines, row by row, and with the right-hand side.
    normal: Vec<f64>,
    rhs: Vec<f64>,
    /// The sum of squares of the right-hand side.
    square: f64,
    /// The row in the middle, half the rows, and how many are usable.
    middle: f64,
    half: f64,
    usable: f64,
}

impl OfLines {
    /// Rows that determine lines, a part of them missing.
    pub(crate) fn enough_rows(model: &Model) -> usize {
        2 * ROWS_OF_AN_UNKNOWN * 2 * model.windowed.len()
    }

    /// `None` where rows are too few.
    pub(crate) fn new(rows: &Rows, model: &Model, block: &Range<usize>, constants: &[f64]) -> Option<Self> {
        let products = Products { rows, model };
        let (count, first) = (products.columns(), 2 * model.windowed.len());
        let (moments, times) = products.of(block);
        if times[0] <= (ROWS_OF_AN_UNKNOWN * first) as f64 {
            return None;
        }
        let entry = |i: usize, j: usize| moments[i.max(j) * count + i.min(j)];
        // With what the constants leave of the right-hand side.
        let with_rest = |i: usize| {
            let by_constants = constants.iter().enumerate().map(|(k, value)| entry(i, first + k) * value);
            entry(i, count - 1) - by_constants.sum::<f64>()
        };
        let by_constants = constants.iter().enumerate().map(|(k, value)| with_rest(first + k) * value).sum::<f64>();
        Some(Self {
            normal: (0..first * first).map(|place| entry(place / first, place % first)).collect(),
            rhs: (0..first).map(with_rest).collect(),
            square: with_rest(count - 1) - by_constants,
            middle: products.centre(block).1,
            half: 0.5 * block.len() as f64,
            usable: times[0],
        })
    }

    /// The sum of squares that the best lines leave.
    fn left(&self) -> Option<f64> {
        left(&self.normal, &self.rhs, self.square)
    }

    /// A line whose value in the middle, or whose growth, is one: its value at a row and its growth per row.
    fn unit(&self, grows: bool, row: f64) -> [f64; 2] {
        if grows { [(row - self.middle) / self.half, 1.0 / self.half] } else { [1.0, 0.0] }
    }
}

/// The mean square that the best lines leave, those of each block its own.
pub(crate) fn mean_left(blocks: &[OfLines]) -> Option<f64> {
    let left: f64 = blocks.iter().map(OfLines::left).sum::<Option<f64>>()?;
    Some(left / blocks.iter().map(|block| block.usable - block.rhs.len() as f64).sum::<f64>())
}

/// What the solution of normal equations leaves of a sum of squares.
fn left(normal: &[f64], rhs: &[f64], square: f64) -> Option<f64> {
    explained(normal, rhs).map(|(_, explained)| square - explained)
}

impl JumpSearch<'_> {
    /// The residual sum of squares of rows over a jump of constants, and of those far from it on either side, for a jump before each candidate; and how many
    /// rows there are. Signals of the constants, whose mean the right-hand side is without, come first; `constants` are what they add to it before the
    /// jump and after it. `None` if too few rows are usable.
    pub(crate) fn left_beside_lines(
        &self,
        constants: &[Vec<f64>; 2],
        far: &[OfLines; 2],
        (over, candidates): (&Range<usize>, &Range<usize>),
    ) -> Option<(Vec<f64>, f64)> {
        let (row, moving) = (over.start, constants[0].len());
        let nothing = vec![[0.0; 2]; self.signals.len()];
        let with = |side: usize, signal: usize, line: [f64; 2]| {
            let mut lines: [Lines; 2] = [nothing.clone(), nothing.clone()];
            lines[side][signal] = line;
            lines
        };
        // What is left of every row, for every candidate.
        let errors = |lines: &[Lines; 2], rhs: &[f64]| -> Option<Vec<Vec<f64>>> {
            let (search, mut errors) = (JumpSearch { rhs, ..*self }, Vec::new());
            search.each_row(&JumpPlace { lines, row, over, candidates }, |begin, left| {
                let of = |candidate: usize| left[candidate.saturating_sub(begin).min(left.len() - 1)];
                errors.push(candidates.clone().map(of).collect());
            })?;
            Some(errors)
        };
        let jumping = constants.each_ref().map(|constants| {
            let lines = constants.iter().map(|&value| [value, 0.0]);
            lines.chain(nothing[moving..].iter().copied()).collect::<Lines>()
        });
        let rest = errors(&jumping, self.rhs)?;
        let zeros = vec![0.0; self.rhs.len()];
        let mut columns = Vec::new();
        for (side, far) in far.iter().enumerate() {
            // A line after a jump begins a row earlier.
            let origin = row as f64 - side as f64;
            for signal in moving..self.signals.len() {
                for grows in [false, true] {
                    columns.push(errors(&with(side, signal, far.unit(grows, origin)), &zeros)?);
                }
            }
        }
        let (count, own) = (columns.len(), columns.len() / 2);
        let of_candidate = |place: usize| {
            let mut normal = vec![0.0; count * count];
            let mut rhs = [far[0].rhs.as_slice(), &far[1].rhs].concat();
            for (side, far) in far.iter().enumerate() {
                for (i, entries) in far.normal.chunks_exact(own).enumerate() {
                    let first = (side * own + i) * count + side * own;
                    normal[first..first + own].copy_from_slice(entries);
                }
            }
            let mut square = far[0].square + far[1].square;
            for (one, rest) in rest.iter().enumerate() {
                let rest = rest[place];
                square += rest * rest;
                for (i, column) in columns.iter().enumerate() {
                    // Errors are what is left: columns with the opposite sign.
                    let value = column[one][place];
                    rhs[i] -= value * rest;
                    for (j, other) in columns.iter().enumerate() {
                        normal[i * count + j] += value * other[one][place];
                    }
                }
            }
            left(&normal, &rhs, square)
        };
        let left = (0..candidates.len()).map(of_candidate).collect::<Option<Vec<f64>>>()?;
        Some((left, far[0].usable + far[1].usable + rest.len() as f64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::jumps::simulated::{DEVIATION, HALF, STRIDE, searched, spring};

    const JUMP: usize = 1500;

    /// What lines in time leave that are free before and after a candidate, one by one: the growth of each is that of a sample.
    fn slowly(rhs: &[f64], angle: &[f64], function: &[f64], rows: Range<usize>, candidate: usize) -> f64 {
        let column = |row: usize, side: usize, grows: bool| {
            let of = |k: usize| {
                let sample = row * STRIDE + k;
                let holds = (sample < candidate) == (side == 0);
                let time = (sample as f64 - JUMP as f64) / 100.0;
                f64::from(u8::from(holds)) * function[k] * angle[sample] * if grows { time } else { 1.0 }
            };
            (0..function.len()).map(of).sum::<f64>()
        };
        let columns = |row: usize| [(0, false), (0, true), (1, false), (1, true)].map(|(a, b)| column(row, a, b));
        let (mut normal, mut products, mut square) = (vec![0.0; 16], vec![0.0; 4], 0.0);
        for row in rows {
            let columns = columns(row);
            square += rhs[row] * rhs[row];
            for i in 0..4 {
                products[i] += columns[i] * rhs[row];
                (0..4).for_each(|j| normal[4 * i + j] += columns[i] * columns[j]);
            }
        }
        left(&normal, &products, square).expect("lines")
    }

    #[test]
    fn what_is_left_is_that_of_lines_which_are_fitted_for_every_candidate() {
        let stiffness = |sample: usize| 10.0 + 1e-3 * sample as f64 + if sample < JUMP { 0.0 } else { 0.8 };
        let spring = spring(stiffness);
        let row = (JUMP - HALF) / STRIDE;
        let (first, end, over) = (row - 200, row + 200, row - 30..row + 30);
        let candidates = JUMP - 30..JUMP + 31;
        searched(&spring, |search| {
            let model = Model { windowed: vec![0], constant: Vec::new(), linear: true, ..Model::default() };
            let of = |block: Range<usize>| OfLines::new(&spring.rows, &model, &block, &[]).expect("rows");
            let far = [of(first..over.start), of(over.end..end)];
            let (found, count) =
                search.left_beside_lines(&[Vec::new(), Vec::new()], &far, (&over, &candidates)).expect("usable rows");
            assert_eq!(count, 400.0);
            for (candidate, found) in candidates.clone().zip(&found) {
                let expected = slowly(&spring.rows.rhs, &spring.angle, &spring.function, first..end, candidate);
                // Sums of squares of torques of some thousand, rounded.
                assert!((found - expected).abs() < 1e-9, "{candidate}: {found}, not {expected}");
            }
            // The best place leaves no more than the jump itself, which is three errors away at most.
            let (variance, best) = (DEVIATION * DEVIATION, found.iter().copied().fold(f64::INFINITY, f64::min));
            assert!(found[JUMP - candidates.start] - best < 9.0 * variance);
            assert!(found[0].min(found[60]) - best > 1e3 * variance);
            assert!(best < 1.2 * 400.0 * variance && mean_left(&far).expect("lines") < 1.2 * variance);
        });
    }
}
