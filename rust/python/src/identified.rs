//! What an identification returns: frozen classes with a name for every number.

use std::collections::HashMap;

use numpy::PyArray1;
use pyo3::prelude::*;
use tvident::Status;
use tvident::identify::{
    FreeOffset, Identification as Found, InstrumentTest, Kind, Outside, Scan as FoundScan, Unknown as FoundUnknown,
    WeakDetails, WidthFrom,
};
use tvident::inference::{Suspect as FoundSuspect, Test};
use tvident::noise::Defect;

/// A number and its standard error.
#[pyclass(frozen, get_all, module = "tvident._core")]
#[derive(Clone, Copy)]
pub(crate) struct Estimate {
    pub(crate) value: f64,
    pub(crate) stderr: f64,
}

/// Whether a constant is one: the probability of such differences between parts of the record by chance, and how much they differ.
#[pyclass(frozen, get_all, module = "tvident._core")]
#[derive(Clone, Copy)]
pub(crate) struct ConstancyTest {
    pub(crate) probability: f64,
    pub(crate) spread: f64,
}

/// What the instrument told: the probability of the test of exogeneity, and the smallest F statistic of the first stage.
#[pyclass(frozen, get_all, module = "tvident._core")]
#[derive(Clone, Copy)]
pub(crate) struct Instrument {
    pub(crate) exogeneity: f64,
    pub(crate) strength: f64,
}

/// Cross-validation errors with the offset that was used, and with one that is free in every window.
#[pyclass(frozen, get_all, module = "tvident._core")]
#[derive(Clone, Copy)]
pub(crate) struct OffsetErrors {
    pub(crate) used: f64,
    pub(crate) free: f64,
}

/// Variances of the noise of the channels.
#[pyclass(frozen, get_all, module = "tvident._core")]
#[derive(Clone, Copy)]
pub(crate) struct ChannelNoise {
    pub(crate) angle: f64,
    pub(crate) torque: f64,
}

/// A length of windows that was tried, and its cross-validation error.
#[pyclass(frozen, get_all, module = "tvident._core")]
#[derive(Clone, Copy)]
pub(crate) struct TriedLength {
    pub(crate) samples: usize,
    pub(crate) error: f64,
}

/// What was done to a channel, by what it is called, and how much of it there is.
#[pyclass(frozen, get_all, module = "tvident._core")]
#[derive(Clone, Copy)]
pub(crate) struct ChannelDefect {
    pub(crate) channel: usize,
    pub(crate) name: &'static str,
    pub(crate) amount: f64,
}

impl ChannelDefect {
    pub(crate) fn new(channel: usize, defect: &Defect) -> Self {
        Self { channel, name: defect.name(), amount: defect.amount() }
    }
}

/// A sample that stands out of its neighbours, and what they say is its value.
#[pyclass(frozen, get_all, module = "tvident._core")]
#[derive(Clone, Copy)]
pub(crate) struct ChannelSpike {
    pub(crate) channel: usize,
    pub(crate) sample: usize,
    pub(crate) value: f64,
}

/// An unknown that has another value elsewhere.
#[pyclass(frozen, get_all, module = "tvident._core")]
#[derive(Clone, Copy)]
pub(crate) struct OtherValue {
    pub(crate) unknown: usize,
    pub(crate) value: f64,
    pub(crate) stderr: f64,
}

/// One unknown: what it turned out to be, its values and their standard errors, and what a test of its constancy said.
#[pyclass(frozen, get_all, module = "tvident._core")]
pub(crate) struct Unknown {
    kind: &'static str,
    values: Py<PyArray1<f64>>,
    stderr: Py<PyArray1<f64>>,
    factor: f64,
    in_common: f64,
    test: Option<ConstancyTest>,
    untested: bool,
}

/// Something that may have been left out of the equation.
#[pyclass(frozen, get_all, module = "tvident._core")]
pub(crate) struct Suspect {
    name: &'static str,
    value: f64,
    stderr: f64,
    conspicuous: bool,
}

/// How a model fails outside the mask that it was found in.
#[pyclass(frozen, get_all, module = "tvident._core")]
pub(crate) struct OutsideMask {
    differing: Vec<OtherValue>,
    residual_ratio: Option<f64>,
}

/// Estimates by the width of the test function, from narrow to wide.
#[pyclass(frozen, get_all, module = "tvident._core")]
pub(crate) struct Scan {
    unknowns: Vec<usize>,
    window_length: Vec<usize>,
    band: Vec<f64>,
    values: Vec<Vec<f64>>,
    stderr: Vec<Vec<f64>>,
    corrected: bool,
    plateau: Option<(usize, usize)>,
    moved: bool,
    tried: usize,
}

