//! Jumps of inertia and damping, where these are constant between jumps.
//!
//! Blocks of the record tell between which of them the constants jump. Where exactly is found as for windowed coefficients: rows that reach
//! over the jump are predicted from lines of the windowed coefficients and constants on both sides. What these change by acts on velocity and acceleration of
//! local polynomials; their mean acts on the columns of the rows, so that the noise of those derivatives hardly matters.

use std::ops::Range;

use crate::error::Error;
use crate::identify::weak::decided::Decided;
use crate::identify::weak::jumps::signals;
use crate::identify::weak::session::Session;
use crate::inference::jumps::constants::Told;
use crate::inference::jumps::free_lines::{OfLines, mean_left};
use crate::inference::jumps::jump::{Jump, JumpSearch};
use crate::lanes::output::Elements;
use crate::local_polynomials::criterion::Criterion;
use crate::local_polynomials::estimates::Estimates;
use crate::local_polynomials::options::{Order, PolynomialOptions, Selection};
use crate::local_polynomials::plan::LocalPolynomials;
use crate::record::derived::Whole;
use crate::record::samples::Samples;
use crate::regression::block_fit::Parts;
use crate::regression::model::Model;
use crate::weak_form::test_function_choice::spectrum_length;
use crate::weak_form::weak_rows::WeakRows;

/// Typical cycles of the motion, and test functions, that a block holds at least.
const CYCLES: f64 = 3.0;
const TEST_FUNCTIONS: usize = 2;
const FEWEST_BLOCKS: usize = 8;
/// Into so many parts the blocks beside a jump are cut to tell about where it is, and each part once more until a test function reaches over it.
const PARTS: usize = 16;
/// Half-widths of the test function around that place within which the jump is looked for: at first, and at most where it may as well be at an end of them.
const NEAR: usize = 2;
const FAR: usize = 8;
/// The shortest windows of velocity and acceleration.
const SHORTEST_WINDOW: usize = 9;

/// Constants on both sides of a place, and blocks beside it.
struct BeforeAndAfter {
    constants: [Vec<f64>; 2],
    /// Rows of a block.
    length: usize,
    /// The row from which on blocks are after it.
    row: usize,
}

