//! Results of weak rows, and their interpolation to every sample.

use std::ops::Range;

use crate::error::Error;
use crate::exec::huge_pages::zeros;
use crate::exec::pool::Piece;
use crate::exec::stages::Stages;
use crate::inference::constancy::Test;
use crate::inference::jumps::jump::{Jump, UNLIKELY};
use crate::status::Status;

/// Rows in a piece of work.
const PIECE: usize = 8192;

/// Numbers at the rows, and what they grow by from row to row where they are carried on beyond the ends.
type Source<'a> = (&'a Vec<f64>, Option<&'a Vec<f64>>);

/// Numbers at every row.
#[derive(Clone, Debug, Default)]
pub(crate) struct RowResults {
    /// The sample of row 0; rows may begin before the record.
    pub(crate) first: f64,
    /// Samples from one row to the next.
    pub(crate) stride: f64,
    /// Windowed and slow unknowns, what they grow by from row to row, and their standard errors.
    pub(crate) values: Vec<Vec<f64>>,
    pub(crate) slopes: Vec<Vec<f64>>,
    pub(crate) errors: Vec<Vec<f64>>,
    /// Covariances of pairs.
    pub(crate) covariances: Vec<Vec<f64>>,
    pub(crate) deviation: Vec<f64>,
    pub(crate) condition: Vec<f64>,
    /// Bits of [`Status`].
    pub(crate) status: Vec<u16>,
    /// Where the values jump, in order.
    pub(crate) jumps: Vec<Jump>,
}

/// A parameter that is constant over the record.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Constant {
    /// Which unknown: 0 inertia, 1 damping, 2 stiffness, then terms.
    pub(crate) unknown: usize,
    /// Its value.
    pub(crate) value: f64,
    /// Its standard error.
    pub(crate) error: f64,
    /// Whether it is the same in all parts of the record.
    pub(crate) test: Option<Test>,
}

/// Numbers at every `step`-th sample.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct SampleResults {
    /// Unknowns that change, in the order in which they are listed.
    pub(crate) values: Vec<Vec<f64>>,
    /// Their standard errors.
    pub(crate) errors: Vec<Vec<f64>>,
    /// Covariances of pairs of unknowns.
    pub(crate) covariances: Vec<Vec<f64>>,
    /// Standard deviation of the residuals of the rows.
    pub(crate) deviation: Vec<f64>,
    /// Condition number of the equations.
    pub(crate) condition: Vec<f64>,
    /// Bits of [`Status`].
    pub(crate) status: Vec<u16>,
}

impl SampleResults {
    /// Nothing but a status.
    pub(crate) fn undetermined(changing: usize, elements: usize, stages: &mut Stages<'_, '_>) -> Result<Self, Error> {
        let filled = |columns: usize, value: f64, stages: &mut Stages<'_, '_>| -> Result<Vec<Vec<f64>>, Error> {
            let mut columns: Vec<Vec<f64>> = (0..columns).map(|_| zeros(elements)).collect::<Result<_, _>>()?;
            stages.fill(&mut columns, |_, parts| parts.iter_mut().for_each(|part| part.fill(value)))?;
            Ok(columns)
        };
        let mut status = zeros(elements)?;
        status.fill((Status::INVALID | Status::RANK_DEFICIENT).bits());
        Ok(Self {
            values: filled(changing, f64::NAN, stages)?,
            errors: filled(changing, f64::NAN, stages)?,
            covariances: Vec::new(),
            deviation: filled(1, f64::NAN, stages)?.remove(0),
            condition: filled(1, f64::INFINITY, stages)?.remove(0),
            status,
        })
    }
}

