//! Decisions from the record: the length of windows, and which unknowns are constant.

use std::borrow::Cow;

use crate::equation::rows::Rows;
use crate::error::Error;
use crate::identify::kinds::Kind;
use crate::identify::weak::choice::Chosen;
use crate::identify::weak::decided::Decided;
use crate::identify::weak::session::Session;
use crate::inference::constancy::{self, Trend};
use crate::inference::jumps::jump::{Jump, row_from};
use crate::inference::jumps::search;
use crate::inference::missing_terms::JudgedTerm;
use crate::inference::part_constants::{NoiseFrom, TestNoise};
use crate::inference::short_parts::{Swinging, swinging};
use crate::inference::slowly_varying;
use crate::inference::trend::tilted;
use crate::regression::fit::Fit;
use crate::regression::model::Model;
use crate::regression::subsample::stretches_of_rows;
use crate::regression::window_length::Scale;
use crate::status::Status;

/// The mean squared error of predicting rows, over the noise's, from which on more is tried, and the part of it that must be left to be
/// worth it.
pub(crate) const BADLY: f64 = 1.5;
pub(crate) const BETTER: f64 = 0.8;
/// The same where no test of parts says that anything changes.
const FAR_BETTER: f64 = 0.5;
/// The same where rows are predicted well and another changes: of constants that are set free beside it for nothing .96 is left at least.
const A_LITTLE_BETTER: f64 = 0.9;

/// The part of what noise does not explain of rows that may be left where a constant that swings is set free: it is .02 to .11 where one swings, .28 to
/// .35 where a friction or a drag is missing.
const LEFT_OF_SWINGS: f64 = 0.2;

/// The same after the first round of a search, from which on it is not worth another.
const HOPELESS: f64 = 0.5;

/// Where constants jump, those that do not change in between stand unless others predict so much better.
const SIMPLER: f64 = 0.98;

/// Rounds of looking for jumps and fitting again with windows that end there. One is enough where even then constants seem to vary and windows are the
/// shortest there are: these follow anything, and what they follow looks like jumps.
const JUMP_ROUNDS: usize = 4;

/// How well rows are predicted, and what holds for their record.
pub(crate) type Predicted = (f64, Status);

/// Whether rows are predicted badly, or widths disagree.
pub(crate) fn is_odd((error, status): Predicted) -> bool {
    error.is_nan() || error >= BADLY || status.contains(Status::SCALES_DISAGREE)
}

/// Whether rows within some limits are predicted better by far than the whole ones, or no worse while widths agree there alone.
pub(crate) fn is_better_within(whole: Predicted, within: Predicted) -> bool {
    let disagrees = |(_, status): Predicted| status.contains(Status::SCALES_DISAGREE);
    let agrees = disagrees(whole) && !disagrees(within) && within.0 <= whole.0;
    !within.1.contains(Status::RANK_DEFICIENT) && (within.0 < BETTER * whole.0 || agrees)
}

/// What was found within some limits where that is better, else what was found in the whole, and which of them it is.
///
/// # Errors
/// If the watch cancelled.
pub(crate) fn better_of<T>(
    whole: T,
    within: Result<T, Error>,
    predicted: impl Fn(&T) -> Predicted,
) -> Result<(T, bool), Error> {
    match within {
        Err(Error::Cancelled) => Err(Error::Cancelled),
        Ok(within) if is_better_within(predicted(&whole), predicted(&within)) => Ok((within, true)),
        _ => Ok((whole, false)),
    }
}

