//! How large windowed coefficients may be, told by the torques of the whole record, and where windows do not tell even that.
//!
//! Where nothing moves, or what moves is within its noise, a window fits noise to noise: its coefficients are many times too large, and so are
//! their errors. What the error is compared with must not be the coefficient itself, which may pass through zero. It is the coefficient
//! with which its term, at the motion of the record, would be as large as the largest torque that acts: the one that was recorded, or that of a
//! constant.

use crate::regression::problem::Problem;

/// Standard errors of so large a part of that coefficient tell nothing: two of them reach as far.
const TELLS_NOTHING: f64 = 0.5;

/// Squares about the mean so small beside those about zero are rounding: the regressor is the same everywhere.
const STILL: f64 = 1e-12;

/// By windowed coefficient, the standard error from which on a window tells nothing of it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Magnitudes(Vec<f64>);

impl Magnitudes {
    /// Those of a problem's windowed coefficients beside its constants; all rows must have the torque's unit.
    pub(crate) fn new(problem: &Problem<'_>, constants: &[f64]) -> Self {
        let columns = problem.windowed.iter().chain(&problem.constants);
        // What is the same everywhere takes the mean of all that acts.
        let centred = columns.into_iter().any(|column| Moments::of(problem, column).is_still());
        let of = |column: &[f64]| {
            let moments = Moments::of(problem, column);
            if centred && !moments.is_still() { moments.about_mean.sqrt() } else { moments.about_zero.sqrt() }
        };
        let weighted = problem.constants.iter().zip(constants).map(|(column, value)| value.abs() * of(column));
        let largest = weighted.fold(of(problem.rhs), f64::max);
        Self(problem.windowed.iter().map(|column| TELLS_NOTHING * largest / of(column)).collect())
    }

    /// Where windows tell nothing of any of the coefficients, which have some standard errors at every place, or at one within a test function's reach:
    /// there they share samples, and an error that passes through a small value between large ones is none.
    pub(crate) fn untold(&self, errors: &[Vec<f64>], reach: usize) -> Vec<bool> {
        let places = errors.first().map_or(0, Vec::len);
        let mut untold = vec![false; places];
        let mut behind = 0;
        for place in 0..places {
            // Without a standard error it is not known.
            if self.0.iter().zip(errors).any(|(most, errors)| errors[place] > *most) {
                let end = (place + reach + 1).min(places);
                untold[place.saturating_sub(reach).max(behind)..end].fill(true);
                behind = end;
            }
        }
        untold
    }
}

/// Mean squares of a column at the rows that are equations.
struct Moments {
    about_zero: f64,
    about_mean: f64,
}

impl Moments {
    fn of(problem: &Problem<'_>, column: &[f64]) -> Self {
        let used = || column.iter().zip(problem.usable).filter(|(_, usable)| **usable).map(|(value, _)| *value);
        let (sum, squares, count) = used().fold((0.0, 0.0, 0.0_f64), |(sum, squares, count), value| {
            (sum + value, squares + value * value, count + 1.0)
        });
        let mean = sum / count;
        Self { about_zero: squares / count, about_mean: (squares / count - mean * mean).max(0.0) }
    }

    fn is_still(&self) -> bool {
        self.about_mean <= STILL * self.about_zero
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equation::rows::Rows;
    use crate::regression::model::Model;
    use crate::regression::simulated::{CONSTANTS, assert_near, model, rows};

    const ROWS: usize = 4000;

    fn magnitudes(rows: &Rows, model: &Model, constants: &[f64]) -> Vec<f64> {
        Magnitudes::new(&model.problem(rows, &rows.rhs, 0.0, None), constants).0
    }

    #[test]
    fn a_coefficient_of_zero_is_as_large_as_the_torque_that_acts() {
        // All regressors have a variance of one, so the torque has that of both constants.
        let rows = rows(ROWS, |_| [0.0, 0.0], 0.0);
        let torque = CONSTANTS.iter().map(|value| value * value).sum::<f64>().sqrt();
        assert_near(magnitudes(&rows, &model(), &CONSTANTS)[0], TELLS_NOTHING * torque, 0.05);
    }

    #[test]
    fn constants_tell_it_where_they_nearly_cancel_each_other() {
        let mut rows = rows(ROWS, |_| [0.0, 0.0], 0.0);
        // At a resonance the torque is next to nothing of what acts.
        rows.rhs.iter_mut().for_each(|torque| *torque *= 0.01);
        assert_near(magnitudes(&rows, &model(), &CONSTANTS)[0], TELLS_NOTHING * 2.0, 0.05);
    }

    #[test]
    fn an_offset_takes_the_mean() {
        let mut rows = rows(ROWS, |_| [3.0, 0.0], 0.0);
        let with_mean = |rows: &Rows| {
            let mut rows = rows.clone();
            rows.rhs.iter_mut().for_each(|torque| *torque += 100.0);
            rows.regressors[2].value.fill(1.0);
            rows
        };
        let offset = with_mean(&rows);
        let torque = (9.0 + CONSTANTS.iter().map(|value| value * value).sum::<f64>()).sqrt();
        assert_near(magnitudes(&offset, &model(), &[2.0, 0.0])[0], TELLS_NOTHING * torque, 0.05);
        // An offset that is windowed itself may be as large as the rest.
        let windowed = Model { windowed: vec![0, 2], constant: vec![1], linear: false, ..Model::default() };
        assert_near(magnitudes(&offset, &windowed, &[2.0])[1], TELLS_NOTHING * torque, 0.05);
        // Without one the mean is a torque as any other.
        rows.rhs.iter_mut().for_each(|torque| *torque += 100.0);
        assert!(magnitudes(&rows, &model(), &CONSTANTS)[0] > 49.0);
    }

    #[test]
    fn rows_that_are_no_equations_do_not_count() {
        let mut rows = rows(ROWS, |_| [3.0, 0.0], 0.0);
        let before = magnitudes(&rows, &model(), &CONSTANTS)[0];
        rows.regressors[0].value[7] = 1e9;
        rows.exclude([7].into_iter());
        assert_near(magnitudes(&rows, &model(), &CONSTANTS)[0], before, 1e-2);
    }

    #[test]
    fn what_one_window_does_not_tell_its_neighbours_do_not_either() {
        let magnitudes = Magnitudes(vec![1.0, 10.0]);
        let mut errors = vec![vec![0.9; 20], vec![9.0; 20]];
        assert_eq!(magnitudes.untold(&errors, 2), [false; 20]);
        (errors[0][5], errors[0][7], errors[1][18], errors[1][0]) = (1.1, f64::INFINITY, 11.0, f64::NAN);
        let expected: Vec<bool> = (0..20).map(|place| (3..10).contains(&place) || place >= 16).collect();
        assert_eq!(magnitudes.untold(&errors, 2), expected);
        assert!(magnitudes.untold(&[], 2).is_empty());
    }
}
