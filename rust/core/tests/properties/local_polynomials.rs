//! Properties of the walk: it agrees with every window projected on its own, however the record is cut and whatever the instructions.

use crate::random::uniform;
use proptest::prelude::*;
use tvident::Status;
use tvident::lanes::Elements;
use tvident::local_polynomials::{Basis, Criterion, Estimates, LocalPolynomials, Order, PolynomialOptions, Selection};
use tvident::simd::Instructions;

/// Everything a plan estimates, for all samples of a record.
#[derive(Clone, Debug, PartialEq)]
struct Everything {
    derivatives: Vec<Vec<f64>>,
    order: Vec<u8>,
    status: Vec<u16>,
    sigma: Vec<f64>,
}

fn chosen(window_length: usize, highest: usize) -> PolynomialOptions {
    PolynomialOptions {
        window_length,
        order: Order::Chosen { criterion: Criterion::Aicc, highest },
        selection: Selection::Window,
        derivatives: vec![0, 1, 2],
        delta: 1.0,
        noise: true,
        quantisation: 0.0,
        instructions: Instructions::current(),
    }
}

fn run_in_pieces(options: PolynomialOptions, record: &[f64], cuts: &[usize]) -> Everything {
    let count = options.derivatives.len();
    let plan = LocalPolynomials::new(options).expect("valid options");
    let n = record.len();
    let mut all = Everything {
        derivatives: vec![vec![0.0; n]; count],
        order: vec![0; n],
        status: vec![0; n],
        sigma: vec![0.0; n],
    };
    let mut scratch = plan.scratch();
    let mut bounds = vec![0];
    bounds.extend(cuts.iter().map(|cut| cut % (n + 1)));
    bounds.push(n);
    bounds.sort_unstable();
    for piece in bounds.windows(2) {
        let (first, end) = (piece[0], piece[1]);
        let mut estimates = Estimates {
            elements: Elements { first, step: 1 },
            derivatives: all.derivatives.iter_mut().map(|derivative| &mut derivative[first..end]).collect(),
            order: &mut all.order[first..end],
            status: &mut all.status[first..end],
            sigma: &mut all.sigma[first..end],
        };
        plan.estimate(&record, first..end, &mut estimates, &mut scratch).expect("the record is long enough");
    }
    all
}

fn run(options: PolynomialOptions, record: &[f64]) -> Everything {
    run_in_pieces(options, record, &[])
}

/// Every window on its own: value and two derivatives of every order, and every order's score.
fn by_hand(window: &[f64], highest: usize) -> (Vec<[f64; 3]>, Vec<f64>) {
    let m = window.len();
    let degrees = (0..=highest).take_while(|&n| Criterion::Aicc.penalty(n, m).is_some()).count();
    let basis = Basis::new(m, degrees).expect("little memory");
    let level = window[m / 2];
    let mut rest: Vec<f64> = window.iter().map(|value| value - level).collect();
    let mut derivatives = Vec::new();
    let mut scores = Vec::new();
    let mut estimate = [level, 0.0, 0.0];
    let tables: Vec<Vec<f64>> = (0..3).map(|d| basis.evaluate(0.0, d)).collect();
    for j in 0..degrees {
        let c: f64 = (0..m).map(|k| basis.value(j, k) * rest[k]).sum();
        for (k, value) in rest.iter_mut().enumerate() {
            *value -= c * basis.value(j, k);
        }
        for (value, table) in estimate.iter_mut().zip(&tables) {
            *value += c * table[j];
        }
        derivatives.push(estimate);
        let residual: f64 = rest.iter().map(|value| value * value).sum();
        scores.push(Criterion::Aicc.score(residual, j, m));
    }
    (derivatives, scores)
}

fn noise(seed: u64, n: usize) -> Vec<f64> {
    let mut uniform = uniform(seed);
    (0..n).map(|_| uniform() + uniform() + uniform()).collect()
}

fn signal(seed: u64, n: usize, level: f64) -> Vec<f64> {
    let wave = |i: usize| (i as f64 * 0.05).sin() + 0.5 * (i as f64 * 0.17).cos();
    noise(seed, n).into_iter().enumerate().map(|(i, e)| wave(i) + level * e).collect()
}

/// Scores closer than this are a tie: rounding decides.
const TIE: f64 = 1e-6;
/// Derivatives agree to this fraction of the largest.
const SCALE: f64 = 1e-9;

