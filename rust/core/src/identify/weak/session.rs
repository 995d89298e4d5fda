//! The working data of one record in weak form: its channels, its noise, and what every step needs of them.

use crate::equation::motion::{Coefficient, unknowns};
use crate::error::Error;
use crate::exec::memory;
use crate::exec::stages::Stages;
use crate::identify::kinds::Kind;
use crate::identify::scanned::Scan;
use crate::identify::weak::angle_zero::outcome::FreeOffset;
use crate::identify::weak::angle_zero::spring::STIFFNESS;
use crate::identify::weak::options::WeakOptions;
use crate::regression::constants::Expected;
use crate::regression::fit::Fit;
use crate::regression::model::Model;
use crate::regression::row_covariance::RowCovariance;
use crate::regression::window_length::Scale;
use crate::weak_form::test_function::{LEAST_HALF_WIDTH, TestFunction};
use crate::weak_form::weak_rows::{Record, TermSamples, WeakRows, mean};

/// Numbers that are kept of a row at most: in any case, for every unknown, and for every pair of windowed ones.
const NUMBERS: usize = 20;
const NUMBERS_OF_AN_UNKNOWN: usize = 10;
const NUMBERS_OF_A_PAIR: usize = 12;

/// One record under work.
pub(crate) struct Session<'a, 'b, 'c> {
    pub(crate) record: Record<'a>,
    pub(crate) options: &'a WeakOptions,
    /// Variances of the noise of angle and torque that decisions are made with, and those that the channels show by themselves.
    pub(crate) noise: [f64; 2],
    pub(crate) channel_noise: [f64; 2],
    /// Variance of the torque's noise at the highest frequencies: a filter of the torque alone left less there.
    pub(crate) highest_noise: f64,
    /// Whether the noise of the angle is that of its rounding: in slow motion it lasts, so that parts of the record scatter more than white noise says.
    pub(crate) is_rounding: bool,
    /// Cycles per sample up to which both channels show the same motion, where one was low-passed, or both alike, and the width of the test function is
    /// to be chosen.
    pub(crate) shared_until: Option<f64>,
    /// Estimates by the width of the test function.
    pub(crate) scan: Scan,
    /// The half-width that the spectra suggest, where widths that agree are narrower.
    pub(crate) suggested: Option<usize>,
    /// How much better an offset would predict that is free in every window, where the record contradicts a constant one.
    pub(crate) free_offset: FreeOffset,
    /// The offset that the record was to decide upon and that is free in every window.
    pub(crate) windowed_offset: Option<usize>,
    /// Coefficients that may vary slowly at most, where an equation is of no use if more do.
    pub(crate) most_slow: Option<usize>,
    /// What was found to change beside constants alone, and is followed in windows.
    pub(crate) followed: Option<usize>,
    /// Samples of the windows that were best a step before, where little changed since: the best ones are near.
    pub(crate) best_before: Option<usize>,
    /// Whether few rows of many compare lengths of windows.
    pub(crate) is_rough: bool,
    pub(crate) stages: Stages<'b, 'c>,
}

