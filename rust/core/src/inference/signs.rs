//! Signs that tell that inertia, damping and stiffness were not told apart: no machine has an inertia of both signs.
//!
//! In windows that hold a single frequency, as those of a sweep do, inertia and stiffness trade places for next to nothing. What the
//! equation does not hold, as a lag, then moves both far beyond their errors, which know of noise alone.

use crate::regression::limits::{NEGATIVE_BEYOND, OFTEN};

const INERTIA: usize = 0;
const STIFFNESS: usize = 2;

/// Correlation of errors from which on inertia and stiffness trade places: a stiffness beside it may have any sign. It is .96 to .996 in sweeps
/// that are flagged, and .06 to .3 in broadband motion under a stiffness that has both signs.
const TRADED: f64 = 0.98;

/// What changes along a record: values and errors by unknown, and covariances by pair of them.
pub(crate) struct Changing<'a> {
    pub(crate) unknowns: &'a [usize],
    pub(crate) values: &'a [Vec<f64>],
    pub(crate) errors: &'a [Vec<f64>],
    pub(crate) pairs: &'a [(usize, usize)],
    pub(crate) covariances: &'a [Vec<f64>],
}

impl Changing<'_> {
    /// Whether the inertia has both signs, or the stiffness does where errors of an inertia that changes are its own, beyond errors and more often
    /// than by chance.
    pub(crate) fn signs_contradict(&self) -> bool {
        let place = |unknown: usize| self.unknowns.iter().position(|&one| one == unknown);
        let Some(inertia) = place(INERTIA) else { return false };
        if self.has_both_signs(inertia, |_| true) {
            return true;
        }
        let is_it = |&(one, other): &(usize, usize)| (one.min(other), one.max(other)) == (INERTIA, STIFFNESS);
        let covariance = self.pairs.iter().position(is_it).map(|pair| &self.covariances[pair]);
        place(STIFFNESS).zip(covariance).is_some_and(|(stiffness, covariance)| {
            let are_traded =
                |at: usize| covariance[at].abs() > TRADED * self.errors[inertia][at] * self.errors[stiffness][at];
            self.has_both_signs(stiffness, are_traded)
        })
    }

    /// Whether some values that count are negative and others positive, beyond their errors and more often than by chance.
    fn has_both_signs(&self, place: usize, counts: impl Fn(usize) -> bool) -> bool {
        let (mut known, mut below, mut above) = (0_usize, 0_usize, 0_usize);
        for (at, (value, error)) in self.values[place].iter().zip(&self.errors[place]).enumerate() {
            if value.is_finite() && error.is_finite() {
                known += 1;
                below += usize::from(*value < -NEGATIVE_BEYOND * error && counts(at));
                above += usize::from(*value > NEGATIVE_BEYOND * error && counts(at));
            }
        }
        below.min(above) as f64 > OFTEN * known as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of which so many of a hundred are negative.
    fn values(negative: usize) -> Vec<f64> {
        (0..100).map(|place| if place < negative { -1.0 } else { 1.0 }).collect()
    }

    /// Whether signs of some unknowns contradict each other, whose errors are a tenth and correlated so much.
    fn contradicts(unknowns: &[usize], values: &[Vec<f64>], correlation: f64) -> bool {
        let errors = vec![vec![0.1; 100]; values.len()];
        let (pairs, covariances) = ([(2, 0)], [vec![0.01 * correlation; 100]]);
        Changing { unknowns, values, errors: &errors, pairs: &pairs, covariances: &covariances }.signs_contradict()
    }

    #[test]
    fn an_inertia_of_both_signs_contradicts() {
        for (negative, found) in [(0, false), (5, false), (6, true), (94, true), (95, false)] {
            assert_eq!(contradicts(&[0, 2], &[values(negative), values(0)], 0.0), found, "{negative} of 100");
        }
        let uncertain = [values(50)];
        let errors = [vec![0.6; 100]];
        let one = Changing { unknowns: &[0], values: &uncertain, errors: &errors, pairs: &[], covariances: &[] };
        assert!(!one.signs_contradict());
    }

    #[test]
    fn a_stiffness_of_both_signs_contradicts_where_errors_of_the_inertia_are_its_own() {
        for (correlation, found) in [(0.99, true), (-0.99, true), (0.9, false), (0.0, false)] {
            assert_eq!(contradicts(&[0, 2], &[values(0), values(50)], correlation), found, "{correlation}");
        }
        assert!(!contradicts(&[2], &[values(50)], 0.99));
        assert!(!contradicts(&[0, 1], &[values(0), values(50)], 0.99));
    }

    #[test]
    fn what_is_no_number_does_not_count() {
        let mut some = values(50);
        some[..60].fill(f64::NAN);
        assert!(!contradicts(&[0], &[some], 0.0));
    }
}
