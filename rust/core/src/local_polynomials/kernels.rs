//! The kernels that step from a start through a block of windows.

use std::ops::Range;

use crate::lanes::interleaved::Strips;
use crate::lanes::output::FinishedRows;
use crate::lanes::tile::{TILE, Tile};
use crate::local_polynomials::evaluate::Finish;
use crate::local_polynomials::sliding_projection::{Projection, State};
use crate::simd::instructions::Instructions;
use crate::simd::vectors::{Kernel, Lanes, dispatch};

/// Windows that are stepped to before they are finished. Each step depends on the one before, finishing does not: in separate loops each
/// keeps the processor busy, and so few states stay in the nearest cache.
pub(crate) const STEPS: usize = 8;

/// Numbers that so many states take.
pub(crate) fn states<const D: usize>(count: usize, lanes: usize) -> usize {
    count * (D + 2) * lanes
}

/// Takes the numbers of some lanes from another state.
pub(crate) fn replace(state: &mut [f64], other: &[f64], lost: u32, lanes: usize) {
    for (place, (value, &other)) in state.iter_mut().zip(other).enumerate() {
        if lost >> (place % lanes) & 1 == 1 {
            *value = other;
        }
    }
}

/// Which way windows are gone through from a start. The start itself is the first window going forwards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    Forward,
    Backward,
}

impl Direction {
    /// The row of a block that its `index`-th window on this side of the start is.
    pub(crate) fn row(self, start: usize, index: usize) -> usize {
        match self {
            Self::Forward => start + index,
            Self::Backward => start - 1 - index,
        }
    }

    /// One more than the last window that shares a tile with the window `index`.
    pub(crate) fn end_of_tile(self, start: usize, index: usize) -> usize {
        let row = self.row(start, index);
        match self {
            Self::Forward => index + TILE - row % TILE,
            Self::Backward => index + row % TILE + 1,
        }
    }

    /// The rows of some windows.
    pub(crate) fn rows(self, start: usize, windows: Range<usize>) -> Range<usize> {
        match self {
            Self::Forward => start + windows.start..start + windows.end,
            Self::Backward => start - windows.end..start - windows.start,
        }
    }

    /// Turns a state into the one of this direction, or back: in reversed time odd coefficients change their sign.
    pub(crate) fn turn<const D: usize>(self, state: &mut [f64]) {
        if self == Self::Backward {
            let lanes = state.len() / states::<D>(1, 1);
            for coefficient in state[..D * lanes].chunks_exact_mut(lanes).skip(1).step_by(2) {
                for value in coefficient {
                    *value = -*value;
                }
            }
        }
    }
}

/// Lays out the samples of a run.
pub(crate) struct Fill<'a> {
    pub(crate) strips: &'a mut Strips,
    pub(crate) samples: &'a [f64],
}

impl Kernel for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        self.strips.fill(simd, self.samples);
    }
}

/// Projects the window at one row of each lane's block.
pub(crate) struct Start<'a, const D: usize, const RESIDUAL: bool> {
    pub(crate) projection: &'a Projection<D>,
    pub(crate) strips: &'a Strips,
    pub(crate) references: &'a [f64],
    pub(crate) row: usize,
    pub(crate) state: &'a mut [f64],
}

impl<const D: usize, const RESIDUAL: bool> Kernel for Start<'_, D, RESIDUAL> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let reference = simd.load(self.references, 0);
        let start = self.projection.start::<S, RESIDUAL>(simd, self.strips, self.row, reference);
        start.store(simd, self.state, 0);
    }
}

/// Goes through windows on one side of the start and finishes them into the tile.
pub(crate) struct Sweep<'a, const D: usize, const RESIDUAL: bool> {
    pub(crate) projection: &'a Projection<D>,
    pub(crate) finish: &'a Finish,
    pub(crate) strips: &'a Strips,
    pub(crate) references: &'a [f64],
    pub(crate) state: &'a mut [f64],
    pub(crate) states: &'a mut [f64],
    pub(crate) tile: &'a mut Tile,
    pub(crate) direction: Direction,
    /// The row of the start, and the windows to go through, counted from it.
    pub(crate) start: usize,
    pub(crate) windows: Range<usize>,
    /// Whether the state is that of the first window already.
    pub(crate) ready: bool,
    /// The rows whose windows are finished.
    pub(crate) finished: FinishedRows,
}

