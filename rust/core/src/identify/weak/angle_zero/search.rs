//! The search for the angle at which the spring is relaxed, `K(t) (θ - θ₀)`, where the record contradicts a constant offset.
//!
//! Minus the stiffness is the regressor of what is left of that angle, as the torque's rate is that of its lag. The rows are moved by
//! what was found until nothing remains. There the regressor's own noise no longer matters, and beside it all other unknowns have the errors
//! that come from not knowing the angle.

use crate::error::Error;
use crate::identify::weak::angle_zero::first_guess::with_free_offset;
use crate::identify::weak::angle_zero::outcome::{AngleZero, FreeOffset};
use crate::identify::weak::angle_zero::spring::{STIFFNESS, SpringColumn};
use crate::identify::weak::choice::Chosen;
use crate::identify::weak::decided::Decided;
use crate::identify::weak::found::WeakIdentified;
use crate::identify::weak::lag::Settled;
use crate::identify::weak::session::Session;
use crate::inference::missing_terms::JudgedTerm;
use crate::regression::model::Model;
use crate::regression::subsample::{more_stretches_of_rows, thinned_rows};
use crate::weak_form::test_function::TestFunction;

/// Times that test function and windows are chosen again with the angle that was found.
const CHOICES: usize = 3;
/// Steps towards it with one choice.
const STEPS: usize = 8;
/// A step that is larger than this part of the last one leads nowhere: the equations do not hold, unless it is within the error. Windows are
/// chosen again after each step, and what is left differs by chance between two that predict equally well.
const SLOWEST: f64 = 0.7;
const WITHIN_ERROR: f64 = 1.0;
/// A step so small, in standard errors, is the last with one choice, and a choice that moves the angle by no more is the last.
const SETTLED: f64 = 0.02;
const CHOSEN: f64 = 0.3;
/// It is there beyond so many standard errors, as a term is suspected.
const CONSPICUOUS: f64 = 5.0;
/// One that is tried, and within so many standard errors beside all that varies slowly, will not be there.
const FAR_FROM_THERE: f64 = 2.0;
/// The part of what an offset that is free in every window explains that the angle must explain.
const LEAST_SHARE: f64 = 0.9;
/// The same of rows that were chosen without it.
const LEAST_SHARE_BEFORE: f64 = 0.5;

/// Where the search for the angle begins with one choice of test function and windows, and the error that the angle has in the end.
#[derive(Clone, Copy)]
struct Approached {
    function: TestFunction,
    zero: f64,
    noise: [f64; 2],
    lag: f64,
    error: f64,
}

impl Approached {
    /// Whether another choice begins in the same place, so that the same follows.
    fn is_as_good_as(&self, other: &Self) -> bool {
        let prepared = |one: &Self| (one.function, one.noise, one.lag);
        prepared(self) == prepared(other) && (self.zero - other.zero).abs() <= SETTLED * self.error
    }
}

