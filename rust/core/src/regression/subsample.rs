//! Subsamples of the rows of a long record, for the choice of hyperparameters.

use std::ops::Range;

use crate::equation::rows::BLOCK;
use crate::equation::rows::{Regressor, Rows};
use crate::record::subsample::{GOLDEN, stretches};
use crate::regression::window_length::Scale;

/// The same for rows, each stretch from the beginning of a block of them.
pub(crate) fn stretches_of_blocks(rows: usize, most: usize, count: usize) -> Vec<Range<usize>> {
    stretches(rows, most, count).map(|one| one.start - one.start % BLOCK..one.end - one.start % BLOCK).collect()
}

/// A column in stretches, one after another.
pub(crate) fn thinned_column<T: Copy>(column: &[T], stretches: &[Range<usize>]) -> Vec<T> {
    stretches.iter().flat_map(|stretch| column.get(stretch.clone()).unwrap_or_default().iter().copied()).collect()
}

/// Rows in stretches, one after another; windows do not reach from one to the next.
pub(crate) fn thinned_rows(rows: &Rows, stretches: &[Range<usize>]) -> Rows {
    let column = |values: &Vec<f64>| thinned_column(values, stretches);
    let regressor = |one: &Regressor| Regressor {
        value: column(&one.value),
        companion: column(&one.companion),
        noise: one.noise.clone(),
    };
    let mut jumps = Vec::new();
    let mut before = 0;
    for stretch in stretches {
        if before > 0 {
            jumps.push(before);
        }
        let inside = rows.jumps.iter().filter(|jump| (stretch.start + 1..stretch.end).contains(jump));
        jumps.extend(inside.map(|jump| before + jump - stretch.start));
        before += stretch.len();
    }
    Rows {
        regressors: rows.regressors.iter().map(regressor).collect(),
        rhs: column(&rows.rhs),
        rhs_noise: rows.rhs_noise.clone(),
        usable: thinned_column(&rows.usable, stretches),
        jumps,
        period: rows.period,
        roots: if rows.roots.is_empty() { Vec::new() } else { column(&rows.roots) },
    }
}

/// Records with more rows than this are subsampled to so many, in so many stretches, to choose hyperparameters.
const LONG: usize = 1 << 15;
const MOST_ROWS: usize = 1 << 14;
const FEW_ROWS: usize = 1 << 12;
const SOME_ROWS: usize = 1 << 11;
const PART: usize = 4;
const STRETCHES: usize = 8;
const MORE: usize = 4;

/// The stretches that represent so many rows, or `None` if the rows are few.
pub(crate) fn stretches_of_rows(rows: usize) -> Option<Vec<Range<usize>>> {
    (rows > LONG).then(|| stretches_of_blocks(rows, MOST_ROWS, STRETCHES))
}

/// Stretches of few rows, and how many of some lengths, shortest first, they hold: enough to rule most of them out before more rows compare the
/// others. `None` if the rows are so few that there is nothing to rule out.
pub(crate) fn few_stretches(rows: usize, scales: &[Scale]) -> Option<(Vec<Range<usize>>, usize)> {
    let few = FEW_ROWS.min(rows / PART);
    let held = scales.partition_point(|scale| 2 * scale.span() <= few / STRETCHES);
    (held > 1).then(|| (stretches_of_blocks(rows, few, STRETCHES), held))
}

/// Rows that compare what may change anywhere in a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Compare {
    /// All of few, or one in each of at least [`MOST_ROWS`] equal parts of many.
    Most,
    /// One in each of at least [`SOME_ROWS`] equal parts, where that comes near enough.
    Some,
}

/// Those rows. No period of the motion falls in with their places.
pub(crate) fn rows_all_over(rows: usize, compare: Compare) -> impl Iterator<Item = usize> {
    let part = match compare {
        Compare::Most if rows <= LONG => 1,
        Compare::Most => rows / MOST_ROWS,
        Compare::Some => (rows / SOME_ROWS).max(1),
    };
    let of_part = move |index: usize| {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within a part")]
        let within = ((index as f64 * GOLDEN).fract() * part as f64) as usize;
        index * part + within
    };
    (0..rows / part).map(of_part)
}

/// Whether rows are so many that those in few stretches are much fewer.
pub(crate) fn are_many(rows: usize) -> bool {
    rows > 2 * FEW_ROWS
}

/// Where stretches begin and end among the rows in them.
pub(crate) fn places_of(stretches: &[Range<usize>]) -> Vec<Range<usize>> {
    let lengths = stretches.iter().map(Range::len);
    let places = lengths.scan(0, |end, length| {
        let first = std::mem::replace(end, *end + length);
        Some(first..*end)
    });
    places.collect()
}

/// Which of the rows in stretches, one after another, a row of the record is, if it is one of them.
pub(crate) fn place_among(stretches: &[Range<usize>], row: usize) -> Option<usize> {
    let mut before = 0;
    for stretch in stretches {
        if stretch.contains(&row) {
            return Some(before + row - stretch.start);
        }
        before += stretch.len();
    }
    None
}

