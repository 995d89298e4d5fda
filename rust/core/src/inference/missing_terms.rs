//! Tests for terms that are missing from the equation of motion: friction, an offset, a hardening spring, a lag of the
//! torque; and for what the torque itself tells: a sensor that is not linear, a resonance.
//!
//! Each term is added to the constants on its own and judged by its standard error (similar to a score test). What the torque tells is judged beside all
//! of them: anything that is missing bends the relation of torque and motion a little.

use std::sync::Arc;

use crate::equation::rows::Rows;
use crate::equation::terms::BuiltInTerm;
use crate::error::Error;
use crate::exec::stages::Stages;
use crate::record::derived::Mapped;
use crate::record::samples::Samples;
use crate::regression::constants::Expected;
use crate::regression::fit::Fit;
use crate::regression::model::Model;
use crate::regression::problem::{Correlated, Problem};
use crate::regression::residuals::residuals;
use crate::regression::row_covariance::RowCovariance;
use crate::simd::instructions::Instructions;

/// A term is suspected if its coefficient exceeds its standard error so many times.
pub const CONSPICUOUS: f64 = 5.0;

/// Blocks of rows that must agree on a coefficient.
const BLOCKS: usize = 32;

/// A term that may be missing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Missing {
    /// A built-in term.
    Term(&'static BuiltInTerm),
    /// The torque lags behind.
    Lag,
    /// A channel beside those of the masses has a part of itself too little.
    Gain,
    /// The torque has a part of its own second derivative: something between its sensor and that of the angle bends.
    Resonance,
    /// It has a part of its own square: what its sensor shows is not symmetric.
    TorqueSquare,
    /// It has a part of its own cube: what its sensor shows is not linear.
    TorqueCube,
}

/// A missing term and its coefficient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Suspect {
    /// What it is.
    pub missing: Missing,
    /// Its coefficient, in the unit of the term, or samples.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
}

impl Missing {
    /// What it is called.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Term(term) => term.name,
            Self::Lag => "lag",
            Self::Gain => "gain",
            Self::Resonance => "resonance",
            Self::TorqueSquare => "torque_square",
            Self::TorqueCube => "torque_cube",
        }
    }

    /// Whether it is told by the torque itself, beside everything else.
    #[must_use]
    pub fn is_of_torque(self) -> bool {
        matches!(self, Self::Resonance | Self::TorqueSquare | Self::TorqueCube)
    }

    /// Whether what the torque tells is told beside it.
    pub(crate) fn is_beside_torque(&self) -> bool {
        if let Self::Term(term) = self { term.beside_torque } else { true }
    }

    /// The samples of a term or of a power of the torque, `None` if they are one everywhere or it is none.
    pub(crate) fn samples<'a>(
        self,
        angle: &'a dyn Samples,
        velocity: &'a dyn Samples,
        torque: &'a dyn Samples,
    ) -> Option<Mapped<'a>> {
        match self {
            Self::Term(term) => term.function.samples(angle, velocity),
            Self::TorqueSquare => Some(Mapped { channel: torque, function: squares }),
            Self::TorqueCube => Some(Mapped { channel: torque, function: cubes }),
            Self::Lag | Self::Gain | Self::Resonance => None,
        }
    }
}

fn squares(values: &mut [f64]) {
    for value in values {
        *value = value.powi(2);
    }
}

fn cubes(values: &mut [f64]) {
    for value in values {
        *value = value.powi(3);
    }
}

impl Suspect {
    /// Whether it is significant.
    #[must_use]
    pub fn is_conspicuous(&self) -> bool {
        self.value.abs() > CONSPICUOUS * self.error
    }
}

/// Factors with their standard errors, and what constants change by.
pub(crate) type FactorsAndChanges = (Vec<(f64, f64)>, Vec<f64>);

/// What every row adds to a coefficient, over its right-hand side, and what is left of the row beside it.
pub(crate) struct InRows {
    pub(crate) by: Vec<f64>,
    pub(crate) left: Vec<f64>,
}

impl InRows {
    /// The standard error that follows from what blocks of rows leave, however that is distributed.
    pub(crate) fn error_of_blocks(&self) -> f64 {
        of_blocks(&self.by, &self.left, self.by.len().div_ceil(BLOCKS))
    }
}

/// The root of the summed squares of the products of two columns, summed in blocks of so many rows: of what rows move a coefficient by and its own column
/// one where a single block tells it.
pub(crate) fn of_blocks(one: &[f64], other: &[f64], rows: usize) -> f64 {
    let products: Vec<f64> = one.iter().zip(other).map(|(one, other)| one * other).collect();
    products.chunks(rows.max(1)).map(|block| block.iter().sum::<f64>().powi(2)).sum::<f64>().sqrt()
}

