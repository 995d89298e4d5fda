//! Derivatives of a basis at many places of a window.

use crate::local_polynomials::basis::{Basis, MOST_DEGREES};

/// Derivatives of the polynomials of a basis in working precision, for many places: [`Basis::evaluate`] has twice that and takes ten times as long.
pub(crate) struct Slopes {
    /// `b_0 = 0, b_1, …` of the recurrence in [`crate::local_polynomials::basis`].
    recurrence: Vec<f64>,
}

impl Slopes {
    pub(crate) fn new(basis: &Basis) -> Self {
        let m = basis.length() as f64;
        let square = |j: f64| j * j * (m * m - j * j) / (4.0 * (4.0 * j * j - 1.0));
        Self { recurrence: (0..basis.degrees()).map(|j| square(j as f64).abs().sqrt()).collect() }
    }

    /// The derivative of every polynomial at a sample of the window: differentiating the recurrence `d` times adds `d q_j^(d-1)`.
    pub(crate) fn at(&self, basis: &Basis, place: usize, derivative: usize) -> [f64; MOST_DEGREES] {
        let (x, degrees) = (basis.position(place), basis.degrees());
        let mut values = [0.0; MOST_DEGREES];
        values.iter_mut().take(degrees).enumerate().for_each(|(degree, value)| *value = basis.value(degree, place));
        for d in 1..=derivative {
            // The derivative of the last degree and of this one, while `values` still holds the one below.
            let (mut last, mut current) = (0.0, 0.0);
            for (j, value) in values.iter_mut().enumerate().take(degrees) {
                let below = std::mem::replace(value, current);
                if let Some(next) = self.recurrence.get(j + 1) {
                    let following = (x * current + d as f64 * below - self.recurrence[j] * last) / next;
                    (last, current) = (current, following);
                }
            }
        }
        values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_in_working_precision_are_as_good_as_it() {
        for length in [17, 51, 201, 2001] {
            let basis = Basis::new(length, 16);
            for place in (0..length).step_by(1 + length / 50) {
                for derivative in 0..4 {
                    let found = Slopes::new(&basis).at(&basis, place, derivative);
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
