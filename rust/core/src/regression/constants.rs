//! Constant unknowns, estimated from all windows together.
//!
//! Once a window's own unknowns are eliminated, the rest of its rows depends on the constant unknowns only (Speckman
//! 1988): a few rows, which are stacked over all windows and decomposed again. A window over a jump fits badly and gets
//! a smaller weight (Huber's rule on its misfit).

use std::ops::Range;

use crate::least_squares::stacked_qr::Summary;
use crate::noise::median::median;
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
        let Some(median) = median(&mut sorted) else { break };
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equation::rows::Rows;
    use crate::regression::dyadic_windows::{WindowShape, solve_windows};
    use crate::regression::simulated::{CONSTANTS, assert_near, model, random, rows, staged, white};

    const SPAN: usize = 40;
    const ROWS: usize = 800;

    /// Windows of 40 rows that share none.
    fn windows(rows: &Rows) -> Solved {
        let problem = model().problem(rows, &rows.rhs, 0.0, None);
        let shapes = [WindowShape::of(0..1, SPAN)];
        let count = (ROWS / SPAN).cast_signed();
        solve_windows(&problem, SPAN, &(0..count), &shapes, Instructions::Scalar).swap_remove(0)
    }

    /// A line in every window, another one in each.
    fn steps(time: f64) -> [f64; 2] {
        let window = (time / crate::regression::simulated::PERIOD / SPAN as f64).floor();
        [3.0 * window.sin() + 0.1 * window * time, 0.1 * window]
    }

    #[test]
    fn constants_are_exact_whatever_the_windows_hold() {
        let rows = rows(ROWS, steps, 0.0);
        let pooled = pool(&windows(&rows), 0..20, white(1.0), Instructions::Scalar).expect("constants");
        for (found, expected) in pooled.values.iter().zip(CONSTANTS) {
            assert_near(*found, expected, 1e-11);
        }
        assert_eq!(pooled.weights, vec![1.0; 20]);
        assert!((2.0..2.5).contains(&pooled.condition), "white columns: {}", pooled.condition);
    }

    #[test]
    fn a_window_that_fits_badly_counts_less() {
        let mut rows = rows(ROWS, steps, 0.1);
        for (row, more) in random(5, SPAN).iter().enumerate() {
            rows.rhs[7 * SPAN + row] += 30.0 * more;
        }
        let full = windows(&rows);
        let found = pool(&full, 0..20, white(0.01), Instructions::Scalar).expect("constants");
        let alike = pool(&full, 0..20, Expected::UNKNOWN, Instructions::Scalar).expect("constants");
        for (window, weight) in found.weights.iter().enumerate() {
            assert_eq!(*weight < 1.0, window == 7, "{window}: {weight}");
        }
        assert_eq!(alike.weights, vec![1.0; 20]);
        // Its square errors are a hundred thousand times too large, and its weight as much too small.
        assert!(found.weights[7] < 1e-6);
        let off = |pooled: &Pooled| pooled.values.iter().zip(CONSTANTS).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off(&found) < 5.0 * 0.1 / (720.0_f64).sqrt());
        assert!(off(&alike) > 10.0 * off(&found));
    }

    #[test]
    fn weights_do_not_depend_on_the_unit_of_the_torque() {
        let mut plain = rows(ROWS, steps, 0.1);
        for (row, more) in random(5, SPAN).iter().enumerate() {
            plain.rhs[7 * SPAN + row] += 3.0 * more;
        }
        let found = |scale: f64| {
            let mut rows = plain.clone();
            rows.rhs.iter_mut().for_each(|rhs| *rhs *= scale);
            pool(&windows(&rows), 0..20, white(0.01 * scale * scale), Instructions::Scalar).expect("constants")
        };
        let one = found(1.0);
        assert!(one.weights[7] < 0.5);
        for scale in [2.0_f64.powi(-20), 1024.0, 2.0_f64.powi(20)] {
            let other = found(scale);
            assert_eq!(other.weights, one.weights, "{scale}");
            let values: Vec<f64> = other.values.iter().map(|value| value / scale).collect();
            assert_eq!(values, one.values, "{scale}");
        }
    }

    #[test]
    fn constants_come_from_the_windows_that_are_asked_for() {
        let mut rows = rows(ROWS, steps, 0.0);
        let first: Vec<f64> = rows.regressors[1].value[..10 * SPAN].to_vec();
        rows.rhs.iter_mut().zip(first).for_each(|(rhs, value)| *rhs += 5.0 * value);
        let full = windows(&rows);
        for (asked, expected) in [(0..10, CONSTANTS[0] + 5.0), (10..20, CONSTANTS[0])] {
            let pooled = pool(&full, asked, white(1.0), Instructions::Scalar).expect("constants");
            assert_near(pooled.values[0], expected, 1e-11);
        }
    }

    #[test]
    fn misfits_of_windows_that_hold_the_expected_noise_are_one() {
        let rows = rows(ROWS, steps, 0.1);
        // What the windows' own unknowns take up is counted with the rows' covariance.
        let covariance = RowCovariance::by_distance(vec![0.01]);
        let correlated = staged(|stages| model().correlated(&rows, &covariance, stages));
        let problem = model().problem(&rows, &rows.rhs, 0.0, Some(&correlated));
        let shapes = [WindowShape::of(0..1, SPAN)];
        let full = solve_windows(&problem, SPAN, &(0..20), &shapes, Instructions::Scalar).swap_remove(0);
        let misfits = misfits(&full, &(0..20), &CONSTANTS, white(0.01));
        let mean = misfits.iter().sum::<f64>() / 20.0;
        // Squares of even noise scatter by √0.8; some 760 of them are left.
        assert!((mean - 1.0).abs() < 5.0 * (0.8_f64 / 760.0).sqrt(), "{mean}");
    }

    #[test]
    fn squares_for_other_constants_are_those_of_the_rows() {
        let rows = rows(ROWS, |_| [0.0, 0.0], 0.0);
        let mut model = model();
        (model.windowed, model.linear) = (Vec::new(), false);
        let problem = model.problem(&rows, &rows.rhs, 0.0, None);
        let shapes = [WindowShape::of(0..1, SPAN)];
        let full = solve_windows(&problem, SPAN, &(0..20), &shapes, Instructions::Scalar).swap_remove(0);
        let [one, other] = [1.5, 0.4];
        let left =
            |row: usize| rows.rhs[row] - one * rows.regressors[1].value[row] - other * rows.regressors[2].value[row];
        for (window, found) in sums_of_squares(&full, &(0..20), &[one, other]).into_iter().enumerate() {
            assert_near(found, (window * SPAN..(window + 1) * SPAN).map(|row| left(row).powi(2)).sum(), 1e-12);
        }
    }

    #[test]
    fn constants_with_the_same_regressor_are_not_determined() {
        let mut rows = rows(ROWS, steps, 0.1);
        rows.regressors[2] = rows.regressors[1].clone();
        let full = windows(&rows);
        assert!(pool(&full, 0..20, white(0.01), Instructions::Scalar).is_none());
        let weakest = weakest(&full, &[1.0; 20]);
        // Their difference is what nothing tells.
        assert_near((weakest[0] / weakest[1]).abs(), 1.0, 1e-6);
        assert!(weakest[0] * weakest[1] < 0.0);
    }
}
