//! A window of a given length centred on every row, as in the paper. Near the ends of the record it is shorter, down to
//! half of its length.
//!
//! The record ends at its first and last equation. Between them, masked or missing rows leave a window with fewer
//! equations.

use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::Piece;
use crate::exec::stages::Stages;
use crate::regression::constants::sums_of_squares;
use crate::regression::dyadic_windows::{WindowShape, solve_windows};
use crate::regression::layout::Fields;
use crate::regression::predictor::Predictor;
use crate::regression::problem::Problem;
use crate::regression::solved::Solved;
use crate::simd::instructions::Instructions;
use crate::status::Status;

/// The condition number of a window is at least the number of its unknowns, apart from rounding; a column of zeros lowers it by one.
const LEAST_CONDITION: f64 = 0.999;

/// Rows in a piece of work.
const PIECE: usize = 2048;

/// Results of the windows around every row.
#[derive(Clone, Debug, Default)]
pub(crate) struct EveryWindow {
    /// Windowed unknowns, by row.
    pub(crate) values: Vec<Vec<f64>>,
    /// Their covariance for given constants, the lower half row by row.
    pub(crate) covariances: Vec<Vec<f64>>,
    /// Their derivatives with respect to each constant: unknown by unknown, constant by constant.
    pub(crate) sensitivities: Vec<Vec<f64>>,
    pub(crate) condition: Vec<f64>,
    /// Standard deviation of the residuals.
    pub(crate) deviation: Vec<f64>,
    pub(crate) status: Vec<u16>,
}

/// Solves a window of `window` rows around each of some rows, which need not exist, for given constants.
pub(crate) fn every_window(
    problem: &Problem<'_>,
    window: usize,
    rows: Range<isize>,
    constants: &[f64],
    ill_conditioned: f64,
    instructions: Instructions,
    stages: &mut Stages<'_, '_>,
) -> Result<EveryWindow, Error> {
    let before = (window / 2).cast_signed();
    let mut pieces = Vec::new();
    for first in rows.clone().step_by(PIECE) {
        let part = first..rows.end.min(first + PIECE.cast_signed());
        pieces.push(Piece { size: part.len(), content: part.start - before..part.end - before });
    }
    let shape = WindowShape { centre: before as f64, ..WindowShape::of(0..window, 1) };
    let work = |blocks: Range<isize>, (): &mut ()| {
        solve_windows(problem, 1, &blocks, std::slice::from_ref(&shape), instructions).swap_remove(0)
    };
    let solved = stages.map(pieces, || (), work)?;
    let solved = Solved::join(&solved.iter().collect::<Vec<_>>());
    let (fields, layout) = (solved.fields, problem.layout);
    let predictor = Predictor::new(&solved, constants);
    let mut found = EveryWindow { condition: solved.field(fields.condition()).to_vec(), ..EveryWindow::default() };
    for unknown in 0..layout.windowed {
        found.values.push((0..solved.len()).map(|place| predictor.value(place, unknown, 0.0)).collect());
        for other in 0..=unknown {
            found.covariances.push(solved.field(fields.covariance(unknown, other)).to_vec());
        }
        for constant in 0..layout.constant {
            found.sensitivities.push(solved.field(fields.solution(unknown, constant)).iter().map(|s| -s).collect());
        }
    }
    let record = problem.inside();
    let left = sums_of_squares(&solved, &(0..solved.len()), constants);
    for place in 0..solved.len() {
        let begin = solved.first + place.cast_signed();
        let inside =
            (begin + window.cast_signed()).min(record.end.cast_signed()) - begin.max(record.start.cast_signed());
        let inside = usize::try_from(inside).unwrap_or(0);
        let status = status(&solved, fields, place, [window, inside], ill_conditioned);
        found.status.push(status.bits());
        let freedom = solved.field(fields.count())[place] - layout.local() as f64;
        found.deviation.push((left[place].max(0.0) / freedom.max(1.0)).sqrt());
        if status.contains(Status::INVALID) {
            found.values.iter_mut().chain(&mut found.covariances).for_each(|column| column[place] = f64::NAN);
            found.deviation[place] = f64::NAN;
            let rank_deficient = status.contains(Status::RANK_DEFICIENT);
            found.condition[place] = if rank_deficient { f64::INFINITY } else { f64::NAN };
        }
    }
    Ok(found)
}

