//! The walk over the samples of a record: projection, choice of order and derivatives of every window in one pass.
//!
//! A record's windows are numbered by their first sample. Span `g` holds the windows `g S … (g+1) S - 1`; its start lies in its
//! middle, at `g S + S/2`, or at the record's last window where that comes first. Blocks are one span, or several short ones, and are
//! worked on in runs, as many side by side as there are lanes. Which spans share a run does not matter, since lanes keep apart, so
//! any cutting of a record gives the same bits. Where few windows are wanted, each is projected on its own (`apart.rs`).

use std::fmt::Debug;
use std::ops::Range;

use crate::lanes::interleaved::Strips;
use crate::lanes::output::Outputs;
use crate::lanes::store::Write;
use crate::lanes::tile::{TILE, Tile};
use crate::local_polynomials::apart::{self, Apart, ApartScratch};
use crate::local_polynomials::basis::Basis;
use crate::local_polynomials::estimates::Estimates;
use crate::local_polynomials::evaluate::{Finish, Functional};
use crate::local_polynomials::kernels::{Direction, Fill, STEPS, Start, Sweep, replace, states};
use crate::local_polynomials::sliding_projection::{Projection, SHORTEST_BLOCK};
use crate::record::buffer::Stretch;
use crate::record::samples::Samples;
use crate::simd::aligned::Aligned;
use crate::simd::instructions::Instructions;
use crate::simd::vectors::{MOST_LANES, dispatch};
use crate::status::Status;

/// No record has so many samples.
const FARTHEST: usize = 1 << 40;

/// Samples copied out of a record at a time, about: several runs of short windows.
const STRETCH: usize = 1 << 13;

/// What an engine can do, whatever the number of its degrees.
pub(crate) trait Walk: Debug + Send + Sync {
    fn block(&self) -> usize;
    /// Windows of a span that come before its start: they are reached backwards from it.
    fn backward(&self) -> usize;
    /// Windows from one piece of work to the next, where every `step`-th is wanted: multiples of it waste no work.
    fn stride(&self, step: usize) -> usize;
    fn scratch(&self) -> EngineScratch;
    fn functionals(&self) -> &[Functional];
    fn walk(
        &self,
        record: &dyn Samples,
        windows: Range<usize>,
        estimates: &mut Estimates<'_>,
        scratch: &mut EngineScratch,
    );
}

/// The engine with the smallest kernels that hold a basis, which follow the residual or do not.
pub(crate) fn engine(basis: &Basis, finish: Finish, residual: bool, instructions: Instructions) -> Box<dyn Walk> {
    match (residual, basis.degrees()) {
        (true, ..=8) => Box::new(Engine::<8, true>::new(basis, finish, instructions)),
        (true, _) => Box::new(Engine::<16, true>::new(basis, finish, instructions)),
        (false, ..=4) => Box::new(Engine::<4, false>::new(basis, finish, instructions)),
        (false, ..=6) => Box::new(Engine::<6, false>::new(basis, finish, instructions)),
        (false, ..=8) => Box::new(Engine::<8, false>::new(basis, finish, instructions)),
        (false, ..=12) => Box::new(Engine::<12, false>::new(basis, finish, instructions)),
        (false, ..=16) => Box::new(Engine::<16, false>::new(basis, finish, instructions)),
        (false, _) => Box::new(Engine::<20, false>::new(basis, finish, instructions)),
    }
}

/// Plan of the walk with kernels of `D` degrees, which follow the residual or do not.
#[derive(Debug)]
pub(crate) struct Engine<const D: usize, const RESIDUAL: bool> {
    projection: Projection<D>,
    finish: Finish,
    instructions: Instructions,
}

/// Memory of one thread.
#[derive(Debug)]
pub(crate) struct EngineScratch {
    stretch: Stretch,
    strips: Strips,
    /// The reference that is subtracted from each lane's samples.
    references: [f64; MOST_LANES],
    /// The start of each lane's block, and the windows that a sweep has come to.
    start: Aligned,
    state: Aligned,
    /// States between stepping and finishing.
    states: Aligned,
    tile: Tile,
    /// For windows that are projected one by one.
    apart: Option<ApartScratch>,
}

impl<const D: usize, const RESIDUAL: bool> Engine<D, RESIDUAL> {
    pub(crate) fn new(basis: &Basis, finish: Finish, instructions: Instructions) -> Self {
        Self { projection: Projection::new(basis), finish, instructions }
    }

