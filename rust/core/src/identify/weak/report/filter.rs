//! What a filter of one channel leaves beside the lag that stands for it.
//!
//! A channel that was low-passed is late by nearly the same time at all frequencies of the motion, so a lag `τ` of the torque explains most of what
//! the filter did. What is left begins with the torque's second and third derivative: `(1 + a₁s + a₂s² + …) e^{-τs}` undoes filter and lag, and is one
//! for a lag alone. So both derivatives are added to the equations, together with the rate, which corrects the lag. If they are not nothing, the
//! constants are wrong by no less than about what they change.
//!
//! A filter that is run forwards and backwards is late by nothing, and weakens fast motion all the same. Of a channel whose noise falls up to the highest
//! frequency the second derivative is asked without a lag: `1 + (ω/ω₀)^2n` undoes such a filter, which is convex as `ω²` is, and the rest is taken by inertia
//! and stiffness. Its sign says which channel it was.

use crate::equation::rows::Rows;
use crate::error::Error;
use crate::identify::weak::decided::Decided;
use crate::identify::weak::report::errors::Errors;
use crate::identify::weak::report::missing_terms::stretches_to_judge;
use crate::identify::weak::session::Session;
use crate::inference::missing_terms::CONSPICUOUS;
use crate::noise::low_passed::is_low_passed;
use crate::regression::fit::Fit;
use crate::regression::limits::NOISE_MODEL_FAILS;
use crate::regression::model::Model;
use crate::regression::problem::Problem;
use crate::regression::residuals::residuals;
use crate::regression::row_covariance::RowCovariance;
use crate::regression::subsample::{thinned_column, thinned_rows};
use crate::weak_form::weak_rows::{Record, TermSamples, WeakRows, rate_of};

/// Derivatives of the torque that are added: those that are judged come after the rate.
const DERIVATIVES: [TermSamples<'static>; 3] =
    [TermSamples::TorqueRate, TermSamples::TorqueCurvature, TermSamples::TorqueJerk];
const CURVATURE: usize = 1;
/// By what part the noise of the torque may be another one than that which derivatives are corrected for.
pub(crate) const UNSURE: f64 = 0.1;

/// A filter without a lag that changes no parameter by more than this part of it is not worth a word.
pub(crate) const LEAST_CHANGE: f64 = 1e-3;

/// A filter of one channel.
pub(crate) struct LeftOfFilter {
    /// By how much the constants, those that change slowly first, change beside derivatives of the torque.
    pub(crate) changes: Vec<f64>,
    /// Whether it is the torque's, and late.
    pub(crate) of_torque: bool,
    pub(crate) late: bool,
}

impl Session<'_, '_, '_> {
    /// What a lag, or none, leaves of a filter, or `None` where nothing speaks of one.
    pub(crate) fn left_of_filter(
        &mut self,
        weak: &WeakRows,
        decided: &Decided,
        fit: &Fit,
        errors: &Errors,
    ) -> Result<Option<LeftOfFilter>, Error> {
        // A mask is there because other equations hold elsewhere, and rows of the torque's derivatives reach out of it.
        if !self.options.diagnose || self.record.mask.is_some() {
            return Ok(None);
        }
        // Noise of an angle that was fused or integrated falls of itself, and equations that leave too much lack something else.
        let (late, record) = (self.record.lag != 0.0, &self.record);
        let may_be = !late && record.noise.is_none() && errors.error <= NOISE_MODEL_FAILS;
        let low_passed = [record.angle, record.torque].map(|channel| may_be && is_low_passed(channel));
        if !late && low_passed == [false; 2] {
            return Ok(None);
        }
        let stretches = stretches_to_judge(weak, decided, fit);
        let mut rhs = decided.rhs(&weak.rows).to_vec();
        let mut rows = weak.rows.clone();
        if let Some(stretches) = &stretches {
            (rows, rhs) = (thinned_rows(&rows, stretches), thinned_column(&rhs, stretches));
        }
        let (terms, constant) = (DERIVATIVES.to_vec(), [true; 3]);
        let record = Record { terms, constant, constant_terms: true, ..self.record.clone() };
        let (function, delta, workers) = (weak.function, self.options.delta, self.stages.workers);
        let stretches = stretches.as_deref();
        let more = self.stages.stage(|watch| WeakRows::build(&record, function, delta, stretches, workers, watch))?;
        let first = rows.regressors.len();
        rows.regressors.extend(more.rows.regressors.into_iter().skip(3));
        rows.clear_unusable();
        // Rows as they are, also where equations were weighted by their noise.
        // The noise of a torque that was low-passed alone is less where its derivatives have most of theirs; what equations show beyond the channel's is there.
        let highest = self.highest_noise.min(self.channel_noise[1]);
        let is_shown = self.noise[1] > self.channel_noise[1];
        let noise = [self.noise[0], if is_shown { self.noise[1] } else { highest.min(self.noise[1]) }];
        let (known, expected) = Self::covariance_of_noise(noise, weak, self.parameters(&decided.model, fit));
        // What changes slowly was taken off the right-hand side; a constant beside it is what it may be wrong by.
        let (model, instructions) = (decided.ordered(), self.options.instructions);
        let problem = model.problem(&rows, &rhs, self.noise[0], None);
        let before = fit.again(&problem, expected, instructions, &mut self.stages)?;
        add_noise_of_torque(&mut rows, weak, first, [self.noise[0], highest]);
        let constant = model.constant.iter().copied().chain(first..first + DERIVATIVES.len()).collect();
        let model = Model { constant, ..model };
        let problem = model.problem(&rows, &rhs, 1.0, None);
        let beside = fit.again(&problem, expected, instructions, &mut self.stages)?;
        let (Some(before), Some(beside)) = (before, beside) else { return Ok(None) };
        // What is left beside the derivatives is noise, whatever was left without them.
        let (left, usable) = residuals(&problem, &beside, &mut self.stages)?;
        let shown = RowCovariance::of_residuals(&left, &usable, 4 * weak.reach());
        let variance = shown.variance();
        let covariance = if variance > known.variance() { shown } else { known };
        let problem = Problem { correlated: Some(model.correlated(&rows, &covariance, &mut self.stages)?), ..problem };
        let count = before.pooled.values.len();
        let mut is_left = false;
        let judged = if late { CURVATURE..DERIVATIVES.len() } else { CURVATURE..CURVATURE + 1 };
        for derivative in judged {
            let place = count + derivative;
            let variance = beside.variance_of(&problem, place, &covariance, &mut self.stages)?;
            let mut most = CONSPICUOUS * variance.sqrt();
            if derivative == CURVATURE {
                let alone = beside.variance_of(&problem, place, &RowCovariance::white(), &mut self.stages)?;
                most += UNSURE
                    * shared_noise(weak, expected.torque.min(covariance.variance()))
                    * problem.rows() as f64
                    * alone;
            }
            is_left |= beside.pooled.values[place].abs() > most;
        }
        let change = |(beside, before): (&f64, &f64)| beside - before;
        let changes = || beside.pooled.values.iter().zip(&before.pooled.values).map(change).collect();
        let of_torque = if late { self.record.lag > 0.0 } else { beside.pooled.values[count + CURVATURE] > 0.0 };
        // What is said of a channel must be seen in it, too.
        is_left &= late || low_passed[usize::from(of_torque)];
        Ok(is_left.then(|| LeftOfFilter { changes: changes(), of_torque, late }))
    }
}

