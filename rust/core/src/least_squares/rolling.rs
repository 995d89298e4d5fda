//! Least squares in every window of rows.
//!
//! A window of `w` rows that begins in one block of `w` rows and ends in the next is a suffix of the one and a prefix of the other. So
//! every window's factor is one merge of two factors that were built by appending rows only (see the module `triangle`): a row enters once
//! and leaves with its block, and nothing is subtracted.
//!
//! Windows are numbered by their first row, which may lie up to a window before the record; rows that do not exist are zero and say
//! nothing. Blocks lie on a grid of absolute row numbers and lanes keep apart, so any cutting of a record gives the same bits.

use std::num::NonZeroUsize;
use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::{self, GoOn, Piece, Watch};
use crate::lanes::interleaved::Strips;
use crate::lanes::output::{Elements, Outputs, split_off};
use crate::lanes::store::Write;
use crate::lanes::tile::Tile;
use crate::least_squares::givens_factor::{
    Dimensions, Few, MOST_REGRESSORS, Many, append, covariance, empty, invert, load, merge, solve, squared_norm, store,
};
use crate::record::samples::{Samples, all_usable, is_usable};
use crate::simd::aligned::Aligned;
use crate::simd::vectors::{Instructions, Kernel, Lanes, MOST_LANES, dispatch};
use crate::status::Status;

/// Suffix factors kept at a time. Longer windows keep one in so many and build the others again.
const SEGMENT: usize = 2048;

/// Rows of every lane between two questions whether to go on: with 16 regressors some 10 ms.
const ASK: usize = 256;

/// Rows in a piece of work, about.
const PIECE: usize = 1 << 14;

/// A condition number from which on parameters have lost half of their digits.
pub const HALF_OF_THE_DIGITS: f64 = 1e8;

/// The plan of least squares with some regressors and right-hand sides in windows of some rows.
#[derive(Clone, Debug)]
pub struct RollingLeastSquares {
    window: usize,
    regressors: usize,
    rhs_count: usize,
    covariances: Vec<(usize, usize)>,
    ill_conditioned: f64,
    instructions: Instructions,
}

/// Rows of equations: one record for every regressor, then one for every right-hand side.
pub struct Equations<'a> {
    /// All of the same length.
    pub columns: Vec<&'a dyn Samples>,
    /// The rows that are equations; those before and after do not count.
    pub rows: Range<usize>,
}

/// Where results are written. Windows belong to the row at their centre: row `i` to the rows `i - w/2 … i - w/2 + w - 1`.
///
/// An empty slice stands for what is not wanted.
#[derive(Debug, Default)]
pub struct Regressions<'a> {
    /// Which rows the elements of every slice belong to.
    pub elements: Elements,
    /// Parameters: one slice for every regressor and, within it, right-hand side.
    pub parameters: Vec<&'a mut [f64]>,
    /// Their standard errors.
    pub errors: Vec<&'a mut [f64]>,
    /// Covariances of the pairs asked for, one slice for every pair and, within it, right-hand side.
    pub covariances: Vec<&'a mut [f64]>,
    /// Residual sum of squares of every right-hand side.
    pub residuals: Vec<&'a mut [f64]>,
    /// Standard deviation of the residuals of every right-hand side.
    pub deviations: Vec<&'a mut [f64]>,
    /// Condition number of the regressors, each scaled to the same norm.
    pub condition: &'a mut [f64],
    /// Bits of [`Status`].
    pub status: &'a mut [u16],
}

impl Regressions<'_> {
    /// Cuts off what belongs to the rows before `row`.
    pub(crate) fn split_off_before(&mut self, row: usize) -> Self {
        let (elements, count) = (self.elements, self.elements.of(0..row).len());
        self.elements = elements.from(count);
        Regressions {
            elements,
            parameters: self.parameters.iter_mut().map(|values| split_off(values, count)).collect(),
            errors: self.errors.iter_mut().map(|values| split_off(values, count)).collect(),
            covariances: self.covariances.iter_mut().map(|values| split_off(values, count)).collect(),
            residuals: self.residuals.iter_mut().map(|values| split_off(values, count)).collect(),
            deviations: self.deviations.iter_mut().map(|values| split_off(values, count)).collect(),
            condition: split_off(&mut self.condition, count),
            status: split_off(&mut self.status, count),
        }
    }
}

