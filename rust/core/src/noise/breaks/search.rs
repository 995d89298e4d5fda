//! Places at which an angle jumps between two samples, as it does where a recorder loses samples and leaves no gap.
//!
//! A mass has no jump of its angle: an impact changes its velocity, a torque its acceleration. So windows around every border of two samples are
//! asked for a step there. Where that shows that samples are lost, and how many, windows whose length the record chooses are asked for shifts of
//! time by about as many, which are found where the motion turns round or is fast, and next to others, too.

use crate::error::Error;
use crate::exec::pool::Watch;
use crate::noise::breaks::shift::shifts;
use crate::noise::breaks::step::Steps;
use crate::noise::defects::defects;
use crate::noise::quantisation::quantisation_step;
use crate::record::samples::Samples;

/// Samples on either side of a border, degree of the polynomial, and how many derivatives may change: a second look with shorter windows finds
/// two breaks close together.
const WINDOWS: [(usize, usize, usize); 2] = [(10, 5, 2), (5, 3, 1)];

/// How many steps show that the recorder loses samples.
const ENOUGH: usize = 3;

/// At how many places the angle jumps between two samples, unless a recorder did something else to it, too; the torque may. Costs some 10 ns a sample: shifts
/// of time are not looked for.
///
/// # Errors
/// If the watch cancels.
pub fn break_counts(angle: &dyn Samples, _: &dyn Samples, watch: &mut Watch<'_>) -> Result<[usize; 2], Error> {
    let of_angle = if defects(angle).is_empty() { steps(angle, quantisation_step(angle), watch)?.len() } else { 0 };
    Ok([of_angle, 0])
}

/// The samples before which an angle jumps, in order.
///
/// # Errors
/// If the watch cancels.
pub(crate) fn breaks(angle: &dyn Samples, watch: &mut Watch<'_>) -> Result<Vec<usize>, Error> {
    let quantum = quantisation_step(angle);
    let mut found = steps(angle, quantum, watch)?;
    if found.len() >= ENOUGH {
        let more = shifts(angle, quantum, &found, watch)?;
        found.extend(more);
        found.sort_unstable();
    }
    Ok(found)
}

/// The borders at which an angle that was rounded to a `quantum` has a step, in order.
fn steps(angle: &dyn Samples, quantum: f64, watch: &mut Watch<'_>) -> Result<Vec<usize>, Error> {
    let mut found: Vec<usize> = Vec::new();
    for (half, degree, changing) in WINDOWS {
        let more = Steps::new(half, degree, changing).find(angle, quantum, &found, watch)?;
        // Short windows follow noise: they are asked only where there is something.
        if found.is_empty() && more.is_empty() {
            return Ok(found);
        }
        found.extend(more);
        found.sort_unstable();
    }
    Ok(found)
}

/// A channel whose samples at some places, in order, are missing.
pub(crate) struct Broken<'a> {
    pub(crate) channel: &'a dyn Samples,
    pub(crate) places: &'a [usize],
}

