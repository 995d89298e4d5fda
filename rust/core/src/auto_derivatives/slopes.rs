//! Derivatives of a basis at many places of a window.

use crate::local_polynomials::basis::{Basis, MOST_DEGREES};

/// The derivative of every polynomial of a basis at a sample of the window, in working precision: [`Basis::evaluate`] has twice that and takes ten
/// times as long.
pub(crate) fn slopes(basis: &Basis, place: usize, derivative: usize) -> [f64; MOST_DEGREES] {
    let mut values = [0.0; MOST_DEGREES];
    let known = values.iter_mut().take(basis.degrees()).enumerate();
    known.for_each(|(degree, value)| *value = basis.value(degree, place));
    for d in 1..=derivative {
        climb(basis, basis.position(place), d, &mut values);
    }
    values
}

/// The same at any position, from the centre, of a window that is much longer than the basis has polynomials.
pub(crate) fn slopes_between(basis: &Basis, x: f64, derivative: usize) -> [f64; MOST_DEGREES] {
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
