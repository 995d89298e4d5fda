//! Setting constants free that swing within the parts that are compared, where that leaves hardly more than noise.

use std::borrow::Cow;
use std::ops::Range;

use crate::equation::rows::Rows;
use crate::error::Error;
use crate::identify::weak::decided::Decided;
use crate::identify::weak::freed::{A_LITTLE_BETTER, NO_LESS, without_rate};
use crate::identify::weak::session::Session;
use crate::inference::cross_validation::best_length;
use crate::inference::short_parts::{LEFT_OF_SWINGS, LEFT_WHERE_LOST, Swinging, swinging};
use crate::inference::slow_lengths::SlowSearch;
use crate::inference::slowly_varying;
use crate::regression::model::Model;
use crate::regression::subsample::{holds, places_of, stretches_of_rows, thinned_rows};
use crate::regression::window_length::Scale;

/// The part that is left after the first round of a search, from which on it is not worth another.
const HOPELESS: f64 = 0.5;

impl Session<'_, '_, '_> {
    /// Sets a constant free that swings, if that leaves hardly more than noise: whatever is missing from an equation follows a curve a little. Where rows
    /// are predicted worst it is set free with all others, too: two that swing hide each other. Returns whether it was. One that was given as constant is
    /// contradicted. What was set free in vain is not tried again.
    pub(crate) fn set_swinging_free(
        &mut self,
        rows: &Rows,
        model: &Model,
        decided: &mut Decided,
        (Swinging { constant, test, .. }, in_vain): (Swinging, &[Vec<usize>]),
    ) -> Result<bool, Error> {
        let swinging = decided.model.constant[constant];
        let undecided = self.undecided();
        let is_open = undecided.contains(&swinging);
        let rows = if is_open { Cow::Borrowed(rows) } else { Cow::Owned(without_rate(rows, swinging)) };
        let is_tried =
            |constants: &[usize]| in_vain.iter().any(|tried| constants.iter().all(|one| tried.contains(one)));
        let mut explained = None;
        if is_open && undecided.len() > 1 && decided.is_lost() {
            if is_tried(&undecided) {
                return Ok(false);
            }
            // Where all leave too much, one of them does.
            let Some(free) = self.swinging_freed(&rows, model, decided, &undecided)? else { return Ok(false) };
            if free.fit.is_some() && !leaves_little(decided, &free, NO_LESS) {
                return Ok(false);
            }
            explained = Some(free).filter(|free| is_explained(decided, free));
        }
        if !is_tried(&[swinging]) {
            let free = self.swinging_freed(&rows, model, decided, &[swinging])?;
            explained = free.filter(|free| is_explained(decided, free)).or(explained);
        }
        let Some(free) = explained else { return Ok(false) };
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

    /// What a record is with some constants set free, if that is worth following along all of it.
    fn swinging_freed(
        &mut self,
        rows: &Rows,
        model: &Model,
        decided: &Decided,
        constants: &[usize],
    ) -> Result<Option<Decided>, Error> {
        if self.is_hopeless(rows, model, decided, constants)? {
            return Ok(None);
        }
        let excess = (decided.error - 1.0).max(0.0);
        Ok(Some(self.freed(rows, model, decided, (constants, 1.0 + HOPELESS * excess))?))
    }

    /// Whether stretches of a long record say that it is not worth following some constants along all of it: even a curve of its own in each leaves too much
    /// of what noise does not explain. Only where windows are short, as they are that follow what is missing: stretches hold many of them.
    fn is_hopeless(
        &mut self,
        rows: &Rows,
        model: &Model,
        decided: &Decided,
        constants: &[usize],
    ) -> Result<bool, Error> {
        let (Some(stretches), Some(first)) = (stretches_of_rows(rows.len()), decided.first) else { return Ok(false) };
        let length = stretches.first().map_or(0, Range::len);
        let is_short = |scale: &Scale| scale.span() * slowly_varying::STRETCH <= length;
        let scales: Vec<Scale> = decided.scales.iter().copied().filter(|&scale| holds(scale)).collect();
        let Some(first) = Some(first).filter(is_short) else { return Ok(false) };
        let some = thinned_rows(rows, &stretches);
        let (noise, expected, instructions) = (self.noise[0], decided.expected, self.options.instructions);
        let problem = decided.model.problem(&some, &some.rhs, noise, None);
        let before = best_length(&problem, (&scales, &[first]), expected, instructions, &mut self.stages)?;
        let Some((_, before)) = before else { return Ok(false) };
        let rest: Vec<usize> = decided.model.constant.iter().copied().filter(|one| !constants.contains(one)).collect();
        let ordered = Model { constant: [constants, &rest].concat(), ..model.clone() };
        let starts: Vec<usize> = places_of(&stretches).iter().skip(1).map(|place| place.start).collect();
        let search = SlowSearch {
            rows: &some,
            model: &ordered,
            coefficients: constants.len(),
            scales: &scales,
            longest: decided.longest.map(|longest| longest.min(length)),
            ..self.slow_search(rows, &ordered, decided)
        };
        let most = if decided.is_lost() { LEFT_OF_SWINGS } else { HOPELESS };
        let jumps = (!rows.jumps.is_empty()).then_some(&some.jumps);
        for breaks in std::iter::once(&starts).chain(jumps) {
            let found = slowly_varying::find(&SlowSearch { breaks, ..search }, first, &mut self.stages)?;
            let Some(found) = found else { return Ok(false) };
            if found.error - 1.0 <= most * (before - 1.0) {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

/// Whether what was set free explains what constants leave.
fn is_explained(decided: &Decided, free: &Decided) -> bool {
    leaves_little(decided, free, 1.0) && (!decided.is_lost() || is_of_a_machine(free))
}

/// Whether it leaves hardly more than noise, or no more than so many times what may be left.
fn leaves_little(decided: &Decided, free: &Decided, times: f64) -> bool {
    let most = if decided.is_lost() { LEFT_WHERE_LOST } else { LEFT_OF_SWINGS };
    let excess = (decided.error - 1.0).max(0.0);
    free.error - 1.0 < times * most * excess && free.error < A_LITTLE_BETTER * decided.error
}

/// Whether what varies slowly is positive on average, as inertia and damping are: in bursts of one frequency a torque that is late is followed by curves of
/// both that are not.
fn is_of_a_machine(free: &Decided) -> bool {
    let Some(found) = &free.found else { return false };
    (0..free.slow.len()).all(|coefficient| found.varying.mean(coefficient) > 0.0)
}
