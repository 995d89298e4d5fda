//! Windows over few times, down to one, where trials are enough: each is predicted from the others.

use crate::error::Error;
use crate::identify::merged::decided::MergedFit;
use crate::identify::merged::followed::FOLLOWS;
use crate::identify::merged::session::MergedSession;
use crate::inference::across_trials::{Dealt, ROWS_OF_UNKNOWN, SaidAcross, left_across};
use crate::inference::cross_validation::{ComparedRows, left_of_rows};
use crate::inference::largest_square::LargestSquare;
use crate::inference::window_averaging::Averages;
use crate::regression::block_products::dot;
use crate::regression::fit::Fit;
use crate::regression::model::Model;
use crate::regression::predictor::without_constants;
use crate::regression::problem::Problem;
use crate::regression::solved::is_determined;
use crate::regression::window_length::Scale;

/// Times of the windows.
const TIMES: [usize; 5] = [1, 3, 5, 9, 15];
/// The fewest trials: so many that one is little among them.
const FEWEST_TRIALS: usize = 10;

/// Windows over few times are tried where one of so many of the shortest others predicts best, or these do not follow.
const SHORT: usize = 2;
/// They must predict so much better than others.
const BETTER: f64 = 0.98;
/// Constants, and what is windowed for the same number of rows, may have so many times the variance that they have with others: trials that move alike tell
/// next to nothing at one time.
const LITTLE_TOLD: f64 = 9.0;
/// The part of what an element is multiplied with that one course in all trials may have, and rounds of finding that course.
const ALIKE: f64 = 0.9;
const ROUNDS: usize = 12;
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
        if model.windowed.iter().any(|&one| self.moves_alike(one)) {
            return Vec::new();
        }
        self.across(model, shortest).into_iter().filter(|scale| growing_in(model, *scale).linear).collect()
    }

    /// Whether one course of what an element is multiplied with, times a factor for each trial, is most of it: at one time such trials tell the same, and long
    /// windows tell more.
    fn moves_alike(&self, element: usize) -> bool {
        let (values, group) = (&self.all.rows.regressors[element].value, self.all.group);
        let norm = |column: &[f64]| dot(column, column).sqrt().max(f64::MIN_POSITIVE);
        let first = values.chunks_exact(group).max_by(|a, b| norm(a).total_cmp(&norm(b)));
        let Some(mut factors) = first.map(<[f64]>::to_vec) else { return false };
        let mut course = Vec::new();
        for _ in 0..ROUNDS {
            let length = norm(&factors);
            factors = factors.into_iter().map(|factor| factor / length).collect();
            course = values.chunks_exact(group).map(|time| dot(time, &factors)).collect::<Vec<f64>>();
            factors.fill(0.0);
            for (time, along) in values.chunks_exact(group).zip(&course) {
                factors.iter_mut().zip(time).for_each(|(factor, value)| *factor += along * value);
            }
        }
        dot(&course, &course) > ALIKE * dot(values, values)
    }

    /// The same decisions beside windows over few times, where these predict better. What changes faster than other windows follow looks like jumps to
    /// them, and makes constants seem to change.
    pub(crate) fn over_few_times(&mut self, fitted: MergedFit) -> Result<MergedFit, Error> {
        let Some(best) = fitted.fit.scale.filter(|scale| !scale.is_across()) else { return Ok(fitted) };
        let across =
            fitted.scales.first().map_or_else(Vec::new, |shortest| self.across_several(&fitted.model, *shortest));
        let is_short = fitted.scales.iter().position(|scale| *scale == best).is_some_and(|place| place < SHORT);
        if across.is_empty() || self.options.regression_window.is_some() || !is_short && fitted.error <= FOLLOWS {
            return Ok(fitted);
        }
        let before = (self.parameters.clone(), self.misfits.clone(), std::mem::take(&mut self.jumps));
        let (freed, is_decided) = (self.freed.clone(), self.is_decided);
        self.fill();
        let compared = self.compared_across(&fitted.model, (&fitted.scales, best), &across)?;
        let again = if best_across(&compared).is_some() {
            self.has_few_times = true;
            let again = self.settle(&self.model())?;
            again.filter(|again| again.fit.scale.is_some_and(Scale::is_across) && again.error < fitted.error)
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
        let compared = ComparedRows::new(&problem, tried, LargestSquare::Fixed);
        let fit = Fit::with_leave_gap_out(&problem, of_others, expected, instructions, &mut self.stages)?;
        let Some(of_best) = fit else { return Ok(Vec::new()) };
        let Some(left_of_others) = left_of_rows(&problem, of_others, &of_best) else { return Ok(Vec::new()) };
        let is_asked = self.options.regression_window.is_some();
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
                compared.errors_of(|row| both(row).map(|both| both[which] * both[which] / expected.variance)).0
            };
            let one = PredictedAcross { scale, error: error(0), of_others: error(1) };
            if one.error.is_finite() && (is_asked || tells(&fit, &of_best)) {
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

/// Whether windows over few times tell constants, and what is windowed, hardly worse than others do.
fn tells(few: &Fit, others: &Fit) -> bool {
    let layout = few.full.fields.layout;
    let of_constants = |fit: &Fit| fit.variances().collect::<Vec<f64>>();
    let of_windowed = |fit: &Fit, unknown: usize| {
        let covariance = fit.full.fields.covariance(unknown, unknown);
        let told = (0..fit.full.len()).filter(|&window| is_determined(&fit.full, window));
        let (sum, count) =
            told.fold((0.0, 0.0_f64), |(sum, count), window| (sum + fit.full.field(covariance)[window], count + 1.0));
        fit.span as f64 * sum / count
    };
    let is_near = |few: f64, others: f64| few <= LITTLE_TOLD * others;
    of_constants(few).into_iter().zip(of_constants(others)).all(|(few, others)| is_near(few, others))
        && (0..layout.windowed).all(|unknown| is_near(of_windowed(few, unknown), of_windowed(others, unknown)))
}

/// The windows over few times that predict best, if they do so better than all others.
pub(crate) fn best_across(compared: &[PredictedAcross]) -> Option<PredictedAcross> {
    let best = compared.iter().min_by(|a, b| a.error.total_cmp(&b.error));
    best.filter(|best| best.error < BETTER * best.of_others).copied()
}

/// Windowed elements at every row, each from the window in the middle of which it lies, or at an end from the nearest one that tells; not a number within
/// gaps between such windows.
pub(crate) fn averages_across(rest: &Problem<'_>, fit: &Fit, said: &[Option<SaidAcross>]) -> Averages {
    let mut averages = Averages::new(rest.layout.windowed, rest.rows());
    let told: Vec<(usize, &SaidAcross)> =
        said.iter().enumerate().filter_map(|(place, one)| Some((place, one.as_ref()?))).collect();
    let value = |place: usize, unknown: usize| said[place].as_ref().map_or(f64::NAN, |one| one.value(unknown));
    for row in 0..rest.rows() {
        let is_beyond_jump = |place: usize| {
            let centre = fit.centre(place);
            rest.jumps.iter().any(|&jump| (jump <= row) != (jump as f64 <= centre))
        };
        let here = fit.nearest(row);
        let next = told.partition_point(|(place, _)| *place < here);
        let [before, after] = [next.checked_sub(1).map(|before| told[before]), told.get(next).copied()]
            .map(|one| one.filter(|(place, _)| !is_beyond_jump(*place)));
        let Some((place, one)) = before.into_iter().chain(after).min_by_key(|(place, _)| place.abs_diff(here)) else {
            continue;
        };
        if place != here && before.is_some() && after.is_some() {
            // A gap.
            continue;
        }
        // As windows beside it do; at an end what is carried on does not grow.
        let on = told.get(next + usize::from(place == here)).copied().filter(|(place, _)| !is_beyond_jump(*place));
        let (from, to) = (before.map_or(place, |one| one.0), on.map_or(place, |one| one.0));
        let apart = ((to - from) * fit.step) as f64 * rest.period;
        let later = (row as f64 - fit.centre(place)) * rest.period;
        for unknown in 0..rest.layout.windowed {
            let slope = if from < to { (value(to, unknown) - value(from, unknown)) / apart } else { 0.0 };
            averages.values[unknown][row] = one.value(unknown) + later * slope;
            (averages.slopes[unknown][row], averages.errors[unknown][row]) = (slope, one.error(unknown));
        }
    }
    averages
}

/// Whether some row has no number.
pub(crate) fn has_gaps(averages: &Averages) -> bool {
    averages.values.iter().flatten().any(|value| value.is_nan())
}

/// Numbers of windows over few times, and others where these have none, whose errors hold what they are off elsewhere.
pub(crate) fn bridged(mut across: Averages, others: &Averages) -> Averages {
    for unknown in 0..across.values.len() {
        let (own, other) = (&across.values[unknown], &others.values[unknown]);
        let squares = own.iter().zip(other).map(|(own, other)| (own - other).powi(2)).filter(|one| one.is_finite());
        let (sum, count) = squares.fold((0.0, 0.0_f64), |(sum, count), one| (sum + one, count + 1.0));
        let off = sum / count.max(1.0);
        for row in (0..own.len()).filter(|&row| own[row].is_nan()).collect::<Vec<_>>() {
            across.values[unknown][row] = other[row];
            across.slopes[unknown][row] = others.slopes[unknown][row];
            across.errors[unknown][row] = (others.errors[unknown][row].powi(2) + off).sqrt();
        }
    }
    across
}
