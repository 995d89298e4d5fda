//! What a record says of its unknowns: over which length windows should reach, and what is constant.

use std::sync::Arc;

use crate::equation::rows::Rows;
use crate::error::Error;
use crate::exec::stages::Stages;
use crate::identify::weak::session::{Chosen, Kind, Session};
use crate::inference::constancy::{self, Test, chi_squared_beyond};
use crate::inference::cross_validation::{Validated, best, validate};
use crate::inference::jumps::jump::{Jump, JumpSearch};
use crate::inference::jumps::search;
use crate::inference::slowly_varying;
use crate::record::derived::{Ones, Whole};
use crate::record::samples::Samples;
use crate::regression::constants::{Expected, misfits};
use crate::regression::fit::Fit;
use crate::regression::limits::NOISE_MODEL_FAILS;
use crate::regression::model::Model;
use crate::regression::predictor::without_constants;
use crate::regression::problem::{Correlated, Problem};
use crate::regression::residuals::residuals;
use crate::regression::row_covariance::RowCovariance;
use crate::regression::subsample::{holds, stretches_of_rows, thinned_rows};
use crate::regression::whitening::Whitening;
use crate::regression::window_length::Scale;
use crate::weak_form::weak_rows::{Record, TermSamples, WeakRows};

/// The mean squared error of predicting rows, over the noise's, from which on more is tried, and the part of it that must be left to be
/// worth it.
const BADLY: f64 = 1.5;
const BETTER: f64 = 0.8;

/// So many of the longest windows that stretches of a long record hold are tried again on all of it, where one of them is best.
const OVERLAP: usize = 2;

/// Rounds of making rows white with the parameters that the last one gave.
const WHITENINGS: usize = 2;

/// Correlations of white rows that chance gives so rarely are none, where their squares add up to more than this part.
const NOT_WHITE: f64 = 1e-4;
const NEARLY_WHITE: f64 = 0.01;

/// Constants of weighted equations and of those that count alike differ by more than chance beyond so many standard deviations, whose square
/// is at least this part of the variance.
const DIFFERENT: f64 = 3.5;
const LEAST_DIFFERENCE: f64 = 0.05;

/// Rounds of looking for jumps and fitting again with windows that end there.
const JUMP_ROUNDS: usize = 4;

/// Lengths of windows, from the best one on and each twice the last, that jumps are looked for with.
const JUMP_SCALES: usize = 3;

/// What was decided, and the fit it rests on.
#[derive(Clone)]
pub(crate) struct Decided {
    /// What is windowed and what is constant.
    pub(crate) model: Model,
    /// Constants that turned out to change.
    pub(crate) slow: Vec<usize>,
    pub(crate) found: Option<slowly_varying::Found>,
    /// Nothing where the constants are not determined.
    pub(crate) fit: Option<Fit>,
    /// The length of windows that predicts best while nothing changes slowly. What changes is looked for from there: windows that were chosen while
    /// too little was free are so short that nothing else is found from them.
    first: Option<Scale>,
    /// Mean squared error of predicting a row from others, over the noise's.
    pub(crate) error: f64,
    pub(crate) tests: Vec<(usize, Test)>,
    /// Lengths that were tried, in samples, and the error of each.
    pub(crate) lengths: Vec<(usize, f64)>,
    pub(crate) scales: Vec<Scale>,
    pub(crate) covariance: RowCovariance,
    /// What it makes of the windowed regressors, once a fit was made with it.
    pub(crate) correlated: Option<Arc<Correlated>>,
    pub(crate) expected: Expected,
    /// Where what is windowed jumps.
    pub(crate) jumps: Vec<Jump>,
    /// All rows, also those over jumps; nothing without jumps.
    pub(crate) whole: Option<Rows>,
    /// Rows whose noise is white, and how they were made so, where the constants were taken from them.
    pub(crate) white: Option<(Rows, Whitening)>,
}

/// How many rows lie in so many samples.
pub(crate) fn rows_of(samples: usize, stride: usize) -> usize {
    ((samples + stride / 2) / stride).max(1)
}

impl Decided {
    /// The rows that the fit was made with.
    pub(crate) fn rows<'a>(&'a self, rows: &'a Rows) -> &'a Rows {
        self.white.as_ref().map_or(rows, |(white, _)| white)
    }

