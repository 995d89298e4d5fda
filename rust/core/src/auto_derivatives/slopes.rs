//! Derivatives of a basis at many places of a window.

use crate::auto_derivatives::deconvolution::AtCentre;
use crate::local_polynomials::basis::{Basis, MOST_DEGREES};

/// A derivative at the samples of a window that is made of means, or of samples.
pub(crate) struct SampleSlopes<'a> {
    basis: &'a Basis,
    step: usize,
    derivative: usize,
    /// The polynomials whose means those of the basis are, in terms of the basis; none where they are the same.
    polynomials: Vec<Vec<f64>>,
}

impl<'a> SampleSlopes<'a> {
    pub(crate) fn new(basis: &'a Basis, step: usize, derivative: usize, degrees: usize) -> Self {
        let polynomials = if step == 1 { Vec::new() } else { AtCentre::new(basis, step).polynomials(degrees) };
        Self { basis, step, derivative, polynomials }
    }

    /// The derivative of every polynomial of the basis at a sample.
    pub(crate) fn of_basis(&self, place: usize) -> [f64; MOST_DEGREES] {
        if self.step == 1 {
            return slopes(self.basis, place, self.derivative);
        }
        let centre = self.basis.length() * self.step / 2;
        slopes_between(self.basis, (place as f64 - centre as f64) / self.step as f64, self.derivative)
    }

    /// The derivative of what every coefficient belongs to.
    pub(crate) fn of_coefficients(&self, place: usize) -> [f64; MOST_DEGREES] {
        let of_basis = self.of_basis(place);
        if self.step == 1 {
            return of_basis;
        }
        let mut slopes = [0.0; MOST_DEGREES];
        for (value, polynomial) in slopes.iter_mut().zip(&self.polynomials) {
            *value = polynomial.iter().zip(of_basis).map(|(factor, slope)| factor * slope).sum();
        }
        slopes
    }

    /// What coefficients are of the derivatives of the basis: for many places.
    pub(crate) fn combined(&self, coefficients: &[f64]) -> Vec<f64> {
        if self.step == 1 {
            return coefficients.to_vec();
        }
        let mut sums = vec![0.0; coefficients.len()];
        for (c, polynomial) in coefficients.iter().zip(&self.polynomials) {
            sums.iter_mut().zip(polynomial).for_each(|(sum, factor)| *sum += c * factor);
        }
        sums
    }
}

/// The derivative of every polynomial of a basis at a sample of the window, in working precision: [`Basis::evaluate`] has twice that and takes ten
/// times as long.
fn slopes(basis: &Basis, place: usize, derivative: usize) -> [f64; MOST_DEGREES] {
    let mut values = [0.0; MOST_DEGREES];
    let known = values.iter_mut().take(basis.degrees()).enumerate();
    known.for_each(|(degree, value)| *value = basis.value(degree, place));
    for d in 1..=derivative {
        climb(basis, basis.position(place), d, &mut values);
    }
    values
}

/// The same at any position, from the centre, of a window that is much longer than the basis has polynomials.
fn slopes_between(basis: &Basis, x: f64, derivative: usize) -> [f64; MOST_DEGREES] {
    let mut values = [0.0; MOST_DEGREES];
    for d in 0..=derivative {
        climb(basis, x, d, &mut values);
    }
    values
}

/// The `d`-th derivatives from those below.
fn climb(basis: &Basis, x: f64, d: usize, values: &mut [f64; MOST_DEGREES]) {
    // The derivative of the last degree and of this one, while `values` still holds the one below.
    let mut last = 0.0;
    let mut current = if d == 0 { 1.0 / (basis.length() as f64).sqrt() } else { 0.0 };
    for (value, (ratio, inverse)) in values.iter_mut().zip(basis.steps()).take(basis.degrees()) {
        let below = std::mem::replace(value, current);
        let following = (x * current + d as f64 * below) * inverse - ratio * last;
        (last, current) = (current, following);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coefficients_combined_give_the_same_derivative() {
        let basis = Basis::new(97, 8).expect("little memory");
        let coefficients: Vec<f64> = (0..8).map(|j| 1.0 / f64::from(j + 1)).collect();
        for (step, derivative) in [(1, 0), (1, 2), (3, 1), (9, 2)] {
            let slopes = SampleSlopes::new(&basis, step, derivative, 8);
            let combined = slopes.combined(&coefficients);
            for place in [0, 1, 40 * step, 97 * step - 1] {
                let sum = |slopes: [f64; MOST_DEGREES], factors: &[f64]| -> f64 {
                    factors.iter().zip(slopes).map(|(factor, slope)| factor * slope).sum()
                };
                let (one, other) =
                    (sum(slopes.of_basis(place), &combined), sum(slopes.of_coefficients(place), &coefficients));
                assert!((one - other).abs() < 1e-13 * one.abs().max(1.0), "{one} {other}");
            }
        }
    }

    #[test]
    fn derivatives_in_working_precision_are_as_good_as_it() {
        for length in [17, 51, 201, 2001] {
            let basis = Basis::new(length, 16).expect("little memory");
            for place in (0..length).step_by(1 + length / 50) {
                for derivative in 0..4 {
                    let found = slopes(&basis, place, derivative);
                    let expected = basis.evaluate(basis.position(place), derivative);
                    let mut size = 0.0_f64;
                    for (value, expected) in found.iter().zip(&expected) {
                        size = size.max(expected.abs());
                        // Three roundings a degree, and derivatives upon each other.
                        assert!(
                            (value - expected).abs() <= 100.0 * f64::EPSILON * size,
                            "{derivative} at {place} of {length}"
                        );
                    }
                }
            }
        }
    }
}
