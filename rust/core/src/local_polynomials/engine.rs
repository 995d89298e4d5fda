//! The walk over the samples of a record: projection, choice of order and derivatives of every window in one pass.
//!
//! A record's windows are numbered by their first sample. Span `g` holds the windows `g S … (g+1) S - 1`; its start lies in its
//! middle, at `g S + S/2`, or at the record's last window where that comes first. Blocks are one span, or several short ones, and are
//! worked on in runs, as many side by side as there are lanes. Which spans share a run does not matter, since lanes keep apart, so
//! any cutting of a record gives the same bits. Short records are side by side instead, one in each lane, which is one block of many
//! spans (`side_by_side.rs`). Where few windows are wanted, each is projected on its own (`apart.rs`), and short ones of a fixed order are
//! sums of their samples (`short_windows.rs`).

use std::fmt::Debug;
use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::Watch;
use crate::lanes::interleaved::Strips;
use crate::lanes::output::Outputs;
use crate::lanes::store::{Records, Write};
use crate::lanes::tile::{TILE, Tile};
use crate::local_polynomials::apart::{self, Apart, ApartScratch};
use crate::local_polynomials::basis::Basis;
use crate::local_polynomials::estimates::Estimates;
use crate::local_polynomials::evaluate::{Finish, Functional};
use crate::local_polynomials::kernels::{Direction, Fill, STEPS, Start, Sweep, replace, states};
use crate::local_polynomials::mirrored_kernels::MirroredScratch;
use crate::local_polynomials::short_windows::ShortWindows;
use crate::local_polynomials::side_by_side::SideBySide;
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
    /// Whether so many records of so many windows cost less side by side, where every `step`-th window is wanted.
    fn joins(&self, records: usize, windows: usize, step: usize) -> bool;
    /// All windows of records side by side, so many elements each.
    fn walk_side_by_side(
        &self,
        records: &SideBySide,
        elements: usize,
        estimates: &mut Estimates<'_>,
        scratch: &mut EngineScratch,
    );
}

/// The engine with the smallest kernels that hold a basis, which follow the residual or do not.
///
/// # Errors
/// If the watch cancels.
pub(crate) fn engine(
    basis: &Basis,
    finish: Finish,
    residual: bool,
    instructions: Instructions,
    watch: &mut Watch<'_>,
) -> Result<Box<dyn Walk>, Error> {
    Ok(match (residual, basis.degrees()) {
        (true, ..=8) => Box::new(Engine::<8, true>::new(basis, finish, instructions, watch)?),
        (true, _) => Box::new(Engine::<16, true>::new(basis, finish, instructions, watch)?),
        (false, ..=4) => Box::new(Engine::<4, false>::new(basis, finish, instructions, watch)?),
        (false, ..=6) => Box::new(Engine::<6, false>::new(basis, finish, instructions, watch)?),
        (false, ..=8) => Box::new(Engine::<8, false>::new(basis, finish, instructions, watch)?),
        (false, ..=12) => Box::new(Engine::<12, false>::new(basis, finish, instructions, watch)?),
        (false, ..=16) => Box::new(Engine::<16, false>::new(basis, finish, instructions, watch)?),
        (false, _) => Box::new(Engine::<20, false>::new(basis, finish, instructions, watch)?),
    })
}

/// Plan of the walk with kernels of `D` degrees, which follow the residual or do not.
#[derive(Debug)]
pub(crate) struct Engine<const D: usize, const RESIDUAL: bool> {
    projection: Projection<D>,
    finish: Finish,
    short: Option<ShortWindows>,
    instructions: Instructions,
}

/// Memory of one thread.
#[derive(Debug)]
pub(crate) struct EngineScratch {
    stretch: Stretch,
    strips: Strips,
    states: States,
    /// For windows that are projected one by one.
    apart: Option<ApartScratch>,
    short: MirroredScratch,
}

/// What the kernels of a run hand on to one another.
#[derive(Debug)]
struct States {
    /// The reference that is subtracted from each lane's samples.
    references: [f64; MOST_LANES],
    /// The start of each lane's block, and the windows that a sweep has come to.
    start: Aligned,
    state: Aligned,
    /// States between stepping and finishing.
    stepped: Aligned,
    tile: Tile,
}

