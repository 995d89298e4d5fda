//! Tests for terms that are missing from the equation of motion: friction, an offset, a hardening spring, a lag of the
//! torque.
//!
//! Each term is added to the constants on its own and judged by its standard error (similar to a score test).

use std::sync::Arc;

use crate::equation::rows::Rows;
use crate::equation::terms::BuiltInTerm;
use crate::error::Error;
use crate::exec::stages::Stages;
use crate::record::derived::Mapped;
use crate::record::samples::Samples;
use crate::regression::constants::Expected;
use crate::regression::fit::Fit;
use crate::regression::layout::Layout;
use crate::regression::model::Model;
use crate::regression::problem::Correlated;
use crate::regression::row_covariance::RowCovariance;
use crate::simd::instructions::Instructions;

/// A term is suspected if its coefficient exceeds its standard error so many times.
const CONSPICUOUS: f64 = 5.0;

/// A term that may be missing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Missing {
    /// A built-in term.
    Term(&'static BuiltInTerm),
    /// The torque lags behind.
    Lag,
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
        }
    }

    /// The samples of a term, `None` if they are one everywhere or it is none.
    pub(crate) fn samples<'a>(self, angle: &'a dyn Samples, velocity: &'a dyn Samples) -> Option<Mapped<'a>> {
        match self {
            Self::Term(term) => term.function.samples(angle, velocity),
            Self::Lag => None,
        }
    }
}

impl Suspect {
    /// Whether it is significant.
    #[must_use]
    pub fn is_conspicuous(&self) -> bool {
        self.value.abs() > CONSPICUOUS * self.error
    }
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
        let mut model = self.model.clone();
        model.constant.push(regressor);
        let problem = model.problem(self.rows, self.rhs, self.noise, Some(self.correlated));
        let fit = self.fit.again(&problem, self.expected, self.instructions, stages)?;
        let Some(fit) = fit else { return Ok(None) };
        let Layout { constant, .. } = problem.layout;
        let variances = fit.covariance(&problem, self.covariance, stages)?;
        let variance = self.inflation * variances[constant * constant - 1];
        Ok(Some((fit.pooled.values[constant - 1], variance.sqrt())))
    }
}
