//! Identification in strong form with a kind of its own for every parameter: some windowed, some constant over the record.
//!
//! The rows are those of the paper, one a sample, from derivatives of local polynomials. Standard errors account for the correlation of neighbouring rows:
//! those of constants by the covariance of the residuals, those of windows by the scatter of windows (see `scatter`).

use std::num::NonZeroUsize;
use std::ops::Range;

use crate::equation::motion::{Motion, unknowns};
use crate::error::Error;
use crate::exec::memory;
use crate::exec::pool::Watch;
use crate::exec::stages::Stages;
use crate::identify::kinds::Kind;
use crate::identify::results::{Constant, RowResults, SampleResults};
use crate::identify::strong::rows::{differentiate, rows};
use crate::identify::strong::scatter::{Track, scatter_of, slices};
use crate::local_polynomials::plan::LocalPolynomials;
use crate::regression::centred_windows::every_window;
use crate::regression::constants::{Expected, sums_of_squares};
use crate::regression::fit::Fit;
use crate::regression::layout::symmetric;
use crate::regression::limits::{HARDLY_TOLD_APART, status_of};
use crate::regression::model::Model;
use crate::regression::newey_west::{Stretched, at_least};
use crate::regression::predictor::without_constants;
use crate::regression::problem::Problem;
use crate::regression::residuals::residuals;
use crate::regression::row_covariance::RowCovariance;
use crate::regression::sandwich::{joint_covariance, sandwich};
use crate::regression::subsample::stretches_of_rows;
use crate::status::Status;

/// Stages of a call, about: only for showing progress.
const STAGES: usize = 6;

/// Numbers that are kept of a sample at most: in any case, and for every unknown.
const NUMBERS: usize = 30;
const NUMBERS_OF_AN_UNKNOWN: usize = 10;

/// How to identify.
#[derive(Clone, Debug)]
pub(crate) struct StrongOptions {
    /// Rows of a window.
    pub(crate) regression_window: usize,
    /// Whether windowed coefficients may grow linearly within a window.
    pub(crate) linear: bool,
    /// How each unknown comes about: unknown coefficients in the order inertia, damping, stiffness, then terms.
    pub(crate) kinds: Vec<Kind>,
    /// Whether the torque is smoothed by polynomials of the orders chosen for the angle.
    pub(crate) filter_torque: bool,
    /// By how many samples the torque comes late.
    pub(crate) lag: f64,
    /// Every how many samples numbers are wanted.
    pub(crate) step: usize,
}

/// What was found in one record.
#[derive(Clone, Debug)]
pub(crate) struct StrongIdentified {
    /// What is constant.
    pub(crate) constants: Vec<Constant>,
    /// Unknowns that change, in the order of the values at the samples.
    pub(crate) changing: Vec<usize>,
    /// Pairs of unknowns whose covariances are at the samples.
    pub(crate) pairs: Vec<(usize, usize)>,
    /// What holds for the whole record.
    pub(crate) record_status: Status,
    /// Numbers at the samples.
    pub(crate) results: SampleResults,
    /// Order of the polynomial around each of these samples.
    pub(crate) order: Vec<u8>,
}

