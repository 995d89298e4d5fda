//! A test of whether a constant swings: whether it differs between short parts of the record.
//!
//! Blocks of an eighth of the record that hold a cycle of what swings, or several, are alike; shorter parts are not. Those that are longer than the
//! windows in which something is followed tell most, but windows of the best length may span a cycle, too. The median of the parts decides, not their
//! mean: where a windowed unknown jumps, a few parts are far off.

use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::Piece;
use crate::exec::stages::Stages;
use crate::inference::constancy::{Test, compare};
use crate::inference::drive::{Drive, SCATTER_OF_MEDIAN, drive, most_by_chance};
use crate::inference::part_constants::{Estimate, TestNoise, estimate};
use crate::noise::median::{MEDIAN_OF_SQUARES, median};
use crate::regression::fit::Fit;
use crate::regression::problem::Problem;
use crate::simd::instructions::Instructions;

/// The mean square that constants leave, over the noise's variance, from which on short parts are compared.
pub(crate) const MORE_THAN_NOISE: f64 = 1.2;

/// The part of what noise does not explain of rows that may be left where a constant that swings is set free: it is .02 to .11 where one swings, .28 to
/// .35 where a friction or a drag is missing.
pub(crate) const LEFT_OF_SWINGS: f64 = 0.2;

/// The part of what noise does not explain that may be left where rows are predicted so badly that hardly one is within the noise: what swings leaves at
/// most .035. Where an angle is low-passed, a torque late, or a friction, a drag or a cubic spring missing, .06 and more is left beside curves of one or two
/// constants that are positive, and mostly half.
pub(crate) const LEFT_WHERE_LOST: f64 = 0.04;

/// The length of a part, in windows.
const WINDOWS: usize = 2;

/// Parts that are compared: of shorter ones some all over the record.
const COUNTS: [usize; 2] = [16, 64];

/// The part of the record that the shortest are, where windows are longer: these were chosen while what swings was constant.
const SHORTEST: usize = 256;

/// Of more rows parts are as long as of so many.
const MOST_ROWS: usize = 1 << 15;

/// Parts that must determine a constant.
const FEWEST: usize = 12;

/// The part of the largest deviation that longer parts must show: they average what swings, and know it better.
const NEARLY_ALL: f64 = 0.9;

/// A constant that differs between short parts.
#[derive(Clone, Debug)]
pub(crate) struct Swinging {
    pub(crate) constant: usize,
    pub(crate) test: Test,
    /// Rows of the longest parts that hardly hide by how much.
    pub(crate) length: usize,
    /// The same where longer ones hide it.
    pub(crate) longest: Option<usize>,
}

/// The constants of a fit, of those that `may` swing, that differ between parts of some length, those first that differ most.
pub(crate) fn swinging(
    problem: &Problem<'_>,
    (fit, may): (&Fit, &[bool]),
    noise: TestNoise<'_>,
    instructions: Instructions,
    stages: &mut Stages<'_, '_>,
) -> Result<Vec<Swinging>, Error> {
    if !may.contains(&true) {
        return Ok(Vec::new());
    }
    let constants: Vec<usize> = (0..problem.layout.constant).filter(|&constant| may[constant]).collect();
    let mut differing: Vec<Swinging> = Vec::new();
    for (place, (length, count)) in lengths(problem.rows(), WINDOWS * fit.span).into_iter().enumerate() {
        let driven = |rows: &Range<usize>| drive(problem, (rows, noise.equations), noise.expected, noise.inflation);
        let driven = parts(problem.rows(), length, count).filter(|rows| driven(rows) == Drive::Always);
        let pieces = driven.map(|rows| Piece { size: rows.len(), content: rows }).collect();
        let estimate = |part: Range<usize>, (): &mut ()| estimate(problem, fit, noise, part, instructions);
        let estimates: Vec<Estimate> = stages.map(pieces, || (), estimate)?;
        for &constant in &constants {
            let each = estimates.iter().flatten();
            let each: Vec<_> = each.map(|(values, variances)| (values[constant], variances[constant])).collect();
            if let Some(test) = compare(&each).filter(|_| most_differ(&each)) {
                differing.push(Swinging { constant, test, length, longest: (place > 0).then_some(length) });
            }
        }
    }
    let of_constant = |constant: usize| {
        let of = || differing.iter().filter(move |one| one.constant == constant);
        let most = of().map(|one| one.test.excess()).fold(0.0, f64::max);
        let deviation = of().map(|one| one.test.deviation).fold(0.0, f64::max);
        let longest = of().find(|one| one.test.deviation >= NEARLY_ALL * deviation)?;
        Some((most, longest.clone()))
    };
    let mut found: Vec<(f64, Swinging)> = constants.into_iter().filter_map(of_constant).collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    Ok(found.into_iter().map(|(_, one)| one).collect())
}

