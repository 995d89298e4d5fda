//! The covariance of what is left of merged rows, where it is more than the noise of the channels makes.
//!
//! The noise of a channel is read at the highest frequencies. That of a torque may be much stronger where the motion is: errors and tests
//! that rest on the channels' noise alone would take what it does for knowledge, and for a change. So they rest on what is left then, by
//! equation: every torque has another noise.

use std::sync::Arc;

use crate::equation::rows::Rows;
use crate::error::Error;
use crate::identify::merged::decided::MergedFit;
use crate::identify::merged::session::MergedSession;
use crate::identify::weak::shown_noise::{MORE, REACHES};
use crate::inference::missing_terms::JudgedTerm;
use crate::inference::part_constants::NoiseFrom;
use crate::regression::constants::Expected;
use crate::regression::limits::NOISE_MODEL_FAILS;
use crate::regression::problem::Correlated;
use crate::regression::residuals::residuals;
use crate::regression::row_covariance::RowCovariance;
use crate::simd::instructions::Instructions;

/// Where equations leave more than the noise of the channels and that may be noise, what windows follow must pay by more than chance.
pub(crate) const SHOWN: f64 = 0.8;

/// The noise that errors and tests of constants rest on.
pub(crate) struct NoiseOfRows {
    pub(crate) covariance: RowCovariance,
    pub(crate) expected: Expected,
    /// What variances are multiplied by.
    pub(crate) inflation: f64,
    pub(crate) from: NoiseFrom,
}

impl NoiseOfRows {
    /// The noise of the channels.
    pub(crate) fn of_channels(fitted: &MergedFit) -> Self {
        Self {
            covariance: fitted.covariance.clone(),
            expected: fitted.expected,
            inflation: fitted.error.max(1.0),
            from: NoiseFrom::Channels,
        }
    }

    /// What judges regressors that rows have beside those of a fit, by this noise.
    pub(crate) fn judged<'a>(
        &'a self,
        rows: &'a Rows,
        fitted: &'a MergedFit,
        correlated: &'a Arc<Correlated>,
        instructions: Instructions,
    ) -> JudgedTerm<'a> {
        JudgedTerm {
            rows,
            model: &fitted.model,
            rhs: &rows.rhs,
            noise: 1.0,
            fit: &fitted.fit,
            covariance: &self.covariance,
            correlated,
            expected: self.expected,
            inflation: self.inflation,
            instructions,
        }
    }
}

impl MergedSession<'_, '_, '_> {
    /// What a fit leaves of the rows, and which of them say something.
    pub(crate) fn left_of(&mut self, fitted: &MergedFit) -> Result<(Vec<f64>, Vec<bool>), Error> {
        let rows = &self.all.rows;
        let problem = fitted.model.problem(rows, &rows.rhs, 1.0, None);
        residuals(&problem, &fitted.fit, &mut self.stages)
    }

    /// The noise of the channels, or what is left where that is more.
    pub(crate) fn noise_of_rows(&mut self, fitted: &MergedFit) -> Result<NoiseOfRows, Error> {
        let known = NoiseOfRows::of_channels(fitted);
        if fitted.error <= MORE || fitted.misfit > NOISE_MODEL_FAILS {
            return Ok(known);
        }
        let (left, usable) = self.left_of(fitted)?;
        let shown = self.covariance_of(&left, &usable);
        // Windows take a part of the noise for what they follow, which rows that they do not hold show.
        let variance = shown.variance().max(fitted.error * fitted.expected.variance);
        if shown.variance().is_nan() || shown.variance() <= 0.0 {
            return Ok(known);
        }
        let covariance = shown.with_variance(variance);
        let expected = Expected::new(&covariance, variance);
        Ok(NoiseOfRows { covariance, expected, inflation: 1.0, from: NoiseFrom::Equations })
    }

    /// The covariance of what is left of the rows of each equation with those that come later of the same trial, tapered to stay positive
    /// semidefinite.
    fn covariance_of(&self, left: &[f64], usable: &[bool]) -> RowCovariance {
        let (equations, group) = (self.merged.equations(), self.all.group);
        let times = REACHES * self.all.reach() / group + 1;
        let left: Vec<f64> = left.iter().zip(usable).map(|(left, usable)| if *usable { *left } else { 0.0 }).collect();
        let distances = (times - 1) * group + equations;
        let mut lags = vec![0.0; distances * equations];
        for time in 0..times {
            let taper = 1.0 - time as f64 / times as f64;
            for one in 0..equations {
                for other in 0..equations {
                    let lag = (time * group + other).checked_sub(one).filter(|_| time > 0 || other >= one);
                    let Some(lag) = lag.filter(|lag| *lag < left.len()) else { continue };
                    let early = (one..left.len() - lag).step_by(equations);
                    let pairs = early.filter(|&row| usable[row] && usable[row + lag]);
                    let (sum, count) = pairs.fold((0.0, 0.0), |(sum, count): (f64, f64), row| {
                        (sum + left[row] * left[row + lag], count + 1.0)
                    });
                    lags[lag * equations + one] = taper * sum / count.max(1.0);
                }
            }
        }
        RowCovariance::of_equations(equations, distances, |lag, one| lags[lag * equations + one])
    }
}
