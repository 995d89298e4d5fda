//! Decisions from merged rows: the length of windows, and which elements are constant.

use crate::equation::rows::Rows;
use crate::error::Error;
use crate::identify::kinds::Kind;
use crate::identify::merged::decided::MergedFit;
use crate::identify::merged::session::MergedSession;
use crate::identify::merged::shown::NoiseOfRows;
use crate::identify::weak::shown_noise::MORE;
use crate::inference::constancy::{self, Test};
use crate::inference::cross_validation::{Validated, best, validate};
use crate::inference::jumps::jump::Jump;
use crate::inference::part_constants::{NoiseFrom, TestNoise};
use crate::inference::short_parts::{LEFT_OF_SWINGS, MORE_THAN_NOISE, swinging};
use crate::regression::fit::Fit;
use crate::regression::limits::NOISE_MODEL_FAILS;
use crate::regression::model::Model;
use crate::regression::residuals::residuals;
use crate::regression::subsample::{holds, stretches_of_rows, thinned_rows};
use crate::regression::window_length::Scale;

/// So many of the longest windows that stretches of a long record hold are tried again on all of it, where one of them is best.
const OVERLAP: usize = 2;
/// What was constant is windowed from here on only if rows are predicted at least so much better.
const BETTER: f64 = 0.98;
/// What no test shows to change is windowed only if rows are predicted so much better: it is what the equations lack.
const LACKING: f64 = 0.5;
/// Where equations leave more than the noise of the channels and that may be noise, what windows follow must pay by more than chance.
pub(crate) const SHOWN: f64 = 0.8;
/// So many times the noise of the channels is hardly noise.
const NO_NOISE: f64 = 50.0;

/// Rounds of looking for jumps and fitting again with windows that end there.
const JUMP_ROUNDS: usize = 4;
/// Constants that differ between parts of the record which are set free for a trial, those that differ most.
const TRIED: usize = 3;

/// Mean squared error of predicting a row, over the noise's, up to which nothing else changes.
const WELL: f64 = 1.3;

/// Why a constant is tried in windows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sought {
    /// It differs between parts of the record.
    Differing,
    /// It differs between short parts all over it alone.
    Swinging,
    /// Constants leave so much that no part can differ by more.
    Hidden,
}

/// The elements' values and the equations' misfits that weights are made of.
type Guess = (Vec<f64>, Vec<f64>);

/// A constant that windows follow, and what weights are made of beside it.
struct Freed {
    one: usize,
    found: MergedFit,
    guess: Guess,
}