/// Memory of one thread.
#[derive(Debug)]
pub struct RollingScratch {
    /// One column of a run's rows.
    column: Vec<f64>,
    /// Rows of the run that hold a value that cannot be used, in order.
    unusable: Vec<usize>,
    strips: Vec<Strips>,
    suffixes: Aligned,
    checkpoints: Aligned,
    tile: Tile,
}

impl RollingLeastSquares {
    /// Prepares windows of `window` rows of `regressors` regressors and `rhs_count` right-hand sides. Of every pair of regressors in
    /// `covariances` the covariance is wanted too. Condition numbers above `ill_conditioned` are flagged.
    ///
    /// # Errors
    /// If there are no regressors or more than 16, or no more rows than regressors.
    pub fn new(
        window: usize,
        regressors: usize,
        rhs_count: usize,
        covariances: Vec<(usize, usize)>,
        ill_conditioned: f64,
        instructions: Instructions,
    ) -> Result<Self, Error> {
        if !(1..=MOST_REGRESSORS).contains(&regressors) {
            return Err(Error::Regressors { regressors, most: MOST_REGRESSORS });
        }
        if window <= regressors {
            return Err(Error::RowsTooFew { window, regressors });
        }
        Ok(Self { window, regressors, rhs_count, covariances, ill_conditioned, instructions })
    }

    /// Windows that are worked on side by side: a record may be cut anywhere, but multiples of this waste nothing.
    #[must_use]
    pub fn stride(&self) -> usize {
        self.window * self.instructions.lanes()
    }

    /// Rows of a window.
    pub(crate) fn window(&self) -> usize {
        self.window
    }

    /// Memory for one thread.
    #[must_use]
    pub fn scratch(&self) -> RollingScratch {
        let lanes = self.instructions.lanes();
        let columns = self.regressors + self.rhs_count;
        let strips = Strips::new(self.window, self.window, lanes);
        let factor = Many { regressors: self.regressors, rhs_count: self.rhs_count }.size() * lanes;
        RollingScratch {
            column: vec![0.0; strips.samples()],
            unusable: Vec::new(),
            strips: vec![strips; columns],
            suffixes: Aligned::zeros(self.window.min(SEGMENT) * factor),
            checkpoints: Aligned::zeros((self.window.div_ceil(SEGMENT) - 1) * factor),
            tile: Tile::new(Slots::of(self).fields(), lanes.next_multiple_of(8), lanes),
        }
    }

