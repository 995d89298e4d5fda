//! The one entry: every record takes the route that its form, kinds, mask and missing samples ask for.
//!
//! In strong form a record without a mask, whose unknowns are all windowed, or all constant and without weights, is worked on piece by piece,
//! and all such records of a call together; any other is held as a whole. Both make the same rows, so the numbers agree to rounding.

use std::num::NonZeroUsize;

use crate::error::Error;
use crate::exec::pool::{Watch, part_of, parts};
use crate::identify::form::{regressors, strong, weak};
use crate::identify::identification::Identification;
use crate::identify::kinds::{Kind, in_strong_form};
use crate::identify::missing::{holes, propagate};
use crate::identify::options::{Method, Options, StrongForm, Task};
use crate::identify::strong::constant::constants;
use crate::identify::strong::streaming::StrongRecord;
use crate::identify::strong::windowed::windows;
use crate::record::samples::is_usable;

/// How a record in strong form is worked on, and whether missing samples are left out of its windows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Route {
    pieces: Pieces,
    leaves_out: bool,
}

/// In which pieces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pieces {
    /// Piece by piece, everything in windows.
    Windowed,
    /// Piece by piece, everything constant.
    Constant,
    /// As a whole.
    Whole,
}

/// Identifies inertia, damping, stiffness and terms of every record.
///
/// # Errors
/// If a record is shorter than its windows or has no room for the weak form's test functions, settings are impossible, or the watch cancels.
pub fn identify_all(
    tasks: &[Task<'_>],
    options: &Options,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<Vec<Identification>, Error> {
    let mut found: Vec<Option<Identification>> = tasks.iter().map(|_| None).collect();
    // Asked once, since the answer may need every sample of the record.
    let routes: Vec<Route> = tasks.iter().map(|task| route(task, options, watch)).collect::<Result<_, Error>>()?;
    let gives_a_part =
        |(task, route): (&Task<'_>, &Route)| matches!(task.method, Method::Weak(_)) || route.pieces == Pieces::Windowed;
    if options.wanted.is_some() && !tasks.iter().zip(&routes).all(gives_a_part) {
        return Err(Error::OnlyOfWholeRecord);
    }
    for pieces in [Pieces::Windowed, Pieces::Constant] {
        for (form, places) in together(tasks, &routes, pieces) {
            let record = |&place: &usize| StrongRecord {
                motion: tasks[place].motion.clone(),
                weights: tasks[place].weights,
                leaves_out: routes[place].leaves_out,
            };
            let records: Vec<StrongRecord<'_>> = places.iter().map(record).collect();
            let each = if pieces == Pieces::Windowed {
                windows(form, &records, options, workers, watch)?
            } else {
                constants(form, &records, options.step, workers, watch)?
            };
            for (place, mut one) in places.into_iter().zip(each) {
                mark_untested(&mut one, options);
                of_mean_weight(&mut one, tasks[place].weights);
                found[place] = Some(one);
            }
        }
    }
    let (parts, samples) = parts(tasks.iter().map(|task| task.motion.angle.len()));
    let rest = tasks.iter().zip(found).zip(parts).map(|((task, found), part)| match found {
        Some(found) => Ok(found),
        None => alone(task, options, workers, &mut part_of(watch, part, samples)),
    });
    rest.collect()
}

/// Identifies one record that is held as a whole.
fn alone(
    task: &Task<'_>,
    options: &Options,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<Identification, Error> {
    let mut found = match &task.method {
        Method::Weak(form) => weak(task, form, options, workers, watch)?,
        Method::Strong(form) => {
            let mut found = strong(task, form, options, workers, watch)?;
            mark_untested(&mut found, options);
            of_mean_weight(&mut found, task.weights);
            found
        }
    };
    if options.propagate {
        let mut holes = holes(&task.motion, f64::is_finite, &mut |_, total| watch(total, total))?;
        // What has no weight is left out, whatever it holds.
        holes.retain(|&sample| task.weights.is_none_or(|weights| weights[sample] > 0.0));
        if !holes.is_empty() {
            propagate(&mut found, &holes, options.step);
        }
    }
    Ok(found)
}

/// Records in strong form that are worked on together, by their settings.
fn together<'a, 'b>(tasks: &'a [Task<'b>], routes: &[Route], pieces: Pieces) -> Vec<(&'a StrongForm<'b>, Vec<usize>)> {
    let mut groups: Vec<(&StrongForm<'b>, Vec<usize>)> = Vec::new();
    for (place, task) in tasks.iter().enumerate().filter(|(place, _)| routes[*place].pieces == pieces) {
        let Method::Strong(form) = &task.method else { continue };
        let same = |other: &StrongForm<'b>, one: usize| {
            std::ptr::eq(other.derivatives, form.derivatives)
                && other.regression_window == form.regression_window
                && routes[one].leaves_out == routes[place].leaves_out
        };
        match groups.iter_mut().find(|(other, places)| same(other, places[0])) {
            Some((_, places)) => places.push(place),
            None => groups.push((form, vec![place])),
        }
    }
    groups
}

/// How a record is worked on; in weak form as a whole.
fn route(task: &Task<'_>, options: &Options, watch: &mut Watch<'_>) -> Result<Route, Error> {
    let whole = Route { pieces: Pieces::Whole, leaves_out: false };
    let Method::Strong(form) = &task.method else { return Ok(whole) };
    let is_plain =
        !form.filter_torque && task.lag == Some(0.0) && task.mask.is_none() && task.motion.measured.noise.is_none();
    let kinds = in_strong_form(&options.kinds, &regressors(&task.motion));
    let all = |kind: Kind| is_plain && kinds.iter().all(|one| *one == kind);
    let pieces = if all(Kind::Constant) && task.weights.is_none() {
        Pieces::Constant
    } else if all(Kind::Windowed) && !form.linear {
        Pieces::Windowed
    } else {
        return Ok(whole);
    };
    // Of a part of a record not all is there to be looked at.
    let leaves_out =
        !options.propagate && (options.wanted.is_some() || !holes(&task.motion, is_usable, watch)?.is_empty());
    Ok(Route { pieces, leaves_out })
}

/// Makes deviations of residuals those of a sample of mean weight, whatever the unit of the weights.
pub(crate) fn of_mean_weight(found: &mut Identification, weights: Option<&[f64]>) {
    let counted = weights.unwrap_or_default().iter().filter(|weight| **weight > 0.0);
    let (sum, count) = counted.fold((0.0, 0_usize), |(sum, count), weight| (sum + weight, count + 1));
    if count > 0 {
        let root = (sum / count as f64).sqrt();
        found.residual_std.iter_mut().for_each(|deviation| *deviation /= root);
    }
}

/// Says of what the record was to decide, and strong form took as constant, that nothing tested it.
fn mark_untested(found: &mut Identification, options: &Options) {
    for (unknown, kind) in found.unknowns.iter_mut().zip(&options.kinds) {
        unknown.untested = *kind == Kind::Automatic && unknown.is_constant();
    }
}