/// The length of the shortest parts of so many rows.
pub(crate) fn shortest(rows: usize, span: usize) -> usize {
    lengths(rows, WINDOWS * span).last().map_or(rows, |(length, _)| *length)
}

/// Lengths of parts of so many rows, the longest first, and how many of each are compared.
fn lengths(rows: usize, of_windows: usize) -> Vec<(usize, usize)> {
    let [few, many] = COUNTS;
    let some = rows.min(MOST_ROWS);
    let mut lengths: Vec<(usize, usize)> = COUNTS.iter().map(|count| (some / count, *count)).collect();
    if of_windows < some / few {
        lengths.push((of_windows, (rows / of_windows.max(1)).min(many)));
    }
    if of_windows > some / many {
        lengths.push((some / SHORTEST, many));
    }
    lengths.retain(|(length, _)| *length > 0);
    lengths.sort_unstable_by(|a, b| b.cmp(a));
    lengths
}

/// Some parts of equal length all over some rows.
fn parts(rows: usize, length: usize, count: usize) -> impl Iterator<Item = Range<usize>> {
    let first = move |index: usize| index * (rows - length) / (count - 1).max(1);
    (0..count).map(move |index| first(index)..first(index) + length)
}

/// Whether most estimates of the same number, each with its variance, lie farther from their median than noise explains.
fn most_differ(parts: &[(f64, f64)]) -> bool {
    let usable = || parts.iter().copied().filter(|(value, variance)| value.is_finite() && *variance > 0.0);
    let mut values: Vec<f64> = usable().map(|(value, _)| value).collect();
    let Some(middle) = median(&mut values).filter(|_| values.len() >= FEWEST) else { return false };
    let mut squares: Vec<f64> = usable().map(|(value, variance)| (value - middle).powi(2) / variance).collect();
    let by_chance = most_by_chance(SCATTER_OF_MEDIAN, squares.len() as f64);
    median(&mut squares).is_some_and(|square| square > MEDIAN_OF_SQUARES * by_chance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equation::rows::Rows;
    use crate::inference::constancy::{self, NO_CHANCE};
    use crate::inference::part_constants::NoiseFrom;
    use crate::regression::row_covariance::RowCovariance;
    use crate::regression::simulated::{CONSTANTS, model, rows, staged, white};

    const ROWS: usize = 3200;
    const DEVIATION: f64 = 0.1;

    /// Rows whose first constant swings by some part of itself, in so many rows.
    fn swung(depth: f64, period: f64, changing: impl Fn(f64) -> [f64; 2]) -> Rows {
        let mut rows = rows(ROWS, changing, DEVIATION);
        for row in 0..ROWS {
            let more = CONSTANTS[0] * depth * (2.0 * std::f64::consts::PI * row as f64 / period).sin();
            rows.rhs[row] += more * rows.regressors[1].value[row];
        }
        rows
    }

    /// What short parts and the eight blocks of these rows say, in windows of so many rows, where rows are predicted as badly as what swings makes them.
    fn said((rows, depth): (&Rows, f64), window: usize, may: [bool; 2]) -> (Vec<Swinging>, bool) {
        let problem = model().problem(rows, &rows.rhs, 0.0, None);
        let variance = DEVIATION * DEVIATION;
        let fit = Fit::in_rows(&problem, window, white(variance), Instructions::Scalar).expect("constants");
        let covariance = &RowCovariance::by_distance(vec![variance]);
        let (expected, from) = (white(variance), NoiseFrom::Channels);
        let inflation = 1.0 + (depth * CONSTANTS[0]).powi(2) / 2.0 / variance;
        let noise = TestNoise { expected, covariance, inflation, from, equations: 1 };
        staged(|stages| {
            let parts = swinging(&problem, (&fit, &may), noise, Instructions::Scalar, stages)?;
            let blocks = constancy::test(&problem, &fit, noise, Instructions::Scalar, stages)?;
            Ok((parts, blocks.iter().flatten().any(|test| test.probability < NO_CHANCE)))
        })
    }

    fn line(time: f64) -> [f64; 2] {
        [1.0 + 0.01 * time, 0.01]
    }

    #[test]
    fn what_swings_several_times_in_a_block_differs_between_short_parts_alone() {
        // A block of 400 rows holds two cycles, or four; windows are shorter than a cycle, or longer by far.
        for (period, window) in [(200.0, 24), (200.0, 64), (200.0, 800), (100.0, 24)] {
            let (found, differs) = said((&swung(0.3, period, line), 0.3), window, [true; 2]);
            let [found] = &found[..] else { panic!("one swings: {found:?}") };
            assert_eq!(found.constant, 0);
            assert!(
                found.longest.is_some_and(|rows| (rows as f64) < period) && found.test.probability < NO_CHANCE,
                "{period} {window} {found:?}"
            );
            assert!(!differs, "{period} {window}");
            // Parts of half a cycle see two thirds of the deviation of a sine.
            let sine = 0.3 / 2.0_f64.sqrt();
            assert!((0.6 * sine..1.15 * sine).contains(&found.test.spread), "{found:?}");
        }
    }

    #[test]
    fn no_length_is_told_where_long_parts_hide_nothing() {
        let (found, _) = said((&swung(0.3, 1600.0, line), 0.3), 24, [true; 2]);
        assert_eq!(found.first().expect("it swings").longest, None);
    }

    #[test]
    fn of_two_that_swing_the_one_comes_first_that_differs_most() {
        let mut rows = swung(0.1, 200.0, line);
        for row in 0..ROWS {
            let more = 0.6 * CONSTANTS[1] * (2.0 * std::f64::consts::PI * row as f64 / 150.0).sin();
            rows.rhs[row] += more * rows.regressors[2].value[row];
        }
        let both = |may| said((&rows, 0.1), 24, may).0.iter().map(|one| one.constant).collect::<Vec<_>>();
        assert_eq!(both([true; 2]), [1, 0]);
        assert_eq!(both([true, false]), [0]);
    }

    #[test]
    fn nothing_swings_where_nothing_does_nor_what_may_not() {
        assert!(said((&swung(0.0, 200.0, line), 0.0), 64, [true; 2]).0.is_empty());
        assert!(said((&swung(0.3, 200.0, line), 0.3), 64, [false; 2]).0.is_empty());
    }

    #[test]
    fn a_few_parts_over_jumps_are_no_swing() {
        // The windowed unknown jumps in five of 64 parts, and its windows are no shorter than they.
        let jumping = |time: f64| [if (time / 270.0).floor() % 2.0 < 1.0 { 1.0 } else { 3.0 }, 0.0];
        assert!(said((&swung(0.0, 200.0, jumping), 0.0), 24, [true; 2]).0.is_empty());
    }

    #[test]
    fn parts_lie_within_the_rows_and_reach_both_ends() {
        for (rows, window) in [(16, 1), (100, 3), (1000, 900), (1_000_000, 50)] {
            for (length, count) in lengths(rows, WINDOWS * window) {
                let all: Vec<_> = parts(rows, length, count).collect();
                assert_eq!((all[0].start, all[count - 1].end), (0, rows));
                assert!(all.iter().all(|part| part.len() == length) && count <= 64);
                assert!(all.windows(2).all(|two| two[0].end <= two[1].start));
            }
        }
        assert!(lengths(10, 4).is_empty());
    }

    #[test]
    fn half_of_the_parts_must_differ() {
        let near = |part: u32| f64::from(part % 3);
        let with_far =
            |far: u32| (0..64).map(|part| (if part < far { 9.0 } else { near(part) }, 1.0)).collect::<Vec<_>>();
        assert!(!most_differ(&with_far(0)) && !most_differ(&with_far(12)));
        let swinging: Vec<_> = (0..64).map(|part| (4.0 * f64::from(part).sin(), 1.0)).collect();
        assert!(most_differ(&swinging) && !most_differ(&swinging[..FEWEST - 1]));
    }
}