    /// Solves the windows around all rows, in parallel. Every element of the outputs must belong to a row.
    ///
    /// The numbers do not depend on the number of workers.
    ///
    /// # Errors
    /// If the watch cancels.
    pub fn run(
        &self,
        equations: &Equations<'_>,
        mut regressions: Regressions<'_>,
        workers: NonZeroUsize,
        watch: &mut Watch<'_>,
    ) -> Result<(), Error> {
        let rows = equations.columns.first().map_or(0, |column| column.len());
        let mut pieces = Vec::new();
        for piece in self.pieces(rows, PIECE) {
            let part = regressions.split_off_before(piece.end);
            pieces.push(Piece { size: piece.len(), content: (piece, part) });
        }
        let work =
            |(rows, mut part): (Range<usize>, Regressions<'_>), scratch: &mut RollingScratch, go_on: &GoOn<'_>| {
                self.solve_while(equations, rows, &mut part, scratch, go_on);
            };
        pool::run_long(pieces, workers, || self.scratch(), work, watch)
    }

    /// Solves the windows around some rows.
    pub fn solve(
        &self,
        equations: &Equations<'_>,
        rows: Range<usize>,
        regressions: &mut Regressions<'_>,
        scratch: &mut RollingScratch,
    ) {
        self.solve_while(equations, rows, regressions, scratch, &|| true);
    }

    /// The same, given up where `go_on` says no: it is asked every few hundred rows of every lane.
    pub(crate) fn solve_while(
        &self,
        equations: &Equations<'_>,
        rows: Range<usize>,
        regressions: &mut Regressions<'_>,
        scratch: &mut RollingScratch,
        go_on: &GoOn<'_>,
    ) {
        let mut outputs = Slots::of(self).outputs(regressions);
        let mut window = self.first_row(rows.start);
        let end = self.first_row(rows.end);
        while window < end && go_on() {
            let first = window - window % self.window;
            let next = end.min(first + self.stride());
            let run = RollingRun { plan: self, base: first, windows: window..next, rows: equations.rows.clone() };
            let outputs = &mut outputs;
            match (self.regressors, self.rhs_count) {
                (1, 1) => {
                    dispatch(
                        self.instructions,
                        RollingKernel { run, shape: Few::<1>, equations, scratch, outputs, go_on },
                    );
                }
                (2, 1) => {
                    dispatch(
                        self.instructions,
                        RollingKernel { run, shape: Few::<2>, equations, scratch, outputs, go_on },
                    );
                }
                (3, 1) => {
                    dispatch(
                        self.instructions,
                        RollingKernel { run, shape: Few::<3>, equations, scratch, outputs, go_on },
                    );
                }
                (4, 1) => {
                    dispatch(
                        self.instructions,
                        RollingKernel { run, shape: Few::<4>, equations, scratch, outputs, go_on },
                    );
                }
                (regressors, rhs_count) => {
                    let shape = Many { regressors, rhs_count };
                    dispatch(self.instructions, RollingKernel { run, shape, equations, scratch, outputs, go_on });
                }
            }
            window = next;
        }
    }

    /// Number of columns of a row, the right-hand sides included.
    pub(crate) fn columns(&self) -> usize {
        self.regressors + self.rhs_count
    }

    /// Cuts the rows of a record into pieces of about so many, so that no run is cut.
    pub(crate) fn pieces(&self, rows: usize, about: usize) -> Vec<Range<usize>> {
        let piece = about.next_multiple_of(self.stride());
        let mut pieces = Vec::new();
        let mut first = 0;
        while first < rows {
            let end = ((self.first_row(first) / piece + 1) * piece - self.first_row(0)).min(rows);
            pieces.push(first..end);
            first = end;
        }
        pieces
    }

    /// The rows that lie in the windows around some rows.
    pub(crate) fn rows_needed(&self, around: Range<usize>, rows: usize) -> Range<usize> {
        around.start.saturating_sub(self.window / 2)..(around.end + self.window).min(rows)
    }

    /// First row of the window around a row, counted from one window before the record.
    fn first_row(&self, row: usize) -> usize {
        row + self.window - self.window / 2
    }
}

/// Where the fields of a window are in the tile.
#[derive(Clone, Copy, Debug)]
struct Slots {
    errors: usize,
    covariances: usize,
    residuals: usize,
    deviations: usize,
    condition: usize,
}

impl Slots {
    fn of(plan: &RollingLeastSquares) -> Self {
        let (p, q, pairs) = (plan.regressors, plan.rhs_count, plan.covariances.len());
        let errors = p * q;
        let covariances = errors + p * q;
        let residuals = covariances + pairs * q;
        Self { errors, covariances, residuals, deviations: residuals + q, condition: residuals + 2 * q }
    }

    /// All fields: the last holds flags.
    fn fields(self) -> usize {
        self.condition + 2
    }

