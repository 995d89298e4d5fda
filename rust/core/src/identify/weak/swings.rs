//! Setting constants free that swing within the parts that are compared, where that leaves hardly more than noise.

use std::borrow::Cow;
use std::ops::Range;

use crate::equation::rows::Rows;
use crate::error::Error;
use crate::identify::weak::decided::Decided;
use crate::identify::weak::freed::{A_LITTLE_BETTER, without_rate};
use crate::identify::weak::session::Session;
use crate::inference::cross_validation::best_length;
use crate::inference::short_parts::{LEFT_OF_SWINGS, Swinging, swinging};
use crate::inference::slowly_varying::{self, SlowSearch};
use crate::regression::fit::Fit;
use crate::regression::limits::NOISE_MODEL_FAILS;
use crate::regression::model::Model;
use crate::regression::problem::Problem;
use crate::regression::residuals::{residuals, usual_variance};
use crate::regression::subsample::{holds, places_of, stretches_of_rows, thinned_rows};
use crate::regression::window_length::Scale;

/// The part that is left after the first round of a search, from which on it is not worth another.
const HOPELESS: f64 = 0.5;

/// The parts of the usual square that may be left where rows are predicted so badly that most squares are beyond the largest that counts, where one constant
/// is set free and where all are: what swings leaves at most .018 and .003. Where one of two is set free .13 and more is left, where an angle is low-passed,
/// or a friction, a drag or a cubic spring is missing, .034 and .049.
const LEFT_BESIDE_ONE: f64 = 0.025;
const LEFT_BESIDE_ALL: f64 = 0.01;

/// The part that is left beside all from which on one of them does not explain it either.
const UNLIKE_ALL: f64 = 0.1;

