//! Tests of what the torque itself tells: is its sensor linear, and is the machine between both sensors rigid?
//!
//! A sensor that shows `T + aT² + bT³`, and a coupling that bends, whose resonance `ω₀` is above the motion and leaves `T + T″/ω₀²` at most, change
//! parameters by what they add to the torque, which windows and residuals hardly show. Their factors are asked beside everything else that may be missing,
//! all at once.

use std::ops::Range;

use crate::error::Error;
use crate::identify::scanned::OTHER_CONSTANT;
use crate::identify::weak::decided::Decided;
use crate::identify::weak::report::filter::{UNSURE, shared_noise};
use crate::identify::weak::report::missing_terms::step_rows;
use crate::identify::weak::session::Session;
use crate::inference::missing_terms::{InRows, Missing, Suspect};
use crate::regression::fit::Fit;
use crate::regression::limits::{NEGLIGIBLE, NOISE_MODEL_FAILS};
use crate::regression::model::Model;
use crate::regression::problem::Problem;
use crate::regression::residuals::residuals;
use crate::regression::row_covariance::RowCovariance;
use crate::weak_form::weak_rows::WeakRows;

/// The least part of the torque's mean square that powers of it must have to be said: half a percent of the torque. Rounding of an angle beside a
/// torque without noise is seen as a quarter of a percent.
const LEAST_OF_POWERS: f64 = 2.5e-5;

/// How many times as large a term that is missing is in the torque for what the torque tells of itself to be no more than what that term is not exactly, in
/// mean squares: ten times.
const FAR_LARGER: f64 = 100.0;

/// From how many times the half-width on another test function is asked, and by how much narrower than that the next is.
const WIDER: usize = 2;

