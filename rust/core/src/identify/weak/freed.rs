//! Setting constants free: those that grow, that swing, or that all change beside one that does.

use std::borrow::Cow;

use crate::equation::rows::Rows;
use crate::error::Error;
use crate::identify::weak::choice::Chosen;
use crate::identify::weak::decide::{BADLY, BETTER};
use crate::identify::weak::decided::Decided;
use crate::identify::weak::session::Session;
use crate::inference::constancy::Test;
use crate::inference::part_constants::TestNoise;
use crate::inference::short_parts::{MORE_THAN_NOISE, Swinging, swinging};
use crate::inference::slow_lengths::SlowSearch;
use crate::inference::slowly_varying::{self, EXPLAINED};
use crate::regression::fit::Fit;
use crate::regression::limits::NOISE_MODEL_FAILS;
use crate::regression::model::Model;
use crate::regression::residuals::residuals;
use crate::weak_form::weak_rows::WeakRows;

/// The part of the mean squared error of predicting rows that must be left where no test of parts says that anything changes.
const FAR_BETTER: f64 = 0.5;
/// The same where rows are predicted well and another changes: of constants that are set free beside it for nothing .96 is left at least.
pub(crate) const A_LITTLE_BETTER: f64 = 0.9;

/// As `LEFT_OF_SWINGS`, in windows beside constants alone: what makes a stiffness or a damping of a spring that hardens or a drag leaves .21 and more.
const LEFT_IN_WINDOWS: f64 = 0.15;

/// Of what several constants together leave, one of them may seem to leave less by this factor: their curves differ.
pub(crate) const NO_LESS: f64 = 1.5;

/// The part that is left after the first round of a search where [`EXPLAINED`] may be left in the end, from which on others come to nothing.
const COMES_TO_NOTHING: f64 = 0.7;

/// Where constants jump, those that do not change in between stand unless others predict so much better.
const SIMPLER: f64 = 0.98;

