//! Constant parameters over whole records in strong form, piece by piece.

use std::num::NonZeroUsize;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use crate::equation::motion::{Motion, unknowns};
use crate::error::Error;
use crate::exec::huge_pages::zeros;
use crate::exec::pool;
use crate::exec::pool::{GoOn, Piece, Watch};
use crate::identify::identification::{Covariance, Identification, Unknown};
use crate::identify::options::StrongForm;
use crate::identify::strong::streaming::{
    Chunk, Identified, PIECE, StrongRecord, equations, finish, pairs, variance_inflations,
};
use crate::lanes::output::Elements;
use crate::least_squares::plan::Regressions;
use crate::least_squares::stacked_qr::{SharedParameters, Summary};
use crate::local_polynomials::plan::LocalPolynomials;
use crate::regression::limits::status_of;
use crate::regression::newey_west::enlarge;
use crate::status::Status;

/// No sample has an element there.
const NOWHERE: Elements = Elements { first: 0, step: 1 };

/// Identifies parameters that are the same over the whole record, one result per record, or `None` if they are not determined.
///
/// `derivatives` must be a plan for the value and the first two derivatives. Equations that hold a value that is no number are left
/// out. Of the outputs only orders and statuses are written. Standard errors hold the correlation of neighbouring rows, as residuals of
/// at most 16 384 rows show it.
///
/// # Errors
/// If a record is shorter than the window of the polynomials, or the watch cancels.
pub(crate) fn identify_constant(
    derivatives: &LocalPolynomials,
    records: Vec<(&StrongRecord<'_>, Identified<'_>)>,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<Vec<Option<SharedParameters>>, Error> {
    let all: Vec<&StrongRecord<'_>> = records.iter().map(|(record, _)| *record).collect();
    let every = |(record, identified): (&StrongRecord<'_>, _)| (0..record.motion.angle.len(), identified);
    let outputs = records.into_iter().map(every).collect();
    let totals = summaries(derivatives, &all, outputs, workers, watch)?;
    solved(derivatives, &all, &totals, workers, watch)
}

/// The summary of the rows of some samples of every record. Of the outputs, which belong to these samples, only orders and statuses are written.
///
/// # Errors
/// As [`identify_constant`].
pub(crate) fn summaries(
    derivatives: &LocalPolynomials,
    records: &[&StrongRecord<'_>],
    outputs: Vec<(Range<usize>, Identified<'_>)>,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<Vec<Summary>, Error> {
    let unknowns = records.first().map_or(0, |record| record.motion.unknowns());
    let mut pieces = Vec::new();
    let mut owners = Vec::new();
    for (index, (&record, (wanted, mut identified))) in records.iter().zip(outputs).enumerate() {
        derivatives.windows(record.motion.angle.len())?;
        for first in (wanted.start - wanted.start % PIECE..wanted.end).step_by(PIECE) {
            let samples = first.max(wanted.start)..wanted.end.min(first + PIECE);
            let part = identified.split_off_before(samples.end);
            pieces.push(Piece { size: samples.len(), content: (pieces.len(), record, samples, part) });
            owners.push(index);
        }
    }
    let summaries = Mutex::new(vec![None; pieces.len()]);
    let failed = Mutex::new(None);
    let work = |(place, record, samples, mut part): (usize, &StrongRecord<'_>, Range<usize>, Identified<'_>),
                chunk: &mut Chunk,
                go_on: &GoOn<'_>| {
        if let Err(error) = chunk.fill(derivatives, record, samples.clone(), go_on) {
            *failed.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
            return;
        }
        let rows = equations(derivatives, record.motion.angle.len());
        let summary = Summary::of(&chunk.columns, |row| chunk.is_equation(row, &rows));
        finish(chunk, samples, &mut part);
        summaries.lock().unwrap_or_else(PoisonError::into_inner)[place] = Some(summary);
    };
    pool::run_long(pieces, workers, || Chunk::new(derivatives, unknowns + 1), work, watch)?;
    if let Some(error) = failed.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(error);
    }
    let mut totals = vec![Summary::empty(unknowns + 1); records.len()];
    for (summary, owner) in summaries.into_inner().unwrap_or_else(PoisonError::into_inner).iter().zip(owners) {
        if let Some(summary) = summary {
            totals[owner].add(summary);
        }
    }
    Ok(totals)
}

/// The summary of the equations around some samples of a record of which [`around`](super::parts::around()) them is there. Summaries of parts add up
/// to that of the record.
///
/// # Errors
/// If the record is shorter than the window of the polynomials, or the watch cancels.
pub fn rows_of_part(
    form: &StrongForm<'_>,
    record: &StrongRecord<'_>,
    wanted: Range<usize>,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<Summary, Error> {
    let nowhere =
        Identified { regressions: Regressions { elements: NOWHERE, ..Regressions::default() }, order: &mut [] };
    let mut found = summaries(form.derivatives, &[record], vec![(wanted, nowhere)], workers, watch)?;
    Ok(found.pop().unwrap_or_else(|| Summary::empty(record.motion.unknowns() + 1)))
}

/// The constants that the rows of a record tell, with the correlation of neighbouring rows in their standard errors. Of the record only
/// [`parts_of_scatter`](super::parts::parts_of_scatter) need be there. `None` if they are not determined.
///
/// # Errors
/// If the record is shorter than the window of the polynomials, or the watch cancels.
pub fn constants_of_rows(
    form: &StrongForm<'_>,
    record: &StrongRecord<'_>,
    rows: &Summary,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<Option<SharedParameters>, Error> {
    let solved = solved(form.derivatives, &[record], std::slice::from_ref(rows), workers, watch)?;
    Ok(solved.into_iter().next().flatten())
}

/// The constants of every record, with the correlation of neighbouring rows in their standard errors.
fn solved(
    derivatives: &LocalPolynomials,
    records: &[&StrongRecord<'_>],
    totals: &[Summary],
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<Vec<Option<SharedParameters>>, Error> {
    let mut solved: Vec<_> = totals.iter().map(Summary::solve).collect();
    let pieces = solved.iter_mut().zip(records).map(|content| Piece { size: 1, content }).collect();
    let work = |(solved, record): (&mut Option<SharedParameters>, &&StrongRecord<'_>), chunk: &mut Chunk| {
        if let Some(solved) = solved {
            enlarge(&mut solved.covariance, &variance_inflations(derivatives, record, chunk)?);
        }
        Ok(())
    };
    let samples = records.iter().map(|record| record.motion.angle.len()).sum();
    let columns = records.first().map_or(0, |record| record.motion.unknowns()) + 1;
    let chunk = || Chunk::new(derivatives, columns);
    let done: Result<(), Error> =
        pool::map(pieces, workers, chunk, work, &mut |_, _| watch(samples, samples))?.into_iter().collect();
    done.map(|()| solved)
}

/// Identifies what is unknown as constant over each record.
///
/// # Errors
/// If a record is shorter than the window of the polynomials, or the watch cancels.
pub(crate) fn constants(
    form: &StrongForm<'_>,
    all: &[StrongRecord<'_>],
    step: usize,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<Vec<Identification>, Error> {
    let elements = Elements { first: 0, step };
    let wanted = |record: &StrongRecord<'_>| record.motion.angle.len().div_ceil(step);
    let mut outputs: Vec<(Vec<u8>, Vec<u16>)> =
        all.iter().map(|record| Ok((zeros(wanted(record))?, zeros(wanted(record))?))).collect::<Result<_, Error>>()?;
    let records = all.iter().zip(&mut outputs).map(|(record, (order, status))| {
        let regressions = Regressions { elements, status, ..Regressions::default() };
        (record, Identified { regressions, order })
    });
    let solved = identify_constant(form.derivatives, records.collect(), workers, watch)?;
    let found = all.iter().zip(solved).zip(outputs);
    let one = |((record, solved), (order, status)): ((&StrongRecord<'_>, _), _)| {
        identification(form, &record.motion, solved, order, status)
    };
    Ok(found.map(one).collect())
}

/// What was found of one record.
fn identification(
    form: &StrongForm<'_>,
    motion: &Motion<'_>,
    solved: Option<SharedParameters>,
    order: Vec<u8>,
    mut status: Vec<u16>,
) -> Identification {
    let numbers = unknowns(&motion.coefficients, motion.terms.len());
    let count = numbers.len();
    let nan = vec![f64::NAN; count * count];
    let solved = solved.unwrap_or_else(|| SharedParameters {
        values: nan[..count].to_vec(),
        covariance: nan,
        residual: f64::NAN,
        condition: f64::INFINITY,
    });
    let record_status = status_of(solved.condition);
    if record_status.contains(Status::RANK_DEFICIENT) {
        for status in &mut status {
            *status |= (Status::INVALID | Status::RANK_DEFICIENT).bits();
        }
    }
    let entry = |one: usize, other: usize| solved.covariance[one * count + other];
    let pairs = pairs(motion).into_iter();
    Identification {
        window_length: form.derivatives.options().window_length,
        exponent: None,
        regression_window: form.regression_window,
        unknowns: numbers
            .iter()
            .enumerate()
            .map(|(one, &number)| Unknown::constant(number, solved.values[one], entry(one, one).sqrt()))
            .collect(),
        covariances: pairs.map(|pair| Covariance { pair, values: vec![entry(pair.0, pair.1)] }).collect(),
        condition: vec![solved.condition],
        residual_std: vec![solved.residual],
        status: Status::of_column(status),
        record_status,
        order,
        jumps: Vec::new(),
        weak: None,
    }
}