/// Which coefficients of the motion are constant whatever is found: those that are known, and those that nothing else was asked of.
pub(crate) fn always_constant(coefficients: &[Coefficient<'_>; 3], kinds: &[Kind]) -> [bool; 3] {
    let mut kinds = kinds.iter();
    let is_constant =
        |one: &Coefficient<'_>| !matches!(one, Coefficient::Unknown) || kinds.next() == Some(&Kind::Constant);
    coefficients.each_ref().map(is_constant)
}

impl Session<'_, '_, '_> {
    /// Regressors of the unknowns: coefficients that are not known, then terms.
    pub(crate) fn unknowns(&self) -> Vec<usize> {
        unknowns(&self.record.coefficients, self.record.terms.len())
    }

    /// Regressors of the unknowns of a kind.
    pub(crate) fn of_kind(&self, kind: Kind) -> Vec<usize> {
        let each = self.unknowns().into_iter().zip(self.kinds());
        each.filter(|(_, one)| *one == kind).map(|(unknown, _)| unknown).collect()
    }

    /// The kinds of the unknowns, as far as they are known by now.
    fn kinds(&self) -> Vec<Kind> {
        let of = |(unknown, &kind): (usize, &Kind)| {
            let is_windowed = [self.windowed_offset, self.followed].contains(&Some(unknown));
            if is_windowed { Kind::Windowed } else { kind }
        };
        self.unknowns().into_iter().zip(&self.options.kinds).map(of).collect()
    }

    /// Regressors of the coefficients that the record is to decide upon.
    pub(crate) fn undecided(&self) -> Vec<usize> {
        self.open().filter(|&unknown| unknown < self.record.coefficients.len()).collect()
    }

    /// The regressor of the offset, if the record is to decide upon it.
    pub(crate) fn undecided_offset(&self) -> Option<usize> {
        self.offset().filter(|&offset| self.open().any(|unknown| unknown == offset))
    }

    /// The regressor of the offset, if there is one.
    pub(crate) fn offset(&self) -> Option<usize> {
        let place = self.record.terms.iter().position(|term| matches!(term, TermSamples::One))?;
        Some(self.record.coefficients.len() + place)
    }

    /// Regressors of the unknowns that the record is to decide upon.
    fn open(&self) -> impl Iterator<Item = usize> {
        let is_decided = |unknown: &usize| self.options.decided.iter().any(|(one, _)| one == unknown);
        self.of_kind(Kind::Automatic).into_iter().filter(move |unknown| !is_decided(unknown))
    }

    /// Takes over that an identification which this one repeats found the offset free beside a windowed stiffness.
    pub(crate) fn repeat_windowed_offset(&mut self) {
        let decided = |offset: &usize| self.options.decided.contains(&(*offset, true));
        self.windowed_offset =
            self.offset().filter(decided).filter(|_| self.of_kind(Kind::Windowed).contains(&STIFFNESS));
    }

    /// Whether the lag of the torque is found in the record, here or by an identification that this one repeats.
    pub(crate) fn finds_lag(&self) -> bool {
        self.options.lag.is_none() || self.options.found_lag.is_some()
    }

    pub(crate) fn model(&self) -> Model {
        let windowed = self.kinds().into_iter().map(|kind| kind == Kind::Windowed);
        Model::new(&self.unknowns(), windowed, self.options.linear)
    }

    /// Inertia, damping and stiffness as far as a fit knows them.
    pub(crate) fn parameters(&self, model: &Model, fit: &Fit) -> [f64; 3] {
        std::array::from_fn(|index| match self.record.coefficients[index] {
            Coefficient::Number(number) => number,
            Coefficient::Record(known) => mean(known),
            Coefficient::Unknown => {
                let constant = model.constant.iter().position(|&one| one == index);
                let windowed = model.windowed.iter().position(|&one| one == index);
                let value = constant.map(|place| fit.pooled.values[place]);
                let value = value.or(windowed.map(|place| fit.median(place))).unwrap_or(0.0);
                if index == 1 { value.max(0.0) } else { value }
            }
        })
    }

    /// The rows' covariance as the noise of both channels makes it, and what windows are expected to leave.
    pub(crate) fn covariance(&self, weak: &WeakRows, parameters: [f64; 3]) -> (RowCovariance, Expected) {
        Self::covariance_of_noise(self.noise, weak, parameters)
    }

    /// The same of some noise of angle and torque.
    pub(crate) fn covariance_of_noise(
        noise: [f64; 2],
        weak: &WeakRows,
        parameters: [f64; 3],
    ) -> (RowCovariance, Expected) {
        let known = RowCovariance::known(&weak.noise, &weak.torque, parameters, noise, weak.stride);
        let torque = RowCovariance::known(&weak.noise, &weak.torque, [0.0; 3], noise, weak.stride).variance();
        let expected = Expected::new(&known, torque);
        (known, expected)
    }

    pub(crate) fn too_short(&self) -> Error {
        let samples = self.record.angle.len();
        let least = match self.options.half_width {
            // The shortest windows on both sides of a row that keep a test function apart.
            Some(half) => {
                let stride = TestFunction::stride_of(half);
                2 * half + 1 + (Scale::fewest_rows(half.div_ceil(stride)) - 1) * stride
            }
            None if self.model().windowed.is_empty() => 8 * LEAST_HALF_WIDTH,
            None => 16 * LEAST_HALF_WIDTH,
        };
        Error::RecordTooShortForWindows { samples, least: least.max(samples + 1) }
    }

    /// Builds the rows, if there is the memory for all that will be known of them.
    pub(crate) fn rows(&mut self, function: TestFunction) -> Result<WeakRows, Error> {
        let (unknowns, windowed) = (self.unknowns().len(), self.of_kind(Kind::Windowed).len());
        // Measured: 29 numbers a row with one unknown of four windowed, 146 with three.
        let numbers = NUMBERS + NUMBERS_OF_AN_UNKNOWN * unknowns + NUMBERS_OF_A_PAIR * windowed * windowed;
        memory::ask_for_numbers((self.record.angle.len() / function.stride()).saturating_mul(numbers))?;
        let (delta, workers) = (self.options.delta, self.stages.workers);
        let mut record = self.record.clone();
        if self.finds_lag() {
            record.terms.push(TermSamples::TorqueRate);
        }
        self.stages.stage(|watch| WeakRows::build(&record, function, delta, None, workers, watch))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_known_or_asked_for_as_constant_stays_so() {
        use Coefficient::{Number, Unknown};
        let found = |coefficients: [Coefficient<'_>; 3], kinds: &[Kind]| always_constant(&coefficients, kinds);
        let kinds = [Kind::Automatic, Kind::Constant, Kind::Windowed, Kind::Constant];
        assert_eq!(found([Unknown; 3], &kinds), [false, true, false]);
        assert_eq!(found([Unknown, Number(0.1), Unknown], &kinds), [false, true, true]);
        assert_eq!(found([Number(1.0); 3], &[]), [true; 3]);
        assert_eq!(found([Unknown; 3], &[Kind::Varying; 3]), [false; 3]);
    }
}
