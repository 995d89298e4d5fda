//! How well slow coefficients predict rows: from equations without the row, beside windows on both sides of it.

use crate::inference::largest_square::{LargestSquare, USUAL};
use crate::inference::slow_curve::Varying;
use crate::inference::slow_equations::Slow;
use crate::regression::constants::Expected;
use crate::regression::problem::Problem;
use crate::regression::solved::is_determined;
use crate::regression::subsample::{Compare, rows_all_over};
use crate::regression::window_length::Scale;

/// The largest squared error over the noise's variance that counts, where noise explains the usual one.
const MOST: f64 = 25.0;

/// Which curves of a bandwidth are to predict a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PredictedBy {
    /// Those without the equations near it.
    OtherEquations,
    /// Those with all equations, where what is left is far more than noise: there curves without the equations near a row may not follow what moves quickly.
    /// All of these are worse than what predicts with noise alone.
    AllEquations,
}

/// How well slow coefficients predict rows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Prediction {
    /// Mean squared error over the noise's variance, from equations without the row.
    pub(crate) error: f64,
    /// The same by all equations, if they are to predict.
    by_all: Option<f64>,
    /// By how much of its variance the noise of a row is more than expected, with the coefficients that were found.
    pub(crate) excess: f64,
}

impl Prediction {
    /// The error by which curves are compared in one way.
    pub(crate) fn by(self, way: PredictedBy) -> f64 {
        match way {
            PredictedBy::OtherEquations => self.error,
            PredictedBy::AllEquations => self.by_all.unwrap_or(self.error),
        }
    }
}

/// The rows that curves are to predict, with what is the same for all curves.
pub(crate) struct PredictedRows<'a, 'b> {
    problem: &'a Problem<'b>,
    slow: &'a Slow<'a>,
    /// By unknown of the windows on both sides of a row, what every constant takes off it, and last what it is without constants.
    solutions: Vec<&'a [f64]>,
    rows: Vec<PredictedRow>,
    /// Slow coefficients that were taken off the right-hand side, and their growth per row, row by row.
    taken: Vec<(f64, f64)>,
    /// The level of each of them.
    levels: Vec<f64>,
}

/// A row, the place of its windows, and how many seconds it lies after their middle.
struct PredictedRow {
    row: usize,
    place: usize,
    later: f64,
}

impl<'a, 'b> PredictedRows<'a, 'b> {
    /// The rows that windows of a length predict: of many some, all over the record.
    pub(crate) fn new(slow: &'a Slow<'a>, problem: &'a Problem<'b>, (scale, compare): (Scale, Compare)) -> Self {
        let solved = slow.fit.leave_gap_out.as_ref();
        let solutions = solved.map_or_else(Vec::new, |solved| {
            let (fields, layout) = (solved.fields, problem.layout);
            let of = |unknown: usize| (0..=layout.constant).map(move |one| solved.field(fields.solution(unknown, one)));
            (0..layout.local()).flat_map(of).collect()
        });
        let predicted = |row: usize| {
            let (cell, solved) = (scale.cell(row), solved?);
            let place = solved.place(cell).filter(|&place| is_determined(solved, place))?;
            Some(PredictedRow { row, place, later: (row as f64 - scale.centres(cell)[1]) * problem.period })
        };
        let usable = rows_all_over(slow.rows, compare).filter(|&row| problem.usable[row]);
        let rows: Vec<PredictedRow> = usable.filter_map(predicted).collect();
        let coefficients = 0..slow.coefficients;
        let of = |one: &PredictedRow| {
            let row = one.row as f64;
            coefficients.clone().map(move |one| slow.current.map_or((0.0, 0.0), |current| current.at(one, row)))
        };
        let taken = rows.iter().flat_map(of).collect();
        let levels = coefficients.clone().map(|one| slow.current.map_or(0.0, |current| current.mean(one))).collect();
        Self { problem, slow, solutions, rows, taken, levels }
    }