impl<const D: usize, const RESIDUAL: bool> Engine<D, RESIDUAL> {
    fn new(basis: &Basis, finish: Finish, instructions: Instructions, watch: &mut Watch<'_>) -> Result<Self, Error> {
        let short = if RESIDUAL { None } else { ShortWindows::new(basis, &finish, instructions) };
        Ok(Self { projection: Projection::watched(basis, watch)?, finish, short, instructions })
    }

    /// Whether every `step`-th window is projected on its own.
    fn apart(&self, step: usize) -> bool {
        apart::serves(self.projection.length(), self.projection.span(), step)
    }

    /// Samples of a window before the one it is said to be around: its centre, or the last one before that.
    fn before_centre(&self) -> usize {
        (self.projection.length() - 1) / 2
    }

    /// Makes those of some windows NaN that hold an unusable sample.
    fn invalidate(&self, unusable: impl Iterator<Item = usize>, windows: &Range<usize>, outputs: &mut Outputs<'_>) {
        let (before, length) = (self.before_centre(), self.projection.length());
        let mut from = windows.start;
        for sample in unusable {
            let first = (sample + 1).saturating_sub(length).max(from);
            let end = (sample + 1).min(windows.end);
            if first < end {
                outputs.invalidate(first + before..end + before, Status::INVALID);
                from = end;
            }
        }
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
            states: States {
                references: [0.0; MOST_LANES],
                start: Aligned::zeros(states::<D>(1, lanes)),
                state: Aligned::zeros(states::<D>(1, lanes)),
                stepped: Aligned::zeros(states::<D>(STEPS, lanes)),
                tile: Tile::new(self.finish.fields(RESIDUAL), TILE, lanes),
            },
            apart: None,
            short: MirroredScratch::default(),
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
        let mut outputs = outputs::<RESIDUAL>(estimates);
        if self.apart(outputs.elements.step) {
            let Self { projection, finish, instructions, .. } = self;
            let apart =
                Apart::<D, RESIDUAL> { projection, finish, instructions: *instructions, step: outputs.elements.step };
            apart.walk(record, windows, &mut outputs, &mut scratch.apart);
            return;
        }
        if let Some(short) = self.short.as_ref().filter(|short| short.serve(&outputs, D)) {
            short.write(record, windows, &mut outputs, &mut scratch.short);
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
            let EngineScratch { stretch, strips, states, .. } = &mut *scratch;
            dispatch(self.instructions, Fill { samples: stretch.from(base, strips.samples()), strips });
            let (windows, records) = (window..end, None);
            let run = EngineRun { engine: self, stretch, strips, base, block, latest: usize::MAX, windows, records };
            run.work(states, &mut outputs);
            let unusable = stretch.unusable(base..base + read).iter().copied();
            self.invalidate(unusable, &run.windows, &mut outputs);
            window = end;
        }
    }

    fn joins(&self, records: usize, windows: usize, step: usize) -> bool {
        let block = self.block();
        // Rows of windows that are stepped through, one record after the other.
        let alone = windows.div_ceil(block * self.instructions.lanes()) * windows.min(block);
        records > 1 && !self.apart(step) && records * alone >= windows
    }

    fn walk_side_by_side(
        &self,
        records: &SideBySide,
        elements: usize,
        estimates: &mut Estimates<'_>,
        scratch: &mut EngineScratch,
    ) {
        let (count, samples) = (records.count(), records.samples());
        let windows = 0..samples - self.projection.length() + 1;
        let mut all = outputs::<RESIDUAL>(estimates);
        if let Some(short) = self.short.as_ref().filter(|short| short.serve(&all, D)) {
            for record in 0..count {
                let own = records.stretch().from((record * samples).cast_signed(), samples);
                let mut outputs = all.part(record * elements..(record + 1) * elements);
                short.write(&own, windows.clone(), &mut outputs, &mut scratch.short);
            }
        } else {
            let run = EngineRun {
                engine: self,
                stretch: records.stretch(),
                strips: records.strips(),
                base: 0,
                block: samples,
                latest: windows.end - 1,
                windows: windows.clone(),
                records: Some(Records { count, elements }),
            };
            run.work(&mut scratch.states, &mut all);
        }
        for record in 0..count {
            let mut unusable = records.unusable(record, 0..samples).peekable();
            if unusable.peek().is_some() {
                let mut own = all.part(record * elements..(record + 1) * elements);
                self.invalidate(unusable, &windows, &mut own);
            }
        }
    }
}

