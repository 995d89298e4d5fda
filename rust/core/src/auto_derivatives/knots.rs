//! Places at which what varies slowly near an end is measured, and numbers in between.

use crate::auto_derivatives::global_choice::rounded;

/// Places at which risks are measured in records that are not short, the closer to each other the nearer to the end; between them risks are interpolated.
const PLACES: usize = 12;

/// The places at which risks are measured, of so many: the first and the last are among them.
pub(crate) fn knots(count: usize) -> Vec<usize> {
    if count <= PLACES {
        return (0..count).collect();
    }
    let knot = |index: usize| {
        let share = index as f64 / (PLACES - 1) as f64;
        rounded((count - 1) as f64 * share * share)
    };
    let mut knots: Vec<usize> = (0..PLACES).map(knot).collect();
    knots.dedup();
    knots
}

/// Numbers at all places from those at a few of them.
pub(crate) fn interpolated(knots: &[usize], at: &[f64]) -> Vec<f64> {
    let mut values = Vec::with_capacity(knots.last().map_or(0, |last| last + 1));
    for (knots, at) in knots.windows(2).zip(at.windows(2)) {
        let span = (knots[1] - knots[0]) as f64;
        for place in knots[0]..knots[1] {
            let distance = (place - knots[0]) as f64 / span;
            // Where one is infinite so is what lies between.
            values.push(at[0] * (1.0 - distance) + if distance > 0.0 { at[1] * distance } else { 0.0 });
        }
    }
    values.extend(at.last());
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knots_reach_from_the_first_place_to_the_last_and_lie_close_at_the_first() {
        for count in [1, 2, PLACES, PLACES + 1, 100, 1000] {
            let knots = knots(count);
            assert_eq!((knots.first(), knots.last()), (Some(&0), Some(&(count - 1))));
            assert!(knots.windows(2).all(|pair| pair[0] < pair[1]), "{knots:?}");
        }
        let knots = knots(1000);
        assert!(knots[1] - knots[0] < knots[PLACES - 1] - knots[PLACES - 2]);
    }

    #[test]
    fn lines_are_kept_and_what_is_infinite_reaches_to_the_next_knot() {
        assert_eq!(interpolated(&[0, 2, 5], &[0.0, 4.0, 10.0]), [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        let values = interpolated(&[0, 2, 4], &[1.0, f64::INFINITY, 3.0]);
        assert_eq!(values, [1.0, f64::INFINITY, f64::INFINITY, f64::INFINITY, 3.0]);
        assert!(interpolated(&[], &[]).is_empty());
    }
}
