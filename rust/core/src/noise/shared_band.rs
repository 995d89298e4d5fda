//! The band in which two channels show the same motion.
//!
//! The noise of an angle that was low-passed falls with the frequency, so that it cannot be read at the highest ones: it looks like motion. What is
//! motion the torque shows as well. So the band ends where the coherence of both is no more than chance.
//!
//! A torque that passed the same filter shows its noise just above that band. The filter is the same where torque and angle fall alike from there on, which
//! motion, mass or spring do not: torque over angle grows with the square of the frequency, and its power with the fourth.

use crate::noise::coherence::{Spectra, spectra};
use crate::noise::spectrum::power_with_little_leakage;
use crate::record::samples::Samples;

/// The powers of a sine as which segments fade in and out. The first tells near frequencies apart, the second leaks less: what a strong motion leaks into a band
/// that a filter emptied is as coherent as the motion.
const FADES: [i32; 2] = [2, 4];

/// Bands are compared that end at so many times the frequency where they begin.
const WIDTH: f64 = 1.5;
/// Standard deviations of the mean of coherences over the chance of one, and as many times that of a single one for its longer tail. Neighbouring
/// frequencies of a window that fades in and out share nearly half their power, which makes the deviation 1.4 times as large.
const BEYOND_CHANCE: f64 = 5.0;
const NEIGHBOURS: f64 = 1.4;

/// Samples of a segment whose spectrum is taken, the longest of which a record holds enough, at half their length from one to the next; the most that are
/// averaged, and the part of them that counts as independent.
const LENGTHS: [usize; 3] = [2048, 1024, 512];
const FEWEST_SEGMENTS: usize = 16;
const MOST_SEGMENTS: usize = 256;
const APART: f64 = 0.6;
/// Where bands begin and end that are compared, over the frequency where the first begins, and how far above the motion that is at most.
const EDGES: [f64; 4] = [1.0, 1.25, 1.6, 2.0];
const FURTHER: f64 = 1.6;
/// Logarithms of the torque's power over the angle's in two bands are alike within so much, and so many standard errors.
const ALIKE: f64 = 0.3;
const ERRORS: f64 = 3.0;

/// The highest frequency, in cycles per sample, of a band in which angle and torque are coherent; `None` if there is no such band or the record is too short.
pub(crate) fn shared_until(angle: &dyn Samples, torque: &dyn Samples) -> Option<f64> {
    let [one, other] = FADES.map(|fade| spectra(angle, torque, fade).and_then(|spectra| coherent_until(&spectra)));
    Some(one?.min(other?))
}

/// The highest frequency of a band in which two channels are coherent.
fn coherent_until(spectra: &Spectra) -> Option<f64> {
    let highest = spectra.length / 2;
    let (mut first, mut last) = (1, None);
    while first < highest {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most the highest frequency")]
        let end = ((WIDTH * first as f64).ceil() as usize).clamp(first + 1, highest);
        let sum: f64 = (first..end).map(|frequency| spectra.coherence(frequency)).sum();
        // Of independent channels the sum over `n` frequencies of `m` segments has a mean of `n / m` and a standard deviation of `√n / m`.
        let count = (end - first) as f64;
        let most = count + BEYOND_CHANCE * (1.0 + NEIGHBOURS * count.sqrt());
        if spectra.segments as f64 * sum > most {
            last = Some(end);
        }
        first = end;
    }
    last.map(|end| end as f64 / spectra.length as f64)
}

/// The density of the torque's noise where the motion ends, if it falls above as that of the angle does: both passed the same filter. `None` if they do not, or
/// too little is known.
pub(crate) fn noise_above(until: f64, angle: &dyn Samples, torque: &dyn Samples) -> Option<f64> {
    let samples = angle.len().min(torque.len());
    let length = LENGTHS.into_iter().find(|length| FEWEST_SEGMENTS * length / 2 <= samples)?;
    let powers = [angle, torque].map(|channel| power_with_little_leakage(channel, length));
    let segments = (2 * samples / length - 1).min(MOST_SEGMENTS) as f64 * APART;
    let mut from = until;
    while from <= FURTHER * until {
        let edges = EDGES.map(|edge| place(edge * from, length));
        let [first, .., end] = edges;
        if end > length / 2 {
            return None;
        }
        let mean = |power: &[f64], band: usize| {
            let band = &power[edges[band]..edges[band + 1]];
            band.iter().sum::<f64>() / band.len() as f64
        };
        let ratio = |band: usize| (mean(&powers[1], band) / mean(&powers[0], band)).ln();
        let count = |band: usize| (edges[band + 1] - edges[band]) as f64;
        let chance = |band: usize| (2.0 / segments * (count(0).recip() + count(band).recip())).sqrt();
        let is_alike = |band: usize| (ratio(band) - ratio(0)).abs() < ALIKE + ERRORS * chance(band);
        if first > 0 && (1..EDGES.len() - 1).all(is_alike) {
            return Some(mean(&powers[1], 0));
        }
        from *= EDGES[1];
    }
    None
}