impl Session<'_, '_, '_> {
    /// Finds where inertia and damping jump, if they are constant between jumps.
    pub(crate) fn jumps_of_constants(
        &mut self,
        weak: &WeakRows,
        decided: &Decided,
        model: &Model,
    ) -> Result<Vec<Jump>, Error> {
        let moves = decided.slow.iter().any(|&one| one < 2) && self.options.averaging;
        if !moves || signals(&self.record, model).is_none() {
            return Ok(Vec::new());
        }
        let samples = self.record.angle.len();
        let cycle = self.evidence(spectrum_length(samples, 200))?.period();
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most the record's length")]
        let length = ((CYCLES * cycle) as usize / weak.stride).max(2 * TEST_FUNCTIONS * weak.reach());
        let rows = weak.rows.len();
        let count = rows / length.max(1);
        if count < FEWEST_BLOCKS {
            return Ok(Vec::new());
        }
        let blocks: Vec<Range<usize>> =
            (0..count).map(|block| rows * block / count..rows * (block + 1) / count).collect();
        let parts = Parts::new(&weak.rows, model, self.noise[0], &blocks);
        let constants = model.constant.len();
        let rhs = parts.scale[constants];
        let variance = decided.expected.variance * decided.expected.variance_inflation / (rhs * rhs);
        let told = Told { parts: &parts.products, constants, variance };
        let places = told.jumps();
        if places.is_empty() {
            return Ok(Vec::new());
        }
        let ends: Vec<usize> = [0].into_iter().chain(places.iter().copied()).chain([count]).collect();
        let values = |stretch: &[usize]| -> Option<Vec<f64>> {
            let values = told.values(stretch[0]..stretch[1])?;
            Some(values.iter().zip(&parts.scale).map(|(value, scale)| value * rhs / scale).collect())
        };
        let Some(values) = ends.windows(2).map(values).collect::<Option<Vec<_>>>() else { return Ok(Vec::new()) };
        let derivatives = self.derivatives(weak.function.half_width())?;
        let placed = places.iter().zip(values.windows(2)).map(|(&block, values)| {
            let both =
                BeforeAndAfter { constants: [values[0].clone(), values[1].clone()], length, row: blocks[block].start };
            self.placed(weak, decided, model, &derivatives, &both)
        });
        Ok(placed.collect::<Option<Vec<Jump>>>().unwrap_or_default())
    }

    /// The place of a jump between two blocks, or `None` if there is too little beside it.
    fn placed(
        &self,
        weak: &WeakRows,
        decided: &Decided,
        model: &Model,
        derivatives: &[Vec<f64>; 2],
        both: &BeforeAndAfter,
    ) -> Option<Jump> {
        let [velocity, acceleration] = derivatives.each_ref().map(Vec::as_slice);
        let mut rhs = weak.rows.rhs.clone();
        let mut moving: Vec<Box<dyn Samples + '_>> = Vec::new();
        // Half of what each changes by.
        let mut changes = Vec::new();
        for (place, &unknown) in model.constant.iter().enumerate() {
            let [before, after] = both.constants.each_ref().map(|values| values[place]);
            let mean = f64::midpoint(before, after);
            let column = &weak.rows.regressors[unknown].value;
            rhs.iter_mut().zip(column).for_each(|(rhs, column)| *rhs -= mean * column);
            moving.push(match unknown {
                0 => Box::new(acceleration),
                1 => Box::new(velocity),
                2 => Box::new(Whole(self.record.angle)),
                _ => continue,
            });
            changes.push((after - before) / 2.0);
        }
        moving.extend(signals(&self.record, model)?);
        let all: Vec<&dyn Samples> = moving.iter().map(|signal| &**signal).collect();
        let problem = model.problem(&weak.rows, &weak.rows.rhs, self.noise[0], None);
        let search = JumpSearch {
            problem: &problem,
            whole: &problem,
            rhs: &rhs,
            signals: &all,
            function: &weak.kernels.values[2],
            first: weak.first,
            stride: weak.stride,
            group: 1,
            expected: decided.expected,
            inflation: 1.0,
            scales: &[],
            lengths: &[],
            instructions: self.options.instructions,
        };
        let half = weak.function.half_width();
        let (rows, last) = (weak.rows.len(), weak.first + (weak.rows.len() - 1) * weak.stride);
        let row_of = |sample: usize| (sample.saturating_sub(weak.first) / weak.stride).min(rows);
        // As long as the windows that predict best.
        let span = decided.fit.as_ref().map_or(both.length, |fit| fit.span).min(2 * both.length);
        let lines = span.max(TEST_FUNCTIONS * weak.reach()).max(OfLines::enough_rows(model));
        let beside = BesideJump { weak, model, both, lines };
        let changes = [changes.iter().map(|change| -change).collect(), changes];
        let place = |sample: usize, within: usize| {
            let candidates = sample.saturating_sub(within).max(weak.first)..(sample + within + 1).min(last);
            let over = row_of(candidates.start.saturating_sub(half))..row_of(candidates.end + half);
            let far = beside.lines_around(&over)?;
            let (left, count) = search.left_beside_lines(&changes, &far, (&over, &candidates))?;
            let best = (0..left.len()).min_by(|&a, &b| left[a].total_cmp(&left[b]))?;
            Some(Jump { of_constants: true, ..search.jump(&left, best, candidates.start, count) })
        };
        let mut within = NEAR * half;
        let mut jump = place(weak.first + beside.about()? * weak.stride, within)?;
        while !jump.is_between_ends() && within < FAR * half {
            within *= 2;
            // A gap, or an end of the record, may leave too little beside more samples.
            let Some(wider) = place(jump.sample, within) else { break };
            jump = wider;
        }
        Some(jump)
    }

    /// Velocity and acceleration at every sample, from polynomials in windows as long as half a test function.
    fn derivatives(&mut self, half_width: usize) -> Result<[Vec<f64>; 2], Error> {
        let (angle, samples) = (self.record.angle, self.record.angle.len());
        let plan = LocalPolynomials::new(PolynomialOptions {
            window_length: (half_width | 1).max(SHORTEST_WINDOW),
            order: Order::Chosen { criterion: Criterion::Aicc, highest: 15 },
            derivatives: vec![1, 2],
            delta: self.options.delta,
            noise: true,
            selection: Selection::Window,
            quantisation: 0.0,
            instructions: self.options.instructions,
        })?;
        let mut both = [vec![0.0; samples], vec![0.0; samples]];
        let [velocity, acceleration] = &mut both;
        let mut columns = (vec![0_u8; samples], vec![0_u16; samples], vec![0.0; samples]);
        let estimates = Estimates {
            elements: Elements { first: 0, step: 1 },
            derivatives: vec![velocity, acceleration],
            order: &mut columns.0,
            status: &mut columns.1,
            sigma: &mut columns.2,
        };
        let workers = self.stages.workers;
        self.stages.stage(|watch| plan.run(&[angle], estimates, true, workers, watch))?;
        Ok(both)
    }
}

