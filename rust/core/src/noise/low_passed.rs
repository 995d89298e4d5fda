//! Whether a channel was low-passed: its noise falls with the frequency where that of a sensor, or of rounding, stays.

use crate::noise::channel::bands;
use crate::noise::spectrum::power_with_little_leakage;
use crate::record::samples::Samples;

/// Samples of a segment whose spectrum is taken, an eighth of its frequencies, and which of these are compared.
const SEGMENT: usize = 256;
const EIGHTH: usize = SEGMENT / 16;
const COMPARED: [usize; 2] = [5, 7];

/// The part of the density that is left at the highest frequencies, at most. White noise has as much in both eighths, within a fifth.
const FALLS: f64 = 0.25;

/// Whether the density of a channel falls up to the highest frequency, as after a filter. That of a channel without noise does, too.
pub(crate) fn is_low_passed(channel: &dyn Samples) -> bool {
    if channel.len() < SEGMENT {
        return false;
    }
    let power = power_with_little_leakage(channel, SEGMENT);
    let density = |eighth: usize| power[eighth * EIGHTH..(eighth + 1) * EIGHTH].iter().sum::<f64>();
    let [below, highest] = COMPARED.map(density);
    highest < FALLS * below
}

/// By what factor the power of a band of white noise is another one by chance, at most.
const CHANCE: f64 = 2.0;

/// The largest density of a torque that was low-passed where the angle shows nothing but noise: what equations leave of it may be noise up to that,
/// of which the quietest band knows nothing. Zero where it was not.
pub(crate) fn density_above_motion(angle: &dyn Samples, torque: &dyn Samples, weights: Option<&[f64]>) -> f64 {
    if is_low_passed(torque) { largest_density_at_rest(angle, torque, weights) } else { 0.0 }
}

/// The same of a torque that is known to be low-passed.
pub(crate) fn largest_density_at_rest(angle: &dyn Samples, torque: &dyn Samples, weights: Option<&[f64]>) -> f64 {
    let [angle, torque] = [angle, torque].map(|channel| bands(channel, weights).0);
    let quietest = angle.iter().copied().fold(f64::INFINITY, f64::min);
    let still = angle.iter().zip(torque).filter(|(angle, _)| **angle <= CHANCE * quietest);
    still.map(|(_, density)| density).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::quantisation::tests::uniform;

    const SAMPLES: usize = 8000;

    /// A slow motion beside noise.
    fn moving(noise: &[f64]) -> Vec<f64> {
        let motion = |sample: usize| 100.0 * (0.05 * sample as f64).sin();
        noise.iter().enumerate().map(|(sample, noise)| motion(sample) + noise).collect()
    }

    #[test]
    fn white_noise_does_not_fall_and_that_of_a_mean_of_neighbours_does() {
        for (place, white) in uniform(20 * SAMPLES).chunks(SAMPLES).enumerate() {
            assert!(!is_low_passed(&moving(white).as_slice()), "{place}");
            let rounded: Vec<f64> = moving(white).iter().map(|value| value.round()).collect();
            assert!(!is_low_passed(&rounded.as_slice()), "{place}");
            let passed: Vec<f64> =
                white.windows(3).map(|near| 0.25 * near[0] + 0.5 * near[1] + 0.25 * near[2]).collect();
            assert!(is_low_passed(&moving(&passed).as_slice()), "{place}");
        }
    }

    #[test]
    fn a_filter_is_seen_beside_motion_that_is_far_more_than_what_it_leaves() {
        let mut state = [0.0; 2];
        let passed = uniform(SAMPLES).into_iter().map(|mut value| {
            for state in &mut state {
                *state += 0.1 * (value - *state);
                value = *state;
            }
            value
        });
        let mut passed: Vec<f64> = passed.collect();
        for _ in 0..3 {
            passed = passed.windows(3).map(|near| 0.25 * near[0] + 0.5 * near[1] + 0.25 * near[2]).collect();
        }
        // With segments that fade as for other spectra what the motion leaks left 0.29 at the highest frequencies.
        assert!(is_low_passed(&moving(&passed).as_slice()));
    }

    #[test]
    fn the_noise_of_a_mean_of_two_is_that_above_the_motion() {
        let noise = uniform(2 * SAMPLES + 1);
        let [angle, torque] = [&noise[..SAMPLES], &noise[SAMPLES..]];
        let mean: Vec<f64> = torque.windows(2).map(|near| 0.5 * (near[0] + near[1])).collect();
        let density =
            |torque: &[f64]| density_above_motion(&moving(angle).as_slice(), &moving(torque).as_slice(), None);
        // Uniform noise has a variance of a twelfth; the second of sixteen bands of the mean has cos²(π/2 · 3/32) = 0.98 of it.
        assert!((12.0 * density(&mean) - 0.98).abs() < 0.1, "{}", density(&mean));
        assert_eq!(density(&torque[..SAMPLES]), 0.0);
    }

    #[test]
    fn nothing_is_said_of_nothing() {
        assert!(!is_low_passed(&vec![0.0; 100].as_slice()));
        assert!(!is_low_passed(&vec![1.0; SAMPLES].as_slice()));
    }
}
