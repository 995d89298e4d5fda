//! Setting constants free: those that differ between parts of the records, that swing, or without which too much is left.

use crate::error::Error;
use crate::identify::merged::decided::MergedFit;
use crate::identify::merged::session::MergedSession;
use crate::identify::merged::shown::SHOWN;
use crate::identify::merged::swings::Swing;
use crate::identify::weak::shown_noise::MORE;
use crate::inference::constancy::{self, Test};
use crate::inference::short_parts::{LEFT_OF_SWINGS, MORE_THAN_NOISE};
use crate::regression::limits::NOISE_MODEL_FAILS;
use crate::regression::model::Model;

/// What was constant is windowed from here on only if rows are predicted at least so much better.
const BETTER: f64 = 0.98;
/// What no test shows to change is windowed only if rows are predicted so much better: it is what the equations lack.
const LACKING: f64 = 0.5;
/// So many times the noise of the channels is hardly noise.
const NO_NOISE: f64 = 50.0;

/// Constants that differ between parts of the record which are set free for a trial, those that differ most.
const TRIED: usize = 3;

/// Mean squared error of predicting a row, over the noise's, up to which nothing else changes.
const WELL: f64 = 1.3;

/// Why a constant is tried in windows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Sought {
    /// It differs between parts of the record.
    Differing,
    /// It differs between short parts all over it alone, and windows leave less than so much of rows, over the noise's variance.
    Swinging(f64),
    /// Constants leave so much that no part can differ by more.
    Hidden,
}

/// The elements' values and the equations' misfits that weights are made of.
pub(crate) type Guess = (Vec<f64>, Vec<f64>);

/// A constant that windows follow, and what weights are made of beside it.
pub(crate) struct Freed {
    pub(crate) one: usize,
    pub(crate) found: MergedFit,
    pub(crate) guess: Guess,
}

impl MergedSession<'_, '_, '_> {
    /// Constants that differ between short parts alone, and what windows that follow one of them must leave: where constants leave hardly more than noise,
    /// those alone that explain it.
    pub(crate) fn swings(&mut self, fitted: &MergedFit) -> Result<(Sought, Vec<Swing>), Error> {
        if fitted.error >= MORE_THAN_NOISE {
            let most = 1.0 + LEFT_OF_SWINGS * (fitted.error - 1.0);
            return Ok((Sought::Swinging(most), self.swinging(fitted)?));
        }
        let found = self.swinging_well(fitted, self.most_left_of_swings(fitted), &[])?;
        let told = self.told_swings(fitted, found)?;
        let least = told.iter().map(|(_, left)| *left).fold(fitted.error, f64::min);
        Ok((Sought::Swinging(0.5 * (fitted.error + least)), told.into_iter().map(|(one, _)| one).collect()))
    }

    /// The constant that explains most where windows follow it, if that is worth it: of those that differ between parts of the record, or of all
    /// where no part can.
    pub(crate) fn freed(
        &mut self,
        fitted: &MergedFit,
        mut tried: Vec<usize>,
        sought: Sought,
    ) -> Result<Option<Freed>, Error> {
        let before = (self.parameters.clone(), self.misfits.clone());
        let hidden = sought == Sought::Hidden;
        if hidden {
            tried = self.suspects(&fitted.model)?;
        }
        tried.truncate(TRIED);
        let may_be_noise = (MORE..NO_NOISE).contains(&fitted.error);
        let most = match (sought, may_be_noise) {
            (Sought::Swinging(most), _) => most / fitted.error,
            (Sought::Hidden, _) if fitted.error > NOISE_MODEL_FAILS => LACKING,
            (Sought::Hidden, _) | (Sought::Differing, true) => SHOWN,
            (Sought::Differing, false) => BETTER,
        };
        // Where nothing but the noise of the channels is left, or what no noise is, what a test says is enough.
        let enough = fitted.model.windowed.is_empty() && sought == Sought::Differing && !may_be_noise;
        let mut best: Option<Freed> = None;
        for one in tried.iter().copied() {
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
        if sought == Sought::Differing && best.as_ref().is_some_and(|best| best.found.error > WELL) {
            return self.or_swinging(fitted, best, (&tried, before));
        }
        Ok(best)
    }

    /// The best of the constants that were tried, or in its place one that differs between short parts and explains far more: eighths differ by little in what
    /// swings, and by more in what follows a little of it.
    fn or_swinging(
        &mut self,
        fitted: &MergedFit,
        mut best: Option<Freed>,
        (tried, before): (&[usize], Guess),
    ) -> Result<Option<Freed>, Error> {
        let most = best.as_ref().map_or(f64::INFINITY, |best| SHOWN * best.found.error);
        (self.parameters, self.misfits) = before.clone();
        self.fill();
        let swings = self.swinging_well(fitted, most, tried)?;
        let is_far = |one: &&Swing| one.is_far_beyond_chance() && !tried.contains(&one.element);
        let others: Vec<usize> = swings.iter().filter(is_far).map(|one| one.element).take(TRIED - 1).collect();
        for one in others {
            (self.parameters, self.misfits) = before.clone();
            let Some(found) = self.fitted(&without(&fitted.model, one))? else { continue };
            if best.as_ref().is_some_and(|best| found.error < SHOWN * best.found.error) {
                best = Some(Freed { one, found, guess: (self.parameters.clone(), self.misfits.clone()) });
            }
        }
        Ok(best)
    }

    /// A fit in which windows follow all constants at once that differ even beside what is left, if that explains far more: of what changes at the
    /// same time none alone is worth its windows, and a jump is seen only beside all that jump.
    pub(crate) fn freed_together(&mut self, told: &MergedFit) -> Result<Option<MergedFit>, Error> {
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
    pub(crate) fn or_another(&mut self, before: &MergedFit, free: MergedFit) -> Result<MergedFit, Error> {
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
}

/// A model with one constant less, which is windowed.
fn without(model: &Model, one: usize) -> Model {
    let mut freer = model.clone();
    freer.constant.retain(|&other| other != one);
    freer.windowed.push(one);
    freer
}

/// Constants that differ between parts of the record, those first that differ most.
pub(crate) fn different(found: &[(usize, Test)]) -> Vec<usize> {
    let mut found: Vec<_> = found.iter().filter(|(_, test)| test.probability < constancy::NO_CHANCE).collect();
    found.sort_by(|a, b| b.1.excess().total_cmp(&a.1.excess()));
    found.into_iter().map(|(one, _)| *one).collect()
}
