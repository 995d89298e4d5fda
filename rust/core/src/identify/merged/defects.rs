//! What a recorder did to the channels of trials and masses.
//!
//! An angle at its limits is missing there. A torque that stays at a limit is what a drive does, and counts, unless rows are predicted badly
//! with such samples and better without them: then the recorder had the limit.

use crate::error::Error;
use crate::identify::merged::found::MergedFound;
use crate::identify::merged::system::{Merged, Trial};
use crate::identify::weak::decide::{better_of, is_odd};
use crate::identify::weak::form::defects_of_torque;
use crate::noise::defects::{Defect, Within, defects};
use crate::record::samples::Samples;
use crate::status::Status;

/// What was done to every channel of every trial, angles before torques.
type OfChannels = Vec<Vec<Vec<Defect>>>;

/// Identifies without what a recorder spoilt, and says what that was.
///
/// # Errors
/// If the work fails.
pub(crate) fn within_limits(
    merged: &Merged<'_>,
    mut identify: impl FnMut(&Merged<'_>) -> Result<MergedFound, Error>,
) -> Result<MergedFound, Error> {
    let angles = merged.channels();
    let of_channels = |trial: &Trial<'_>| -> Vec<Vec<Defect>> {
        let of_angles = trial.angles.iter().map(|angle| defects(*angle));
        of_angles.chain(trial.torques.iter().map(|torque| defects_of_torque(*torque, true))).collect()
    };
    let mut spoilt: OfChannels = merged.trials.iter().map(of_channels).collect();
    without_common_lines(&mut spoilt);
    let whole = with_limits(merged, &spoilt, |channel| channel < angles, &mut identify)?;
    let predicted = |found: &MergedFound| (found.prediction_error, found.record_status);
    let at_limits = |one: &Vec<Defect>| one.iter().any(|defect| defect.limits().is_some());
    let has_limits = spoilt.iter().any(|trial| trial[angles..].iter().any(at_limits));
    let (found, is_within) = if has_limits && is_odd(predicted(&whole)) {
        better_of(whole, with_limits(merged, &spoilt, |_| true, &mut identify), predicted)?
    } else {
        (whole, false)
    };
    Ok(told(found, spoilt, angles, |channel| is_within || channel < angles))
}

/// Forgets lines between readings that all channels of a trial have alike: these change no equation.
fn without_common_lines(spoilt: &mut OfChannels) {
    let is_line = |one: &&Defect| matches!(one, Defect::Interpolated(_));
    for trial in spoilt {
        let first = trial.first().and_then(|channel| channel.iter().find(is_line)).copied();
        if let Some(line) = first.filter(|line| trial.iter().all(|channel| channel.contains(line))) {
            for channel in trial.iter_mut() {
                channel.retain(|one| *one != line);
            }
        }
    }
}

/// Identifies with samples at the limits of some channels missing.
fn with_limits(
    merged: &Merged<'_>,
    spoilt: &OfChannels,
    of: impl Fn(usize) -> bool,
    identify: &mut impl FnMut(&Merged<'_>) -> Result<MergedFound, Error>,
) -> Result<MergedFound, Error> {
    let limits_of_channel = |(channel, defects): (usize, &Vec<Defect>)| {
        let limits = defects.iter().find_map(Defect::limits).filter(|_| of(channel));
        limits.unwrap_or([f64::NEG_INFINITY, f64::INFINITY])
    };
    let limits: Vec<Vec<[f64; 2]>> =
        spoilt.iter().map(|trial| trial.iter().enumerate().map(limits_of_channel).collect()).collect();
    if limits.iter().flatten().flatten().all(|limit| limit.is_infinite()) {
        return identify(merged);
    }
    let channels: Vec<Vec<Within<'_>>> =
        merged.trials.iter().zip(&limits).map(|(trial, limits)| bounded(trial, limits)).collect();
    let trials = merged.trials.iter().zip(&channels).map(|(trial, channels)| {
        let (angles, torques) = channels.split_at(trial.angles.len());
        Trial { angles: read(angles), torques: read(torques), ..trial.clone() }
    });
    identify(&Merged { trials: trials.collect(), elements: merged.elements.clone(), samples: merged.samples })
}

/// The channels of a trial, each within its limits.
fn bounded<'a>(trial: &Trial<'a>, limits: &[[f64; 2]]) -> Vec<Within<'a>> {
    let channels = trial.angles.iter().chain(&trial.torques).zip(limits);
    channels.map(|(&channel, &limits)| Within { channel, limits }).collect()
}

fn read<'a>(channels: &'a [Within<'a>]) -> Vec<&'a dyn Samples> {
    channels.iter().map(|one| one as &dyn Samples).collect()
}

/// Says what was done to channels, of which angles come first: of trials what the first one with it has. Limits count where samples at them are
/// missing, and holds of a torque where the motion does not say that it acts in steps.
fn told(mut found: MergedFound, spoilt: OfChannels, angles: usize, is_left_out: impl Fn(usize) -> bool) -> MergedFound {
    for trial in spoilt {
        for (channel, defects) in trial.into_iter().enumerate() {
            // An angle does not move in steps.
            let late =
                found.late.iter().find(|(other, _)| *other == channel && channel >= angles).map(|(_, late)| *late);
            for mut defect in defects {
                if late.is_some_and(|late| defect.acts_in_steps(late.value, late.error)) {
                    continue;
                }
                if defect.limits().is_some() {
                    if !is_left_out(channel) {
                        continue;
                    }
                    defect.leave_out();
                }
                if !found.defects.iter().any(|(other, one)| *other == channel && one.name() == defect.name()) {
                    found.defects.push((channel, defect));
                }
            }
        }
    }
    found.late.retain(|(_, late)| late.is_conspicuous());
    if found.defects.iter().any(|(_, defect)| defect.is_doubtful()) {
        found.record_status |= Status::CHANNEL_SUSPECTED;
    }
    found
}
