//! Properties of test functions: their kernels are derivatives, and the weak equation of motion holds to rounding.

use proptest::prelude::*;
use tvident::weak_form::TestFunction;

/// Of sums of up to 79 numbers below 800, twice the square of the highest exponent.
const ROUNDING: f64 = 79.0 * 800.0 * f64::EPSILON;

fn dot(kernel: &[f64], samples: impl Fn(f64) -> f64, half: usize, delta: f64) -> f64 {
    kernel.iter().enumerate().map(|(k, value)| value * samples((k as f64 - half as f64) * delta)).sum()
}

proptest! {
    #[test]
    fn kernels_are_derivatives_of_the_test_function(half in 80..300_usize, exponent in 8..13_usize, cycles in 0.1..3.0_f64) {
        let delta = 1e-3;
        let function = TestFunction::new(half, exponent, delta).expect("valid");
        let kernels = function.kernels(0.0);
        let omega = cycles * 2.0 * std::f64::consts::PI / (half as f64 * delta);
        let (angle, velocity) = (|t: f64| (omega * t + 0.3).sin(), |t: f64| omega * (omega * t + 0.3).cos());
        let acceleration = |t: f64| -omega * omega * (omega * t + 0.3).sin();
        let [inertia, damping, stiffness] = &kernels.values;
        let at = |kernel: &[f64], samples: &dyn Fn(f64) -> f64| dot(kernel, samples, half, delta);
        // What is integrated by parts: ⟨φ″θ⟩ = ⟨φθ̈⟩ and -⟨φ′θ⟩ = ⟨φθ̇⟩.
        prop_assert!((at(inertia, &angle) - at(stiffness, &acceleration)).abs() < 1e-11 * omega * omega);
        prop_assert!((at(damping, &angle) - at(stiffness, &velocity)).abs() < 1e-11 * omega);
        // The same for coefficients that grow with time: ⟨(τφ)″θ⟩ = ⟨φ τ θ̈⟩.
        let window = half as f64 * delta;
        let [inertia, damping, slope] = &kernels.slopes;
        prop_assert!((at(inertia, &angle) - at(slope, &acceleration)).abs() < 1e-11 * omega * omega * window);
        prop_assert!((at(damping, &angle) - at(slope, &velocity)).abs() < 1e-11 * omega * window);
        prop_assert!((kernels.values[2].iter().sum::<f64>() - 1.0).abs() < 1e-13);
    }

    #[test]
    fn a_constant_is_exact_however_narrow_the_test_function(
        half in 4..40_usize,
        exponent in 3..21_usize,
        shift in -0.5..0.5_f64,
    ) {
        let kernels = TestFunction::new(half, exponent, 1.0).expect("valid").kernels(shift);
        for (index, kernel) in kernels.values.iter().chain(&kernels.slopes).enumerate() {
            let expected = if index == 2 { 1.0 } else { 0.0 };
            prop_assert!((kernel.iter().sum::<f64>() - expected).abs() < ROUNDING);
        }
    }

    #[test]
    fn a_shifted_kernel_reads_what_came_late(half in 80..300_usize, shift in -0.5..0.5_f64) {
        let function = TestFunction::new(half, 9, 1.0).expect("valid");
        let omega = 4.0 / half as f64;
        let on_time = dot(&function.kernels(0.0).values[2], |t| (omega * t).cos(), half, 1.0);
        let late = dot(&function.kernels(shift).values[2], |t| (omega * (t - shift)).cos(), half, 1.0);
        prop_assert!((on_time - late).abs() < 1e-12);
    }
}

#[test]
fn what_is_no_test_function_is_refused() {
    let message = TestFunction::new(50, 2, 1.0).expect_err("too flat an end").to_string();
    assert!(message.contains("exponent must be between 3 and 20; got 2"), "{message}");
    let message = TestFunction::new(3, 9, 1.0).expect_err("too short").to_string();
    assert!(message.contains("at least 9 samples; got 7"), "{message}");
}
