//! Solves windows of rows: summaries of blocks are merged by doubling, and each window is merged from them.
//!
//! Rows are grouped into blocks of `step`, and a window is a whole number of consecutive blocks. Summaries of `1, 2, 4, …`
//! blocks are merged from each other, and a window of any length from the summaries that its binary digits name. Eight
//! neighbouring windows are computed side by side. The numbers of a window depend only on its rows, so every way of cutting the
//! work gives the same bits.

use std::cell::RefCell;
use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::Piece;
use crate::exec::stages::Stages;
use crate::regression::block_sums::BlockSums;
use crate::regression::dyadic_kernels::{Merges, Solves, Summaries, memory};
use crate::regression::problem::Problem;
use crate::regression::solve::SolveScratch;
use crate::regression::solved::Solved;
use crate::regression::summary_table::Table;
use crate::simd::f64x8::{Packet, WIDTH};
use crate::simd::instructions::Instructions;
use crate::simd::vectors::dispatch;

/// Cells in a piece of work.
pub(crate) const PIECE: usize = 512;

/// A thread keeps the memory of a table with at most so many numbers for its next piece of work.
const MOST_KEPT: usize = 1 << 17;

/// Windows merged at a time, so that their summaries stay in the nearest cache.
const CHUNK: usize = 8 * WIDTH;

/// The shape of a window, in blocks from its first: the parts that are merged, and the time at which it is solved.
#[derive(Clone, Debug)]
pub(crate) struct WindowShape {
    /// Blocks of every part.
    pub(crate) parts: Vec<Range<usize>>,
    /// Time at which it is solved, in rows from the first row of block 0.
    pub(crate) centre: f64,
}

impl WindowShape {
    /// Consecutive blocks of `step` rows.
    pub(crate) fn of(blocks: Range<usize>, step: usize) -> Self {
        let centre = (((blocks.start + blocks.end) * step) as f64 - 1.0) / 2.0;
        Self { parts: vec![blocks], centre }
    }

    /// The block after the last.
    fn end(&self) -> usize {
        self.parts.iter().map(|part| part.end).max().unwrap_or(0)
    }

    /// The parts cut into pieces of 2ⁿ blocks: the first block of each piece, and n.
    fn pieces(&self) -> Vec<(usize, usize)> {
        let mut pieces = Vec::new();
        for part in &self.parts {
            let mut first = part.start;
            while first < part.end {
                let level = (part.end - first).ilog2() as usize;
                pieces.push((first, level));
                first += 1 << level;
            }
        }
        pieces
    }
}

/// Solves windows of several shapes, one of each for every block in `blocks`. Block `b` holds the rows `b · step …`, which need not exist.
pub(crate) fn solve_windows(
    problem: &Problem<'_>,
    step: usize,
    blocks: &Range<isize>,
    shapes: &[WindowShape],
    instructions: Instructions,
) -> Vec<Solved> {
    solve_windows_of(problem, None, (step, blocks), shapes, instructions)
}

/// The same, with the sums of blocks where they are known. They were summed in another order: other rounding.
fn solve_windows_of(
    problem: &Problem<'_>,
    sums: Option<&BlockSums>,
    (step, blocks): (usize, &Range<isize>),
    shapes: &[WindowShape],
    instructions: Instructions,
) -> Vec<Solved> {
    let mut tables = TABLES.take();
    let known = sums.and_then(|sums| sums.of(step));
    let mut solved = DyadicWindows { problem, known, step, blocks, instructions }.solve(shapes, &mut tables);
    tables.iter_mut().filter(|table| table.len() > MOST_KEPT).for_each(|table| *table = Table::default());
    TABLES.set(tables);
    if !problem.jumps.is_empty() {
        for (shape, solved) in shapes.iter().zip(&mut solved) {
            let first = shape.parts.iter().map(|part| part.start).min().unwrap_or(0);
            for (place, block) in blocks.clone().enumerate() {
                let row = |offset: usize| (block + offset.cast_signed()) * step.cast_signed();
                if problem.jumps_within(&(row(first)..row(shape.end()) - 1)) {
                    solved.disregard(place);
                }
            }
        }
    }
    solved
}

