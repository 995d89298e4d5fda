//! Windowed coefficients at every row.

use std::ops::Range;

use crate::error::Error;
use crate::exec::stages::Stages;
use crate::identify::weak::decided::{Decided, rows_of};
use crate::identify::weak::outside_mask::Outside;
use crate::identify::weak::session::Session;
use crate::inference::carried_on::{add_unknown_changes, far_from_equations};
use crate::inference::window_averaging::average;
use crate::regression::centred_windows::every_window;
use crate::regression::constants::Expected;
use crate::regression::fit::Fit;
use crate::regression::limits::HARDLY_TOLD_APART;
use crate::regression::predictor::without_constants;
use crate::regression::problem::Problem;
use crate::regression::solved::{is_determined, sensitivity};
use crate::regression::subsample::{stretches_of_rows, thinned_column, thinned_rows};
use crate::status::Status;
use crate::weak_form::weak_rows::WeakRows;

/// Time-varying parameters, at rows from `first` on, whatever they were taken from.
pub(crate) struct Tracks {
    pub(crate) first: isize,
    pub(crate) values: Vec<Vec<f64>>,
    pub(crate) slopes: Vec<Vec<f64>>,
    /// Covariances for given constants, the lower half row by row.
    pub(crate) covariances: Vec<Vec<f64>>,
    pub(crate) sensitivities: Vec<Vec<f64>>,
    pub(crate) condition: Vec<f64>,
    pub(crate) status: Vec<u16>,
}

impl Tracks {
    /// The tracks of no coefficient: only condition and status.
    fn of_no_coefficient(rows: usize) -> Self {
        let nothing = || Vec::new();
        Self {
            first: 0,
            values: nothing(),
            slopes: nothing(),
            covariances: nothing(),
            sensitivities: nothing(),
            condition: vec![1.0; rows],
            status: vec![0; rows],
        }
    }

    /// The row of a place.
    pub(crate) fn row(&self, place: usize) -> f64 {
        (self.first + place.cast_signed()) as f64
    }

    /// Marks rows that are no equations, and those outside the mask where the model fails.
    pub(crate) fn mark(&mut self, usable: &[bool], outside: Option<&Outside>) {
        let first = self.first;
        let mut flag = |row: usize, status: Status| {
            self.status[(row.cast_signed() - first).unsigned_abs()] |= status.bits();
        };
        (0..usable.len()).filter(|&row| !usable[row]).for_each(|row| flag(row, Status::GAP));
        for &row in outside.iter().filter(|outside| outside.fails()).flat_map(|outside| &outside.rows) {
            flag(row, Status::NOISE_MODEL);
        }
    }
}

