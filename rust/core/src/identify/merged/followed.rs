//! Narrower test functions, where windows hardly longer than one follow too slowly what all trials share, or the function itself blurs it.
//!
//! The test function is chosen as if nothing changed: for the spectrum of the angles and the noise. A window holds a test function on either side of what it
//! predicts, so none follows what changes faster. What it leaves then is the same change in all trials, which noise is not.

use std::f64::consts::SQRT_2;

use crate::error::Error;
use crate::identify::merged::decided::MergedFit;
use crate::identify::merged::session::MergedSession;
use crate::identify::weak::shown_noise::MORE;
use crate::weak_form::test_function::{LEAST_HALF_WIDTH, TestFunction};

/// Mean squared error of predicting a row, over the noise's, up to which the shortest windows follow.
pub(crate) const FOLLOWS: f64 = 1.1;
/// A narrower test function is taken only if rows are predicted so much better.
const BETTER: f64 = 0.95;
/// What is left along a windowed element, over what is left across it, from which on all trials have it in common.
const IN_COMMON: f64 = 2.0;

impl MergedSession<'_, '_, '_> {
    /// The same decisions with a test function that is narrow enough to follow what changes, as long as each predicts much better than the last.
    pub(crate) fn follow(&mut self, mut fitted: MergedFit) -> Result<MergedFit, Error> {
        if self.options.window_length.is_some() || self.options.regression_window.is_some() {
            return Ok(fitted);
        }
        loop {
            let is_slow = fitted.has_shortest_windows() && fitted.error > FOLLOWS && self.is_in_common(&fitted)?;
            let errors = self.squared_errors_over_few_times(&fitted)?;
            let is_blurred = errors.is_some_and(|errors| errors.blur > errors.noise);
            if !is_slow && !is_blurred {
                break;
            }
            let function = self.all.function;
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a half-width is positive")]
            let half_width = (function.half_width() as f64 / SQRT_2).round() as usize;
            if half_width < LEAST_HALF_WIDTH {
                break;
            }
            let before = self.state();
            self.jumps.clear();
            self.build(TestFunction::new(half_width, function.exponent(), self.options.delta)?)?;
            self.pilot()?;
            let mut again = self.settle(&self.model())?;
            if let Some(tried) = again.take() {
                // Narrow functions let more noise through, in which what windows do not follow is lost.
                let is_better = match errors {
                    Some(errors) => {
                        let of_tried = self.squared_errors_over_few_times(&tried)?;
                        of_tried.is_some_and(|of_tried| of_tried.sum() < errors.sum())
                    }
                    None => tried.error < BETTER * fitted.error,
                };
                again = is_better.then_some(tried);
            }
            let Some(again) = again else {
                self.restore(before)?;
                break;
            };
            (fitted, self.at_end) = (again, self.all.function.half_width() == LEAST_HALF_WIDTH);
        }
        Ok(fitted)
    }

    /// Whether windows leave far more than noise, and that is the same in all trials at one time, along what they follow.
    pub(crate) fn changes_in_common(&mut self, fitted: &MergedFit) -> Result<bool, Error> {
        Ok(fitted.error > MORE && self.is_in_common(fitted)?)
    }

    /// Whether what windows leave is the same in all trials at one time.
    fn is_in_common(&mut self, fitted: &MergedFit) -> Result<bool, Error> {
        if fitted.model.windowed.is_empty() || self.merged.trials.len() < 2 {
            return Ok(false);
        }
        let (left, _) = self.left_of(fitted)?;
        Ok(self.left_in_common(fitted, &left) >= IN_COMMON)
    }
}
