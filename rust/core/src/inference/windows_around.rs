//! Windows before, around and after a row: they predict the row without containing it, and give the coefficients there.

use crate::regression::predictor::Predictor;
use crate::regression::problem::Problem;
use crate::regression::window_length::{Cells, Scale};

/// The windows of one scale around some rows, ready to predict.
pub(crate) struct Around<'a> {
    scale: Scale,
    one_sided: Predictor<'a>,
    leave_gap_out: Predictor<'a>,
    full: Predictor<'a>,
}

/// A window at a row: the candidate, which predicts the row without containing it, the reference, whose coefficients
/// are used there, and the time of the row after their centre.
pub(crate) struct WindowAtRow<'a, 'b> {
    candidate: &'b Predictor<'a>,
    reference: &'b Predictor<'a>,
    place: usize,
    reference_place: usize,
    later: f64,
}

impl<'a> Around<'a> {
    pub(crate) fn new(scale: Scale, cells: &'a Cells, constants: &[f64]) -> Self {
        let of = |solved| Predictor::new(solved, constants);
        Self { scale, one_sided: of(&cells.one_sided), leave_gap_out: of(&cells.leave_gap_out), full: of(&cells.full) }
    }

    /// The window before (0), around (1) or after (2) a row, or `None` if it does not exist or a jump lies between.
    pub(crate) fn at_row(&self, problem: &Problem<'_>, row: usize, which: usize) -> Option<WindowAtRow<'a, '_>> {
        let cell = self.scale.cell(row);
        let later = |centre: f64| (row as f64 - centre) * problem.period;
        if which == 1 {
            let (place, reference_place) = (self.leave_gap_out.place(cell)?, self.full.place(cell)?);
            let later = later(self.scale.centres(cell)[1]);
            return Some(WindowAtRow {
                candidate: &self.leave_gap_out,
                reference: &self.full,
                place,
                reference_place,
                later,
            });
        }
        if !self.scale.stands_alone() {
            return None;
        }
        let cell = if which == 0 { cell } else { self.scale.after(cell) };
        let place = self.one_sided.place(cell)?;
        let rows = self.scale.one_sided_rows(cell);
        let between = if which == 0 { rows.end - 1..row.cast_signed() } else { row.cast_signed()..rows.start };
        if problem.jumps_within(&between) {
            return None;
        }
        let later = later(self.scale.centres(cell)[0]);
        Some(WindowAtRow {
            candidate: &self.one_sided,
            reference: &self.one_sided,
            place,
            reference_place: place,
            later,
        })
    }
}

impl WindowAtRow<'_, '_> {
    /// The reference's value of a windowed unknown at the row.
    pub(crate) fn value(&self, unknown: usize) -> f64 {
        self.reference.value(self.reference_place, unknown, self.later)
    }

    pub(crate) fn slope(&self, unknown: usize) -> f64 {
        self.reference.value(self.reference_place, unknown, 1.0)
            - self.reference.value(self.reference_place, unknown, 0.0)
    }

    pub(crate) fn variance(&self, unknown: usize) -> f64 {
        self.reference.variance(self.reference_place, unknown, self.later)
    }

    /// The candidate's prediction of the row's right-hand side.
    pub(crate) fn predict(&self, problem: &Problem<'_>, row: usize) -> f64 {
        self.candidate.predict(problem, self.place, row, self.later)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::simulated::{CONSTANTS, PERIOD, assert_near, model, rows, staged};
    use crate::simd::instructions::Instructions;

    const ROWS: usize = 400;
    const ROW: usize = 200;

    fn line(time: f64) -> [f64; 2] {
        [3.0 + 0.2 * time, 0.2]
    }

    /// What windows before, around and after row 200 say of it and predict there, the row itself being off by something.
    fn at_row(off: f64, jump: Option<usize>) -> [Option<[f64; 2]>; 3] {
        let mut rows = rows(ROWS, line, 0.0);
        rows.rhs[ROW] += off;
        rows.jumps.extend(jump);
        let problem = model().problem(&rows, &rows.rhs, 0.0, None);
        let scale = *Scale::all(ROWS, 3).iter().find(|scale| scale.stands_alone()).expect("a length");
        let all = scale.one_sided_cells(ROWS);
        let cells = staged(|stages| scale.solve(&problem, &all, Instructions::Scalar, stages));
        let around = Around::new(scale, &cells, &CONSTANTS);
        [0, 1, 2].map(|which| {
            let window = around.at_row(&problem, ROW, which)?;
            assert!(window.variance(0) >= 0.0);
            Some([window.value(0), window.predict(&problem, ROW)])
        })
    }

    #[test]
    fn a_line_is_predicted_from_every_side_by_windows_that_have_not_seen_the_row() {
        let rows = rows(ROWS, line, 0.0);
        let constants: f64 = (0..2).map(|one| CONSTANTS[one] * rows.regressors[1 + one].value[ROW]).sum();
        for off in [0.0, 100.0] {
            for (which, found) in at_row(off, None).into_iter().enumerate() {
                let [value, predicted] = found.expect("a window");
                assert_near(predicted, rows.rhs[ROW] - constants, 1e-9);
                // The value at the row itself comes from all rows around it, this one too.
                let untouched = (value - line(ROW as f64 * PERIOD)[0]).abs() < 1e-8;
                assert_eq!(untouched, off == 0.0 || which != 1, "{which}: {value}");
            }
        }
    }

    #[test]
    fn a_jump_between_a_row_and_a_window_hides_the_window() {
        let seen = |jump| at_row(0.0, Some(jump)).map(|window| window.is_some());
        // The jump comes right before the row, right behind it, or far away.
        assert_eq!(seen(ROW), [false, false, true]);
        assert_eq!(seen(ROW + 1), [true, false, false]);
        assert_eq!(seen(20), [true, true, true]);
    }
}