impl<const D: usize, const RESIDUAL: bool> Kernel for Sweep<'_, D, RESIDUAL> {
    /// The window come to and a bit for every lane that must start afresh there, or the end and none.
    type Output = (usize, u32);

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) -> (usize, u32) {
        self.through::<S, false>(simd)
    }
}

/// The same where orders are averaged: a kernel of its own, so that each has the registers to itself.
struct Averaging<'a, const D: usize, const RESIDUAL: bool>(Sweep<'a, D, RESIDUAL>);

impl<const D: usize, const RESIDUAL: bool> Kernel for Averaging<'_, D, RESIDUAL> {
    type Output = (usize, u32);

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) -> (usize, u32) {
        self.0.through::<S, true>(simd)
    }
}

impl<const D: usize, const RESIDUAL: bool> Sweep<'_, D, RESIDUAL> {
    /// Runs the kernel that serves.
    pub(crate) fn go(self, instructions: Instructions) -> (usize, u32) {
        // Orders are known where residuals are.
        if RESIDUAL && self.finish.averages() {
            dispatch(instructions, Averaging(self))
        } else {
            dispatch(instructions, self)
        }
    }

    #[inline(always)]
    fn through<S: Lanes, const AVERAGE: bool>(mut self, simd: S) -> (usize, u32) {
        let reference = simd.load(self.references, 0);
        let (backward, bare) = (self.direction == Direction::Backward, self.finish.is_bare());
        let mut first = self.windows.start;
        while first < self.windows.end {
            let end = self.windows.end.min(first + STEPS);
            let (come_to, lost) = self.step(simd, reference, first..end);
            for index in first..come_to {
                let row = self.direction.row(self.start, index);
                if !self.finished.hold(row) {
                    continue;
                }
                if !AVERAGE && bare {
                    let stored = (&*self.states, index - first);
                    self.finish.give::<S, D, RESIDUAL>(simd, stored, reference, backward, self.tile, row);
                    continue;
                }
                let state = State::<S, D>::load(simd, self.states, index - first);
                if AVERAGE {
                    self.finish.finish_average::<S, D>(simd, &state, reference, backward, self.tile, row);
                } else {
                    self.finish.finish::<S, D, RESIDUAL>(simd, &state, reference, backward, self.tile, row);
                }
            }
            if lost != 0 {
                return (come_to, lost);
            }
            first = end;
        }
        (self.windows.end, 0)
    }

    /// Steps to some windows and keeps their states. Returns the window come to and the lanes that must start afresh there.
    #[inline(always)]
    fn step<S: Lanes>(&mut self, simd: S, reference: S::f64s, windows: Range<usize>) -> (usize, u32) {
        let (projection, strips) = (self.projection, self.strips);
        let (length, start) = (projection.length(), self.start);
        let mut state = State::load(simd, self.state, 0);
        let mut first = windows.start;
        if self.ready {
            state.store(simd, self.states, 0);
            self.ready = false;
            first += 1;
        }
        // Going forwards from row to row + 1 the sample after the window enters; backwards the one before it.
        let forward = self.direction == Direction::Forward;
        let row = if forward { (start + first).max(1) - 1 } else { start.max(first) - first };
        let (mut entering, mut leaving) = if forward {
            (strips.cursor(row + length), strips.cursor(row))
        } else {
            (strips.cursor(row.max(1) - 1), strips.cursor((row + length).max(1) - 1))
        };
        for index in first..windows.end {
            let new = simd.sub_f64s(strips.at(simd, entering), reference);
            let old = simd.sub_f64s(strips.at(simd, leaving), reference);
            let lost = simd.bits(projection.step::<S, RESIDUAL>(simd, &mut state, new, old));
            if lost != 0 {
                state.store(simd, self.state, 0);
                self.ready = true;
                return (index, lost);
            }
            state.store(simd, self.states, index - windows.start);
            (entering, leaving) = if forward {
                (strips.after(entering), strips.after(leaving))
            } else {
                (strips.before(entering), strips.before(leaving))
            };
        }
        state.store(simd, self.state, 0);
        (windows.end, 0)
    }
}
