//! Identification in strong form with kinds of its own for every parameter: some in every window, some constant over the record.
//!
//! The rows are those of the paper, one a sample, from derivatives of local polynomials. Standard errors hold that neighbouring rows are
//! correlated: those of constants by the covariance of the residuals, those of windows by how far windows scatter (see the module `scatter`).

use std::num::NonZeroUsize;
use std::ops::Range;

use crate::equation::motion::{Coefficient, Motion, Term, unknowns};
use crate::equation::rows::{Regressor, Rows};
use crate::error::Error;
use crate::exec::pool::Watch;
use crate::exec::stages::Stages;
use crate::identify::results::{RowResults, SampleResults};
use crate::identify::strong::scatter::{Track, scatter_of, slices};
use crate::identify::weak::session::{Constant, Kind};
use crate::lanes::output::Elements;
use crate::local_polynomials::estimates::Estimates;
use crate::local_polynomials::options::{Options, Order};
use crate::local_polynomials::plan::LocalPolynomials;
use crate::record::delayed::Delayed;
use crate::record::samples::{Samples, is_usable};
use crate::regression::centred_windows::every_window;
use crate::regression::constants::{Expected, sums_of_squares};
use crate::regression::fit::Fit;
use crate::regression::limits::HARDLY_TOLD_APART;
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

/// How to identify.
#[derive(Clone, Debug)]
pub struct StrongOptions {
    /// Rows of a window.
    pub equations: usize,
    /// Whether what is windowed may grow linearly within a window.
    pub linear: bool,
    /// How each unknown comes about: unknown coefficients in the order inertia, damping, stiffness, then terms.
    pub kinds: Vec<Kind>,
    /// Whether the torque is smoothed by polynomials of the orders chosen for the angle.
    pub filter_torque: bool,
    /// By how many samples the torque comes late.
    pub lag: f64,
    /// Every how many samples numbers are wanted.
    pub step: usize,
}

/// What was found in one record.
#[derive(Clone, Debug)]
pub struct StrongIdentified {
    /// What is constant.
    pub constants: Vec<Constant>,
    /// Condition number of the equations for the constants; infinite where they are not determined.
    pub condition: f64,
    /// Unknowns that change, in the order of the values at the samples.
    pub changing: Vec<usize>,
    /// Pairs of unknowns whose covariances are at the samples.
    pub pairs: Vec<(usize, usize)>,
    /// Numbers at the samples.
    pub results: SampleResults,
    /// Order of the polynomial around each of these samples.
    pub order: Vec<u8>,
}

