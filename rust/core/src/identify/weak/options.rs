//! The options of the weak form for one record.

use std::ops::Range;

use crate::identify::kinds::Kind;
use crate::identify::options::WidthFrom;
use crate::inference::missing_terms::Missing;
use crate::simd::instructions::Instructions;

/// How to identify.
#[derive(Clone, Debug)]
#[allow(clippy::struct_excessive_bools, reason = "each says one thing that is asked for, whatever the others say")]
pub(crate) struct WeakOptions {
    /// Seconds from one sample to the next.
    pub(crate) delta: f64,
    /// Samples on either side of a test function's centre; chosen from the spectra where not given.
    pub(crate) half_width: Option<usize>,
    /// Exponent of the test function; chosen likewise.
    pub(crate) exponent: Option<usize>,
    /// Samples that a window spans; chosen by cross-validation.
    pub(crate) regression_window: Option<usize>,
    /// Whether windows of many lengths, before, around and after a sample are averaged and, where nothing is windowed, equations are weighted by
    /// their noise; otherwise ordinary least squares in windows of one length.
    pub(crate) averaging: bool,
    /// Whether windowed coefficients may grow linearly within a window.
    pub(crate) linear: bool,
    /// How each unknown comes about: unknown coefficients in the order inertia, damping, stiffness, then terms.
    pub(crate) kinds: Vec<Kind>,
    /// Which of those that are automatic an earlier identification decided upon, in its order, and whether they change.
    pub(crate) decided: Vec<(usize, bool)>,
    /// Variances of the noise of angle and torque; estimated where not given.
    pub(crate) noise: [Option<f64>; 2],
    /// The variance of the torque's noise as equations show it; judged from the record where not given.
    pub(crate) shown_noise: Option<f64>,
    /// By how many samples the torque comes late; estimated where not given.
    pub(crate) lag: Option<f64>,
    /// Samples of a lag that is given which were not told where it was found in the record; nothing where it was not.
    pub(crate) found_lag: Option<f64>,
    /// Samples of the windows near which lengths are compared first, where an identification that this one repeats did so.
    pub(crate) near: Option<usize>,
    /// Where a test function that is given came from, if the record chose it.
    pub(crate) width_from: Option<WidthFrom>,
    /// About which angle the spring is relaxed: zero, or another one that is estimated from there on; where not given zero, unless the record
    /// contradicts that.
    pub(crate) angle_zero: Option<f64>,
    /// The step that the angle was rounded to, zero for none; looked for where not given.
    pub(crate) quantisation: Option<f64>,
    /// Every how many samples numbers are wanted.
    pub(crate) step: usize,
    /// The samples at which numbers are wanted; all if `None`. Averages over windows are not made for others.
    pub(crate) wanted: Option<Range<usize>>,
    /// Whether to look for what may have been left out, and for what not to look.
    pub(crate) diagnose: bool,
    /// What cannot be missing because it is there.
    pub(crate) not_missing: Vec<Missing>,
    /// Vector instructions.
    pub(crate) instructions: Instructions,
}
