//! What is identified together: trials, their channels, and the unknowns that their equations share.
//!
//! The equation of mass `e` is `Σ_u x_u Σ_entries factor · regressor = f_e`, a regressor being a derivative of any of the angles, or a term
//! given at every sample. An unknown that appears in several equations ties them: the constant of a spring between two masses does so.

use crate::identify::kinds::Kind;
use crate::record::samples::Samples;
use crate::simd::instructions::Instructions;

/// What an unknown is multiplied with in an equation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Multiplied {
    /// A derivative of an angle: 0 its acceleration, 1 its velocity, 2 the angle itself.
    Motion {
        /// Which angle.
        channel: usize,
        /// Of inertia (0), damping (1) or stiffness (2).
        coefficient: usize,
    },
    /// One of the terms that are given at every sample.
    Term(usize),
}

/// Where an unknown appears.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Which equation.
    pub equation: usize,
    /// What it is multiplied with there.
    pub of: Multiplied,
    /// By how much more.
    pub factor: f64,
}

/// A coefficient of the equations.
#[derive(Clone, Debug)]
pub struct Element {
    /// Where it appears.
    pub entries: Vec<Entry>,
    /// Its value, where it is known.
    pub known: Option<f64>,
    /// How it comes about otherwise.
    pub kind: Kind,
}

impl Element {
    /// Whether it multiplies motion, and is no term.
    pub(crate) fn is_of_motion(&self) -> bool {
        self.entries.iter().any(|entry| matches!(entry.of, Multiplied::Motion { .. }))
    }
}

/// The channels of one trial, all of the same length.
#[derive(Clone)]
pub struct Trial<'a> {
    /// The angles of all masses, and of what else moves.
    pub angles: Vec<&'a dyn Samples>,
    /// The torque on every mass, one for each equation.
    pub torques: Vec<&'a dyn Samples>,
    /// Terms, sample by sample.
    pub terms: Vec<&'a dyn Samples>,
    /// Where a sample may be the centre of an equation; everywhere if `None`.
    pub mask: Option<&'a [bool]>,
    /// One over the variance of every sample's noise, as a part of that of a sample of weight one; all alike if `None`.
    pub weights: Option<&'a [f64]>,
    /// The sample of the result that every sample belongs to, growing; the samples count themselves if `None`.
    pub position: Option<&'a [f64]>,
}

/// What is identified together.
#[derive(Clone)]
pub struct Merged<'a> {
    /// Trials that share all parameters.
    pub trials: Vec<Trial<'a>>,
    /// Coefficients of their equations.
    pub elements: Vec<Element>,
    /// Samples of the result: those of the longest trial, where they count themselves.
    pub samples: usize,
}

/// How it is identified. What is `None` is chosen from the records.
#[derive(Clone, Debug)]
pub struct MergedOptions {
    /// Seconds from one sample to the next.
    pub delta: f64,
    /// Samples of the test function, odd.
    pub window_length: Option<usize>,
    /// Exponent of the test function.
    pub exponent: Option<usize>,
    /// Samples whose equations are solved together.
    pub regression_window: Option<usize>,
    /// Variances of the noise of every angle and of every torque.
    pub noise: Option<(Vec<f64>, Vec<f64>)>,
    /// Every how many samples numbers are wanted.
    pub step: usize,
    /// Vector instructions.
    pub instructions: Instructions,
}

impl Merged<'_> {
    /// Number of equations: masses whose force is known.
    pub(crate) fn equations(&self) -> usize {
        self.trials.first().map_or(0, |trial| trial.torques.len())
    }

    /// Number of angles.
    pub(crate) fn channels(&self) -> usize {
        self.trials.first().map_or(0, |trial| trial.angles.len())
    }

    /// Places of the unknown elements.
    pub(crate) fn unknowns(&self) -> Vec<usize> {
        (0..self.elements.len()).filter(|&place| self.elements[place].known.is_none()).collect()
    }

    /// Rows that stand side by side: of all equations of all trials at one time.
    pub(crate) fn group(&self) -> usize {
        self.trials.len() * self.equations()
    }
}
