//! What an identification returns: frozen classes with a name for every number.

use std::collections::HashMap;

use numpy::PyArray1;
use pyo3::prelude::*;
use tvident::Status;
use tvident::identify::{
    FreeOffset, Identification as Found, InstrumentTest, Kind, Outside, Scan as FoundScan, Unknown as FoundUnknown,
    WeakDetails,
};
use tvident::inference::Suspect as FoundSuspect;
use tvident::noise::Defect;

/// One unknown: what it turned out to be, its values and their standard errors, and what a test of its constancy said.
#[pyclass(frozen, get_all, module = "tvident._core")]
pub(crate) struct Unknown {
    kind: &'static str,
    values: Py<PyArray1<f64>>,
    stderr: Py<PyArray1<f64>>,
    factor: f64,
    test: Option<(f64, f64)>,
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
    differing: Vec<(usize, f64, f64)>,
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
    noise: Option<(f64, f64)>,
    shown_noise: Option<f64>,
    lengths: Vec<(usize, f64)>,
    prediction_error: f64,
    weighted: bool,
    pooling: Option<f64>,
    constants_condition: f64,
    weakest: Vec<f64>,
    mostly_noise: bool,
    unexplained: bool,
    lag: Option<(f64, f64)>,
    angle_zero: Option<(f64, f64)>,
    /// Where an offset that is free in every window predicts better: the error with the one that was used, and with a free one.
    free_offset: Option<(f64, f64)>,
    suspects: Vec<Py<Suspect>>,
    defects: Vec<(usize, &'static str, f64)>,
    resting: f64,
    pulses: Vec<(usize, usize)>,
    spikes: Vec<(usize, usize, f64)>,
    lost: Vec<usize>,
    limits: Option<[f64; 2]>,
    unread: [Vec<usize>; 2],
    scan: Option<Py<Scan>>,
    outside_mask: Option<Py<OutsideMask>>,
    /// With an instrument: the probability of the test of exogeneity, and the smallest F statistic of the first stage.
    instrument: Option<(f64, f64)>,
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
                    test: unknown.test.map(|test| (test.probability, test.spread)),
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
        let outside =
            |outside: Outside| Py::new(py, OutsideMask { differing: outside.differing, residual_ratio: outside.left });
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
            instrument: instrument.map(|test| (test.exogeneity, test.strength)),
            jumps: found.jumps,
            noise: weak.map(|weak| weak.noise.into()),
            shown_noise: weak.map(|weak| weak.shown_noise),
            lengths: weak.map(|weak| weak.lengths.clone()).unwrap_or_default(),
            prediction_error: weak.map_or(1.0, |weak| weak.prediction_error),
            weighted: weak.is_some_and(|weak| weak.weighted),
            pooling: weak.and_then(|weak| weak.pooling),
            constants_condition: weak.map_or(1.0, |weak| weak.condition),
            weakest: weak.map(|weak| weak.weakest.clone()).unwrap_or_default(),
            mostly_noise: weak.is_some_and(|weak| weak.mostly_noise),
            unexplained: weak.is_some_and(|weak| weak.unexplained),
            lag: weak.and_then(|weak| weak.lag).map(|lag| (lag.value, lag.error)),
            angle_zero: weak.and_then(|weak| weak.angle_zero).map(|zero| (zero.value, zero.error)),
            free_offset: weak
                .map(|weak| weak.free_offset)
                .filter(FreeOffset::is_better)
                .map(|offset| (offset.error, offset.free)),
            suspects: weak.map_or(Ok(Vec::new()), |weak| weak.suspects.iter().map(suspect).collect::<PyResult<_>>())?,
            defects: weak.map(defects).unwrap_or_default(),
            resting: weak.map_or(0.0, |weak| weak.resting),
            pulses: weak.map_or_else(Vec::new, |weak| weak.pulses.iter().map(|one| (one.start, one.end)).collect()),
            spikes: weak.map_or_else(Vec::new, |weak| weak.spikes.clone()),
            lost: weak.map_or_else(Vec::new, |weak| weak.lost.clone()),
            limits: weak.and_then(|weak| weak.limits),
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

/// What was done to each channel, by what it is called, and how much of it there is.
fn defects(weak: &WeakDetails) -> Vec<(usize, &'static str, f64)> {
    let of = |(channel, defects): (usize, &Vec<Defect>)| {
        defects.iter().map(move |defect| (channel, defect.name(), defect.amount())).collect::<Vec<_>>()
    };
    weak.defects.iter().enumerate().flat_map(of).collect()
}