impl Session<'_, '_, '_> {
    /// Sets a constant free that swings, if that leaves hardly more than noise: whatever is missing from an equation follows a curve a little. Where rows
    /// are predicted worst it is set free with all others, too: two that swing hide each other. Returns whether it was. One that was given as constant is
    /// contradicted.
    pub(crate) fn set_swinging_free(
        &mut self,
        rows: &Rows,
        model: &Model,
        decided: &mut Decided,
        Swinging { constant, test, .. }: Swinging,
    ) -> Result<bool, Error> {
        let swinging = decided.model.constant[constant];
        let undecided = self.undecided();
        let is_open = undecided.contains(&swinging);
        let rows = if is_open { Cow::Borrowed(rows) } else { Cow::Owned(without_rate(rows, swinging)) };
        let all = Some(undecided).filter(|all| is_open && all.len() > 1 && is_lost(decided));
        let (mut beside_all, mut by_usual) = (None, is_lost(decided));
        if let Some(all) = all {
            let (free, left) = self.freed_with_left(&rows, model, decided, (&all, true))?;
            by_usual = left < UNLIKE_ALL;
            beside_all = free.filter(|_| left < LEFT_BESIDE_ALL);
        }
        let (alone, left) = self.freed_with_left(&rows, model, decided, (&[swinging], by_usual))?;
        let Some(free) = alone.filter(|_| left < LEFT_BESIDE_ONE).or(beside_all) else { return Ok(false) };
        if is_open {
            *decided = free;
        }
        decided.tests.retain(|(one, _)| *one != swinging);
        decided.tests.push((swinging, test));
        Ok(is_open)
    }

    /// The constant of the motion that differs most between short parts of the record, if one does.
    pub(crate) fn swinging(&mut self, rows: &Rows, decided: &Decided) -> Result<Option<Swinging>, Error> {
        let Some(fit) = decided.fit.as_ref().filter(|fit| fit.scale.is_some()) else { return Ok(None) };
        let problem = decided.problem(decided.rows(rows), self.noise[0]);
        let may = self.of_motion(decided);
        let (noise, instructions) = (self.test_noise(decided), self.options.instructions);
        Ok(swinging(&problem, (fit, &may), noise, instructions, &mut self.stages)?.into_iter().next())
    }

    /// What a record is with some constants set free, unless that is hopeless, and the part that is left of what noise does not explain: none or all of it by
    /// the error of predicting rows, which one alone may be judged by, or of the usual square.
    fn freed_with_left(
        &mut self,
        rows: &Rows,
        model: &Model,
        decided: &Decided,
        (constants, by_usual): (&[usize], bool),
    ) -> Result<(Option<Decided>, f64), Error> {
        if self.is_hopeless(rows, model, decided, (constants, by_usual))? {
            return Ok((None, f64::INFINITY));
        }
        let excess = (decided.error - 1.0).max(0.0);
        let hopeless = if by_usual { f64::INFINITY } else { 1.0 + HOPELESS * excess };
        let free = self.freed(rows, model, decided, (constants, hopeless))?;
        let is_settled = free.error - 1.0 < LEFT_OF_SWINGS * excess && free.error < A_LITTLE_BETTER * decided.error;
        let left = if constants.len() == 1 && is_settled {
            0.0
        } else if by_usual && is_of_a_machine(&free) {
            let problems = [decided, &free].map(|one| (one.problem(rows, self.noise[0]), one.fit.as_ref()));
            let [before, after] = problems.map(|(problem, fit)| self.usual_left(&problem, fit));
            after? / before?
        } else {
            f64::INFINITY
        };
        Ok((Some(free), left))
    }

    /// The usual square that a fit leaves, which has no limit; infinite without a fit.
    fn usual_left(&mut self, problem: &Problem<'_>, fit: Option<&Fit>) -> Result<f64, Error> {
        let Some(fit) = fit else { return Ok(f64::INFINITY) };
        let (left, usable) = residuals(problem, fit, &mut self.stages)?;
        Ok(usual_variance(&left, &usable).unwrap_or(f64::INFINITY))
    }

    /// Whether stretches of a long record say that it is not worth following some constants along all of it: even a curve of its own in each leaves too much
    /// of what noise does not explain. Only where windows are short, as they are that follow what is missing: stretches hold many of them.
    fn is_hopeless(
        &mut self,
        rows: &Rows,
        model: &Model,
        decided: &Decided,
        (constants, by_usual): (&[usize], bool),
    ) -> Result<bool, Error> {
        let (Some(stretches), Some(first)) = (stretches_of_rows(rows.len()), decided.first) else { return Ok(false) };
        let length = stretches.first().map_or(0, Range::len);
        let is_short = |scale: &Scale| scale.span() * slowly_varying::STRETCH <= length;
        let scales: Vec<Scale> = decided.scales.iter().copied().filter(|&scale| holds(scale)).collect();
        // Where most squares are beyond the largest that counts, no length was chosen by them.
        let others = || scales.iter().rev().copied().find(is_short).filter(|_| by_usual);
        let Some(first) = Some(first).filter(is_short).or_else(others) else { return Ok(false) };
        let some = thinned_rows(rows, &stretches);
        let (noise, expected, instructions) = (self.noise[0], decided.expected, self.options.instructions);
        let problem = decided.model.problem(&some, &some.rhs, noise, None);
        let before = best_length(&problem, (&scales, &[first]), expected, instructions, &mut self.stages)?;
        let Some((scale, error)) = before else { return Ok(false) };
        let before = self.unexplained(&problem, (scale, error), (decided, by_usual))?;
        let rest: Vec<usize> = decided.model.constant.iter().copied().filter(|one| !constants.contains(one)).collect();
        let ordered = Model { constant: [constants, &rest].concat(), ..model.clone() };
        let rest = Model { constant: rest, ..model.clone() };
        let starts: Vec<usize> = places_of(&stretches).iter().skip(1).map(|place| place.start).collect();
        let search = SlowSearch {
            rows: &some,
            model: &ordered,
            coefficients: constants.len(),
            scales: &scales,
            longest: decided.longest.map(|longest| longest.min(length)),
            ..self.slow_search(rows, &ordered, decided)
        };
        let jumps = (!rows.jumps.is_empty()).then_some(&some.jumps);
        for breaks in std::iter::once(&starts).chain(jumps) {
            let found = slowly_varying::find(&SlowSearch { breaks, ..search }, first, &mut self.stages)?;
            let Some(found) = found else { return Ok(false) };
            let problem = rest.problem(&some, &found.rhs, noise, None);
            if self.unexplained(&problem, (found.scale, found.error), (decided, by_usual))? <= HOPELESS * before {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// What windows of a length, which predict with some error, leave of some rows that noise does not explain, or the usual square.
    fn unexplained(
        &mut self,
        problem: &Problem<'_>,
        (scale, error): (Scale, f64),
        (decided, by_usual): (&Decided, bool),
    ) -> Result<f64, Error> {
        if !by_usual {
            return Ok(error - 1.0);
        }
        let (expected, instructions) = (decided.expected, self.options.instructions);
        let fit = Fit::new(problem, Some(scale), expected, instructions, &mut self.stages)?;
        self.usual_left(problem, fit.as_ref())
    }
}

/// Whether what varies slowly is positive on average, as inertia and damping are: in bursts of one frequency a torque that is late is followed by curves of
/// both that are not.
fn is_of_a_machine(free: &Decided) -> bool {
    let Some(found) = &free.found else { return false };
    (0..free.slow.len()).all(|coefficient| found.varying.mean(coefficient) > 0.0)
}

/// Whether rows are predicted so badly that most squares are beyond the largest that counts: what is then left is compared by the usual row.
fn is_lost(decided: &Decided) -> bool {
    decided.error >= NOISE_MODEL_FAILS
}
