//! The noise of a channel is found whatever its signal, and never below quantisation and rounding.

use crate::random::uniform;
use tvident::noise::{CorrelatedNoise, FEWEST_SAMPLES, coloured_noise, coloured_or_low_passed_noise, noise};
use tvident::simd::Instructions;

/// Sums of twelve uniform numbers: nearly normal, of variance one.
fn normal(seed: u64, count: usize) -> Vec<f64> {
    let mut uniform = uniform(seed);
    (0..count).map(|_| (0..12).map(|_| uniform()).sum()).collect()
}

fn wave(count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(|i| (i as f64 * 0.05).sin() + 0.5 * (i as f64 * 0.11).cos())
}

fn sigma(samples: &[f64]) -> f64 {
    noise(&samples, None, None, Instructions::current()).expect("long enough").sigma
}

#[test]
fn white_noise_is_found_beside_a_signal() {
    for level in [1e-6, 1e-3, 0.1, 10.0] {
        let samples: Vec<f64> = wave(20_000).zip(normal(3, 20_000)).map(|(wave, noise)| wave + level * noise).collect();
        // The design's own range; 20 000 samples know the noise to 0.5 %.
        assert!((0.98..=1.02).contains(&(sigma(&samples) / level)), "{level}");
    }
}

#[test]
fn a_long_record_is_looked_at_in_parts() {
    let samples = normal(5, 700_000);
    assert!((sigma(&samples) - 1.0).abs() < 0.01);
}

#[test]
fn noise_is_never_below_quantisation_or_rounding() {
    let step = 0.01;
    let coarse: Vec<f64> = wave(4000).map(|value| (value / step).round() * step).collect();
    let found = noise(&coarse.as_slice(), None, None, Instructions::current()).expect("long enough");
    assert!((found.quantisation / step - 1.0).abs() < 1e-9);
    assert!(found.sigma >= step / 12_f64.sqrt() && found.sigma < 1.1 * step / 12_f64.sqrt());
    let resting = [7.0; 400];
    assert_eq!(
        noise(&resting.as_slice(), None, Some(step), Instructions::current()).map(|found| found.sigma),
        Ok(step / 12_f64.sqrt())
    );
    assert!(sigma(&resting) > 0.0 && sigma(&resting) < 1e-14);
}

#[test]
fn values_that_are_no_number_do_not_count() {
    let mut samples = normal(7, 4000);
    samples[500] = f64::NAN;
    samples[501] = f64::INFINITY;
    assert!((sigma(&samples) - 1.0).abs() < 0.05);
    assert!(sigma(&[f64::NAN; 100]).is_nan());
}

#[test]
fn a_record_of_less_than_a_window_is_refused() {
    let short = vec![0.0; FEWEST_SAMPLES - 1];
    let message = noise(&short.as_slice(), None, None, Instructions::current()).expect_err("too short").to_string();
    assert!(message.contains("at least 25 samples"), "{message}");
    assert!(noise(&[0.0; FEWEST_SAMPLES].as_slice(), None, None, Instructions::current()).is_ok());
}

/// First-order noise of correlation `ρ`, of variance one, over a signal.
fn first_order(correlation: f64, seed: u64, signal: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut level = 0.0;
    let fresh = (1.0 - correlation * correlation).sqrt();
    let noise = normal(seed, 21_000).into_iter().map(|e| {
        level = correlation * level + fresh * e;
        level
    });
    noise.skip(1000).enumerate().map(|(i, e)| e + signal(i as f64)).collect()
}

#[test]
fn the_colour_of_noise_is_found_beside_a_signal() {
    for correlation in [0.3, 0.5, 0.8, 0.9] {
        for amplitude in [0.0, 30.0] {
            let samples = first_order(correlation, 7, |i| amplitude * (i * 0.02).sin());
            let white = sigma(&samples).powi(2);
            let found = coloured_noise(&samples.as_slice(), white, Instructions::current());
            let truth = CorrelatedNoise::new(0.0, vec![(correlation, 1.0)]);
            // Below these frequencies the signal is. A twentieth is what few noises miss, and 20 000 samples know an octave to as much.
            for frequency in [0.05, 0.1, 0.3, 1.0, 3.0] {
                let ratio = found.density(frequency) / truth.density(frequency);
                assert!((0.75..=1.33).contains(&ratio), "{correlation} at {frequency}: {ratio}");
            }
        }
    }
}

#[test]
fn noise_that_rises_to_the_highest_frequencies_is_found_beside_a_signal() {
    // The last is the sum of two, one of which falls: as strong at both ends, and weak between them.
    for (falls, rises) in [(0.0, -0.3), (0.0, -0.5), (0.0, -0.7), (0.7, -0.6)] {
        for amplitude in [0.0, 30.0] {
            let mut samples = first_order(rises, 7, |i| amplitude * (i * 0.02).sin());
            let mut first_order_noises = vec![(rises, 1.0)];
            if falls > 0.0 {
                samples.iter_mut().zip(first_order(falls, 8, |_| 0.0)).for_each(|(sample, other)| *sample += other);
                first_order_noises.push((falls, 1.0));
            }
            let white = sigma(&samples).powi(2);
            let found = coloured_noise(&samples.as_slice(), white, Instructions::current());
            let truth = CorrelatedNoise::new(0.0, first_order_noises);
            for frequency in [0.05, 0.1, 0.3, 1.0, 2.5] {
                let ratio = found.density(frequency) / truth.density(frequency);
                assert!((0.7..=1.4).contains(&ratio), "{falls}, {rises} at {frequency}: {ratio}");
            }
        }
    }
}

