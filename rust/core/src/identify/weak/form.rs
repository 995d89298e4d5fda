//! The weak form of one record, from its channels to its result.

use std::num::NonZeroUsize;

use crate::equation::motion::{Measured, Motion, Term};
use crate::equation::terms::{BuiltInTerm, TermFunction};
use crate::error::Error;
use crate::exec::memory;
use crate::exec::pool::{Piece, Watch};
use crate::exec::stages::Stages;
use crate::identify::scanned::Scan;
use crate::identify::weak::angle_zero::outcome::FreeOffset;
use crate::identify::weak::angle_zero::spring::STIFFNESS;
use crate::identify::weak::below_filter::BelowFilter;
use crate::identify::weak::choice::Chosen;
use crate::identify::weak::decide::BADLY;
use crate::identify::weak::found::WeakIdentified;
use crate::identify::weak::friction::FrictionDirection;
use crate::identify::weak::lag::{Lag, Settled};
use crate::identify::weak::limits;
use crate::identify::weak::options::WeakOptions;
use crate::identify::weak::pulses::{add_pulses, allow_hidden, are_the_same, without_pulses};
use crate::identify::weak::session::{Session, always_constant};
use crate::identify::weak::torque_jumps::without_jumps;
use crate::noise::breaks::search::{Broken, breaks};
use crate::noise::channel::{rounding_variance, variance_after};
use crate::noise::defects::{Defect, Within, defects};
use crate::noise::passed::PassedNoise;
use crate::noise::quantisation::quantisation_step;
use crate::noise::spikes::{LONGEST, Repaired, spikes};
use crate::noise::unread::unread;
use crate::record::samples::Samples;
use crate::regression::model::Model;
use crate::simd::instructions::Instructions;
use crate::status::Status;
use crate::weak_form::weak_rows::{Record, TermSamples};

/// Stages of a call, about: only for showing progress.
const STAGES: usize = 50;

/// Samples of a record whose rows and windows are given back to the system before there are results: looking for what is free takes next to nothing of
/// so long a call.
const LONG: usize = 1_000_000;

/// Times that pulses are looked for, with those of the last time taken off the torque.
const PULSE_ROUNDS: usize = 2;

/// The noise of a channel is that of its rounding where it is at most so many times as large, in variance.
const HARDLY_MORE: f64 = 1.5;

/// The samples that count, and how much.
type Counted<'a> = (Option<&'a [bool]>, Option<&'a [f64]>);

