//! The walk where few windows are wanted: each is projected on its own, as many side by side as there are lanes.
//!
//! A span costs one start and a step for every window, wanted or not. From a certain distance on a start for every window that is
//! wanted costs less. Such windows depend on nothing but their own samples.

use std::ops::Range;

use crate::lanes::interleaved::Strips;
use crate::lanes::output::{FinishedRows, Outputs};
use crate::lanes::store::write_row;
use crate::lanes::tile::Tile;
use crate::local_polynomials::evaluate::Finish;
use crate::local_polynomials::kernels::{Direction, Fill, Start, Sweep, states};
use crate::local_polynomials::sliding_projection::{Projection, SHORTEST_BLOCK};
use crate::record::buffer::Stretch;
use crate::record::samples::Samples;
use crate::simd::aligned::Aligned;
use crate::simd::instructions::Instructions;
use crate::simd::vectors::{MOST_LANES, dispatch};
use crate::status::Status;

/// Samples copied out of a record at a time, about.
const STRETCH: usize = 1 << 13;

/// What stepping to a window and finishing it costs: as much as a start does for so many samples of its window. Measured: 14.5 ns against
/// at most 200 ns for 201 samples.
const STEP: usize = 10;

/// Plan of windows that are projected one by one.
pub(crate) struct Apart<'a, const D: usize, const RESIDUAL: bool> {
    pub(crate) projection: &'a Projection<D>,
    pub(crate) finish: &'a Finish,
    pub(crate) instructions: Instructions,
    /// Samples from one window to the next.
    pub(crate) step: usize,
}

/// Memory of one thread, for one step.
#[derive(Debug)]
pub(crate) struct ApartScratch {
    step: usize,
    stretch: Stretch,
    strips: Strips,
    /// Windows that share no sample, one after the other.
    gathered: Vec<f64>,
    references: [f64; MOST_LANES],
    state: Aligned,
    states: Aligned,
    tile: Tile,
    /// Whether each lane's window holds an unusable sample.
    unusable: [bool; MOST_LANES],
}

/// Whether every `step`-th window of so many samples costs less by itself than all windows do in spans.
pub(crate) fn serves(length: usize, span: usize, step: usize) -> bool {
    // A span costs a start, and each of its windows a step.
    step >= SHORTEST_BLOCK && length * span <= step.saturating_mul(length + STEP * span)
}

impl<const D: usize, const RESIDUAL: bool> Apart<'_, D, RESIDUAL> {
    fn scratch(&self) -> ApartScratch {
        let (length, lanes) = (self.projection.length(), self.instructions.lanes());
        ApartScratch {
            step: self.step,
            stretch: Stretch::default(),
            strips: Strips::new(self.step.min(length), length, lanes),
            gathered: Vec::new(),
            references: [0.0; MOST_LANES],
            state: Aligned::zeros(states::<D>(1, lanes)),
            states: Aligned::zeros(states::<D>(1, lanes)),
            tile: Tile::new(self.finish.fields(RESIDUAL), 1, lanes),
            unusable: [false; MOST_LANES],
        }
    }

    /// Writes what is wanted of some windows.
    pub(crate) fn walk(
        &self,
        record: &dyn Samples,
        windows: Range<usize>,
        outputs: &mut Outputs<'_>,
        scratch: &mut Option<ApartScratch>,
    ) {
        let (projection, finish, instructions) = (self.projection, self.finish, self.instructions);
        let (before, lanes) = ((projection.length() - 1) / 2, instructions.lanes());
        if scratch.as_ref().is_none_or(|scratch| scratch.step != self.step) {
            *scratch = Some(self.scratch());
        }
        let Some(scratch) = scratch else { return };
        scratch.stretch.load(record, 0..0);
        let elements = outputs.elements.of(windows.start + before..windows.end + before);
        for first in elements.clone().step_by(lanes) {
            let some = first..elements.end.min(first + lanes);
            let window = outputs.elements.sample(first) - before;
            if self.step <= projection.length() {
                self.lay_out(record, window, windows.end, scratch);
            } else {
                self.gather(record, window, some.len(), scratch);
            }
            let ApartScratch { strips, references, state, states, tile, .. } = &mut *scratch;
            dispatch(instructions, Start::<D, RESIDUAL> { projection, strips, references, row: 0, state });
            let sweep = Sweep::<D, RESIDUAL> {
                projection,
                finish,
                strips,
                references,
                state,
                states,
                tile,
                direction: Direction::Forward,
                start: 0,
                windows: 0..1,
                ready: true,
                finished: FinishedRows::default(),
            };
            sweep.go(instructions);
            write_row(tile, lanes, some.clone(), finish.fixed_order(RESIDUAL), outputs);
            for (element, _) in some.zip(scratch.unusable).filter(|(_, unusable)| *unusable) {
                let sample = outputs.elements.sample(element);
                outputs.invalidate(sample..sample + 1, Status::INVALID);
            }
        }
    }

    /// Lays out windows that overlap, from one on, each sample once.
    fn lay_out(&self, record: &dyn Samples, window: usize, end: usize, scratch: &mut ApartScratch) {
        let (length, lanes) = (self.projection.length(), self.instructions.lanes());
        let ApartScratch { stretch, strips, references, unusable, .. } = scratch;
        let (begin, count, advance) = (window.cast_signed(), strips.samples(), lanes * self.step);
        if !stretch.holds(&(begin..begin + count.cast_signed())) {
            let runs = (STRETCH / advance).clamp(1, (end - window) / advance + 1);
            stretch.load(record, begin..begin + (count + (runs - 1) * advance).cast_signed());
        }
        dispatch(self.instructions, Fill { samples: stretch.from(begin, count), strips });
        for (lane, (reference, unusable)) in references[..lanes].iter_mut().zip(unusable).enumerate() {
            let first = begin + (lane * self.step).cast_signed();
            *reference = stretch.nearest_usable(first + (length / 2).cast_signed(), length / 2);
            *unusable = !stretch.unusable(first..first + length.cast_signed()).is_empty();
        }
    }

    /// Lays out windows that share no sample, from one on, without what lies between them.
    fn gather(&self, record: &dyn Samples, window: usize, count: usize, scratch: &mut ApartScratch) {
        let length = self.projection.length();
        let ApartScratch { stretch, strips, gathered, references, unusable, .. } = scratch;
        gathered.resize(strips.samples(), 0.0);
        for (lane, samples) in gathered.chunks_exact_mut(length).take(count).enumerate() {
            let first = (window + lane * self.step).cast_signed();
            stretch.load(record, first..first + length.cast_signed());
            samples.copy_from_slice(stretch.from(first, length));
            references[lane] = stretch.nearest_usable(first + (length / 2).cast_signed(), length / 2);
            unusable[lane] = !stretch.unusable(first..first + length.cast_signed()).is_empty();
        }
        dispatch(self.instructions, Fill { samples: gathered, strips });
    }
}
