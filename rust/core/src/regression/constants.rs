//! Constant unknowns, estimated from all windows together.
//!
//! Once a window's own unknowns are eliminated, the rest of its rows depends on the constant unknowns only (Speckman
//! 1988): a few rows, which are stacked over all windows and decomposed again. A window over a jump fits badly and gets
//! a smaller weight (Huber's rule on its misfit).

use std::ops::Range;

use crate::least_squares::stacked_qr::Summary;
use crate::regression::layout::Layout;
use crate::regression::row_covariance::RowCovariance;
use crate::regression::solved::{Solved, is_determined};
use crate::regression::summary::absorb;
use crate::simd::f64x8::{Packet, WIDTH};
use crate::simd::instructions::Instructions;
use crate::simd::vectors::{Kernel, Lanes, dispatch};

/// Windows whose misfit exceeds the median by more than so many standard deviations get less weight.
const TOLERATED: f64 = 4.0;

/// Rounds of weighting.
const ROUNDS: usize = 3;

/// Estimates of the constant unknowns from all windows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pooled {
    pub(crate) values: Vec<f64>,
    /// The inverse of the normal matrix, row by row.
    pub(crate) inverse: Vec<f64>,
    /// Condition number of the columns after elimination, each scaled by its norm before.
    pub(crate) condition: f64,
    /// Weight of every window.
    pub(crate) weights: Vec<f64>,
}

/// The expected noise of a row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Expected {
    /// Variance of a row, and the part of it that is the torque's.
    pub(crate) variance: f64,
    pub(crate) torque: f64,
    /// Variance inflation: the number of rows that carry the information of one independent row.
    pub(crate) variance_inflation: f64,
}

impl Expected {
    /// For unknown noise: all windows keep their weights, whatever their misfit.
    pub(crate) const UNKNOWN: Self = Self { variance: f64::NAN, torque: 0.0, variance_inflation: 1.0 };

    pub(crate) fn new(covariance: &RowCovariance, torque: f64) -> Self {
        Self { variance: covariance.variance(), torque, variance_inflation: covariance.variance_inflation() }
    }
}

/// Solves for the constant unknowns from some windows, or returns `None` if they are not determined.
pub(crate) fn pool(
    full: &Solved,
    windows: Range<usize>,
    expected: Expected,
    instructions: Instructions,
) -> Option<Pooled> {
    let fields = full.fields;
    let mut weights: Vec<f64> =
        windows.clone().map(|window| f64::from(u8::from(is_determined(full, window)))).collect();
    let mut pooled = solve(full, &windows, &weights, instructions)?;
    if fields.layout.local() == 0 {
        return Some(Pooled { weights, ..pooled });
    }
    for _ in 0..ROUNDS {
        let misfits = misfits(full, &windows, &pooled.values, expected);
        let mut sorted: Vec<f64> = misfits
            .iter()
            .zip(&weights)
            .filter(|(misfit, weight)| misfit.is_finite() && **weight > 0.0)
            .map(|(misfit, _)| *misfit)
            .collect();
        if sorted.is_empty() {
            break;
        }
        let middle = sorted.len() / 2;
        let median = *sorted.select_nth_unstable_by(middle, f64::total_cmp).1;
        let counts = &full.field(fields.count())[windows.clone()];
        for ((count, weight), misfit) in counts.iter().zip(&mut weights).zip(&misfits) {
            let independent = (count / expected.variance_inflation - 2.0).max(1.0);
            let most = median.max(1.0) * (1.0 + TOLERATED * (2.0 / independent).sqrt());
            if *weight > 0.0 {
                *weight = if *misfit > most { (most / misfit).powi(2) } else { 1.0 };
            }
        }
        pooled = solve(full, &windows, &weights, instructions)?;
    }
    Some(Pooled { weights, ..pooled })
}