impl RowResults {
    /// What the rows say at every `step`-th of so many samples: interpolated between them, carried on beyond the first and last.
    pub(crate) fn at_samples(
        &self,
        samples: usize,
        step: usize,
        stages: &mut Stages<'_, '_>,
    ) -> Result<SampleResults, Error> {
        let (rows, count) = (self.status.len(), samples.div_ceil(step));
        let carried = self.values.iter().zip(&self.slopes).map(|(column, slopes)| (column, Some(slopes)));
        let kept = self.errors.iter().chain(&self.covariances).chain([&self.deviation, &self.condition]);
        let sources: Vec<Source<'_>> = carried.chain(kept.map(|column| (column, None))).collect();
        let mut columns: Vec<Vec<f64>> = sources.iter().map(|_| zeros(count)).collect::<Result<_, _>>()?;
        let mut status = zeros(count)?;
        let mut pieces = Vec::new();
        {
            let mut columns: Vec<&mut [f64]> = columns.iter_mut().map(Vec::as_mut_slice).collect();
            let (mut status, mut done) = (status.as_mut_slice(), 0);
            for first in (0..rows).step_by(PIECE) {
                let rows = first..rows.min(first + PIECE);
                let end = if rows.end == self.status.len() { count } else { self.element(rows.end, step).min(count) };
                let here = ..end - done;
                let columns: Vec<_> = columns.iter_mut().filter_map(|column| column.split_off_mut(here)).collect();
                let status = status.split_off_mut(here).unwrap_or_default();
                pieces.push(Piece { size: status.len() * step, content: (done, rows, columns, status) });
                done = end;
            }
        }
        stages.map(
            pieces,
            || (),
            |(first, rows, columns, status): (_, _, Vec<&mut [f64]>, &mut [u16]), (): &mut ()| {
                self.between(&sources, step, first, rows, columns, status);
            },
        )?;
        let mut columns = columns.into_iter();
        let mut next = |count: usize| columns.by_ref().take(count).collect();
        let mut results = SampleResults {
            values: next(self.values.len()),
            errors: next(self.errors.len()),
            covariances: next(self.covariances.len()),
            deviation: Vec::new(),
            condition: Vec::new(),
            status,
        };
        results.deviation = columns.next().unwrap_or_default();
        results.condition = columns.next().unwrap_or_default();
        self.jumps.iter().for_each(|jump| self.blur(jump, samples, step, &mut results));
        Ok(results)
    }

    /// The first element at or after a row, for one every `step` samples.
    fn element(&self, row: usize, step: usize) -> usize {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a row of the record, or before it")]
        let element = (self.at(row) / step as f64).ceil().max(0.0) as usize;
        element
    }

    /// The sample of a row.
    fn at(&self, row: usize) -> f64 {
        self.first + row as f64 * self.stride
    }