proptest! {
    #![proptest_config(ProptestConfig { cases: ProptestConfig::default().cases / 6, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_window_is_as_if_projected_alone(
        seed: u64, half in 2_usize..130, more in 0_usize..300, highest in 0_usize..=15, level in 1e-4..1.0_f64,
    ) {
        let m = 2 * half + 1;
        let record = signal(seed, m + more, level);
        let found = run(chosen(m, highest), &record);
        let scale: Vec<f64> =
            found.derivatives.iter().map(|d| d.iter().fold(0.0_f64, |a, b| a.max(b.abs()))).collect();
        for i in half..record.len() - half {
            let (derivatives, scores) = by_hand(&record[i - half..=i + half], highest);
            let best = scores.iter().copied().fold(f64::INFINITY, f64::min);
            let order = usize::from(found.order[i]);
            prop_assert!(scores[order] - best < TIE, "sample {i}: order {order} of {scores:?}");
            for d in 0..3 {
                let error = (found.derivatives[d][i] - derivatives[order][d]).abs();
                prop_assert!(error <= SCALE * scale[d], "sample {i}, derivative {d}: error {error}, scale {}", scale[d]);
            }
        }
    }

    #[test]
    fn any_cutting_gives_the_same_bits(
        seed: u64, half in 2_usize..60, more in 0_usize..2000, cuts in prop::collection::vec(any::<usize>(), 0..6),
    ) {
        let record = signal(seed, 2 * half + 1 + more, 0.01);
        let options = chosen(2 * half + 1, 15);
        prop_assert_eq!(run_in_pieces(options.clone(), &record, &cuts), run(options, &record));
    }

    #[test]
    fn every_path_gives_the_same_numbers(seed: u64, half in 2_usize..60, more in 0_usize..500) {
        let record = signal(seed, 2 * half + 1 + more, 0.01);
        let options = chosen(2 * half + 1, 15);
        let fastest = run(options.clone(), &record);
        for instructions in Instructions::available() {
            let other = run(PolynomialOptions { instructions, ..options.clone() }, &record);
            for i in 0..record.len() {
                if fastest.order[i] == other.order[i] {
                    for d in 0..3 {
                        let error = (fastest.derivatives[d][i] - other.derivatives[d][i]).abs();
                        prop_assert!(error <= SCALE * (1.0 + fastest.derivatives[d][i].abs()), "{instructions:?}, sample {i}");
                    }
                } else {
                    let window = i.clamp(half, record.len() - 1 - half);
                    let (_, scores) = by_hand(&record[window - half..=window + half], 15);
                    let difference = scores[usize::from(fastest.order[i])] - scores[usize::from(other.order[i])];
                    prop_assert!(difference.abs() < TIE, "{instructions:?}, sample {i}: no tie, {difference}");
                }
            }
        }
    }

    #[test]
    fn what_is_no_number_stays_in_its_own_windows(
        seed: u64, half in 2_usize..40, more in 100_usize..600, places in prop::collection::vec(any::<usize>(), 1..4),
        glitch in prop::sample::select(vec![f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300]),
    ) {
        let clean = signal(seed, 2 * half + 1 + more, 0.01);
        let mut record = clean.clone();
        for place in &places {
            record[place % clean.len()] = glitch;
        }
        let options = chosen(2 * half + 1, 7);
        let (found, expected) = (run(options.clone(), &record), run(options, &clean));
        for i in 0..record.len() {
            let centre = i.clamp(half, record.len() - 1 - half);
            let hit = record[centre - half..=centre + half].iter().any(|value| value.abs() > 1e100 || value.is_nan());
            let invalid = found.status[i] & Status::INVALID.bits() != 0;
            prop_assert_eq!(hit, invalid, "sample {}", i);
            prop_assert_eq!(found.derivatives[0][i].is_nan(), invalid);
            if !invalid && found.order[i] == expected.order[i] {
                for d in 0..3 {
                    let error = (found.derivatives[d][i] - expected.derivatives[d][i]).abs();
                    prop_assert!(error < 1e-9, "sample {i}, derivative {d}: {error}");
                }
            }
        }
    }
}

#[test]
fn a_glitch_leaves_nothing_behind() {
    for m in [51, 201, 2001] {
        let clean = signal(7, 4 * m, 1e-3);
        let mut record = clean.clone();
        record[2 * m] = 1e8;
        let (found, expected) = (run(chosen(m, 15), &record), run(chosen(m, 15), &clean));
        for i in (0..record.len()).filter(|i| i.abs_diff(2 * m) > m / 2) {
            for d in 0..3 {
                let error = (found.derivatives[d][i] - expected.derivatives[d][i]).abs();
                assert!(error <= 1e-9, "window {m}, sample {i}, derivative {d}: {error}");
            }
        }
    }
}

#[test]
fn a_polynomial_is_its_own_fit_and_exact() {
    let record: Vec<f64> = (0..500).map(|i| f64::from(i) / 100.0).map(|t| 1.0 - t + 0.5 * t * t * t).collect();
    let found = run(PolynomialOptions { delta: 0.01, ..chosen(51, 15) }, &record);
    for (i, &value) in record.iter().enumerate() {
        let t = i as f64 / 100.0;
        assert_eq!(found.order[i], 3, "sample {i}");
        assert_ne!(found.status[i] & Status::EXACT.bits(), 0);
        assert!((found.derivatives[0][i] - value).abs() < 1e-11);
        assert!((found.derivatives[1][i] - (1.5 * t * t - 1.0)).abs() < 1e-9);
        assert!((found.derivatives[2][i] - 3.0 * t).abs() < 1e-6, "{}", found.derivatives[2][i] - 3.0 * t);
    }
}

#[test]
fn a_resting_encoder_takes_the_lowest_order() {
    let found = run(chosen(51, 15), &[0.3; 400]);
    assert!(found.order.iter().all(|&order| order == 0));
    assert!(found.derivatives[0].iter().all(|&value| value == 0.3));
    assert!(found.sigma.iter().all(|&sigma| sigma == 0.0));
    assert!(found.status.iter().all(|&status| status & Status::EXACT.bits() != 0));
}
