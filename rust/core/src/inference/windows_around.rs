//! Windows before, around and after a row: they predict the row without containing it, and give the coefficients there.

use std::ops::Range;

use crate::regression::predictor::{Predictor, UnknownInWindow};
use crate::regression::problem::Problem;
use crate::regression::window_length::{Cells, Scale};

/// The windows of one scale around some rows, ready to predict.
pub(crate) struct Around<'a> {
    scale: Scale,
    one_sided: Predictor<'a>,
    leave_gap_out: Predictor<'a>,
    full: Predictor<'a>,
}

/// A window at a row, and the time of the row after its centre.
pub(crate) struct WindowAtRow<'a, 'b> {
    window: WindowOfCell<'a, 'b>,
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
        let window = self.of_cell(cell, which)?;
        Some(WindowAtRow { window, later: self.later(problem, cell, row, which)? })
    }

    /// Gives what the windows at some rows leave of these, by row, where there are such windows.
    pub(crate) fn errors(
        &self,
        problem: &Problem<'_>,
        rows: &Range<usize>,
        which: usize,
        mut give: impl FnMut(usize, f64),
    ) {
        let mut tracks = vec![UnknownInWindow::default(); problem.layout.windowed];
        for cell in self.cells(rows) {
            let Some(window) = self.of_cell(cell, which) else { continue };
            window.candidate.lines(window.place, &mut tracks);
            for row in self.rows_of(cell, rows) {
                if let Some(later) = self.later(problem, cell, row, which) {
                    give(row, problem.rhs[row] - UnknownInWindow::predict(&tracks, problem, row, later));
                }
            }
        }
    }

    /// Gives the values, the slopes and the standard errors of the windows at some rows, by row, where there are such windows.
    pub(crate) fn numbers(
        &self,
        problem: &Problem<'_>,
        rows: &Range<usize>,
        which: usize,
        mut give: impl FnMut(usize, &[f64]),
    ) {
        let windowed = problem.layout.windowed;
        let (mut tracks, mut numbers) = (vec![UnknownInWindow::default(); windowed], vec![0.0; 3 * windowed]);
        for cell in self.cells(rows) {
            let Some(window) = self.of_cell(cell, which) else { continue };
            window.reference.tracks(window.reference_place, &mut tracks);
            for row in self.rows_of(cell, rows) {
                let Some(later) = self.later(problem, cell, row, which) else { continue };
                for (unknown, track) in tracks.iter().enumerate() {
                    numbers[unknown] = track.value(later);
                    numbers[windowed + unknown] = track.slope();
                    numbers[2 * windowed + unknown] = track.variance(later).max(0.0).sqrt();
                }
                give(row, &numbers);
            }
        }
    }

    /// The cells of some rows.
    fn cells(&self, rows: &Range<usize>) -> Range<isize> {
        if rows.is_empty() { 0..0 } else { self.scale.cell(rows.start)..self.scale.cell(rows.end - 1) + 1 }
    }

    /// Those of some rows that belong to a cell.
    fn rows_of(&self, cell: isize, rows: &Range<usize>) -> Range<usize> {
        let own = self.scale.rows_of_cell(cell);
        own.start.max(rows.start)..own.end.min(rows.end)
    }

    /// The window of the rows of a cell.
    fn of_cell(&self, cell: isize, which: usize) -> Option<WindowOfCell<'a, '_>> {
        if which == 1 {
            let (place, reference_place) = (self.leave_gap_out.place(cell)?, self.full.place(cell)?);
            let (candidate, reference) = (&self.leave_gap_out, &self.full);
            return Some(WindowOfCell { candidate, reference, place, reference_place });
        }
        if !self.scale.stands_alone() {
            return None;
        }
        let place = self.one_sided.place(self.one_sided_cell(cell, which))?;
        Some(WindowOfCell { candidate: &self.one_sided, reference: &self.one_sided, place, reference_place: place })
    }

    /// The number of the one-sided window before or after the rows of a cell.
    fn one_sided_cell(&self, cell: isize, which: usize) -> isize {
        if which == 0 { cell } else { self.scale.after(cell) }
    }

    /// The time of a row of a cell after the centre of its window, or `None` if a jump lies between.
    fn later(&self, problem: &Problem<'_>, cell: isize, row: usize, which: usize) -> Option<f64> {
        let later = |centre: f64| (row as f64 - centre) * problem.period;
        if which == 1 {
            return Some(later(self.scale.centres(cell)[1]));
        }
        let cell = self.one_sided_cell(cell, which);
        if !problem.jumps.is_empty() {
            let (rows, row) = (self.scale.one_sided_rows(cell), row.cast_signed());
            let between = if which == 0 { rows.end - 1..row } else { row..rows.start };
            if problem.jumps_within(&between) {
                return None;
            }
        }
        Some(later(self.scale.centres(cell)[0]))
    }
}

/// The window of the rows of a cell: the candidate, which predicts them without containing them, the reference, whose coefficients are used there,
/// and where both stand.
struct WindowOfCell<'a, 'b> {
    candidate: &'b Predictor<'a>,
    reference: &'b Predictor<'a>,
    place: usize,
    reference_place: usize,
}

impl WindowAtRow<'_, '_> {
    /// The reference's value of a windowed unknown at the row.
    pub(crate) fn value(&self, unknown: usize) -> f64 {
        self.window.reference.value(self.window.reference_place, unknown, self.later)
    }

    pub(crate) fn slope(&self, unknown: usize) -> f64 {
        self.window.reference.line(self.window.reference_place, unknown).slope()
    }

    pub(crate) fn variance(&self, unknown: usize) -> f64 {
        self.window.reference.variance(self.window.reference_place, unknown, self.later)
    }

    /// The candidate's prediction of the row's right-hand side.
    pub(crate) fn predict(&self, problem: &Problem<'_>, row: usize) -> f64 {
        self.window.candidate.predict(problem, self.window.place, row, self.later)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::sides::Sides;
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
        let cells = staged(|stages| scale.solve(&problem, (&all, Sides::ALL), Instructions::Scalar, stages));
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
