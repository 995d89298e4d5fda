//! By how much a test function and a window over few times blur what all trials share.
//!
//! A mean over times with some weights takes half of their variance times the second derivative off what changes. The second derivative is that of the
//! estimates, between times as far apart as the weights reach, where noise makes little of it.

use crate::error::Error;
use crate::identify::merged::decided::MergedFit;
use crate::identify::merged::session::MergedSession;
use crate::inference::window_averaging::Averages;
use crate::noise::median::median;
use crate::regression::window_length::Scale;

/// Times between which the second derivative is taken, in standard deviations of the weights.
const APART: f64 = 2.0;
/// Root mean squares of the growth from which on it is far steeper than usual.
const STEEP: f64 = 3.0;
/// Times at which it is known, at least.
const FEWEST: usize = 8;

/// The squared error of windowed elements over their mean squares, summed over them: of noise, and of blur.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SquaredErrors {
    pub(crate) noise: f64,
    pub(crate) blur: f64,
}

impl SquaredErrors {
    pub(crate) fn sum(self) -> f64 {
        self.noise + self.blur
    }
}

impl MergedSession<'_, '_, '_> {
    /// The mean squared blur of every windowed element; zero where windows are longer than a test function, whose errors hold what they bend.
    pub(crate) fn blur(&self, fitted: &MergedFit, averages: &Averages) -> Vec<f64> {
        let windowed = fitted.model.windowed.len();
        let Some(variance) = self.variance_of_weights(fitted) else { return vec![0.0; windowed] };
        let group = self.all.group;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "rows of a test function")]
        let apart = (APART * variance.sqrt()).round().max(1.0) as usize;
        let factor = variance / (2 * apart * apart) as f64;
        let of = |values: &Vec<f64>| {
            let values: Vec<f64> = values.chunks(group).map(|time| time[time.len() / 2]).collect();
            let blur = |time: usize| {
                let (first, last) = ((time - apart) * group, (time + apart + 1) * group);
                let is_told = |first: usize| self.all.rows.usable[first..first + group].contains(&true);
                if self.jumps_between(first, last) || !(first..last).step_by(group).all(is_told) {
                    return None;
                }
                let [before, here, after] = [time - apart, time, time + apart].map(|time| values[time]);
                let blur = factor * (before - 2.0 * here + after);
                Some(blur * blur).filter(|one| one.is_finite())
            };
            let blurs: Vec<f64> = (apart..values.len().saturating_sub(apart)).filter_map(blur).collect();
            if blurs.len() < FEWEST { 0.0 } else { blurs.iter().sum::<f64>() / blurs.len() as f64 }
        };
        averages.values.iter().map(of).collect()
    }

    /// The variance of the times that windows over few times take a mean over, in squared times: that of the test function, and of rows with equal weights.
    fn variance_of_weights(&self, fitted: &MergedFit) -> Option<f64> {
        let scale = fitted.fit.scale.filter(|scale| scale.is_across())?;
        let (times, stride) = ((scale.span() / self.all.group) as f64, self.all.function.stride() as f64);
        Some(self.all.function.variance() / (stride * stride) + (times * times - 1.0) / 12.0)
    }

    /// The squared error at every row of what is far steeper there than it usually is, as at a jump that was not found: no second derivative tells it, but
    /// it grows within a standard deviation of the weights by as much as it is off. Nothing of windows that are longer than a test function.
    pub(crate) fn steep(&self, fitted: &MergedFit, averages: &Averages) -> Vec<Vec<f64>> {
        let Some(variance) = self.variance_of_weights(fitted) else { return Vec::new() };
        let seconds = variance.sqrt() * self.all.group as f64 * self.all.rows.period;
        let of = |slopes: &Vec<f64>| {
            let growth = |slope: &f64| if slope.is_finite() { (slope * seconds).abs() } else { 0.0 };
            let usual =
                STEEP * (slopes.iter().map(|slope| growth(slope).powi(2)).sum::<f64>() / slopes.len() as f64).sqrt();
            slopes.iter().map(|slope| (growth(slope) - usual).max(0.0).powi(2)).collect()
        };
        averages.slopes.iter().map(of).collect()
    }

    /// Whether a jump lies between two rows.
    fn jumps_between(&self, first: usize, last: usize) -> bool {
        self.all.rows.jumps.iter().any(|jump| (first..last).contains(jump))
    }

    /// The squared errors of what is windowed.
    fn squared_errors(&mut self, fitted: &MergedFit) -> Result<SquaredErrors, Error> {
        let noise = self.noise_of_rows(fitted)?;
        let correlated = self.correlated_by(fitted, &noise)?;
        let averages = self.averages(fitted, &correlated, &noise)?;
        let blur = self.blur(fitted, &averages);
        let mean_square = |column: &[f64]| {
            let (sum, count) = column
                .iter()
                .filter(|one| one.is_finite())
                .fold((0.0, 0.0_f64), |(sum, count), one| (sum + one * one, count + 1.0));
            sum / count.max(1.0)
        };
        let mut all = SquaredErrors::default();
        for (place, blur) in blur.iter().enumerate() {
            let scale = mean_square(&averages.values[place]).max(f64::MIN_POSITIVE);
            let mut squares: Vec<f64> =
                averages.errors[place].iter().map(|error| error * error).filter(|one| one.is_finite()).collect();
            all.noise += noise.inflation * median(&mut squares).unwrap_or(0.0) / scale;
            all.blur += blur / scale;
        }
        Ok(all)
    }

    /// The same of windows over few times; nothing of longer ones.
    pub(crate) fn squared_errors_over_few_times(&mut self, fitted: &MergedFit) -> Result<Option<SquaredErrors>, Error> {
        if !fitted.fit.scale.is_some_and(Scale::is_across) {
            return Ok(None);
        }
        self.squared_errors(fitted).map(Some)
    }
}