    /// Whether every `step`-th window is projected on its own.
    fn apart(&self, step: usize) -> bool {
        apart::serves(self.projection.length(), self.projection.span(), step)
    }

    /// Samples of a window before the one it is said to be around: its centre, or the last one before that.
    fn before_centre(&self) -> usize {
        (self.projection.length() - 1) / 2
    }
}

impl<const D: usize, const RESIDUAL: bool> Walk for Engine<D, RESIDUAL> {
    fn block(&self) -> usize {
        self.projection.block()
    }

    fn backward(&self) -> usize {
        self.projection.backward()
    }

    fn stride(&self, step: usize) -> usize {
        // A step beyond every record may be any number.
        self.instructions.lanes() * if self.apart(step) { step.min(FARTHEST) } else { self.block() }
    }

    fn functionals(&self) -> &[Functional] {
        self.finish.functionals()
    }

    fn scratch(&self) -> EngineScratch {
        let lanes = self.instructions.lanes();
        EngineScratch {
            stretch: Stretch::default(),
            strips: Strips::new(self.block(), self.projection.length(), lanes),
            references: [0.0; MOST_LANES],
            start: Aligned::zeros(states::<D>(1, lanes)),
            state: Aligned::zeros(states::<D>(1, lanes)),
            states: Aligned::zeros(states::<D>(STEPS, lanes)),
            tile: Tile::new(self.finish.fields(RESIDUAL), TILE, lanes),
            apart: None,
        }
    }

    fn walk(
        &self,
        record: &dyn Samples,
        windows: Range<usize>,
        estimates: &mut Estimates<'_>,
        scratch: &mut EngineScratch,
    ) {
        let (block, backward, lanes) = (self.block(), self.projection.backward(), self.instructions.lanes());
        let last = record.len() - self.projection.length();
        debug_assert!(windows.end <= last + 1, "a window must lie in the record");
        // The last span's start may have to move down to the last window; that span then runs alone.
        let in_span = last % self.projection.span();
        let moved = if in_span < backward { last - in_span } else { last + 1 };
        let Estimates { elements, derivatives, order, status, sigma } = estimates;
        let mut values: Vec<&mut [f64]> = derivatives.iter_mut().map(|values| &mut **values).collect();
        if RESIDUAL {
            values.push(sigma);
        }
        let mut outputs = Outputs { elements: *elements, values, order, status };
        if self.apart(outputs.elements.step) {
            let Self { projection, finish, instructions } = self;
            let apart =
                Apart::<D, RESIDUAL> { projection, finish, instructions: *instructions, step: outputs.elements.step };
            apart.walk(record, windows, &mut outputs, &mut scratch.apart);
            return;
        }
        // What a run reads, and how much of it is not read again by the next.
        let (read, advance) = (scratch.strips.samples().cast_signed(), (lanes * block).cast_signed());
        scratch.stretch.load(record, 0..0);
        let mut window = windows.start;
        while window < windows.end {
            let (base, end) = if window >= moved {
                (last.cast_signed() - backward.cast_signed(), windows.end)
            } else {
                let first = window - window % block;
                (first.cast_signed(), windows.end.min(moved).min(first + lanes * block))
            };
            if !scratch.stretch.holds(&(base..base + read)) {
                let runs =
                    (STRETCH.cast_signed() / advance).clamp(1, (windows.end - window).cast_signed() / advance + 1);
                scratch.stretch.load(record, base..base + read + (runs - 1) * advance);
            }
            let run = EngineRun { engine: self, base, windows: window..end };
            run.work(scratch, &mut outputs);
            run.invalidate(scratch.stretch.unusable(base..base + read), &mut outputs);
            window = end;
        }
    }
}

/// Blocks side by side: lane `l` works on the windows that begin from `base + l B` on, of which `windows` are wanted.
struct EngineRun<'a, const D: usize, const RESIDUAL: bool> {
    engine: &'a Engine<D, RESIDUAL>,
    base: isize,
    windows: Range<usize>,
}

