//! Results of weak rows, and what they say at every sample.

use crate::jumps::{Jump, UNLIKELY};
use crate::status::Status;

/// Samples that are looked up before every column is read for them.
const AT_A_TIME: usize = 1024;

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

/// Numbers at every so-manieth sample.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SampleResults {
    /// Unknowns that change, in the order in which they are listed.
    pub values: Vec<Vec<f64>>,
    /// Their standard errors.
    pub errors: Vec<Vec<f64>>,
    /// Covariances of pairs of unknowns.
    pub covariances: Vec<Vec<f64>>,
    /// Standard deviation of what is left of the torque after multiplication with the test function.
    pub deviation: Vec<f64>,
    /// Condition number of the equations.
    pub condition: Vec<f64>,
    /// Bits of [`Status`].
    pub status: Vec<u16>,
}

impl SampleResults {
    /// Nothing but a status.
    pub(crate) fn undetermined(changing: usize, elements: usize) -> Self {
        let nothing = || vec![f64::NAN; elements];
        Self {
            values: (0..changing).map(|_| nothing()).collect(),
            errors: (0..changing).map(|_| nothing()).collect(),
            covariances: Vec::new(),
            deviation: nothing(),
            condition: vec![f64::INFINITY; elements],
            status: vec![(Status::INVALID | Status::RANK_DEFICIENT).bits(); elements],
        }
    }
}

impl RowResults {
    /// What the rows say at every `step`-th of so many samples: interpolated between them, carried on beyond the first and last.
    pub(crate) fn at_samples(&self, samples: usize, step: usize) -> SampleResults {
        let (rows, count) = (self.status.len(), samples.div_ceil(step));
        let empty =
            |columns: &Vec<Vec<f64>>| -> Vec<Vec<f64>> { columns.iter().map(|_| Vec::with_capacity(count)).collect() };
        let mut results = SampleResults {
            values: empty(&self.values),
            errors: empty(&self.errors),
            covariances: empty(&self.covariances),
            deviation: Vec::with_capacity(count),
            condition: Vec::with_capacity(count),
            status: Vec::with_capacity(count),
        };
        let mut places = Vec::with_capacity(AT_A_TIME);
        for first in (0..count).step_by(AT_A_TIME) {
            places.clear();
            places.extend((first..count.min(first + AT_A_TIME)).map(|place| self.place(place * step, rows)));
            let into = results.values.iter_mut().zip(&self.values).zip(&self.slopes);
            for ((result, column), slopes) in into {
                let along = |place: &Place| place.between(column) + place.beyond * slopes[place.nearest];
                result.extend(places.iter().map(along));
            }
            let errors = results.errors.iter_mut().zip(&self.errors);
            let covariances = results.covariances.iter_mut().zip(&self.covariances);
            let others = [(&mut results.deviation, &self.deviation), (&mut results.condition, &self.condition)];
            for (result, column) in errors.chain(covariances).chain(others) {
                result.extend(places.iter().map(|place| place.between(column)));
            }
            results.status.extend(places.iter().map(|place| {
                let edge = if place.beyond == 0.0 { 0 } else { Status::EDGE.bits() };
                self.status[place.nearest] | edge
            }));
        }
        self.jumps.iter().for_each(|jump| self.blur(jump, samples, step, &mut results));
        results
    }

    /// Where a jump may or may not have happened the values are the mean of both, and its spread is part of their errors.
    fn blur(&self, jump: &Jump, samples: usize, step: usize, results: &mut SampleResults) {
        let (rows, at) = (self.status.len(), |row: usize| self.first + row as f64 * self.stride);
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
                let on = |row: usize| column[row] + (sample as f64 - at(row)) / self.stride * slopes[row];
                let (left, right) = (on(after - 1), on(after));
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
        let usable = |row: usize| self.status[row] & Status::INVALID.bits() == 0;
        if usable(row) != usable(next) && part != 0.0 {
            // The number beside a gap is better than none.
            let only = if usable(row) { row } else { next };
            place = Place { row: only, next: only, part: 0.0, beyond: exact - only as f64, nearest: only };
        }
        // A jump between two rows: the one on the sample's side of it is carried on.
        let jump = self.jumps.partition_point(|jump| jump.sample <= sample);
        let at = |row: usize| self.first + row as f64 * self.stride;
        let before = jump.checked_sub(1).is_some_and(|index| self.jumps[index].sample as f64 > at(row));
        let after = self.jumps.get(jump).is_some_and(|jump| jump.sample as f64 <= at(next));
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