/// Identifies one record in strong form.
///
/// `derivatives` must be a plan for the value and the first two derivatives.
///
/// # Errors
/// If the record is shorter than the window of the polynomials, or the watch cancels.
pub(crate) fn identify_strong(
    derivatives: &LocalPolynomials,
    motion: &Motion<'_>,
    (mask, weights): (Option<&[bool]>, Option<&[f64]>),
    options: &StrongOptions,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<StrongIdentified, Error> {
    let samples = motion.angle.len();
    // Measured: 40 to 52 numbers a sample with three unknowns.
    memory::ask_for_numbers(samples.saturating_mul(NUMBERS + NUMBERS_OF_AN_UNKNOWN * motion.unknowns()))?;
    let mut stages = Stages::new(workers, samples, STAGES, watch);
    let differentiated = differentiate(derivatives, motion, (options.lag, options.filter_torque), &mut stages)?;
    let rows = rows(derivatives, motion, (mask, weights), options.linear, &differentiated);
    let windowed = options.kinds.iter().map(|kind| *kind == Kind::Windowed);
    let model = Model::new(&unknowns(&motion.coefficients, motion.terms.len()), windowed, options.linear);
    let instructions = derivatives.options().instructions;
    let mut problem = model.problem(&rows, &rows.rhs, 0.0, None);
    // All residuals are taken to be of one variance, which ordinary least squares reads off them.
    let any = Expected::UNKNOWN;
    let fit = if model.windowed.is_empty() {
        Fit::new(&problem, None, any, instructions, &mut stages)?
    } else {
        Fit::in_rows(&problem, options.regression_window, any, instructions)
    };
    let order = differentiated.order.iter().copied().step_by(options.step).collect();
    let Some(fit) = fit else { return undetermined(&model, samples.div_ceil(options.step), order, &mut stages) };
    let constants = fit.pooled.values.clone();
    let count = constants.len();

    let windows = 0..fit.full.len();
    let ones = vec![1.0; fit.full.len()];
    let columns: Vec<_> = (0..count).map(|constant| fit.influence(&problem, &windows, &ones, constant)).collect();
    let variance = variance(&problem, &fit);
    let reach = derivatives.options().window_length / 2;
    let sandwich = |rows: &RowCovariance| sandwich(&columns, &fit.pooled.inverse, rows);
    let ordinary = sandwich(&RowCovariance::by_distance(vec![variance]));
    let shown = row_covariance(&problem, &fit, reach, variance, &mut stages)?;
    let covariance = at_least(sandwich(&shown), &ordinary, count);
    problem.constants.truncate(count);
    let (mut results, pairs) = if model.windowed.is_empty() {
        constants_at_rows(&model, &fit, variance, &covariance, samples)
    } else {
        let windows = Windows { derivatives, model: &model, problem: &problem, fit: &fit, covariance: &covariance };
        windows.at_rows(options.regression_window, samples, &mut stages)?
    };
    for (one, other) in results.status.iter_mut().zip(&differentiated.status) {
        *one |= other & !Status::INVALID.bits();
    }
    stages.finish()?;
    Ok(StrongIdentified {
        constants: listed(&model, &constants, &covariance),
        changing: model.windowed.clone(),
        pairs,
        record_status: status_of(fit.pooled.condition),
        results: results.at_samples(samples, options.step, &mut stages)?,
        order,
    })
}

/// Numbers at every sample, and the pairs of unknowns whose covariances are among them.
type AtRows = (RowResults, Vec<(usize, usize)>);

/// The same numbers everywhere.
fn constants_at_rows(model: &Model, fit: &Fit, variance: f64, covariance: &[f64], samples: usize) -> AtRows {
    let mut results = RowResults {
        stride: 1.0,
        condition: vec![fit.pooled.condition; samples],
        deviation: vec![variance.sqrt(); samples],
        status: vec![0; samples],
        ..RowResults::default()
    };
    let mut pairs = Vec::new();
    let count = model.constant.len();
    for one in 0..count {
        for other in (0..one).filter(|&other| model.constant[one] < 3 && model.constant[other] < 3) {
            pairs.push((model.constant[one], model.constant[other]));
            results.covariances.push(vec![covariance[one * count + other]; samples]);
        }
    }
    (results, pairs)
}

/// What windows beside constants are solved with.
struct Windows<'a> {
    derivatives: &'a LocalPolynomials,
    model: &'a Model,
    problem: &'a Problem<'a>,
    fit: &'a Fit,
    /// Covariance of the constants.
    covariance: &'a [f64],
}

impl Windows<'_> {
    /// What is windowed at every row, with errors from how far windows scatter.
    fn at_rows(&self, window: usize, samples: usize, stages: &mut Stages<'_, '_>) -> Result<AtRows, Error> {
        let Self { derivatives, model, problem, fit, covariance } = *self;
        let (constants, count) = (&fit.pooled.values, fit.pooled.values.len());
        let (range, ill) = (0..samples.cast_signed(), HARDLY_TOLD_APART);
        let instructions = derivatives.options().instructions;
        let found = every_window(problem, window, range, constants, ill, instructions, stages)?;
        let windowed = model.windowed.len();
        let own = |one, other, row: usize| found.covariances[symmetric(one, other)][row];
        let errors: Vec<Vec<f64>> =
            (0..windowed).map(|one| (0..samples).map(|row| own(one, one, row).sqrt()).collect()).collect();
        let (values, errors) = (slices(&found.values), slices(&errors));
        let track = Track { values: &values, errors: &errors };
        let factors = scatter_of(derivatives, window, samples, track)
            .or_else(|| variance_inflations(problem, derivatives.options().window_length / 2))
            .unwrap_or_else(|| vec![1.0; windowed]);
        let between = |one: usize, other: usize, row: usize| {
            let own = |one: usize, other: usize| own(one, other, row) * factors[one] * factors[other];
            let sensitive = |unknown: usize, k: usize| found.sensitivities[unknown * count + k][row];
            joint_covariance([one, other], [windowed, count], own, sensitive, |i, j| covariance[i * count + j])
        };
        let mut results = RowResults { stride: 1.0, ..RowResults::default() };
        results.errors =
            (0..windowed).map(|one| (0..samples).map(|row| between(one, one, row).sqrt()).collect()).collect();
        let mut pairs = Vec::new();
        let names: Vec<usize> = model.windowed.iter().chain(&model.constant).copied().collect();
        for one in 0..names.len() {
            for other in (0..one).filter(|&other| names[one] < 3 && names[other] < 3) {
                pairs.push((names[one], names[other]));
                results.covariances.push((0..samples).map(|row| between(one, other, row)).collect());
            }
        }
        results.slopes = found.values.iter().map(|column| vec![0.0; column.len()]).collect();
        results.values = found.values;
        results.condition = found.condition;
        results.deviation = found.deviation;
        results.status = found.status;
        Ok((results, pairs))
    }
}

