//! The options of identification.

use std::ops::Range;

use crate::equation::motion::Motion;
use crate::identify::kinds::Kind;
use crate::local_polynomials::plan::LocalPolynomials;
use crate::simd::instructions::Instructions;

/// Which equations are made of a record.
#[derive(Clone, Debug)]
pub enum Method<'a> {
    /// The equation of motion multiplied by a test function and integrated by parts.
    Weak(WeakForm),
    /// The equation of motion at every sample, with derivatives of local polynomials.
    Strong(StrongForm<'a>),
}

/// Settings of the weak form. What is `None` is chosen from the record.
#[derive(Clone, Debug)]
pub struct WeakForm {
    /// Samples of the test function, odd.
    pub window_length: Option<usize>,
    /// Exponent of the test function.
    pub exponent: Option<usize>,
    /// Samples whose equations are solved together.
    pub regression_window: Option<usize>,
    /// Whether windows of many lengths, before, around and after a sample are averaged and, where nothing is windowed, equations are weighted by
    /// their noise; otherwise ordinary least squares in windows of one length.
    pub averaging: bool,
    /// Whether windowed coefficients may grow linearly within a window.
    pub linear: bool,
    /// Variances of the noise of angle and torque.
    pub noise: [Option<f64>; 2],
    /// The variance of the torque's noise as equations show it; judged from the record where not given.
    pub shown_noise: Option<f64>,
    /// What else an earlier identification of the record tells.
    pub repeated: Repeated,
}

/// Where a test function came from that a record chose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WidthFrom {
    /// The spectra suggest it.
    Spectra,
    /// They do, and it is the narrowest or the widest of those that were tried.
    End,
    /// Other widths than the one that they suggest agree.
    Plateau,
}

/// What an earlier identification of a record was asked and found, beside what is given to one that repeats it: without it choices that are given would
/// count as certain, and be judged as if nothing else had been asked.
#[derive(Clone, Debug, Default)]
pub struct Repeated {
    /// Places of the unknowns whose kinds were automatic, and which it decided as they are given now: those that change in the order in which they were
    /// found to.
    pub tested: Vec<usize>,
    /// Samples of the windows near which lengths were compared, where not all were.
    pub near: Option<usize>,
    /// Where the test function came from; `None` where it was given.
    pub width_from: Option<WidthFrom>,
    /// Where the lag that is given was found in the record, so that errors hold its own: the samples of it that were not told, as the search did not
    /// settle.
    pub found_lag: Option<f64>,
}

impl Default for WeakForm {
    fn default() -> Self {
        Self {
            window_length: None,
            exponent: None,
            regression_window: None,
            averaging: true,
            linear: true,
            noise: [None; 2],
            shown_noise: None,
            repeated: Repeated::default(),
        }
    }
}

/// Settings of the strong form.
#[derive(Clone, Debug)]
pub struct StrongForm<'a> {
    /// The plan for the angle and its first two derivatives.
    pub derivatives: &'a LocalPolynomials,
    /// Rows that are solved together.
    pub regression_window: usize,
    /// Whether the torque is smoothed by polynomials of the orders chosen for the angle.
    pub filter_torque: bool,
    /// Whether windowed coefficients may grow linearly within a window.
    pub linear: bool,
}

/// One record to identify.
#[derive(Clone)]
pub struct Task<'a> {
    /// Its equation of motion.
    pub motion: Motion<'a>,
    /// Where a sample may be the centre of an equation; everywhere if `None`.
    pub mask: Option<&'a [bool]>,
    /// One over the variance of every sample's noise, relative to the others; all alike if `None`. Samples of weight zero must be missing in the channels.
    pub weights: Option<&'a [f64]>,
    /// Which equations are made.
    pub method: Method<'a>,
    /// By how many samples the torque comes late; estimated if `None`, which the weak form can.
    pub lag: Option<f64>,
    /// About which angle the spring is relaxed, in weak form beside a constant offset: zero, or another angle that is then estimated from
    /// there on; if `None` it is zero unless the record contradicts that.
    pub angle_zero: Option<f64>,
}

/// What is the same for all records of a call.
#[derive(Clone, Debug)]
pub struct Options {
    /// Seconds from one sample to the next.
    pub delta: f64,
    /// How each unknown comes about: unknown coefficients in the order inertia, damping, stiffness, then terms.
    pub kinds: Vec<Kind>,
    /// The step that the angle was rounded to, zero for none; looked for if `None`. Only the weak form asks for it: the plan of the strong form
    /// has its own.
    pub quantisation: Option<f64>,
    /// Whether windows that hold a missing sample have no number, rather than one from their other samples.
    pub propagate: bool,
    /// Every how many samples numbers are wanted.
    pub step: usize,
    /// The samples at which numbers are wanted; all if `None`. Of a record in strong form whose windows are wanted for a part only what
    /// [`around`](crate::identify::around()) says need be there, and standard errors are those of ordinary least squares. The weak form looks at
    /// all of the record, and may leave other samples without numbers.
    pub wanted: Option<Range<usize>>,
    /// Whether to look for terms that may have been left out.
    pub diagnose: bool,
    /// Vector instructions.
    pub instructions: Instructions,
}
