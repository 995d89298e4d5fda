//! The result of one record in weak form.

use std::ops::Range;

use crate::identify::options::WidthFrom;
use crate::identify::results::{Constant, SampleResults};
use crate::identify::scanned::Scan;
use crate::identify::weak::angle_zero::outcome::AngleZero;
use crate::identify::weak::angle_zero::outcome::FreeOffset;
use crate::identify::weak::lag::Lag;
use crate::identify::weak::outside_mask::Outside;
use crate::inference::missing_terms::Suspect;
use crate::noise::defects::Defect;
use crate::status::Status;
use crate::weak_form::test_function::TestFunction;

/// What was found in one record.
#[derive(Clone, Debug)]
pub(crate) struct WeakIdentified {
    /// The test function.
    pub(crate) function: TestFunction,
    /// Where it came from, if the record chose it.
    pub(crate) width_from: Option<WidthFrom>,
    /// Variances of the noise of angle and torque.
    pub(crate) noise: [f64; 2],
    /// The variance of the torque's noise that everything was chosen with.
    pub(crate) shown_noise: f64,
    /// Samples spanned by the windows that windowed unknowns are eliminated in: those that predict best where none were given.
    pub(crate) regression_window: usize,
    /// Samples of the windows near which they were compared, where not all were.
    pub(crate) near: Option<usize>,
    /// Lengths of windows that were tried, in samples, and how well each predicts.
    pub(crate) lengths: Vec<(usize, f64)>,
    /// Mean squared error of predicting a row from others, over the noise's.
    pub(crate) prediction_error: f64,
    /// Whether equations were weighted by the inverse of their covariance: where nothing changes and the noise explains what is left.
    pub(crate) weighted: bool,
    /// Samples that coefficients which change slowly are taken from.
    pub(crate) pooling: Option<f64>,
    /// What turned out to be constant.
    pub(crate) constants: Vec<Constant>,
    /// The covariance of the constants, row by row.
    pub(crate) covariance: Vec<f64>,
    /// Condition number of the equations for the constants; infinite where they are not determined.
    pub(crate) condition: f64,
    /// How much each constant takes part in the combination that is determined worst, its column scaled to a norm of one.
    pub(crate) weakest: Vec<f64>,
    /// Whether that combination is mostly the angle's noise.
    pub(crate) mostly_noise: bool,
    /// Whether the motion explains no more of the torque than chance, so that nothing is determined.
    pub(crate) unexplained: bool,
    /// What may have been left out.
    pub(crate) suspects: Vec<Suspect>,
    /// The estimated lag, or `None` if it was given or is not determined.
    pub(crate) lag: Option<Lag>,
    /// Samples of it that are not told beyond its error beside what the equations hold: the search for it did not settle.
    pub(crate) untold_lag: f64,
    /// Samples by which a lag that was found may be wrong since steps of the torque may lie anywhere between two samples.
    pub(crate) lag_of_steps: f64,
    /// Which channel is filtered by more than the lag explains, and by which part of them constants may be wrong by that, if one is.
    pub(crate) filtered: Option<(usize, f64)>,
    /// The angle at which the spring is relaxed, or `None` if it was not needed.
    pub(crate) angle_zero: Option<AngleZero>,
    /// How much better an offset would predict that is free in every window.
    pub(crate) free_offset: FreeOffset,
    /// What the torque seems to be late by, the lag that was given with it; nothing where nobody asked.
    pub(crate) late: Option<Lag>,
    /// What unknowns that do not belong to windows change by with every sample that the torque is later.
    pub(crate) with_lag: Vec<(usize, f64)>,
    /// What the rows say that the mask keeps out; nothing without a mask.
    pub(crate) outside_mask: Option<Outside>,
    /// Unknowns that change, in the order of the values at the samples.
    pub(crate) changing: Vec<usize>,
    /// The part of their variances that all samples have in common; empty where nothing is known at samples.
    pub(crate) in_common: Vec<f64>,
    /// Pairs of constants and their covariance.
    pub(crate) constant_pairs: Vec<(usize, usize, f64)>,
    /// Pairs of unknowns whose covariances are at the samples.
    pub(crate) pairs: Vec<(usize, usize)>,
    /// Samples before which windowed parameters jump.
    pub(crate) jumps: Vec<usize>,
    /// Samples of pulses of the stiffness, whose ends are among the jumps.
    pub(crate) pulses: Vec<Range<usize>>,
    /// Samples that stand out of their neighbours: the channel, the sample, and what took its place, NaN where it was left out.
    pub(crate) spikes: Vec<(usize, usize, f64)>,
    /// Samples before which some were lost, and values at which angle and torque are clipped: such samples count as missing.
    pub(crate) lost: Vec<usize>,
    pub(crate) limits: [Option<[f64; 2]>; 2],
    /// Samples of angle and torque at which they were not read: they count as missing.
    pub(crate) unread: [Vec<usize>; 2],
    /// Estimates by the width of the test function.
    pub(crate) scan: Scan,
    /// What was done to angle, torque and other channels.
    pub(crate) defects: Vec<Vec<Defect>>,
    /// The part of the record that rests, where a term of friction asks for it.
    pub(crate) resting: f64,
    /// What holds for the whole record.
    pub(crate) record_status: Status,
    /// Numbers at the samples.
    pub(crate) results: SampleResults,
}
