//! Decisions from merged rows: the length of windows, and which elements are constant.

use crate::equation::rows::Rows;
use crate::error::Error;
use crate::identify::kinds::Kind;
use crate::identify::merged::across::{best_across, growing_in};
use crate::identify::merged::decided::MergedFit;
use crate::identify::merged::freed::{Freed, Sought, different};
use crate::identify::merged::session::MergedSession;
use crate::identify::merged::shown::NoiseOfRows;
use crate::identify::weak::shown_noise::MORE;
use crate::inference::constancy::{self, Test};
use crate::inference::cross_validation::{Validated, best, validate};
use crate::inference::jumps::jump::Jump;
use crate::inference::largest_square::LargestSquare;
use crate::inference::part_constants::{NoiseFrom, TestNoise};
use crate::regression::fit::Fit;
use crate::regression::limits::NOISE_MODEL_FAILS;
use crate::regression::model::Model;
use crate::regression::residuals::residuals;
use crate::regression::subsample::{holds, stretches_of_rows, thinned_rows};
use crate::regression::window_length::Scale;

/// So many of the longest windows that stretches of a long record hold are tried again on all of it, where one of them is best.
const OVERLAP: usize = 2;

/// Rounds of looking for jumps and fitting again with windows that end there.
const JUMP_ROUNDS: usize = 4;

/// Windows that were chosen, and those that they were chosen of.
#[derive(Default)]
struct ChosenWindows {
    scale: Option<Scale>,
    /// Mean squared error of predicting a row, over the noise's.
    error: Option<f64>,
    /// Lengths that were tried, in samples, and the error of each.
    lengths: Vec<(usize, f64)>,
    scales: Vec<Scale>,
    across: Vec<Scale>,
}