/// The fit that a term is added to.
pub(crate) struct JudgedTerm<'a> {
    pub(crate) rows: &'a Rows,
    pub(crate) model: &'a Model,
    pub(crate) rhs: &'a [f64],
    /// Variance of the angle's noise.
    pub(crate) noise: f64,
    pub(crate) fit: &'a Fit,
    pub(crate) covariance: &'a RowCovariance,
    pub(crate) correlated: &'a Arc<Correlated>,
    pub(crate) expected: Expected,
    /// The factor on all variances.
    pub(crate) inflation: f64,
    pub(crate) instructions: Instructions,
}

impl JudgedTerm<'_> {
    /// Adds one regressor to the constants and returns its coefficient with its standard error, or `None` if it is not determined.
    pub(crate) fn factor(&self, regressor: usize, stages: &mut Stages<'_, '_>) -> Result<Option<(f64, f64)>, Error> {
        Ok(self.factors(&[regressor], stages)?.and_then(|mut each| each.pop()))
    }

    /// The same of several regressors beside each other.
    pub(crate) fn factors(
        &self,
        regressors: &[usize],
        stages: &mut Stages<'_, '_>,
    ) -> Result<Option<Vec<(f64, f64)>>, Error> {
        Ok(self.factors_and_changes(regressors, stages)?.map(|(factors, _)| factors))
    }

    /// What rows tell of the last of several regressors beside each other, or `None` if it is not determined.
    pub(crate) fn in_rows(&self, regressors: &[usize], stages: &mut Stages<'_, '_>) -> Result<Option<InRows>, Error> {
        let Some((problem, fit)) = self.beside(regressors, stages)? else { return Ok(None) };
        let last = problem.layout.constant - 1;
        let by = fit.moved_by_rows(&problem, last..last + 1, stages)?.swap_remove(0);
        let (left, _) = residuals(&problem, &fit, stages)?;
        Ok(Some(InRows { by, left }))
    }

    /// The problem with regressors as further constants, which are the last, and its fit, or `None` if there are none or they are not determined.
    pub(crate) fn beside(
        &self,
        regressors: &[usize],
        stages: &mut Stages<'_, '_>,
    ) -> Result<Option<(Problem<'_>, Fit)>, Error> {
        if regressors.is_empty() {
            return Ok(None);
        }
        let mut model = self.model.clone();
        model.constant.extend(regressors);
        let problem = model.problem(self.rows, self.rhs, self.noise, Some(self.correlated));
        let fit = self.fit.again(&problem, self.expected, self.instructions, stages)?;
        Ok(fit.map(|fit| (problem, fit)))
    }

    /// The same, and what each constant of the model, and every regressor before the last, changes by with every unit of the last.
    pub(crate) fn factors_and_changes(
        &self,
        regressors: &[usize],
        stages: &mut Stages<'_, '_>,
    ) -> Result<Option<FactorsAndChanges>, Error> {
        let Some((problem, fit)) = self.beside(regressors, stages)? else { return Ok(None) };
        let (known, count) = (self.model.constant.len(), problem.layout.constant);
        let variances = fit.variances_of(&problem, known..count, self.covariance, stages)?;
        let values = fit.pooled.values[known..count].iter().zip(variances);
        let factors = values.map(|(&value, variance)| (value, (self.inflation * variance).sqrt())).collect();
        let with_last = &fit.pooled.inverse[(count - 1) * count..];
        let changes = with_last[..count - 1].iter().map(|with| with / with_last[count - 1]).collect();
        Ok(Some((factors, changes)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equation::rows::Regressor;
    use crate::regression::simulated::{model, random, rows, staged, white};

    const ROWS: usize = 800;
    const DEVIATION: f64 = 0.3;

    /// What a judge says of terms that are added to the fit of some rows, whose noise has a variance.
    fn judged<R>(rows: &Rows, variance: f64, judge: impl FnOnce(&JudgedTerm<'_>) -> R) -> R {
        let (model, covariance) = (model(), RowCovariance::by_distance(vec![variance]));
        let correlated = staged(|stages| model.correlated(rows, &covariance, stages));
        let problem = model.problem(rows, &rows.rhs, 0.0, Some(&correlated));
        let expected = white(variance);
        let fit = Fit::in_rows(&problem, 80, expected, Instructions::Scalar).expect("constants");
        judge(&JudgedTerm {
            rows,
            model: &model,
            rhs: &rows.rhs,
            noise: 0.0,
            fit: &fit,
            covariance: &covariance,
            correlated: &correlated,
            expected,
            inflation: 1.0,
            instructions: Instructions::Scalar,
        })
    }

    /// A regressor of these values, without a companion.
    fn column(value: Vec<f64>) -> Regressor {
        Regressor { companion: vec![0.0; ROWS], value, ..Regressor::default() }
    }

    /// The coefficients, over their standard errors and off the truth in standard errors, of a term that is missing and of one that is not.
    fn factors(true_value: f64) -> [(f64, f64); 2] {
        let mut rows = rows(ROWS, |time| [1.0 + 0.01 * time, 0.01], DEVIATION);
        for seed in [40, 41] {
            let value = random(seed, ROWS);
            if seed == 40 {
                rows.rhs.iter_mut().zip(&value).for_each(|(rhs, value)| *rhs += true_value * value);
            }
            rows.regressors.push(column(value));
        }
        judged(&rows, DEVIATION * DEVIATION, |judged| {
            [3, 4].map(|regressor| staged(|stages| judged.factor(regressor, stages)).expect("determined"))
        })
    }

    #[test]
    fn a_missing_term_is_found_with_its_coefficient_and_one_that_is_not_there_is_nothing() {
        for true_value in [0.0, 0.05, 0.5, -2.0] {
            let [(value, error), (nothing, other)] = factors(true_value);
            assert!((value - true_value).abs() < 4.0 * error, "{value} ± {error}");
            if true_value == 0.0 {
                assert!(nothing.abs() < 4.0 * other, "{nothing} ± {other}");
            }
            // White regressors of variance one, two of 80 rows taken up by each window.
            let expected = DEVIATION / (ROWS as f64 * 78.0 / 80.0).sqrt();
            assert!((error / expected - 1.0).abs() < 0.15, "{error}, {expected}");
        }
    }

    #[test]
    fn what_changes_with_the_last_regressor_is_told_of_those_before_it_too() {
        let mut rows = rows(ROWS, |time| [1.0 + 0.01 * time, 0.01], 0.0);
        // The second is half of the first, and something of its own.
        let (first, own) = (random(40, ROWS), random(41, ROWS));
        let second = first.iter().zip(&own).map(|(first, own)| 0.5 * first + own).collect();
        rows.regressors.extend([first, second].map(column));
        let (factors, changes) = judged(&rows, 1.0, |judged| {
            staged(|stages| judged.factors_and_changes(&[3, 4], stages)).expect("both are determined")
        });
        let constants = model().constant.len();
        assert_eq!((factors.len(), changes.len()), (2, constants + 1));
        // With every unit of the second the first goes back by half a unit, as far as 800 random rows tell.
        assert!((changes[constants] + 0.5).abs() < 4.0 / (ROWS as f64).sqrt(), "{changes:?}");
    }

    #[test]
    fn blocks_that_do_not_agree_on_a_coefficient_have_a_larger_error() {
        let block = ROWS / BLOCKS;
        for apart in [0.0, 0.5] {
            let mut rows = rows(ROWS, |_| [1.0, 0.0], DEVIATION);
            let value = random(40, ROWS);
            for (row, value) in value.iter().enumerate() {
                rows.rhs[row] += if row / block % 2 == 0 { apart * value } else { -apart * value };
            }
            rows.regressors.push(column(value));
            judged(&rows, DEVIATION * DEVIATION, |judged| {
                let (_, of_noise) = staged(|stages| judged.factor(3, stages)).expect("determined");
                let told = staged(|stages| judged.in_rows(&[3], stages)).expect("determined");
                // Each block has the same share, and 32 tell their scatter to an eighth.
                let expected = of_noise.hypot(apart / (BLOCKS as f64).sqrt());
                assert!((told.error_of_blocks() / expected - 1.0).abs() < 0.5, "{} {expected}", told.error_of_blocks());
                let shares = of_blocks(&told.by, &rows.regressors[3].value, block);
                assert!((shares * (BLOCKS as f64).sqrt() - 1.0).abs() < 0.5, "{shares}");
                let one = of_blocks(&told.by, &rows.regressors[3].value, ROWS);
                assert!((one - 1.0).abs() < 1e-9, "{one}");
            });
        }
    }

    #[test]
    fn a_term_is_suspected_from_five_standard_errors_on() {
        let suspect = |value, error| Suspect { missing: Missing::Lag, value, error };
        assert!(suspect(5.1, 1.0).is_conspicuous() && suspect(-5.1, 1.0).is_conspicuous());
        assert!(!suspect(4.9, 1.0).is_conspicuous() && !suspect(-4.9, 1.0).is_conspicuous());
        assert!(!suspect(f64::NAN, 1.0).is_conspicuous());
    }
}
