//! Signs that tell that inertia, damping and stiffness were not told apart: no machine has an inertia of both signs.
//!
//! In windows that hold a single frequency, as those of a sweep do, inertia and stiffness trade places for next to nothing. What the
//! equation does not hold, as a lag, then moves both far beyond their errors, which know of noise alone.

use crate::regression::limits::{NEGATIVE_BEYOND, OFTEN};

const INERTIA: usize = 0;
const STIFFNESS: usize = 2;

/// Whether the inertia has both signs, or the stiffness does beside an inertia that changes, beyond errors and more often than by chance.
/// What changes is given by unknown, with its values and errors.
pub(crate) fn signs_contradict(changing: &[usize], values: &[Vec<f64>], errors: &[Vec<f64>]) -> bool {
    let place = |unknown: usize| changing.iter().position(|&one| one == unknown);
    let has_both = |place: usize| has_both_signs(&values[place], &errors[place]);
    place(INERTIA).is_some_and(|inertia| has_both(inertia) || place(STIFFNESS).is_some_and(has_both))
}

/// Whether some values are negative and others positive, beyond their errors and more often than by chance.
fn has_both_signs(values: &[f64], errors: &[f64]) -> bool {
    let (mut known, mut below, mut above) = (0_usize, 0_usize, 0_usize);
    for (value, error) in values.iter().zip(errors).filter(|(value, error)| value.is_finite() && error.is_finite()) {
        known += 1;
        below += usize::from(*value < -NEGATIVE_BEYOND * error);
        above += usize::from(*value > NEGATIVE_BEYOND * error);
    }
    below.min(above) as f64 > OFTEN * known as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of which so many of a hundred are negative.
    fn values(negative: usize) -> Vec<f64> {
        (0..100).map(|place| if place < negative { -1.0 } else { 1.0 }).collect()
    }

    #[test]
    fn an_inertia_of_both_signs_contradicts() {
        for (negative, error, contradicts) in
            [(0, 0.1, false), (5, 0.1, false), (6, 0.1, true), (94, 0.1, true), (95, 0.1, false), (50, 0.6, false)]
        {
            let found = signs_contradict(&[0, 2], &[values(negative), values(0)], &[vec![error; 100], vec![0.1; 100]]);
            assert_eq!(found, contradicts, "{negative} of 100, errors of {error}");
        }
    }

    #[test]
    fn a_stiffness_of_both_signs_contradicts_beside_an_inertia_that_changes_only() {
        let errors = vec![0.1; 100];
        assert!(signs_contradict(&[0, 2], &[values(0), values(50)], &[errors.clone(), errors.clone()]));
        assert!(!signs_contradict(&[2], &[values(50)], std::slice::from_ref(&errors)));
        assert!(!signs_contradict(&[0, 1], &[values(0), values(50)], &[errors.clone(), errors]));
    }

    #[test]
    fn what_is_no_number_does_not_count() {
        let mut some = values(50);
        some[..60].fill(f64::NAN);
        assert!(!signs_contradict(&[0], &[some], &[vec![0.1; 100]]));
    }
}
