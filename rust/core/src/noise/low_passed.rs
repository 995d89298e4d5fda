//! Whether a channel was low-passed: its noise falls with the frequency where that of a sensor, or of rounding, stays.

use crate::noise::spectrum::power;
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
    let power = power(channel, SEGMENT);
    let density = |eighth: usize| power[eighth * EIGHTH..(eighth + 1) * EIGHTH].iter().sum::<f64>();
    let [below, highest] = COMPARED.map(density);
    highest < FALLS * below
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
    fn nothing_is_said_of_nothing() {
        assert!(!is_low_passed(&vec![0.0; 100].as_slice()));
        assert!(!is_low_passed(&vec![1.0; SAMPLES].as_slice()));
    }
}