impl<const D: usize, const RESIDUAL: bool> EngineRun<'_, D, RESIDUAL> {
    /// Finishes the windows of the run, span by span, from the start forwards, then backwards.
    ///
    /// The kernels are called one by one, not from one another: in one function they would spill each other's registers.
    fn work(&self, scratch: &mut EngineScratch, outputs: &mut Outputs<'_>) {
        let Engine { projection, finish, instructions } = self.engine;
        let (instructions, span, wanted) = (*instructions, projection.span(), self.rows());
        let EngineScratch { stretch, strips, references, start: at_start, state, states, tile, .. } = scratch;
        dispatch(instructions, Fill { samples: stretch.from(self.base, strips.samples()), strips });
        // A short block is written whole, with its spans together; a long one tile by tile.
        let whole = projection.block() <= TILE;
        let ahead = self.engine.before_centre().cast_signed();
        let finished = outputs.elements.rows_from(self.base + ahead, SHORTEST_BLOCK);
        for first in (wanted.start - wanted.start % span..wanted.end).step_by(span) {
            let start = first + projection.backward();
            self.take_references(stretch, start, references);
            dispatch(
                instructions,
                Start::<D, RESIDUAL> { projection, strips, references, row: start, state: at_start },
            );
            let forwards = wanted.end.min(first + span).saturating_sub(start);
            let backwards = start.saturating_sub(wanted.start.max(first));
            for (direction, count) in [(Direction::Forward, forwards), (Direction::Backward, backwards)] {
                state.copy_from_slice(at_start);
                direction.turn::<D>(state);
                let (mut done, mut ready, mut written) = (0, direction == Direction::Forward, 0);
                while done < count {
                    let end = count.min(direction.end_of_tile(start, done));
                    let sweep = Sweep::<D, RESIDUAL> {
                        projection,
                        finish,
                        strips,
                        references,
                        state,
                        states,
                        tile,
                        direction,
                        start,
                        windows: done..end,
                        ready,
                        finished,
                    };
                    let lost;
                    (done, lost) = sweep.go(instructions);
                    ready = lost != 0;
                    if ready {
                        // The next window of some lanes is projected afresh.
                        let mut fresh = state.clone();
                        let row = direction.row(start, done);
                        let afresh = Start::<D, RESIDUAL> { projection, strips, references, row, state: &mut fresh };
                        dispatch(instructions, afresh);
                        direction.turn::<D>(&mut fresh);
                        replace(state, &fresh, lost, instructions.lanes());
                    } else if !whole {
                        self.write(tile, direction.rows(start, written..done), outputs);
                        written = done;
                    }
                }
            }
        }
        if whole {
            self.write(tile, wanted, outputs);
        }
    }

    /// Writes out some rows, which the tile holds.
    fn write(&self, tile: &Tile, rows: Range<usize>, outputs: &mut Outputs<'_>) {
        let Engine { projection, finish, instructions } = self.engine;
        let write = Write {
            tile,
            rows,
            base: self.base,
            block: projection.block(),
            windows: self.windows.clone(),
            ahead: self.engine.before_centre().cast_signed(),
            fixed_order: finish.fixed_order(RESIDUAL),
            outputs,
        };
        dispatch(*instructions, write);
    }

    /// Takes a reference for each lane: the sample at the centre of the start in a row, or the nearest to it that is a number.
    fn take_references(&self, stretch: &Stretch, start: usize, references: &mut [f64; MOST_LANES]) {
        let projection = &self.engine.projection;
        let half = projection.length() / 2;
        let centre = self.base + (start + half).cast_signed();
        for (lane, reference) in references[..self.engine.instructions.lanes()].iter_mut().enumerate() {
            *reference = stretch.nearest_usable(centre + (lane * projection.block()).cast_signed(), half);
        }
    }

    /// The rows of windows that any lane needs.
    fn rows(&self) -> Range<usize> {
        let block = self.engine.block();
        let row = |window: usize| (window.cast_signed() - self.base).unsigned_abs();
        let (first, end) = (row(self.windows.start), row(self.windows.end));
        if end <= block { first..end } else { 0..block }
    }

    /// Makes windows with an unusable sample NaN.
    fn invalidate(&self, unusable: &[usize], outputs: &mut Outputs<'_>) {
        let (before, length) = (self.engine.before_centre(), self.engine.projection.length());
        let mut from = self.windows.start;
        for &sample in unusable {
            let first = (sample + 1).saturating_sub(length).max(from);
            let end = (sample + 1).min(self.windows.end);
            if first < end {
                outputs.invalidate(first + before..end + before, Status::INVALID);
                from = end;
            }
        }
    }
}