impl Samples for Broken<'_> {
    fn len(&self) -> usize {
        self.channel.len()
    }

    fn read(&self, first: usize, into: &mut [f64]) {
        self.channel.read(first, into);
        let [from, to] = [first, first + into.len()].map(|end| self.places.partition_point(|&place| place < end));
        self.places[from..to].iter().for_each(|place| into[place - first] = f64::NAN);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::quantisation::tests::uniform;

    fn found(angle: &[f64]) -> Vec<usize> {
        breaks(&angle, &mut |_, _| true).unwrap()
    }

    fn motion(time: f64) -> f64 {
        (0.05 * time).sin() + 0.4 * (0.017 * time).cos()
    }

    #[test]
    fn lost_samples_are_found_and_nothing_else() {
        let samples = 6000;
        let noise = uniform(samples);
        let lost = [700, 1500, 1508, 2900, 4111, 5200];
        let time = |sample: usize| (sample + 3 * lost.iter().filter(|&&place| place <= sample).count()) as f64;
        let broken: Vec<f64> = (0..samples).map(|n| motion(time(n)) + 2e-3 * noise[n]).collect();
        // Where the motion turns round a loss cannot be found, and nothing is wrong.
        let moves = |&&place: &&usize| (motion(time(place)) - motion(time(place) - 3.0)).abs() > 0.04;
        let places = found(&broken);
        for place in lost.iter().filter(moves) {
            assert!(places.contains(place), "{place} {places:?}");
        }
        assert!(lost.iter().filter(moves).count() >= 4);
        assert!(places.iter().all(|place| lost.contains(place)), "{places:?}");
        let whole: Vec<f64> = (0..samples).map(|n| motion(n as f64) + 2e-3 * noise[n]).collect();
        assert_eq!(found(&whole), [] as [usize; 0]);
        let exact: Vec<f64> = (0..samples).map(|n| motion(n as f64)).collect();
        assert_eq!(found(&exact), [] as [usize; 0]);
        assert_eq!(found(&broken[..15]), [] as [usize; 0]);
    }

    #[test]
    fn neighbouring_losses_are_found_however_fast_the_motion_is() {
        let samples = 4000;
        let noise = uniform(samples);
        // 16 and 64 samples a cycle at least; losses apart by less than a window, and by less than a test function.
        for (speed, apart, loud) in [(1.0, 6, 0.0), (1.0, 6, 2e-3), (0.25, 3, 0.0), (0.25, 3, 2e-3)] {
            let motion = |time: f64| (0.39 * time).sin() + 0.8 * (0.23 * time + 1.0).cos() + 0.9 * (0.11 * time).sin();
            let motion = |time: f64| motion(speed * time);
            let near = [(500, 3), (511, 3), (900, 3), (900 + apart, 3), (2100, 6), (2120, 3), (2800, 3), (2812, 2)];
            let is_near = |place: usize| near.iter().any(|&(one, _)| place.abs_diff(one) < 30);
            let single = (1..36).map(|n| 300 + 97 * n).filter(|&place| !is_near(place));
            let lost: Vec<(usize, usize)> = single.map(|place| (place, 3)).chain(near).collect();
            let before = |sample: usize| -> usize {
                lost.iter().filter(|&&(place, _)| place <= sample).map(|&(_, lost)| lost).sum()
            };
            let time = |sample: usize| (sample + before(sample)) as f64;
            let broken: Vec<f64> = (0..samples).map(|n| motion(time(n)) + loud * noise[n]).collect();
            let places = found(&broken);
            // Between those that are close together some samples are no use.
            let missed = |&&(place, _): &&(usize, usize)| places.iter().all(|found| found.abs_diff(place) > 2);
            assert_eq!(lost.iter().find(missed), None, "{places:?}");
            let elsewhere = |&&found: &&usize| lost.iter().all(|&(place, _)| found.abs_diff(place) > 8);
            assert_eq!(places.iter().find(elsewhere), None, "{places:?}");
            let whole: Vec<f64> = (0..samples).map(|n| motion(n as f64) + loud * noise[n]).collect();
            assert_eq!(found(&whole), [] as [usize; 0]);
        }
    }

    #[test]
    fn impacts_spikes_steps_of_an_encoder_and_gaps_are_no_breaks() {
        let samples = 4000;
        let noise = uniform(samples);
        // The velocity jumps, then the acceleration.
        let impact = |n: usize| 0.05 * (n as f64 - 2000.0).abs() + 1e-3 * (n as f64 - 1000.0).max(0.0).powi(2);
        let hit: Vec<f64> = (0..samples).map(|n| motion(n as f64) + impact(n) + 1e-3 * noise[n]).collect();
        assert_eq!(found(&hit), [] as [usize; 0]);
        let spike = |n: usize| if n % 500 == 250 { 1.0 } else { 0.0 };
        let spikes: Vec<f64> = (0..samples).map(|n| motion(n as f64) + spike(n) + 1e-3 * noise[n]).collect();
        assert_eq!(found(&spikes), [] as [usize; 0]);
        for step in [1e-3, 0.02, 0.3] {
            let rounded: Vec<f64> = (0..samples).map(|n| (motion(n as f64 / 8.0) / step).round() * step).collect();
            assert_eq!(found(&rounded), [] as [usize; 0], "{step}");
        }
        let gaps: Vec<f64> = (0..samples).map(|n| if n % 400 < 3 { f64::NAN } else { motion(n as f64) }).collect();
        assert_eq!(found(&gaps), [] as [usize; 0]);
    }

    #[test]
    fn samples_at_breaks_are_missing_however_they_are_read() {
        let values: Vec<f64> = (0..100).map(f64::from).collect();
        let (channel, places) = (values.as_slice(), [0, 17, 18, 99]);
        let broken = Broken { channel: &channel, places: &places };
        for (first, count) in [(0, 100), (17, 1), (18, 4), (1, 16), (90, 10)] {
            let mut read = vec![0.0; count];
            broken.read(first, &mut read);
            for (sample, value) in (first..).zip(read) {
                assert_eq!(value.is_nan(), places.contains(&sample), "{sample}");
            }
        }
    }
}
