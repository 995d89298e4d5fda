//! Limits beyond which a fit is not trusted as it is.

use crate::status::Status;

/// A condition number of the equations of motion beyond which they hardly tell the parameters apart.
///
/// Under a multisine, windows have 10 … 100. Under a single sine only noise tells inertia from stiffness, and they have 1000 and more.
pub const HARDLY_TOLD_APART: f64 = 500.0;

/// A cross-validation error beyond which the rows hold more than the noise of the channels explains.
pub const NOISE_MODEL_FAILS: f64 = 4.0;

/// Standard errors below zero from which on a value is negative, not merely uncertain.
pub const NEGATIVE_BEYOND: f64 = 2.0;

/// A part of the values that is no chance.
pub const OFTEN: f64 = 0.05;

/// The part of the torque's mean square that the equations must leave of it for its noise to be worth a word: two percent of its amplitude.
pub(crate) const UNEXPLAINED: f64 = 4e-4;

/// The part of it that is little: a third of a percent of its amplitude.
pub(crate) const LITTLE: f64 = 1e-5;

/// A smaller part of it is explained for every purpose.
pub(crate) const NEGLIGIBLE: f64 = 1e-6;

/// What windows that are hardly longer than a test function may leave, in mean squares of the torque that was recorded and of the largest in the equation:
/// little of the largest, that of a spring and a mass that swing against each other, as a stiffness does that bends within windows.
pub(crate) fn left_by_short_windows(recorded: f64, largest: f64) -> f64 {
    (UNEXPLAINED * recorded).min(LITTLE * largest)
}

/// The flag of a condition number; one that is no number tells nothing apart.
pub(crate) fn status_of(condition: f64) -> Status {
    if !condition.is_finite() {
        Status::RANK_DEFICIENT
    } else if condition > HARDLY_TOLD_APART {
        Status::ILL_CONDITIONED
    } else {
        Status::GOOD
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_condition_number_is_flagged_beyond_its_limit() {
        for (condition, status) in [
            (1.0, Status::GOOD),
            (HARDLY_TOLD_APART, Status::GOOD),
            (HARDLY_TOLD_APART.next_up(), Status::ILL_CONDITIONED),
            (f64::MAX, Status::ILL_CONDITIONED),
            (f64::INFINITY, Status::RANK_DEFICIENT),
            (f64::NAN, Status::RANK_DEFICIENT),
        ] {
            assert_eq!(status_of(condition), status, "{condition}");
        }
    }

    #[test]
    fn windows_under_a_multisine_are_told_apart_and_those_under_a_single_sine_are_not() {
        assert_eq!([10.0, 100.0, 1000.0].map(status_of), [Status::GOOD, Status::GOOD, Status::ILL_CONDITIONED]);
    }

    #[test]
    fn what_is_left_of_the_torque_is_a_mean_square() {
        // Two percent of an amplitude; the square rounds once, its root once more.
        assert!((UNEXPLAINED.sqrt() - 0.02).abs() <= 0.02 * 2.0 * f64::EPSILON);
        const { assert!(NEGLIGIBLE < LITTLE && LITTLE < UNEXPLAINED) };
    }
}