impl Session<'_, '_, '_> {
    /// Decides with the test function that was chosen, and where the record contradicts a constant offset, tries an angle other than zero at which
    /// the spring is relaxed. It stays if it predicts better.
    pub(crate) fn settle(&mut self, model: &Model, mut chosen: Chosen) -> Result<Settled, Error> {
        let offset = self.offset_beside_changing_stiffness(model);
        if let (Some(_), Some(given)) = (offset, self.options.angle_zero.filter(|given| *given != 0.0)) {
            self.record.angle_zero = given;
            if let Some(mut settled) = self.settle_around(model, None)?
                && self.add_spring(&mut settled)?
            {
                return Ok(settled);
            }
            self.record.angle_zero = 0.0;
            chosen = self.choose(model)?;
        }
        let Some(offset) = offset else { return self.decide_and_choose_again(chosen, model) };
        let is_sought = self.options.angle_zero.is_none();
        if !is_sought && self.undecided_offset().is_none() {
            if self.options.diagnose {
                // An angle is looked for no more, but that a free offset would predict better is said again.
                self.offset_is_missed(&mut chosen, model, offset)?;
            }
            return self.decide_and_choose_again(chosen, model);
        }
        // Before anything else follows what the offset may not: looking for parameters that vary and jump takes longest where nothing fits.
        let missed = self.offset_is_missed(&mut chosen, model, offset)?;
        if is_sought
            && missed
            && let Some(settled) = self.with_angle_zero(model, offset, Some(&mut chosen))?
        {
            return Ok(settled);
        }
        let first = self.decide_and_choose_again(chosen, model)?;
        if is_sought
            && !missed
            && self.offset_is_contradicted(&first.0.weak, &first.1, offset)?
            && let Some(settled) = self.with_angle_zero(model, offset, None)?
        {
            return Ok(settled);
        }
        self.with_windowed_offset(model, offset, first, missed)
    }

    /// Chooses and decides with an angle at which the spring is relaxed; `None`, with everything as it was, if it does not predict better. Where
    /// rows are predicted badly without it, those at hand must be predicted much better with it before others are chosen.
    fn with_angle_zero(
        &mut self,
        model: &Model,
        offset: usize,
        missed: Option<&mut Chosen>,
    ) -> Result<Option<Settled>, Error> {
        let before = (self.scan.clone(), self.record.lag, self.noise);
        let guess = match (self.guess_angle_zero(model, offset)?, missed) {
            (Some(guess), Some(chosen)) => {
                (self.scan, self.noise) = (before.0.clone(), before.2);
                self.improved(guess, chosen, model)?
            }
            (guess, _) => guess,
        };
        if let Some(guess) = guess {
            self.record.angle_zero = guess;
            if let Some(mut settled) = self.settle_around(model, Some(offset))?
                && self.add_spring(&mut settled)?
            {
                return Ok(Some(settled));
            }
        }
        self.record.angle_zero = 0.0;
        (self.scan, self.record.lag, self.noise) = before;
        Ok(None)
    }

    /// A better guess with which rows at hand, or stretches of many, are predicted better, if not by as much as a free offset does.
    fn improved(&mut self, guess: f64, chosen: &mut Chosen, model: &Model) -> Result<Option<f64>, Error> {
        let FreeOffset { error, free } = self.free_offset;
        let fitted = chosen.fitted.take();
        let some = more_stretches_of_rows(chosen.weak.rows.len());
        let some = some.map_or_else(|| chosen.weak.rows.clone(), |some| thinned_rows(&chosen.weak.rows, &some));
        let rows = std::mem::replace(&mut chosen.weak.rows, some);
        self.move_zero(chosen, guess);
        let rests = self.roughly(|session| session.approach(chosen, model))?;
        let with = chosen.fitted.as_ref().map_or(f64::INFINITY, |fitted| fitted.error);
        let zero = std::mem::take(&mut self.record.angle_zero);
        // Moving them back would leave rounding.
        (chosen.weak.rows, chosen.fitted) = (rows, fitted);
        Ok((rests && error - with >= LEAST_SHARE_BEFORE * (error - free)).then_some(zero))
    }

    /// The regressor of a constant offset beside a windowed stiffness, where such an angle may be looked for.
    fn offset_beside_changing_stiffness(&self, model: &Model) -> Option<usize> {
        let offset = self.offset()?;
        let sought = model.windowed.contains(&STIFFNESS) && model.constant.contains(&offset);
        sought.then_some(offset)
    }

    /// Chooses and decides around an angle and moves it until nothing remains; `None` if the rows do not determine it. Where an offset is
    /// given to compare with, also if the angle is no better or within its error of zero.
    fn settle_around(&mut self, model: &Model, offset: Option<usize>) -> Result<Option<Settled>, Error> {
        let mut before: Option<Approached> = None;
        for choice in 1..=CHOICES {
            let start = self.record.angle_zero;
            let mut chosen = self.choose(model)?;
            if !self.approach(&mut chosen, model)? {
                return Ok(None);
            }
            let (zero, noise, lag) = (self.record.angle_zero, self.noise, self.record.lag);
            let begun = Approached { function: chosen.weak.function, zero, noise, lag, error: 0.0 };
            if offset.is_some() && before.is_some_and(|before| before.is_as_good_as(&begun)) {
                // What was not there then will not be there now.
                return Ok(None);
            }
            if let Some(offset) = offset.filter(|_| choice == 1)
                && !self.predicts_better(&mut chosen, model, offset)?
            {
                return Ok(None);
            }
            let (mut chosen, mut decided, lag) = self.decide_and_choose_again(chosen, model)?;
            let mut step = 1;
            let error = loop {
                let Some((left, error)) = self.left_of_zero(&chosen, &decided)? else { return Ok(None) };
                let nearly = self.record.angle_zero + left;
                if offset.is_some() && !decided.slow.is_empty() && nearly.abs() < FAR_FROM_THERE * error {
                    // The search for what varies takes longest of all: it is not made once more for what will not be there.
                    return Ok(None);
                }
                if left.abs() <= SETTLED * error {
                    break error;
                }
                if step == STEPS {
                    return Ok(None);
                }
                step += 1;
                if let Some(whole) = decided.whole.take() {
                    chosen.weak.rows = whole;
                }
                self.move_zero(&mut chosen, left);
                decided = self.decide(&mut chosen, model)?;
            };
            let zero = self.record.angle_zero;
            if (zero - start).abs() <= CHOSEN * error || choice == CHOICES {
                let is_there = offset.is_none() || zero.abs() > CONSPICUOUS * error;
                return Ok(is_there.then_some((chosen, decided, lag)));
            }
            before = (zero.abs() <= CONSPICUOUS * error).then_some(Approached { error, ..begun });
        }
        Ok(None)
    }

    /// Moves the angle until next to nothing remains while everything that is not windowed is constant; whether it comes to rest.
    fn approach(&mut self, chosen: &mut Chosen, model: &Model) -> Result<bool, Error> {
        let mut before = f64::INFINITY;
        for _ in 0..STEPS {
            let fitted = self.take_fitted(chosen, model)?;
            let left = self.left_of_zero(chosen, &fitted)?;
            chosen.fitted = Some(fitted);
            let Some((left, error)) = left else { return Ok(false) };
            if left.abs() <= CHOSEN * error {
                return Ok(true);
            }
            if left.abs() > SLOWEST * before {
                return Ok(left.abs() <= WITHIN_ERROR * error);
            }
            before = left.abs();
            self.move_zero(chosen, left);
            self.fit_near(chosen, model)?;
        }
        Ok(false)
    }

    /// Moves the angle at which the spring is relaxed.
    fn move_zero(&mut self, chosen: &mut Chosen, by: f64) {
        chosen.weak.move_zero(by);
        self.record.angle_zero += by;
    }

    /// What is left of the angle at which the spring is relaxed, and its standard error.
    fn left_of_zero(&mut self, chosen: &Chosen, decided: &Decided) -> Result<Option<(f64, f64)>, Error> {
        let Some(fit) = &decided.fit else { return Ok(None) };
        let mut rows = chosen.weak.rows.clone();
        let Some(spring) = SpringColumn::new(&decided.model, fit, rows.len(), rows.period) else { return Ok(None) };
        let place = rows.regressors.len();
        let regressor = spring.regressor(&rows);
        rows.regressors.push(regressor);
        let correlated = decided.model.correlated(&rows, &decided.covariance, &mut self.stages)?;
        let judged = JudgedTerm {
            rows: &rows,
            model: &decided.model,
            rhs: decided.rhs(&rows),
            noise: self.noise[0],
            fit,
            covariance: &decided.covariance,
            correlated: &correlated,
            expected: decided.expected,
            inflation: decided.inflation(),
            instructions: self.options.instructions,
        };
        let found = judged.factor(place, &mut self.stages)?;
        Ok(found.filter(|(left, error)| left.is_finite() && error.is_finite()))
    }

    /// Whether rows are predicted better with the angle that was found than without, by nearly as much as with an offset that is free in every
    /// window: one that drifts follows the stiffness in part.
    fn predicts_better(&mut self, chosen: &mut Chosen, model: &Model, offset: usize) -> Result<bool, Error> {
        let with = chosen.fitted.as_ref().map_or(f64::INFINITY, |fitted| fitted.error);
        let free = self.error_of(chosen, &with_free_offset(model, offset))?;
        let zero = self.record.angle_zero;
        chosen.weak.move_zero(-zero);
        let without = self.error_of(chosen, model)?;
        chosen.weak.move_zero(zero);
        let better = with < without && without - with >= LEAST_SHARE * (without - free);
        self.free_offset = FreeOffset { error: if better { with } else { without }, free };
        Ok(better)
    }

    /// Lets what is left of the angle be one more constant, so that every error knows of it. Returns whether the rows determine it.
    fn add_spring(&mut self, (chosen, decided, _): &mut Settled) -> Result<bool, Error> {
        let rows = &mut chosen.weak.rows;
        let Some(fit) = &decided.fit else { return Ok(false) };
        let Some(spring) = SpringColumn::new(&decided.model, fit, rows.len(), rows.period) else { return Ok(false) };
        decided.model.constant.push(rows.regressors.len());
        let regressor = spring.regressor(rows);
        rows.regressors.push(regressor);
        decided.spring = Some(spring);
        let problem = decided.problem(rows, self.noise[0]);
        let again = fit.again(&problem, decided.expected, self.options.instructions, &mut self.stages)?;
        decided.fit = again;
        Ok(decided.fit.is_some())
    }

    /// Takes the angle out of the constants of a record, as far as it was sought; `None` where the record does not determine it.
    pub(crate) fn take_angle_zero(&self, found: &mut WeakIdentified, decided: &Decided) -> Option<AngleZero> {
        decided.spring.as_ref()?;
        let regressor = *decided.model.constant.last()?;
        found.weakest.pop();
        let place = found.constants.iter().position(|one| one.unknown == regressor)?;
        let left = found.constants.remove(place);
        let value = self.record.angle_zero + left.value;
        value.is_finite().then_some(AngleZero { value, error: left.error })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_choice_is_as_good_as_one_that_begins_in_the_same_place() {
        let function = |half: usize| TestFunction::new(half, 9, 1e-3).expect("a test function");
        let (zero, error) = (8.6e-5, 1.8e-5);
        let one = Approached { function: function(11), zero, noise: [1e-10, 6e-4], lag: 0.0, error };
        let at = |zero: f64| Approached { zero, error: 0.0, ..one };
        assert!(one.is_as_good_as(&at(zero + 0.9 * SETTLED * error)));
        assert!(!one.is_as_good_as(&at(zero - 1.1 * SETTLED * error)));
        let others = [
            Approached { function: function(12), ..one },
            Approached { noise: [1e-10, 7e-4], ..one },
            Approached { lag: 0.5, ..one },
        ];
        assert!(others.iter().all(|other| !one.is_as_good_as(other)));
    }
}