impl Session<'_, '_, '_> {
    /// What the torque tells beside all that may be missing, whose regressors are some of the rows'; the fit comes with its right-hand side and its error
    /// of prediction. Where the test function was made narrower than those that agree with it, the widest of these whose equations hold contradicts what
    /// it tells: noise is less there, and windows are longer.
    pub(crate) fn of_torque(
        &mut self,
        weak: &WeakRows,
        decided: &Decided,
        fitted: (&Fit, &[f64], f64),
        regressors: Range<usize>,
        candidates: &[Missing],
    ) -> Result<Vec<Suspect>, Error> {
        let told = self.of_torque_in(weak, decided, fitted, (regressors, candidates), &[])?;
        let mut suspects: Vec<_> = told.into_iter().flatten().map(|(suspect, _)| suspect).collect();
        let doubted: Vec<_> = suspects.iter().filter(|one| one.is_conspicuous()).map(|one| one.missing).collect();
        if !self.scan.moved || !decided.jumps.is_empty() || doubted.is_empty() {
            return Ok(suspects);
        }
        let (mut width, mut others) = (self.scan.widest().unwrap_or(0), None);
        while others.is_none() && width >= WIDER * weak.function.half_width() {
            // Beside a torque without noise the widest leave what windows do not follow: that tells nothing.
            others = self.of_torque_with(width, decided, candidates, &doubted)?;
            width /= WIDER;
        }
        for (other, is_little) in others.into_iter().flatten() {
            let is_other =
                |one: &Suspect| (one.value - other.value).abs() > OTHER_CONSTANT * one.error.hypot(other.error);
            let place = suspects.iter().position(|one| one.missing == other.missing && is_other(one));
            match place {
                Some(place) if is_little => drop(suspects.remove(place)),
                Some(place) => suspects[place] = other,
                None => {}
            }
        }
        Ok(suspects)
    }

    /// What is doubted, with a test function of another half-width.
    fn of_torque_with(
        &mut self,
        half_width: usize,
        decided: &Decided,
        candidates: &[Missing],
        doubted: &[Missing],
    ) -> Result<Option<Vec<(Suspect, bool)>>, Error> {
        let mut model = decided.ordered();
        // The column of the spring's zero is one of the other function's rows.
        model.constant.retain(|&one| one < 3 + self.record.terms.len());
        let mut wide = self.chosen_with(half_width, &model)?;
        let fitted = self.fit_first(&wide, &model)?;
        let Some(fit) = &fitted.fit else { return Ok(None) };
        let more = self.regressors_of(candidates, &wide.weak, None)?;
        let rows = &mut wide.weak.rows;
        let first = rows.regressors.len();
        rows.regressors.extend(more);
        rows.clear_unusable();
        let (rhs, regressors) = (rows.rhs.clone(), first..rows.regressors.len());
        self.of_torque_in(&wide.weak, &fitted, (fit, &rhs, fitted.error), (regressors, candidates), doubted)
    }

    /// The same with the test function of these rows, and whether each is too little to be said: of what is doubted, or of what is not too little. `None`
    /// where equations leave too much beside all of these.
    fn of_torque_in(
        &mut self,
        weak: &WeakRows,
        decided: &Decided,
        (fit, rhs, error): (&Fit, &[f64], f64),
        (regressors, candidates): (Range<usize>, &[Missing]),
        doubted: &[Missing],
    ) -> Result<Option<Vec<(Suspect, bool)>>, Error> {
        let rows = &weak.rows;
        let (known, expected) = self.covariance(weak, self.parameters(&decided.model, fit));
        let model = decided.ordered();
        let count = model.constant.len();
        let model = Model { constant: model.constant.iter().copied().chain(regressors.clone()).collect(), ..model };
        let problem = model.problem(rows, rhs, self.noise[0], None);
        let Some(beside) = fit.again(&problem, expected, self.options.instructions, &mut self.stages)? else {
            return Ok(None);
        };
        let (left, usable) = residuals(&problem, &beside, &mut self.stages)?;
        let shown = RowCovariance::of_residuals(&left, &usable, 4 * weak.reach());
        if error.min(shown.variance() / known.variance()) > NOISE_MODEL_FAILS {
            // They lack something else.
            return Ok(None);
        }
        let covariance = if shown.variance() > known.variance() { shown } else { known };
        let problem = Problem { correlated: Some(model.correlated(rows, &covariance, &mut self.stages)?), ..problem };
        let noise = expected.torque.min(covariance.variance());
        let shared = shared(weak, &regressors, candidates, (noise, self.torque_zero()));
        let lag = candidates.iter().position(|&one| one == Missing::Lag);
        let steps = step_rows(weak, (candidates, regressors.start), decided);
        let mut suspects = Vec::new();
        for (place, &missing) in candidates.iter().enumerate().filter(|(_, missing)| missing.is_of_torque()) {
            let value = beside.pooled.values[count + place];
            let least = if missing == Missing::Resonance { NEGLIGIBLE } else { LEAST_OF_POWERS };
            let is_little = value * value * rows.mean_square_of(regressors.start + place) < least * rows.mean_square();
            let is_asked = if doubted.is_empty() { !is_little } else { doubted.contains(&missing) };
            if !is_asked {
                continue;
            }
            let variance = beside.variance_of(&problem, count + place, &covariance, &mut self.stages)?;
            let mut suspect = Suspect { missing, value, error: variance.sqrt() };
            if suspect.is_conspicuous() {
                let mut by = beside.moved_by_rows(&problem, count + place..count + place + 1, &mut self.stages)?;
                let told = InRows { by: by.swap_remove(0), left: left.clone() };
                let spread = if missing == Missing::Resonance { self.spread_of_steps() } else { 0.0 };
                suspect.error =
                    suspect.error.max(told.error_of_blocks()).hypot(self.by_steps(&told.by, steps)) + spread;
            }
            if suspect.is_conspicuous() {
                // The torque's noise is in both sides.
                let white = beside.covariance(&problem, &RowCovariance::white(), &mut self.stages)?;
                let row = &white[(count + place) * problem.layout.constant + count..][..candidates.len()];
                let by_noise = rows.len() as f64 * row.iter().zip(&shared).map(|(one, other)| one * other).sum::<f64>();
                suspect.value -= by_noise;
                // The cube of a torque of two levels differs from it by its noise alone, and no noise is known so well.
                suspect.error += by_noise.abs() * if missing == Missing::Resonance { UNSURE } else { 1.0 };
                if let (Missing::Resonance, Some(lag)) = (missing, lag) {
                    // A torque that is late has half its lag's square of the second derivative.
                    let variance = beside.variance_of(&problem, count + lag, &covariance, &mut self.stages)?;
                    let lag = beside.pooled.values[count + lag];
                    suspect.value += lag * lag / 2.0;
                    suspect.error += lag.abs() * variance.sqrt();
                }
            }
            suspects.push((place, suspect, is_little));
        }
        if suspects.iter().any(|(_, one, _)| one.is_conspicuous()) {
            // A friction or a spring that is missing comes first: beside what it is not exactly all else is judged once it is in the equation.
            let size = |place: usize, value: f64| value * value * rows.mean_square_of(regressors.start + place);
            let mut largest = 0.0_f64;
            for (place, &missing) in candidates.iter().enumerate().filter(|(_, one)| matches!(one, Missing::Term(_))) {
                let variance = beside.variance_of(&problem, count + place, &covariance, &mut self.stages)?;
                let term = Suspect { missing, value: beside.pooled.values[count + place], error: variance.sqrt() };
                if term.is_conspicuous() {
                    largest = largest.max(size(place, term.value));
                }
            }
            suspects.retain(|(place, one, _)| FAR_LARGER * size(*place, one.value) > largest);
        }
        Ok(Some(suspects.into_iter().map(|(_, suspect, is_little)| (suspect, is_little)).collect()))
    }
}

