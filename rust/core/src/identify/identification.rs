//! The result of one record, whatever its route.

use std::ops::Range;

use crate::identify::kinds::Kind;
use crate::identify::options::WidthFrom;
use crate::identify::scanned::Scan;
use crate::identify::weak::angle_zero::outcome::AngleZero;
use crate::identify::weak::angle_zero::outcome::FreeOffset;
use crate::identify::weak::lag::Lag;
use crate::identify::weak::outside_mask::Outside;
use crate::inference::constancy::Test;
use crate::inference::missing_terms::Suspect;
use crate::noise::defects::Defect;
use crate::status::Status;

/// What was found of one unknown. Places of unknowns count coefficients that are not known, then terms.
#[derive(Clone, Debug)]
pub struct Unknown {
    /// Which unknown of the equation of motion it is: 0 inertia, 1 damping, 2 stiffness, then terms.
    pub number: usize,
    /// How it came about in the end.
    pub kind: Kind,
    /// One value for every wanted sample, or one for the record.
    pub values: Vec<f64>,
    /// Their standard errors without [`Unknown::factor`]; [`Unknown::stderr`] has it.
    pub unscaled_stderr: Vec<f64>,
    /// What these are multiplied by: one, unless they are those of ordinary least squares, whose equations are correlated.
    pub factor: f64,
    /// The part of their variances that all samples have in common, as the constants beside a windowed unknown pass it on: one where it is not known
    /// to be less.
    pub in_common: f64,
    /// Whether it is the same in all parts of the record, where that was tested.
    pub test: Option<Test>,
    /// Whether the record was to decide, and the form cannot ask it.
    pub untested: bool,
}

impl Unknown {
    /// A value for the record.
    pub(crate) fn constant(number: usize, value: f64, stderr: f64) -> Self {
        Self {
            number,
            kind: Kind::Constant,
            values: vec![value],
            unscaled_stderr: vec![stderr],
            factor: 1.0,
            in_common: 1.0,
            test: None,
            untested: false,
        }
    }

    /// Values for every wanted sample, with standard errors and what those are multiplied by.
    pub(crate) fn windowed(number: usize, values: Vec<f64>, unscaled_stderr: Vec<f64>, factor: f64) -> Self {
        Self { kind: Kind::Windowed, values, unscaled_stderr, factor, ..Self::constant(number, f64::NAN, f64::NAN) }
    }

    /// Standard errors: one for every wanted sample, or one for the record.
    #[must_use]
    pub fn stderr(&self) -> Vec<f64> {
        self.unscaled_stderr.iter().map(|error| self.factor * error).collect()
    }

    /// Whether it has one value for the record.
    #[must_use]
    pub fn is_constant(&self) -> bool {
        self.kind == Kind::Constant
    }
}

/// The covariance of two coefficients, before factors.
#[derive(Clone, Debug)]
pub struct Covariance {
    /// Places of the unknowns.
    pub pair: (usize, usize),
    /// One value for every wanted sample, or one for the record.
    pub values: Vec<f64>,
}