    /// The outputs in the order of the fields.
    fn outputs<'a>(self, regressions: &'a mut Regressions<'_>) -> Outputs<'a> {
        let Regressions { elements, parameters, errors, covariances, residuals, deviations, condition, status } =
            regressions;
        let mut values: Vec<&'a mut [f64]> = Vec::with_capacity(self.fields());
        let groups = [
            (parameters, self.errors),
            (errors, self.covariances),
            (covariances, self.residuals),
            (residuals, self.deviations),
            (deviations, self.condition),
        ];
        for (group, end) in groups {
            values.extend(group.iter_mut().map(|values| &mut **values));
            values.resize_with(end, Default::default);
        }
        values.push(condition);
        Outputs { elements: *elements, values, order: Default::default(), status }
    }
}

/// Blocks of windows side by side: lane `l` works on those that begin at `base + l w`, of which `windows` are wanted.
struct RollingRun<'a> {
    plan: &'a RollingLeastSquares,
    base: usize,
    windows: Range<usize>,
    /// Rows that are equations.
    rows: Range<usize>,
}

impl RollingRun<'_> {
    /// Lays out the rows of the run. Those that are no equations, or hold what cannot be used, become zero.
    #[inline(always)]
    fn load<S: Lanes>(&self, simd: S, equations: &Equations<'_>, scratch: &mut RollingScratch) {
        let RollingScratch { column, unusable, strips, .. } = scratch;
        let before = self.plan.window;
        let end = self.base + column.len();
        let present = (self.rows.start + before).clamp(self.base, end)..(self.rows.end + before).clamp(self.base, end);
        let places = present.start - self.base..present.end - self.base;
        unusable.clear();
        for (strips, record) in strips.iter_mut().zip(&equations.columns) {
            column[..places.start].fill(0.0);
            column[places.end..].fill(0.0);
            record.read(present.start.saturating_sub(before), &mut column[places.clone()]);
            if !all_usable(column) {
                unusable.extend((0..column.len()).filter(|&row| !is_usable(column[row])));
            }
            strips.fill(simd, column);
        }
        unusable.sort_unstable();
        unusable.dedup();
        for strips in strips {
            for &row in unusable.iter() {
                strips.clear(row);
            }
        }
    }

    /// How many equations a window holds.
    fn count(&self, window: usize) -> usize {
        let first = window.max(self.rows.start + self.plan.window);
        let end = (window + self.plan.window).min(self.rows.end + self.plan.window);
        end.saturating_sub(first)
    }

    /// The window that begins in row 0 of a lane.
    fn first(&self, lane: usize) -> usize {
        self.base + lane * self.plan.window
    }

    /// Whether every row of every window is an equation.
    fn is_full(&self, lanes: usize) -> bool {
        self.count(self.base) == self.plan.window && self.count(self.first(lanes) - 1) == self.plan.window
    }

    /// Says of the windows with missing rows that they lie at an edge, and takes back those that are less than half full or hold what
    /// cannot be used.
    fn mark(&self, unusable: &[usize], full: bool, outputs: &mut Outputs<'_>) {
        if full && unusable.is_empty() {
            return;
        }
        let plan = self.plan;
        for window in self.windows.clone() {
            let row = window + plan.window / 2 - plan.window;
            let count = self.count(window);
            let edge = if count < plan.window { Status::EDGE } else { Status::GOOD };
            let rows = window - self.base..window - self.base + plan.window;
            let next = unusable.partition_point(|&bad| bad < rows.start);
            if 2 * count < plan.window || unusable.get(next).is_some_and(|bad| *bad < rows.end) {
                outputs.invalidate(row..row + 1, edge | Status::INVALID);
            } else if count <= plan.regressors {
                outputs.invalidate(row..row + 1, edge | Status::INVALID | Status::RANK_DEFICIENT);
                let elements = outputs.elements.of(row..row + 1);
                if let Some(condition) = outputs.values.last_mut().filter(|condition| !condition.is_empty()) {
                    condition[elements].fill(f64::INFINITY);
                }
            } else if edge != Status::GOOD {
                let elements = outputs.elements.of(row..row + 1);
                if !outputs.status.is_empty() {
                    outputs.status[elements].iter_mut().for_each(|status| *status |= edge.bits());
                }
            }
        }
    }
}

/// The kernel of a run.
struct RollingKernel<'a, 'b, 'c, H: Dimensions> {
    run: RollingRun<'a>,
    shape: H,
    equations: &'a Equations<'a>,
    scratch: &'b mut RollingScratch,
    outputs: &'b mut Outputs<'c>,
    go_on: &'b GoOn<'b>,
}

