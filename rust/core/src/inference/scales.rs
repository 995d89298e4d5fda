//! Whether equations of every scale agree: the plateau.
//!
//! With the width of the test function the band moves in which the equation of motion is asked to hold. Where it holds, all widths give
//! the same constants; narrow ones are more precise if noise is what it is taken for, and wrong if it is not. So a result is accepted
//! where a range of widths agrees, each within the errors that blocks of the record show (after Lepski's comparison of scales, 1990,
//! but only along a range: the widest test functions may be wrong for other reasons).
//!
//! Where next to no noise is left, a difference that matters to nobody is beyond every error: how a simulator or a sensor lets the torque go from sample to
//! sample is a difference of a thousandth already. Where no range agrees otherwise, one that agrees within that is accepted.

use crate::regression::block_fit::BlockFit;

/// Estimates agree that differ by no more than so many standard errors, the smaller of the two.
pub const AGREE: f64 = 2.0;

/// Estimates that differ by less than this part of them are alike, whatever their errors: no sensor's gain is known better.
pub(crate) const ALIKE: f64 = 1e-3;

/// Widths that agree span at least this factor, or they agree by chance.
pub const LEAST_PLATEAU: f64 = 2.0;

/// A scale whose error is so many times that of a wider one is drowned in noise: it agrees with anything.
const DROWNED: f64 = 10.0;

/// Constants by one test function, or by one length of windows.
#[derive(Clone, Debug, PartialEq)]
pub struct AtScale {
    /// Samples on either side of the centre.
    pub half_width: usize,
    /// Where half the power of the motion passes, in hertz: the equation is asked to hold below.
    pub band: f64,
    /// The constants, in the order of the unknowns.
    pub values: Vec<f64>,
    /// Their standard errors, from blocks of the record.
    pub errors: Vec<f64>,
}

impl AtScale {
    pub(crate) fn new((half_width, band): (usize, f64), fit: BlockFit) -> Self {
        Self { half_width, band, errors: fit.errors(), values: fit.values }
    }

    fn window_length(&self) -> f64 {
        (2 * self.half_width + 1) as f64
    }

    /// Whether every constant of another scale is the same, but for so many standard errors, the smaller of the two, or a part of the smaller.
    pub(crate) fn agrees(&self, other: &Self, errors: f64, part: f64) -> bool {
        let pairs = self.values.iter().zip(&other.values).zip(self.errors.iter().zip(&other.errors));
        pairs.into_iter().all(|((one, other), (error, other_error))| {
            let most = (errors * error.min(*other_error)).max(part * one.abs().min(other.abs()));
            // NaN agrees with nothing.
            (one - other).abs() <= most
        })
    }
}

/// A range of scales that agree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plateau {
    /// Places of the narrowest and of the widest.
    pub first: usize,
    /// The widest.
    pub last: usize,
}

impl Plateau {
    /// Whether the scale at a place belongs to it.
    pub(crate) fn holds(&self, place: usize) -> bool {
        (self.first..=self.last).contains(&place)
    }

    /// By what factor the widths differ.
    pub(crate) fn factor(&self, scales: &[AtScale]) -> f64 {
        scales[self.last].window_length() / scales[self.first].window_length()
    }
}

/// The longest range of scales of which every one agrees with the narrowest, but for a part of it, the narrower of equals, and which does not begin where
/// wider ones tell far more. Scales go from narrow to wide.
pub(crate) fn plateau(scales: &[AtScale], part: f64) -> Option<Plateau> {
    let drowned = |place: usize| {
        let tells_more = |wider: &AtScale| {
            scales[place].errors.iter().zip(&wider.errors).any(|(error, wider)| *error > DROWNED * wider)
        };
        scales[place + 1..].iter().any(tells_more)
    };
    let from = |first: usize| {
        let beyond = scales[first + 1..].iter().position(|one| !scales[first].agrees(one, AGREE, part));
        Plateau { first, last: beyond.map_or(scales.len() - 1, |beyond| first + beyond) }
    };
    let mut best: Option<Plateau> = None;
    for found in (0..scales.len()).filter(|&first| !drowned(first)).map(from) {
        if best.is_none_or(|best| found.factor(scales) > best.factor(scales) * (1.0 + 1e-9)) {
            best = Some(found);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scales(estimates: &[(f64, f64)]) -> Vec<AtScale> {
        let at = |(place, &(value, error)): (usize, &(f64, f64))| AtScale {
            half_width: 4 << place,
            band: 100.0 / f64::from(1 << place),
            values: vec![value, 1.0],
            errors: vec![error, 1.0],
        };
        estimates.iter().enumerate().map(at).collect()
    }

    #[test]
    fn the_longest_range_of_widths_that_agree_is_the_plateau() {
        let scales = scales(&[(0.1, 0.01), (0.12, 0.01), (0.5, 0.05), (1.0, 0.1), (1.1, 0.1), (0.95, 0.2), (3.0, 0.2)]);
        let found = plateau(&scales, 0.0).unwrap();
        assert_eq!(found, Plateau { first: 3, last: 5 });
        assert!((found.factor(&scales) - 257.0 / 65.0).abs() < 1e-12);
    }

    #[test]
    fn widths_that_are_drowned_in_noise_are_no_plateau() {
        let scales = scales(&[(9.0, 20.0), (-5.0, 30.0), (3.0, 10.0), (1.1, 0.1), (1.0, 0.1)]);
        assert_eq!(plateau(&scales, 0.0), Some(Plateau { first: 3, last: 4 }));
    }

    #[test]
    fn of_ranges_as_long_the_narrower_counts_and_nan_agrees_with_nothing() {
        assert_eq!(plateau(&scales(&[(1.0, 0.1), (2.0, 0.1)]), 0.0), Some(Plateau { first: 0, last: 0 }));
        let found = plateau(&scales(&[(1.0, f64::NAN), (f64::NAN, 0.1), (1.0, 0.1), (1.0, 0.1)]), 0.0);
        assert_eq!(found, Some(Plateau { first: 2, last: 3 }));
        assert_eq!(plateau(&[], 0.0), None);
    }

    #[test]
    fn widths_that_differ_by_less_than_anybody_needs_are_alike_where_that_is_enough() {
        let scales = scales(&[(1.01, 1e-6), (1.0004, 1e-6), (1.0, 1e-6), (0.9996, 1e-6), (0.99, 1e-6)]);
        assert_eq!(plateau(&scales, 0.0), Some(Plateau { first: 0, last: 0 }));
        assert_eq!(plateau(&scales, ALIKE), Some(Plateau { first: 1, last: 3 }));
    }
}
