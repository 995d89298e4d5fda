//! Decisions from merged rows: the length of windows, and which elements are constant.

use std::sync::Arc;

use crate::equation::rows::Rows;
use crate::error::Error;
use crate::identify::kinds::Kind;
use crate::identify::merged::session::MergedSession;
use crate::inference::constancy::{self, NoiseFrom, Test, TestNoise};
use crate::inference::cross_validation::{Validated, best, validate};
use crate::inference::jumps::jump::Jump;
use crate::regression::constants::Expected;
use crate::regression::fit::Fit;
use crate::regression::limits::NOISE_MODEL_FAILS;
use crate::regression::model::Model;
use crate::regression::problem::Correlated;
use crate::regression::residuals::residuals;
use crate::regression::row_covariance::RowCovariance;
use crate::regression::subsample::{holds, stretches_of_rows, thinned_rows};
use crate::regression::window_length::Scale;

/// So many of the longest windows that stretches of a long record hold are tried again on all of it, where one of them is best.
const OVERLAP: usize = 2;
/// What was constant is windowed from here on only if rows are predicted at least so much better.
const BETTER: f64 = 0.98;
/// What no test shows to change is windowed only if rows are predicted so much better: it is what the equations lack.
const LACKING: f64 = 0.5;

/// Rounds of looking for jumps and fitting again with windows that end there.
const JUMP_ROUNDS: usize = 4;
/// Constants that differ between parts of the record which are set free for a trial, those that differ most.
const TRIED: usize = 3;

/// The elements' values and the equations' misfits that weights are made of.
type Guess = (Vec<f64>, Vec<f64>);

/// What was decided, and the fit it rests on.
#[derive(Clone)]
pub(crate) struct MergedFit {
    pub(crate) model: Model,
    pub(crate) fit: Fit,
    pub(crate) covariance: RowCovariance,
    pub(crate) correlated: Arc<Correlated>,
    pub(crate) expected: Expected,
    /// Mean squared error of predicting a row from others, over the noise's.
    pub(crate) error: f64,
    /// The largest misfit of an equation without a torque; 1 where all are explained.
    pub(crate) misfit: f64,
    pub(crate) scales: Vec<Scale>,
    /// Lengths that were tried, in samples, and the error of each.
    pub(crate) lengths: Vec<(usize, f64)>,
    pub(crate) tests: Vec<(usize, Test)>,
    /// Whether a constant that differs between parts of the record stayed one.
    pub(crate) contradicted: bool,
    pub(crate) jumps: Vec<Jump>,
}

impl MergedFit {
    /// Whether its windows are the shortest of those that were tried.
    pub(crate) fn has_shortest_windows(&self) -> bool {
        self.scales.len() > 1 && self.fit.scale.is_some() && self.scales.first().copied() == self.fit.scale
    }
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
            None => all.clone(),
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
        let samples = |jumps: &[Jump]| jumps.iter().map(|jump| jump.sample).collect::<Vec<_>>();
        for _ in 0..JUMP_ROUNDS {
            let found = self.find_jumps(&fitted)?;
            if samples(&found) == samples(&self.jumps) {
                break;
            }
            let before = (std::mem::replace(&mut self.jumps, found), self.parameters.clone());
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
        let Some(mut fitted) = self.fitted(model)? else { return Ok(None) };
        loop {
            let tests = self.tests(&fitted)?;
            let of_constants = fitted.model.constant.iter().copied().zip(tests);
            let found: Vec<(usize, Test)> = of_constants.filter_map(|(one, test)| Some((one, test?))).collect();
            fitted.tests.retain(|(one, _)| fitted.model.windowed.contains(one));
            fitted.tests.extend(found.clone());
            fitted.contradicted = found.iter().any(|(_, test)| test.probability < constancy::NO_CHANCE);
            // What constants leave may be so much that no part of the record differs by more, though one of them changes.
            let hidden = !fitted.contradicted && fitted.error > NOISE_MODEL_FAILS;
            let before = (self.parameters.clone(), self.misfits.clone());
            let tried = if hidden { self.suspects(&fitted.model)? } else { self.different(found) };
            // An unknown that varies makes others seem to vary, too: the one that explains most is set free.
            let mut best: Option<(MergedFit, Guess)> = None;
            for one in tried.into_iter().take(TRIED) {
                (self.parameters, self.misfits) = before.clone();
                let freer = without(&fitted.model, one);
                if hidden {
                    self.begin_with(&freer)?;
                }
                let Some(found) = self.fitted(&freer)? else { continue };
                if best.as_ref().is_none_or(|(best, _)| found.error < best.error) {
                    best = Some((found, (self.parameters.clone(), self.misfits.clone())));
                }
            }
            let most = if hidden { LACKING } else { BETTER };
            let free = fitted.model.windowed.is_empty() && !hidden;
            let better = |found: &MergedFit| free || found.error < most * fitted.error;
            let Some((found, after)) = best.filter(|(found, _)| better(found)) else {
                (self.parameters, self.misfits) = before;
                self.fill();
                return Ok(Some(fitted));
            };
            // Windows were compared with weights of parameters that were wrong while this one was held constant.
            (self.parameters, self.misfits) = after;
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
            fitted = MergedFit { tests: std::mem::take(&mut fitted.tests), ..again };
        }
    }

    /// Constants that nobody asked for and that differ between parts of the record, those first that differ most.
    fn different(&self, mut found: Vec<(usize, Test)>) -> Vec<usize> {
        found.retain(|(one, test)| test.probability < constancy::NO_CHANCE && self.is_open(*one));
        found.sort_by(|a, b| b.1.excess().total_cmp(&a.1.excess()));
        found.into_iter().map(|(one, _)| one).collect()
    }

    /// Constants that nobody asked for, those first that leave least where short windows follow them.
    fn suspects(&mut self, model: &Model) -> Result<Vec<usize>, Error> {
        let open: Vec<usize> = model.constant.iter().copied().filter(|&one| self.is_open(one)).collect();
        let mut left = Vec::new();
        for one in open {
            left.extend(self.begin_with(&without(model, one))?.map(|left| (one, left)));
        }
        left.sort_by(|a, b| a.1.total_cmp(&b.1));
        Ok(left.into_iter().map(|(one, _)| one).collect())
    }

    /// Whether the record decides what kind an element is of.
    fn is_open(&self, element: usize) -> bool {
        self.merged.elements[element].kind == Kind::Automatic
    }

    /// Whether each constant is the same in all parts of the record.
    fn tests(&mut self, fitted: &MergedFit) -> Result<Vec<Option<Test>>, Error> {
        if self.asks_for_constants() && fitted.error > NOISE_MODEL_FAILS {
            // By how much constants may differ is not known where the noise that is left is not.
            return Ok(vec![None; fitted.model.constant.len()]);
        }
        let rows = &self.all.rows;
        let problem = fitted.model.problem(rows, &rows.rhs, 1.0, Some(&fitted.correlated));
        let noise = TestNoise {
            expected: fitted.expected,
            covariance: &fitted.covariance,
            inflation: fitted.error.max(1.0),
            from: NoiseFrom::Channels,
            equations: self.merged.equations(),
        };
        constancy::test(&problem, &fitted.fit, noise, self.options.instructions, &mut self.stages)
    }
}

/// A model with one constant less, which is windowed.
fn without(model: &Model, one: usize) -> Model {
    let mut freer = model.clone();
    freer.constant.retain(|&other| other != one);
    freer.windowed.push(one);
    freer
}
