//! Windows over few times, down to one, where trials are enough: each is predicted from the others.

use crate::error::Error;
use crate::identify::merged::decided::MergedFit;
use crate::identify::merged::session::MergedSession;
use crate::inference::across_trials::{Dealt, ROWS_OF_UNKNOWN, SaidAcross, left_across};
use crate::inference::cross_validation::{ComparedRows, clipped, left_of_rows};
use crate::inference::window_averaging::Averages;
use crate::regression::fit::Fit;
use crate::regression::model::Model;
use crate::regression::predictor::without_constants;
use crate::regression::problem::Problem;
use crate::regression::window_length::Scale;

/// Times of the windows.
const TIMES: [usize; 5] = [1, 3, 5, 9, 15];
/// The fewest trials: so many that one is little among them.
const FEWEST_TRIALS: usize = 10;

/// No shorter windows are tried once some predict so many times worse than the best of the longer ones.
const HOPELESS: f64 = 1.2;

/// How well windows over few times predict.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PredictedAcross {
    pub(crate) scale: Scale,
    /// Mean squared error of predicting a row, over the noise's, and that of other windows on the same rows.
    pub(crate) error: f64,
    pub(crate) of_others: f64,
}

impl MergedSession<'_, '_, '_> {
    /// Windows over fewer times than the shortest of others holds, with trials enough to determine what is windowed.
    pub(crate) fn across(&self, model: &Model, shortest: Scale) -> Vec<Scale> {
        let group = self.all.group;
        let times = shortest.span() / group;
        if self.merged.trials.len() < FEWEST_TRIALS || model.windowed.is_empty() {
            return Vec::new();
        }
        // One part of the trials is left out.
        let is_enough =
            |&one: &usize| one * group >= 2 * ROWS_OF_UNKNOWN * growing_beyond_one(model, one).layout().local();
        let some = TIMES.into_iter().filter(|&one| one < times).filter(is_enough);
        some.map(|one| Scale::across(one, self.all.reach() / group, group)).collect()
    }

    /// Those of several times: at one, what grows is not told from damping.
    pub(crate) fn across_several(&self, model: &Model, shortest: Scale) -> Vec<Scale> {
        self.across(model, shortest).into_iter().filter(|scale| growing_in(model, *scale).linear).collect()
    }

    /// The same decisions beside windows over few times, where these predict better. What changes faster than other windows follow looks like jumps to
    /// them, and makes constants seem to change.
    pub(crate) fn over_few_times(&mut self, fitted: MergedFit) -> Result<MergedFit, Error> {
        let Some(best) = fitted.fit.scale.filter(|scale| !scale.is_across()) else { return Ok(fitted) };
        let across =
            fitted.scales.first().map_or_else(Vec::new, |shortest| self.across_several(&fitted.model, *shortest));
        if across.is_empty() || self.options.regression_window.is_some() {
            return Ok(fitted);
        }
        let before = (self.parameters.clone(), self.misfits.clone(), std::mem::take(&mut self.jumps));
        let (freed, is_decided) = (self.freed.clone(), self.is_decided);
        self.fill();
        let compared = self.compared_across(&fitted.model, (&fitted.scales, best), &across)?;
        let again = if best_across(&compared).is_some() {
            self.has_few_times = true;
            self.settle(&self.model())?.filter(|again| again.error < fitted.error)
        } else {
            None
        };
        if let Some(again) = again {
            return Ok(again);
        }
        self.has_few_times = false;
        (self.parameters, self.misfits, self.jumps) = before;
        (self.freed, self.is_decided) = (freed, is_decided);
        self.fill();
        Ok(fitted)
    }

    /// How rows of one time belong to trials.
    pub(crate) fn dealt(&self) -> Dealt {
        Dealt { group: self.all.group, equations: self.merged.equations() }
    }

    /// How well windows over few times predict, beside the best of all others, which were `tried`: the shortest first, as far as any promises anything.
    pub(crate) fn compared_across(
        &mut self,
        model: &Model,
        (tried, of_others): (&[Scale], Scale),
        across: &[Scale],
    ) -> Result<Vec<PredictedAcross>, Error> {
        let dealt = self.dealt();
        let (covariance, expected) = self.covariance();
        let (rows, instructions) = (&self.all.rows, self.options.instructions);
        let correlated = model.correlated(rows, &covariance, &mut self.stages)?;
        let problem = model.problem(rows, &rows.rhs, 1.0, Some(&correlated));
        let compared = ComparedRows::new(&problem, tried);
        let fit = Fit::with_leave_gap_out(&problem, of_others, expected, instructions, &mut self.stages)?;
        let Some(fit) = fit else { return Ok(Vec::new()) };
        let Some(left_of_others) = left_of_rows(&problem, of_others, &fit) else { return Ok(Vec::new()) };
        let mut found: Vec<PredictedAcross> = Vec::new();
        for &scale in across.iter().rev() {
            let model = &growing_in(model, scale);
            let problem = model.problem(rows, &rows.rhs, 1.0, Some(&correlated));
            let Some(fit) = Fit::new(&problem, Some(scale), expected, instructions, &mut self.stages)? else {
                continue;
            };
            let constants = &fit.pooled.values;
            let rhs = without_constants(&problem, constants);
            let rest = model.without_constants(rows, &problem, &rhs, constants, 1.0);
            let left = left_across(&rest, scale, dealt, &mut self.stages)?;
            let both = |row: usize| {
                let other = left_of_others(row).filter(|_| problem.usable[row] && left[row].is_finite())?;
                Some([left[row], other])
            };
            let error = |which: usize| {
                compared.errors_of(|row| both(row).map(|both| clipped(both[which], expected.variance))).0
            };
            let one = PredictedAcross { scale, error: error(0), of_others: error(1) };
            if one.error.is_finite() {
                found.push(one);
            }
            let least = found.iter().map(|one| one.error).fold(f64::INFINITY, f64::min);
            if one.error > HOPELESS * least {
                break;
            }
        }
        found.reverse();
        Ok(found)
    }
}

