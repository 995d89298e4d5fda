//! Standard errors: from the noise of the channels, or from the residuals where the equations show more than that.

use crate::equation::rows::Rows;
use crate::error::Error;
use crate::identify::weak::decided::Decided;
use crate::identify::weak::session::Session;
use crate::regression::constants::Expected;
use crate::regression::fit::Fit;
use crate::regression::limits::{LITTLE, NEGLIGIBLE, NOISE_MODEL_FAILS, UNEXPLAINED, left_by_short_windows};
use crate::regression::row_covariance::RowCovariance;
use crate::status::Status;
use crate::weak_form::weak_rows::WeakRows;

/// By how much more noise than that of the channels equations must have been chosen with: the noise of another part of a recording, whose
/// settings are given, differs by less.
const RAISED: f64 = 1.5;

/// How errors are made.
pub(crate) struct Errors {
    pub(crate) covariance: RowCovariance,
    pub(crate) expected: Expected,
    /// What variances are multiplied by.
    pub(crate) inflation: f64,
    /// Mean squared error of predicting rows, or of what is left of them where nothing is windowed, over the noise's variance.
    pub(crate) error: f64,
    /// The same over the variance of the noise that the channels show by themselves.
    pub(crate) over_channels: f64,
    /// Variance of what is left of the rows.
    pub(crate) left: f64,
    /// What is wrong with the noise.
    pub(crate) status: Status,
}

impl Errors {
    /// Whether next to nothing is left of the right-hand side of some rows.
    pub(crate) fn is_explained(&self, rows: &Rows) -> bool {
        self.left <= NEGLIGIBLE * rows.mean_square()
    }
}

impl Session<'_, '_, '_> {
    /// The covariance that errors are made from: that of the channels' noise, or where it fails to explain the residuals, theirs.
    pub(crate) fn errors(&mut self, weak: &WeakRows, decided: &Decided, fit: &Fit) -> Result<Errors, Error> {
        let mut errors = Errors {
            covariance: decided.covariance.clone(),
            expected: decided.expected,
            inflation: decided.error.max(1.0),
            error: decided.error,
            over_channels: decided.error,
            left: f64::NAN,
            status: Status::GOOD,
        };
        let (shown, coloured) = self.shown(weak, decided, fit)?;
        errors.left = shown.variance();
        let whole = decided.model.windowed.is_empty();
        errors.error = if whole { shown.variance() / errors.expected.variance } else { decided.error };
        if whole {
            errors.inflation = errors.error.max(1.0);
        }
        let fails = errors.error > NOISE_MODEL_FAILS;
        let raised = self.raised(weak, decided);
        let matters = errors.left > UNEXPLAINED * weak.rows.mean_square();
        errors.over_channels = errors.error * raised;
        if coloured && errors.left > self.left_beside_motion(weak, decided, fit) {
            errors.status |= Status::COLOURED;
        }
        if fails && !errors.is_explained(&weak.rows) || matters && errors.over_channels > NOISE_MODEL_FAILS {
            errors.status |= Status::NOISE_MODEL;
        }
        if fails || raised > RAISED {
            // Coloured noise is stronger where the motion is, of which windows take a part for what they follow: what they leave of rows that
            // they do not hold has all of it.
            let unseen = self.shown_unseen(weak, decided)?.filter(|unseen| unseen.variance() > 0.0);
            let unseen = unseen.unwrap_or_else(|| shown.clone());
            let least = if fails { 0.0 } else { errors.covariance.variance() };
            let variance = unseen.variance().max(shown.variance()).max(least);
            errors.covariance = unseen.with_variance(variance);
        }
        if fails {
            errors.inflation = 1.0;
            errors.expected = Expected::new(&errors.covariance, errors.covariance.variance());
        }
        Ok(errors)
    }

    /// What may be left and be correlated, as a mean square: next to nothing of the largest torque, and little of the one that was recorded. Near a
    /// resonance the torques of spring and mass are far larger than the drive's: a part of them that no window follows is more of the drive's. Beside the
    /// shortest windows it may be more: there are none that follow it.
    fn left_beside_motion(&self, weak: &WeakRows, decided: &Decided, fit: &Fit) -> f64 {
        let recorded = weak.rows.mean_square();
        let largest = weak.largest_torque(self.parameters(&decided.model, fit), self.noise[0]);
        let most = (NEGLIGIBLE * largest).min(LITTLE * recorded);
        if decided.has_windows_of_a_function(weak) { most.max(left_by_short_windows(recorded, largest)) } else { most }
    }
}
