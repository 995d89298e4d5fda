//! The results of each form, converted to one common type.

use std::num::NonZeroUsize;

use crate::equation::motion::{Coefficient, Motion, Term, unknowns};
use crate::equation::terms::{BUILT_IN_TERMS, TermFunction};
use crate::error::Error;
use crate::exec::pool::Watch;
use crate::identify::identification::{Covariance, Identification, Unknown, WeakDetails};
use crate::identify::kinds::{Kind, in_strong_form, in_weak_form};
use crate::identify::options::{Options, StrongForm, Task, WeakForm};
use crate::identify::results::{Constant, SampleResults};
use crate::identify::scanned::Scan;
use crate::identify::strong::general::{StrongOptions, identify_strong};
use crate::identify::weak::form::identify_weak;
use crate::identify::weak::options::WeakOptions;
use crate::identify::weak::outside_mask::Outside;
use crate::inference::missing_terms::Missing;
use crate::status::Status;

/// What was found of the unknowns of one record, by the numbers of their regressors.
struct Found {
    constants: Vec<Constant>,
    changing: Vec<usize>,
    /// By unknown that changes: the part of its variance that all samples have in common; empty where that is not known.
    in_common: Vec<f64>,
    /// Pairs of constants and their covariance.
    constant_pairs: Vec<(usize, usize, f64)>,
    /// Pairs of unknowns whose covariances are at the samples.
    pairs: Vec<(usize, usize)>,
    results: SampleResults,
}

impl Found {
    /// The unknowns in their order. What was asked of a kind keeps its name; the record names the others.
    fn unknowns(&mut self, asked: &[Kind], regressors: &[usize]) -> Vec<Unknown> {
        let unknown = |(&asked, &number): (&Kind, &usize)| {
            if let Some(found) = self.constants.iter().find(|constant| constant.unknown == number) {
                let unknown = Unknown::constant(number, found.value, found.error);
                return Unknown { test: found.test.clone(), ..unknown };
            }
            let place = self.changing.iter().position(|&one| one == number);
            let take = |columns: &mut Vec<Vec<f64>>| {
                place.and_then(|place| columns.get_mut(place)).map(std::mem::take).unwrap_or_default()
            };
            let kind = match asked {
                Kind::Automatic if number < 2 => Kind::Varying,
                Kind::Automatic => Kind::Windowed,
                kind => kind,
            };
            let (values, stderr) = (take(&mut self.results.values), take(&mut self.results.errors));
            let in_common = place.and_then(|place| self.in_common.get(place)).copied().unwrap_or(1.0);
            Unknown { kind, in_common, ..Unknown::windowed(number, values, stderr, 1.0) }
        };
        asked.iter().zip(regressors).map(unknown).collect()
    }

    /// Covariances of all pairs of coefficients: zero where nothing tells them.
    fn covariances(&mut self, regressors: &[usize]) -> Vec<Covariance> {
        let coefficients: Vec<usize> = regressors.iter().copied().filter(|&number| number < 3).collect();
        let mut found = Vec::new();
        for one in 0..coefficients.len() {
            for other in one + 1..coefficients.len() {
                let is_it = |a: usize, b: usize| [(a, b), (b, a)].contains(&(coefficients[one], coefficients[other]));
                let changing = self.pairs.iter().position(|&(a, b)| is_it(a, b));
                let constant = self.constant_pairs.iter().find(|&&(a, b, _)| is_it(a, b));
                let values = match changing {
                    Some(place) => std::mem::take(&mut self.results.covariances[place]),
                    None => vec![constant.map_or(0.0, |(_, _, covariance)| *covariance)],
                };
                found.push(Covariance { pair: (one, other), values });
            }
        }
        found
    }
}

