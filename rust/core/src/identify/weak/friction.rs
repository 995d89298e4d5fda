//! The direction of motion as friction feels it: what is known of the sign of the velocity, and where the machine rests.
//!
//! Near zero the sign of a noisy velocity is chance. Its expectation under the noise, `erf(v / √2 σ)`, is what least squares needs. At
//! rest friction is whatever holds the machine, anything between `-F` and `F`: equations that touch such samples say nothing of it.

use std::num::NonZeroUsize;
use std::ops::Range;

use statrs::function::erf::erf;

use crate::equation::motion::{Motion, Term};
use crate::equation::terms::TermFunction;
use crate::error::Error;
use crate::exec::pool::Watch;
use crate::lanes::output::Elements;
use crate::local_polynomials::criterion::Criterion;
use crate::local_polynomials::estimates::Estimates;
use crate::local_polynomials::options::{Order, PolynomialOptions, Selection};
use crate::local_polynomials::plan::LocalPolynomials;
use crate::noise::channel::channel_variance;
use crate::noise::spectrum::power;
use crate::record::samples::Samples;
use crate::simd::instructions::Instructions;
use crate::weak_form::test_function_choice::{Evidence, spectrum_length};

/// A velocity within so many standard errors of zero, or this part of its root mean square, may be rest.
const WITHIN_NOISE: f64 = 3.0;
const SLOW: f64 = 0.01;

/// A machine that turns round passes such velocities in a time that its acceleration tells; one that stays there so many times longer rests.
const LONGER_THAN_PASSING: f64 = 10.0;

/// Where less than this part of the record moves, rest is what the record is about.
const LEAST_MOTION: f64 = 0.05;

/// Samples on either side of the shortest windows in which a machine may be seen to rest.
const LEAST_HALF: usize = 4;

/// The velocity of a record as friction needs it.
pub struct Sliding {
    /// The velocity at every sample in rad/s; NaN at rest, where friction may be anything up to its limit.
    pub velocity: Vec<f64>,
    /// Its standard errors.
    pub errors: Vec<f64>,
}

impl Sliding {
    /// The velocity of an angle that is sampled every `delta` seconds.
    ///
    /// # Errors
    /// If a window does not fit, or the watch cancels.
    pub fn of(
        angle: &dyn Samples,
        (delta, instructions): (f64, Instructions),
        workers: NonZeroUsize,
        watch: &mut Watch<'_>,
    ) -> Result<Self, Error> {
        let ([mut velocity, errors], rests) = velocity_and_rest(angle, (delta, instructions), workers, watch)?;
        velocity.iter_mut().zip(&rests).filter(|(_, rests)| **rests).for_each(|(velocity, _)| *velocity = f64::NAN);
        Ok(Self { velocity, errors })
    }
}

/// Velocity and its errors at every sample, and where a machine rests.
fn velocity_and_rest(
    angle: &dyn Samples,
    (delta, instructions): (f64, Instructions),
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<([Vec<f64>; 2], Vec<bool>), Error> {
    let window = 2 * half_window(angle, (delta, instructions)) + 1;
    let both = velocity(angle, window, (delta, instructions), (workers, watch))?;
    let mut rests = resting(&both[0], &both[1], window, delta);
    rest_briefly(angle, &both[0], (window, delta, instructions), &mut rests);
    Ok((both, rests))
}

/// Adds rests that are shorter than the windows of the velocity, which blur their ends: slopes in the shortest windows tell them whose noise is next to nothing.
fn rest_briefly(
    angle: &dyn Samples,
    velocity: &[f64],
    (window, delta, instructions): (usize, f64, Instructions),
    rests: &mut [bool],
) {
    let noise = channel_variance(angle, None, instructions).sqrt() / delta;
    let slow = SLOW * mean_square(velocity.iter().copied()).sqrt();
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "compared with a window before")]
    let half = match (12.0 * (WITHIN_NOISE * noise / slow).powi(2)).cbrt() / 2.0 {
        half if half < window as f64 / 4.0 => (half.ceil() as usize).max(LEAST_HALF),
        _ => return,
    };
    if 4 * half > window || rests.len() <= 2 * half {
        return;
    }
    let slopes = slopes(angle, half, delta);
    let error = noise * (12.0 / (2.0 * half as f64 + 1.0).powi(3)).sqrt();
    for rest in runs(&resting(&slopes, &vec![error; slopes.len()], 2 * half + 1, delta)) {
        // Slopes within half a window of its ends are those of what moves there.
        rests[rest.start.saturating_sub(half)..(rest.end + half).min(slopes.len())].fill(true);
    }
    if is_all_rest(rests) {
        rests.fill(false);
    }
}

