//! Merged rows, from channels to their result.

use std::num::NonZeroUsize;

use crate::error::Error;
use crate::exec::pool::Watch;
use crate::exec::stages::Stages;
use crate::identify::merged::choice::noise_of;
use crate::identify::merged::defects::within_limits;
use crate::identify::merged::fading::colours_of;
use crate::identify::merged::found::MergedFound;
use crate::identify::merged::interleaved::{Interleaved, Weights};
use crate::identify::merged::session::{EXPONENT, MergedSession};
use crate::identify::merged::system::{Merged, MergedOptions};
use crate::identify::scanned::Scan;
use crate::noise::correlated::CorrelatedNoise;
use crate::weak_form::test_function::{LEAST_HALF_WIDTH, TestFunction};

/// Stages of a call, about: only for showing progress.
const STAGES: usize = 60;
/// Rounds of taking less of the noise's colour where less is left.
const FADINGS: usize = 3;

/// Identifies what trials and masses share, in weak form.
///
/// # Errors
/// If records are too short, settings are impossible, or the watch cancels.
pub fn identify_merged(
    merged: &Merged<'_>,
    options: &MergedOptions,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<MergedFound, Error> {
    within_limits(merged, |merged| identify_within(merged, options, workers, watch))
}

/// Identifies what trials and masses share where samples that a recorder spoilt are missing.
fn identify_within(
    merged: &Merged<'_>,
    options: &MergedOptions,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<MergedFound, Error> {
    let samples: usize = merged.trials.iter().filter_map(|trial| trial.angles.first()).map(|one| one.len()).sum();
    let mut stages = Stages::new(workers, samples, STAGES, watch);
    let function = TestFunction::new(LEAST_HALF_WIDTH, EXPONENT, options.delta)?;
    let (all, trials) = Interleaved::build(merged, function, options.delta, &mut stages)?;
    let mut session = MergedSession {
        merged,
        options,
        noise: [Vec::new(), Vec::new()],
        misfits: Vec::new(),
        is_decided: false,
        has_few_times: false,
        freed: Vec::new(),
        colours: [Vec::new(), Vec::new()],
        parameters: merged.elements.iter().map(|element| element.known.unwrap_or(0.0)).collect(),
        weights: Weights { angles: Vec::new(), equations: Vec::new() },
        all,
        trials,
        at_end: false,
        scan: Scan::default(),
        jumps: Vec::new(),
        whole: None,
        stages,
    };
    session.noise = noise_of(&mut session)?;
    let [angles, torques] = colours_of(&mut session)?;
    let white = session.noise[1].iter().map(|&variance| CorrelatedNoise::white(variance)).collect();
    session.colours = [angles, white];
    let Some(mut fitted) = session.chosen_and_settled()? else { return session.nothing() };
    if let Some(again) = session.with_colour_of_torques(&fitted, &torques)? {
        fitted = again;
    }
    for _ in 0..FADINGS {
        if !session.fade(&fitted) {
            break;
        }
        let Some(again) = session.chosen_and_settled()? else { return session.nothing() };
        fitted = again;
    }
    let fitted = session.over_few_times(fitted)?;
    let fitted = session.follow(fitted)?;
    let (mut found, at_rows) = session.report(&fitted)?;
    let windowed = fitted.model.windowed.clone();
    drop(fitted);
    let results = at_rows.at_samples(merged.samples, options.step, &mut session.stages)?;
    found.take(&windowed, results);
    session.stages.finish()?;
    Ok(found)
}
