//! The noise of a channel is found whatever its signal, and never below quantisation and rounding.

use tvident::noise::{FEWEST_SAMPLES, noise};
use tvident::simd::Instructions;

/// Sums of twelve uniform numbers: nearly normal, of variance one.
fn normal(seed: u64, count: usize) -> Vec<f64> {
    let mut state = seed | 1;
    let mut uniform = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    (0..count).map(|_| (0..12).map(|_| uniform()).sum()).collect()
}

fn wave(count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(|i| (i as f64 * 0.05).sin() + 0.5 * (i as f64 * 0.11).cos())
}

fn sigma(samples: &[f64]) -> f64 {
    noise(&samples, None, Instructions::current()).expect("long enough").sigma
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
    let found = noise(&coarse.as_slice(), None, Instructions::current()).expect("long enough");
    assert!((found.quantisation / step - 1.0).abs() < 1e-9);
    assert!(found.sigma >= step / 12_f64.sqrt() && found.sigma < 1.1 * step / 12_f64.sqrt());
    let resting = [7.0; 400];
    assert_eq!(
        noise(&resting.as_slice(), Some(step), Instructions::current()).map(|found| found.sigma),
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
    let message = noise(&short.as_slice(), None, Instructions::current()).expect_err("too short").to_string();
    assert!(message.contains("at least 25 samples"), "{message}");
    assert!(noise(&[0.0; FEWEST_SAMPLES].as_slice(), None, Instructions::current()).is_ok());
}