/// The slope of least squares around every sample; NaN within half a window of an end or of what is missing.
fn slopes(angle: &dyn Samples, half: usize, delta: f64) -> Vec<f64> {
    let mut samples = vec![0.0; angle.len()];
    angle.read(0, &mut samples);
    let scale = delta * (1..=half).map(|step| 2.0 * (step * step) as f64).sum::<f64>();
    let slope = |centre: usize| {
        let rise = |step: usize| step as f64 * (samples[centre + step] - samples[centre - step]);
        (1..=half).map(rise).sum::<f64>() / scale
    };
    let inside = half..samples.len() - half;
    (0..samples.len()).map(|centre| if inside.contains(&centre) { slope(centre) } else { f64::NAN }).collect()
}

/// Where samples in a row are true.
fn runs(flags: &[bool]) -> Vec<Range<usize>> {
    let mut found: Vec<Range<usize>> = Vec::new();
    for place in (0..flags.len()).filter(|&place| flags[place]) {
        match found.last_mut() {
            Some(run) if run.end == place => run.end += 1,
            _ => found.push(place..place + 1),
        }
    }
    found
}

/// The mean square of what is finite.
fn mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let finite = values.filter(|value| value.is_finite());
    let (sum, count) = finite.fold((0.0, 0.0_f64), |(sum, count), value| (sum + value * value, count + 1.0));
    sum / count.max(1.0)
}

/// Whether hardly anything moves.
fn is_all_rest(rests: &[bool]) -> bool {
    let moves = rests.iter().filter(|rests| !**rests).count() as f64;
    moves < LEAST_MOTION * rests.len() as f64
}

/// What friction feels of a record.
pub(crate) struct FrictionDirection {
    /// The velocity at every sample; empty where no term needs it.
    pub(crate) velocity: Vec<f64>,
    /// The expected sign of the velocity; NaN at rest.
    pub(crate) direction: Vec<f64>,
    /// The part of the record at rest.
    pub(crate) resting: f64,
}

impl FrictionDirection {
    /// The direction of a motion with terms of the velocity; nothing for any other.
    pub(crate) fn of(
        motion: &Motion<'_>,
        (delta, instructions): (f64, Instructions),
        workers: NonZeroUsize,
        watch: &mut Watch<'_>,
    ) -> Result<Self, Error> {
        let of_velocity = |term: &Term<'_>| match term {
            Term::BuiltIn(term) => matches!(term.function, TermFunction::OfVelocity(_) | TermFunction::Direction),
            Term::Record(_) => false,
        };
        if !motion.terms.iter().any(of_velocity) {
            return Ok(Self { velocity: Vec::new(), direction: Vec::new(), resting: 0.0 });
        }
        let ([velocity, errors], rests) = velocity_and_rest(motion.angle, (delta, instructions), workers, watch)?;
        let direction = velocity
            .iter()
            .zip(&errors)
            .zip(&rests)
            .map(|((&velocity, &error), &rests)| if rests { f64::NAN } else { expected_sign(velocity, error) });
        let direction = direction.collect();
        let resting = rests.iter().filter(|rests| **rests).count() as f64 / rests.len().max(1) as f64;
        Ok(Self { velocity, direction, resting })
    }
}

/// What the sign of a velocity is on average, where its error is normal.
pub(crate) fn expected_sign(velocity: f64, error: f64) -> f64 {
    if velocity == 0.0 || velocity.is_nan() {
        return velocity;
    }
    if error > 0.0 { erf(velocity / (error * std::f64::consts::SQRT_2)) } else { velocity.signum() }
}

/// Where a machine rests: its velocity is within its noise, or next to nothing, for much longer than it takes to turn round.
fn resting(velocity: &[f64], errors: &[f64], window: usize, delta: f64) -> Vec<bool> {
    let slow = SLOW * mean_square(velocity.iter().copied()).sqrt();
    let limit = |sample: usize| (WITHIN_NOISE * errors[sample]).max(slow);
    let near = |sample: usize| velocity[sample].abs() <= limit(sample);
    let moving = (1..velocity.len()).filter(|&sample| !near(sample) && velocity[sample].is_finite());
    let acceleration = mean_square(moving.map(|sample| velocity[sample] - velocity[sample - 1])).sqrt() / delta;
    let mut rests = vec![false; velocity.len()];
    let mut first = 0;
    while first < velocity.len() {
        if !near(first) {
            first += 1;
            continue;
        }
        let end = (first..velocity.len()).find(|&sample| !near(sample)).unwrap_or(velocity.len());
        let widest = (first..end).map(limit).fold(slow, f64::max);
        let passing = 2.0 * widest / (acceleration * delta);
        if (end - first) as f64 > (LONGER_THAN_PASSING * passing).max(window as f64) {
            rests[first..end].fill(true);
        }
        first = end;
    }
    if is_all_rest(&rests) {
        rests.fill(false);
    }
    rests
}