/// The same model for windows of some length: what is windowed grows within them, but for those of one time, where growth of a stiffness is damping as well.
pub(crate) fn growing_in(model: &Model, scale: Scale) -> Model {
    growing_beyond_one(model, if scale.is_across() { scale.span() / scale.step } else { usize::MAX })
}

fn growing_beyond_one(model: &Model, times: usize) -> Model {
    Model { linear: times > 1, ..model.clone() }
}

/// The windows over few times that predict best, if they do so better than all others.
pub(crate) fn best_across(compared: &[PredictedAcross]) -> Option<PredictedAcross> {
    let best = compared.iter().min_by(|a, b| a.error.total_cmp(&b.error));
    best.filter(|best| best.error < best.of_others).copied()
}

/// Windowed elements at every row, each from the window in the middle of which it lies, or the nearest one that tells. They grow as windows beside it do.
pub(crate) fn averages_across(rest: &Problem<'_>, fit: &Fit, said: &[Option<SaidAcross>]) -> Averages {
    let mut averages = Averages::new(rest.layout.windowed, rest.rows());
    let told: Vec<(usize, &SaidAcross)> =
        said.iter().enumerate().filter_map(|(place, one)| Some((place, one.as_ref()?))).collect();
    for row in 0..rest.rows() {
        let is_beyond_jump = |place: usize| {
            let centre = fit.centre(place);
            rest.jumps.iter().any(|&jump| (jump <= row) != (jump as f64 <= centre))
        };
        let here = fit.nearest(row);
        let next = told.partition_point(|(place, _)| *place < here);
        let beside = [next.checked_sub(1).map(|before| told[before]), told.get(next).copied()];
        let near = beside.into_iter().flatten().filter(|(place, _)| !is_beyond_jump(*place));
        let Some((place, one)) = near.min_by_key(|(place, _)| place.abs_diff(here)) else { continue };
        let neighbour = |place: usize| said.get(place)?.as_ref().filter(|_| !is_beyond_jump(place));
        let before = place.checked_sub(1).and_then(|before| Some((before, neighbour(before)?)));
        let (from, to) =
            (before.unwrap_or((place, one)), neighbour(place + 1).map_or((place, one), |one| (place + 1, one)));
        let apart = ((to.0 - from.0) * fit.step) as f64 * rest.period;
        let later = (row as f64 - fit.centre(place)) * rest.period;
        for unknown in 0..rest.layout.windowed {
            let slope = if apart > 0.0 { (to.1.value(unknown) - from.1.value(unknown)) / apart } else { 0.0 };
            averages.values[unknown][row] = one.value(unknown) + later * slope;
            (averages.slopes[unknown][row], averages.errors[unknown][row]) = (slope, one.error(unknown));
        }
    }
    averages
}
