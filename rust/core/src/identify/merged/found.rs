//! What is found of merged rows.

use crate::identify::kinds::Kind;
use crate::identify::merged::suspected_terms::SuspectedTerm;
use crate::identify::results::{Constant, SampleResults};
use crate::identify::scanned::Scan;
use crate::inference::constancy::Test;
use crate::inference::missing_terms::Suspect;
use crate::noise::defects::Defect;
use crate::status::Status;

/// What was found of one unknown element.
#[derive(Clone, Debug)]
pub struct FoundElement {
    /// Its place among the elements.
    pub element: usize,
    /// Constant or windowed.
    pub kind: Kind,
    /// One value for the record, or one for every wanted sample.
    pub values: Vec<f64>,
    /// Standard errors.
    pub stderr: Vec<f64>,
    /// Whether it is the same in all parts of the record, where that was tested.
    pub test: Option<Test>,
    /// By how much each trial alone differs from all of them, with its standard error; nothing with a single trial.
    pub spread: Vec<(f64, f64)>,
}

/// What was found of everything.
#[derive(Clone, Debug)]
pub struct MergedFound {
    /// Samples of the test function, and its exponent.
    pub window_length: usize,
    /// Its exponent.
    pub exponent: usize,
    /// Samples whose equations are solved together.
    pub regression_window: usize,
    /// Lengths of windows that were tried, in samples, and the error of predicting a row with each, over the noise's.
    pub lengths: Vec<(usize, f64)>,
    /// Mean squared error of predicting a row from others, over the noise's.
    pub prediction_error: f64,
    /// How many times its noise is left of an equation without a torque, which any multiple of its parameters satisfies, at most; 1 where all
    /// are explained.
    pub misfit: f64,
    /// Whether windows leave what all trials have in common at one time: something changes faster than they follow.
    pub changes_in_common: bool,
    /// Variances of the noise of every angle and every torque.
    pub noise: (Vec<f64>, Vec<f64>),
    /// How many times as strong the noise of every angle, and then of every torque, is at the lowest frequencies as at the highest, where those variances
    /// are read.
    pub colours: Vec<f64>,
    /// What was found of every unknown, in the order of the elements.
    pub elements: Vec<FoundElement>,
    /// Places of the constants among the unknowns, and their covariance, row by row.
    pub constants: Vec<usize>,
    /// Their covariance, row by row.
    pub covariance: Vec<f64>,
    /// Pairs of elements of which one is windowed, and their covariances at every wanted sample.
    pub pairs: Vec<(usize, usize)>,
    /// Their covariances.
    pub covariances: Vec<Vec<f64>>,
    /// Condition number of the equations for the constants; infinite where they are not determined.
    pub condition: f64,
    /// How much each constant takes part in the combination that is determined worst, its column scaled to a norm of one.
    pub weakest: Vec<f64>,
    /// Standard deviation of what is left, over the noise's, at every wanted sample.
    pub residual: Vec<f64>,
    /// What holds at every wanted sample.
    pub status: Vec<Status>,
    /// What holds for the whole record.
    pub record_status: Status,
    /// Samples before which windowed elements jump.
    pub jumps: Vec<usize>,
    /// Estimates by the width of the test function; empty where something is windowed or the width was given.
    pub scan: Scan,
    /// What was done to channels, angles before torques.
    pub defects: Vec<(usize, Defect)>,
    /// Channels that may be late, angles before torques, and by how many samples they seem to be.
    pub late: Vec<(usize, Suspect)>,
    /// Angles that no equation is of whose gain seems to be wrong, and the part of themselves that they lack.
    pub lacking: Vec<(usize, Suspect)>,
    /// Terms that equations seem to lack.
    pub terms: Vec<SuspectedTerm>,
}

impl MergedFound {
    /// Elements that are constants.
    pub(crate) fn constants_found(&self) -> Vec<Constant> {
        let constants = self.elements.iter().filter(|one| one.kind == Kind::Constant);
        constants
            .map(|one| Constant { unknown: one.element, value: one.values[0], error: one.stderr[0], test: None })
            .collect()
    }

    /// Takes the numbers at the samples.
    pub(crate) fn take(&mut self, windowed: &[usize], mut results: SampleResults) {
        for (place, &element) in windowed.iter().enumerate() {
            let Some(found) = self.elements.iter_mut().find(|one| one.element == element) else { continue };
            found.values = std::mem::take(&mut results.values[place]);
            found.stderr = std::mem::take(&mut results.errors[place]);
        }
        self.covariances = results.covariances;
        self.residual = results.deviation;
        self.status = Status::of_column(results.status);
    }
}