/// Samples on either side of a polynomial's centre: an eighth of a typical cycle.
fn half_window(angle: &dyn Samples, (delta, instructions): (f64, Instructions)) -> usize {
    let samples = angle.len();
    let evidence = Evidence {
        power: power(angle, spectrum_length(samples, 200)),
        samples,
        noise: [channel_variance(angle, None, instructions), 0.0],
        coloured: None,
        delta,
        unknown: [true; 3],
    };
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to a few samples")]
    let half = (evidence.period() / 8.0).clamp(8.0, 100.0) as usize;
    half.min((samples.max(1) - 1) / 2)
}

/// The velocity at every sample and its standard error, from local polynomials in windows of some length.
fn velocity(
    angle: &dyn Samples,
    window_length: usize,
    (delta, instructions): (f64, Instructions),
    (workers, watch): (NonZeroUsize, &mut Watch<'_>),
) -> Result<[Vec<f64>; 2], Error> {
    let samples = angle.len();
    let plan = LocalPolynomials::new(PolynomialOptions {
        window_length,
        order: Order::Chosen { criterion: Criterion::Aicc, highest: 15 },
        derivatives: vec![1],
        delta,
        noise: true,
        selection: Selection::Window,
        quantisation: 0.0,
        instructions,
    })?;
    let mut both = [vec![0.0; samples], vec![0.0; samples]];
    let [velocity, errors] = &mut both;
    let mut columns = (vec![0_u8; samples], vec![0_u16; samples], vec![0.0; samples]);
    for (column, wants_errors) in [(velocity, false), (errors, true)] {
        let estimates = Estimates {
            elements: Elements { first: 0, step: 1 },
            derivatives: vec![column],
            order: &mut columns.0,
            status: &mut columns.1,
            sigma: &mut columns.2,
        };
        if wants_errors {
            plan.errors(&[angle], estimates, workers, watch)?;
        } else {
            plan.run(&[angle], estimates, true, workers, watch)?;
        }
    }
    Ok(both)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sign_of_a_velocity_is_known_as_far_as_its_error_lets_it() {
        assert_eq!([expected_sign(2.0, 0.0), expected_sign(-2.0, 0.0), expected_sign(0.0, 0.0)], [1.0, -1.0, 0.0]);
        assert!((expected_sign(1.0, 1.0) - 0.682_689_492).abs() < 1e-9);
        assert!((expected_sign(-4.0, 1.0) + 1.0).abs() < 1e-4);
    }

    #[test]
    fn a_machine_that_stays_rests_and_one_that_turns_round_does_not() {
        let delta = 0.001;
        let moves = |sample: usize| (sample as f64 * 0.01).sin();
        let velocity: Vec<f64> = (0..4000).map(|n| if (1000..2000).contains(&n) { 0.0 } else { moves(n) }).collect();
        let rests = resting(&velocity, &vec![1e-4; 4000], 21, delta);
        assert!(rests[1000..2000].iter().all(|rests| *rests));
        assert_eq!(rests.iter().filter(|rests| **rests).count(), 1000);
    }

    #[test]
    fn rests_that_are_shorter_than_the_windows_of_the_velocity_are_found() {
        // Moves of 150 samples from place to place, a rest of 60 after each.
        let place = |n: usize| {
            let part = (n % 210).min(150) as f64 / 150.0;
            (n / 210) as f64 + part.powi(3) * (10.0 - 15.0 * part + 6.0 * part.powi(2))
        };
        let encoder: Vec<f64> = (0..4200).map(|n| (place(n) * 1e4).round() / 1e4).collect();
        let velocity: Vec<f64> = (0..4200).map(|n| (place(n + 1) - place(n)) / 0.01).collect();
        let mut rests = vec![false; 4200];
        rest_briefly(&encoder.as_slice(), &velocity, (201, 0.01, Instructions::current()), &mut rests);
        let is_rest = |n: usize| n % 210 >= 150;
        let found = (210..3990).filter(|&n| is_rest(n) && rests[n]).count();
        assert!(found > 18 * 55, "{found}");
        // Where it is slow besides, friction is known, but little is lost.
        assert!((210..3990).filter(|&n| !is_rest(n) && rests[n]).count() < 18 * 30);
        // Windows of the velocity that are as short find them themselves.
        let mut rests = vec![false; 4200];
        rest_briefly(&encoder.as_slice(), &velocity, (9, 0.01, Instructions::current()), &mut rests);
        assert!(rests.iter().all(|rests| !rests));
    }

    #[test]
    fn a_record_that_hardly_moves_is_not_all_rest() {
        let rests = resting(&[0.0; 500], &[0.0; 500], 21, 0.001);
        assert!(rests.iter().all(|rests| !rests));
    }
}