/// The covariance of a row's noise with that of each regressor, from the variance of the torque's noise and what its powers are taken from.
fn shared(weak: &WeakRows, regressors: &Range<usize>, candidates: &[Missing], (torque, zero): (f64, f64)) -> Vec<f64> {
    let scale: f64 = weak.torque.iter().sum();
    let mean = |column: &[f64]| column.iter().sum::<f64>() / (scale * weak.rows.len() as f64);
    let square = candidates.iter().position(|&one| one == Missing::TorqueSquare);
    let squares = square.map_or(0.0, |place| mean(&weak.rows.regressors[regressors.start + place].value));
    let of = |missing: &Missing| match missing {
        Missing::Resonance => -shared_noise(weak, torque),
        // The slopes of both powers, in the mean.
        Missing::TorqueSquare => 2.0 * (mean(&weak.rows.rhs) - zero) * torque,
        Missing::TorqueCube => 3.0 * squares * torque,
        Missing::Term(_) | Missing::Lag | Missing::Gain => 0.0,
    };
    candidates.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use rustfft::num_complex::Complex64;

    use super::*;
    use crate::identify::builder::{Identify, identify};
    use crate::identify::identification::Identification;
    use crate::identify::kinds::Kind;
    use crate::identify::options::{Repeated, WeakForm, WidthFrom};
    use crate::regression::simulated::random;

    const RATE: f64 = 1000.0;
    const SAMPLES: usize = 8000;
    const INERTIA: f64 = 0.0123;
    const DAMPING: f64 = 0.05;
    const STIFFNESS: f64 = 13.0;
    /// Where the masses on both sides of a coupling resonate, and the part of the inertia that is behind it.
    const RESONANCE: f64 = 60.0;
    const LOAD: f64 = 0.4;
    /// Of the largest torque, what its cube adds there.
    const CUBE: f64 = 0.02;
    /// What noise is of angle and torque: little, so that a short record tells enough.
    const LITTLE: [f64; 2] = [1e-3, 3e-3];
    /// What an angle is rounded to.
    const STEP: f64 = 4e-3;
    /// What a resonance five times as high as the motion leaves of fourth derivatives.
    const ABOUT: f64 = 0.15;

    /// Angle and torque of a machine that is driven by many frequencies, rigid or with the angle behind a coupling, with noise of a part of either.
    fn record(is_rigid: bool, noise: [f64; 2]) -> [Vec<f64>; 2] {
        let (load, motor) = (LOAD * INERTIA, (1.0 - LOAD) * INERTIA);
        let coupling = motor * load / INERTIA * (TAU * RESONANCE).powi(2);
        let [mut angle, mut torque] = [(); 2].map(|()| vec![0.0; SAMPLES]);
        for (wave, phase) in random(7, 47).into_iter().enumerate() {
            let s = Complex64::new(0.0, TAU * (0.5 + 0.25 * wave as f64));
            let rest = DAMPING * s + STIFFNESS;
            let passed = if is_rigid { 1.0.into() } else { coupling / (coupling + load * s * s + rest) };
            let inertias =
                if is_rigid { INERTIA * s * s + rest } else { motor * s * s + (load * s * s + rest) * passed };
            for (sample, (angle, torque)) in angle.iter_mut().zip(&mut torque).enumerate() {
                let drive = 0.05 * (s * (sample as f64 / RATE) + Complex64::new(0.0, 2.0 * phase)).exp();
                *torque += drive.re;
                *angle += (drive * passed / inertias).re;
            }
        }
        for ((channel, part), seed) in [&mut angle, &mut torque].into_iter().zip(noise).zip([1, 2]) {
            let square = channel.iter().map(|value| value * value).sum::<f64>() / SAMPLES as f64;
            channel
                .iter_mut()
                .zip(random(seed, SAMPLES))
                .for_each(|(value, noise)| *value += part * square.sqrt() * noise);
        }
        [angle, torque]
    }

    /// What a sensor shows that is not linear, and the factor of the cube that it adds.
    fn not_linear(torque: &[f64]) -> (Vec<f64>, f64) {
        let factor = CUBE / torque.iter().fold(0.0_f64, |most, one| most.max(one.abs())).powi(2);
        let shown = |torque: &f64| (0..20).fold(*torque, |shown, _| torque + factor * shown.powi(3));
        (torque.iter().map(shown).collect(), factor)
    }

    /// What is found where inertia and damping are constant.
    fn found(call: Identify<'_>) -> Identification {
        call.inertia(Kind::Constant).damping(Kind::Constant).run().expect("a record")
    }

    /// What the torque tells beyond chance.
    fn told(found: &Identification) -> Vec<Suspect> {
        let suspects = found.weak.as_ref().map_or(&[][..], |weak| weak.suspects.as_slice());
        suspects.iter().copied().filter(|one| one.missing.is_of_torque() && one.is_conspicuous()).collect()
    }

    #[test]
    fn nothing_is_told_of_a_rigid_machine_and_a_linear_sensor() {
        for noise in [[1e-3, 1e-2], [1e-3, 0.3], [1e-2, 1e-2]] {
            let [angle, torque] = record(true, noise);
            assert_eq!(told(&found(identify(&angle, &torque, RATE))), [], "{noise:?}");
        }
    }

    #[test]
    fn a_cube_is_told_with_the_factor_that_corrects_it() {
        let [angle, torque] = record(true, LITTLE);
        let (shown, factor) = not_linear(&torque);
        let told = told(&found(identify(&angle, &shown, RATE)));
        let [cube] = told[..] else { panic!("one thing, not {told:?}") };
        assert_eq!(cube.missing, Missing::TorqueCube);
        assert!((cube.value / factor - 1.0).abs() < ABOUT, "{} ± {}, {factor}", cube.value, cube.error);
    }

    #[test]
    fn a_coupling_that_bends_is_told_with_its_resonance() {
        let [angle, torque] = record(false, [1e-3, 1e-2]);
        let told = told(&found(identify(&angle, &torque, RATE).stiffness(Kind::Constant)));
        let [bends] = told[..] else { panic!("one thing, not {told:?}") };
        assert_eq!(bends.missing, Missing::Resonance);
        let resonance = 1.0 / (TAU * bends.value.sqrt());
        assert!((resonance / RESONANCE - 1.0).abs() < ABOUT, "{resonance}");
    }

    /// The angle of a rig whose stiffness swings, rounded, and its torque without noise.
    fn rounded() -> [Vec<f64>; 2] {
        let [mut angle, mut torque] = [(); 2].map(|()| vec![0.0; SAMPLES / 2]);
        for (wave, phase) in random(7, 24).into_iter().enumerate() {
            let frequency = TAU * (0.5 + 0.5 * wave as f64);
            for (sample, (angle, torque)) in angle.iter_mut().zip(&mut torque).enumerate() {
                let time = sample as f64 / RATE;
                let stiffness = STIFFNESS * (1.0 + 0.3 * (TAU * 0.4 * time).sin());
                let (sine, cosine) = (frequency * time + 2.0 * phase).sin_cos();
                *angle += sine;
                *torque += (stiffness - INERTIA * frequency.powi(2)) * sine + DAMPING * frequency * cosine;
            }
        }
        for angle in &mut angle {
            *angle = (*angle / STEP).round() * STEP;
        }
        [angle, torque]
    }

    #[test]
    fn a_wider_function_that_agrees_contradicts_a_narrow_one() {
        let [angle, torque] = rounded();
        let of = |width_from| {
            let repeated = Repeated { width_from: Some(width_from), ..Repeated::default() };
            let form = WeakForm { window_length: Some(13), exponent: Some(9), repeated, ..WeakForm::default() };
            told(&found(identify(&angle, &torque, RATE).weak_form(form)))
        };
        assert_ne!(of(WidthFrom::Spectra), [], "windows follow a stiffness that bends as far as noise lets them");
        assert_eq!(of(WidthFrom::Plateau), []);
    }
}
