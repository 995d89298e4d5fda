//! The coherence of two channels' noise, above the band of the motion: where a controller feeds the angle's noise back, the torque holds it.
//!
//! Above the motion the angle's spectrum is that of its noise, flat. There
//!
//! ```text
//! γ²(f) = |S_θT(f)|² / (S_θθ(f) S_TT(f))
//! ```
//!
//! is one over the number of segments if the noise of both is independent, and the share of the torque's power that comes from the angle's noise
//! otherwise. What motion is left in the band makes it at most the share of motion in the angle's power.
//!
//! An angle without noise holds what a drive of steps moves there, which is no noise: the torque is what moves the inertia, `-Iω²θ`, late by the lag
//! of its channel, known or not. A controller's torque grows less fast than that, and equals it at one frequency only.

use std::f64::consts::PI;

use crate::noise::transform::Transform;
use crate::record::samples::{Samples, all_usable};

/// Samples of a segment, and of one in a record that is too short for enough of these; segments at most and at least.
const SEGMENT: usize = 512;
const SHORT_SEGMENT: usize = 128;
const MOST: usize = 256;
const FEWEST: usize = 16;

/// The power of a sine as which segments fade in and out.
const FADE: i32 = 2;

/// Above the motion the angle's power is at most so many times that of its noise, in at least so many frequencies.
const FLAT: f64 = 1.15;
const FREQUENCIES: usize = 32;

/// Coherence of the noise from which on the torque holds that of the angle: four times what motion below the noise can make.
pub const CORRELATED_NOISE: f64 = 0.3;

/// The torque over what moves the inertia, where it is taken for that: within so much of one.
const MOVED: f64 = 0.5;

/// Samples by which a torque may be later or earlier than is known, and the steps in which that is sought.
const LATER: f64 = 4.0;
const STEPS: i32 = 16;

/// Sums of the spectra of two channels.
pub(crate) struct Spectra {
    pub(crate) length: usize,
    angle: Vec<f64>,
    torque: Vec<f64>,
    both: Vec<[f64; 2]>,
    pub(crate) segments: usize,
}

impl Spectra {
    /// The coherence of the channels at a frequency; zero where one of them has nothing.
    pub(crate) fn coherence(&self, frequency: usize) -> f64 {
        let [real, imaginary] = self.both[frequency];
        let powers = self.angle[frequency] * self.torque[frequency];
        if powers > 0.0 { (real * real + imaginary * imaginary) / powers } else { 0.0 }
    }
}

/// The mean coherence of angle and torque above the motion, less its bias; `None` if the record has no such band, is too short, or shows motion
/// there. The inertia is over the square of the sample period, and 0 where it is not known; the lag of the torque is in samples.
pub fn noise_coherence(
    angle: &dyn Samples,
    torque: &dyn Samples,
    variance: f64,
    (inertia, lag): (f64, f64),
) -> Option<f64> {
    let spectra = spectra(angle, torque, FADE)?;
    let count = spectra.segments as f64;
    // From the highest frequency down, as long as their mean is that of noise.
    let highest = spectra.length / 2;
    let (mut first, mut sum) = (highest, 0.0);
    for frequency in (2..highest).rev() {
        sum += spectra.angle[frequency] / count;
        let mean = sum / (highest - frequency) as f64;
        if mean <= FLAT * variance {
            first = frequency;
        }
    }
    let band = first..highest;
    if band.len() < FREQUENCIES {
        return None;
    }
    let is_moved = |frequency: usize, lag: f64| {
        let pace = 2.0 * PI * frequency as f64 / spectra.length as f64;
        let (sine, cosine) = (pace * lag).sin_cos();
        let moving = -inertia * pace * pace;
        let [real, imaginary] = spectra.both[frequency].map(|value| value / (moving * spectra.angle[frequency]));
        (real - cosine).hypot(imaginary - sine) < MOVED
    };
    let steps = if inertia == 0.0 { 0 } else { STEPS };
    let lags = (-steps..=steps).map(|step| lag + LATER * f64::from(step) / f64::from(STEPS));
    let moved = lags.map(|lag| band.clone().filter(|&frequency| is_moved(frequency, lag)).count()).max();
    if 2 * moved.unwrap_or(0) > band.len() {
        return None;
    }
    let frequencies = band.len() as f64;
    let coherence = band.map(|frequency| spectra.coherence(frequency));
    let bias = 1.0 / count;
    Some(((coherence.sum::<f64>() / frequencies - bias) / (1.0 - bias)).max(0.0))
}

