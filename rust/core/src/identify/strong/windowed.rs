//! Windowed parameters around every sample in strong form, piece by piece: the paper's method.

use std::num::NonZeroUsize;

use crate::equation::motion::unknowns as unknowns_of;
use crate::error::Error;
use crate::exec::huge_pages::zeros;
use crate::exec::pool::Watch;
use crate::identify::identification::{Covariance, Identification, Unknown};
use crate::identify::options::{Options, StrongForm};
use crate::identify::strong::scatter::{Track, identify_with_scatter, scatter, slices};
use crate::identify::strong::streaming::{Identified, StrongRecord, identify_parts, pairs};
use crate::lanes::output::Elements;
use crate::least_squares::plan::Regressions;
use crate::status::Status;

/// Numbers of every wanted sample of one record, in columns.
struct Columns {
    values: Vec<Vec<f64>>,
    stderr: Vec<Vec<f64>>,
    covariances: Vec<Vec<f64>>,
    residual_std: Vec<f64>,
    condition: Vec<f64>,
    status: Vec<u16>,
    order: Vec<u8>,
}

impl Columns {
    fn new(unknowns: usize, pairs: usize, elements: usize) -> Result<Self, Error> {
        let columns = |count: usize| (0..count).map(|_| zeros(elements)).collect::<Result<_, _>>();
        Ok(Self {
            values: columns(unknowns)?,
            stderr: columns(unknowns)?,
            covariances: columns(pairs)?,
            residual_std: zeros(elements)?,
            condition: zeros(elements)?,
            status: zeros(elements)?,
            order: zeros(elements)?,
        })
    }

    fn outputs(&mut self, elements: Elements) -> Identified<'_> {
        fn all(columns: &mut [Vec<f64>]) -> Vec<&mut [f64]> {
            columns.iter_mut().map(Vec::as_mut_slice).collect()
        }
        let regressions = Regressions {
            elements,
            parameters: all(&mut self.values),
            errors: all(&mut self.stderr),
            covariances: all(&mut self.covariances),
            residuals: Vec::new(),
            deviations: vec![&mut self.residual_std],
            condition: &mut self.condition,
            status: &mut self.status,
            ..Regressions::default()
        };
        Identified { regressions, order: &mut self.order }
    }
}

/// Identifies what is unknown in a window of equations around every sample of every record. Of all records missing samples are left out, or of none.
///
/// # Errors
/// If a record is shorter than the window of the polynomials, or the watch cancels.
pub(crate) fn windows(
    form: &StrongForm<'_>,
    all: &[StrongRecord<'_>],
    options: &Options,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<Vec<Identification>, Error> {
    let Some(one) = all.first() else { return Ok(Vec::new()) };
    let (derivatives, rows, first) = (form.derivatives, form.regression_window, &one.motion);
    let (unknowns, pairs) = (first.unknowns(), pairs(first));
    let least_squares = one.windows(derivatives, rows, pairs.clone())?;
    let step = options.step;
    let wanted = |record: &StrongRecord<'_>| options.wanted.clone().unwrap_or(0..record.motion.angle.len());
    let elements =
        Elements { first: options.wanted.as_ref().map_or(0, |wanted| wanted.start.next_multiple_of(step)), step };
    let empty = |record: &StrongRecord<'_>| Columns::new(unknowns, pairs.len(), elements.of(wanted(record)).len());
    let mut columns: Vec<Columns> = all.iter().map(empty).collect::<Result<_, _>>()?;
    let outputs = columns.iter_mut().map(|columns| columns.outputs(elements));
    let records: Vec<_> = all.iter().zip(outputs).map(|(record, out)| (record, (wanted(record), out))).collect();
    let factors = if options.wanted.is_some() {
        identify_parts(derivatives, &least_squares, records, workers, watch)?;
        vec![vec![1.0; unknowns]; all.len()]
    } else if step == 1 {
        identify_parts(derivatives, &least_squares, records, workers, watch)?;
        let found: Vec<_> = columns.iter().map(|columns| (slices(&columns.values), slices(&columns.stderr))).collect();
        let tracks = found.iter().map(|(values, errors)| Track { values, errors });
        scatter(derivatives, &least_squares, &all.iter().zip(tracks).collect::<Vec<_>>())?
    } else {
        let records = records.into_iter().map(|(record, (wanted, out))| (record, wanted, out)).collect();
        identify_with_scatter(derivatives, &least_squares, records, workers, watch)?
    };
    let numbers = unknowns_of(&first.coefficients, first.terms.len());
    let found = columns.into_iter().zip(factors).map(|(columns, factors)| {
        let unknowns = columns.values.into_iter().zip(columns.stderr).zip(factors).zip(&numbers);
        Identification {
            window_length: derivatives.options().window_length,
            exponent: None,
            regression_window: rows,
            unknowns: unknowns
                .map(|(((values, stderr), factor), &number)| Unknown::windowed(number, values, stderr, factor))
                .collect(),
            covariances: pairs
                .iter()
                .zip(columns.covariances)
                .map(|(&pair, values)| Covariance { pair, values })
                .collect(),
            condition: columns.condition,
            residual_std: columns.residual_std,
            status: Status::of_column(columns.status),
            record_status: Status::GOOD,
            order: columns.order,
            jumps: Vec::new(),
            weak: None,
        }
    });
    Ok(found.collect())
}
