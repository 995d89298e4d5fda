//! What is done with eight neighbouring summaries at a time: made from rows, merged, solved.

use crate::regression::layout::{Fields, Layout, symmetric};
use crate::regression::problem::Problem;
use crate::regression::solve::{SolveScratch, solve};
use crate::regression::solved::Solved;
use crate::regression::summary::{absorb, count, merge, recentre};
use crate::regression::summary_table::Table;
use crate::simd::f64x8::{Packet, WIDTH};
use crate::simd::vectors::{Kernel, Lanes};

/// Rows absorbed at a time.
const BATCH: usize = 8;

/// The most frequent layouts: one unknown that may grow within a window, alone and beside two constants.
const ALONE: Layout = Layout { windowed: 1, linear: true, constant: 0 };
const BESIDE_TWO: Layout = Layout { constant: 2, ..ALONE };

/// Does something with a layout. The most frequent ones are constants, so that the compiler unrolls their loops: half the time.
/// One number at a time gains nothing by that.
macro_rules! with_layout {
    ($layout:ident, $lanes:expr, $body:expr) => {
        match $layout {
            ALONE if $lanes > 1 => {
                let $layout = ALONE;
                $body
            }
            BESIDE_TWO if $lanes > 1 => {
                let $layout = BESIDE_TWO;
                $body
            }
            _ => $body,
        }
    };
}

/// Memory that any of the kernels needs.
pub(crate) fn memory(layout: Layout) -> Vec<Packet> {
    let columns = layout.columns();
    vec![Packet::ZERO; 2 * layout.size() + (columns.max(BATCH) * columns).max(Fields { layout }.size())]
}

/// The summaries of single blocks.
pub(crate) struct Summaries<'a, 'b> {
    pub(crate) problem: &'a Problem<'b>,
    pub(crate) step: usize,
    pub(crate) first: isize,
    pub(crate) count: usize,
    pub(crate) table: &'a mut Table,
    pub(crate) memory: &'a mut [Packet],
}

impl Kernel for Summaries<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, _simd: S) {
        let Self { problem, step, first, count, table, memory } = self;
        let layout = problem.layout;
        with_layout!(layout, S::F64_LANES, {
            let (summary, rows) = memory.split_at_mut(layout.size());
            // Lengths repeated for the compiler.
            let (summary, rows) = (&mut summary[..layout.size()], &mut rows[..BATCH * layout.columns()]);
            for place in (0..count).step_by(WIDTH) {
                summarise(problem, layout, step, first + place.cast_signed(), summary, rows);
                table.store(place, summary);
            }
        });
    }
}

/// Writes the sums of neighbouring summaries and others, whose rows begin `later` seconds after theirs, from the beginning of a table
/// on. Without summaries the others are added to what is there.
pub(crate) struct Merges<'a> {
    pub(crate) layout: Layout,
    pub(crate) table: &'a mut Table,
    pub(crate) summaries: Option<(&'a Table, usize)>,
    pub(crate) others: (&'a Table, usize),
    pub(crate) count: usize,
    pub(crate) later: f64,
    pub(crate) memory: &'a mut [Packet],
}

impl Kernel for Merges<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, _simd: S) {
        let Self { layout, table, summaries, others: (others, from), count, later, memory } = self;
        with_layout!(layout, S::F64_LANES, {
            let (summary, rest) = memory.split_at_mut(layout.size());
            let (more, rows) = rest.split_at_mut(layout.size());
            let (summary, more) = (&mut summary[..layout.size()], &mut more[..layout.size()]);
            let rows = &mut rows[..layout.columns() * layout.columns()];
            for packet in (0..count).step_by(WIDTH) {
                match summaries {
                    Some((summaries, first)) => summaries.load(first + packet, summary),
                    None => table.load(packet, summary),
                }
                others.load(from + packet, more);
                merge(layout, summary, more, later, rows);
                table.store(packet, summary);
            }
        });
    }
}

/// Solves neighbouring summaries at a time after their origins.
pub(crate) struct Solves<'a, 'b> {
    pub(crate) problem: &'a Problem<'b>,
    pub(crate) summaries: (&'a Table, usize),
    pub(crate) count: usize,
    pub(crate) later: f64,
    pub(crate) scratch: &'a mut SolveScratch,
    pub(crate) result: &'a mut Solved,
    /// Where the first result stands.
    pub(crate) place: usize,
    pub(crate) memory: &'a mut [Packet],
}

impl Kernel for Solves<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, _simd: S) {
        let Self { problem, summaries: (summaries, first), count, later, scratch, result, place, memory } = self;
        let layout = problem.layout;
        let variance = problem.correlated.as_ref().map(|correlated| correlated.variance);
        with_layout!(layout, S::F64_LANES, {
            let size = Fields { layout }.size();
            let (summary, rest) = memory.split_at_mut(layout.size());
            let (noise, fields) = rest.split_at_mut(layout.size());
            let (summary, noise) = (&mut summary[..layout.size()], &mut noise[..layout.size()]);
            let fields = &mut fields[..size];
            for packet in (0..count).step_by(WIDTH) {
                summaries.load(first + packet, summary);
                recentre(layout, summary, later, noise);
                solve(layout, summary, &problem.noise, variance, scratch, fields);
                result.put(place + packet, fields);
            }
        });
    }
}

