//! The decisions made for a record, and the fit that they rest on.

use std::sync::Arc;

use crate::equation::rows::Rows;
use crate::error::Error;
use crate::exec::stages::Stages;
use crate::identify::weak::angle_zero::spring::SpringColumn;
use crate::inference::constancy::{NO_CHANCE, Test};
use crate::inference::jumps::jump::Jump;
use crate::inference::largest_square::MOST;
use crate::inference::slowly_varying;
use crate::regression::constants::Expected;
use crate::regression::fit::Fit;
use crate::regression::limits::NOISE_MODEL_FAILS;
use crate::regression::model::Model;
use crate::regression::problem::{Correlated, Problem};
use crate::regression::row_covariance::RowCovariance;
use crate::regression::whitening::Whitening;
use crate::regression::window_length::Scale;
use crate::weak_form::weak_rows::WeakRows;

/// What was decided, and the fit it rests on.
#[derive(Clone)]
pub(crate) struct Decided {
    /// What is windowed and what is constant.
    pub(crate) model: Model,
    /// Constants that turned out to change.
    pub(crate) slow: Vec<usize>,
    pub(crate) found: Option<slowly_varying::SlowCoefficients>,
    /// `None` if the constants are not determined.
    pub(crate) fit: Option<Fit>,
    /// Whether the fit is one of the rows that compared windows: enough to tell which are best, and how well they predict.
    pub(crate) is_sketch: bool,
    /// The length of windows that predicts best while nothing varies slowly. The search for what varies begins there: windows that were chosen while
    /// too little was free are so short that nothing else is found from them.
    pub(crate) first: Option<Scale>,
    /// Rows of parts so short that they do not hide how much varies: windows beside which it is sought are no longer.
    pub(crate) longest: Option<usize>,
    /// Samples of the windows near which lengths were compared, where not all were.
    pub(crate) near: Option<usize>,
    /// Mean squared error of predicting a row from others, over the noise's.
    pub(crate) error: f64,
    pub(crate) tests: Vec<(usize, Test)>,
    /// Lengths that were tried, in samples, and the error of each.
    pub(crate) lengths: Vec<(usize, f64)>,
    pub(crate) scales: Vec<Scale>,
    pub(crate) covariance: RowCovariance,
    /// What it makes of the windowed regressors, once a fit was made with it.
    pub(crate) correlated: Option<Arc<Correlated>>,
    pub(crate) expected: Expected,
    /// Whether it is known where constants jump.
    pub(crate) constants_jump: bool,
    /// Jumps of windowed coefficients and of constants.
    pub(crate) jumps: Vec<Jump>,
    /// Samples by which the torque may be later or earlier than it is taken to be, beyond what the equations tell: a search for its lag did not settle.
    pub(crate) untold_lag: f64,
    /// All rows, also those over jumps; nothing without jumps.
    pub(crate) whole: Option<Rows>,
    /// The stiffness as a regressor, which is the last of the constants, where the spring's zero is sought.
    pub(crate) spring: Option<SpringColumn>,
    /// Rows whose noise is white, and how they were made so, where the constants were taken from them.
    pub(crate) white: Option<(Rows, Whitening)>,
}

/// How many rows lie in so many samples.
pub(crate) fn rows_of(samples: usize, stride: usize) -> usize {
    ((samples + stride / 2) / stride).max(1)
}

impl Decided {
    /// Whether its windows are the shortest of those that were tried.
    pub(crate) fn has_shortest_windows(&self) -> bool {
        let scale = self.fit.as_ref().and_then(|fit| fit.scale);
        self.scales.len() > 1 && scale.is_some() && self.scales.first().copied() == scale
    }

    /// Whether its windows are hardly longer than the test function of the rows: they follow anything as if it were motion.
    pub(crate) fn has_windows_of_a_function(&self, weak: &WeakRows) -> bool {
        self.fit.as_ref().is_some_and(|fit| fit.scale.is_some() && weak.follow_anything(fit.span))
    }

    /// Whether parts of the record have other values of a constant than noise explains.
    pub(crate) fn differs(&self, unknown: usize) -> bool {
        self.tests.iter().any(|(one, test)| *one == unknown && test.probability < NO_CHANCE)
    }

    /// Whether constants seem to vary and windows are the shortest of those that were tried.
    pub(crate) fn follows_anything(&self) -> bool {
        !self.slow.is_empty() && self.has_shortest_windows()
    }

    /// Whether rows are predicted so badly that hardly one is within the noise.
    pub(crate) fn is_lost(&self) -> bool {
        self.error >= NOISE_MODEL_FAILS
    }

    /// What tests multiply the variance of the noise by: predictions leave as much, but beyond a limit what is missing from the equation would hide what
    /// differs.
    pub(crate) fn inflation(&self) -> f64 {
        if self.error.is_nan() { 1.0 } else { self.error.clamp(1.0, MOST) }
    }

    /// The rows that the fit was made with.
    pub(crate) fn rows<'a>(&'a self, rows: &'a Rows) -> &'a Rows {
        self.white.as_ref().map_or(rows, |(white, _)| white)
    }

    /// Other rows of the record, made as white as those that the fit was made with.
    pub(crate) fn as_white(&self, rows: Rows, stages: &mut Stages<'_, '_>) -> Result<Rows, Error> {
        match &self.white {
            Some((_, whitening)) => whitening.apply(&rows, stages),
            None => Ok(rows),
        }
    }

    /// The right-hand side without what varies slowly.
    pub(crate) fn rhs<'a>(&'a self, rows: &'a Rows) -> &'a [f64] {
        self.found.as_ref().map_or(&rows.rhs, |found| &found.rhs)
    }

    /// The equations for what does not change slowly. `noise` is the variance of the angle's.
    pub(crate) fn problem<'a>(&'a self, rows: &'a Rows, noise: f64) -> Problem<'a> {
        self.model.problem(rows, self.rhs(rows), noise, self.correlated.as_ref())
    }

    /// The model with what varies slowly before the other constants.
    pub(crate) fn ordered(&self) -> Model {
        let constant = self.slow.iter().chain(&self.model.constant).copied().collect();
        Model { constant, ..self.model.clone() }
    }
}