/// Identifies one record in strong form.
///
/// `derivatives` must be a plan for the value and the first two derivatives.
///
/// # Errors
/// If the record is shorter than the window of the polynomials, or the watch cancels.
pub fn identify_strong(
    derivatives: &LocalPolynomials,
    motion: &Motion<'_>,
    mask: Option<&[bool]>,
    options: &StrongOptions,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<StrongIdentified, Error> {
    let samples = motion.angle.len();
    let mut stages = Stages::new(workers, samples, STAGES, watch);
    let differentiated = differentiate(derivatives, motion, options, &mut stages)?;
    let rows = rows(derivatives, motion, mask, options, &differentiated);
    let kinds = options.kinds.iter();
    let windowed = kinds.map(|kind| *kind == Kind::Windowed);
    let model = Model::new(&unknowns(&motion.coefficients, motion.terms.len()), windowed, options.linear);
    let instructions = derivatives.options().instructions;
    let mut problem = model.problem(&rows, &rows.rhs, 0.0, None);
    // All residuals are taken to be of one variance, which ordinary least squares reads off them.
    let any = Expected::UNKNOWN;
    let fit = if model.windowed.is_empty() {
        Fit::new(&problem, None, any, instructions, &mut stages)?
    } else {
        Fit::in_rows(&problem, options.equations, any, instructions)
    };
    let order = differentiated.order.iter().copied().step_by(options.step).collect();
    let changing = model.windowed.clone();
    let Some(fit) = fit else { return Ok(undetermined(&model, samples, options.step, order)) };
    let constants = fit.pooled.values.clone();
    let count = constants.len();

    let windows = 0..fit.full.len();
    let ones = vec![1.0; fit.full.len()];
    let columns: Vec<_> = (0..count).map(|constant| fit.influence(&problem, &windows, &ones, constant)).collect();
    let variance = variance(&problem, &fit);
    let reach = derivatives.options().window_length / 2;
    let sandwich = |rows: &RowCovariance| sandwich(&columns, &fit.pooled.inverse, rows);
    let ordinary = sandwich(&RowCovariance { lags: vec![variance] });
    let shown = row_covariance(&problem, &fit, reach, variance, &mut stages)?;
    let covariance = at_least(sandwich(&shown), &ordinary, count);
    problem.constants.truncate(count);
    let mut results = RowResults { stride: 1.0, ..RowResults::default() };
    let mut pairs = Vec::new();
    if model.windowed.is_empty() {
        results.condition = vec![fit.pooled.condition; samples];
        results.deviation = vec![variance.sqrt(); samples];
        results.status = vec![0; samples];
        for one in 0..count {
            for other in (0..one).filter(|&other| model.constant[one] < 3 && model.constant[other] < 3) {
                pairs.push((model.constant[one], model.constant[other]));
                results.covariances.push(vec![covariance[one * count + other]; samples]);
            }
        }
    } else {
        let range = 0..samples.cast_signed();
        let (ill, window) = (HARDLY_TOLD_APART, options.equations);
        let found = every_window(&problem, window, range, &constants, ill, instructions, &mut stages)?;
        let windowed = model.windowed.len();
        let own = |one, other, row: usize| found.covariances[crate::regression::layout::symmetric(one, other)][row];
        let errors: Vec<Vec<f64>> =
            (0..windowed).map(|one| (0..samples).map(|row| own(one, one, row).sqrt()).collect()).collect();
        let (values, errors) = (slices(&found.values), slices(&errors));
        let track = Track { values: &values, errors: &errors };
        let factors = scatter_of(derivatives, window, samples, track)
            .or_else(|| redundancies(&problem, reach))
            .unwrap_or_else(|| vec![1.0; windowed]);
        let between = |one: usize, other: usize, row: usize| {
            let own = |one: usize, other: usize| own(one, other, row) * factors[one] * factors[other];
            let sensitive = |unknown: usize, k: usize| found.sensitivities[unknown * count + k][row];
            joint_covariance([one, other], [windowed, count], own, sensitive, |i, j| covariance[i * count + j])
        };
        results.errors =
            (0..windowed).map(|one| (0..samples).map(|row| between(one, one, row).sqrt()).collect()).collect();
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
    }
    let ill = if fit.pooled.condition > HARDLY_TOLD_APART { Status::ILL_CONDITIONED } else { Status::GOOD };
    for (one, other) in results.status.iter_mut().zip(&differentiated.status) {
        *one |= other & !Status::INVALID.bits() | ill.bits();
    }
    stages.finish()?;
    Ok(StrongIdentified {
        constants: listed(&model, &constants, &covariance),
        condition: fit.pooled.condition,
        changing,
        pairs,
        results: results.at_samples(samples, options.step, &mut stages)?,
        order,
    })
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
fn undetermined(model: &Model, samples: usize, step: usize, order: Vec<u8>) -> StrongIdentified {
    let nan = |&unknown: &usize| Constant { unknown, value: f64::NAN, error: f64::NAN, test: None };
    StrongIdentified {
        constants: model.constant.iter().map(nan).collect(),
        condition: f64::INFINITY,
        changing: model.windowed.clone(),
        pairs: Vec::new(),
        results: SampleResults::undetermined(model.windowed.len(), samples.div_ceil(step)),
        order,
    }
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

/// By how much standard errors of what is windowed exceed those of ordinary least squares, where all is taken as constant.
fn redundancies(problem: &Problem<'_>, reach: usize) -> Option<Vec<f64>> {
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

/// The angle and its derivatives, the torque without its lag, and what the polynomials say.
struct Differentiated {
    derivatives: [Vec<f64>; 3],
    torque: Vec<f64>,
    order: Vec<u8>,
    status: Vec<u16>,
}

fn differentiate(
    plan: &LocalPolynomials,
    motion: &Motion<'_>,
    options: &StrongOptions,
    stages: &mut Stages<'_, '_>,
) -> Result<Differentiated, Error> {
    let samples = motion.angle.len();
    let mut found = Differentiated {
        derivatives: [(); 3].map(|()| vec![0.0; samples]),
        torque: vec![0.0; samples],
        order: vec![0; samples],
        status: vec![0; samples],
    };
    let workers = stages.workers;
    let elements = Elements { first: 0, step: 1 };
    stages.stage(|watch| {
        let estimates = Estimates {
            elements,
            derivatives: found.derivatives.iter_mut().map(Vec::as_mut_slice).collect(),
            order: &mut found.order,
            status: &mut found.status,
            sigma: &mut [],
        };
        plan.run(vec![(motion.angle, estimates)], true, workers, watch)
    })?;
    let torque = Delayed::new(motion.torque, options.lag);
    torque.read(0, &mut found.torque);
    if options.filter_torque {
        let recorded = found.torque.clone();
        let mut smoothed = vec![0.0; samples];
        let mut orders: Vec<u8> = found.order.clone();
        orders.sort_unstable();
        orders.dedup();
        for order in orders {
            let options = Options { order: Order::Fixed(order.into()), derivatives: vec![0], ..plan.options().clone() };
            let fixed = LocalPolynomials::new(options)?;
            stages.stage(|watch| {
                let estimates = Estimates {
                    elements,
                    derivatives: vec![&mut smoothed],
                    order: &mut [],
                    status: &mut [],
                    sigma: &mut [],
                };
                fixed.run(vec![(&recorded.as_slice() as &dyn Samples, estimates)], true, workers, watch)
            })?;
            let own = found.torque.iter_mut().zip(&smoothed).zip(&found.order);
            own.filter(|(_, one)| **one == order).for_each(|((torque, smooth), _)| *torque = *smooth);
        }
    }
    Ok(found)
}

/// One row a sample.
fn rows(
    plan: &LocalPolynomials,
    motion: &Motion<'_>,
    mask: Option<&[bool]>,
    options: &StrongOptions,
    differentiated: &Differentiated,
) -> Rows {
    let samples = motion.angle.len();
    let [angle, velocity, acceleration] = &differentiated.derivatives;
    let mut columns: Vec<Vec<f64>> = vec![acceleration.clone(), velocity.clone(), angle.clone()];
    for term in &motion.terms {
        columns.push(match term {
            Term::Offset => vec![1.0; samples],
            Term::Coulomb => velocity.iter().map(|&velocity| crate::record::derived::sign(velocity)).collect(),
            Term::Cubic => angle.iter().map(|angle| angle * angle * angle).collect(),
            Term::Record(record) => whole(*record),
        });
    }
    let mut rhs = differentiated.torque.clone();
    for (coefficient, column) in motion.coefficients.iter().zip(&columns) {
        match coefficient {
            Coefficient::Unknown => {}
            Coefficient::Number(number) => {
                rhs.iter_mut().zip(column).for_each(|(rhs, factor)| *rhs -= number * factor);
            }
            Coefficient::Record(record) => {
                let known = whole(*record).into_iter().zip(column);
                rhs.iter_mut().zip(known).for_each(|(rhs, (known, factor))| *rhs -= known * factor);
            }
        }
    }
    let before = plan.before_centre();
    let equations = before..(samples + before + 1).saturating_sub(plan.options().window_length).max(before);
    let usable: Vec<bool> = (0..samples)
        .map(|row| {
            equations.contains(&row)
                && mask.is_none_or(|mask| mask[row])
                && columns.iter().chain([&rhs]).all(|column| is_usable(column[row]))
        })
        .collect();
    for column in columns.iter_mut().chain([&mut rhs]) {
        column.iter_mut().zip(&usable).filter(|(_, usable)| !**usable).for_each(|(value, _)| *value = 0.0);
    }
    let companion = || if options.linear { vec![0.0; samples] } else { Vec::new() };
    let regressors =
        columns.into_iter().map(|value| Regressor { value, companion: companion(), noise: Default::default() });
    Rows {
        regressors: regressors.collect(),
        rhs,
        rhs_noise: Vec::new(),
        usable,
        jumps: Vec::new(),
        period: plan.options().delta,
    }
}

fn whole(record: &dyn Samples) -> Vec<f64> {
    let mut values = vec![0.0; record.len()];
    record.read(0, &mut values);
    values
}
