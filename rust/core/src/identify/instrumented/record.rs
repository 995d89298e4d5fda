//! One record with an instrument: rows of the recorded motion, rows of the motion that the instrument explains, two-stage least squares.

use std::num::NonZeroUsize;

use crate::equation::motion::{Motion, unknowns};
use crate::error::Error;
use crate::exec::pool::{Watch, part_of, parts};
use crate::identify::identification::{Covariance, Identification, Unknown};
use crate::identify::instrumented::constancy::tests;
use crate::identify::instrumented::explained::explained;
use crate::identify::instrumented::strong_windows::strong;
use crate::identify::instrumented::two_stage_rows::{Both, WEAK_INSTRUMENT, columns, solve};
use crate::identify::options::{Method, Options, Task, WeakForm};
use crate::identify::route::of_mean_weight;
use crate::identify::weak::form::with_record;
use crate::inference::constancy::NO_CHANCE;
use crate::record::samples::Samples;
use crate::regression::limits::status_of;
use crate::regression::two_stage::{TwoStage, beyond};
use crate::status::Status;
use crate::weak_form::test_function::TestFunction;
use crate::weak_form::weak_rows::WeakRows;

/// Half-widths of test functions that are tried: from the narrowest whose sums are integrals to 1e-6 of an acceleration a hundredth of the sample rate fast
/// (8 samples took 3e-5 of an inertia), each wider by a factor.
const NARROWEST: usize = 12;
const WIDER: f64 = 1.4;

/// Test functions that a record holds at least.
const FUNCTIONS: usize = 16;

/// The exponent where none is given.
const EXPONENT: usize = 8;

/// What an instrument is worth.
#[derive(Clone, Copy, Debug)]
pub struct InstrumentTest {
    /// Probability that noise which does not reach the regressors makes least squares differ as much from the instrument's estimates.
    pub exogeneity: f64,
    /// The smallest F statistic of the first stage.
    pub strength: f64,
}

