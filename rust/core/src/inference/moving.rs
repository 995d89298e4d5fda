//! Rows that tell windows of different lengths apart: those around which what is windowed moves.
//!
//! Where a motion has faded, or a drive stands, windows of all lengths predict the rows equally well, to their noise. Counted among the others they
//! would hide what windows do not follow while the machine moves: with a drive that is off half of the time, half of it.

use std::ops::Range;

use crate::regression::problem::Problem;

/// The mean square of a regressor around a row, over that of all rows, from which on it moves there: 3 % of its amplitude.
const MOVES: f64 = 1e-3;

/// Whether something that is windowed moves around every row: in parts of the record as long as a test function, which reaches so many rows.
pub(crate) fn moving(problem: &Problem<'_>, reach: usize) -> Vec<bool> {
    let mean_square = |column: &[f64], rows: Range<usize>| {
        let used = rows.filter(|&row| problem.usable[row]);
        let (sum, count) =
            used.fold((0.0, 0.0_f64), |(sum, count), row| (sum + column[row] * column[row], count + 1.0));
        if count > 0.0 { sum / count } else { 0.0 }
    };
    let rows = problem.rows();
    let least: Vec<f64> = problem.windowed.iter().map(|column| MOVES * mean_square(column, 0..rows)).collect();
    let mut moving = vec![false; rows];
    for (part, moves) in moving.chunks_mut(2 * reach + 1).enumerate() {
        let first = part * (2 * reach + 1);
        let here = first..first + moves.len();
        let mut columns = problem.windowed.iter().zip(&least);
        moves.fill(columns.any(|(column, &least)| mean_square(column, here.clone()) > least));
    }
    moving
}

#[cfg(test)]
mod tests {
    use crate::regression::simulated::{model, rows};

    #[test]
    fn rows_of_a_motion_that_has_faded_do_not_move() {
        let mut rows = rows(1000, |_| [1.0, 0.0], 0.0);
        let moving = |rows: &_| super::moving(&model().problem(rows, &rows.rhs, 0.0, None), 3);
        assert_eq!(moving(&rows), [true; 1000]);
        // Parts have seven rows, and 49 ends the seventh. What is constant moves on.
        rows.regressors[0].value[49..].iter_mut().for_each(|value| *value *= 0.0005);
        assert_eq!(moving(&rows), (0..1000).map(|row| row < 49).collect::<Vec<_>>());
        rows.exclude(7..21);
        assert_eq!(moving(&rows), (0..1000).map(|row| row < 7 || (21..49).contains(&row)).collect::<Vec<_>>());
    }
}