/// What only the weak form says.
#[derive(Clone, Debug)]
pub struct WeakDetails {
    /// Variances of the noise of angle and torque.
    pub noise: [f64; 2],
    /// The variance of the torque's noise that everything was chosen with: that of the channel, or what the equations leave if that is more.
    pub shown_noise: f64,
    /// Lengths of windows that were tried, in samples, and the error of predicting a row with each, over the noise's.
    pub lengths: Vec<(usize, f64)>,
    /// Mean squared error of predicting a row from others, over the noise's.
    pub prediction_error: f64,
    /// Whether equations were weighted by the inverse of their noise's covariance.
    pub weighted: bool,
    /// Samples that coefficients which change slowly are taken from; `None` if there are none.
    pub pooling: Option<f64>,
    /// Condition number of the equations for the constants; infinite where they are not determined.
    pub condition: f64,
    /// How much each constant takes part in the combination that is determined worst, its column scaled to a norm of one.
    pub weakest: Vec<f64>,
    /// Whether that combination is mostly the angle's noise.
    pub mostly_noise: bool,
    /// Whether the motion explains no more of the torque than chance, so that nothing is determined.
    pub unexplained: bool,
    /// Where the test function came from; `None` if it was given.
    pub width_from: Option<WidthFrom>,
    /// Samples of the windows near which lengths were compared, where not all were.
    pub near: Option<usize>,
    /// Places of the unknowns that change, in the order in which they were found to.
    pub changing: Vec<usize>,
    /// The lag that was estimated; `None` if it was given or is not determined.
    pub lag: Option<Lag>,
    /// Samples of a lag that are not told beyond that, which errors of the unknowns hold: the search for it did not settle.
    pub untold_lag: f64,
    /// The angle at which the spring is relaxed, where a constant offset was contradicted and this predicts better.
    pub angle_zero: Option<AngleZero>,
    /// How much better an offset would predict that is free in every window, where the record contradicts a constant one.
    pub free_offset: FreeOffset,
    /// What may have been left out.
    pub suspects: Vec<Suspect>,
    /// What unknowns that do not belong to windows change by with every sample that the torque is later.
    pub with_lag: Vec<(usize, f64)>,
    /// What was done to angle and torque, then velocity and acceleration where they were measured: clipped, held, interpolated, wrapped or filtered samples.
    pub defects: Vec<Vec<Defect>>,
    /// The part of the record that rests, where a term of friction asks for it: equations there say nothing of friction and are left out.
    pub resting: f64,
    /// Samples of pulses of the stiffness: the first, and the first after it. Both are among the jumps.
    pub pulses: Vec<Range<usize>>,
    /// Samples that stand out of their neighbours: the channel (0 for the angle, 1 for the torque), the sample, and what took its place, NaN where it
    /// was left out.
    pub spikes: Vec<(usize, usize, f64)>,
    /// Samples before which some were lost: they count as missing.
    pub lost: Vec<usize>,
    /// Values at which angle and torque are clipped, where samples there count as missing: the smallest and the largest.
    pub limits: [Option<[f64; 2]>; 2],
    /// Samples of angle and torque at which they hold one value in place of a reading: they count as missing.
    pub unread: [Vec<usize>; 2],
    /// Estimates by the width of the test function.
    pub scan: Scan,
    /// What the rows say that the mask keeps out; `None` without a mask.
    pub outside_mask: Option<Outside>,
}

/// What is found in one record. Numbers that concern a sample have one element for every wanted sample, or one where they are the same everywhere.
#[derive(Clone, Debug)]
pub struct Identification {
    /// Samples of the test function, or of the windows of the polynomials.
    pub window_length: usize,
    /// Exponent of the test function; `None` in strong form.
    pub exponent: Option<usize>,
    /// Samples whose equations are solved together.
    pub regression_window: usize,
    /// What was found of each unknown.
    pub unknowns: Vec<Unknown>,
    /// Covariances of all pairs of unknown coefficients.
    pub covariances: Vec<Covariance>,
    /// Condition number of the equations.
    pub condition: Vec<f64>,
    /// Standard deviation of the residuals of the torque.
    pub residual_std: Vec<f64>,
    /// What holds at every wanted sample.
    pub status: Vec<Status>,
    /// What holds for the whole record.
    pub record_status: Status,
    /// Order of the polynomial around every wanted sample; empty in weak form.
    pub order: Vec<u8>,
    /// Samples before which windowed coefficients jump.
    pub jumps: Vec<usize>,
    /// What only the weak form says.
    pub weak: Option<WeakDetails>,
}

impl Identification {
    /// The inertia; `None` if it was known.
    #[must_use]
    pub fn inertia(&self) -> Option<&Unknown> {
        self.unknown(0)
    }

    /// The damping; `None` if it was known.
    #[must_use]
    pub fn damping(&self) -> Option<&Unknown> {
        self.unknown(1)
    }

    /// The stiffness; `None` if it was known.
    #[must_use]
    pub fn stiffness(&self) -> Option<&Unknown> {
        self.unknown(2)
    }

    /// The factor of a term, counted in the order in which terms were given.
    #[must_use]
    pub fn term(&self, place: usize) -> Option<&Unknown> {
        self.unknown(3 + place)
    }

    fn unknown(&self, number: usize) -> Option<&Unknown> {
        self.unknowns.iter().find(|unknown| unknown.number == number)
    }
}