impl<H: Dimensions> Kernel for RollingKernel<'_, '_, '_, H> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(mut self, simd: S) {
        self.run.load(simd, self.equations, self.scratch);
        let window = self.run.plan.window;
        let size = self.shape.size() * S::F64_LANES;
        let segments = window.div_ceil(SEGMENT);
        let mut row = self.shape.factor(simd.splat_f64s(0.0));
        let mut suffix = empty(simd, self.shape);
        for segment in (1..segments).rev() {
            let rows = segment * SEGMENT..window.min((segment + 1) * SEGMENT);
            for offset in rows.rev() {
                if offset % ASK == 0 && !(self.go_on)() {
                    return;
                }
                self.append(simd, &mut suffix, offset, 0, &mut row);
            }
            store(simd, self.shape, &mut self.scratch.checkpoints[(segment - 1) * size..], &suffix);
        }
        let full = self.run.is_full(S::F64_LANES);
        let places = self.scratch.tile.places();
        let mut prefix = empty(simd, self.shape);
        for segment in 0..segments {
            let rows = segment * SEGMENT..window.min((segment + 1) * SEGMENT);
            suffix = empty(simd, self.shape);
            if segment + 1 < segments {
                load(simd, self.shape, &self.scratch.checkpoints[segment * size..], &mut suffix);
            }
            for offset in rows.clone().rev() {
                if offset % ASK == 0 && !(self.go_on)() {
                    return;
                }
                self.append(simd, &mut suffix, offset, 0, &mut row);
                store(simd, self.shape, &mut self.scratch.suffixes[(offset - rows.start) * size..], &suffix);
            }
            // Merging waits for the step before, solving for nothing: apart, each keeps the processor busy.
            let mut first = rows.start;
            while first < rows.end {
                if first % ASK == 0 && !(self.go_on)() {
                    return;
                }
                let some = first..rows.end.min(first - first % places + places);
                for offset in some.clone() {
                    let place = (offset - rows.start) * size;
                    load(simd, self.shape, &self.scratch.suffixes[place..], &mut suffix);
                    merge(simd, self.shape, &mut suffix, &prefix, &mut row);
                    store(simd, self.shape, &mut self.scratch.suffixes[place..], &suffix);
                    self.append(simd, &mut prefix, offset, 1, &mut row);
                }
                for offset in some.clone() {
                    load(simd, self.shape, &self.scratch.suffixes[(offset - rows.start) * size..], &mut suffix);
                    self.finish(simd, &suffix, offset, full, &mut row);
                }
                // The last windows are written together with some that were written before, to fill the vectors.
                if some.end % places == 0 || some.end == window {
                    self.write(simd, some.end.saturating_sub(places)..some.end);
                }
                first = some.end;
            }
        }
        self.run.mark(&self.scratch.unusable, full, self.outputs);
    }
}

