//! The weak form of one record, from its channels to its result.

use std::num::NonZeroUsize;

use crate::equation::motion::{Motion, Term};
use crate::equation::terms::TermFunction;
use crate::error::Error;
use crate::exec::pool::{Piece, Watch};
use crate::exec::stages::Stages;
use crate::identify::weak::found::WeakIdentified;
use crate::identify::weak::options::WeakOptions;
use crate::identify::weak::session::Session;
use crate::lanes::output::Elements;
use crate::local_polynomials::criterion::Criterion;
use crate::local_polynomials::estimates::Estimates;
use crate::local_polynomials::options::{Order, PolynomialOptions, Selection};
use crate::local_polynomials::plan::LocalPolynomials;
use crate::noise::channel::channel_variance;
use crate::noise::spectrum::power;
use crate::record::samples::Samples;
use crate::simd::instructions::Instructions;
use crate::weak_form::test_function_choice::{Evidence, spectrum_length};
use crate::weak_form::weak_rows::{Record, TermSamples};

/// Stages of a call, about: only for showing progress.
const STAGES: usize = 50;

/// Identifies one record in weak form.
///
/// # Errors
/// If the record is too short, its rows do not determine what is constant, or the watch cancels.
pub(crate) fn identify_weak(
    motion: &Motion<'_>,
    mask: Option<&[bool]>,
    options: &WeakOptions,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<WeakIdentified, Error> {
    let lag = options.lag.unwrap_or(0.0);
    with_record(motion, (mask, lag), (options.delta, options.instructions), (workers, watch), |record, watch| {
        identify(record, options, workers, watch)
    })
}

/// Does something with the record that a motion is, its terms evaluated at every sample.
///
/// # Errors
/// If the work fails, or the watch cancels.
pub(crate) fn with_record<R>(
    motion: &Motion<'_>,
    (mask, lag): (Option<&[bool]>, f64),
    (delta, instructions): (f64, Instructions),
    (workers, watch): (NonZeroUsize, &mut Watch<'_>),
    work: impl FnOnce(Record<'_>, &mut Watch<'_>) -> Result<R, Error>,
) -> Result<R, Error> {
    let of_velocity =
        |term: &Term<'_>| matches!(term, Term::BuiltIn(term) if matches!(term.function, TermFunction::OfVelocity(_)));
    let velocity = if motion.terms.iter().any(of_velocity) {
        velocity(motion.angle, (delta, instructions), workers, watch)?
    } else {
        Vec::new()
    };
    let velocity = velocity.as_slice();
    let mapped = |term: &Term<'_>| match term {
        Term::BuiltIn(term) => term.function.samples(motion.angle, &velocity),
        Term::Record(_) => None,
    };
    let mapped: Vec<_> = motion.terms.iter().map(mapped).collect();
    let terms = motion.terms.iter().zip(&mapped).map(|(term, mapped)| match (*term, mapped) {
        (Term::Record(record), _) => TermSamples::Given(record),
        (Term::BuiltIn(_), Some(mapped)) => TermSamples::Given(mapped),
        (Term::BuiltIn(_), None) => TermSamples::One,
    });
    let record = Record {
        angle: motion.angle,
        torque: motion.torque,
        coefficients: motion.coefficients,
        terms: terms.collect(),
        lag,
        mask,
    };
    work(record, watch)
}

/// The velocity at every sample, from local polynomials an eighth of a typical cycle to either side.
fn velocity(
    angle: &dyn Samples,
    (delta, instructions): (f64, Instructions),
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<Vec<f64>, Error> {
    let samples = angle.len();
    let evidence = Evidence {
        power: power(angle, spectrum_length(samples, 200)),
        samples,
        noise: [channel_variance(angle, None, instructions), 0.0],
        delta,
        unknown: [true; 3],
    };
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to a few samples")]
    let half = (evidence.period() / 8.0).clamp(8.0, 100.0) as usize;
    let plan = LocalPolynomials::new(PolynomialOptions {
        window_length: (2 * half + 1).min((samples.max(1) - 1) / 2 * 2 + 1),
        order: Order::Chosen { criterion: Criterion::Aicc, highest: 15 },
        derivatives: vec![1],
        delta,
        noise: false,
        selection: Selection::Window,
        quantisation: 0.0,
        instructions,
    })?;
    let mut velocity = vec![0.0; samples];
    let estimates = Estimates {
        elements: Elements { first: 0, step: 1 },
        derivatives: vec![&mut velocity],
        order: &mut [],
        status: &mut [],
        sigma: &mut [],
    };
    plan.run(vec![(angle, estimates)], true, workers, watch)?;
    Ok(velocity)
}

/// Identifies one record.
fn identify(
    record: Record<'_>,
    options: &WeakOptions,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<WeakIdentified, Error> {
    let samples = record.angle.len();
    let mut stages = Stages::new(workers, samples, STAGES, watch);
    let channels = [(record.angle, options.noise[0], options.quantisation), (record.torque, options.noise[1], None)];
    let pieces = channels.map(|channel| Piece { size: samples, content: channel });
    let level = |(channel, given, step): (_, Option<f64>, _), (): &mut ()| {
        given.unwrap_or_else(|| channel_variance(channel, step, options.instructions))
    };
    let levels = stages.map(pieces.into(), || (), level)?;
    let mut session = Session { record, options, noise: [levels[0], levels[1]], stages };
    let model = session.model();
    let (chosen, decided, lag) = session.choose_and_decide(&model)?;
    let (mut found, at_rows) = session.report(chosen, &decided)?;
    // Rows and windows take as much memory as the results.
    drop(decided);
    if let Some(at_rows) = at_rows {
        found.results = at_rows.at_samples(samples, options.step, &mut session.stages)?;
    }
    session.stages.finish()?;
    found.lag = lag;
    Ok(found)
}
