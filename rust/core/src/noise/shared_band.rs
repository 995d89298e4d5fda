//! The band in which two channels show the same motion.
//!
//! The noise of an angle that was low-passed falls with the frequency, so that it cannot be read at the highest ones: it looks like motion. What is
//! motion the torque shows as well. So the band ends where the coherence of both is no more than chance.

use crate::noise::coherence::spectra;
use crate::record::samples::Samples;

/// Bands are compared that end at so many times the frequency where they begin.
const WIDTH: f64 = 1.5;
/// Standard deviations of the mean of coherences over the chance of one, and as many times that of a single one for its longer tail. Neighbouring
/// frequencies of a window that fades in and out share nearly half their power, which makes the deviation 1.4 times as large.
const BEYOND_CHANCE: f64 = 5.0;
const NEIGHBOURS: f64 = 1.4;

/// The highest frequency, in cycles per sample, of a band in which angle and torque are coherent; `None` if there is no such band or the record is too short.
pub(crate) fn shared_until(angle: &dyn Samples, torque: &dyn Samples) -> Option<f64> {
    let spectra = spectra(angle, torque)?;
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
}