/// The first frequency of a spectrum from some cycles per sample on.
fn place(frequency: f64, length: usize) -> usize {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few thousand at most")]
    let place = (frequency * length as f64).ceil() as usize;
    place
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::quantisation::tests::uniform;

    const SAMPLES: usize = 20_000;

    fn passed(noise: &[f64], corner: f64) -> Vec<f64> {
        let mut state = [0.0; 2];
        let step = |value: &f64| {
            state[0] += corner * (value - state[0]);
            state[1] += corner * (state[0] - state[1]);
            state[1]
        };
        noise.iter().map(step).collect()
    }

    #[test]
    fn the_band_ends_where_only_one_channel_moves() {
        let noise = uniform(3 * SAMPLES);
        let [drive, angle, torque] = [0, 1, 2].map(|place| &noise[place * SAMPLES..(place + 1) * SAMPLES]);
        // Two corners at 1/62.8 cycles a sample leave 1/100 of the power at five times that.
        let motion = passed(drive, 0.1);
        let beside = |noise: Vec<f64>, part: f64| -> Vec<f64> {
            motion.iter().zip(noise).map(|(motion, noise)| motion + part * noise).collect()
        };
        let until = |angle: &[f64], torque: &[f64]| shared_until(&angle, &torque);
        let found = until(&beside(passed(angle, 0.3), 0.05), &beside(torque.to_vec(), 0.05)).unwrap();
        assert!((0.03..0.25).contains(&found), "{found}");
        let found = until(&beside(angle.to_vec(), 1e-6), &beside(torque.to_vec(), 1e-6)).unwrap();
        assert!(found > 0.4, "{found}");
        assert_eq!(until(angle, torque), None);
        assert_eq!(until(angle, &vec![0.0; SAMPLES]), None);
        assert_eq!(until(&angle[..500], &angle[..500]), None);
    }

    #[test]
    fn a_torque_shows_its_noise_above_the_motion_where_both_passed_the_same_filter() {
        let noise = uniform(3 * SAMPLES);
        let [drive, angle, torque] = [0, 1, 2].map(|place| &noise[place * SAMPLES..(place + 1) * SAMPLES]);
        let motion = passed(&passed(&passed(drive, 0.05), 0.05), 0.05);
        let moved: Vec<f64> =
            (1..SAMPLES - 1).map(|k| 100.0 * (motion[k - 1] - 2.0 * motion[k] + motion[k + 1])).collect();
        let beside = |motion: &[f64], noise: &[f64], part: f64| -> Vec<f64> {
            motion.iter().zip(noise).map(|(motion, noise)| motion + part * noise).collect()
        };
        let channels = [beside(&motion[1..], angle, 1e-2), beside(&moved, torque, 0.01)];
        let [angle, torque] = channels.each_ref().map(|channel| passed(channel, 0.9));
        let other = passed(&channels[1], 0.02);
        let above = |until: f64, torque: &[f64]| noise_above(until, &angle.as_slice(), &torque);
        let until = shared_until(&angle.as_slice(), &torque.as_slice()).unwrap();
        let density = above(until, &torque).unwrap();
        // Uniform noise has a variance of a twelfth. Two corners near 1/7 cycles a sample take a half of it at most below that.
        assert!((0.3..1.2).contains(&(12.0 * density / 1e-4)), "{density} {until}");
        // Another filter falls in another way, and a motion that reaches all frequencies has none above.
        assert_eq!(above(until, &other), None);
        assert_eq!(above(0.5, &torque), None);
        assert_eq!(noise_above(until, &&angle[..4000], &&torque[..4000]), None);
    }
}