    /// Mean squared error of predicting them, over the noise's variance: slow coefficients from equations without the row, windowed ones from windows
    /// on both sides of it. The angle's noise in a row grows with the coefficients: each square counts as if that were the expected noise, or
    /// the smallest coefficients would predict best. More than twice that noise excuses no error.
    pub(crate) fn error(
        &self,
        [leave_gap_out, full]: &[Varying; 2],
        ways: &[PredictedBy],
        expected: Expected,
    ) -> Prediction {
        let &Self { problem, slow, .. } = self;
        let coefficients = slow.coefficients;
        let is_noisy = !problem.noise.is_zero();
        let usual = expected.variance - expected.torque;
        let (mut squares, mut excess) = (Vec::with_capacity(self.rows.len()), 0.0);
        let mut factors = Vec::new();
        let mut locals = vec![0.0; problem.layout.local()];
        let mut constants = [leave_gap_out, full].map(|curve| self.constants(curve));
        for (beside, taken) in self.rows.iter().zip(self.taken.chunks(coefficients)) {
            let left = self.left((beside, taken), (leave_gap_out, full), &mut constants[0], &mut locals);
            let mut square = left * left;
            if is_noisy {
                let mut more = |constants: &[f64], locals: &[f64]| {
                    beside.factors(problem, locals, &mut factors);
                    let slow = (0..coefficients).map(|one| constants[one] + taken[one].0 - self.levels[one]);
                    factors.extend(slow.chain(constants[coefficients..].iter().copied()));
                    factors.push(-1.0);
                    (problem.noise.variance(&factors) - usual).min(usual)
                };
                square -= more(&constants[0], &locals);
                for (one, (value, _)) in taken.iter().enumerate() {
                    constants[1][one] = full.at(one, beside.row as f64).0 - value;
                }
                self.locals(beside.place, &constants[1], &mut locals);
                excess += more(&constants[1], &locals) / expected.variance;
            }
            squares.push(square / expected.variance);
        }
        let count = self.rows.len() as f64;
        if count == 0.0 {
            return Prediction { error: f64::INFINITY, by_all: None, excess: 0.0 };
        }
        let mean = |squares: &[f64]| {
            let most = LargestSquare::Growing.of(squares.iter().copied(), MOST);
            squares.iter().map(|square| square.min(most)).sum::<f64>() / count
        };
        let error = mean(&squares);
        let by_all = (error > USUAL && ways.contains(&PredictedBy::AllEquations)).then(|| {
            squares.clear();
            for of_row in self.rows.iter().zip(self.taken.chunks(coefficients)) {
                let left = self.left(of_row, (full, full), &mut constants[1], &mut locals);
                squares.push(left * left / expected.variance);
            }
            USUAL + mean(&squares)
        });
        Prediction { error, by_all, excess: excess / count }
    }

    /// The constants beside a curve, after places for its coefficients at a row.
    fn constants(&self, curve: &Varying) -> Vec<f64> {
        let mut constants = vec![0.0; self.problem.layout.constant];
        constants[self.slow.coefficients..].copy_from_slice(&curve.constants);
        constants
    }

    /// What is left of a row, from which slow coefficients and their growth were taken before, with those of a curve, the growth of another, and windows on
    /// both sides of it, whose unknowns it gives, too.
    fn left(
        &self,
        (beside, taken): (&PredictedRow, &[(f64, f64)]),
        (curve, growth): (&Varying, &Varying),
        constants: &mut [f64],
        locals: &mut [f64],
    ) -> f64 {
        let &Self { problem, slow, .. } = self;
        let row = beside.row;
        let mut left = problem.rhs[row];
        for (one, (companion, (value, rate))) in slow.companions.iter().zip(taken).enumerate() {
            constants[one] = curve.at(one, row as f64).0 - value;
            left -= (growth.at(one, row as f64).1 - rate) / problem.period * companion[row];
        }
        for (constant, column) in constants.iter().zip(&problem.constants) {
            left -= constant * column[row];
        }
        self.locals(beside.place, constants, locals);
        left - beside.predicted(problem, locals)
    }

    /// The unknowns of windows for given constants: values at the middle, then their growth.
    fn locals(&self, place: usize, constants: &[f64], locals: &mut [f64]) {
        for (local, solutions) in locals.iter_mut().zip(self.solutions.chunks_exact(constants.len() + 1)) {
            let (slopes, own) = solutions.split_at(constants.len());
            *local = own[0][place];
            for (slope, constant) in slopes.iter().zip(constants) {
                *local -= slope[place] * constant;
            }
        }
    }
}

impl PredictedRow {
    /// What windowed coefficients make of the row.
    fn predicted(&self, problem: &Problem<'_>, locals: &[f64]) -> f64 {
        let &Self { row, later, .. } = self;
        let of = |(unknown, local): (usize, &f64)| {
            local
                * match unknown.checked_sub(problem.layout.windowed) {
                    None => problem.windowed[unknown][row],
                    Some(slope) => problem.companions[slope][row] + later * problem.windowed[slope][row],
                }
        };
        locals.iter().enumerate().map(of).sum()
    }

