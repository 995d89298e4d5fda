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
