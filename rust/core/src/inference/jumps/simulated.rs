//! A spring that jumps, for the tests of this room.

use crate::equation::rows::{Regressor, Rows};
use crate::inference::jumps::jump::JumpSearch;
use crate::regression::model::Model;
use crate::regression::row_covariance::RowCovariance;
use crate::regression::simulated::{random, staged, white};
use crate::regression::window_length::Scale;
use crate::simd::instructions::Instructions;

/// An angle, and rows of a spring alone that jumps before some samples.
pub(crate) struct Spring {
    pub(crate) angle: Vec<f64>,
    pub(crate) function: Vec<f64>,
    pub(crate) rows: Rows,
}

pub(crate) const SAMPLES: usize = 3000;
pub(crate) const HALF: usize = 12;
pub(crate) const STRIDE: usize = 2;
pub(crate) const DEVIATION: f64 = 1e-3;

pub(crate) fn spring(stiffness: impl Fn(usize) -> f64) -> Spring {
    let waves = |sample: usize| -> f64 {
        (1..8_u8).map(|wave| (sample as f64 * 0.01 * f64::from(wave) + f64::from(wave * wave)).sin()).sum()
    };
    let angle: Vec<f64> = (0..SAMPLES).map(waves).collect();
    let position = |k: usize| (k as f64 - HALF as f64) / HALF as f64;
    let mut function: Vec<f64> = (0..=2 * HALF).map(|k| (1.0 - position(k).powi(2)).powi(5)).collect();
    let total: f64 = function.iter().sum();
    for value in &mut function {
        *value /= total;
    }
    let count = (SAMPLES - 2 * HALF).div_ceil(STRIDE);
    let of = |row: usize, weight: &dyn Fn(usize, usize) -> f64| -> f64 {
        (0..=2 * HALF).map(|k| function[k] * angle[row * STRIDE + k] * weight(k, row * STRIDE + k)).sum()
    };
    let column = |weight: &dyn Fn(usize, usize) -> f64| (0..count).map(|row| of(row, weight)).collect::<Vec<f64>>();
    let period = 0.5;
    let regressor = Regressor {
        value: column(&|_, _| 1.0),
        companion: column(&|k, _| (k as f64 - HALF as f64) * period / STRIDE as f64),
        ..Regressor::default()
    };
    let noise = random(5, count);
    let mut rhs = column(&|_, sample| stiffness(sample));
    rhs.iter_mut().zip(noise).for_each(|(rhs, noise)| *rhs += DEVIATION * noise);
    let rows = Rows { rhs, usable: vec![true; count], period, regressors: vec![regressor], ..Rows::default() };
    Spring { angle, function, rows }
}

/// What jumps are looked for in, for some work.
pub(crate) fn searched<R>(spring: &Spring, work: impl FnOnce(&JumpSearch<'_>) -> R) -> R {
    let (rows, variance) = (&spring.rows, DEVIATION * DEVIATION);
    let model = Model { windowed: vec![0], constant: Vec::new(), linear: true, ..Model::default() };
    let covariance = RowCovariance::by_distance(vec![variance]);
    let correlated = staged(|stages| model.correlated(rows, &covariance, stages));
    let problem = model.problem(rows, &rows.rhs, 0.0, Some(&correlated));
    let scales = Scale::all(rows.len(), HALF / STRIDE);
    let lengths: Vec<Scale> = scales.iter().filter(|scale| scale.stands_alone()).take(3).copied().collect();
    work(&JumpSearch {
        problem: &problem,
        whole: &problem,
        rhs: &rows.rhs,
        signals: &[&spring.angle.as_slice()],
        function: &spring.function,
        first: HALF,
        stride: STRIDE,
        group: 1,
        expected: white(variance),
        inflation: 1.0,
        scales: &scales,
        lengths: &lengths,
        instructions: Instructions::Scalar,
    })
}