/// Ranges that end before some places within them, in ascending order, and begin again there.
pub(crate) fn cut(ranges: &[Range<usize>], places: impl Iterator<Item = usize>) -> Vec<Range<usize>> {
    let mut ends: Vec<usize> = ranges.iter().map(|range| range.end).chain(places).collect();
    ends.sort_unstable();
    ends.dedup();
    let begin = ranges.first().map_or(0, |range| range.start);
    let starts = std::iter::once(begin).chain(ends.iter().copied());
    starts.zip(&ends).map(|(start, &end)| start..end).filter(|range| !range.is_empty()).collect()
}

/// More of them, for tests of constants beside which nothing is windowed: so much less is estimated from each row.
pub(crate) fn more_stretches_of_rows(rows: usize) -> Option<Vec<Range<usize>>> {
    (rows > MORE * LONG).then(|| stretches_of_blocks(rows, MORE * MOST_ROWS, STRETCHES))
}

/// Whether stretches of rows hold enough windows of a length.
pub(crate) fn holds(scale: Scale) -> bool {
    2 * scale.span() <= MOST_ROWS / STRETCHES
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn some_rows_come_near_all_over_what_all_would() {
        assert!(rows_all_over(SOME_ROWS, Compare::Some).eq(0..SOME_ROWS));
        for rows in [2 * SOME_ROWS, LONG, 700_001] {
            let found: Vec<usize> = rows_all_over(rows, Compare::Some).collect();
            let part = rows / SOME_ROWS;
            assert!((SOME_ROWS..SOME_ROWS + SOME_ROWS / part).contains(&found.len()) && part > 1);
            assert!(found.iter().enumerate().all(|(index, row)| row / part == index));
        }
    }

    #[test]
    fn few_rows_compare_all_over_what_many_would() {
        assert!(rows_all_over(LONG, Compare::Most).eq(0..LONG));
        for rows in [LONG + 1, 700_001] {
            let found: Vec<usize> = rows_all_over(rows, Compare::Most).collect();
            let part = rows / MOST_ROWS;
            assert!((MOST_ROWS..MOST_ROWS + MOST_ROWS / part).contains(&found.len()));
            assert!(found.iter().enumerate().all(|(index, row)| row / part == index));
            // Whatever period the motion has, each quarter of its phases holds its share, but for a tenth.
            for period in [part, part + 1, 2 * part, 3 * part + 1, 40].into_iter().filter(|period| *period >= 16) {
                let phase = |row: &usize| (row % period) as f64 / period as f64;
                let share = |quarter: f64| {
                    let met = found.iter().filter(|row| (quarter..quarter + 0.25).contains(&phase(row))).count();
                    let whole = (0..period).filter(|row| (quarter..quarter + 0.25).contains(&phase(row))).count();
                    (met * period) as f64 / (whole * found.len()) as f64
                };
                for quarter in [0.0, 0.25, 0.5, 0.75] {
                    assert!((share(quarter) - 1.0).abs() < 0.1, "{rows} {period} {quarter}: {}", share(quarter));
                }
            }
        }
    }

    #[test]
    fn stretches_of_rows_begin_with_a_block() {
        for rows in [40_000, 1_000_003] {
            let parts = stretches_of_rows(rows).unwrap();
            assert_eq!(parts.iter().map(Range::len).sum::<usize>(), MOST_ROWS);
            assert!(parts.iter().all(|part| part.start % BLOCK == 0 && part.end <= rows));
            assert!(rows - parts[STRETCHES - 1].end < BLOCK);
            let scales = Scale::all(rows, 6);
            let (few, held) = few_stretches(rows, &scales).expect("lengths");
            let places = places_of(&few);
            assert_eq!((few.len(), places[0].start, places[STRETCHES - 1].end), (STRETCHES, 0, FEW_ROWS));
            assert!(places.windows(2).all(|pair| pair[0].end == pair[1].start));
            assert!(2 * scales[held - 1].span() <= few[0].len() && 2 * scales[held].span() > few[0].len());
        }
    }

    #[test]
    fn stretches_are_cut_where_something_jumps_and_rows_between_them_are_none() {
        let stretches = [10..30, 40..50];
        assert_eq!(
            [9, 10, 29, 30, 39, 40, 49].map(|row| place_among(&stretches, row)),
            [None, Some(0), Some(19), None, None, Some(20), Some(29)]
        );
        let places = || places_of(&stretches);
        assert_eq!(places(), [0..20, 20..30]);
        assert_eq!(cut(&places(), [5, 25].into_iter()), [0..5, 5..20, 20..25, 25..30]);
        assert_eq!(cut(&places(), [0, 20, 30].into_iter()), [0..20, 20..30]);
        assert_eq!(cut(&places(), std::iter::empty()), [0..20, 20..30]);
    }
}