/// Identifies constants of every record, with one instrument each.
///
/// # Errors
/// If a record is too short, or the watch cancels.
pub fn identify_with_instruments(
    tasks: &[(Task<'_>, &dyn Samples)],
    options: &Options,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<Vec<(Identification, InstrumentTest)>, Error> {
    let (parts, samples) = parts(tasks.iter().map(|(task, _)| task.motion.angle.len()));
    let each = tasks
        .iter()
        .zip(parts)
        .map(|((task, instrument), part)| one(task, *instrument, options, workers, &mut part_of(watch, part, samples)));
    each.collect()
}

fn one(
    task: &Task<'_>,
    instrument: &dyn Samples,
    options: &Options,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<(Identification, InstrumentTest), Error> {
    let motion = explained(task.motion.angle, instrument);
    let motion = motion.unwrap_or_else(|| vec![f64::NAN; task.motion.angle.len()]);
    let motion = motion.as_slice();
    let explained = Motion { angle: &motion, ..task.motion.clone() };
    let mut best: Option<(f64, Both, Option<TwoStage>)> = None;
    match &task.method {
        Method::Weak(form) => {
            for function in functions(form, task.motion.angle.len(), options.delta)? {
                let both = weak(task, &explained, function, options, (workers, &mut *watch))?;
                let found = solve(&both, &task.motion);
                // The product of all errors; what determines nothing comes last.
                let size = found.as_ref().map_or(f64::INFINITY, TwoStage::size);
                if best.as_ref().is_none_or(|(least, ..)| size < *least) {
                    best = Some((size, both, found));
                }
            }
        }
        Method::Strong(form) => {
            let (both, found) = strong(form, task, &explained, (workers, &mut *watch))?;
            best = Some((0.0, both, found));
        }
    }
    let (_, both, found) = best.ok_or(Error::NotDetermined)?;
    let (mut found, test) = identification(task, options, &both, found.as_ref());
    if matches!(task.method, Method::Strong(_)) {
        of_mean_weight(&mut found, task.weights);
    }
    Ok((found, test))
}

/// The test functions to try.
fn functions(form: &WeakForm, samples: usize, delta: f64) -> Result<Vec<TestFunction>, Error> {
    let exponent = form.exponent.unwrap_or(EXPONENT);
    let widest = samples / FUNCTIONS;
    let mut widths = Vec::new();
    let mut width = NARROWEST;
    while width <= widest {
        widths.push(width);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "less than the record")]
        let next = (WIDER * width as f64) as usize;
        width = next;
    }
    let widths = form.window_length.map_or(widths, |length| vec![length / 2]);
    if widths.is_empty() {
        return Err(Error::RecordTooShortForWindows { samples, least: FUNCTIONS * NARROWEST });
    }
    widths.into_iter().map(|width| TestFunction::new(width, exponent, delta)).collect()
}

fn weak(
    task: &Task<'_>,
    explained: &Motion<'_>,
    function: TestFunction,
    options: &Options,
    (workers, watch): (NonZeroUsize, &mut Watch<'_>),
) -> Result<Both, Error> {
    let lag = task.lag.unwrap_or(0.0);
    let mut built = Vec::new();
    for motion in [&task.motion, explained] {
        let how = (options.delta, options.instructions);
        let (rows, _) =
            with_record(motion, (task.mask, task.weights, lag), how, (workers, &mut *watch), |record, watch| {
                WeakRows::build(&record, function, options.delta, None, workers, watch)
            })?;
        built.push(rows);
    }
    let reach = built[0].reach();
    let mut rows = built.into_iter().map(|built| built.rows);
    let (recorded, explained) = (rows.next().unwrap_or_default(), rows.next().unwrap_or_default());
    Ok(Both {
        recorded,
        explained,
        reach: 2 * reach,
        window_length: function.window_length(),
        exponent: Some(function.exponent()),
    })
}

/// What was found of one record.
fn identification(
    task: &Task<'_>,
    options: &Options,
    both: &Both,
    found: Option<&TwoStage>,
) -> (Identification, InstrumentTest) {
    let motion = &task.motion;
    let numbers = unknowns(&motion.coefficients, motion.terms.len());
    let count = numbers.len();
    let test = found.map_or(InstrumentTest { exogeneity: f64::NAN, strength: 0.0 }, |found| InstrumentTest {
        exogeneity: beyond(found.contrast),
        strength: found.strength,
    });
    let elements = motion.angle.len().div_ceil(options.step);
    let mut record_status = found.map_or(Status::RANK_DEFICIENT, |found| status_of(found.condition));
    let is_strong = found.is_some() && test.strength >= WEAK_INSTRUMENT;
    if found.is_some() && !is_strong {
        record_status |= Status::ILL_CONDITIONED;
    }
    let tests = if is_strong { tests(&columns(both, motion), both.reach) } else { vec![None; count] };
    if tests.iter().flatten().any(|test| test.probability < NO_CHANCE) {
        record_status |= Status::KIND_CONTRADICTED;
    }
    let status = if found.is_none() { Status::INVALID | Status::RANK_DEFICIENT } else { Status::GOOD };
    let value = |one: usize| found.map_or(f64::NAN, |found| found.values[one]);
    let entry = |one: usize, other: usize| found.map_or(f64::NAN, |found| found.covariance[one * count + other]);
    let constants = numbers.iter().enumerate();
    let coefficients: Vec<usize> = (0..count).filter(|&one| numbers[one] < 3).collect();
    let pairs = coefficients.iter().flat_map(|&other| coefficients.iter().map(move |&one| (one, other)));
    let identification = Identification {
        window_length: both.window_length,
        exponent: both.exponent,
        regression_window: match &task.method {
            Method::Weak(_) => motion.angle.len(),
            Method::Strong(form) => form.regression_window,
        },
        unknowns: constants
            .zip(tests)
            .map(|((one, &number), test)| Unknown {
                test,
                ..Unknown::constant(number, value(one), entry(one, one).sqrt())
            })
            .collect(),
        covariances: pairs
            .filter(|(one, other)| one < other)
            .map(|pair| Covariance { pair, values: vec![entry(pair.0, pair.1)] })
            .collect(),
        condition: vec![found.map_or(f64::INFINITY, |found| found.condition)],
        residual_std: vec![found.map_or(f64::NAN, |found| found.residual)],
        status: vec![status; elements],
        record_status,
        order: Vec::new(),
        jumps: Vec::new(),
        weak: None,
    };
    (identification, test)
}