/// Identifies one record in weak form.
pub(crate) fn weak(
    task: &Task<'_>,
    form: &WeakForm,
    options: &Options,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<Identification, Error> {
    let regressors = regressors(&task.motion);
    let weak_options = WeakOptions {
        delta: options.delta,
        half_width: form.window_length.map(|length| length / 2),
        exponent: form.exponent,
        regression_window: form.regression_window,
        averaging: form.averaging,
        linear: form.linear,
        kinds: in_weak_form(&asked(&options.kinds, &form.repeated.tested), &regressors, form.averaging),
        decided: decided(&form.repeated.tested, &options.kinds, &regressors),
        noise: form.noise,
        shown_noise: form.shown_noise,
        lag: task.lag,
        found_lag: form.repeated.found_lag,
        near: form.repeated.near,
        width_from: form.repeated.width_from,
        angle_zero: task.angle_zero,
        quantisation: options.quantisation,
        step: options.step,
        wanted: options.wanted.clone(),
        diagnose: options.diagnose,
        not_missing: not_missing(task),
        instructions: options.instructions,
    };
    let found = identify_weak(&task.motion, (task.mask, task.weights), &weak_options, workers, watch)?;
    let place = |number: usize| regressors.iter().position(|&one| one == number).unwrap_or(number);
    let outside_mask = found.outside_mask.map(|outside| placed(outside, &place));
    let details = WeakDetails {
        noise: found.noise,
        shown_noise: found.shown_noise,
        lengths: found.lengths,
        prediction_error: found.prediction_error,
        weighted: found.weighted,
        pooling: found.pooling,
        condition: found.condition,
        weakest: found.weakest,
        mostly_noise: found.mostly_noise,
        unexplained: found.unexplained,
        lag: found.lag,
        untold_lag: found.untold_lag,
        width_from: found.width_from,
        near: found.near,
        changing: found.changing.iter().map(|&one| place(one)).collect(),
        angle_zero: found.angle_zero,
        free_offset: found.free_offset,
        suspects: found.suspects,
        with_lag: found.with_lag.iter().map(|&(one, by)| (place(one), by)).collect(),
        defects: found.defects,
        resting: found.resting,
        pulses: found.pulses,
        spikes: found.spikes,
        lost: found.lost,
        limits: found.limits,
        unread: found.unread,
        scan: Scan { unknowns: found.scan.unknowns.iter().map(|&one| place(one)).collect(), ..found.scan },
        outside_mask,
    };
    let mut unknowns = Found {
        constants: found.constants,
        changing: found.changing,
        in_common: found.in_common,
        constant_pairs: found.constant_pairs,
        pairs: found.pairs,
        results: found.results,
    };
    Ok(Identification {
        window_length: found.function.window_length(),
        exponent: Some(found.function.exponent()),
        regression_window: found.regression_window,
        unknowns: unknowns.unknowns(&options.kinds, &regressors),
        covariances: unknowns.covariances(&regressors),
        condition: unknowns.results.condition,
        residual_std: unknowns.results.deviation,
        status: Status::of_column(unknowns.results.status),
        record_status: found.record_status,
        order: Vec::new(),
        jumps: found.jumps,
        weak: Some(details),
    })
}

/// The same with places among the unknowns.
fn placed(outside: Outside, place: &dyn Fn(usize) -> usize) -> Outside {
    let differing = outside.differing.iter().map(|&(number, value, error)| (place(number), value, error)).collect();
    Outside { differing, ..outside }
}

/// Identifies one record in strong form, whatever its kinds, mask and missing samples.
pub(crate) fn strong(
    task: &Task<'_>,
    form: &StrongForm<'_>,
    options: &Options,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<Identification, Error> {
    let regressors = regressors(&task.motion);
    let strong_options = StrongOptions {
        regression_window: form.regression_window,
        linear: form.linear,
        kinds: in_strong_form(&options.kinds, &regressors),
        filter_torque: form.filter_torque,
        lag: task.lag.unwrap_or(0.0),
        step: options.step,
    };
    let found =
        identify_strong(form.derivatives, &task.motion, (task.mask, task.weights), &strong_options, workers, watch)?;
    let mut unknowns = Found {
        constants: found.constants,
        changing: found.changing,
        in_common: Vec::new(),
        constant_pairs: Vec::new(),
        pairs: found.pairs,
        results: found.results,
    };
    Ok(Identification {
        window_length: form.derivatives.options().window_length,
        exponent: None,
        regression_window: form.regression_window,
        unknowns: unknowns.unknowns(&strong_options.kinds, &regressors),
        covariances: unknowns.covariances(&regressors),
        condition: unknowns.results.condition,
        residual_std: unknowns.results.deviation,
        status: Status::of_column(unknowns.results.status),
        record_status: found.record_status,
        order: found.order,
        jumps: Vec::new(),
        weak: None,
    })
}

/// The kinds as they were asked for, where an earlier identification decided upon some.
fn asked(given: &[Kind], tested: &[usize]) -> Vec<Kind> {
    let each = given.iter().enumerate();
    each.map(|(place, &kind)| if tested.contains(&place) { Kind::Automatic } else { kind }).collect()
}

/// What an earlier identification decided of unknowns that were automatic: which of them change.
fn decided(tested: &[usize], given: &[Kind], regressors: &[usize]) -> Vec<(usize, bool)> {
    let each = tested.iter().filter(|&&place| given.get(place).is_some_and(|kind| *kind != Kind::Automatic));
    each.map(|&place| (regressors[place], given[place] != Kind::Constant)).collect()
}

/// The numbers of the regressors whose factors are unknown.
pub(crate) fn regressors(motion: &Motion<'_>) -> Vec<usize> {
    unknowns(&motion.coefficients, motion.terms.len())
}

/// What cannot be missing because it is there, or is not a question that anybody asked: what a spring does beside one that is known. A lag that is found leaves
/// none; one that is given may be another.
fn not_missing(task: &Task<'_>) -> Vec<Missing> {
    let built_in = task.motion.terms.iter().filter_map(|term| match term {
        Term::BuiltIn(term) => Some(Missing::Term(term)),
        Term::Record(_) => None,
    });
    let is_known = !matches!(task.motion.coefficients[2], Coefficient::Unknown);
    let of_spring = BUILT_IN_TERMS.iter().filter(|term| is_known && matches!(term.function, TermFunction::OfAngle(_)));
    let lag = task.lag.is_none().then_some(Missing::Lag);
    built_in.chain(of_spring.map(Missing::Term)).chain(lag).collect()
}
