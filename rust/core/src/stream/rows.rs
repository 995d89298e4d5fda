//! The latest rows of equations, known by their absolute numbers.

use crate::least_squares::one_by_one::RowSource;
use crate::record::samples::{Samples, is_usable};
use crate::stream::polynomials::PIECE;

/// Rows that are still needed, row by row.
#[derive(Clone, Debug)]
pub(crate) struct RecentRows {
    /// Numbers of a row, its weight included.
    columns: usize,
    /// Whether the last number of a row is its weight.
    weighted: bool,
    /// Number of the first row in `values`.
    first: usize,
    values: Vec<f64>,
    /// Numbers of the rows that hold an unusable value, in order.
    unusable: Vec<usize>,
    /// Numbers of the rows of weight zero, in order.
    without_weight: Vec<usize>,
}

/// Reads records piece by piece into columns, and gives the number of rows and the columns of each.
pub(crate) fn in_pieces(records: &[&dyn Samples], columns: &mut [Vec<f64>], mut take: impl FnMut(usize, &[Vec<f64>])) {
    let total = records.first().map_or(0, |record| record.len());
    for from in (0..total).step_by(PIECE) {
        let count = PIECE.min(total - from);
        for (column, record) in columns.iter_mut().zip(records) {
            column.resize(count, 0.0);
            record.read(from, column);
        }
        take(count, columns);
    }
}

impl RecentRows {
    /// Rows of so many columns from number `first` on.
    pub(crate) fn new(columns: usize, first: usize, values: Vec<f64>) -> Self {
        Self::of(columns, false, first, values)
    }

    /// The same, with one column more for the weights where there are any.
    pub(crate) fn of(columns: usize, weighted: bool, first: usize, values: Vec<f64>) -> Self {
        let columns = columns + usize::from(weighted);
        let (unusable, without_weight) = (Vec::new(), Vec::new());
        let mut rows = Self { columns, weighted, first, values, unusable, without_weight };
        rows.note_unusable(first);
        rows
    }

    /// Number of rows so far, those that were forgotten included.
    pub(crate) fn len(&self) -> usize {
        self.first + self.values.len() / self.columns
    }

    /// Appends rows that are given column by column.
    pub(crate) fn extend<'a>(&mut self, count: usize, columns: impl Iterator<Item = &'a [f64]>) {
        if count == 0 {
            return;
        }
        let (from, held) = (self.len(), self.values.len());
        self.values.resize(held + count * self.columns, 0.0);
        for (column, values) in columns.enumerate() {
            for (place, &value) in self.values[held + column..].iter_mut().step_by(self.columns).zip(values) {
                *place = value;
            }
        }
        self.note_unusable(from);
    }

    /// Forgets rows before one, as [`crate::record::retained::Retained`] does.
    pub(crate) fn forget_before(&mut self, row: usize) {
        let gone = row.saturating_sub(self.first).min(self.values.len() / self.columns);
        if 2 * gone * self.columns > self.values.len() {
            self.values.drain(..gone * self.columns);
            self.first += gone;
            let first = self.first;
            self.unusable.retain(|&bad| bad >= first);
            self.without_weight.retain(|&row| row >= first);
        }
    }

    /// The rows from one on and its number: what resuming needs.
    pub(crate) fn from(&self, row: usize) -> (usize, &[f64]) {
        let gone = row.saturating_sub(self.first).min(self.values.len() / self.columns);
        (self.first + gone, &self.values[gone * self.columns..])
    }

    /// Every column as a record; the weights are the last, where there are any.
    pub(crate) fn columns(&self) -> Vec<ColumnOf<'_>> {
        (0..self.columns).map(|column| ColumnOf { rows: self, column }).collect()
    }

    /// One number of a row.
    fn number(&self, row: usize, column: usize) -> f64 {
        self.values[(row - self.first) * self.columns + column]
    }

    fn note_unusable(&mut self, from: usize) {
        let place = (from - self.first) * self.columns;
        for (number, row) in (from..).zip(self.values[place..].chunks_exact(self.columns)) {
            if self.weighted && row[self.columns - 1] == 0.0 {
                self.without_weight.push(number);
            } else if !row.iter().all(|value| is_usable(*value)) {
                self.unusable.push(number);
            }
        }
    }
}

impl RowSource for RecentRows {
    fn row(&self, row: usize) -> &[f64] {
        &self.values[(row - self.first) * self.columns..][..self.columns - usize::from(self.weighted)]
    }

    fn weight(&self, row: usize) -> f64 {
        if self.weighted { self.values[(row - self.first + 1) * self.columns - 1] } else { 1.0 }
    }

    fn without_weight(&self) -> &[usize] {
        &self.without_weight
    }

    fn unusable(&self) -> &[usize] {
        &self.unusable
    }
}

/// One column of the rows.
pub(crate) struct ColumnOf<'a> {
    rows: &'a RecentRows,
    column: usize,
}

impl Samples for ColumnOf<'_> {
    fn len(&self) -> usize {
        self.rows.len()
    }

    fn read(&self, first: usize, into: &mut [f64]) {
        for (row, value) in (first..).zip(into) {
            *value = if row < self.rows.first { 0.0 } else { self.rows.number(row, self.column) };
        }
    }
}