/// Identifies one record in weak form, without samples that were not read, and without spikes: those of the angle are replaced by what their neighbours say, those of the torque are left out,
/// unless nothing is known without them: then they are what moves the machine.
///
/// # Errors
/// If the record is too short, its rows do not determine what is constant, or the watch cancels.
pub(crate) fn identify_weak(
    motion: &Motion<'_>,
    counted: Counted<'_>,
    options: &WeakOptions,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<WeakIdentified, Error> {
    let as_recorded = [is_as_recorded(&motion.measured), motion.measured.passed[1].is_none()];
    let not_read = [
        if as_recorded[0] { unread(motion.angle, watch)? } else { Vec::new() },
        if as_recorded[1] { unread(motion.torque, watch)? } else { Vec::new() },
    ];
    let angle = Broken { channel: motion.angle, places: &not_read[0] };
    let torque = Broken { channel: motion.torque, places: &not_read[1] };
    let is_read = not_read.iter().all(Vec::is_empty);
    let read = if is_read { None } else { Some(Motion { angle: &angle, torque: &torque, ..motion.clone() }) };
    let motion = read.as_ref().unwrap_or(motion);
    let of_angle = if as_recorded[0] { spikes(motion.angle, LONGEST[0], watch)? } else { Vec::new() };
    let of_torque = if as_recorded[1] { spikes(motion.torque, LONGEST[1], watch)? } else { Vec::new() };
    let angle = Repaired { channel: motion.angle, spikes: &of_angle };
    let repaired = if of_angle.is_empty() { None } else { Some(Motion { angle: &angle, ..motion.clone() }) };
    let motion = repaired.as_ref().unwrap_or(motion);
    let mut left_out: Vec<usize> = of_torque.iter().map(|spike| spike.place).collect();
    let mut found = without(motion, &left_out, counted, options, workers, watch);
    let is_known = found.as_ref().is_ok_and(|found| !found.record_status.contains(Status::RANK_DEFICIENT));
    if !left_out.is_empty() && !is_known {
        left_out.clear();
        found = without(motion, &left_out, counted, options, workers, watch);
    }
    found.map(|mut found| {
        found.spikes = of_angle.iter().map(|spike| (0, spike.place, spike.instead)).collect();
        found.spikes.extend(left_out.iter().map(|&place| (1, place, f64::NAN)));
        found.unread = not_read;
        found
    })
}

/// Identifies one record without some samples of its torque, and without what a recorder spoilt, its limits among that where they are the recorder's.
///
/// # Errors
/// If the record is too short, its rows do not determine what is constant, or the watch cancels.
fn without(
    motion: &Motion<'_>,
    left_out: &[usize],
    (mask, weights): Counted<'_>,
    options: &WeakOptions,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<WeakIdentified, Error> {
    limits::identify(motion.torque, |part, of_torque| match part {
        None => without_limits(motion, (left_out, of_torque), (mask, weights), options, workers, watch),
        Some(part) => motion.within(part, |motion| {
            let left_out = left_out.iter().filter(|&place| part.contains(place)).map(|place| place - part.start);
            let left_out: Vec<usize> = left_out.collect();
            let counted = (mask.map(|mask| &mask[part.clone()]), weights.map(|weights| &weights[part.clone()]));
            without_limits(motion, (&left_out, of_torque), counted, options, workers, watch)
        }),
    })
}

/// Identifies one record without some samples of its torque and those at its limits, where these are the recorder's, and without what a recorder spoilt.
///
/// # Errors
/// If the record is too short, its rows do not determine what is constant, or the watch cancels.
fn without_limits(
    motion: &Motion<'_>,
    (left_out, of_torque): (&[usize], Option<[f64; 2]>),
    (mask, weights): Counted<'_>,
    options: &WeakOptions,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<WeakIdentified, Error> {
    let lag = options.lag.unwrap_or(0.0);
    let mut defects = defects_of_motion(motion, of_torque.is_some());
    let lost = lost_samples(motion, &defects, watch)?;
    let limits = [clipped_at(motion, &defects), of_torque];
    let [angle, torque] = limits.map(|limits| limits.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]));
    let angle = Within { channel: motion.angle, limits: angle };
    let torque = Within { channel: motion.torque, limits: torque };
    let angle = Broken { channel: &angle, places: &lost };
    let mut places = [&lost, left_out].concat();
    places.sort_unstable();
    let torque = Broken { channel: &torque, places: &places };
    let is_whole = limits == [None; 2] && places.is_empty();
    let whole = if is_whole { None } else { Some(Motion { angle: &angle, torque: &torque, ..motion.clone() }) };
    let motion = whole.as_ref().unwrap_or(motion);
    let found = with_record(
        motion,
        (mask, weights, lag),
        (options.delta, options.instructions),
        (workers, watch),
        |record, watch| {
            let jumping: Vec<_> = motion.terms.iter().zip(&record.terms).filter_map(jumping).collect();
            let calm = without_jumps(record.torque, &jumping);
            identify(&record, (calm.as_deref(), motion.measured.passed, is_whole), options, workers, watch)
        },
    );
    found.map(|(found, resting)| {
        for (defects, _) in defects.iter_mut().zip(limits).filter(|(_, limits)| limits.is_some()) {
            defects.iter_mut().for_each(Defect::leave_out);
        }
        defects[0].extend((!lost.is_empty()).then_some(Defect::Broken(lost.len())));
        // Whether a torque is held by its recorder the motion says, if it is asked.
        let lag = found.lag.or(found.late);
        let acts = |one: &Defect| lag.is_some_and(|late| one.acts_in_steps(late.value, late.error));
        defects[1].retain(|one| !(acts(one) || !options.diagnose && matches!(one, Defect::Held(_))));
        // Unless something else was done to it.
        if let Some((channel, part)) = found.filtered.filter(|&(channel, _)| defects[channel].is_empty()) {
            defects[channel].push(Defect::Filtered(part));
        }
        let doubtful = defects.iter().flatten().any(Defect::is_doubtful);
        let suspected = if doubtful { Status::CHANNEL_SUSPECTED } else { Status::GOOD };
        WeakIdentified { record_status: found.record_status | suspected, resting, defects, lost, limits, ..found }
    })
}

/// What was done to every channel: angle and torque, then velocity and acceleration. Limits of the torque are the recorder's or the drive's.
fn defects_of_motion(motion: &Motion<'_>, recorder_limits_torque: bool) -> Vec<Vec<Defect>> {
    let [angle, rates @ ..] = motion.measured.channels;
    let of_angle =
        if is_alone(&motion.measured) { defects(motion.angle) } else { angle.map_or_else(Vec::new, defects) };
    let rates = rates.map(|rate| rate.map_or_else(Vec::new, defects_of_rate));
    let of_torque = defects_of_torque(motion.torque, recorder_limits_torque);
    let mut found: Vec<Vec<Defect>> = [of_angle, of_torque].into_iter().chain(rates).collect();
    let interpolated = |one: &Defect| matches!(one, Defect::Interpolated(_));
    let alike = found[0].iter().find(|one| interpolated(one)).is_some_and(|one| found[1].contains(one));
    for (channel, defects) in found.iter_mut().enumerate() {
        // Resampling here may draw straight lines, whose noise is known; and what was done to both channels alike changes no equation.
        let known = alike || motion.measured.passed.get(channel).is_some_and(Option::is_some);
        defects.retain(|one| !(interpolated(one) && known));
    }
    found
}

/// The samples before which some were lost: only of an angle that was measured alone and uniformly, and as it was recorded otherwise.
fn lost_samples(motion: &Motion<'_>, defects: &[Vec<Defect>], watch: &mut Watch<'_>) -> Result<Vec<usize>, Error> {
    if is_as_recorded(&motion.measured) && defects[0].is_empty() { breaks(motion.angle, watch) } else { Ok(Vec::new()) }
}

/// The limits at which an angle that was measured alone is clipped.
fn clipped_at(motion: &Motion<'_>, defects: &[Vec<Defect>]) -> Option<[f64; 2]> {
    defects[0].iter().find_map(Defect::limits).filter(|_| is_alone(&motion.measured))
}

/// Whether the angle is what was measured, and nothing else was.
fn is_alone(measured: &Measured<'_>) -> bool {
    let [_, rates @ ..] = measured.channels;
    rates.iter().all(Option::is_none)
}

/// Whether the angle is what was measured, sample by sample.
fn is_as_recorded(measured: &Measured<'_>) -> bool {
    is_alone(measured) && measured.passed[0].is_none()
}

/// Does something with the record that a motion is, its terms evaluated at every sample, and says which part of it rests.
///
/// # Errors
/// If the work fails, or the watch cancels.
pub(crate) fn with_record<R>(
    motion: &Motion<'_>,
    (mask, weights, lag): (Option<&[bool]>, Option<&[f64]>, f64),
    (delta, instructions): (f64, Instructions),
    (workers, watch): (NonZeroUsize, &mut Watch<'_>),
    work: impl FnOnce(Record<'_>, &mut Watch<'_>) -> Result<R, Error>,
) -> Result<(R, f64), Error> {
    let friction = FrictionDirection::of(motion, (delta, instructions), workers, watch)?;
    let (velocity, direction) = (friction.velocity.as_slice(), friction.direction.as_slice());
    let mapped = |term: &Term<'_>| match term {
        Term::BuiltIn(term) => term.function.samples(motion.angle, &velocity),
        Term::Record(_) => None,
    };
    let mapped: Vec<_> = motion.terms.iter().map(mapped).collect();
    let terms = motion.terms.iter().zip(&mapped).map(|(term, mapped)| match (*term, mapped) {
        (Term::Record(record), _) => TermSamples::Given(record),
        (Term::BuiltIn(BuiltInTerm { function: TermFunction::Direction, .. }), _) => TermSamples::Given(&direction),
        (Term::BuiltIn(_), Some(mapped)) => TermSamples::Given(mapped),
        (Term::BuiltIn(_), None) => TermSamples::One,
    });
    let record = Record {
        angle: motion.angle,
        torque: motion.torque,
        noise: motion.measured.noise,
        coefficients: motion.coefficients,
        constant: [false; 3],
        terms: terms.collect(),
        constant_terms: false,
        lag,
        angle_zero: 0.0,
        mask,
        weights,
    };
    Ok((work(record, watch)?, friction.resting))
}

/// The samples of a term that may jump from one to the next.
fn jumping<'a>((term, samples): (&Term<'a>, &TermSamples<'a>)) -> Option<&'a dyn Samples> {
    match (term, samples) {
        (Term::BuiltIn(term), _) if term.smooth => None,
        (_, TermSamples::Given(samples)) => Some(*samples),
        _ => None,
    }
}

/// Identifies one record. The noise of the torque is that of a `calm` one, without jumps, where there is one; what was resampled is compared with noise
/// that `passed` the same way.
fn identify(
    record: &Record<'_>,
    (calm, passed, whole): (Option<&[f64]>, [Option<&PassedNoise>; 2], bool),
    options: &WeakOptions,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<WeakIdentified, Error> {
    let samples = record.angle.len();
    let mut stages = Stages::new(workers, samples, STAGES, watch);
    let told = record.noise.map(|noise| noise.variance);
    let calm = calm.as_ref().map(|calm| (calm as &dyn Samples, quantisation_step(record.torque)));
    let (torque, step) = calm.map_or((record.torque, None), |(calm, step)| (calm, Some(step)));
    let channels = [
        (record.angle, options.noise[0].or(told), options.quantisation, passed[0]),
        (torque, options.noise[1], step, passed[1]),
    ];
    let pieces = channels.map(|channel| Piece { size: samples, content: channel });
    let level = |(channel, given, step, passed): (_, Option<f64>, _, _), (): &mut ()| {
        given.unwrap_or_else(|| variance_after(passed, channel, record.weights, step, options.instructions))
    };
    let levels = stages.map(pieces.into(), || (), level)?;
    settled(record, (options, whole), [levels[0], levels[1]], stages)
}

/// Identifies a record whose channels have some noise, again where pulses of the stiffness were found that hide what else there is.
fn settled(
    record: &Record<'_>,
    (options, whole): (&WeakOptions, bool),
    mut channel_noise: [f64; 2],
    mut stages: Stages<'_, '_>,
) -> Result<WeakIdentified, Error> {
    let step = options.quantisation.unwrap_or_else(|| quantisation_step(record.angle));
    let is_rounding = step > 0.0 && channel_noise[0] <= HARDLY_MORE * rounding_variance(step, record.weights);
    let filtered = BelowFilter::new(record, options, channel_noise[1]);
    channel_noise[1] = filtered.torque_noise[0];
    // What looks like a pulse where samples are missing may be a loss that was not detected.
    let (mut pulses, mut calm, mut round) = (Vec::new(), Vec::new(), if whole { 0 } else { PULSE_ROUNDS });
    loop {
        let calm_torque = calm.as_slice();
        let mut session = Session {
            record: Record {
                torque: if pulses.is_empty() { record.torque } else { &calm_torque },
                constant: always_constant(&record.coefficients, &options.kinds),
                ..record.clone()
            },
            options,
            noise: [0.0; 2],
            channel_noise,
            is_rounding,
            highest_noise: filtered.torque_noise[1],
            shared_until: filtered.until,
            scan: Scan::default(),
            suggested: None,
            free_offset: FreeOffset::default(),
            windowed_offset: None,
            most_slow: None,
            followed: None,
            best_before: None,
            is_rough: false,
            stages,
        };
        session.repeat_windowed_offset();
        let model = session.model();
        let mut chosen = session.choose(&model)?;
        if round < PULSE_ROUNDS {
            let again = session.pulses(&mut chosen, &model, &pulses, record.torque)?;
            if !are_the_same(&again, &pulses) {
                stages = session.stages;
                calm = without_pulses(record.torque, record.angle, &again);
                // Pulses that are none stay out.
                (round, pulses) = (if again.is_empty() { PULSE_ROUNDS } else { round + 1 }, again);
                continue;
            }
        }
        let hidden = session.hidden_pulses(&chosen, &pulses);
        let mut found = session.finished(chosen, &model)?;
        if let Some(place) = found.changing.iter().position(|&unknown| unknown == STIFFNESS) {
            if let Some(hidden) = hidden {
                allow_hidden(&mut found, place, options.step, &hidden, &pulses);
            }
            add_pulses(&mut found, place, options.step, &pulses);
        }
        session.stages.finish()?;
        return Ok(found);
    }
}

impl Session<'_, '_, '_> {
    /// Decides, and once more where something changes beside constants alone: the test function was chosen, and its widths were compared, as if it did not.
    /// Returns also what widths beside constants found.
    fn settled_with_followed(&mut self, chosen: Chosen, model: &Model) -> Result<(Settled, Option<Scan>), Error> {
        let settled = self.settle(model, chosen)?;
        self.followed = settled.1.model.windowed.first().copied().filter(|_| self.model().windowed.is_empty());
        if self.followed.is_none() {
            return Ok((settled, None));
        }
        drop(settled);
        let before = std::mem::take(&mut self.scan);
        let model = self.model();
        let chosen = self.choose(&model)?;
        Ok((self.settle(&model, chosen)?, Some(before)))
    }

    /// Decides with a test function that was chosen, and reports.
    fn finished(&mut self, chosen: Chosen, model: &Model) -> Result<WeakIdentified, Error> {
        let samples = self.record.angle.len();
        let ((chosen, decided, lag), before) = self.settled_with_followed(chosen, model)?;
        self.scan_between_jumps(&chosen, &decided)?;
        // What is followed explains that widths disagreed beside constants only where nothing is left.
        let before = before.filter(|_| decided.error >= BADLY);
        let (mut found, at_rows) = self.report(chosen, &decided, before.as_ref())?;
        found.scan = before.unwrap_or_else(|| std::mem::take(&mut self.scan));
        found.free_offset = self.free_offset;
        found.angle_zero = self.take_angle_zero(&mut found, &decided);
        let status = found.scan.status(&found.constants);
        found.record_status |= status;
        // Rows and windows take as much memory as the results.
        drop(decided);
        if let Some(at_rows) = at_rows {
            if samples >= LONG {
                memory::give_back();
            }
            found.results = at_rows.at_samples(samples, self.options.step, &mut self.stages)?;
        }
        found.lag = lag.map(|one| Lag { error: one.error.hypot(found.lag_of_steps), ..one });
        Ok(found)
    }
}

/// What was done to a velocity or an acceleration; wrapping is for angles.
fn defects_of_rate(rate: &dyn Samples) -> Vec<Defect> {
    defects(rate).into_iter().filter(|defect| !matches!(defect, Defect::Wrapped(_))).collect()
}

/// What was done to the torque. One that stays at a limit is what the drive does if that is not known to be the recorder's, and wrapping is for angles.
pub(crate) fn defects_of_torque(torque: &dyn Samples, recorder_limits: bool) -> Vec<Defect> {
    let is_done = |defect: &Defect| match defect {
        Defect::Held(_) | Defect::Interpolated(_) => true,
        Defect::Clipped { .. } => recorder_limits,
        _ => false,
    };
    defects(torque).into_iter().filter(is_done).collect()
}
