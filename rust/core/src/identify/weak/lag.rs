//! The lag of the torque, estimated from the record itself.
//!
//! A torque recorded too late by `τ` is `T(t) = T_recorded(t + τ) ≈ T_recorded(t) + τ Ṫ_recorded(t)`, so the coefficient of the torque's
//! rate is the remaining lag. The rows are built again with the lag found so far until nothing remains: there
//! the expansion is exact, and the noise of the rate, which is uncorrelated with that of the torque, no longer matters.
//!
//! Only the inertia separates the lag from the damping: with motion at a single frequency the lag is not determined.

use crate::equation::rows::{Regressor, Rows};
use crate::error::Error;
use crate::identify::kinds::Kind;
use crate::identify::weak::choice::Chosen;
use crate::identify::weak::decide::BADLY;
use crate::identify::weak::decided::Decided;
use crate::identify::weak::session::Session;
use crate::inference::missing_terms::{CONSPICUOUS, JudgedTerm};
use crate::inference::slowly_varying::{followed, without};
use crate::noise::median::median;
use crate::regression::constants::Expected;
use crate::regression::fit::Fit;
use crate::regression::model::Model;
use crate::weak_form::test_function::TestFunction;
use crate::weak_form::test_function_choice::spectrum_length;
use crate::weak_form::weak_rows::WeakRows;

/// Times that test function and windows are chosen again with the lag that was found.
const CHOICES: usize = 4;
/// Steps towards the lag with one choice.
const STEPS: usize = 16;
/// A step so small, in standard errors, ends the search: a tenth of a percent of the width of an interval.
const SETTLED: f64 = 4e-3;
/// A choice that moves the lag by no more, in standard errors, is the last.
const CHOSEN: f64 = 0.1;
/// The largest part of the last move that a move may be to tell where all of them lead.
const MOST_OF_A_MOVE: f64 = 0.9;
/// The least part of the lag that a step may be taken to cover, where noise of the rate hides the rest.
const LEAST_RESPONSE: f64 = 0.05;
/// A lag that is not known to this part of the test function's half-width is not determined: beyond it the rate is no line.
pub(crate) const UNKNOWN: f64 = 0.5;

/// A lag beside constants is known well enough to begin with from a step of so many samples on, and is at most so many half-widths. It is large from
/// this part of the half-width that was chosen without it.
const ABOUT: f64 = 0.1;
const MOST_HALVES: f64 = 2.0;
const LARGE: f64 = 0.25;

/// Times that a lag is sought beside which nothing need vary.
const TRIES: usize = 2;

/// Powers of time by which what changes slowly may change once more beside a lag: what was found of it with another lag holds a part of that, since a
/// damping that follows a sweep does what a lag does.
const GROWTHS: i32 = 3;

/// By how many samples the torque comes late.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lag {
    /// Samples.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
}

/// What is left of a regressor where what varies slowly follows it, and by how much each does so in the median.
pub(crate) struct Followed {
    pub(crate) left: Vec<f64>,
    pub(crate) by: Vec<f64>,
}

/// What was chosen and decided, and the lag that was found on the way.
pub(crate) type Settled = (Chosen, Decided, Option<Lag>);

/// Moves of a lag each of which is about the same part of the one before: what varies slowly took the rest over, and gives it back bit by bit.
#[derive(Clone, Copy, Debug)]
struct Creeping {
    moved: f64,
    part: f64,
}

impl Creeping {
    /// Two moves, if the second is a part of the first.
    fn new([before, moved]: [f64; 2]) -> Option<Self> {
        let part = moved / before;
        (part > 0.0 && part <= MOST_OF_A_MOVE).then_some(Self { moved, part })
    }

    /// What all further moves together will be: a geometric series.
    fn left(self) -> f64 {
        self.moved * self.part / (1.0 - self.part)
    }

    /// By how much the error of all of them is larger than that of one, which holds for what varies as it is.
    fn raised(self) -> f64 {
        1.0 / (1.0 - self.part)
    }

    /// Whether so many moves later one will be so small that it is the last.
    fn settles_after(self, moves: usize, error: f64) -> bool {
        let later = (0..moves).fold(self.moved, |moved, _| moved * self.part);
        later.abs() <= CHOSEN * error
    }
}