impl Scan {
    pub(crate) fn new(py: Python<'_>, found: &FoundScan) -> PyResult<Py<Self>> {
        let scales = || found.scales.iter();
        Py::new(
            py,
            Self {
                unknowns: found.unknowns.clone(),
                window_length: scales().map(|one| 2 * one.half_width + 1).collect(),
                band: scales().map(|one| one.band).collect(),
                values: scales().map(|one| one.values.clone()).collect(),
                stderr: scales().map(|one| one.errors.clone()).collect(),
                corrected: found.corrected,
                plateau: found.plateau.map(|plateau| (plateau.first, plateau.last)),
                moved: found.moved,
                tried: found.tried,
            },
        )
    }
}

impl OutsideMask {
    fn new(outside: Outside) -> Self {
        let other = |(unknown, value, stderr)| OtherValue { unknown, value, stderr };
        Self { differing: outside.differing.into_iter().map(other).collect(), residual_ratio: outside.left }
    }
}

/// What was found in one record. What only the weak form says is None or empty in strong form.
#[pyclass(frozen, get_all, module = "tvident._core")]
pub(crate) struct Identification {
    window_length: usize,
    exponent: Option<usize>,
    regression_window: usize,
    unknowns: Vec<Py<Unknown>>,
    covariances: HashMap<(usize, usize), Py<PyArray1<f64>>>,
    condition: Py<PyArray1<f64>>,
    residual_std: Py<PyArray1<f64>>,
    status: Py<PyArray1<u16>>,
    record_status: u16,
    order: Py<PyArray1<u8>>,
    jumps: Vec<usize>,
    /// Where the test function came from that was chosen.
    width_from: Option<&'static str>,
    /// Samples of the windows near which lengths were compared, where not all were.
    near: Option<usize>,
    /// Places of the unknowns that change, in the order in which they were found to.
    changing: Vec<usize>,
    noise: Option<ChannelNoise>,
    shown_noise: Option<f64>,
    lengths: Vec<TriedLength>,
    prediction_error: f64,
    weighted: bool,
    pooling: Option<f64>,
    constants_condition: f64,
    weakest: Vec<f64>,
    mostly_noise: bool,
    unexplained: bool,
    lag: Option<Estimate>,
    /// Samples of it that are not told beyond that, which errors hold: the search for it did not settle.
    untold_lag: f64,
    angle_zero: Option<Estimate>,
    /// Where an offset that is free in every window predicts better.
    free_offset: Option<OffsetErrors>,
    suspects: Vec<Py<Suspect>>,
    /// What unknowns that do not belong to windows change by with every sample that the torque is later.
    with_lag: Vec<(usize, f64)>,
    defects: Vec<ChannelDefect>,
    resting: f64,
    pulses: Vec<(usize, usize)>,
    spikes: Vec<ChannelSpike>,
    lost: Vec<usize>,
    limits: [Option<[f64; 2]>; 2],
    unread: [Vec<usize>; 2],
    scan: Option<Py<Scan>>,
    outside_mask: Option<Py<OutsideMask>>,
    instrument: Option<Instrument>,
}