thread_local! {
    /// Summaries of the last piece of work of every thread, for their memory.
    static TABLES: RefCell<Vec<Table>> = const { RefCell::new(Vec::new()) };
}

/// Solves windows of some shapes, so many of each, around the first cells and those that follow.
pub(crate) fn solve_shapes(
    (problem, sums): (&Problem<'_>, Option<&BlockSums>),
    step: usize,
    shapes: &[(WindowShape, usize)],
    instructions: Instructions,
    stages: &mut Stages<'_, '_>,
) -> Result<Vec<Solved>, Error> {
    let end = shapes.iter().map(|(_, cells)| *cells).max().unwrap_or(0).cast_signed();
    let pieces = (0..end).step_by(PIECE).map(|first| first..(first + PIECE.cast_signed()).min(end));
    let pieces = pieces.map(|blocks| Piece { size: blocks.len() * step, content: blocks });
    let alone: Vec<WindowShape> = shapes.iter().map(|(shape, _)| shape.clone()).collect();
    let work =
        |blocks: Range<isize>, (): &mut ()| solve_windows_of(problem, sums, (step, &blocks), &alone, instructions);
    let solved = stages.map(pieces.collect(), || (), work)?;
    if solved.is_empty() {
        return Ok(vec![Solved::new(problem.layout, 0, 0); shapes.len()]);
    }
    let of = |(shape, (_, cells)): (usize, &(WindowShape, usize))| {
        Solved::join_first(&solved.iter().map(|part| &part[shape]).collect::<Vec<_>>(), *cells)
    };
    Ok(shapes.iter().enumerate().map(of).collect())
}

/// Windows of every block in a range.
struct DyadicWindows<'a, 'b> {
    problem: &'a Problem<'b>,
    /// The sums of all blocks of the record, and how many there are.
    known: Option<(&'a Table, usize)>,
    step: usize,
    blocks: &'a Range<isize>,
    instructions: Instructions,
}

impl DyadicWindows<'_, '_> {
    /// Summaries, doubled summaries and windows are kernels of their own: a merge stands in one of them only, since the compiler
    /// takes its time over each.
    fn solve(&self, shapes: &[WindowShape], tables: &mut Vec<Table>) -> Vec<Solved> {
        let layout = self.problem.layout;
        let windows = self.blocks.len();
        let mut results: Vec<_> = shapes.iter().map(|_| Solved::new(layout, self.blocks.start, windows)).collect();
        if windows == 0 {
            return results;
        }
        let reach = shapes.iter().map(WindowShape::end).max().unwrap_or(0);
        let pieces: Vec<_> = shapes.iter().map(WindowShape::pieces).collect();
        let levels = pieces.iter().flatten().map(|&(_, level)| level).max().unwrap_or(0);
        // The first table holds the windows that are being merged.
        tables.resize(tables.len().max(levels + 2), Table::default());
        let Some((chunk, tables)) = tables.split_first_mut() else { return results };
        let memory = &mut memory(layout);
        self.fill(tables, levels, windows + reach.max(1) - 1, memory);
        chunk.resize(layout.size(), CHUNK);
        let mut scratch = SolveScratch::new(layout);
        for ((shape, pieces), result) in shapes.iter().zip(&pieces).zip(&mut results) {
            let Some((&(begin, level), rest)) = pieces.split_first() else { continue };
            for place in (0..windows).step_by(CHUNK) {
                let count = CHUNK.min(windows - place);
                let mut held = Some((&tables[level], place + begin));
                for &(first, level) in rest {
                    let others = (&tables[level], place + first);
                    self.merge(chunk, held.take(), others, (count, first - begin), memory);
                }
                let summaries = held.unwrap_or((&*chunk, 0));
                let later = shape.centre * self.problem.period - begin as f64 * self.block_period();
                let solves = Solves {
                    problem: self.problem,
                    summaries,
                    count,
                    later,
                    scratch: &mut scratch,
                    result,
                    place,
                    memory,
                };
                dispatch(self.instructions, solves);
            }
        }
        results
    }

    fn block_period(&self) -> f64 {
        self.step as f64 * self.problem.period
    }

    /// Summarises single blocks, as many as there are windows of one block, and by doubling the windows of 2, 4, 8, … of them.
    fn fill(&self, tables: &mut [Table], levels: usize, count: usize, memory: &mut [Packet]) {
        let layout = self.problem.layout;
        let &Self { problem, step, blocks, instructions, .. } = self;
        tables[0].resize(layout.size(), count);
        match (self.known, usize::try_from(blocks.start)) {
            (Some((known, all)), Ok(first)) if first + count <= all => {
                tables[0].copy(layout.size(), (known, first, 1), 0..count);
            }
            _ => {
                let (first, table) = (blocks.start, &mut tables[0]);
                dispatch(instructions, Summaries { problem, step, first, count, table, memory });
            }
        }
        for level in 0..levels {
            let half = 1 << level;
            let count = count + 1 - 2 * half;
            let (below, table) = tables.split_at_mut(level + 1);
            let (below, table) = (&below[level], &mut table[0]);
            table.resize(layout.size(), count);
            self.merge(table, Some((below, 0)), (below, half), (count, half), memory);
        }
    }

    /// Writes the sums of summaries and others that begin some blocks later; without summaries the others are added to what is there.
    fn merge(
        &self,
        table: &mut Table,
        summaries: Option<(&Table, usize)>,
        others: (&Table, usize),
        (count, blocks_later): (usize, usize),
        memory: &mut [Packet],
    ) {
        let later = blocks_later as f64 * self.block_period();
        let merges = Merges { layout: self.problem.layout, table, summaries, others, count, later, memory };
        dispatch(self.instructions, merges);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::equation::rows::Rows;
    use crate::regression::simulated::{PERIOD, assert_near, least_squares, model, random, rows};
    use crate::regression::solved::local;

    const ROWS: usize = 150;
    /// Windows of some hundred rows with five unknowns and columns that grow with time.
    const ROUNDING: f64 = 1e-9;

    fn noisy() -> Rows {
        let mut rows = rows(ROWS, |time| [1.0 + 0.1 * time, 0.1], 0.3);
        rows.exclude([3, 40, 41, 90].into_iter());
        rows
    }

    /// A window's unknowns by least squares of its rows, for no constants at all: value and rate at its centre.
    fn slowly(rows: &Rows, held: &[usize], centre: f64) -> [f64; 2] {
        let of = |column: &Vec<f64>| held.iter().map(|&row| column[row]).collect::<Vec<f64>>();
        let value = of(&rows.regressors[0].value);
        let times = held.iter().map(|&row| (row as f64 - centre) * PERIOD);
        let companion = of(&rows.regressors[0].companion).into_iter().zip(&value).zip(times);
        let companion = companion.map(|((own, value), time)| own + time * value).collect();
        let found = least_squares(&[value, companion, of(&rows.rhs)]);
        [found[0], found[1]]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]
        #[test]
        fn windows_of_any_shape_are_least_squares_of_their_rows(
            step in 1_usize..6,
            first in -4_isize..12,
            parts in [4_usize..9, 0_usize..5, 0_usize..7],
        ) {
            let rows = noisy();
            let problem = model().problem(&rows, &rows.rhs, 0.0, None);
            let [before, hole, after] = parts;
            let shape = if after == 0 {
                WindowShape::of(0..before, step)
            } else {
                let all = before + hole + after;
                WindowShape { parts: vec![0..before, before + hole..all], centre: (all * step - 1) as f64 / 2.0 }
            };
            let blocks = first..first + 9;
            let shapes = [WindowShape::of(1..3, step), shape.clone()];
            for instructions in Instructions::available() {
                let solved = &solve_windows(&problem, step, &blocks, &shapes, instructions)[1];
                for (place, block) in blocks.clone().enumerate() {
                    let begin = block * step.cast_signed();
                    let all = shape.parts.iter().flat_map(|part| part.start * step..part.end * step);
                    let held: Vec<usize> = all
                        .filter_map(|offset| usize::try_from(begin + offset.cast_signed()).ok())
                        .filter(|&row| row < ROWS && rows.usable[row])
                        .collect();
                    prop_assert_eq!(solved.field(solved.fields.count())[place], held.len() as f64);
                    if held.len() > 4 {
                        let expected = slowly(&rows, &held, begin as f64 + shape.centre);
                        for (unknown, expected) in expected.into_iter().enumerate() {
                            assert_near(local(solved, place, &[], unknown), expected, ROUNDING);
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn a_window_over_a_jump_counts_as_one_without_rows() {
        let mut rows = noisy();
        rows.jumps = vec![60];
        let problem = model().problem(&rows, &rows.rhs, 0.0, None);
        let shapes = [WindowShape::of(0..5, 4)];
        let solved = &solve_windows(&problem, 4, &(0..25), &shapes, Instructions::Scalar)[0];
        let counts = solved.field(solved.fields.count());
        // Blocks from 11 on begin before row 60 and end at it or behind; that from 10 ends with row 59.
        let over: Vec<usize> = (0..25).filter(|&block| counts[block] == 0.0).collect();
        assert_eq!(over, (11..15).collect::<Vec<_>>());
    }

    #[test]
    fn the_same_bits_however_windows_are_cut() {
        let rows = noisy();
        let problem = model().problem(&rows, &rows.rhs, 0.0, None);
        let shapes = [WindowShape::of(0..13, 2)];
        for instructions in Instructions::available() {
            let whole = &solve_windows(&problem, 2, &(0..60), &shapes, instructions)[0];
            for first in [0_isize, 1, 5, 8, 31] {
                let part = &solve_windows(&problem, 2, &(first..first + 21), &shapes, instructions)[0];
                for field in 0..whole.fields.size() {
                    assert_eq!(part.field(field), &whole.field(field)[first.unsigned_abs()..][..21]);
                }
            }
        }
    }

    #[test]
    fn what_the_covariance_of_rows_makes_of_a_window_is_summed_with_its_own_time() {
        // Independent rows of variance 0.7 make 0.7 times the products of the columns.
        let rows = noisy();
        let covariance = crate::regression::row_covariance::RowCovariance::by_distance(vec![0.7]);
        let correlated = crate::regression::simulated::staged(|stages| model().correlated(&rows, &covariance, stages));
        let problem = model().problem(&rows, &rows.rhs, 0.0, Some(&correlated));
        let plain = model().problem(&rows, &rows.rhs, 0.0, None);
        let shapes = [WindowShape::of(0..11, 3)];
        let [with, without] = [&problem, &plain]
            .map(|problem| solve_windows(problem, 3, &(0..20), &shapes, Instructions::Scalar).swap_remove(0));
        let (fields, counts) = (with.fields, with.field(with.fields.count()));
        for (place, &count) in counts.iter().enumerate() {
            // Two unknowns take up the noise of two rows.
            assert_near(with.field(fields.freedom())[place], 1.4, ROUNDING);
            let unknowns = [local(&without, place, &[], 0), local(&without, place, &[], 1)];
            assert!(unknowns.iter().all(|value| value.is_finite()) && count > 28.0);
            let residual = residual(&without, place) / (count - 2.0);
            for (i, j) in [(0, 0), (1, 0), (1, 1)] {
                let ordinary = without.field(fields.covariance(i, j))[place] / residual;
                assert_near(with.field(fields.covariance(i, j))[place] / 0.7, ordinary, ROUNDING);
            }
        }
    }

    /// What all unknowns together leave of a window.
    fn residual(solved: &Solved, place: usize) -> f64 {
        let constants = solved.fields.layout.constant;
        solved.field(solved.fields.left(constants, constants))[place]
    }

    #[test]
    fn powers_of_two_make_any_length() {
        for length in 1..40 {
            let shape = WindowShape::of(3..3 + length, 1);
            let mut next = 3;
            for (first, level) in shape.pieces() {
                assert_eq!(first, next);
                next += 1 << level;
            }
            assert_eq!(next, shape.end());
        }
        assert!(random(1, 8).iter().all(|value| value.abs() < 1.8));
    }
}