impl Session<'_, '_, '_> {
    /// Decides what is constant with the test function that was chosen, finds the lag where it is not given, and chooses again with it.
    pub(crate) fn decide_and_choose_again(&mut self, mut chosen: Chosen, model: &Model) -> Result<Settled, Error> {
        let (mut lag, mut without, mut last, mut raised, mut untold) = (None, None, None, 1.0, 0.0);
        if let Some(about) = self.large_lag(&chosen)? {
            self.record.lag = about;
            chosen = self.choose(model)?;
        }
        for choice in 1..=CHOICES {
            if choice > 1 {
                chosen = self.choose(model)?;
            }
            let mut decided = self.decide_with_noise(&mut chosen, model)?;
            // To be found again where no lag is: a search for what varies takes longest of all.
            if self.options.lag.is_none() && choice == 1 && self.record.lag == 0.0 && !decided.slow.is_empty() {
                without = Some((chosen.clone(), decided.clone(), (self.scan.clone(), self.suggested, self.noise)));
            }
            (chosen, decided) = self.between_jumps_of_suggested(chosen, decided, model)?;
            decided.untold_lag = self.options.found_lag.unwrap_or(0.0);
            if self.options.lag.is_some() || self.varies_too_much(&decided) {
                return Ok((chosen, decided, None));
            }
            if choice == 1 && !decided.slow.is_empty() {
                (chosen, decided) = self.constant_beside_lag((chosen, decided), model)?;
            }
            let before = self.record.lag;
            let earlier: Option<Lag> = lag;
            lag = self.find_lag(&chosen, &decided)?;
            let Some(found) = lag else {
                untold = earlier.map_or(0.0, |lag| lag.value.hypot(lag.error));
                break;
            };
            let moved = found.value - before;
            let settled = moved.abs() <= CHOSEN * found.error;
            if settled || choice == CHOICES {
                // The rows at hand stand: they differ from those of the last step by less than can be told. Where they have not settled, the last step is a
                // part of the error.
                let error = raised * if settled { found.error } else { found.error.hypot(moved) };
                // What changes slowly and the lag make room for each other: a lag that does not settle, and may be none, is not determined.
                if !settled && !decided.slow.is_empty() && before.abs() <= CONSPICUOUS * error {
                    let alike = last.filter(|(_, slow)| *slow == decided.slow);
                    let more = alike.map_or(0.0, |(before, _)| still_to_come([before, moved]));
                    (lag, untold) = (None, (found.value + more).hypot(error));
                    break;
                }
                self.record.lag = before;
                decided.untold_lag = (error * error - found.error * found.error).max(0.0).sqrt();
                return Ok((chosen, decided, Some(Lag { value: before, error })));
            }
            self.record.lag = found.value;
            let creeps = last.take().filter(|(_, slow)| *slow == decided.slow).and_then(|(before, _)| {
                Creeping::new([before, moved]).filter(|one| !one.settles_after(1, found.error))
            });
            if let Some(creeps) = creeps {
                let (limit, error) = (found.value + creeps.left(), creeps.raised() * found.error);
                if limit.abs() <= CONSPICUOUS * error && !creeps.settles_after(CHOICES - choice, found.error) {
                    // It will not settle, and may be none.
                    (lag, untold) = (None, limit.hypot(error));
                    break;
                }
                (self.record.lag, raised) = (limit, creeps.raised());
            } else if !decided.slow.is_empty() {
                last = Some((moved, decided.slow));
            }
        }
        self.record.lag = 0.0;
        if let Some((chosen, mut decided, (scan, suggested, noise))) = without {
            (self.scan, self.suggested, self.noise) = (scan, suggested, noise);
            decided.untold_lag = untold;
            return Ok((chosen, decided, lag));
        }
        let mut chosen = self.choose(model)?;
        let mut decided = self.decide_with_noise(&mut chosen, model)?;
        decided.untold_lag = untold;
        Ok((chosen, decided, lag))
    }

    /// A lag that is large beside the test function that was chosen without it, about, or `None` where there is none or it is given. Windows follow
    /// what such a lag leaves as if it were motion, and it cannot be found beside them: so unknowns are constant here, and the test function is
    /// half a typical cycle wide on either side.
    fn large_lag(&mut self, chosen: &Chosen) -> Result<Option<f64>, Error> {
        if self.options.lag.is_some() {
            return Ok(None);
        }
        let samples = self.record.angle.len();
        let typical = 0.5 * self.evidence(spectrum_length(samples, 200))?.period();
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most the record's length")]
        let half = (typical as usize).min(samples / 16).max(chosen.weak.function.half_width());
        let function = TestFunction::new(half, chosen.weak.function.exponent(), self.options.delta)?;
        let constant = self.unknowns().into_iter().chain([self.rate()]).collect();
        let model = Model { constant, linear: self.options.linear, ..Model::default() };
        let (rate, may_change) = (model.constant.len() - 1, self.may_change());
        let start = self.record.lag;
        let mut lag = start;
        for _ in 0..STEPS {
            self.record.lag = lag;
            let weak = self.rows(function);
            self.record.lag = start;
            let mut weak = weak?;
            let growths = growing(&mut weak.rows, &may_change);
            let mut model = model.clone();
            model.constant.splice(rate..rate, growths);
            let problem = model.problem(&weak.rows, &weak.rows.rhs, self.noise[0], None);
            let fit = Fit::new(&problem, None, Expected::UNKNOWN, self.options.instructions, &mut self.stages)?;
            let step = fit.and_then(|fit| fit.pooled.values.last().map(|left| -left / self.options.delta));
            let Some(step) = step.filter(|step| step.is_finite()) else { return Ok(None) };
            lag += step.clamp(-UNKNOWN * half as f64, UNKNOWN * half as f64);
            if lag.abs() > MOST_HALVES * half as f64 {
                return Ok(None);
            }
            if step.abs() < ABOUT {
                let least = (LARGE * chosen.weak.function.half_width() as f64).max(1.0);
                return Ok(Some(lag).filter(|lag| lag.abs() > least));
            }
        }
        Ok(None)
    }

    /// What was decided, or, where something varies slowly that need not do so beside a lag, nothing of it beside that: of two equations that predict
    /// alike, the one in which nothing changes.
    fn constant_beside_lag(
        &mut self,
        (chosen, decided): (Chosen, Decided),
        model: &Model,
    ) -> Result<(Chosen, Decided), Error> {
        if !self.of_kind(Kind::Varying).is_empty() {
            return Ok((chosen, decided));
        }
        let mut beside: Option<Chosen> = None;
        let before = (self.scan.clone(), self.record.lag, self.noise);
        for _ in 0..TRIES {
            let one = beside.as_ref().unwrap_or(&chosen);
            let constant = self.fit_first(one, model)?;
            let Some(found) = self.find_lag(one, &constant)? else { break };
            if beside.is_some() && (found.value - self.record.lag).abs() <= CHOSEN * found.error {
                // The same would be decided.
                break;
            }
            self.record.lag = found.value;
            let mut one = self.choose(model)?;
            // What is told to vary is not followed: it will not stand.
            let most = self.most_slow.replace(0);
            let again = self.decide(&mut one, model);
            self.most_slow = most;
            let mut again = again?;
            let stands = |again: &Decided| {
                again.fit.is_some() && again.slow.is_empty() && again.error < BADLY.max(decided.error)
            };
            if stands(&again) && again.error >= BADLY {
                // Nor was it asked whether something varies that is constant nowhere.
                one = self.choose(model)?;
                again = self.decide(&mut one, model)?;
            }
            if stands(&again) {
                return Ok((one, again));
            }
            beside = Some(one);
        }
        (self.scan, self.record.lag, self.noise) = before;
        Ok((chosen, decided))
    }

    /// The lag, iterated until its correction vanishes, or `None` if the rows do not determine it.
    fn find_lag(&mut self, chosen: &Chosen, decided: &Decided) -> Result<Option<Lag>, Error> {
        let Some(fit) = &decided.fit else { return Ok(None) };
        let start = self.record.lag;
        let widest = chosen.weak.function.half_width() as f64;
        let (mut lag, mut response) = (start, 1.0);
        let mut last: Option<(f64, f64)> = None;
        for _ in 0..STEPS {
            self.record.lag = lag;
            let mut weak = self.rows(chosen.weak.function)?;
            weak.rows.exclude_as(&chosen.weak.rows);
            let left = self.left(&weak, chosen, decided, fit)?;
            self.record.lag = start;
            let Some((left, error)) = left.filter(|(left, error)| left.is_finite() && error.is_finite()) else {
                return Ok(None);
            };
            if let Some((lag_before, left_before)) = last {
                // Noise of the rate hides a part of what is left; two steps tell which.
                let measured = (left_before - left) / (lag - lag_before);
                response = if measured.is_finite() { measured.clamp(LEAST_RESPONSE, 1.0) } else { response };
            }
            let (step, error) = (left / response, error / response);
            if error > UNKNOWN * widest {
                return Ok(None);
            }
            let rounding = f64::EPSILON * self.record.torque.len() as f64;
            if last.is_some() && step.abs() <= (SETTLED * error).max(rounding) {
                return Ok(Some(Lag { value: lag, error }));
            }
            last = Some((lag, left));
            lag += step.clamp(-UNKNOWN * widest, UNKNOWN * widest);
        }
        Ok(None)
    }

    /// The factor of the torque's rate beside everything else, in samples, and its standard error.
    fn left(
        &mut self,
        weak: &WeakRows,
        chosen: &Chosen,
        decided: &Decided,
        fit: &Fit,
    ) -> Result<Option<(f64, f64)>, Error> {
        // What slowly varying parameters took off the right-hand side depends on the angle only. Their levels are estimated again beside the
        // rate: found with another lag, they hold a part of it.
        let (before, without) = (&chosen.weak.rows.rhs, decided.rhs(&chosen.weak.rows));
        let slow = before.iter().zip(without).map(|(rhs, without)| rhs - without);
        let rhs = weak.rows.rhs.iter().zip(slow).map(|(rhs, slow)| rhs - slow).collect();
        let mut rows = decided.as_white(Rows { rhs, ..weak.rows.clone() }, &mut self.stages)?;
        let correlated = decided.model.correlated(&rows, &decided.covariance, &mut self.stages)?;
        let mut model = decided.ordered();
        model.constant.extend(growing(&mut rows, &decided.slow));
        let judged = JudgedTerm {
            rows: &rows,
            model: &model,
            rhs: &rows.rhs,
            noise: self.noise[0],
            fit,
            covariance: &decided.covariance,
            correlated: &correlated,
            expected: decided.expected,
            inflation: decided.inflation(),
            instructions: self.options.instructions,
        };
        let found = judged.factor(self.rate(), &mut self.stages)?;
        let period = self.options.delta;
        Ok(found.map(|(value, error)| (-value / period, error / period)))
    }

    /// What is left of a column of a regressor where what varies slowly follows it as it follows the motion, or `None` if that is not determined. A
    /// damping that follows a sweep does what a lag does: beside it only the rest of the torque's rate tells the lag.
    pub(crate) fn beside_slow(
        &mut self,
        rows: &Rows,
        column: &[f64],
        decided: &Decided,
    ) -> Result<Option<Followed>, Error> {
        let Some(found) = &decided.found else {
            return Ok(Some(Followed { left: column.to_vec(), by: Vec::new() }));
        };
        let in_equations = |(value, is_usable): (&f64, &bool)| if *is_usable { *value } else { 0.0 };
        let column: Vec<f64> = column.iter().zip(&rows.usable).map(in_equations).collect();
        let model = decided.ordered();
        let search = self.slow_search(rows, &model, decided);
        let varying = followed(&search, found, &column, &mut self.stages)?;
        Ok(varying.map(|varying| {
            let left = without(rows, &column, &decided.slow, &varying);
            let mut by = varying.values;
            Followed { left, by: by.iter_mut().map(|values| median(values).unwrap_or(f64::NAN)).collect() }
        }))
    }

    /// Which of inertia and damping may change along the record.
    fn may_change(&self) -> Vec<usize> {
        let undecided = self.undecided();
        let all = [undecided, self.of_kind(Kind::Varying), self.of_kind(Kind::Windowed)].concat();
        (0..2).filter(|unknown| all.contains(unknown)).collect()
    }

    /// Which regressor the torque's rate is.
    pub(crate) fn rate(&self) -> usize {
        3 + self.record.terms.len()
    }
}