impl MergedSession<'_, '_, '_> {
    /// Fits a model in windows of the length that predicts best; `None` where the rows do not determine what is constant.
    pub(crate) fn fitted(&mut self, model: &Model) -> Result<Option<MergedFit>, Error> {
        let instructions = self.options.instructions;
        let all = self.scales();
        let group = self.all.group;
        let per_row = self.all.function.stride() as f64 / group as f64;
        let wanted = self.options.regression_window.map(|samples| samples as f64 / per_row);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "rows of a record")]
        let wanted = wanted.map(|rows| Scale::nearest(&all, rows.round().max(1.0) as usize).ok_or(self.too_short()));
        let tried = match wanted.transpose()? {
            Some(one) => vec![all[one]],
            None => self.covering(&all),
        };
        if tried.is_empty() && !model.windowed.is_empty() {
            return Err(self.too_short());
        }
        let (mut scale, mut lengths, mut error) = (None, Vec::new(), None);
        if !model.windowed.is_empty() {
            let validated = self.validated(model, &tried)?;
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "samples of a record")]
            let samples = |scale: Scale| (scale.span() as f64 * per_row).round() as usize;
            lengths = validated.iter().map(|one| (one.fit.scale.map_or(0, samples), one.error)).collect();
            let Some(best) = best(&validated).or(validated.last()) else { return Ok(None) };
            (scale, error) = (best.fit.scale, Some(best.error));
            self.remember(model, &best.fit);
        }
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
            scales: tried,
            lengths,
            tests: Vec::new(),
            contradicted: false,
            jumps: Vec::new(),
            searched: false,
        }))
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
            validate(&problem, scales, expected, instructions, stages)
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
        loop {
            let found = self.tests(&fitted, NoiseFrom::Channels)?;
            let mut tried = different(&found);
            fitted.take_tests(found);
            // What constants leave may be so much that no part of the record differs by more, though one of them changes.
            let mut sought = if tried.is_empty() && fitted.error > MORE { Sought::Hidden } else { Sought::Differing };
            if tried.is_empty() && (MORE_THAN_NOISE..=MORE).contains(&fitted.error) {
                (sought, tried) = (Sought::Swinging, self.swinging(&fitted)?);
            }
            let hidden = sought == Sought::Hidden;
            let before = (self.parameters.clone(), self.misfits.clone());
            let Some(Freed { one, found, guess }) = self.freed(&fitted, tried, sought)? else {
                (self.parameters, self.misfits) = before;
                self.fill();
                let told = self.told_by_what_is_left(fitted)?;
                let Some(again) = self.freed_together(&told)? else {
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

    /// The constant that explains most where windows follow it, if that is worth it: of those that differ between parts of the record, or of all
    /// where no part can.
    fn freed(&mut self, fitted: &MergedFit, mut tried: Vec<usize>, sought: Sought) -> Result<Option<Freed>, Error> {
        let before = (self.parameters.clone(), self.misfits.clone());
        let hidden = sought == Sought::Hidden;
        if hidden {
            tried = self.suspects(&fitted.model)?;
        }
        tried.truncate(TRIED);
        let may_be_noise = (MORE..NO_NOISE).contains(&fitted.error);
        let most = match (sought, may_be_noise) {
            (Sought::Swinging, _) => (1.0 + LEFT_OF_SWINGS * (fitted.error - 1.0)) / fitted.error,
            (Sought::Hidden, _) if fitted.error > NOISE_MODEL_FAILS => LACKING,
            (Sought::Hidden, _) | (Sought::Differing, true) => SHOWN,
            (Sought::Differing, false) => BETTER,
        };
        // Where nothing but the noise of the channels is left, or what no noise is, what a test says is enough.
        let enough = fitted.model.windowed.is_empty() && sought == Sought::Differing && !may_be_noise;
        let mut best: Option<Freed> = None;
        for one in tried {
            (self.parameters, self.misfits) = before.clone();
            let freer = without(&fitted.model, one);
            if hidden {
                self.begin_with(&freer)?;
            }
            let Some(found) = self.fitted(&freer)? else { continue };
            let is_better = enough && self.is_open(one) || found.error < most * fitted.error;
            if is_better && best.as_ref().is_none_or(|best| found.error < best.found.error) {
                best = Some(Freed { one, found, guess: (self.parameters.clone(), self.misfits.clone()) });
            }
        }
        Ok(best)
    }

    /// A fit in which windows follow all constants at once that differ even beside what is left, if that explains far more: of what changes at the
    /// same time none alone is worth its windows, and a jump is seen only beside all that jump.
    fn freed_together(&mut self, told: &MergedFit) -> Result<Option<MergedFit>, Error> {
        let may_be_freed = |one: usize| told.model.constant.contains(&one) && self.is_open(one);
        let differ: Vec<_> = different(&told.tests).into_iter().filter(|&one| may_be_freed(one)).collect();
        if told.error <= MORE || differ.is_empty() {
            return Ok(None);
        }
        let before = (self.parameters.clone(), self.misfits.clone(), self.jumps.clone());
        let freer = differ.into_iter().fold(told.model.clone(), |model, one| without(&model, one));
        if let Some(free) = self.fitted(&freer)? {
            let free = self.beside_jumps(free)?;
            if free.error < SHOWN * told.error {
                return Ok(Some(free));
            }
        }
        (self.parameters, self.misfits, self.jumps) = before;
        self.fill();
        Ok(None)
    }

    /// A fit beside which an element was set free, or one with another in its place that explains far more: parts hardly differ in what swings
    /// many times in each, and more in what follows a little of it.
    fn or_another(&mut self, before: &MergedFit, free: MergedFit) -> Result<MergedFit, Error> {
        if free.error <= WELL || free.error > MORE {
            return Ok(free);
        }
        let guess = (self.parameters.clone(), self.misfits.clone());
        let most = self.suspects(&before.model)?.into_iter().next();
        if let Some(one) = most.filter(|&one| self.is_open(one) && !free.model.windowed.contains(&one)) {
            (self.parameters, self.misfits) = guess.clone();
            self.fill();
            if let Some(found) =
                self.fitted(&without(&before.model, one))?.filter(|found| found.error < SHOWN * free.error)
            {
                return Ok(found);
            }
        }
        (self.parameters, self.misfits) = guess;
        self.fill();
        Ok(free)
    }

    /// A fit whose windows end at jumps, if there are any and it predicts better so: what windows cannot follow makes others seem to vary.
    fn beside_jumps(&mut self, mut fitted: MergedFit) -> Result<MergedFit, Error> {
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

    /// Constants, those first that leave least where short windows follow them.
    fn suspects(&mut self, model: &Model) -> Result<Vec<usize>, Error> {
        let mut left = Vec::new();
        for one in model.constant.clone() {
            if !self.is_tried(one) {
                continue;
            }
            left.extend(self.begin_with(&without(model, one))?.map(|left| (one, left)));
        }
        left.sort_by(|a, b| a.1.total_cmp(&b.1));
        Ok(left.into_iter().map(|(one, _)| one).collect())
    }

    /// Whether the record decides what kind an element is of.
    fn is_open(&self, element: usize) -> bool {
        self.merged.elements[element].kind == Kind::Automatic
    }

    /// Whether a constant is asked whether it changes: not if it stands for zeros of angles in equations without a torque, and was asked for as constant.
    fn is_tried(&self, element: usize) -> bool {
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

    /// Constants of the motion that differ between short parts of the records, those first that differ most.
    fn swinging(&mut self, fitted: &MergedFit) -> Result<Vec<usize>, Error> {
        let NoiseOfRows { covariance, expected, inflation, from } = NoiseOfRows::of_channels(fitted);
        let rows = &self.all.rows;
        let problem = fitted.model.problem(rows, &rows.rhs, 1.0, Some(&fitted.correlated));
        let noise =
            TestNoise { expected, covariance: &covariance, inflation, from, equations: self.merged.equations() };
        let constants = &fitted.model.constant;
        let may = |one: &usize| self.merged.elements[*one].is_of_motion() && self.is_tried(*one);
        let may: Vec<bool> = constants.iter().map(may).collect();
        let found = swinging(&problem, (&fitted.fit, &may), noise, self.options.instructions, &mut self.stages)?;
        Ok(found.into_iter().map(|one| constants[one.constant]).collect())
    }
}

/// Constants that differ between parts of the record, those first that differ most.
fn different(found: &[(usize, Test)]) -> Vec<usize> {
    let mut found: Vec<_> = found.iter().filter(|(_, test)| test.probability < constancy::NO_CHANCE).collect();
    found.sort_by(|a, b| b.1.excess().total_cmp(&a.1.excess()));
    found.into_iter().map(|(one, _)| *one).collect()
}

fn samples(jumps: &[Jump]) -> Vec<usize> {
    jumps.iter().map(|jump| jump.sample).collect()
}

/// A model with one constant less, which is windowed.
fn without(model: &Model, one: usize) -> Model {
    let mut freer = model.clone();
    freer.constant.retain(|&other| other != one);
    freer.windowed.push(one);
    freer
}
