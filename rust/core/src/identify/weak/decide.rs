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

    /// Fits again what was fitted before something moved that changes the best length of windows by little, if at all. Returns the fit before. Both may
    /// be sketches.
    pub(crate) fn fit_near(&mut self, chosen: &mut Chosen, model: &Model) -> Result<Option<Decided>, Error> {
        self.best_before = chosen.best_windows();
        let before = chosen.fitted.take();
        let fitted = self.sketch_first(chosen, model);
        self.best_before = None;
        chosen.fitted = Some(fitted?);
        Ok(before)
    }

    /// Fits everything that is not windowed as constant, in windows of the length that predicts best where it is not given.
    pub(crate) fn fit_first(&mut self, chosen: &Chosen, model: &Model) -> Result<Decided, Error> {
        let mut decided = self.sketch_first(chosen, model)?;
        self.complete(&chosen.weak, &mut decided)?;
        Ok(decided)
    }

    /// The same, of many rows only as far as it tells which windows are best and how well they predict.
    pub(crate) fn sketch_first(&mut self, chosen: &Chosen, model: &Model) -> Result<Decided, Error> {
        let rows = &chosen.weak.rows;
        let (covariance, expected) = self.covariance(&chosen.weak, chosen.parameters);
        let mut decided = Decided {
            model: model.clone(),
            slow: Vec::new(),
            found: None,
            fit: None,
            is_sketch: false,
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
            untold_lag: 0.0,
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
        let mut fitted = self.take_sketch(chosen, model)?;
        self.complete(&chosen.weak, &mut fitted)?;
        Ok(fitted)
    }

    /// The same, which may be a sketch.
    pub(crate) fn take_sketch(&mut self, chosen: &mut Chosen, model: &Model) -> Result<Decided, Error> {
        match chosen.fitted.take() {
            Some(fitted) => Ok(fitted),
            None => self.sketch_first(chosen, model),
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
        let mut before: Option<Decided> = None;
        loop {
            if !decided.slow.is_empty() && !std::mem::take(&mut is_free) {
                if decided.found.is_none() {
                    decided.longest = self.swinging(rows, &decided)?.and_then(|one| one.longest);
                }
                self.set_free(rows, &model, &mut decided, f64::INFINITY)?;
                let is_lost = |before: &Decided| decided.is_lost() && decided.error >= before.error;
                if let Some(before) = before.take().filter(is_lost) {
                    // A curve beside which rows are lost explains no difference between parts.
                    decided = before;
                    break;
                }
            }
            let worst = self.test(rows, &mut decided)?;
            let asked = changing.next();
            let is_lost = asked.is_none() && !model.windowed.is_empty() && decided.is_lost();
            // Constants that were set free together for nothing in this round.
            let mut in_vain = Vec::new();
            let may_vary = self.most_slow.is_none_or(|most| decided.slow.len() < most);
            if worst.is_some() && is_lost && may_vary {
                is_free = self.set_contradicted_free(rows, &model, &mut decided, &mut in_vain)?;
                if is_free {
                    continue;
                }
            }
            let worst = worst.filter(|_| !(is_lost && may_vary));
            let Some(worst) = asked.or(worst) else {
                if self.most_slow == Some(decided.slow.len()) && decided.error >= BADLY {
                    // Nothing more may vary that would predict well.
                    break;
                }
                if let Some(free) = self.swinging_beside_constants(chosen, &model, &mut decided)? {
                    (model, decided) = (Cow::Owned(free.model.clone()), free);
                    continue;
                }
                is_free = self.set_unsteady_free(rows, &model, &mut decided, in_vain)?;
                if is_free {
                    continue;
                }
                break;
            };
            if model.windowed.is_empty() {
                let Some(free) = self.in_windows((&chosen.weak, chosen.parameters), &model, &decided, worst)? else {
                    break;
                };
                (model, decided) = (Cow::Owned(free.model.clone()), free);
            } else {
                before = asked.is_none().then(|| decided.clone());
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
        let alone = decided.model.windowed.is_empty() && self.options.averaging;
        let may = fit.scale.is_some() || alone;
        Ok(self.contradicted(decided).first().copied().filter(|_| may))
    }

    /// The constants that parts of the record contradict and that may be set free, those first that differ most.
    pub(crate) fn contradicted(&self, decided: &Decided) -> Vec<usize> {
        let tested = self.undecided();
        let contradicted = decided.tests.iter().filter(|(one, test)| {
            tested.contains(one) && !decided.slow.contains(one) && test.probability < constancy::NO_CHANCE
        });
        let mut contradicted: Vec<_> = contradicted.collect();
        contradicted.sort_by(|a, b| {
            let by_excess = b.1.excess().total_cmp(&a.1.excess());
            a.1.probability.total_cmp(&b.1.probability).then(by_excess)
        });
        contradicted.into_iter().map(|(one, _)| *one).collect()
    }

    /// The noise that parts of the record are compared with.
    pub(crate) fn test_noise<'a>(&self, decided: &'a Decided) -> TestNoise<'a> {
        let is_raised = self.noise != self.channel_noise;
        TestNoise {
            expected: decided.expected,
            covariance: &decided.covariance,
            inflation: decided.inflation(),
            from: if is_raised || self.is_rounding { NoiseFrom::Equations } else { NoiseFrom::Channels },
            equations: 1,
        }
    }

    /// By how much inertia, damping and stiffness grow along the record where they are constants and something is windowed beside them: blocks lose
    /// what windows take.
    pub(crate) fn trends(&mut self, rows: &Rows, decided: &Decided, fit: &Fit) -> Result<Vec<Option<Trend>>, Error> {
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
            inflation: decided.inflation(),
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
}