/// What moves of a lag will add up to that go on as these two, each the same part of the one before; nothing if they do not become smaller.
fn still_to_come([before, moved]: [f64; 2]) -> f64 {
    let part = moved / before;
    if part > 0.0 && part < 1.0 { moved * part / (1.0 - part) } else { 0.0 }
}

/// Adds regressors times powers of time to rows, from the middle of the record on, and returns which they are.
fn growing(rows: &mut Rows, regressors: &[usize]) -> Vec<usize> {
    let first = rows.regressors.len();
    let half = (0.5 * (rows.len() as f64 - 1.0)).max(1.0);
    for &regressor in regressors {
        for power in 1..=GROWTHS {
            let at = |(row, value): (usize, &f64)| value * ((row as f64 - half) / half).powi(power);
            let of = |column: &[f64]| column.iter().enumerate().map(at).collect();
            let Regressor { value, companion, .. } = &rows.regressors[regressor];
            let more = Regressor { value: of(value), companion: of(companion), ..Regressor::default() };
            rows.regressors.push(more);
        }
    }
    (first..rows.regressors.len()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moves_that_shrink_by_one_factor_tell_where_they_lead() {
        let one = Creeping::new([0.8, 0.4]).expect("a part");
        // 0.2 + 0.1 + 0.05 and so on.
        assert!((one.left() - 0.4).abs() < 1e-15 && (one.raised() - 2.0).abs() < 1e-15);
        // The move after next is 0.1.
        assert!(one.settles_after(2, 1.001) && !one.settles_after(2, 0.999) && !one.settles_after(1, 1.001));
        for other in [[0.8, -0.4], [0.8, 0.8], [0.4, 0.8], [0.0, 0.1], [0.0, 0.0], [1.0, 0.0]] {
            assert!(Creeping::new(other).is_none(), "{other:?}");
        }
        // However slowly they become smaller: 0.99² and so on.
        assert!((still_to_come([1.0, 0.99]) - 98.01).abs() < 1e-9 && still_to_come([1.0, 1.0]) == 0.0);
    }
}