impl<H: Dimensions> RollingKernel<'_, '_, '_, H> {
    /// Appends the row at an offset of each lane's block, or of the block after it.
    #[inline(always)]
    fn append<S: Lanes>(
        &self,
        simd: S,
        factor: &mut H::Factor<S::f64s>,
        offset: usize,
        block: usize,
        row: &mut H::Factor<S::f64s>,
    ) {
        for column in 0..self.shape.regressors() + self.shape.rhs_count() {
            row[column] = self.scratch.strips[column].in_block(simd, offset, block);
        }
        append(simd, self.shape, factor, row, 0, simd.splat_f64s(1.0));
    }

    /// Solves each lane's window.
    #[inline(always)]
    fn finish<S: Lanes>(
        &mut self,
        simd: S,
        factor: &H::Factor<S::f64s>,
        offset: usize,
        full: bool,
        values: &mut H::Factor<S::f64s>,
    ) {
        let (shape, plan) = (self.shape, self.run.plan);
        let (p, q) = (shape.regressors(), shape.rhs_count());
        let slots = Slots::of(plan);
        let freedom = self.freedom(simd, offset, full);
        let tile = &mut self.scratch.tile;
        // The squared condition number comes first: where it has no digits nothing has.
        invert(simd, shape, factor, values);
        let mut squares = simd.splat_f64s(0.0);
        for i in 0..p {
            let variance = covariance(simd, shape, values, i, i);
            squares = simd.mul_add_f64s(squared_norm(simd, shape, factor, i), variance, squares);
        }
        let condition = simd.sqrt_f64s(simd.mul_f64s(squares, simd.splat_f64s(p as f64)));
        let greatest = simd.splat_f64s(1.0 / (f64::EPSILON * plan.window as f64));
        let determined = simd.less_than_f64s(condition, greatest);
        let ill = simd.greater_than_f64s(condition, simd.splat_f64s(plan.ill_conditioned));
        let flags = simd.select_f64s(ill, code(simd, Status::ILL_CONDITIONED), simd.splat_f64s(0.0));
        let deficient = code(simd, Status::INVALID | Status::RANK_DEFICIENT);
        let condition = simd.select_f64s(determined, condition, simd.splat_f64s(f64::INFINITY));
        tile.put(simd, slots.condition, offset, condition);
        tile.put(simd, slots.condition + 1, offset, simd.select_f64s(determined, flags, deficient));

        let nothing = simd.select_f64s(determined, simd.splat_f64s(0.0), simd.splat_f64s(f64::NAN));
        for rhs in 0..q {
            let residual = simd.add_f64s(factor[shape.row(p) + rhs], nothing);
            let variance = simd.mul_f64s(residual, freedom);
            tile.put(simd, slots.residuals + rhs, offset, residual);
            for (pair, &(i, j)) in plan.covariances.iter().enumerate() {
                let one = covariance(simd, shape, values, i.min(j), i.max(j));
                tile.put(simd, slots.covariances + pair * q + rhs, offset, simd.mul_f64s(one, variance));
            }
            let deviation = simd.sqrt_f64s(variance);
            tile.put(simd, slots.deviations + rhs, offset, deviation);
            for i in 0..p {
                let error = simd.mul_f64s(simd.sqrt_f64s(covariance(simd, shape, values, i, i)), deviation);
                tile.put(simd, slots.errors + i * q + rhs, offset, error);
            }
        }
        for rhs in 0..q {
            solve(simd, shape, factor, rhs, values);
            for i in 0..p {
                tile.put(simd, i * q + rhs, offset, simd.add_f64s(values[i], nothing));
            }
        }
    }

    /// One over the degrees of freedom of each lane's window.
    #[inline(always)]
    fn freedom<S: Lanes>(&self, simd: S, offset: usize, full: bool) -> S::f64s {
        let (plan, p) = (self.run.plan, self.shape.regressors());
        if full {
            return simd.splat_f64s(1.0 / (plan.window - p) as f64);
        }
        let mut freedom = [0.0; MOST_LANES];
        for (lane, freedom) in freedom[..S::F64_LANES].iter_mut().enumerate() {
            *freedom = 1.0 / self.run.count(self.run.first(lane) + offset).saturating_sub(p) as f64;
        }
        simd.load(&freedom, 0)
    }

    /// Writes out the windows at some offsets of each lane's block.
    #[inline(always)]
    fn write<S: Lanes>(&mut self, simd: S, rows: Range<usize>) {
        let plan = self.run.plan;
        let write = Write {
            tile: &self.scratch.tile,
            rows,
            base: self.run.base.cast_signed(),
            block: plan.window,
            windows: self.run.windows.clone(),
            ahead: (plan.window / 2).cast_signed() - plan.window.cast_signed(),
            fixed_order: None,
            outputs: &mut *self.outputs,
        };
        write.run(simd);
    }
}

/// Flags as the tile holds them.
#[inline(always)]
fn code<S: Lanes>(simd: S, status: Status) -> S::f64s {
    simd.splat_f64s(256.0 * f64::from(status.bits()))
}
