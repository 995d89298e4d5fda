//! Jumps of inertia and damping, where these are constant between jumps.
//!
//! Blocks of the record tell between which of them the constants jump. Where exactly is found as for windowed coefficients: rows that reach
//! over the jump are predicted from the constants and lines on both sides, with velocity and acceleration of local polynomials.

use std::ops::Range;

use crate::error::Error;
use crate::identify::weak::decided::Decided;
use crate::identify::weak::jumps::signals;
use crate::identify::weak::session::Session;
use crate::inference::jumps::constants::Told;
use crate::inference::jumps::jump::{Jump, JumpSearch, Lines};
use crate::inference::jumps::placement::JumpPlace;
use crate::lanes::output::Elements;
use crate::local_polynomials::criterion::Criterion;
use crate::local_polynomials::estimates::Estimates;
use crate::local_polynomials::options::{Order, PolynomialOptions, Selection};
use crate::local_polynomials::plan::LocalPolynomials;
use crate::record::derived::Whole;
use crate::record::samples::Samples;
use crate::regression::block_fit::{Parts, lines};
use crate::regression::model::Model;
use crate::weak_form::test_function_choice::spectrum_length;
use crate::weak_form::weak_rows::WeakRows;

/// Typical cycles of the motion, and test functions, that a block holds at least.
const CYCLES: f64 = 3.0;
const TEST_FUNCTIONS: usize = 2;
const FEWEST_BLOCKS: usize = 8;
/// Half-widths of the test function around the last place within which the next one is looked for.
const NEAR: usize = 2;
/// The shortest windows of velocity and acceleration.
const SHORTEST_WINDOW: usize = 9;

/// Constants on both sides of a place, and blocks beside it.
struct BeforeAndAfter {
    constants: [Vec<f64>; 2],
    /// Rows of a block.
    length: usize,
    sample: usize,
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
            let both = BeforeAndAfter {
                constants: [values[0].clone(), values[1].clone()],
                length,
                sample: weak.first + blocks[block].start * weak.stride,
            };
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
        let (mut moving, mut factors): (Vec<Box<dyn Samples + '_>>, Vec<usize>) = (Vec::new(), Vec::new());
        for (place, &unknown) in model.constant.iter().enumerate() {
            match unknown {
                0 => moving.push(Box::new(acceleration)),
                1 => moving.push(Box::new(velocity)),
                2 => moving.push(Box::new(Whole(self.record.angle))),
                _ => {
                    let value = f64::midpoint(both.constants[0][place], both.constants[1][place]);
                    let column = &weak.rows.regressors[unknown].value;
                    rhs.iter_mut().zip(column).for_each(|(rhs, column)| *rhs -= value * column);
                    continue;
                }
            }
            factors.push(place);
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
        let mut sample = both.sample;
        let mut jump = None;
        for wide in [both.length * weak.stride, NEAR * half, NEAR * half] {
            let row_of = |sample: usize| (sample.saturating_sub(weak.first) / weak.stride).min(rows);
            let row = row_of(sample).clamp(1, rows - 1);
            let gap = wide / weak.stride + weak.reach();
            let before = row.saturating_sub(gap + both.length)..row.saturating_sub(gap);
            let after = (row + gap).min(rows)..(row + gap + both.length).min(rows);
            let line = |block: &Range<usize>, place_of: usize, origin: usize| -> Option<Lines> {
                let centre = 0.5 * (block.start + block.end) as f64 - 0.5;
                let found = lines(&weak.rows, model, block, &both.constants[place_of])?;
                let at = |[value, growth]: [f64; 2]| {
                    let growth = growth * weak.rows.period;
                    [value + growth * (origin as f64 - centre), growth]
                };
                let constants = factors.iter().map(|&place| [both.constants[place_of][place], 0.0]);
                Some(constants.chain(found.into_iter().map(at)).collect())
            };
            let both = [line(&before, 0, row)?, line(&after, 1, row - 1)?];
            let candidates = sample.saturating_sub(wide).max(weak.first)..(sample + wide + 1).min(last);
            let over = row_of(candidates.start.saturating_sub(half))..row_of(candidates.end + half);
            let left = search.left(&JumpPlace { lines: &both, row, over: &over, candidates: &candidates })?;
            let best = (0..left.len()).min_by(|&a, &b| left[a].total_cmp(&left[b]))?;
            sample = candidates.start + best;
            jump = Some(search.jump(&left, best, candidates.start, over.len() as f64));
        }
        jump.map(|jump| Jump { of_constants: true, ..jump })
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