/// The rows beside a jump of constants.
struct BesideJump<'a> {
    weak: &'a WeakRows,
    model: &'a Model,
    both: &'a BeforeAndAfter,
    /// Rows over which windowed unknowns follow a line.
    lines: usize,
}

impl BesideJump<'_> {
    /// What rows beside others say of lines that windowed unknowns follow there, as far as one line may hold.
    fn lines_around(&self, over: &Range<usize>) -> Option<[OfLines; 2]> {
        let whole = self.wider(over, self.lines);
        Some([self.line(whole.start..over.start, 0)?, self.line(over.end..whole.end, 1)?])
    }

    /// What some rows say of lines beside the constants before or after the jump.
    fn line(&self, rows: Range<usize>, side: usize) -> Option<OfLines> {
        OfLines::new(&self.weak.rows, self.model, &rows, &self.both.constants[side])
    }

    /// The mean square that is left of rows before some and after them, as far as others reach, by lines that hold so long as one may.
    fn left(&self, over: &Range<usize>, whole: &Range<usize>) -> Option<f64> {
        let sides = [whole.start..over.start.max(whole.start), over.end.min(whole.end)..whole.end];
        let mut all = Vec::new();
        for (side, rows) in sides.into_iter().enumerate() {
            let count = (rows.len() / self.lines).max(1);
            let place = |part: usize| rows.start + rows.len() * part / count;
            let before = all.len();
            // A part that lies in a gap says nothing.
            all.extend((0..count).filter_map(|part| self.line(place(part)..place(part + 1), side)));
            if all.len() == before {
                return None;
            }
        }
        mean_left(&all)
    }

    /// Rows, and so many more on either side as there are.
    fn wider(&self, rows: &Range<usize>, more: usize) -> Range<usize> {
        rows.start.saturating_sub(more)..(rows.end + more).min(self.weak.rows.len())
    }

    /// The row about which the constants jump: where lines of the windowed unknowns leave least beside them, not counting rows that a test function there
    /// reaches over.
    fn about(&self) -> Option<usize> {
        let (mut row, mut within) = (self.both.row, self.both.length);
        let whole = self.wider(&(row..row), 2 * within);
        loop {
            let step = (within / PARTS).max(1);
            let left = |place: usize| -> Option<(usize, f64)> {
                let over = self.wider(&(place..place), self.weak.reach());
                Some((place, self.left(&over, &whole)?))
            };
            let places = self.wider(&(row..row + 1), within).step_by(step);
            (row, _) = places.filter_map(left).min_by(|a, b| a.1.total_cmp(&b.1))?;
            if step <= self.weak.reach().max(1) {
                return Some(row);
            }
            within = 2 * step;
        }
    }
}