    /// Fills elements from `first` on, which lie between rows and the rows after them.
    fn between(
        &self,
        sources: &[Source<'_>],
        step: usize,
        first: usize,
        rows: Range<usize>,
        mut columns: Vec<&mut [f64]>,
        status: &mut [u16],
    ) {
        let total = self.status.len();
        let end = first + status.len();
        let mut parts = Vec::new();
        let mut done = first;
        for row in rows {
            let next = if row + 1 == total { end } else { self.element(row + 1, step).min(end) };
            let here = done - first..next - first;
            // What lies before the first row or beyond the last, next to a gap or over a jump is looked up sample by sample.
            let alone = row == 0 && done < self.element(0, step) || row + 1 == total || self.breaks_after(row);
            parts.clear();
            if alone {
                for (place, element) in here.zip(done..) {
                    let found = self.place(element * step, total);
                    for ((column, slopes), result) in sources.iter().zip(&mut columns) {
                        let carried = slopes.map_or(0.0, |slopes| found.beyond * slopes[found.nearest]);
                        result[place] = found.between(column) + carried;
                    }
                    let edge = if found.beyond == 0.0 { 0 } else { Status::EDGE.bits() };
                    status[place] = self.status[found.nearest] | edge;
                }
            } else {
                parts.extend((done..next).map(|element| ((element * step) as f64 - self.at(row)) / self.stride));
                for ((column, _), result) in sources.iter().zip(&mut columns) {
                    let (before, after) = (column[row], column[row + 1]);
                    for (value, part) in result[here.clone()].iter_mut().zip(&parts) {
                        *value = before + part * (after - before);
                    }
                    if parts.first() == Some(&0.0) {
                        result[here.start] = before;
                    }
                }
                for (status, &part) in status[here].iter_mut().zip(&parts) {
                    *status = self.status[if part < 0.5 { row } else { row + 1 }];
                }
            }
            done = next;
        }
    }

    /// Whether there is a jump between a row and the next, or a number at only one of them.
    fn breaks_after(&self, row: usize) -> bool {
        let next = self.jumps.partition_point(|jump| jump.sample as f64 <= self.at(row));
        self.is_usable(row) != self.is_usable(row + 1)
            || self.jumps.get(next).is_some_and(|jump| jump.sample as f64 <= self.at(row + 1))
    }

    fn is_usable(&self, row: usize) -> bool {
        self.status[row] & Status::INVALID.bits() == 0
    }

    /// Where a jump may or may not have happened the values are the mean of both, and its spread is part of their errors. Of the side that a sample is on
    /// it has its value; the other is carried on from the last row beside the jump.
    fn blur(&self, jump: &Jump, samples: usize, step: usize, results: &mut SampleResults) {
        let rows = self.status.len();
        let exact = (jump.sample as f64 - self.first) / self.stride;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the rows")]
        let after = exact.ceil().clamp(1.0, rows as f64 - 1.0) as usize;
        let end = samples.min(jump.first + jump.happened.len());
        for sample in (jump.first.next_multiple_of(step)..end).step_by(step) {
            let happened = jump.happened[sample - jump.first];
            if !(UNLIKELY..=1.0 - UNLIKELY).contains(&happened) {
                continue;
            }
            let place = sample / step;
            for ((column, slopes), (values, errors)) in
                self.values.iter().zip(&self.slopes).zip(results.values.iter_mut().zip(&mut results.errors))
            {
                let on = |row: usize| column[row] + (sample as f64 - self.at(row)) / self.stride * slopes[row];
                let own = values[place];
                let (left, right) = if sample < jump.sample { (own, on(after)) } else { (on(after - 1), own) };
                values[place] = left + happened * (right - left);
                errors[place] = errors[place].hypot((happened * (1.0 - happened)).sqrt() * (right - left));
            }
        }
    }

    fn place(&self, sample: usize, rows: usize) -> Place {
        let exact = (sample as f64 - self.first) / self.stride;
        let inside = exact.clamp(0.0, rows as f64 - 1.0);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the rows")]
        let row = inside.floor() as usize;
        let next = (row + 1).min(rows - 1);
        let part = inside - row as f64;
        let mut place = Place { row, next, part, beyond: exact - inside, nearest: if part < 0.5 { row } else { next } };
        if self.is_usable(row) != self.is_usable(next) && part != 0.0 {
            // The number beside a gap is better than none.
            let only = if self.is_usable(row) { row } else { next };
            place = Place { row: only, next: only, part: 0.0, beyond: exact - only as f64, nearest: only };
        }
        // A jump between two rows: the row on the same side of the jump as the sample is carried on.
        let jump = self.jumps.partition_point(|jump| jump.sample <= sample);
        let before = jump.checked_sub(1).is_some_and(|index| self.jumps[index].sample as f64 > self.at(row));
        let after = self.jumps.get(jump).is_some_and(|jump| jump.sample as f64 <= self.at(next));
        match (before, after) {
            (true, false) => Place { row: next, next, part: 0.0, beyond: exact - next as f64, nearest: next },
            (false, true) => Place { row, next: row, part: 0.0, beyond: exact - row as f64, nearest: row },
            _ => place,
        }
    }
}

/// Where a sample lies among rows.
#[derive(Clone, Copy, Debug)]
struct Place {
    row: usize,
    next: usize,
    /// How far from the one to the other.
    part: f64,
    /// Rows by which it lies outside of them.
    beyond: f64,
    nearest: usize,
}

impl Place {
    fn between(&self, column: &[f64]) -> f64 {
        if self.part == 0.0 {
            return column[self.row];
        }
        column[self.row] + self.part * (column[self.next] - column[self.row])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::simulated::staged;

    const ROWS: usize = 60;
    const STRIDE: f64 = 10.0;

    #[test]
    fn where_a_jump_may_have_happened_the_side_that_a_sample_is_on_has_its_own_value() {
        // A curve on both sides of a jump, whose growth is hardly known beside it.
        let curve = |row: usize| if row < 30 { 1.0 } else { 2.0 + 0.01 * (row as f64 - 30.0) };
        let slope = |row: usize| if row == 30 { 0.5 } else { 0.0 };
        let happened: Vec<f64> = (0..200).map(|place| f64::from(place) / 199.0).collect();
        let column = |of: fn(usize) -> f64| vec![(0..ROWS).map(of).collect::<Vec<f64>>()];
        let results = RowResults {
            first: 5.0,
            stride: STRIDE,
            values: vec![(0..ROWS).map(curve).collect()],
            slopes: vec![(0..ROWS).map(slope).collect()],
            errors: column(|_| 0.1),
            deviation: vec![0.0; ROWS],
            condition: vec![1.0; ROWS],
            status: vec![0; ROWS],
            jumps: vec![Jump { sample: 300, first: 200, happened: happened.clone(), of_constants: false }],
            ..RowResults::default()
        };
        let found = staged(|stages| results.at_samples(600, 1, stages));
        let later = 375;
        let (part, own) = (happened[later - 200], curve(37));
        assert!((found.values[0][later] - (1.0 + part * (own - 1.0))).abs() < 1e-12, "{}", found.values[0][later]);
        let spread = (part * (1.0 - part)).sqrt() * (own - 1.0);
        assert!((found.errors[0][later] - 0.1_f64.hypot(spread)).abs() < 1e-12);
        // Before it, what comes after is carried on from the first row behind it.
        let (earlier, part) = (245, happened[45]);
        let after = 2.0 + (245.0 - 305.0) / STRIDE * 0.5;
        assert!((found.values[0][earlier] - (1.0 + part * (after - 1.0))).abs() < 1e-12);
    }
}