/// The outputs as kernels fill them.
fn outputs<'a, const RESIDUAL: bool>(estimates: &'a mut Estimates<'_>) -> Outputs<'a> {
    let Estimates { elements, derivatives, order, status, sigma } = estimates;
    let mut values: Vec<&mut [f64]> = derivatives.iter_mut().map(|values| &mut **values).collect();
    if RESIDUAL {
        values.push(sigma);
    }
    Outputs { elements: *elements, values, order, status }
}

/// Blocks side by side: lane `l` works on the windows that begin from `base + l B` on, of which `windows` are wanted. Or records: lane `l`
/// works on those `windows` of the `l`-th record.
struct EngineRun<'a, const D: usize, const RESIDUAL: bool> {
    engine: &'a Engine<D, RESIDUAL>,
    stretch: &'a Stretch,
    strips: &'a Strips,
    base: isize,
    /// Samples from the block of one lane to that of the next.
    block: usize,
    /// The last row that a start may lie in.
    latest: usize,
    windows: Range<usize>,
    records: Option<Records>,
}

impl<const D: usize, const RESIDUAL: bool> EngineRun<'_, D, RESIDUAL> {
    /// Finishes the windows of the run, span by span, from the start forwards, then backwards.
    ///
    /// The kernels are called one by one, not from one another: in one function they would spill each other's registers.
    fn work(&self, states: &mut States, outputs: &mut Outputs<'_>) {
        let Engine { projection, finish, instructions, .. } = self.engine;
        let (instructions, span, strips, wanted) = (*instructions, projection.span(), self.strips, self.rows());
        let States { references, start: at_start, state, stepped: states, tile } = states;
        // Short spans are written whole, as many together as a tile holds; long ones tile by tile.
        let whole = projection.block() <= TILE;
        let together = TILE - TILE % projection.block();
        let ahead = self.engine.before_centre().cast_signed();
        let finished = outputs.elements.rows_from(self.base + ahead, SHORTEST_BLOCK);
        for first in (wanted.start - wanted.start % span..wanted.end).step_by(span) {
            let start = (first + projection.backward()).min(self.latest);
            self.take_references(start, references);
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
            let end = wanted.end.min(first + span);
            if whole && (end == wanted.end || end % together == 0) {
                self.write(tile, wanted.start.max((end - 1) / together * together)..end, outputs);
            }
        }
    }

    /// Writes out some rows, which the tile holds.
    fn write(&self, tile: &Tile, rows: Range<usize>, outputs: &mut Outputs<'_>) {
        let Engine { finish, instructions, .. } = self.engine;
        let write = Write {
            tile,
            rows,
            base: self.base,
            block: if self.records.is_some() { 0 } else { self.block },
            records: self.records,
            windows: self.windows.clone(),
            ahead: self.engine.before_centre().cast_signed(),
            fixed_order: finish.fixed_order(RESIDUAL),
            outputs,
        };
        dispatch(*instructions, write);
    }

    /// Takes a reference for each lane: the sample at the centre of the start in a row, or the nearest to it that is a number.
    fn take_references(&self, start: usize, references: &mut [f64; MOST_LANES]) {
        let half = self.engine.projection.length() / 2;
        let centre = self.base + (start + half).cast_signed();
        for (lane, reference) in references[..self.engine.instructions.lanes()].iter_mut().enumerate() {
            *reference = self.stretch.nearest_usable(centre + (lane * self.block).cast_signed(), half);
        }
    }

    /// The rows of windows that any lane needs.
    fn rows(&self) -> Range<usize> {
        let block = self.block;
        let row = |window: usize| (window.cast_signed() - self.base).unsigned_abs();
        let (first, end) = (row(self.windows.start), row(self.windows.end));
        if end <= block { first..end } else { 0..block }
    }
}