/// Lists the torque's noise after that of the angle wherever it enters, so that estimates are corrected for both, whose variances are part of it then:
/// derivatives from some regressor on have more of it than motion where test functions are narrow.
fn add_noise_of_torque(rows: &mut Rows, weak: &WeakRows, first: usize, noise: [f64; 2]) {
    let [of_angle, of_torque] = noise.map(f64::sqrt);
    let kernels = rows.regressors.iter().flat_map(|regressor| &regressor.noise).chain([&rows.rhs_noise]);
    let length = kernels.map(Vec::len).max().unwrap_or(0);
    let [curvature, rate, value] = &weak.kernels.values;
    let jerk = rate_of(curvature, weak.function.delta());
    let scaled = |kernel: &mut Vec<f64>| kernel.iter_mut().for_each(|value| *value *= of_angle);
    let add = |kernel: &mut Vec<f64>, torque: &[f64]| {
        kernel.resize(length, 0.0);
        kernel.extend(torque.iter().map(|value| of_torque * value));
    };
    rows.regressors.iter_mut().flat_map(|regressor| &mut regressor.noise).for_each(scaled);
    scaled(&mut rows.rhs_noise);
    add(&mut rows.rhs_noise, value);
    for (regressor, kernel) in rows.regressors[first..].iter_mut().zip([rate, curvature, &jerk]) {
        add(&mut regressor.noise[0], kernel);
    }
}

/// The covariance of the noise of a row with that of the torque's second derivative, whose size it has: of the rate and the third derivative it is none.
pub(crate) fn shared_noise(weak: &WeakRows, torque: f64) -> f64 {
    let square = |kernel: &[f64]| kernel.iter().map(|value| value * value).sum::<f64>();
    let [_, rate, value] = &weak.kernels.values;
    torque * square(rate) / square(value)
}
