//! Rows whose answer is known, and slow ways to it: for the tests of this room and those behind it.

use std::num::NonZeroUsize;

use crate::equation::rows::{Regressor, Rows};
use crate::error::Error;
use crate::exec::stages::Stages;
use crate::regression::constants::Expected;
use crate::regression::model::Model;

/// Seconds from one row to the next.
pub(crate) const PERIOD: f64 = 0.5;

/// What the constants of the rows are.
pub(crate) const CONSTANTS: [f64; 2] = [2.0, -0.7];

/// Numbers of mean zero and variance one that look random, evenly distributed.
pub(crate) fn random(seed: u64, count: usize) -> Vec<f64> {
    let mut state = seed.wrapping_mul(0x9fb2_1c65_1e98_df25);
    let mut next = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = state;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..count).map(|_| (next() - 0.5) * 12.0_f64.sqrt()).collect()
}

/// Rows of one unknown that changes, given by its value and its rate at a time, and of two that are constant, with white noise of some
/// deviation on the right-hand side. Regressors are white.
pub(crate) fn rows(count: usize, changing: impl Fn(f64) -> [f64; 2], deviation: f64) -> Rows {
    let regressor = |seed: u64| Regressor {
        value: random(seed, count),
        companion: random(seed + 10, count),
        noise: [Vec::new(), Vec::new()],
    };
    let regressors: Vec<Regressor> = (0..3).map(regressor).collect();
    let noise = random(99, count);
    let rhs = |row: usize| {
        let [value, rate] = changing(row as f64 * PERIOD);
        let constants: f64 = CONSTANTS.iter().zip(&regressors[1..]).map(|(value, one)| value * one.value[row]).sum();
        value * regressors[0].value[row] + rate * regressors[0].companion[row] + constants + deviation * noise[row]
    };
    let rhs = (0..count).map(rhs).collect();
    Rows { rhs, usable: vec![true; count], period: PERIOD, regressors, ..Rows::default() }
}

/// The model of these rows: what changes follows a line in every window.
pub(crate) fn model() -> Model {
    Model { windowed: vec![0], constant: vec![1, 2], linear: true, ..Model::default() }
}

/// What independent rows with noise of some variance leave.
pub(crate) fn white(variance: f64) -> Expected {
    Expected { variance, torque: variance, variance_inflation: 1.0 }
}

/// Works on one thread, unwatched.
pub(crate) fn staged<R>(work: impl FnOnce(&mut Stages<'_, '_>) -> Result<R, Error>) -> R {
    let mut watch = |_: usize, _: usize| true;
    work(&mut Stages::new(NonZeroUsize::MIN, 1, 1, &mut watch)).expect("nobody cancels")
}

/// The products of every two columns.
pub(crate) fn products(columns: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let product = |one: &Vec<f64>, other: &Vec<f64>| one.iter().zip(other).map(|(a, b)| a * b).sum();
    columns.iter().map(|one| columns.iter().map(|other| product(one, other)).collect()).collect()
}

/// Solves linear equations by elimination with pivots.
pub(crate) fn solved(mut matrix: Vec<Vec<f64>>, mut rhs: Vec<f64>) -> Vec<f64> {
    let size = rhs.len();
    for column in 0..size {
        let pivot = (column..size).max_by(|&a, &b| matrix[a][column].abs().total_cmp(&matrix[b][column].abs()));
        let pivot = pivot.expect("a row");
        matrix.swap(column, pivot);
        rhs.swap(column, pivot);
        let pivot = matrix[column].clone();
        for row in (0..size).filter(|&row| row != column) {
            let factor = matrix[row][column] / pivot[column];
            matrix[row].iter_mut().zip(&pivot).for_each(|(entry, above)| *entry -= factor * above);
            rhs[row] -= factor * rhs[column];
        }
    }
    (0..size).map(|row| rhs[row] / matrix[row][row]).collect()
}

/// The least-squares solution of columns, of which the last is the right-hand side, by normal equations.
pub(crate) fn least_squares(columns: &[Vec<f64>]) -> Vec<f64> {
    let mut normal = products(columns);
    normal.pop();
    let rhs = normal.iter_mut().map(|row| row.pop().expect("a right-hand side")).collect();
    solved(normal, rhs)
}

/// Fails where two numbers differ by more than some part of one and themselves.
#[track_caller]
pub(crate) fn assert_near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance * (1.0 + expected.abs()), "{found}, not {expected}");
}