/// The status of a window of which so many rows lie between the first equation and the last.
fn status(solved: &Solved, fields: Fields, place: usize, [window, inside]: [usize; 2], ill_conditioned: f64) -> Status {
    let count = solved.field(fields.count())[place];
    let condition = solved.field(fields.condition())[place];
    let unknowns = fields.layout.local() as f64;
    let mut status = if inside < window { Status::EDGE } else { Status::GOOD };
    if count < inside as f64 {
        status |= Status::GAP;
    }
    if 2 * inside < window {
        status |= Status::INVALID;
    } else if count <= unknowns
        || condition < LEAST_CONDITION * unknowns
        || !condition.is_finite()
        || condition * f64::EPSILON * count >= 1.0
    {
        status |= Status::INVALID | Status::RANK_DEFICIENT;
    } else if condition > ill_conditioned {
        status |= Status::ILL_CONDITIONED;
    }
    status
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equation::rows::Rows;
    use crate::regression::simulated::{CONSTANTS, PERIOD, assert_near, least_squares, model, rows, staged};

    const ROWS: usize = 90;
    const WINDOW: usize = 21;

    fn noisy() -> Rows {
        let mut rows = rows(ROWS, |time| [time.sin(), time.cos()], 0.2);
        rows.exclude([40, 41].into_iter());
        rows
    }

    fn found(rows: &Rows, range: Range<isize>) -> EveryWindow {
        let problem = model().problem(rows, &rows.rhs, 0.0, None);
        staged(|stages| every_window(&problem, WINDOW, range, &CONSTANTS, 500.0, Instructions::Scalar, stages))
    }

    #[test]
    fn a_window_around_every_row_is_least_squares_of_its_rows() {
        let rows = noisy();
        let problem = model().problem(&rows, &rows.rhs, 0.0, None);
        let rest = crate::regression::predictor::without_constants(&problem, &CONSTANTS);
        let found = found(&rows, 0..ROWS.cast_signed());
        for row in 0..ROWS {
            let held: Vec<usize> = (row.saturating_sub(WINDOW / 2)..(row + WINDOW / 2 + 1).min(ROWS))
                .filter(|&row| rows.usable[row])
                .collect();
            let value: Vec<f64> = held.iter().map(|&row| rows.regressors[0].value[row]).collect();
            let time = |one: usize| (one as f64 - row as f64) * PERIOD;
            let companion =
                held.iter().map(|&one| rows.regressors[0].companion[one] + time(one) * rows.regressors[0].value[one]);
            let columns = [value.clone(), companion.collect(), held.iter().map(|&row| rest[row]).collect()];
            let expected = least_squares(&columns);
            assert_near(found.values[0][row], expected[0], 1e-9);
            let left =
                (0..held.len()).map(|i| columns[2][i] - expected[0] * columns[0][i] - expected[1] * columns[1][i]);
            let deviation = (left.map(|left| left * left).sum::<f64>() / (held.len() as f64 - 2.0)).sqrt();
            assert_near(found.deviation[row], deviation, 1e-9);
        }
    }

    #[test]
    fn flags_say_what_a_window_lacks() {
        let rows = noisy();
        let status = |range: Range<isize>| found(&rows, range).status;
        let (edge, gap) = (Status::EDGE.bits(), Status::GAP.bits());
        let all = status(0..ROWS.cast_signed());
        for (row, &status) in all.iter().enumerate() {
            let near_end = row < WINDOW / 2 || row + WINDOW / 2 >= ROWS;
            assert_eq!(status & edge != 0, near_end, "{row}");
            // Windows that hold one of the rows 40 and 41 that are no equations.
            assert_eq!(status & gap != 0, (30..=51).contains(&row), "{row}");
            assert_eq!(status & Status::INVALID.bits(), 0, "{row}");
        }
        // Beyond the record half of a window must be left.
        let beyond = status(-3..0);
        assert!(beyond.iter().all(|status| status & Status::INVALID.bits() != 0));
    }

    #[test]
    fn a_regressor_that_rests_determines_nothing() {
        let mut rows = noisy();
        rows.regressors[0].value.fill(0.0);
        rows.regressors[0].companion.fill(0.0);
        let found = found(&rows, 20..30);
        let nothing = (Status::INVALID | Status::RANK_DEFICIENT).bits();
        assert!(found.status.iter().all(|status| status & nothing == nothing));
        assert!(found.values[0].iter().all(|value| value.is_nan()));
        assert!(found.condition.iter().all(|condition| condition.is_infinite()));
    }
}