/// Spectra of two channels, or `None` if there are too few segments in which every sample of both is usable. These fade in and out as some power of a sine.
pub(crate) fn spectra(angle: &dyn Samples, torque: &dyn Samples, power: i32) -> Option<Spectra> {
    let samples = angle.len().min(torque.len());
    let is_long = 2 * samples >= (FEWEST + 1) * SEGMENT;
    let length = if is_long { SEGMENT } else { SHORT_SEGMENT };
    let last = samples.checked_sub(length)?;
    let every = (length / 2).max(last / MOST);
    let fade: Vec<f64> = (0..length).map(|k| (PI * (k as f64 + 0.5) / length as f64).sin().powi(power)).collect();
    let energy: f64 = fade.iter().map(|value| value * value).sum();
    let transform = Transform::new(length);
    let size = length / 2 + 1;
    let mut spectra =
        Spectra { length, angle: vec![0.0; size], torque: vec![0.0; size], both: vec![[0.0; 2]; size], segments: 0 };
    let mut stretch = vec![0.0; length];
    for first in (0..=last).step_by(every) {
        let mut transformed = [angle, torque].map(|channel| {
            channel.read(first, &mut stretch);
            let usable = all_usable(&stretch);
            let mean = stretch.iter().sum::<f64>() / length as f64;
            stretch.iter_mut().zip(&fade).for_each(|(value, fade)| *value = (*value - mean) * fade);
            usable.then(|| transform.of(&stretch))
        });
        let (Some(one), Some(other)) = (transformed[0].take(), transformed[1].take()) else { continue };
        for (place, ([a, b], [c, d])) in one.into_iter().zip(other).enumerate() {
            spectra.angle[place] += (a * a + b * b) / energy;
            spectra.torque[place] += (c * c + d * d) / energy;
            spectra.both[place][0] += (a * c + b * d) / energy;
            spectra.both[place][1] += (b * c - a * d) / energy;
        }
        spectra.segments += 1;
    }
    (spectra.segments >= FEWEST).then_some(spectra)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::quantisation::tests::uniform;

    #[test]
    fn noise_that_is_fed_back_is_seen_and_independent_noise_is_not() {
        let noise = uniform(3 * 16_384);
        let (angle, rest) = noise.split_at(16_384);
        let motion = |sample: usize| (sample as f64 * 0.02).sin();
        let moving: Vec<f64> = angle.iter().enumerate().map(|(sample, noise)| 10.0 * motion(sample) + noise).collect();
        let fed_back: Vec<f64> = moving.iter().zip(rest).map(|(angle, own)| -5.0 * angle + own).collect();
        let alone: Vec<f64> =
            rest[..16_384].iter().enumerate().map(|(sample, own)| 3.0 * motion(sample) + own).collect();
        let of = |torque: &[f64]| noise_coherence(&moving.as_slice(), &torque, 1.0 / 12.0, (0.0, 0.0)).unwrap();
        // 25 parts of the torque's 26 come from the angle. Of independent noise 120 segments leave less than 0.01 in the mean of 200 frequencies.
        assert!((of(&fed_back) - 25.0 / 26.0).abs() < 0.02 && of(&alone) < 0.01, "{} {}", of(&fed_back), of(&alone));
        assert_eq!(noise_coherence(&moving.as_slice(), &alone.as_slice(), 1e-6, (0.0, 0.0)), None);
        // Few samples are seen in short segments: 30 segments leave 0.05 of independent noise at most.
        let of_few =
            |torque: &[f64]| noise_coherence(&&moving[..2000], &&torque[..2000], 1.0 / 12.0, (0.0, 0.0)).unwrap();
        assert!((of_few(&fed_back) - 25.0 / 26.0).abs() < 0.05 && of_few(&alone) < 0.05);
        assert_eq!(noise_coherence(&&moving[..1000], &&alone[..1000], 1.0 / 12.0, (0.0, 0.0)), None);
    }

    #[test]
    fn what_a_rough_torque_moves_is_no_noise() {
        for lag in [0.0, 2.3] {
            let [mut angle, mut torque] = [(); 2].map(|()| vec![0.0; 16_384]);
            for (wave, phase) in uniform(500).into_iter().enumerate() {
                let frequency = PI * (wave as f64 + 0.5) / 500.0;
                for (sample, (angle, torque)) in angle.iter_mut().zip(&mut torque).enumerate() {
                    let drive = |late: f64| (frequency * (sample as f64 - late) + 2.0 * PI * phase).sin();
                    *torque += drive(lag);
                    *angle -= drive(0.0) / frequency.powi(2);
                }
            }
            let of = |motion| noise_coherence(&angle.as_slice(), &torque.as_slice(), 1e9, motion);
            assert!(of((0.0, lag)).unwrap() > CORRELATED_NOISE, "{:?}", of((0.0, lag)));
            assert_eq!((of((1.0, lag)), of((1.0, lag + 3.0))), (None, None));
            // Of quite another lag, or of another inertia, it is not what moves that.
            for motion in [(1.0, lag + 9.0), (3.0, lag), (0.3, lag)] {
                assert!(of(motion).unwrap() > CORRELATED_NOISE, "{motion:?}");
            }
        }
    }

    #[test]
    fn a_controller_is_no_rough_drive_whatever_the_inertia() {
        let noise = uniform(2 * 16_384);
        let (angle, rest) = noise.split_at(16_384);
        let back = |sample: usize| angle[sample] - if sample > 0 { angle[sample - 1] } else { 0.0 };
        // Proportional and derivative, with gains that a machine of this inertia bears.
        for (proportional, derivative) in [(0.05, 0.0), (0.0, 0.3), (0.05, 0.3)] {
            let torque: Vec<f64> = (0..angle.len())
                .map(|sample| 0.02 * rest[sample] - proportional * angle[sample] - derivative * back(sample))
                .collect();
            let found = noise_coherence(&angle, &torque.as_slice(), 1.0 / 12.0, (1.0, 0.0));
            assert!(found.is_some_and(|coherence| coherence > CORRELATED_NOISE), "{found:?}");
        }
    }
}
