//! The quantisation step of a channel, found from the differences of neighbouring samples.

use std::ops::Range;

use crate::record::samples::{Samples, is_usable};
use crate::record::subsample::stretches;

/// The most differences that are searched for a step, and the fewest from which a step is inferred.
const MOST_DIFFERENCES: usize = 1 << 12;
const FEWEST_DIFFERENCES: usize = 16;

/// So many of the smallest differences are searched before all of them.
const SMALLEST: usize = 32;

/// Number of stretches in the subsample of a longer record.
pub(crate) const STRETCHES: usize = 64;

/// Rounding of differences of numbers of single and of double precision, in units of the largest number. Single precision comes first,
/// since its own last place is a step too.
const PRECISIONS: [f64; 2] = [8.0 * f32::EPSILON as f64, 8.0 * f64::EPSILON];

/// The least ratio of a step to rounding.
const ABOVE_ROUNDING: f64 = 64.0;

/// The parts of a record of so many samples whose differences are searched.
pub fn searched(samples: usize) -> impl Iterator<Item = Range<usize>> {
    stretches(samples, MOST_DIFFERENCES, STRETCHES)
}

/// The step that all differences of neighbouring samples are multiples of, or zero where there is none.
///
/// The cost is negligible: at most 4096 differences are searched.
#[must_use]
pub fn quantisation_step(record: &dyn Samples) -> f64 {
    let mut differences = Vec::new();
    let mut largest = 0.0_f64;
    let mut samples = Vec::new();
    for places in searched(record.len()) {
        samples.resize(places.len(), 0.0);
        record.read(places.start, &mut samples);
        let usable = samples.iter().filter(|value| is_usable(**value));
        largest = usable.fold(largest, |largest, value| largest.max(value.abs()));
        differences.extend(samples.windows(2).map(|pair| (pair[1] - pair[0]).abs()));
    }
    differences.retain(|&difference| is_usable(difference) && difference > 0.0);
    if differences.len() < FEWEST_DIFFERENCES {
        return 0.0;
    }
    // What is true of all differences is true of the smallest: without a step of theirs there is none, and the rest need no order.
    let smallest = differences.len().min(SMALLEST);
    differences.select_nth_unstable_by(smallest - 1, f64::total_cmp);
    differences[..smallest].sort_unstable_by(f64::total_cmp);
    let step = |differences: &[f64]| {
        PRECISIONS.iter().find_map(|precision| common_step(differences, precision * largest)).unwrap_or(0.0)
    };
    let of_smallest = step(&differences[..smallest]);
    if of_smallest == 0.0 || smallest == differences.len() {
        return of_smallest;
    }
    differences.sort_unstable_by(f64::total_cmp);
    step(&differences)
}

/// The largest step of which all differences, in rising order, are multiples within rounding: Euclid's algorithm for numbers that
/// are rounded.
fn common_step(differences: &[f64], rounding: f64) -> Option<f64> {
    let mut step = *differences.first()?;
    'smaller: loop {
        if step < ABOVE_ROUNDING * rounding {
            return None;
        }
        // The larger the multiple, the more precise the step.
        let mut known = step;
        for &difference in differences {
            let multiple = (difference / known).round();
            let rest = (difference - multiple * known).abs();
            if rest > rounding {
                step = rest;
                continue 'smaller;
            }
            known = difference / multiple;
        }
        return Some(known);
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Numbers between -0.5 and 0.5 of variance 1/12.
    pub(crate) fn uniform(count: usize) -> Vec<f64> {
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        let mut next = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        (0..count).map(|_| next()).collect()
    }

    #[test]
    #[allow(clippy::cast_possible_truncation, reason = "that is what is tested")]
    fn a_step_is_found_in_double_and_single_precision_and_with_an_offset() {
        for step in [1.0, 0.1, std::f64::consts::TAU / 4096.0] {
            let whole: Vec<f64> =
                (0..3000).map(|i| (100.0 * (f64::from(i) * 0.01).sin()).round() * step + 7.3).collect();
            let single: Vec<f64> = whole.iter().map(|&value| f64::from(value as f32)).collect();
            assert!((quantisation_step(&whole.as_slice()) / step - 1.0).abs() < 1e-9);
            assert!((quantisation_step(&single.as_slice()) / step - 1.0).abs() < 1e-3);
        }
    }

    #[test]
    fn steps_that_are_never_single_are_found_too() {
        // Differences of 6, 10 and 15 steps have nothing in common but one.
        let mut level = 0.0;
        let samples: Vec<f64> = (0..90)
            .map(|i| {
                level += [6.0, -10.0, 15.0][i % 3] * 0.01;
                level
            })
            .collect();
        assert!((quantisation_step(&samples.as_slice()) - 0.01).abs() < 1e-12);
    }

    #[test]
    fn jumps_of_a_quiet_record_are_no_steps() {
        let quiet: Vec<f64> =
            uniform(500).iter().enumerate().map(|(i, e)| 1e-7 * e + f64::from(u8::from(i % 20 == 0))).collect();
        assert_eq!(quantisation_step(&quiet.as_slice()), 0.0);
    }

    #[test]
    fn nothing_is_found_where_there_is_no_step() {
        assert_eq!(quantisation_step(&uniform(5000).as_slice()), 0.0);
        assert_eq!(quantisation_step(&[3.0; 100].as_slice()), 0.0);
        assert_eq!(quantisation_step(&[f64::NAN; 100].as_slice()), 0.0);
        assert_eq!(quantisation_step(&[].as_slice()), 0.0);
    }
}
