//! What the torque does in parts of a record: noise alone, blows now and then, or a drive.
//!
//! Where no torque acts the equation is homogeneous and says nothing of how large its parameters are.

use std::f64::consts::SQRT_2;
use std::ops::Range;

use crate::noise::median::{MEDIAN_OF_SQUARES, median};
use crate::regression::constants::Expected;
use crate::regression::problem::Problem;

/// Standard deviations by which the median of squares of noise is larger by chance, and one of them for a single square, over the median.
const FREE: f64 = 5.0;
pub(crate) const SCATTER_OF_MEDIAN: f64 = 2.34;

/// Blows are no chance where the mean of squares is so many times what noise explains: it has heavier tails than that of a few samples.
const STRUCK: f64 = 3.0;

/// The mean, or with its scatter the median, of so many independent squares over its expectation, beyond which it is no chance.
pub(crate) fn most_by_chance(scattered: f64, independent: f64) -> f64 {
    1.0 + FREE * scattered / independent.sqrt()
}

/// The longest run of places that hold, among some.
pub(crate) fn longest_run(holds: &[bool], places: Range<usize>) -> Option<Range<usize>> {
    let end = |first: usize| (first..places.end).find(|&place| !holds[place]).unwrap_or(places.end);
    let runs = places.clone().map(|first| first..end(first)).filter(|run| !run.is_empty());
    // Of equally long ones the first.
    runs.rev().max_by_key(Range::len)
}

/// What a torque does in some rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Drive {
    /// It is within chance of its noise.
    Never,
    /// It is within chance of its noise in most of them.
    NowAndThen,
    /// It is more than its noise in most of them.
    Always,
}

/// What the torque does in some rows of every equation, about its median there, which an offset takes: that of the equation that is driven most.
pub(crate) fn drive(
    problem: &Problem<'_>,
    (rows, equations): (&Range<usize>, usize),
    expected: Expected,
    inflation: f64,
) -> Drive {
    let of = |equation: usize| {
        let used = || {
            let rows = rows.clone().filter(move |row| row % equations == equation);
            rows.filter(|&row| problem.usable[row] && problem.root(row) > 0.0)
        };
        let mut torques: Vec<f64> = used().map(|row| problem.rhs[row] / problem.root(row)).collect();
        let torque = median(&mut torques)?;
        let square = |row: usize| (problem.rhs[row] - torque * problem.root(row)).powi(2);
        let mut squares: Vec<f64> = used().map(square).collect();
        let independent = squares.len() as f64 / expected.variance_inflation;
        let (mean, noise) = (squares.iter().sum::<f64>() / squares.len() as f64, inflation * expected.torque);
        let most = |scattered: f64| most_by_chance(scattered, independent) * noise;
        let is_most = median(&mut squares)? > MEDIAN_OF_SQUARES * most(SCATTER_OF_MEDIAN);
        let is_struck = mean > STRUCK * most(SQRT_2);
        Some(if is_most {
            Drive::Always
        } else if is_struck {
            Drive::NowAndThen
        } else {
            Drive::Never
        })
    };
    // Without a row to look at it is as good as driven: there is nothing to leave out.
    (0..equations).filter_map(of).max().unwrap_or(Drive::Always)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_runs_the_longest_and_the_first_of_equals_stands() {
        assert_eq!(longest_run(&[true, false, true, true, false, true, true], 0..7), Some(2..4));
        assert_eq!(longest_run(&[true, false, true, true], 0..2), Some(0..1));
        assert_eq!(longest_run(&[true, false, true], 1..2), None);
    }

    #[test]
    fn noise_blows_and_a_drive_are_told_apart_about_any_offset() {
        use crate::regression::simulated::{model, random, rows, white};
        let (count, deviation) = (400, 0.1);
        let mut rows = rows(count, |_| [1.0, 0.01], deviation);
        // Nearly normal, as medians are taken of it.
        let uniform = [100, 101, 102, 103].map(|seed| random(seed, count));
        let noise: Vec<f64> = (0..count).map(|row| uniform.iter().map(|one| one[row]).sum::<f64>() / 2.0).collect();
        let blow = |row: usize| 2.0 * (0.3 * row as f64).cos().signum();
        let mut told = |torque: &dyn Fn(usize) -> f64, offset: f64| {
            for (row, noise) in noise.iter().enumerate() {
                rows.rhs[row] = deviation * noise + torque(row) + offset;
            }
            let problem = model().problem(&rows, &rows.rhs, 0.0, None);
            drive(&problem, (&(0..count), 1), white(deviation * deviation), 1.0)
        };
        for offset in [0.0, -7.0] {
            let mut blows = |every: usize| told(&|row| if row % every == 0 { blow(row) } else { 0.0 }, offset);
            assert_eq!([blows(usize::MAX), blows(10)], [Drive::Never, Drive::NowAndThen], "{offset}");
            assert_eq!(told(&|_| 0.0, offset), Drive::Never, "{offset}");
            assert_eq!(told(&|row| (0.7 * row as f64).sin(), offset), Drive::Always, "{offset}");
        }
    }
}
