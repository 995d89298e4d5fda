//! An offset that the record is to decide upon, and that is not constant: free in every window.
//!
//! A zero of the torque that drifts is nothing that a windowed stiffness may follow, but it does: a drift of 5 % of the torque moves it by half
//! a percent, one of 30 % by 1 to 26 %. Beside an offset that is free in every window it is as good as without a drift.

use crate::equation::rows::Rows;
use crate::error::Error;
use crate::identify::weak::angle_zero::outcome::FreeOffset;
use crate::identify::weak::choice::Chosen;
use crate::identify::weak::decide::{BADLY, BETTER};
use crate::identify::weak::lag::Settled;
use crate::identify::weak::session::Session;
use crate::inference::short_parts::LEFT_OF_SWINGS;
use crate::regression::limits::NOISE_MODEL_FAILS;
use crate::regression::model::Model;
use crate::weak_form::test_function::TestFunction;
use crate::weak_form::test_function_choice::spectrum_length;

/// Typical cycles that a record must last: in less than one a part of it does not tell an offset from the motion, and parts are eight.
const CYCLES: f64 = 8.0;

impl Session<'_, '_, '_> {
    /// Chooses and decides with an offset that is free in every window where the record is to decide upon it, and where parts of the record have
    /// other offsets, or noise does not explain what a constant one leaves and one seems to be `missed`. Otherwise, or if it is no better, what was
    /// found with a constant one: of the same rows, beside all that is set free there, it must leave far less, and rows that are not predicted badly.
    /// Where parts of the record differ it need only leave less, but far less where hardly a row is within the noise.
    pub(crate) fn with_windowed_offset(
        &mut self,
        model: &Model,
        offset: usize,
        constant: Settled,
        missed: bool,
    ) -> Result<Settled, Error> {
        let differs = constant.1.differs(offset);
        // What was set free since may explain what a free offset was missed for.
        self.free_offset.error = self.free_offset.error.min(constant.1.error);
        let fails = missed && constant.1.error > NOISE_MODEL_FAILS;
        if self.undecided_offset() != Some(offset) || !(differs || fails) {
            return Ok(constant);
        }
        let samples = self.record.angle.len();
        if (samples as f64) < CYCLES * self.evidence(spectrum_length(samples, 200))?.period() {
            return Ok(constant);
        }
        let before = (self.scan.clone(), self.record.lag, self.noise);
        self.windowed_offset = Some(offset);
        // What else is missing, such as a lag, is followed in part by anything that is free; beside a drift that is gone nothing more varies.
        self.most_slow = (!differs).then_some(constant.1.slow.len());
        let free = self.model();
        let chosen = self.choose(&free)?;
        let settled = self.decide_and_choose_again(chosen, &free)?;
        let error = settled.1.error;
        let explains = error < BADLY && !self.varies_too_much(&settled.1);
        // Where hardly a row is within the noise, parts differ by whatever is missing.
        let far_better = error < if constant.1.is_lost() { LEFT_OF_SWINGS * constant.1.error } else { f64::INFINITY };
        // Windows that are hardly longer than the test function follow anything, and most of all where an offset is free in them.
        let is_told = settled.1.fit.is_some() && !settled.1.has_windows_of_a_function(&settled.0.weak);
        let is_possible = is_told && (differs && far_better || explains);
        (self.windowed_offset, self.most_slow) = (None, None);
        // Errors are compared on the same rows: those that were chosen beside a constant offset are long enough to hide what drifts.
        let least = if differs { 1.0 } else { BETTER };
        let is_known = (self.record.lag, self.noise) == (before.1, before.2)
            && Searched::of(&constant).finds_what(&Searched::of(&settled))
            && constant.1.fit.is_some()
            && !constant.1.slow.is_empty();
        let beside = match is_possible {
            true if is_known => constant.1.error,
            true => self.error_beside_constant(&settled.0, model, &constant)?,
            false => 0.0,
        };
        if is_possible && error < least * beside {
            self.windowed_offset = Some(offset);
            self.free_offset = FreeOffset::default();
            return Ok(settled);
        }
        (self.scan, self.record.lag, self.noise) = before;
        Ok(constant)
    }

    /// The error of predicting rows beside a constant offset, with everything else that was set free there.
    fn error_beside_constant(
        &mut self,
        chosen: &Chosen,
        model: &Model,
        (_, decided, _): &Settled,
    ) -> Result<f64, Error> {
        if decided.slow.is_empty() {
            return self.error_of(chosen, model);
        }
        let weak = chosen.weak.clone();
        let mut same = Chosen { weak, fitted: None, fitted_before: None, ..*chosen };
        let found = self.decide(&mut same, model)?;
        Ok(if found.fit.is_some() { found.error } else { f64::INFINITY })
    }
}

/// Where what varies and jumps was searched, which takes longest of all.
#[derive(Clone, Copy)]
struct Searched<'a> {
    function: TestFunction,
    /// Rows, before those over jumps were left out.
    rows: &'a Rows,
    jumps: usize,
}

impl<'a> Searched<'a> {
    fn of((Chosen { weak, .. }, decided, _): &'a Settled) -> Self {
        let rows = decided.whole.as_ref().unwrap_or(&weak.rows);
        Self { function: weak.function, rows, jumps: weak.rows.jumps.len() }
    }

    /// Whether a search in rows of another would find the same: those of the same test function, with the same equations. More jumps that are known of the
    /// other might help it.
    fn finds_what(&self, other: &Self) -> bool {
        self.function == other.function && self.rows.usable == other.rows.usable && other.jumps <= self.jumps
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::simulated::rows;

    #[test]
    fn nothing_is_searched_twice_in_the_same_rows() {
        let function = |half: usize| TestFunction::new(half, 9, 1e-3).expect("a test function");
        let some = rows(200, |_| [1.0, 0.0], 0.1);
        let mut fewer = some.clone();
        fewer.exclude([50].into_iter());
        let one = Searched { function: function(11), rows: &some, jumps: 1 };
        assert!(one.finds_what(&one) && one.finds_what(&Searched { jumps: 0, ..one }));
        assert!(!one.finds_what(&Searched { jumps: 2, ..one }), "jumps that only the other knows may help");
        assert!(!one.finds_what(&Searched { function: function(12), ..one }));
        assert!(!one.finds_what(&Searched { rows: &fewer, ..one }));
    }
}
