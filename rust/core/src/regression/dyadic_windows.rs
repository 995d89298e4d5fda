//! Solves windows of rows: summaries of blocks are merged by doubling, and each window is merged from them.
//!
//! Rows are grouped into blocks of `step`, and a window is a whole number of consecutive blocks. Summaries of `1, 2, 4,
//! …` blocks are merged from each other, and a window of any length from the summaries that its binary digits name.
//! Eight neighbouring windows are computed side by side. The numbers of a window depend only on its rows, so every way
//! of cutting the work gives the same bits.

use std::cell::RefCell;
use std::ops::Range;

use crate::regression::layout::{Fields, Layout, symmetric};
use crate::regression::problem::Problem;
use crate::regression::solve::{SolveScratch, solve};
use crate::regression::solved::Solved;
use crate::regression::summary::{absorb, count, merge, recentre};
use crate::simd::f64x8::{Packet, WIDTH};
use crate::simd::instructions::Instructions;
use crate::simd::vectors::{Kernel, Lanes, dispatch};

/// A thread keeps the memory of a table with at most so many numbers for its next piece of work.
const MOST_KEPT: usize = 1 << 17;

/// Rows absorbed at a time.
const BATCH: usize = 8;

/// Summaries of consecutive windows of one length.
#[derive(Clone, Debug, Default)]
struct Table {
    padded: usize,
    values: Vec<f64>,
}

impl Table {
    /// Makes room for `count` summaries. Entries beyond those stored are arbitrary.
    fn resize(&mut self, size: usize, count: usize) {
        // A packet may begin at any window, so the last may reach beyond.
        self.padded = count.next_multiple_of(WIDTH) + WIDTH;
        if self.values.len() < size * self.padded {
            self.values.resize(size * self.padded, 0.0);
        }
    }

    #[inline(always)]
    fn load(&self, place: usize, summary: &mut [Packet]) {
        for (entry, value) in summary.iter_mut().enumerate() {
            *value = Packet::load(&self.values[entry * self.padded + place..]);
        }
    }

    #[inline(always)]
    fn store(&mut self, place: usize, summary: &[Packet]) {
        for (entry, value) in summary.iter().enumerate() {
            value.store(&mut self.values[entry * self.padded + place..]);
        }
    }
}

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
        let centre = ((blocks.start + blocks.end) * step - 1) as f64 / 2.0;
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
    let mut tables = TABLES.take();
    let mut solved = dispatch(instructions, DyadicKernel { problem, step, blocks, shapes, tables: &mut tables });
    tables.iter_mut().filter(|table| table.values.len() > MOST_KEPT).for_each(|table| *table = Table::default());
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

/// Memory for eight windows.
struct Memory {
    rows: Vec<Packet>,
    summary: Vec<Packet>,
    other: Vec<Packet>,
    fields: Vec<Packet>,
}

impl Memory {
    fn new(layout: Layout) -> Self {
        let packets = |count: usize| vec![Packet::ZERO; count];
        Self {
            rows: packets(layout.columns().max(BATCH) * layout.columns()),
            summary: packets(layout.size()),
            other: packets(layout.size()),
            fields: packets(Fields { layout }.size()),
        }
    }
}

struct DyadicKernel<'a, 'b> {
    problem: &'a Problem<'b>,
    step: usize,
    blocks: &'a Range<isize>,
    shapes: &'a [WindowShape],
    tables: &'a mut Vec<Table>,
}

impl Kernel for DyadicKernel<'_, '_> {
    type Output = Vec<Solved>;

    #[inline(always)]
    fn run<S: Lanes>(self, _simd: S) -> Vec<Solved> {
        // The most frequent layouts are constants, so that the compiler unrolls their loops: half the time.
        match self.problem.layout {
            ALONE => self.with(ALONE),
            BESIDE_TWO => self.with(BESIDE_TWO),
            layout => self.with(layout),
        }
    }
}

/// One unknown that may grow within a window, alone and beside two constants.
const ALONE: Layout = Layout { windowed: 1, linear: true, constant: 0 };
const BESIDE_TWO: Layout = Layout { constant: 2, ..ALONE };

impl DyadicKernel<'_, '_> {
    #[inline(always)]
    fn with(self, layout: Layout) -> Vec<Solved> {
        let Self { problem, step, blocks, shapes, tables } = self;
        let windows = blocks.len();
        let mut results: Vec<_> = shapes.iter().map(|_| Solved::new(layout, blocks.start, windows)).collect();
        if windows == 0 {
            return results;
        }
        let reach = shapes.iter().map(WindowShape::end).max().unwrap_or(0);
        let pieces: Vec<_> = shapes.iter().map(WindowShape::pieces).collect();
        let levels = pieces.iter().flatten().map(|&(_, level)| level).max().unwrap_or(0);
        let block_period = step as f64 * problem.period;

        let mut memory = Memory::new(layout);
        let Memory { rows, summary, other, fields } = &mut memory;
        // Lengths repeated for the compiler.
        let rows = &mut rows[..layout.columns().max(BATCH) * layout.columns()];
        let (summary, other) = (&mut summary[..layout.size()], &mut other[..layout.size()]);
        let fields = &mut fields[..Fields { layout }.size()];
        let count = windows + reach.max(1) - 1;
        tables.resize(tables.len().max(levels + 1), Table::default());
        tables[0].resize(layout.size(), count);
        for place in (0..count).step_by(WIDTH) {
            summarise(problem, layout, step, blocks.start + place.cast_signed(), summary, rows);
            tables[0].store(place, summary);
        }
        for level in 0..levels {
            let half = 1 << level;
            let count = count + 1 - 2 * half;
            let (below, table) = tables.split_at_mut(level + 1);
            let (below, table) = (&below[level], &mut table[0]);
            table.resize(layout.size(), count);
            for place in (0..count).step_by(WIDTH) {
                below.load(place, summary);
                below.load(place + half, other);
                merge(layout, summary, other, half as f64 * block_period, rows);
                table.store(place, summary);
            }
        }
        let mut scratch = SolveScratch::new(layout);
        let variance = problem.correlated.as_ref().map(|correlated| correlated.variance);
        for ((shape, pieces), result) in shapes.iter().zip(&pieces).zip(&mut results) {
            for place in (0..windows).step_by(WIDTH) {
                let mut begin = 0;
                for (number, &(first, level)) in pieces.iter().enumerate() {
                    if number == 0 {
                        tables[level].load(place + first, summary);
                        begin = first;
                    } else {
                        tables[level].load(place + first, other);
                        merge(layout, summary, other, (first - begin) as f64 * block_period, rows);
                    }
                }
                let later = shape.centre * problem.period - begin as f64 * block_period;
                recentre(layout, summary, later, other);
                solve(layout, summary, &problem.noise, variance, &mut scratch, fields);
                result.put(place, fields);
            }
        }
        results
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