    /// Other rows of the record, made as white as those that the fit was made with.
    pub(crate) fn as_white(&self, rows: Rows, stages: &mut Stages<'_, '_>) -> Result<Rows, Error> {
        match &self.white {
            Some((_, whitening)) => whitening.apply(&rows, stages),
            None => Ok(rows),
        }
    }

    /// The right-hand side without what changes slowly.
    pub(crate) fn rhs<'a>(&'a self, rows: &'a Rows) -> &'a [f64] {
        self.found.as_ref().map_or(&rows.rhs, |found| &found.rhs)
    }

    /// The equations for what does not change slowly. `noise` is the variance of the angle's.
    fn problem<'a>(&'a self, rows: &'a Rows, noise: f64) -> Problem<'a> {
        self.model.problem(rows, self.rhs(rows), noise, self.correlated.as_ref())
    }

    /// The model with what changes slowly before the other constants.
    pub(crate) fn ordered(&self) -> Model {
        let constant = self.slow.iter().chain(&self.model.constant).copied().collect();
        Model { constant, ..self.model.clone() }
    }
}

impl Session<'_, '_, '_> {
    /// Chooses the length of windows where it is not given, tests what is constant, and finds jumps of what is windowed.
    pub(crate) fn decide(&mut self, chosen: &mut Chosen, model: &Model) -> Result<Decided, Error> {
        let (mut jumps, mut whole, mut round) = (Vec::new(), None, 0);
        loop {
            let mut decided = self.decide_kinds(chosen, model)?;
            let found = if round < JUMP_ROUNDS {
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
            let (function, rows) = (&weak.kernels.values[2], weak.rows.len());
            weak.rows.exclude(search::rows_over(&found, function, weak.first, weak.stride, rows));
            weak.rows.jumps = found.iter().map(|jump| (jump.sample - weak.first).div_ceil(weak.stride)).collect();
            (jumps, round) = (found, round + 1);
        }
    }

    /// Chooses the length of windows where it is not given, and tests what is constant.
    fn decide_kinds(&mut self, chosen: &Chosen, model: &Model) -> Result<Decided, Error> {
        let rows = &chosen.weak.rows;
        let (covariance, expected) = self.covariance(&chosen.weak, chosen.parameters);
        let mut decided = Decided {
            model: model.clone(),
            slow: Vec::new(),
            found: None,
            fit: None,
            first: None,
            error: 1.0,
            tests: Vec::new(),
            lengths: Vec::new(),
            scales: Vec::new(),
            covariance,
            correlated: None,
            expected,
            jumps: Vec::new(),
            whole: None,
            white: None,
        };
        if self.options.average {
            decided.scales = Scale::all(rows.len(), chosen.weak.reach());
        }
        self.fit_constants(&chosen.weak, &mut decided)?;
        decided.slow = self.of_kind(Kind::Varying);
        loop {
            if !decided.slow.is_empty() {
                self.set_free(rows, model, &mut decided)?;
            }
            let Some(worst) = self.test(rows, &mut decided)? else { break };
            decided.slow.push(worst);
        }
        self.set_others_free(rows, model, &mut decided)?;
        Ok(decided)
    }

    /// Tests every constant. Returns the one that differs most between the parts of the record, if it may be set free.
    fn test(&mut self, rows: &Rows, decided: &mut Decided) -> Result<Option<usize>, Error> {
        let Some(fit) = &decided.fit else { return Ok(None) };
        let problem = decided.problem(decided.rows(rows), self.noise[0]);
        let (expected, inflation) = (decided.expected, decided.error.max(1.0));
        let instructions = self.options.instructions;
        let results =
            constancy::test(&problem, fit, expected, &decided.covariance, inflation, instructions, &mut self.stages)?;
        // Tests of what was set free before stand as they were.
        decided.tests.retain(|(one, _)| decided.slow.contains(one));
        let constants = decided.model.constant.iter().zip(results);
        decided.tests.extend(constants.filter_map(|(&one, test)| test.map(|test| (one, test))));
        let tested = self.of_kind(Kind::Tested);
        let conspicuous = decided.tests.iter().filter(|(one, test)| {
            tested.contains(one) && !decided.slow.contains(one) && test.probability < constancy::NO_CHANCE
        });
        let worst = conspicuous.min_by(|a, b| a.1.probability.total_cmp(&b.1.probability)).map(|(one, _)| *one);
        Ok(worst.filter(|_| fit.scale.is_some()))
    }

    /// Sets all that was tested free where one of them changes and yet the rows are predicted badly: what changes beside what is held
    /// constant needs windows so short that a test sees nothing.
    fn set_others_free(&mut self, rows: &Rows, model: &Model, decided: &mut Decided) -> Result<(), Error> {
        let others: Vec<usize> =
            self.of_kind(Kind::Tested).into_iter().filter(|one| !decided.slow.contains(one)).collect();
        if decided.slow.is_empty() || others.is_empty() || decided.error < BADLY {
            return Ok(());
        }
        let mut free = decided.clone();
        free.slow.extend(others);
        self.set_free(rows, model, &mut free)?;
        if free.fit.is_some() && free.error < BETTER * decided.error {
            *decided = free;
        }
        Ok(())
    }

    /// Regressors of the unknowns of a kind.
    fn of_kind(&self, kind: Kind) -> Vec<usize> {
        let unknowns = self.unknowns();
        unknowns.iter().zip(&self.options.kinds).filter(|(_, one)| **one == kind).map(|(index, _)| *index).collect()
    }

    /// Fits everything that is not windowed as constant, in windows of the length that predicts best. What the noise makes of rows depends on
    /// the parameters, so a first fit gives those that the last one is made with.
    fn fit_constants(&mut self, weak: &WeakRows, decided: &mut Decided) -> Result<(), Error> {
        let (rows, stride) = (&weak.rows, weak.stride);
        let instructions = self.options.instructions;
        let model = decided.model.clone();
        let wanted = self.options.equations.map(|samples| rows_of(samples, stride));
        if model.windowed.is_empty() || !self.options.average {
            let window = wanted.unwrap_or(rows.len()).min(rows.len());
            for last in [false, true] {
                let correlated = model.correlated(rows, &decided.covariance, &mut self.stages)?;
                let problem = model.problem(rows, &rows.rhs, self.noise[0], Some(&correlated));
                decided.correlated = Some(correlated);
                decided.fit = if model.windowed.is_empty() {
                    Fit::new(&problem, None, decided.expected, instructions, &mut self.stages)?
                } else {
                    Fit::in_rows(&problem, window, decided.expected, instructions)
                };
                let Some(fit) = &decided.fit else { return Ok(()) };
                if !model.windowed.is_empty() {
                    let misfits = misfits(&fit.full, &(0..fit.full.len()), &fit.pooled.values, decided.expected);
                    decided.error = misfits.iter().sum::<f64>() / misfits.len().max(1) as f64;
                }
                if !last {
                    (decided.covariance, decided.expected) = self.covariance(weak, self.parameters(&model, fit));
                }
            }
            let weighted = self.options.average && self.of_kind(Kind::Varying).is_empty();
            return if weighted { self.whiten(weak, decided) } else { Ok(()) };
        }
        let scales = &decided.scales;
        let tried = match wanted {
            Some(wanted) => scales[Scale::nearest(scales, wanted).ok_or(self.too_short())?..][..1].to_vec(),
            None => scales.clone(),
        };
        if tried.is_empty() {
            return Err(self.too_short());
        }
        let validated = self.validate(rows, decided, &tried)?;
        let span = |one: &Validated| one.fit.scale.map_or(0, |scale| scale.span() * stride);
        decided.lengths = validated.iter().map(|one| (span(one), one.error)).collect();
        // Where no row can be predicted any length is as good, and the longest tells most.
        let Some(best) = best(&validated).or(validated.last()) else { return Ok(()) };
        decided.error = if best.error.is_finite() { best.error } else { 1.0 };
        (decided.covariance, decided.expected) = self.covariance(weak, self.parameters(&model, &best.fit));
        let scale = best.fit.scale;
        decided.first = scale;
        drop(validated);
        let correlated = model.correlated(rows, &decided.covariance, &mut self.stages)?;
        let problem = model.problem(rows, &rows.rhs, self.noise[0], Some(&correlated));
        decided.correlated = Some(correlated);
        decided.fit = Fit::new(&problem, scale, decided.expected, instructions, &mut self.stages)?;
        Ok(())
    }

    /// Takes constants from rows whose noise is white, as long as the noise of the channels explains what is left: if something else does, it
    /// need not be where that noise is.
    fn whiten(&mut self, weak: &WeakRows, decided: &mut Decided) -> Result<(), Error> {
        let (rows, instructions) = (&weak.rows, self.options.instructions);
        if self.explained(weak, decided)?.is_none() {
            return Ok(());
        }
        let expected = Expected { variance: 1.0, torque: 1.0, variance_inflation: 1.0 };
        let mut white = Decided { covariance: RowCovariance::white(), expected, correlated: None, ..decided.clone() };
        for _ in 0..WHITENINGS {
            let Some(fit) = &white.fit else { return Ok(()) };
            let (covariance, _) = self.covariance(weak, self.parameters(&white.model, fit));
            let Some(whitening) = Whitening::new(&covariance, rows, weak.stride) else { return Ok(()) };
            let made = whitening.apply(rows, &mut self.stages)?;
            let problem = white.model.problem(&made, &made.rhs, self.noise[0], None);
            white.fit = Fit::new(&problem, None, expected, instructions, &mut self.stages)?;
            white.white = Some((made, whitening));
        }
        if self.is_white(weak, &white)? && self.agree(rows, decided, &white)? {
            *decided = white;
        }
        Ok(())
    }

    /// Whether what is left of white rows is white, as far as it matters and chance allows (Box and Pierce 1970).
    fn is_white(&mut self, weak: &WeakRows, white: &Decided) -> Result<bool, Error> {
        let Some(shown) = self.explained(weak, white)? else { return Ok(false) };
        let usable = weak.rows.usable.iter().filter(|usable| **usable).count() as f64;
        let (squares, lags) = (usable * shown.squared_correlations(), shown.lags.len() - 1);
        Ok(chi_squared_beyond(squares, lags) > NOT_WHITE || squares - (lags as f64) < NEARLY_WHITE * usable)
    }

    /// The covariance of what a fit leaves, where the noise of the channels explains it.
    fn explained(&mut self, weak: &WeakRows, decided: &Decided) -> Result<Option<RowCovariance>, Error> {
        let Some(fit) = &decided.fit else { return Ok(None) };
        let (shown, coloured) = self.shown(weak, decided, fit)?;
        let explained = !coloured && shown.variance() <= NOISE_MODEL_FAILS * decided.expected.variance;
        Ok(explained.then_some(shown))
    }

    /// Whether constants from rows as they are and from white ones differ by no more than chance (Hausman 1978).
    fn agree(&mut self, rows: &Rows, alike: &Decided, white: &Decided) -> Result<bool, Error> {
        let mut variances = Vec::new();
        for one in [alike, white] {
            let Some(fit) = &one.fit else { return Ok(false) };
            let problem = one.problem(one.rows(rows), self.noise[0]);
            variances.push((fit.covariance(&problem, &one.covariance, &mut self.stages)?, &fit.pooled.values));
        }
        let count = alike.model.constant.len();
        let [(all, values), (least, others)] = &variances[..] else { return Ok(false) };
        Ok((0..count).all(|constant| {
            let (all, least) = (all[constant * (count + 1)], least[constant * (count + 1)]);
            // What is efficient is not correlated with its difference from what is not.
            let variance = (all - least).max(LEAST_DIFFERENCE * all);
            (values[constant] - others[constant]).powi(2) <= DIFFERENT * DIFFERENT * variance
        }))
    }

    /// How well windows of some lengths predict what they have not seen: on stretches of a long record as far as they hold windows so
    /// long, and on all of it beyond where the longest of those are best.
    fn validate(&mut self, rows: &Rows, decided: &Decided, scales: &[Scale]) -> Result<Vec<Validated>, Error> {
        let (instructions, expected) = (self.options.instructions, decided.expected);
        let mut validated = |rows: &Rows, scales: &[Scale]| {
            let correlated = decided.model.correlated(rows, &decided.covariance, &mut self.stages)?;
            let problem = decided.model.problem(rows, &rows.rhs, self.noise[0], Some(&correlated));
            validate(&problem, scales, expected, instructions, &mut self.stages)
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
            // The stretches miss the few rows that there are.
            None => validated(rows, scales),
        }
    }

    /// Finds jumps of what is windowed beside those that are known. `whole` holds all rows where some are over jumps.
    fn find_jumps(
        &mut self,
        weak: &WeakRows,
        decided: &Decided,
        known: &[Jump],
        whole: Option<&Rows>,
    ) -> Result<Vec<Jump>, Error> {
        if decided.error > NOISE_MODEL_FAILS {
            // What is left is more than noise everywhere, so it tells nothing of jumps.
            return Ok(known.to_vec());
        }
        let signals = signals(&self.record, &decided.model).filter(|_| self.options.average);
        let (Some(signals), Some(fit)) = (signals, &decided.fit) else { return Ok(known.to_vec()) };
        let signals: Vec<&dyn Samples> = signals.iter().map(|signal| &**signal).collect();
        let (constants, noise) = (&fit.pooled.values, self.noise[0]);
        let problem = decided.problem(&weak.rows, noise);
        let rest_rhs = without_constants(&problem, constants);
        let rest = decided.model.without_constants(&weak.rows, &problem, &rest_rhs, constants, noise);
        let whole = whole.unwrap_or(&weak.rows);
        let rhs = match &decided.found {
            Some(found) => slowly_varying::without(whole, &decided.slow, &found.varying),
            None => whole.rhs.clone(),
        };
        let whole = decided.model.problem(whole, &rhs, noise, None);
        let best = decided.scales.iter().position(|scale| Some(*scale) == fit.scale).unwrap_or(0);
        let alone = decided.scales[best..].iter().filter(|scale| scale.stands_alone());
        let lengths: Vec<Scale> = alone.step_by(2).take(JUMP_SCALES).copied().collect();
        let search = JumpSearch {
            problem: &rest,
            whole: &whole,
            rhs: &without_constants(&whole, constants),
            signals: &signals,
            function: &weak.kernels.values[2],
            first: weak.first,
            stride: weak.stride,
            expected: decided.expected,
            inflation: decided.error.max(1.0),
            scales: &decided.scales,
            lengths: &lengths,
            instructions: self.options.instructions,
        };
        search.find(&residuals(&problem, fit, &mut self.stages)?.0, known, &mut self.stages)
    }

    /// Finds what changes slowly, and the other constants beside it.
    fn set_free(&mut self, rows: &Rows, model: &Model, decided: &mut Decided) -> Result<(), Error> {
        let instructions = self.options.instructions;
        let Some(first) = decided.first else { return Ok(()) };
        let rest = model.constant.iter().copied().filter(|one| !decided.slow.contains(one)).collect();
        decided.model = Model { constant: rest, ..model.clone() };
        let ordered = decided.ordered();
        let slow = decided.slow.len();
        let search = slowly_varying::SlowSearch {
            rows,
            model: &ordered,
            coefficients: slow,
            noise: self.noise[0],
            expected: decided.expected,
            scales: &decided.scales,
            instructions,
        };
        decided.found = slowly_varying::find(&search, first, &mut self.stages)?;
        decided.fit = None;
        if let Some(found) = &decided.found {
            let problem = decided.problem(rows, self.noise[0]);
            let (scale, expected) = (Some(found.scale), decided.expected);
            let fit = Fit::new(&problem, scale, expected, instructions, &mut self.stages)?;
            (decided.error, decided.fit) = (found.error, fit);
        }
        Ok(())
    }
}

/// What the windowed unknowns multiply, sample by sample; nothing where there are none or jumps of one would act through a derivative.
fn signals<'a>(record: &Record<'a>, model: &Model) -> Option<Vec<Box<dyn Samples + 'a>>> {
    if model.windowed.is_empty() {
        return None;
    }
    let of = |&index: &usize| -> Option<Box<dyn Samples + 'a>> {
        match index.checked_sub(2)? {
            0 => Some(Box::new(Whole(record.angle))),
            term => match record.terms[term - 1] {
                TermSamples::One => Some(Box::new(Ones(record.angle.len()))),
                TermSamples::Given(samples) => Some(Box::new(Whole(samples))),
                TermSamples::TorqueRate => None,
            },
        }
    };
    model.windowed.iter().map(of).collect()
}