/// What is constant, with its standard errors.
fn listed(model: &Model, values: &[f64], covariance: &[f64]) -> Vec<Constant> {
    let numbered = model.constant.iter().zip(values).enumerate();
    let one = |(place, (&unknown, &value)): (usize, (&usize, &f64))| Constant {
        unknown,
        value,
        error: covariance[place * (values.len() + 1)].sqrt(),
        test: None,
    };
    numbered.map(one).collect()
}

/// Nothing but a status.
fn undetermined(
    model: &Model,
    elements: usize,
    order: Vec<u8>,
    stages: &mut Stages<'_, '_>,
) -> Result<StrongIdentified, Error> {
    let nan = |&unknown: &usize| Constant { unknown, value: f64::NAN, error: f64::NAN, test: None };
    Ok(StrongIdentified {
        constants: model.constant.iter().map(nan).collect(),
        changing: model.windowed.clone(),
        pairs: Vec::new(),
        record_status: Status::RANK_DEFICIENT,
        results: SampleResults::undetermined(model.windowed.len(), elements, stages)?,
        order,
    })
}

/// The covariance of rows that residuals show, for residuals of some variance; of a long record, those of stretches.
fn row_covariance(
    problem: &Problem<'_>,
    fit: &Fit,
    reach: usize,
    variance: f64,
    stages: &mut Stages<'_, '_>,
) -> Result<RowCovariance, Error> {
    let (left, usable) = residuals(problem, fit, stages)?;
    let stretches = stretches_of_rows(left.len());
    let stretches = stretches.filter(|stretches| stretches.iter().all(|part| part.len() > 4 * reach));
    let mut stretched = Stretched::new(1, reach);
    for Range { start, end } in stretches.unwrap_or_else(|| std::iter::once(0..left.len()).collect()) {
        stretched.push(&[left[start..end].to_vec()], |row| usable[start + row]);
    }
    let mut covariance = stretched.covariance();
    let shown = covariance.variance();
    if shown > 0.0 {
        covariance.lags.iter_mut().for_each(|lag| *lag *= variance / shown);
    }
    Ok(covariance)
}

/// The factor by which standard errors of windowed coefficients exceed those of ordinary least squares, if all are assumed constant.
fn variance_inflations(problem: &Problem<'_>, reach: usize) -> Option<Vec<f64>> {
    let columns = problem.windowed.iter().chain(&problem.constants).chain([&problem.rhs]);
    let columns: Vec<Vec<f64>> = columns.map(|column| column.to_vec()).collect();
    let mut stretched = Stretched::new(columns.len(), reach);
    stretched.push(&columns, |row| problem.usable[row]);
    stretched.factors()
}

/// Variance of what a fit leaves, its unknowns counted once.
fn variance(problem: &Problem<'_>, fit: &Fit) -> f64 {
    let usable = problem.usable.iter().filter(|usable| **usable).count() as f64;
    if problem.layout.windowed == 0 {
        let left = without_constants(problem, &fit.pooled.values);
        return left.iter().map(|value| value * value).sum::<f64>()
            / (usable - problem.layout.constant as f64).max(1.0);
    }
    let fields = fit.full.fields;
    let sum: f64 = sums_of_squares(&fit.full, &(0..fit.full.len()), &fit.pooled.values).iter().sum();
    let counts = fit.full.field(fields.count()).iter();
    let freedom: f64 = counts.map(|count| (count - problem.layout.local() as f64).max(0.0)).sum();
    sum / freedom.max(1.0)
}
