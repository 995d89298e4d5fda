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
