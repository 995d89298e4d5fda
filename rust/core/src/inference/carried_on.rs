//! Rows at which windows are carried on from beside a gap.

use std::collections::BTreeMap;

use crate::noise::median::median;

/// Squared difference of a coefficient on both sides of a gap, over the sum of both variances, above which it changed meanwhile.
const CHANGED: f64 = 16.0;

/// By how much more than it usually does within as many rows: what is slower is followed by windows.
const UNUSUAL: f64 = 4.0;

/// Part of the rows between two equations by which it may have changed beside them: their windows know little of these.
const BESIDE: usize = 8;

/// Pairs of rows that tell by how much it usually changes.
const LOOKED_AT: usize = 1 << 12;

/// Rows that are farther than a reach from every row that is an equation: what is windowed is carried on there from beside the gap, and no error knows what
/// it does meanwhile.
pub(crate) fn far_from_equations(usable: &[bool], reach: usize) -> Vec<bool> {
    let mut far = vec![true; usable.len()];
    let mut near = 0;
    for row in (0..usable.len()).filter(|&row| usable[row]) {
        let end = (row + reach + 1).min(usable.len());
        far[near.max(row.saturating_sub(reach))..end].fill(false);
        near = end;
    }
    far
}

/// Adds to the variances of a coefficient what is not known of when it changed, between two equations beside a gap.
///
/// No equation tells it: with `a` before the gap and `b` after it, at a part `x` of the rows between them, the estimate `v` is off by `a - v` with a
/// probability of `1 - x` and by `b - v` with one of `x`, if it jumps at any of them. Rows close to the gap count as rows in it.
pub(crate) fn add_unknown_changes(usable: &[bool], values: &[f64], variances: &mut [f64]) {
    let known: Vec<usize> = (0..usable.len()).filter(|&row| usable[row] && values[row].is_finite()).collect();
    let (mut usual, mut added) = (BTreeMap::new(), Vec::new());
    for (place, (&left, &right)) in known.iter().zip(known.iter().skip(1)).enumerate() {
        if right - left < 2 {
            continue;
        }
        let beside = (right - left) / BESIDE;
        let before = known[place - known[..place].iter().rev().take_while(|&&row| row + beside >= left).count()];
        let after = known[place + known[place + 1..].iter().take_while(|&&row| row <= right + beside).count()];
        let (first, last) = (values[before], values[after]);
        if (last - first).powi(2) <= CHANGED * (variances[before] + variances[after]) {
            continue;
        }
        let apart = (after - before).next_power_of_two();
        let usual = *usual.entry(apart).or_insert_with(|| usual_change(&known, values, apart));
        if (last - first).abs() > UNUSUAL * usual {
            added.extend((before + 1..after).map(|row| {
                let (part, value) = ((row - before) as f64 / (after - before) as f64, values[row]);
                (row, (1.0 - part) * (first - value).powi(2) + part * (last - value).powi(2))
            }));
        }
    }
    for (row, variance) in added {
        variances[row] += variance;
    }
}

/// The median change of a coefficient from one equation to that so many rows later, NaN where there is none.
fn usual_change(known: &[usize], values: &[f64], apart: usize) -> f64 {
    let step = known.len().div_ceil(LOOKED_AT).max(1);
    let later = |row: usize| known.binary_search(&(row + apart)).ok().map(|place| known[place]);
    let changes = known.iter().step_by(step).filter_map(|&row| Some((values[later(row)?] - values[row]).abs()));
    median(&mut changes.collect::<Vec<_>>()).unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::{add_unknown_changes, far_from_equations};

    #[test]
    fn what_changed_in_a_gap_has_the_variance_of_when_it_did() {
        let usable: Vec<bool> = (0..400).map(|row| !(200..=298).contains(&row)).collect();
        let across = |values: &[f64]| {
            let mut variances = vec![1e-4; 400];
            add_unknown_changes(&usable, values, &mut variances);
            variances
        };
        // Ten times the noise, along a straight line between both sides.
        let changed: Vec<f64> = (0..400).map(|row| ((f64::from(row) - 199.0) / 100.0).clamp(0.0, 1.0)).collect();
        let variances = across(&changed);
        assert!((variances[249] - 1e-4 - 0.25).abs() < 1e-12);
        // Twelve rows on either side count, too.
        let part = 22.0 / 124.0;
        assert!((variances[209] - 1e-4 - (1.0 - part) * 0.01 - part * 0.81).abs() < 1e-12);
        assert!((variances[193] - 1e-4 - 6.0 / 124.0).abs() < 1e-12);
        assert!((0..=187).chain(311..400).all(|row| variances[row] == 1e-4));
        // What changes everywhere is followed; noise is none.
        let slope: Vec<f64> = (0..400).map(|row| f64::from(row) / 100.0).collect();
        let little: Vec<f64> = changed.iter().map(|value| 0.05 * value).collect();
        assert!([slope, little].iter().all(|values| across(values) == vec![1e-4; 400]));
        // Nothing is known beside the ends, nor where values are none.
        let mut unknown = changed;
        unknown[..200].fill(f64::NAN);
        assert_eq!(across(&unknown), vec![1e-4; 400]);
    }

    #[test]
    fn rows_are_far_from_equations_beyond_the_reach_of_all() {
        let usable = [false, false, true, true, false, false, false, false, false, true, false];
        let far = |reach| far_from_equations(&usable, reach).iter().map(|&far| u8::from(far)).collect::<Vec<_>>();
        assert_eq!(far(0), [1, 1, 0, 0, 1, 1, 1, 1, 1, 0, 1]);
        assert_eq!(far(1), [1, 0, 0, 0, 0, 1, 1, 1, 0, 0, 0]);
        assert_eq!(far(2), [0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0]);
        assert_eq!(far(3), [0; 11]);
        assert_eq!(far_from_equations(&[false; 3], 5), [true; 3]);
    }
}