#[test]
fn a_little_colour_is_found_in_short_records() {
    let colour = |samples: &[f64]| coloured_noise(&samples, 1.0, Instructions::current());
    for seed in 0..40 {
        // By chance the four shortest windows may each agree with white noise.
        assert!(!colour(&first_order(0.5, 100 + seed, |_| 0.0)[..2000]).is_white(), "seed {seed}");
        assert!(colour(&normal(200 + seed, 2000)).is_white(), "seed {seed}");
    }
}

#[test]
fn what_is_white_or_no_noise_has_no_colour() {
    let colour = |samples: &[f64]| coloured_noise(&samples, 1.0, Instructions::current());
    let white: Vec<f64> = wave(20_000).zip(normal(11, 20_000)).map(|(wave, e)| 30.0 * wave + e).collect();
    assert_eq!(colour(&white), CorrelatedNoise::white(1.0));
    // A random walk goes on rising to the lowest frequencies, and steps are rare and large.
    let mut level = 0.0;
    let walk = normal(12, 20_000).into_iter().map(|e| {
        level += e;
        level
    });
    assert!(colour(&walk.collect::<Vec<f64>>()).is_white());
    let steps: Vec<f64> = normal(13, 20_000)
        .into_iter()
        .enumerate()
        .map(|(i, e)| 0.1 * e + if i % 900 < 450 { 3.0 } else { 0.0 })
        .collect();
    assert!(colour(&steps).is_white());
    assert!(colour(&first_order(0.8, 14, |_| 0.0)[..500]).is_white());
    assert!(colour(&[f64::NAN; 2000]).is_white());
}

/// Noise of variance one behind a filter that the last samples go through, over a signal.
fn behind(filter: &[f64], seed: u64, signal: impl Fn(f64) -> f64) -> Vec<f64> {
    let size = filter.iter().map(|weight| weight * weight).sum::<f64>().sqrt();
    let white = normal(seed, 20_000 + filter.len());
    let passed = white.windows(filter.len()).map(|last| last.iter().zip(filter).map(|(e, w)| e * w).sum::<f64>());
    passed.enumerate().map(|(i, e)| e / size + signal(i as f64)).collect()
}

#[test]
fn noise_behind_a_low_pass_filter_is_told_from_motion() {
    let colour = |samples: &[f64]| coloured_or_low_passed_noise(&samples, 0.1, Instructions::current());
    // Means of neighbours, and two real poles.
    let poles: Vec<f64> = (0..60).map(|k| 0.7_f64.powi(k + 1) - 0.4_f64.powi(k + 1)).collect();
    for filter in [vec![1.0; 2], vec![1.0; 3], vec![1.0; 5], poles] {
        // Where no motion rises from it noise of so low a corner may be motion.
        let amplitudes: &[f64] = if filter.len() > 3 { &[30.0] } else { &[0.0, 30.0] };
        for &amplitude in amplitudes {
            let found = colour(&behind(&filter, 7, |i| amplitude * (i * 0.02).sin()));
            let size: f64 = filter.iter().map(|weight| weight * weight).sum();
            for frequency in [0.05, 0.1, 0.3, 0.6] {
                let turned = |part: fn(f64) -> f64| -> f64 {
                    (0..).zip(&filter).map(|(k, weight)| weight * part(f64::from(k) * frequency)).sum()
                };
                let truth = (turned(f64::cos).powi(2) + turned(f64::sin).powi(2)) / size;
                let ratio = found.density(frequency) / truth;
                assert!((0.7..=1.4).contains(&ratio), "{} at {frequency}: {ratio}", filter.len());
            }
            assert!((0.8..=1.25).contains(&found.variance()), "{}: {}", filter.len(), found.variance());
        }
    }
}

#[test]
fn a_motion_of_limited_band_is_no_noise() {
    let colour = |samples: &[f64]| coloured_or_low_passed_noise(&samples, 1e-6, Instructions::current());
    // 40 waves up to a tenth of the sample rate, alone and with white noise.
    let motion = |i: f64| (1..=40).map(|k| (i * 0.0157 * f64::from(k) + f64::from(k * k)).sin()).sum::<f64>();
    for noise in [0.0, 1e-3, 0.1] {
        let samples: Vec<f64> =
            (0..20_000).zip(normal(3, 20_000)).map(|(i, e)| motion(f64::from(i)) + noise * e).collect();
        assert!(colour(&samples).is_white(), "{noise}");
    }
}
