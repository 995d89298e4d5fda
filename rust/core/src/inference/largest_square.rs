//! The largest square that counts among squared errors of predicting rows, so that single rows do not dominate.

use crate::noise::median::{MEDIAN_OF_SQUARES, median};

/// The largest squared error of predicting rows, over the noise's variance, that counts where noise explains the usual one.
pub(crate) const MOST: f64 = 9.0;

/// The usual square, over the noise's variance, up to which the largest stays as it is. Beyond it rows hold more than noise, and the largest grows with the
/// usual one: where nearly every square is beyond the largest, all choices would look alike.
pub(crate) const USUAL: f64 = 4.0;

/// So many squares tell the usual one.
const TOLD_BY: usize = 4096;

/// What the largest square that counts is where noise does not explain the usual one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum LargestSquare {
    /// The same as elsewhere: of a chain, where elements that are followed hide each other.
    Fixed,
    /// As many times larger as the usual one is.
    Growing,
}

impl LargestSquare {
    /// The largest that counts among some squares over the noise's variance, which are not a number where nothing is predicted. `most` is it where noise
    /// explains them.
    pub(crate) fn of(self, squares: impl Iterator<Item = f64>, most: f64) -> f64 {
        if self == Self::Fixed {
            return most;
        }
        let squares: Vec<f64> = squares.filter(|square| square.is_finite()).collect();
        let stride = squares.len().div_ceil(TOLD_BY).max(1);
        let mut some: Vec<f64> = squares.into_iter().step_by(stride).collect();
        most * median(&mut some).map_or(1.0, |middle| (middle / MEDIAN_OF_SQUARES / USUAL).max(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The largest where the usual square is some multiple of the noise's variance and a few are beyond everything.
    fn largest(usual: f64) -> f64 {
        let square = |one: usize| if one.is_multiple_of(50) { 1e12 } else { usual * MEDIAN_OF_SQUARES };
        LargestSquare::Growing.of((0..20_000).map(square).chain([f64::NAN, f64::INFINITY]), MOST)
    }

    #[test]
    fn the_largest_stays_as_it_is_up_to_four_times_the_noise_and_grows_with_the_usual_one_beyond() {
        assert!([0.0, 1.0, 3.9].into_iter().all(|usual| largest(usual) == MOST));
        for usual in [5.0, 1e6] {
            assert!((largest(usual) / (usual / USUAL * MOST) - 1.0).abs() < 4.0 * f64::EPSILON, "{usual}");
        }
    }

    #[test]
    fn nothing_tells_nothing() {
        assert_eq!(LargestSquare::Growing.of(std::iter::empty(), MOST), MOST);
        assert_eq!(LargestSquare::Growing.of([f64::NAN].into_iter(), MOST), MOST);
    }

    #[test]
    fn a_fixed_one_stays() {
        assert_eq!(LargestSquare::Fixed.of([1e6; 3].into_iter(), MOST), MOST);
    }
}