/// The residual sums of squares of some windows over their expectation.
pub(crate) fn misfits(full: &Solved, windows: &Range<usize>, values: &[f64], expected: Expected) -> Vec<f64> {
    let field = |field: usize| &full.field(field)[windows.clone()];
    let (counts, freedoms) = (field(full.fields.count()), field(full.fields.freedom()));
    let mut misfits = sums_of_squares(full, windows, values);
    for ((misfit, &count), &freedom) in misfits.iter_mut().zip(counts).zip(freedoms) {
        let noise = count * expected.variance;
        let left = (noise - freedom).max(0.3 * noise);
        *misfit = (*misfit + count * (expected.variance - expected.torque)) / left;
    }
    misfits
}

/// The residual sums of squares of some windows for given constants, corrected for the noise of the angle.
pub(crate) fn sums_of_squares(full: &Solved, windows: &Range<usize>, values: &[f64]) -> Vec<f64> {
    let (fields, constants) = (full.fields, full.fields.layout.constant);
    let left = |row: usize, column: usize| &full.field(fields.left(row, column))[windows.clone()];
    let mut sums = left(constants, constants).to_vec();
    for row in 0..constants {
        let mut errors = left(row, constants).to_vec();
        for (column, value) in values.iter().enumerate().take(constants).skip(row) {
            errors.iter_mut().zip(left(row, column)).for_each(|(error, factor)| *error -= factor * value);
        }
        sums.iter_mut().zip(errors).for_each(|(sum, error)| *sum += error * error);
    }
    sums
}

/// The combination of constants that all windows together determine worst, each column scaled to its norm: one entry per constant.
pub(crate) fn weakest(full: &Solved, weights: &[f64]) -> Vec<f64> {
    let constants = full.fields.layout.constant;
    if constants == 0 {
        return Vec::new();
    }
    let (total, norms) = Stack { full, windows: &(0..full.len()), weights }.run(pulp::Scalar::new());
    total.weakest(&norms)
}

fn solve(full: &Solved, windows: &Range<usize>, weights: &[f64], instructions: Instructions) -> Option<Pooled> {
    let fields = full.fields;
    let constants = fields.layout.constant;
    if constants == 0 {
        return Some(Pooled { condition: 1.0, ..Pooled::default() });
    }
    let (total, norms) = dispatch(instructions, Stack { full, windows, weights });
    let (values, inverse, condition) = total.solution(&norms)?;
    Some(Pooled { values, inverse, condition, weights: Vec::new() })
}

/// Stacks the rows that windows leave for the constants and decomposes them, eight windows at a time.
struct Stack<'a> {
    full: &'a Solved,
    windows: &'a Range<usize>,
    weights: &'a [f64],
}

impl Kernel for Stack<'_> {
    /// The factor, and the squared norms of the columns before anything was eliminated.
    type Output = (Summary, Vec<f64>);

    #[inline(always)]
    fn run<S: Lanes>(self, _simd: S) -> (Summary, Vec<f64>) {
        let fields = self.full.fields;
        let constants = fields.layout.constant;
        let layout = Layout { windowed: 0, linear: false, constant: constants };
        let columns = layout.columns();
        let mut factor = vec![Packet::ZERO; layout.size()];
        let mut rows = vec![Packet::ZERO; columns * columns];
        let mut norms = vec![0.0; constants];
        let enough = fields.layout.regressors() as f64;
        for first in self.windows.clone().step_by(WIDTH) {
            let mut weight = Packet::ZERO;
            for (lane, weight) in weight.0.iter_mut().enumerate() {
                let window = first + lane;
                if self.windows.contains(&window) && self.full.field(fields.count())[window] > enough {
                    *weight = self.weights[window - self.windows.start];
                }
            }
            let root = weight.sqrt();
            let place = first.cast_signed();
            for row in 0..constants {
                for column in row..columns {
                    let value = Packet::gather(self.full.field(fields.left(row, column)), place, 1);
                    rows[row * columns + column] = root * value;
                }
                let squared = weight * Packet::gather(self.full.field(fields.norm(row)), place, 1);
                norms[row] += squared.0.iter().sum::<f64>();
            }
            absorb(layout, &mut factor, &mut rows, constants, true);
        }
        let entry = |row: usize, column: usize| {
            let (lane, row) = (row / columns, row % columns);
            if column < row { 0.0 } else { factor[layout.entry(row, column)].0[lane] }
        };
        (Summary::from_rows(WIDTH * columns, columns, entry), norms)
    }
}