impl Session<'_, '_, '_> {
    /// Sets the constant free that seems to grow most where rows are predicted badly, if that leaves far less, or else the one that swings most, if that
    /// leaves hardly more than noise: whatever is missing from an equation follows a curve a little. Returns whether it was. One that was given as
    /// constant is contradicted. What was set free in vain is not tried again.
    pub(crate) fn set_unsteady_free(
        &mut self,
        rows: &Rows,
        model: &Model,
        decided: &mut Decided,
        mut in_vain: Vec<Vec<usize>>,
    ) -> Result<bool, Error> {
        let Some(fit) = decided.fit.as_ref().filter(|fit| fit.scale.is_some()) else { return Ok(false) };
        if !decided.slow.is_empty() {
            return Ok(false);
        }
        let growing = if decided.error < BADLY { None } else { self.growing(rows, decided, fit)? };
        let swinging = self.swinging(rows, decided)?;
        decided.longest = swinging.as_ref().and_then(|one| one.longest);
        if let Some(growing) = growing {
            let free = self.freed(rows, model, decided, (&[growing], hopeless(decided)))?;
            let most = if decided.is_lost() { EXPLAINED } else { FAR_BETTER };
            if free.error < most * decided.error {
                *decided = free;
                return Ok(true);
            }
            if decided.is_lost() {
                in_vain.push(vec![growing]);
            }
        }
        match swinging {
            Some(swinging) => self.set_swinging_free(rows, model, decided, (swinging, &in_vain)),
            None => Ok(false),
        }
    }

    /// Sets constants free that parts of the record contradict where hardly a row is within the noise: there parts differ by whatever is missing from the
    /// equation, and only a constant that explains most of that changes. The one is set free that leaves least, or all of them together, for two that
    /// change hide each other. Where all of them explain next to nothing, one of them explains no more. Returns whether one was, and adds those that were
    /// tried in vain.
    pub(crate) fn set_contradicted_free(
        &mut self,
        rows: &Rows,
        model: &Model,
        decided: &mut Decided,
        in_vain: &mut Vec<Vec<usize>>,
    ) -> Result<bool, Error> {
        let contradicted = self.contradicted(decided);
        if decided.found.is_none() {
            decided.longest = self.swinging(rows, decided)?.and_then(|one| one.longest);
        }
        let may = self.most_slow.is_none_or(|most| decided.slow.len() + contradicted.len() <= most);
        let all = (may && contradicted.len() > 1).then_some(contradicted.as_slice());
        let most = EXPLAINED * decided.error;
        let all_free = all.map(|all| self.freed(rows, model, decided, (all, hopeless(decided)))).transpose()?;
        let mut best: Option<Decided> = None;
        // Swings must leave less than what is asked here.
        let explain_nothing = |free: &Decided| free.fit.is_some() && free.error >= NO_LESS * most;
        if let Some(all) = all.filter(|_| all_free.as_ref().is_some_and(explain_nothing)) {
            in_vain.push(all.to_vec());
            return Ok(false);
        }
        for constants in contradicted.chunks(1) {
            let free = self.freed(rows, model, decided, (constants, hopeless(decided)))?;
            best = best.filter(|best| best.error.total_cmp(&free.error).is_le()).or(Some(free));
            if best.as_ref().is_some_and(|best| best.error < BADLY) {
                break;
            }
        }
        let explains = |free: &Decided| free.error < most;
        if let Some(free) = best.filter(explains).or(all_free.filter(explains)) {
            *decided = free;
            return Ok(true);
        }
        in_vain.extend(contradicted.chunks(1).chain(all).map(<[usize]>::to_vec));
        Ok(false)
    }

    /// What a record is where one of its constants is followed in windows, as a stiffness is, beside the others alone; `None` where that is not determined.
    pub(crate) fn in_windows(
        &mut self,
        (weak, parameters): (&WeakRows, [f64; 3]),
        model: &Model,
        decided: &Decided,
        one: usize,
    ) -> Result<Option<Decided>, Error> {
        let constant = model.constant.iter().copied().filter(|&other| other != one).collect();
        let model = Model { windowed: vec![one], constant, linear: self.options.linear, ..Model::default() };
        let mut free = Decided { model, white: None, correlated: None, ..decided.clone() };
        (free.covariance, free.expected) = self.covariance(weak, parameters);
        self.fit_constants(weak, &mut free)?;
        self.complete(weak, &mut free)?;
        Ok(Some(free).filter(|free| free.fit.is_some()))
    }

    /// Follows the constant in windows that swings where there are constants alone, the one of several that leaves least so, if that is hardly more than
    /// noise. One that was given as constant is contradicted.
    pub(crate) fn swinging_beside_constants(
        &mut self,
        chosen: &Chosen,
        model: &Model,
        decided: &mut Decided,
    ) -> Result<Option<Decided>, Error> {
        let (weak, undecided) = (&chosen.weak, self.undecided());
        let (left, found) = self.swinging_alone(weak, decided)?;
        let mut best: Option<(Decided, usize, Test)> = None;
        for Swinging { constant, test, .. } in found {
            let swinging = decided.model.constant[constant];
            let weak = if undecided.contains(&swinging) {
                Cow::Borrowed(weak)
            } else {
                Cow::Owned(weak.with(without_rate(&weak.rows, swinging)))
            };
            let free = self.in_windows((&weak, chosen.parameters), model, decided, swinging)?;
            let is_better = |free: &Decided| best.as_ref().is_none_or(|(best, ..)| free.error < best.error);
            best = free.filter(is_better).map(|free| (free, swinging, test)).or(best);
        }
        let Some((free, swinging, mut test)) = best else { return Ok(None) };
        let [before, after] = [(left, &*decided), (free.error, &free)].map(|(left, one)| left * self.raised(weak, one));
        if free.error >= NOISE_MODEL_FAILS || after - 1.0 >= LEFT_IN_WINDOWS * (before - 1.0) {
            return Ok(None);
        }
        if undecided.contains(&swinging) {
            return Ok(Some(free));
        }
        let usable = weak.rows.usable.iter().filter(|usable| **usable).count() as f64;
        let values = free.fit.as_ref().map_or_else(Vec::new, |fit| fit.values(0));
        let predicted = Test::of_prediction(before / after, usable / free.expected.variance_inflation, &values);
        test.probability = test.probability.min(predicted.probability);
        decided.tests.retain(|(one, _)| *one != swinging);
        decided.tests.push((swinging, test));
        Ok(None)
    }

    /// What constants alone leave of rows, over the noise's variance, and those of the motion that differ between short parts of the record by more than
    /// that, where it is more than noise.
    fn swinging_alone(&mut self, weak: &WeakRows, decided: &Decided) -> Result<(f64, Vec<Swinging>), Error> {
        let alone = |_: &&Fit| decided.model.windowed.is_empty() && self.options.averaging;
        let Some(fit) = decided.fit.as_ref().filter(alone) else { return Ok((1.0, Vec::new())) };
        let problem = decided.problem(decided.rows(&weak.rows), self.noise[0]);
        let (left, usable) = residuals(&problem, fit, &mut self.stages)?;
        let count = usable.iter().filter(|usable| **usable).count().max(1) as f64;
        let left = left.iter().map(|left| left * left).sum::<f64>() / count / decided.expected.variance;
        if left * self.raised(weak, decided) < MORE_THAN_NOISE {
            return Ok((left, Vec::new()));
        }
        let may = self.of_motion(decided);
        let noise = TestNoise { inflation: left.max(1.0), ..self.test_noise(decided) };
        Ok((left, swinging(&problem, (fit, &may), noise, self.options.instructions, &mut self.stages)?))
    }

    /// Which of the constants are of the motion.
    pub(crate) fn of_motion(&self, decided: &Decided) -> Vec<bool> {
        let coefficients = self.record.coefficients.len();
        decided.model.constant.iter().map(|&one| one < coefficients).collect()
    }

    /// What a record is with some of its constants set free, or roughly where it is hopeless; the error is infinite where that is not determined.
    pub(crate) fn freed(
        &mut self,
        rows: &Rows,
        model: &Model,
        decided: &Decided,
        (constants, hopeless): (&[usize], f64),
    ) -> Result<Decided, Error> {
        let mut free = decided.clone();
        free.slow.extend_from_slice(constants);
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
        // What parts contradict was tried before.
        let may = |one: &usize| undecided.contains(one) && !decided.differs(*one);
        let growing = growing.filter(|(one, trend)| may(one) && trend.is_conspicuous());
        let most = growing.max_by(|a, b| a.1.excess().total_cmp(&b.1.excess()));
        Ok(most.map(|(most, _)| most))
    }

    /// Sets all that was tested free where one of them changes, if rows are predicted better then: a parameter that varies beside one that is held
    /// constant needs windows so short that a test sees little, if anything.
    pub(crate) fn set_others_free(&mut self, rows: &Rows, model: &Model, decided: &mut Decided) -> Result<(), Error> {
        let others: Vec<usize> = self.undecided().into_iter().filter(|one| !decided.slow.contains(one)).collect();
        if decided.slow.is_empty() || others.is_empty() {
            return Ok(());
        }
        let mut free = decided.clone();
        free.slow.extend(others);
        self.set_free(rows, model, &mut free, f64::INFINITY)?;
        let least = match decided.error {
            error if error < BADLY => A_LITTLE_BETTER,
            error if error < NOISE_MODEL_FAILS => BETTER,
            _ => EXPLAINED,
        };
        if free.fit.is_some() && free.error < least * decided.error {
            *decided = free;
        }
        Ok(())
    }

    /// The search for what varies slowly along all of the record, without an end before the last round.
    pub(crate) fn slow_search<'a>(&self, rows: &'a Rows, ordered: &'a Model, decided: &'a Decided) -> SlowSearch<'a> {
        SlowSearch {
            rows,
            model: ordered,
            coefficients: decided.slow.len(),
            noise: self.noise[0],
            expected: decided.expected,
            scales: &decided.scales,
            longest: decided.longest,
            before: decided.error,
            hopeless: f64::INFINITY,
            breaks: &[],
            simpler: 1.0,
            instructions: self.options.instructions,
        }
    }

    /// Estimates what varies slowly, and the other constants beside it; with an error that is hopeless, roughly.
    pub(crate) fn set_free(
        &mut self,
        rows: &Rows,
        model: &Model,
        decided: &mut Decided,
        hopeless: f64,
    ) -> Result<(), Error> {
        let instructions = self.options.instructions;
        let Some(first) = decided.first else { return Ok(()) };
        let rest = model.constant.iter().copied().filter(|one| !decided.slow.contains(one)).collect();
        decided.model = Model { constant: rest, ..model.clone() };
        let ordered = decided.ordered();
        let search = SlowSearch { hopeless, ..self.slow_search(rows, &ordered, decided) };
        let mut found = slowly_varying::find(&search, first, &mut self.stages)?;
        if !rows.jumps.is_empty() {
            // What jumps may be the inertia as well as the stiffness.
            let simpler = if decided.constants_jump { SIMPLER } else { 1.0 };
            let jumping = SlowSearch { breaks: &rows.jumps, simpler, ..search };
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

/// The error after the first round of a search from which on it is not worth another: only where constants must explain most of what is left.
fn hopeless(decided: &Decided) -> f64 {
    if decided.is_lost() { COMES_TO_NOTHING * decided.error } else { f64::INFINITY }
}

/// Rows in which the rate of a coefficient that was given as constant, for which they have no column, makes nothing: good enough to tell whether it
/// changes.
pub(crate) fn without_rate(rows: &Rows, coefficient: usize) -> Rows {
    let mut rows = rows.clone();
    rows.regressors[coefficient].companion = vec![0.0; rows.len()];
    rows
}