/// Summarises eight neighbouring blocks.
#[inline(always)]
fn summarise(
    problem: &Problem<'_>,
    layout: Layout,
    step: usize,
    block: isize,
    summary: &mut [Packet],
    rows: &mut [Packet],
) {
    let (columns, q) = (layout.columns(), layout.windowed);
    summary.fill(Packet::ZERO);
    let begin = block * step.cast_signed();
    for first in (0..step).step_by(BATCH) {
        let batch = BATCH.min(step - first);
        for offset in 0..batch {
            let time = (first + offset) as f64 * problem.period;
            let place = begin + (first + offset).cast_signed();
            let row = &mut rows[offset * columns..(offset + 1) * columns];
            for (value, column) in row.iter_mut().zip(&problem.windowed[..q]) {
                *value = Packet::gather(column, place, step);
            }
            if layout.linear {
                for i in 0..q {
                    row[q + i] = Packet::gather(problem.companions[i], place, step) + Packet::splat(time) * row[i];
                }
            }
            for i in 0..layout.constant {
                row[layout.local() + i] = Packet::gather(problem.constants[i], place, step);
            }
            row[columns - 1] = Packet::gather(problem.rhs, place, step);
            count(layout, summary, Packet::gather_flags(problem.usable, place, step), time);
            if let Some(correlated) = &problem.correlated {
                for i in 0..layout.local() {
                    let noisy = match i.checked_sub(q) {
                        None => Packet::gather(&correlated.windowed[i], place, step),
                        Some(i) => {
                            Packet::gather(&correlated.companions[i], place, step)
                                + Packet::splat(time) * Packet::gather(&correlated.windowed[i], place, step)
                        }
                    };
                    // Both halves of a product that the window's ends make unsymmetric.
                    for j in 0..layout.local() {
                        let half = Packet::splat(if i == j { 1.0 } else { 0.5 });
                        summary[layout.noise() + symmetric(i, j)] += half * noisy * row[j];
                    }
                }
            }
        }
        absorb(layout, summary, rows, batch, false);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equation::rows::Rows;
    use crate::regression::model::Model;
    use crate::regression::simulated::{PERIOD, assert_near, least_squares, model, products, rows};
    use crate::regression::solved::local;
    use crate::simd::instructions::Instructions;
    use crate::simd::vectors::dispatch;

    const ROWS: usize = 150;
    /// Reflections of some dozen rows whose columns grow with time.
    const ROUNDING: f64 = 1e-11;

    /// Both layouts that the compiler unrolls, and one that it does not.
    fn models() -> [Model; 3] {
        [
            model(),
            Model { windowed: vec![0], constant: vec![], linear: true, ..Model::default() },
            Model { windowed: vec![0, 1], constant: vec![2], linear: false, ..Model::default() },
        ]
    }

    fn noisy() -> Rows {
        let mut rows = rows(ROWS, |time| [1.0 + 0.1 * time, 0.1], 0.3);
        rows.exclude([3, 40, 41, 90].into_iter());
        rows
    }

    /// The columns of some rows, of which those before and behind the record are zero, with times from the first of them.
    fn columns(problem: &Problem<'_>, begin: isize, count: usize) -> Vec<Vec<f64>> {
        let of = |column: &[f64]| -> Vec<f64> {
            let at = |offset: usize| usize::try_from(begin + offset.cast_signed()).ok();
            (0..count).map(|offset| at(offset).and_then(|row| column.get(row)).copied().unwrap_or(0.0)).collect()
        };
        let windowed: Vec<_> = problem.windowed.iter().map(|column| of(column)).collect();
        let mut found = windowed.clone();
        if problem.layout.linear {
            for (companion, value) in problem.companions.iter().zip(&windowed) {
                let times = (0..count).map(|offset| offset as f64 * PERIOD);
                found.push(
                    of(companion).iter().zip(value).zip(times).map(|((own, one), time)| own + time * one).collect(),
                );
            }
        }
        found.extend(problem.constants.iter().map(|column| of(column)));
        found.push(of(problem.rhs));
        found
    }

    /// What a summary says of rows, whatever the signs of its factor.
    fn assert_is_of(table: &Table, place: usize, problem: &Problem<'_>, begin: isize, count: usize) {
        let layout = problem.layout;
        let mut summary = vec![Packet::ZERO; layout.size()];
        table.load(place, &mut summary);
        let at = |row: usize, column: usize| if row <= column { summary[layout.entry(row, column)].0[0] } else { 0.0 };
        let expected = products(&columns(problem, begin, count));
        for i in 0..layout.columns() {
            for j in 0..=i {
                let product: f64 = (0..layout.columns()).map(|k| at(k, i) * at(k, j)).sum();
                assert_near(product, expected[i][j], ROUNDING * (1.0 + expected[i][i] + expected[j][j]));
            }
        }
        let usable = (begin..begin + count.cast_signed())
            .filter(|&row| usize::try_from(row).is_ok_and(|row| problem.usable.get(row) == Some(&true)));
        assert_eq!(summary[layout.sums()].0[0], usable.count() as f64);
    }

    /// Summaries of blocks from one of them on.
    fn summarised(problem: &Problem<'_>, step: usize, first: isize, count: usize, with: Instructions) -> Table {
        let mut table = Table::default();
        table.resize(problem.layout.size(), count);
        let memory = &mut memory(problem.layout);
        dispatch(with, Summaries { problem, step, first, count, table: &mut table, memory });
        table
    }

    #[test]
    fn blocks_of_any_length_have_the_products_of_their_rows() {
        let rows = noisy();
        for model in models() {
            let problem = model.problem(&rows, &rows.rhs, 0.0, None);
            for instructions in Instructions::available() {
                for (step, first) in [(1, 37), (BATCH - 1, 0), (BATCH, 3), (BATCH + 1, -2), (3 * BATCH, 1)] {
                    let count = 11;
                    let table = summarised(&problem, step, first, count, instructions);
                    for place in 0..count {
                        let begin = (first + place.cast_signed()) * step.cast_signed();
                        assert_is_of(&table, place, &problem, begin, step);
                    }
                }
            }
        }
    }

    #[test]
    fn merged_summaries_have_the_products_of_both() {
        let (rows, step, count) = (noisy(), 4, 13);
        for model in models() {
            let problem = model.problem(&rows, &rows.rhs, 0.0, None);
            let layout = problem.layout;
            for instructions in Instructions::available() {
                let blocks = summarised(&problem, step, 0, count + 4, instructions);
                let mut both = Table::default();
                both.resize(layout.size(), count);
                let memory = &mut memory(layout);
                // Blocks 1 and 2, then block 3, for every window one block later.
                for (summaries, others, blocks_later) in
                    [(Some((&blocks, 1)), (&blocks, 2), 1), (None, (&blocks, 3), 2)]
                {
                    let later = (blocks_later * step) as f64 * PERIOD;
                    dispatch(
                        instructions,
                        Merges { layout, table: &mut both, summaries, others, count, later, memory },
                    );
                    for place in 0..count {
                        let begin = ((place + 1) * step).cast_signed();
                        assert_is_of(&both, place, &problem, begin, (blocks_later + 1) * step);
                    }
                }
            }
        }
    }

    #[test]
    fn a_summary_is_solved_at_the_time_that_is_asked_for_and_written_where_it_belongs() {
        let (rows, step, count) = (rows(ROWS, |time| [1.0 + 0.1 * time, 0.1], 0.3), 20, 6);
        let model = Model { windowed: vec![0], constant: vec![], linear: true, ..Model::default() };
        let problem = model.problem(&rows, &rows.rhs, 0.0, None);
        for instructions in Instructions::available() {
            let table = summarised(&problem, step, 0, count, instructions);
            let mut result = Solved::new(problem.layout, 0, 2 * WIDTH);
            let later = 7.0 * PERIOD;
            let solves = Solves {
                problem: &problem,
                summaries: (&table, 1),
                count: count - 1,
                later,
                scratch: &mut SolveScratch::new(problem.layout),
                result: &mut result,
                place: WIDTH,
                memory: &mut memory(problem.layout),
            };
            dispatch(instructions, solves);
            for place in 0..count - 1 {
                let [value, rate] = least_squares(&columns(&problem, ((place + 1) * step).cast_signed(), step))[..]
                else {
                    panic!("a value and its rate")
                };
                assert_near(local(&result, WIDTH + place, &[], 0), value + later * rate, ROUNDING);
                assert_near(local(&result, WIDTH + place, &[], 1), rate, ROUNDING);
            }
            assert_eq!(result.field(result.fields.count())[..WIDTH], [0.0; WIDTH]);
        }
    }
}