    /// By which windowed regressors and their companions count in it.
    fn factors(&self, problem: &Problem<'_>, locals: &[f64], factors: &mut Vec<f64>) {
        let windowed = problem.layout.windowed;
        factors.clear();
        factors.extend_from_slice(&locals[..windowed]);
        for one in 0..windowed {
            let slope = if problem.layout.linear { locals[windowed + one] } else { 0.0 };
            factors[one] += self.later * slope;
            factors.push(slope);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equation::rows::Rows;
    use crate::regression::fit::Fit;
    use crate::regression::simulated::{CONSTANTS, assert_near, model, rows, staged, white};
    use crate::simd::instructions::Instructions;

    const ROWS: usize = 900;
    const ROUNDING: f64 = 1e-9;

    fn line(time: f64) -> [f64; 2] {
        [3.0 + 0.2 * time, 0.2]
    }

    /// A coefficient that grows along the rows from one number to another, beside the other constant.
    fn curve(from: f64, to: f64) -> Varying {
        let values = (0..=9).map(|point| from + (to - from) * f64::from(point) / 9.0).collect();
        let (spacing, stretches, variances) = (100.0, vec![(0.0, 0)], vec![vec![1.0; 10]]);
        Varying { spacing, stretches, values: vec![values], variances, constants: vec![CONSTANTS[1]] }
    }

    /// How well curves predict rows from which a curve was taken before, the angle's noise having some variance.
    fn predicted(rows: &Rows, current: Option<&Varying>, curves: [&Varying; 2], noise: f64) -> Prediction {
        let model = model();
        let scale = *Scale::all(ROWS, 3).iter().find(|scale| scale.stands_alone()).expect("a length");
        let rhs: Vec<f64> = match current {
            None => rows.rhs.clone(),
            Some(current) => crate::inference::slowly_varying::without(rows, &rows.rhs, &[1], current),
        };
        let problem = model.problem(rows, &rhs, noise, None);
        let expected = Expected { torque: 0.5, ..white(1.0) };
        let fit = staged(|stages| Fit::with_leave_gap_out(&problem, scale, expected, Instructions::Scalar, stages));
        let fit = fit.expect("constants");
        let weights = vec![1.0; fit.full.len()];
        let companions = vec![rows.regressors[1].companion.as_slice()];
        let slow = Slow { fit: &fit, coefficients: 1, companions, current, weights: &weights, rows: ROWS, breaks: &[] };
        let curves = curves.map(Varying::clone);
        let rows = PredictedRows::new(&slow, &problem, (scale, Compare::Most));
        rows.error(&curves, &[PredictedBy::OtherEquations], expected)
    }

    #[test]
    fn the_right_curve_leaves_nothing_and_another_its_distance_squared() {
        let rows = rows(ROWS, line, 0.0);
        let error = |off: f64| {
            let curve = curve(CONSTANTS[0] + off, CONSTANTS[0] + off);
            predicted(&rows, None, [&curve, &curve], 0.0).error
        };
        assert!(error(0.0) < ROUNDING);
        let square = rows.regressors[1].value.iter().map(|value| value * value).sum::<f64>() / ROWS as f64;
        // Windows beside a row tell nothing of it: what they follow of the distance is a little more noise.
        assert!((1.0..1.3).contains(&(error(0.5) / 0.25 / square)), "{} {square}", error(0.5));
        assert_near(error(0.5), 4.0 * error(0.25), ROUNDING);
    }

    #[test]
    fn what_was_taken_off_before_changes_nothing() {
        let rows = rows(ROWS, line, 0.3);
        let (one, other) = (curve(0.8, 1.9), curve(1.4, 1.1));
        let alone = predicted(&rows, None, [&one, &other], 0.0);
        for current in [curve(0.9, 0.9), curve(CONSTANTS[0], CONSTANTS[0])] {
            let found = predicted(&rows, Some(&current), [&one, &other], 0.0);
            assert_near(found.error, alone.error, ROUNDING);
        }
    }

    #[test]
    fn noise_of_the_regressor_excuses_as_much_as_the_coefficient_makes_of_it() {
        let mut rows = rows(ROWS, line, 0.3);
        rows.regressors[1].noise = [vec![1.0], Vec::new()];
        let [small, large] = [0.0, 0.5].map(|value| curve(value, value));
        // Half of the variance of 1 is that of the angle's noise as expected; the rest of what a coefficient of .5 makes is excused.
        let (noise, usual) = (0.2, 0.5);
        let found = predicted(&rows, None, [&large, &large], noise);
        assert_near(found.excess, 0.25 * noise - usual, ROUNDING);
        let without = predicted(&rows, None, [&large, &large], 0.0);
        assert_near(found.error - without.error, usual - 0.25 * noise, 0.02);
        assert_near(predicted(&rows, None, [&small, &small], noise).excess, -usual, ROUNDING);
        // More than twice as much excuses nothing more.
        assert_near(predicted(&rows, None, [&large, &large], 8.0).excess, usual, ROUNDING);
    }
}