impl Identification {
    pub(crate) fn new(py: Python<'_>, found: Found, instrument: Option<InstrumentTest>) -> PyResult<Self> {
        let array = |values: Vec<f64>| PyArray1::from_vec(py, values).unbind();
        let unknown = |unknown: FoundUnknown| {
            Py::new(
                py,
                Unknown {
                    kind: name(unknown.kind),
                    values: array(unknown.values),
                    stderr: array(unknown.unscaled_stderr),
                    factor: unknown.factor,
                    in_common: unknown.in_common,
                    test: unknown.test.map(ConstancyTest::from),
                    untested: unknown.untested,
                },
            )
        };
        let suspect = |suspect: &FoundSuspect| {
            Py::new(
                py,
                Suspect {
                    name: suspect.missing.name(),
                    value: suspect.value,
                    stderr: suspect.error,
                    conspicuous: suspect.is_conspicuous(),
                },
            )
        };
        let outside = |outside| Py::new(py, OutsideMask::new(outside));
        let weak = found.weak.as_ref();
        Ok(Self {
            window_length: found.window_length,
            exponent: found.exponent,
            regression_window: found.regression_window,
            unknowns: found.unknowns.into_iter().map(unknown).collect::<PyResult<_>>()?,
            covariances: found.covariances.into_iter().map(|one| (one.pair, array(one.values))).collect(),
            condition: array(found.condition),
            residual_std: array(found.residual_std),
            status: PyArray1::from_vec(py, found.status.into_iter().map(Status::bits).collect()).unbind(),
            record_status: found.record_status.bits(),
            order: PyArray1::from_vec(py, found.order).unbind(),
            instrument: instrument.map(|test| Instrument { exogeneity: test.exogeneity, strength: test.strength }),
            jumps: found.jumps,
            width_from: weak.and_then(|weak| weak.width_from).map(width_from),
            near: weak.and_then(|weak| weak.near),
            changing: weak.map(|weak| weak.changing.clone()).unwrap_or_default(),
            noise: weak.map(|weak| ChannelNoise { angle: weak.noise[0], torque: weak.noise[1] }),
            shown_noise: weak.map(|weak| weak.shown_noise),
            lengths: weak.map(|weak| tried(&weak.lengths)).unwrap_or_default(),
            prediction_error: weak.map_or(1.0, |weak| weak.prediction_error),
            weighted: weak.is_some_and(|weak| weak.weighted),
            pooling: weak.and_then(|weak| weak.pooling),
            constants_condition: weak.map_or(1.0, |weak| weak.condition),
            weakest: weak.map(|weak| weak.weakest.clone()).unwrap_or_default(),
            mostly_noise: weak.is_some_and(|weak| weak.mostly_noise),
            unexplained: weak.is_some_and(|weak| weak.unexplained),
            untold_lag: weak.map_or(0.0, |weak| weak.untold_lag),
            lag: weak.and_then(|weak| weak.lag).map(|lag| Estimate { value: lag.value, stderr: lag.error }),
            angle_zero: weak
                .and_then(|weak| weak.angle_zero)
                .map(|zero| Estimate { value: zero.value, stderr: zero.error }),
            free_offset: weak
                .map(|weak| weak.free_offset)
                .filter(FreeOffset::is_better)
                .map(|offset| OffsetErrors { used: offset.error, free: offset.free }),
            suspects: weak.map_or(Ok(Vec::new()), |weak| weak.suspects.iter().map(suspect).collect::<PyResult<_>>())?,
            with_lag: weak.map(|weak| weak.with_lag.clone()).unwrap_or_default(),
            defects: weak.map(defects).unwrap_or_default(),
            resting: weak.map_or(0.0, |weak| weak.resting),
            pulses: weak.map_or_else(Vec::new, |weak| weak.pulses.iter().map(|one| (one.start, one.end)).collect()),
            spikes: weak.map(spikes).unwrap_or_default(),
            lost: weak.map_or_else(Vec::new, |weak| weak.lost.clone()),
            limits: weak.map_or([None; 2], |weak| weak.limits),
            unread: weak.map_or_else(Default::default, |weak| weak.unread.clone()),
            scan: weak.map(|weak| Scan::new(py, &weak.scan)).transpose()?,
            outside_mask: found
                .weak
                .and_then(|weak| weak.outside_mask)
                .filter(Outside::fails)
                .map(outside)
                .transpose()?,
        })
    }
}

/// What a kind is called.
pub(crate) fn name(kind: Kind) -> &'static str {
    match kind {
        Kind::Windowed => "windowed",
        Kind::Constant => "constant",
        Kind::Automatic => "auto",
        Kind::Varying => "varying",
    }
}

/// A kind by its name.
pub(crate) fn kind(name: &str) -> Option<Kind> {
    match name {
        "windowed" => Some(Kind::Windowed),
        "constant" => Some(Kind::Constant),
        "auto" => Some(Kind::Automatic),
        "varying" => Some(Kind::Varying),
        _ => None,
    }
}

/// Where a test function came from, and its name.
const WIDTHS_FROM: [(WidthFrom, &str); 3] =
    [(WidthFrom::Spectra, "spectra"), (WidthFrom::End, "end"), (WidthFrom::Plateau, "plateau")];

fn width_from(from: WidthFrom) -> &'static str {
    WIDTHS_FROM.iter().find(|(one, _)| *one == from).map_or("", |(_, name)| name)
}

/// Where a test function came from, by its name.
pub(crate) fn width_from_named(name: &str) -> Option<WidthFrom> {
    WIDTHS_FROM.iter().find(|(_, one)| *one == name).map(|(from, _)| *from)
}

impl From<Test> for ConstancyTest {
    fn from(test: Test) -> Self {
        Self { probability: test.probability, spread: test.spread }
    }
}

/// Lengths of windows and their errors, by name.
pub(crate) fn tried(lengths: &[(usize, f64)]) -> Vec<TriedLength> {
    lengths.iter().map(|&(samples, error)| TriedLength { samples, error }).collect()
}

/// What was done to each channel.
fn defects(weak: &WeakDetails) -> Vec<ChannelDefect> {
    let of = |(channel, defects): (usize, &Vec<Defect>)| {
        defects.iter().map(move |defect| ChannelDefect::new(channel, defect)).collect::<Vec<_>>()
    };
    weak.defects.iter().enumerate().flat_map(of).collect()
}

/// Samples that stand out of their neighbours.
fn spikes(weak: &WeakDetails) -> Vec<ChannelSpike> {
    weak.spikes.iter().map(|&(channel, sample, value)| ChannelSpike { channel, sample, value }).collect()
}