impl Session<'_, '_, '_> {
    /// Chooses the length of windows where it is not given, tests which coefficients are constant, and finds jumps of windowed ones.
    pub(crate) fn decide(&mut self, chosen: &mut Chosen, model: &Model) -> Result<Decided, Error> {
        let (mut jumps, mut whole, mut round) = (Vec::new(), None, 0);
        loop {
            let mut decided = self.decide_kinds(chosen, model, jumps.iter().any(|jump: &Jump| jump.of_constants))?;
            if self.varies_too_much(&decided) {
                return Ok(decided);
            }
            let of_constants =
                if round == 0 { self.jumps_of_constants(&chosen.weak, &decided, model)? } else { Vec::new() };
            let found = if !of_constants.is_empty() {
                of_constants
            } else if round < JUMP_ROUNDS && !(round > 0 && decided.follows_anything()) {
                self.find_jumps(&chosen.weak, &decided, &jumps, whole.as_ref())?
            } else {
                jumps.clone()
            };
            let samples = |jumps: &[Jump]| jumps.iter().map(|jump| jump.sample).collect::<Vec<_>>();
            if samples(&found) == samples(&jumps) {
                (decided.jumps, decided.whole) = (found, whole);
                return Ok(decided);
            }
            let weak = &mut chosen.weak;
            let whole = whole.get_or_insert_with(|| weak.rows.clone());
            weak.rows = whole.clone();
            let (function, rows, times) = (&weak.kernels.values[2], weak.rows.len(), (weak.first, weak.stride, 1));
            weak.rows.exclude(search::rows_over(&found, function, times, rows));
            weak.rows.jumps = found.iter().map(|jump| row_from(jump.sample, times)).collect();
            (jumps, round) = (found, round + 1);
        }
    }

    /// Fits again what was fitted before something moved that changes the best length of windows by little, if at all. Returns the fit before.
    pub(crate) fn fit_near(&mut self, chosen: &mut Chosen, model: &Model) -> Result<Option<Decided>, Error> {
        self.best_before = chosen.best_windows();
        let before = chosen.fitted.take();
        let fitted = self.fit_first(chosen, model);
        self.best_before = None;
        chosen.fitted = Some(fitted?);
        Ok(before)
    }

    /// Fits everything that is not windowed as constant, in windows of the length that predicts best where it is not given.
    pub(crate) fn fit_first(&mut self, chosen: &Chosen, model: &Model) -> Result<Decided, Error> {
        let rows = &chosen.weak.rows;
        let (covariance, expected) = self.covariance(&chosen.weak, chosen.parameters);
        let mut decided = Decided {
            model: model.clone(),
            slow: Vec::new(),
            found: None,
            fit: None,
            first: None,
            longest: None,
            near: None,
            error: 1.0,
            tests: Vec::new(),
            lengths: Vec::new(),
            scales: Vec::new(),
            covariance,
            correlated: None,
            expected,
            constants_jump: false,
            jumps: Vec::new(),
            whole: None,
            spring: None,
            white: None,
        };
        if self.options.averaging {
            decided.scales = Scale::all(rows.len(), chosen.weak.reach());
        }
        self.fit_constants(&chosen.weak, &mut decided)?;
        Ok(decided)
    }

    /// The fit that was made with a test function, or else the first.
    pub(crate) fn take_fitted(&mut self, chosen: &mut Chosen, model: &Model) -> Result<Decided, Error> {
        match chosen.fitted.take() {
            Some(fitted) => Ok(fitted),
            None => self.fit_first(chosen, model),
        }
    }

    /// Chooses the length of windows where it is not given, and tests what is constant.
    fn decide_kinds(&mut self, chosen: &mut Chosen, model: &Model, constants_jump: bool) -> Result<Decided, Error> {
        let mut decided = self.take_fitted(chosen, model)?;
        decided.constants_jump = constants_jump;
        let rows = &chosen.weak.rows;
        decided.slow = self.of_kind(Kind::Varying);
        // What is in windows from the beginning is not set free beside itself.
        let changing = self.options.decided.iter().filter(|(_, changes)| *changes).map(|(unknown, _)| *unknown);
        let mut changing = changing.filter(|unknown| !model.windowed.contains(unknown));
        let (mut model, mut is_free) = (Cow::Borrowed(model), false);
        loop {
            if !decided.slow.is_empty() && !std::mem::take(&mut is_free) {
                if decided.found.is_none() {
                    decided.longest = self.swinging(rows, &decided)?.and_then(|one| one.longest);
                }
                self.set_free(rows, &model, &mut decided, f64::INFINITY)?;
            }
            let worst = self.test(rows, &mut decided)?;
            let Some(worst) = changing.next().or(worst) else {
                if self.most_slow == Some(decided.slow.len()) && decided.error >= BADLY {
                    // Nothing more may vary that would predict well.
                    break;
                }
                is_free = self.set_unsteady_free(rows, &model, &mut decided)?;
                if is_free {
                    continue;
                }
                break;
            };
            if model.windowed.is_empty() {
                // Beside constants it is followed in windows, as a stiffness is.
                let constant = model.constant.iter().copied().filter(|&one| one != worst).collect();
                let linear = self.options.linear;
                model = Cow::Owned(Model { windowed: vec![worst], constant, linear, ..Model::default() });
                let before = decided.clone();
                (decided.model, decided.white, decided.correlated) = (model.clone().into_owned(), None, None);
                (decided.covariance, decided.expected) = self.covariance(&chosen.weak, chosen.parameters);
                self.fit_constants(&chosen.weak, &mut decided)?;
                if decided.fit.is_none() {
                    decided = before;
                    break;
                }
            } else {
                decided.slow.push(worst);
                if self.varies_too_much(&decided) {
                    // To find how it varies takes longest of all.
                    return Ok(decided);
                }
            }
        }
        self.set_others_free(rows, &model, &mut decided)?;
        Ok(decided)
    }

    /// Whether more varies than may.
    pub(crate) fn varies_too_much(&self, decided: &Decided) -> bool {
        self.most_slow.is_some_and(|most| decided.slow.len() > most)
    }

    /// Tests every constant. Returns the one that differs most between the parts of the record, if it may be set free.
    pub(crate) fn test(&mut self, rows: &Rows, decided: &mut Decided) -> Result<Option<usize>, Error> {
        let Some(fit) = &decided.fit else { return Ok(None) };
        let problem = decided.problem(decided.rows(rows), self.noise[0]);
        let noise = self.test_noise(decided);
        let mut results = constancy::test(&problem, fit, noise, self.options.instructions, &mut self.stages)?;
        // Lines are asked only where rows are predicted about as well as noise allows: what a missing term leaves may follow a line, too. And only where
        // nothing varies slowly: what was taken off for that has errors which a line does not know.
        let differs = results.iter().flatten().any(|test| test.probability < constancy::NO_CHANCE);
        if !differs && decided.slow.is_empty() && decided.error < BADLY {
            let trends = self.trends(rows, decided, fit)?;
            constancy::beside_lines(&mut results, &trends, noise.from);
        }
        // Tests of what was set free before stand as they were.
        decided.tests.retain(|(one, _)| decided.slow.contains(one));
        let constants = decided.model.constant.iter().zip(results);
        decided.tests.extend(constants.filter_map(|(&one, test)| test.map(|test| (one, test))));
        let tested = self.undecided();
        let conspicuous = decided.tests.iter().filter(|(one, test)| {
            tested.contains(one) && !decided.slow.contains(one) && test.probability < constancy::NO_CHANCE
        });
        let worst = conspicuous.min_by(|a, b| a.1.probability.total_cmp(&b.1.probability)).map(|(one, _)| *one);
        let alone = decided.model.windowed.is_empty() && self.options.averaging;
        Ok(worst.filter(|_| fit.scale.is_some() || alone))
    }

    /// The noise that parts of the record are compared with.
    fn test_noise<'a>(&self, decided: &'a Decided) -> TestNoise<'a> {
        let is_raised = self.noise != self.channel_noise;
        TestNoise {
            expected: decided.expected,
            covariance: &decided.covariance,
            inflation: decided.error.max(1.0),
            from: if is_raised || self.is_rounding { NoiseFrom::Equations } else { NoiseFrom::Channels },
            equations: 1,
        }
    }

    /// By how much inertia, damping and stiffness grow along the record where they are constants and something is windowed beside them: blocks lose
    /// what windows take.
    fn trends(&mut self, rows: &Rows, decided: &Decided, fit: &Fit) -> Result<Vec<Option<Trend>>, Error> {
        let Decided { model, covariance, expected, .. } = decided;
        let mut trends = vec![None; model.constant.len()];
        let coefficients = self.record.coefficients.len();
        let tested: Vec<usize> = model.constant.iter().copied().filter(|&one| one < coefficients).collect();
        let Some(correlated) = &decided.correlated else { return Ok(trends) };
        if model.windowed.is_empty() || tested.is_empty() || stretches_of_rows(rows.len()).is_some() {
            return Ok(trends);
        }
        let mut rows = decided.rows(rows).clone();
        let first = rows.regressors.len();
        let tilted = tilted(&rows, &tested);
        rows.regressors.extend(tilted);
        let judged = JudgedTerm {
            rows: &rows,
            model,
            rhs: decided.rhs(&rows),
            noise: self.noise[0],
            fit,
            covariance,
            correlated,
            expected: *expected,
            inflation: decided.error.max(1.0),
            instructions: self.options.instructions,
        };
        let lines: Vec<usize> = (first..first + tested.len()).collect();
        let Some(factors) = judged.factors(&lines, &mut self.stages)? else { return Ok(trends) };
        for (unknown, (growth, error)) in tested.iter().zip(factors) {
            let place = model.constant.iter().position(|one| one == unknown);
            if let Some(place) = place.filter(|_| error > 0.0 && growth.is_finite()) {
                trends[place] = Some(Trend { value: fit.pooled.values[place], growth, error });
            }
        }
        Ok(trends)
    }

    /// Sets the constant free that seems to grow most where rows are predicted badly, if that leaves far less, or else the one that swings most, if that
    /// leaves hardly more than noise: whatever is missing from an equation follows a curve a little. Returns whether it was. One that was given as
    /// constant is contradicted.
    fn set_unsteady_free(&mut self, rows: &Rows, model: &Model, decided: &mut Decided) -> Result<bool, Error> {
        let Some(fit) = decided.fit.as_ref().filter(|fit| fit.scale.is_some()) else { return Ok(false) };
        if !decided.slow.is_empty() {
            return Ok(false);
        }
        let growing = if decided.error < BADLY { None } else { self.growing(rows, decided, fit)? };
        let swinging = self.swinging(rows, decided)?;
        decided.longest = swinging.as_ref().and_then(|one| one.longest);
        if let Some(growing) = growing {
            let free = self.freed(rows, model, decided, (growing, f64::INFINITY))?;
            if free.error < FAR_BETTER * decided.error {
                *decided = free;
                return Ok(true);
            }
        }
        let Some(Swinging { constant, test, .. }) = swinging else { return Ok(false) };
        let swinging = decided.model.constant[constant];
        let is_open = self.undecided().contains(&swinging);
        let rows = if is_open { Cow::Borrowed(rows) } else { Cow::Owned(without_rate(rows, swinging)) };
        let hopeless = 1.0 + HOPELESS * (decided.error - 1.0).max(0.0);
        let free = self.freed(&rows, model, decided, (swinging, hopeless))?;
        let is_settled = free.error - 1.0 < LEFT_OF_SWINGS * (decided.error - 1.0);
        if !is_settled || free.error >= A_LITTLE_BETTER * decided.error {
            return Ok(false);
        }
        if is_open {
            *decided = free;
        }
        decided.tests.retain(|(one, _)| *one != swinging);
        decided.tests.push((swinging, test));
        Ok(is_open)
    }

    /// What a record is with one of its constants set free, or roughly where it is hopeless; the error is infinite where that is not determined.
    fn freed(
        &mut self,
        rows: &Rows,
        model: &Model,
        decided: &Decided,
        (constant, hopeless): (usize, f64),
    ) -> Result<Decided, Error> {
        let mut free = decided.clone();
        free.slow.push(constant);
        self.set_free(rows, model, &mut free, hopeless)?;
        if free.fit.is_none() {
            free.error = f64::INFINITY;
        }
        Ok(free)
    }

    /// The undecided constant that seems to grow most along the record.
    fn growing(&mut self, rows: &Rows, decided: &Decided, fit: &Fit) -> Result<Option<usize>, Error> {
        let trends = self.trends(rows, decided, fit)?;
        let undecided = self.undecided();
        let growing = decided.model.constant.iter().zip(&trends).filter_map(|(&one, trend)| Some((one, (*trend)?)));
        let growing = growing.filter(|(one, trend)| undecided.contains(one) && trend.is_conspicuous());
        let most = growing.max_by(|a, b| a.1.excess().total_cmp(&b.1.excess()));
        Ok(most.map(|(most, _)| most))
    }

    /// The constant of the motion that differs most between short parts of the record, if one does.
    fn swinging(&mut self, rows: &Rows, decided: &Decided) -> Result<Option<Swinging>, Error> {
        let Some(fit) = decided.fit.as_ref().filter(|fit| fit.scale.is_some()) else { return Ok(None) };
        let problem = decided.problem(decided.rows(rows), self.noise[0]);
        let coefficients = self.record.coefficients.len();
        let may: Vec<bool> = decided.model.constant.iter().map(|&one| one < coefficients).collect();
        let (noise, instructions) = (self.test_noise(decided), self.options.instructions);
        swinging(&problem, (fit, &may), noise, instructions, &mut self.stages)
    }

    /// Sets all that was tested free where one of them changes, if rows are predicted better then: a parameter that varies beside one that is held
    /// constant needs windows so short that a test sees little, if anything.
    fn set_others_free(&mut self, rows: &Rows, model: &Model, decided: &mut Decided) -> Result<(), Error> {
        let others: Vec<usize> = self.undecided().into_iter().filter(|one| !decided.slow.contains(one)).collect();
        if decided.slow.is_empty() || others.is_empty() {
            return Ok(());
        }
        let mut free = decided.clone();
        free.slow.extend(others);
        self.set_free(rows, model, &mut free, f64::INFINITY)?;
        let least = if decided.error < BADLY { A_LITTLE_BETTER } else { BETTER };
        if free.fit.is_some() && free.error < least * decided.error {
            *decided = free;
        }
        Ok(())
    }

    /// The search for what varies slowly along all of the record, without an end before the last round.
    pub(crate) fn slow_search<'a>(
        &self,
        rows: &'a Rows,
        ordered: &'a Model,
        decided: &'a Decided,
    ) -> slowly_varying::SlowSearch<'a> {
        slowly_varying::SlowSearch {
            rows,
            model: ordered,
            coefficients: decided.slow.len(),
            noise: self.noise[0],
            expected: decided.expected,
            scales: &decided.scales,
            longest: decided.longest,
            hopeless: f64::INFINITY,
            breaks: &[],
            simpler: 1.0,
            instructions: self.options.instructions,
        }
    }

    /// Estimates what varies slowly, and the other constants beside it; with an error that is hopeless, roughly.
    fn set_free(&mut self, rows: &Rows, model: &Model, decided: &mut Decided, hopeless: f64) -> Result<(), Error> {
        let instructions = self.options.instructions;
        let Some(first) = decided.first else { return Ok(()) };
        let rest = model.constant.iter().copied().filter(|one| !decided.slow.contains(one)).collect();
        decided.model = Model { constant: rest, ..model.clone() };
        let ordered = decided.ordered();
        let search = slowly_varying::SlowSearch { hopeless, ..self.slow_search(rows, &ordered, decided) };
        let mut found = slowly_varying::find(&search, first, &mut self.stages)?;
        if !rows.jumps.is_empty() {
            // What jumps may be the inertia as well as the stiffness.
            let simpler = if decided.constants_jump { SIMPLER } else { 1.0 };
            let jumping = slowly_varying::SlowSearch { breaks: &rows.jumps, simpler, ..search };
            let jumping = slowly_varying::find(&jumping, first, &mut self.stages)?;
            // A curve that bends quickly comes near the rows that it was taken from, a jump or not: it is judged by others.
            let predicted = |one: &Option<slowly_varying::SlowCoefficients>| {
                one.as_ref().map_or(f64::INFINITY, |one| one.predicted)
            };
            found = if simpler * predicted(&jumping) < predicted(&found) { jumping } else { found };
        }
        decided.found = found;
        decided.fit = None;
        if let Some(found) = &decided.found {
            decided.model.taken.clone_from(&found.taken);
            let problem = decided.problem(rows, self.noise[0]);
            let (scale, expected) = (Some(found.scale), decided.expected);
            let fit = Fit::new(&problem, scale, expected, instructions, &mut self.stages)?;
            (decided.error, decided.fit) = (found.error, fit);
        }
        Ok(())
    }
}

/// Rows in which the rate of a coefficient that was given as constant, for which they have no column, makes nothing: good enough to tell whether it
/// changes.
fn without_rate(rows: &Rows, coefficient: usize) -> Rows {
    let mut rows = rows.clone();
    rows.regressors[coefficient].companion = vec![0.0; rows.len()];
    rows
}
