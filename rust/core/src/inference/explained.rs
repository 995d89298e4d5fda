//! Whether a fit explains the torque beyond chance.
//!
//! The equation of motion is homogeneous: with a torque that is nothing but noise, every parameter is zero as far as the equations tell,
//! though nothing but their scale is missing. So the rows that are left by a fit are compared with those that are left without the motion, in
//! units of one independent row. Where the torque has nothing to do with the angle, the difference is at most a χ² variable.

use crate::inference::constancy::chi_squared_beyond;
use crate::regression::row_covariance::RowCovariance;

/// A probability that no record reaches by chance: many windows were tried, and the one that predicts best was kept.
const NEVER_CHANCE: f64 = 1e-9;

/// So many times their mean the noise of rows may have at the frequencies of the motion: rows of a test function have 1.4 times at most.
const DENSEST: f64 = 1.5;

/// What is left of rows so small a part of what was there that no fit of noise leaves it: the shortest windows have fewer unknowns than
/// independent rows.
const PLAINLY: f64 = 0.1;

/// Sums of squares so small beside those of the torque are rounding.
const ROUNDING: f64 = 1e-24;

/// The rows' squares summed: of the torque, of what is left of it without the motion, and of what a fit leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Squares {
    pub(crate) torque: f64,
    pub(crate) without: f64,
    pub(crate) left: f64,
}

impl Squares {
    /// Whether rows are explained so well that nothing needs to be tested.
    pub(crate) fn are_plainly_explained(&self) -> bool {
        !self.are_rounding() && self.left < PLAINLY * self.without
    }

    /// Whether there is no torque beside rounding.
    pub(crate) fn are_rounding(&self) -> bool {
        self.without.is_nan() || self.without <= ROUNDING * self.torque
    }

    /// Whether so many rows, of which `inflation` carry the information of one, are explained beyond chance by so many unknowns.
    pub(crate) fn are_explained(&self, rows: f64, inflation: f64, unknowns: usize) -> bool {
        let independent = DENSEST * inflation * self.left / rows;
        !self.are_rounding()
            && (self.left == 0.0
                || chi_squared_beyond((self.without - self.left) / independent, unknowns) < NEVER_CHANCE)
    }
}

/// Whether a number with a standard error differs from zero by more than any chance.
pub(crate) fn is_no_chance(value: f64, error: f64) -> bool {
    error > 0.0 && chi_squared_beyond((value / error).powi(2), 1) < NEVER_CHANCE
}

/// Rows that carry the information of one, as those themselves show, which are up to so far correlated.
pub(crate) fn inflation(rows: &[f64], usable: &[bool], farthest: usize) -> f64 {
    let inflation = RowCovariance::of_residuals(rows, usable, farthest).variance_inflation();
    if inflation.is_finite() { inflation } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::simulated::random;

    #[test]
    fn what_chance_explains_is_not_explained() {
        let squares = |left: f64| Squares { torque: 100.0, without: 100.0, left };
        // The χ² that four unknowns exceed once in 10⁹ records is 48.0 (from tables), of 1000 rows, four of which make one.
        let independent = DENSEST * 4.0 / 1000.0;
        let limit = 100.0 / (1.0 + 48.0 * independent);
        assert!(!squares(limit + 0.5).are_explained(1000.0, 4.0, 4));
        assert!(squares(limit - 0.5).are_explained(1000.0, 4.0, 4));
        assert!(!squares(100.0).are_explained(1000.0, 4.0, 4));
        assert!(!squares(120.0).are_explained(1000.0, 4.0, 4));
    }

    #[test]
    fn no_torque_is_never_explained_and_an_exact_fit_always() {
        let of = |torque, without, left| Squares { torque, without, left };
        assert!(of(1.0, 1.0, 0.0).are_explained(100.0, 1.0, 3) && of(1.0, 1.0, 0.0).are_plainly_explained());
        for nothing in [of(0.0, 0.0, 0.0), of(1.0, 1e-28, 0.0), of(f64::NAN, f64::NAN, f64::NAN)] {
            assert!(!nothing.are_explained(100.0, 1.0, 3) && !nothing.are_plainly_explained(), "{nothing:?}");
        }
        assert!(!of(1.0, 1.0, 0.2).are_plainly_explained());
    }

    #[test]
    fn six_standard_errors_are_no_chance() {
        // The normal distribution is beyond 6.11 once in 10⁹.
        assert!(!is_no_chance(6.0, 1.0) && is_no_chance(-6.2, 1.0));
        assert!(!is_no_chance(1.0, 0.0) && !is_no_chance(f64::NAN, 1.0));
    }

    #[test]
    fn rows_that_overlap_carry_less_information() {
        let white = random(5, 4000);
        let mean: Vec<f64> = white.windows(4).map(|four| four.iter().sum()).collect();
        let usable = vec![true; 4000];
        // Correlations of ¾, ½ and ¼: one and twice the sum of their squares. Of chance a tenth is left, and the taper takes a little off.
        let found = inflation(&mean, &usable[..mean.len()], 40);
        assert!((found - 2.75).abs() < 0.3, "{found}");
        assert_eq!(inflation(&[0.0; 9], &usable[..9], 3), 1.0);
    }
}
