//! Sums of the blocks of a long record, for windows of many lengths: a block twice as long is the sum of two.

use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::Piece;
use crate::exec::stages::Stages;
use crate::regression::dyadic_kernels::{Merges, Summaries, memory};
use crate::regression::layout::Layout;
use crate::regression::problem::Problem;
use crate::regression::summary_table::Table;
use crate::simd::instructions::Instructions;
use crate::simd::vectors::dispatch;

/// Rows of the shortest blocks that are kept: their sums take as many numbers as two rows each.
const SHORTEST: usize = 16;

/// Of fewer rows blocks are summed as they are needed.
const MANY: usize = 1 << 15;

/// Blocks in a piece of work.
const PIECE: usize = 512;

/// Sums of all blocks of a record, in their order: of the shortest, of those twice as long, and so on.
pub(crate) struct BlockSums {
    /// Rows of the shortest.
    step: usize,
    /// The sums of each length, and how many blocks there are.
    tables: Vec<(Table, usize)>,
}

impl BlockSums {
    /// Those of the blocks of so many rows that windows of some lengths are made of, or `None` where they would hardly be used.
    pub(crate) fn new(
        problem: &Problem<'_>,
        blocks: impl Iterator<Item = usize> + Clone,
        instructions: Instructions,
        stages: &mut Stages<'_, '_>,
    ) -> Result<Option<Self>, Error> {
        let kept = blocks.filter(|rows| *rows >= SHORTEST);
        let (Some(step), Some(longest)) = (kept.clone().min(), kept.max()) else { return Ok(None) };
        if longest == step || problem.rows() <= MANY {
            return Ok(None);
        }
        let (layout, levels) = (problem.layout, (longest / step).ilog2());
        let count = problem.rows().div_ceil(step << levels) << levels;
        let pieces = (0..count).step_by(PIECE).map(|first| first..(first + PIECE).min(count));
        let pieces = pieces.map(|blocks| Piece { size: blocks.len() * step, content: blocks });
        let work = |blocks: Range<usize>, memory: &mut Vec<_>| {
            let mut table = Table::default();
            table.resize(layout.size(), blocks.len());
            let (first, count) = (blocks.start.cast_signed(), blocks.len());
            dispatch(instructions, Summaries { problem, step, first, count, table: &mut table, memory });
            (blocks, table)
        };
        let mut all = Table::default();
        all.resize(layout.size(), count);
        for (blocks, part) in stages.map(pieces.collect(), || memory(layout), work)? {
            all.copy(layout.size(), (&part, 0, 1), blocks);
        }
        let mut tables = vec![(all, count)];
        for level in 0..levels {
            let block = (step << level) as f64 * problem.period;
            let longer = sums_of_two(layout, &tables[tables.len() - 1], block, instructions);
            tables.push(longer);
        }
        Ok(Some(Self { step, tables }))
    }

    /// The sums of blocks of so many rows, and how many there are.
    pub(crate) fn of(&self, step: usize) -> Option<(&Table, usize)> {
        let (table, count) = self.tables.iter().enumerate().find(|(level, _)| self.step << level == step)?.1;
        Some((table, *count))
    }
}

/// Sums of every block and the next, each of so many seconds.
fn sums_of_two(
    layout: Layout,
    (shorter, count): &(Table, usize),
    later: f64,
    instructions: Instructions,
) -> (Table, usize) {
    let half = count / 2;
    let [mut first, second] = [0, 1].map(|place| {
        let mut table = Table::default();
        table.resize(layout.size(), half);
        table.copy(layout.size(), (shorter, place, 2), 0..half);
        table
    });
    let memory = &mut memory(layout);
    let merges =
        Merges { layout, table: &mut first, summaries: None, others: (&second, 0), count: half, later, memory };
    dispatch(instructions, merges);
    (first, half)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::fit::Fit;
    use crate::regression::simulated::{assert_near, model, rows, staged, white};
    use crate::regression::solved::{is_determined, local};
    use crate::regression::window_length::Scale;

    const ROWS: usize = 40_000;
    const DEVIATION: f64 = 0.3;
    /// Reflections of some ten thousand rows whose columns grow with time.
    const ROUNDING: f64 = 1e-8;

    #[test]
    fn windows_are_the_same_whichever_way_their_blocks_were_summed() {
        let mut rows = rows(ROWS, |time| [(0.002 * time).sin(), 0.002 * (0.002 * time).cos()], DEVIATION);
        rows.exclude([3, 700, 701, ROWS - 1].into_iter());
        let problem = model().problem(&rows, &rows.rhs, 0.0, None);
        let (scales, expected) = (Scale::all(ROWS, 6), white(DEVIATION * DEVIATION));
        for instructions in Instructions::available() {
            let steps = scales.iter().map(|scale| scale.step);
            let sums = staged(|stages| BlockSums::new(&problem, steps, instructions, stages)).expect("long windows");
            let long = scales.iter().filter(|scale| sums.of(scale.step).is_some());
            assert_eq!(long.clone().count(), scales.iter().filter(|scale| scale.step >= SHORTEST).count());
            for scale in long {
                let fit = |sums| {
                    let one = std::slice::from_ref(scale);
                    let fits = staged(|stages| Fit::of_lengths((&problem, sums), one, expected, instructions, stages));
                    fits.into_iter().flatten().next().expect("constants")
                };
                let (with, without) = (fit(Some(&sums)), fit(None));
                let constants = &without.pooled.values;
                for (one, other) in with.pooled.values.iter().zip(constants) {
                    assert_near(*one, *other, ROUNDING);
                }
                for (with, without) in [(&with.full, &without.full)]
                    .into_iter()
                    .chain(with.leave_gap_out.iter().zip(&without.leave_gap_out))
                {
                    assert_eq!(with.len(), without.len());
                    let counts = with.fields.count();
                    assert_eq!(with.field(counts), without.field(counts), "{}", scale.span());
                    for window in (0..with.len()).filter(|&window| is_determined(without, window)) {
                        for unknown in 0..2 {
                            let of = |solved| local(solved, window, constants, unknown);
                            assert_near(of(with), of(without), ROUNDING);
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn of_few_rows_or_one_length_nothing_is_kept() {
        let kept = |count: usize, which: &dyn Fn(&Scale) -> bool| {
            let rows = rows(count, |time| [1.0 + 0.01 * time, 0.01], DEVIATION);
            let problem = model().problem(&rows, &rows.rhs, 0.0, None);
            let scales: Vec<Scale> = Scale::all(count, 6).into_iter().filter(which).collect();
            let steps = scales.iter().map(|scale| scale.step);
            staged(|stages| BlockSums::new(&problem, steps, Instructions::Scalar, stages)).is_some()
        };
        assert!(kept(ROWS, &|scale| scale.step >= 64));
        assert!(!kept(MANY, &|_| true));
        assert!(!kept(ROWS, &|scale| scale.step <= SHORTEST));
    }
}