impl MergedSession<'_, '_, '_> {
    /// Fits a model in windows of the length that predicts best; `None` where the rows do not determine what is constant.
    pub(crate) fn fitted(&mut self, model: &Model) -> Result<Option<MergedFit>, Error> {
        let instructions = self.options.instructions;
        let model = &Model { linear: true, ..model.clone() };
        let Some(ChosenWindows { scale, mut error, lengths, scales, across }) = self.chosen_windows(model)? else {
            return Ok(None);
        };
        let model = &scale.map_or_else(|| model.clone(), |scale| growing_in(model, scale));
        // What noise makes of rows depends on the parameters, so a first fit gives those that the last one is made with.
        let mut fit = None;
        for _ in 0..2 {
            self.fill();
            let (covariance, expected) = self.covariance();
            let correlated = model.correlated(&self.all.rows, &covariance, &mut self.stages)?;
            let problem = model.problem(&self.all.rows, &self.all.rows.rhs, 1.0, Some(&correlated));
            let Some(one) = Fit::new(&problem, scale, expected, instructions, &mut self.stages)? else {
                return Ok(None);
            };
            if model.windowed.is_empty() {
                let (left, usable) = residuals(&problem, &one, &mut self.stages)?;
                let count = usable.iter().filter(|usable| **usable).count() as f64;
                let sum: f64 = left.iter().map(|left| left * left).sum();
                error = Some(sum / (count - one.pooled.values.len() as f64).max(1.0) / expected.variance);
            }
            self.remember(model, &one);
            self.take_misfits(model, &one)?;
            fit = Some((one, covariance, correlated, expected));
        }
        let misfit = self.misfit();
        let error = error.filter(|error| error.is_finite()).unwrap_or(1.0);
        let error = if misfit > 1.0 { error.max(misfit) } else { error };
        Ok(fit.map(|(fit, covariance, correlated, expected)| MergedFit {
            model: model.clone(),
            fit,
            covariance,
            correlated,
            expected,
            error,
            misfit,
            scales,
            across,
            lengths,
            tests: Vec::new(),
            contradicted: false,
            jumps: Vec::new(),
            searched: false,
        }))
    }

    /// The length of windows that predicts best, or the nearest to the one that is asked for; `None` where rows determine nothing.
    fn chosen_windows(&mut self, model: &Model) -> Result<Option<ChosenWindows>, Error> {
        let all = self.scales();
        if model.windowed.is_empty() {
            let scales = self.covering(&all);
            return Ok(Some(ChosenWindows { scales, ..ChosenWindows::default() }));
        }
        let group = self.all.group;
        let per_row = self.all.function.stride() as f64 / group as f64;
        let wanted = self.options.regression_window.map(|samples| samples as f64 / per_row);
        let scales = if let Some(wanted) = wanted {
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "rows of a record")]
            let rows = wanted.round().max(1.0) as usize;
            let across = all.first().map_or_else(Vec::new, |shortest| self.across(model, *shortest));
            let each = [across.as_slice(), all.as_slice()].concat();
            let one = each[Scale::nearest(&each, rows).ok_or(self.too_short())?];
            if one.is_across() {
                let compared = self.compared_across(model, (&all, all[0]), &[one])?;
                let lengths = compared.iter().map(|found| (self.samples_in(one), found.error)).collect();
                let error = compared.first().map(|found| found.error);
                return Ok(Some(ChosenWindows { scale: Some(one), error, lengths, scales: all, across: Vec::new() }));
            }
            vec![one]
        } else {
            self.covering(&all)
        };
        if scales.is_empty() {
            return Err(self.too_short());
        }
        let validated = self.validated(model, &scales)?;
        let mut lengths: Vec<_> =
            validated.iter().map(|one| (one.fit.scale.map_or(0, |scale| self.samples_in(scale)), one.error)).collect();
        let Some(best) = best(&validated).or(validated.last()) else { return Ok(None) };
        let (mut scale, mut error) = (best.fit.scale, Some(best.error));
        self.remember(model, &best.fit);
        let across = match all.first() {
            Some(&shortest) if wanted.is_none() && self.has_few_times => self.across_several(model, shortest),
            _ => Vec::new(),
        };
        if let Some(of_others) = scale.filter(|_| !across.is_empty()) {
            let compared = self.compared_across(model, (&scales, of_others), &across)?;
            lengths.splice(0..0, compared.iter().map(|one| (self.samples_in(one.scale), one.error)));
            if let Some(best) = best_across(&compared) {
                (scale, error) = (Some(best.scale), Some(best.error));
            }
        }
        Ok(Some(ChosenWindows { scale, error, lengths, scales, across }))
    }

    /// Samples that windows hold, about: of one time, one.
    pub(crate) fn samples_in(&self, scale: Scale) -> usize {
        let (stride, group) = (self.all.function.stride(), self.all.group);
        let times = scale.span() / group;
        if scale.is_across() { (times - 1) * stride + 1 } else { times * stride }
    }

    /// How well windows of some lengths predict rows that were left out: on stretches of many rows as far as they hold windows so long.
    fn validated(&mut self, model: &Model, scales: &[Scale]) -> Result<Vec<Validated>, Error> {
        let (covariance, expected) = self.covariance();
        // Stretches may begin with the row of any equation.
        let covariance = covariance.mean();
        let instructions = self.options.instructions;
        let rows = &self.all.rows;
        let stages = &mut self.stages;
        let mut validated = |rows: &Rows, scales: &[Scale]| {
            let correlated = model.correlated(rows, &covariance, stages)?;
            let problem = model.problem(rows, &rows.rhs, 1.0, Some(&correlated));
            validate(&problem, (scales, LargestSquare::Fixed), expected, instructions, stages)
        };
        let Some(stretches) = stretches_of_rows(rows.len()).filter(|_| scales.len() > 1) else {
            return validated(rows, scales);
        };
        let short = scales.partition_point(|scale| holds(*scale));
        let found = validated(&thinned_rows(rows, &stretches), &scales[..short])?;
        let long = short.saturating_sub(OVERLAP);
        match best(&found).and_then(|best| best.fit.scale) {
            Some(best) if !scales[long..].contains(&best) => Ok(found),
            Some(_) => validated(rows, &scales[long..]),
            None => validated(rows, scales),
        }
    }

    /// Chooses the test function, and settles what is asked for with it.
    pub(crate) fn chosen_and_settled(&mut self) -> Result<Option<MergedFit>, Error> {
        self.jumps.clear();
        self.choose()?;
        let model = self.model();
        self.settle(&model)
    }

    /// Decides, finds jumps and decides again with windows that end there, until no jump is new.
    pub(crate) fn settle(&mut self, model: &Model) -> Result<Option<MergedFit>, Error> {
        let Some(mut fitted) = self.decide(model)? else { return Ok(None) };
        for _ in 0..JUMP_ROUNDS {
            let found = if fitted.searched { fitted.jumps.clone() } else { self.find_jumps(&fitted)? };
            if samples(&found) == samples(&self.jumps) {
                break;
            }
            let before = (std::mem::replace(&mut self.jumps, found), self.parameters.clone());
            self.fill();
            let Some(again) = self.decide(&fitted.model.clone())? else {
                // Beside so many jumps nothing is determined.
                (self.jumps, self.parameters) = before;
                self.fill();
                break;
            };
            fitted = again;
        }
        fitted.jumps.clone_from(&self.jumps);
        Ok(Some(fitted))
    }

    /// Tests what the record decides about, and lets windows follow what is not constant where that predicts better.
    pub(crate) fn decide(&mut self, model: &Model) -> Result<Option<MergedFit>, Error> {
        self.is_decided = false;
        let Some(mut fitted) = self.fitted(model)? else { return Ok(None) };
        if fitted.fit.scale.is_some_and(|scale| !growing_in(&fitted.model, scale).linear) {
            // What grows within windows of one time would be a damping that changes.
            return Ok(Some(fitted));
        }
        loop {
            let found = self.tests(&fitted, NoiseFrom::Channels)?;
            let mut tried = different(&found);
            fitted.take_tests(found);
            let (mut sought, mut swings) = (Sought::Differing, Vec::new());
            if tried.is_empty() && fitted.error > MORE {
                // What constants leave may be so much that no part of the record differs by more, though one of them changes.
                sought = Sought::Hidden;
            } else if tried.is_empty() {
                (sought, swings) = self.swings(&fitted)?;
                tried = swings.iter().map(|one| one.element).collect();
            }
            let hidden = sought == Sought::Hidden;
            let before = (self.parameters.clone(), self.misfits.clone());
            let Some(Freed { one, found, guess }) = self.freed(&fitted, tried, sought)? else {
                (self.parameters, self.misfits) = before;
                self.fill();
                let mut told = self.told_by_what_is_left(fitted)?;
                let Some(again) = self.freed_together(&told)? else {
                    for (one, _) in self.told_swings(&told, swings)? {
                        told.contradict_by(one.element, one.test);
                    }
                    return self.held_by_torques(told).map(Some);
                };
                fitted = MergedFit { tests: told.tests, ..again };
                continue;
            };
            if !self.is_open(one) {
                // What it is asked to be stands, and nothing else is to follow what it does.
                (self.parameters, self.misfits) = before;
                self.fill();
                let mut fitted = self.told_by_what_is_left(fitted)?;
                let usable = self.all.rows.usable.iter().filter(|usable| **usable).count();
                let inflation = self.noise_of_rows(&fitted)?.expected.variance_inflation;
                fitted.contradict(one, &found, usable as f64 / inflation);
                for (swing, _) in
                    self.told_swings(&fitted, swings)?.into_iter().filter(|(swing, _)| swing.element == one)
                {
                    fitted.contradict_by(one, swing.test);
                }
                return self.held_by_torques(fitted).map(Some);
            }
            // Windows were compared with weights of parameters that were wrong while this one was held constant.
            (self.parameters, self.misfits) = guess;
            self.fill();
            let again = if hidden && self.jumps.is_empty() {
                // So was the test function.
                self.freed.clone_from(&found.model.windowed);
                self.choose()?;
                let Some(again) = self.fitted(&found.model)? else { return Ok(None) };
                again
            } else {
                self.fitted(&found.model)?.unwrap_or(found)
            };
            let again = self.beside_jumps(again)?;
            let again = if hidden { again } else { self.or_another(&fitted, again)? };
            fitted = MergedFit { tests: std::mem::take(&mut fitted.tests), ..again };
        }
    }

    /// A fit whose windows end at jumps, if there are any and it predicts better so: what windows cannot follow makes others seem to vary.
    pub(crate) fn beside_jumps(&mut self, mut fitted: MergedFit) -> Result<MergedFit, Error> {
        let found = self.find_jumps(&fitted)?;
        if samples(&found) != samples(&self.jumps) {
            let before = (self.jumps.clone(), self.parameters.clone(), self.misfits.clone());
            self.jumps.clone_from(&found);
            self.fill();
            let again = self.fitted(&fitted.model)?;
            if let Some(again) = again.filter(|again| again.error < fitted.error) {
                return Ok(again);
            }
            (self.jumps, self.parameters, self.misfits) = before;
            self.fill();
        }
        (fitted.jumps, fitted.searched) = (found, true);
        Ok(fitted)
    }

    /// Whether the record decides what kind an element is of.
    pub(crate) fn is_open(&self, element: usize) -> bool {
        self.merged.elements[element].kind == Kind::Automatic
    }

    /// Whether a constant is asked whether it changes: not if it stands for zeros of angles in equations without a torque, and was asked for as constant.
    pub(crate) fn is_tried(&self, element: usize) -> bool {
        self.is_open(element) || !self.takes_all(element)
    }

    /// A fit with tests that rest on what is left, where that is more than the noise of the channels: that may be coloured.
    fn told_by_what_is_left(&mut self, mut fitted: MergedFit) -> Result<MergedFit, Error> {
        if fitted.error > MORE {
            let found = self.tests(&fitted, NoiseFrom::Equations)?;
            fitted.take_tests(found);
        }
        Ok(fitted)
    }

    /// Whether each constant is the same in all parts of the record, beside the noise of the channels or what is left.
    fn tests(&mut self, fitted: &MergedFit, from: NoiseFrom) -> Result<Vec<(usize, Test)>, Error> {
        if self.asks_for_constants() && fitted.error > NOISE_MODEL_FAILS {
            // By how much constants may differ is not known where the noise that is left is not.
            return Ok(Vec::new());
        }
        let NoiseOfRows { covariance, expected, inflation, from } = match from {
            NoiseFrom::Channels => NoiseOfRows::of_channels(fitted),
            NoiseFrom::Equations => self.noise_of_rows(fitted)?,
        };
        let rows = &self.all.rows;
        let shown = match from {
            NoiseFrom::Channels => None,
            NoiseFrom::Equations => Some(fitted.model.correlated(rows, &covariance, &mut self.stages)?),
        };
        let correlated = shown.as_ref().unwrap_or(&fitted.correlated);
        let problem = fitted.model.problem(rows, &rows.rhs, 1.0, Some(correlated));
        let equations = self.merged.equations();
        let noise = TestNoise { expected, covariance: &covariance, inflation, from, equations };
        let tests = constancy::test(&problem, &fitted.fit, noise, self.options.instructions, &mut self.stages)?;
        let of_constants = fitted.model.constant.iter().copied().zip(tests);
        Ok(of_constants.filter(|(one, _)| self.is_tried(*one)).filter_map(|(one, test)| Some((one, test?))).collect())
    }
}

fn samples(jumps: &[Jump]) -> Vec<usize> {
    jumps.iter().map(|jump| jump.sample).collect()
}