impl Session<'_, '_, '_> {
    /// The rows that numbers at the wanted samples are made of, with those within a window around them, of which residuals are.
    fn wanted_rows(&self, weak: &WeakRows, span: usize) -> Range<usize> {
        let rows = weak.rows.len();
        let Some(wanted) = &self.options.wanted else { return 0..rows };
        let row = |sample: usize| sample.saturating_sub(weak.first) / weak.stride;
        let end = rows.min(row(wanted.end) + span + 2);
        row(wanted.start).saturating_sub(span + 1).min(end)..end
    }

    /// Time-varying parameters, at every row.
    pub(crate) fn tracks(
        &mut self,
        problem: &Problem<'_>,
        weak: &WeakRows,
        decided: &Decided,
        (fit, all): (&Fit, &Fit),
        constants: &[f64],
        expected: Expected,
    ) -> Result<Tracks, Error> {
        let rows = &weak.rows;
        let instructions = self.options.instructions;
        let windowed = problem.layout.windowed;
        if windowed == 0 {
            return Ok(Tracks::of_no_coefficient(rows.len()));
        }
        if !self.options.averaging {
            // Rows that would lie before and after the record have windows too, as long as half of them is there.
            let beyond = weak.first.div_ceil(weak.stride).cast_signed();
            let range = -beyond..rows.len().cast_signed() + beyond + 1;
            let (ill, stages) = (HARDLY_TOLD_APART, &mut self.stages);
            let window = self.options.regression_window.map_or(fit.span, |samples| rows_of(samples, weak.stride));
            let found = every_window(problem, window, range.clone(), constants, ill, instructions, stages)?;
            let slopes = found.values.iter().map(|column| vec![0.0; column.len()]).collect();
            return Ok(Tracks {
                first: range.start,
                values: found.values,
                slopes,
                covariances: found.covariances,
                sensitivities: found.sensitivities,
                condition: found.condition,
                status: found.status,
            });
        }
        let stretches = stretches_of_rows(rows.len());
        let thinned =
            stretches.map(|stretches| (thinned_rows(rows, &stretches), thinned_column(decided.rhs(rows), &stretches)));
        let ordered = decided.ordered();
        let thinned = thinned.as_ref().map(|(rows, rhs)| (rows, ordered.problem(rows, rhs, self.noise[0], None)));
        let thinned_rhs = thinned.as_ref().map_or_else(Vec::new, |(_, problem)| without_constants(problem, constants));
        let noise = self.noise[0];
        let thinned = thinned
            .as_ref()
            .map(|(rows, problem)| ordered.without_constants(rows, problem, &thinned_rhs, constants, noise));
        let rhs = without_constants(problem, constants);
        let rest = ordered.without_constants(rows, problem, &rhs, constants, noise);
        let (judged, stages) = ((expected, fit.span, self.wanted_rows(weak, fit.span)), &mut self.stages);
        let averages = average(&rest, thinned.as_ref(), &decided.scales, judged, instructions, stages)?;
        let names = fit.full.fields;
        let condition = fit.full.field(names.condition());
        let usable = &decided.whole.as_ref().unwrap_or(rows).usable;
        let far = far_from_equations(usable, fit.span / 4);
        let status = (0..rows.len()).map(|row| {
            let mut status = if usable[row] { Status::GOOD } else { Status::GAP };
            if averages.values.iter().any(|column| column[row].is_nan()) {
                status |= Status::INVALID;
            }
            if far[row] || condition[fit.nearest(row)] > HARDLY_TOLD_APART {
                status |= Status::ILL_CONDITIONED;
            }
            status.bits()
        });
        let status = status.collect();
        let mut covariances = Vec::new();
        for unknown in 0..windowed {
            for other in 0..=unknown {
                let squared =
                    averages.errors[unknown].iter().map(|error| if other == unknown { error * error } else { 0.0 });
                let mut squared: Vec<f64> = squared.collect();
                if other == unknown {
                    add_unknown_changes(usable, &averages.values[unknown], &mut squared);
                }
                covariances.push(squared);
            }
        }
        Ok(Tracks {
            first: 0,
            covariances,
            slopes: averages
                .slopes
                .iter()
                .map(|column| column.iter().map(|slope| slope * rows.period).collect())
                .collect(),
            values: averages.values,
            sensitivities: sensitivities(problem, all, &mut self.stages)?,
            condition: (0..rows.len()).map(|row| condition[fit.nearest(row)]).collect(),
            status,
        })
    }
}

/// The derivatives of the windowed coefficients with respect to each constant, row by row, from the window nearest to each row.
fn sensitivities(problem: &Problem<'_>, all: &Fit, stages: &mut Stages<'_, '_>) -> Result<Vec<Vec<f64>>, Error> {
    let layout = problem.layout;
    let determined: Vec<usize> = (0..all.full.len()).filter(|&window| is_determined(&all.full, window)).collect();
    let beside = |wanted: usize| {
        let next = determined.partition_point(|&window| window < wanted);
        let around = [next.checked_sub(1), Some(next)].into_iter().flatten();
        let around = around.filter_map(|place| determined.get(place).copied());
        around.min_by_key(|place| place.abs_diff(wanted)).unwrap_or(wanted)
    };
    let mut columns = vec![vec![0.0; problem.rows()]; layout.windowed * layout.constant];
    stages.fill(&mut columns, |rows, columns| {
        for (index, row) in rows.enumerate() {
            let wanted = all.nearest(row);
            let place = if is_determined(&all.full, wanted) { wanted } else { beside(wanted) };
            let later = (row as f64 - all.centre(place)) * problem.period;
            for (number, column) in columns.iter_mut().enumerate() {
                let (unknown, constant) = (number / layout.constant, number % layout.constant);
                column[index] = sensitivity(&all.full, place, unknown, constant, later);
            }
        }
    })?;
    Ok(columns)
}
