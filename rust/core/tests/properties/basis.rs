//! Properties of the orthonormal basis, and the thin QR of a Legendre Vandermonde matrix as an independent reference.

use faer::Mat;
use proptest::prelude::*;
use tvident::local_polynomials::Basis;

/// Orthogonality to degree 15, and above it: two hundred roundings of numbers below one, far from the accuracy that
/// derivatives need (1e-9 of scale).
const ORTHOGONALITY: f64 = 1e-12;
const ORTHOGONALITY_ABOVE_15: f64 = 1e-11;
/// The QR reference itself is only good to some 1e-14 times the number of columns.
const REFERENCE: f64 = 1e-13;

/// The sum by pairs: its own rounding must not hide the basis's.
fn pairwise_sum(terms: &[f64]) -> f64 {
    if terms.len() <= 8 {
        return terms.iter().sum();
    }
    let (left, right) = terms.split_at(terms.len() / 2);
    pairwise_sum(left) + pairwise_sum(right)
}

fn largest_inner_product_error(basis: &Basis, degrees: usize) -> f64 {
    let column = |j: usize| (0..basis.length()).map(move |k| basis.value(j, k));
    let mut worst = 0.0_f64;
    for i in 0..degrees {
        for j in 0..=i {
            let products: Vec<f64> = column(i).zip(column(j)).map(|(a, b)| a * b).collect();
            worst = worst.max((pairwise_sum(&products) - f64::from(i == j)).abs());
        }
    }
    worst
}

#[test]
fn the_basis_is_orthonormal_for_every_window() {
    for length in [5, 16, 17, 20, 21, 22, 51, 201, 400, 2001, 20_001, 100_001] {
        let basis = Basis::new(length, length.min(20)).expect("little memory");
        assert!(largest_inner_product_error(&basis, length.min(16)) <= ORTHOGONALITY, "window {length} to degree 15");
        assert!(largest_inner_product_error(&basis, length.min(20)) <= ORTHOGONALITY_ABOVE_15, "window {length}");
    }
}

#[test]
fn the_basis_is_the_thin_qr_of_a_legendre_vandermonde_matrix() {
    for length in [17, 51, 201, 2001] {
        let degrees = 16;
        let mut vandermonde = Mat::<f64>::zeros(length, degrees);
        for k in 0..length {
            let x = 2.0 * k as f64 / (length - 1) as f64 - 1.0;
            let (mut last, mut current) = (0.0, 1.0);
            for j in 0..degrees {
                vandermonde[(k, j)] = current;
                let degree = j as f64;
                (last, current) = (current, ((2.0 * degree + 1.0) * x * current - degree * last) / (degree + 1.0));
            }
        }
        let q = vandermonde.qr().compute_thin_Q();
        let basis = Basis::new(length, degrees).expect("little memory");
        for j in 0..degrees {
            let sign = if (q[(length - 1, j)] < 0.0) == (basis.value(j, length - 1) < 0.0) { 1.0 } else { -1.0 };
            for k in 0..length {
                assert!(
                    (sign * q[(k, j)] - basis.value(j, k)).abs() < REFERENCE,
                    "window {length}, degree {j}, sample {k}"
                );
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn differences_follow_from_degree_to_degree(length in 5_usize..400, position in -1.0..1.0_f64) {
        let basis = Basis::new(length, length.min(20)).expect("little memory");
        // A position that one less than it is exact too.
        let x = (position * length as f64 * 512.0).round() / 1024.0;
        let (here, before, differences) = (basis.evaluate(x, 0), basis.evaluate(x - 1.0, 0), basis.differences());
        // The recurrence, and the same with all terms positive: what its rounding errors are a fraction of.
        let (mut last, mut current) = ([0.0; 2], [0.0; 2]);
        for j in 0..basis.degrees() {
            let [difference, size] = current.map(|value| differences.scale[j] * value);
            let allowed = 20.0 * f64::EPSILON * (size + here[j].abs() + before[j].abs());
            prop_assert!((here[j] - before[j] - difference).abs() <= allowed, "degree {j}");
            let (gain, damping) = (differences.gain[j], differences.damping[j]);
            let next = [
                last[0] + gain * here[j] - damping * current[0],
                last[1] + gain * here[j].abs() + damping * current[1],
            ];
            (last, current) = (current, next);
        }
    }

    #[test]
    fn polynomials_are_even_or_odd(length in 5_usize..400, d in 0_usize..4) {
        let basis = Basis::new(length, length.min(20)).expect("little memory");
        for index in 0..length {
            let mirror = length - 1 - index;
            for j in 0..basis.degrees() {
                let sign = if j % 2 == 0 { 1.0 } else { -1.0 };
                prop_assert_eq!(basis.value(j, index), sign * basis.value(j, mirror));
            }
        }
        let (right, left) = (basis.evaluate(1.5, d), basis.evaluate(-1.5, d));
        for j in 0..basis.degrees() {
            let sign = if (j + d) % 2 == 0 { 1.0 } else { -1.0 };
            prop_assert_eq!(right[j], sign * left[j]);
        }
    }
}
