//! The simple call: two channels and a sample rate, with a builder for everything else.

use std::num::NonZeroUsize;

use crate::equation::motion::{Coefficient, Measured, Motion, Term};
use crate::equation::terms::{BUILT_IN_TERMS, BuiltInTerm};
use crate::error::Error;
use crate::exec::pool::{Watch, workers};
use crate::identify::identification::Identification;
use crate::identify::kinds::Kind;
use crate::identify::options::{Method, Options, StrongForm, Task, WeakForm};
use crate::identify::route::identify_all;
use crate::local_polynomials::criterion::Criterion;
use crate::local_polynomials::options::{Order, PolynomialOptions, Selection};
use crate::local_polynomials::plan::LocalPolynomials;
use crate::noise::quantisation::quantisation_step;
use crate::simd::instructions::Instructions;

/// How inertia, damping or stiffness comes about: unknown, of some kind, or known.
#[derive(Clone, Copy, Debug)]
pub enum Parameter<'a> {
    /// Unknown.
    Unknown(Kind),
    /// Known, the same at every sample; zero leaves it out.
    Known(f64),
    /// Known at every sample.
    KnownAt(&'a [f64]),
}

impl From<Kind> for Parameter<'_> {
    fn from(kind: Kind) -> Self {
        Self::Unknown(kind)
    }
}

impl From<f64> for Parameter<'_> {
    fn from(value: f64) -> Self {
        Self::Known(value)
    }
}

impl<'a> From<&'a [f64]> for Parameter<'a> {
    fn from(values: &'a [f64]) -> Self {
        Self::KnownAt(values)
    }
}

/// Settings of the strong form, from which its plan is made.
#[derive(Clone, Debug)]
pub struct StrongSettings {
    /// Samples in the windows of the polynomials.
    pub window_length: usize,
    /// The highest candidate order.
    pub max_order: usize,
    /// What chooses the order.
    pub criterion: Criterion,
    /// How many windows choose it together.
    pub selection: Selection,
    /// Rows that are solved together.
    pub regression_window: usize,
    /// Whether the torque is smoothed by polynomials of the orders chosen for the angle.
    pub filter_torque: bool,
    /// Whether windowed coefficients may grow linearly within a window.
    pub linear: bool,
}

impl Default for StrongSettings {
    /// Those of the paper.
    fn default() -> Self {
        Self {
            window_length: 201,
            max_order: 15,
            criterion: Criterion::Aicc,
            selection: Selection::Window,
            regression_window: 200,
            filter_torque: false,
            linear: false,
        }
    }
}

#[derive(Clone, Debug)]
enum Form {
    Weak(WeakForm),
    Strong(StrongSettings),
}

/// A call that was not yet made: [`identify`] begins it, [`Identify::run`] makes it.
#[derive(Clone, Debug)]
#[must_use = "nothing is identified before `run`"]
pub struct Identify<'a> {
    angle: &'a [f64],
    torque: &'a [f64],
    sample_rate: f64,
    coefficients: [Parameter<'a>; 3],
    terms: Vec<(&'a str, Kind)>,
    form: Form,
    lag: Option<f64>,
    mask: Option<&'a [bool]>,
    quantisation: Option<f64>,
    step: usize,
    workers: Option<NonZeroUsize>,
}

/// Identifies inertia, damping and stiffness from an angle in rad and a torque in N·m, sampled so many times a second.
///
/// Unless more is said, the weak form is used and everything else is chosen from the record: inertia and damping are constant if the record
/// does not contradict it, the stiffness has a value at every sample, and an offset of the torque is unknown, too: constant unless the record
/// says that it drifts.
///
/// ```
/// use tvident::identify::Kind;
///
/// let angle: Vec<f64> = (0..8000).map(|k| f64::from(k) * 1e-3).map(|t| (9.0 * t).sin() + 0.5 * (31.0 * t).cos()).collect();
/// // I = 0.02, C = 0.1, K = 5
/// let torque: Vec<f64> = (0..8000)
///     .map(|k| f64::from(k) * 1e-3)
///     .map(|t| {
///         let velocity = 9.0 * (9.0 * t).cos() - 15.5 * (31.0 * t).sin();
///         let acceleration = -81.0 * (9.0 * t).sin() - 480.5 * (31.0 * t).cos();
///         0.02 * acceleration + 0.1 * velocity + 5.0 * ((9.0 * t).sin() + 0.5 * (31.0 * t).cos())
///     })
///     .collect();
/// let found = tvident::identify(&angle, &torque, 1000.0).stiffness(Kind::Constant).run()?;
/// let stiffness = found.stiffness().expect("it was unknown");
/// assert!((stiffness.values[0] - 5.0).abs() < 1e-6);
/// # Ok::<(), tvident::Error>(())
/// ```
pub fn identify<'a>(angle: &'a [f64], torque: &'a [f64], sample_rate: f64) -> Identify<'a> {
    Identify {
        angle,
        torque,
        sample_rate,
        coefficients: [Kind::Automatic, Kind::Automatic, Kind::Windowed].map(Parameter::Unknown),
        terms: vec![("offset", Kind::Automatic)],
        form: Form::Weak(WeakForm::default()),
        lag: Some(0.0),
        mask: None,
        quantisation: None,
        step: 1,
        workers: None,
    }
}

impl<'a> Identify<'a> {
    /// Says how the inertia comes about.
    pub fn inertia(mut self, inertia: impl Into<Parameter<'a>>) -> Self {
        self.coefficients[0] = inertia.into();
        self
    }

    /// Says how the damping comes about.
    pub fn damping(mut self, damping: impl Into<Parameter<'a>>) -> Self {
        self.coefficients[1] = damping.into();
        self
    }

    /// Says how the stiffness comes about.
    pub fn stiffness(mut self, stiffness: impl Into<Parameter<'a>>) -> Self {
        self.coefficients[2] = stiffness.into();
        self
    }

    /// Says what else stands on the left-hand side: names of [`BUILT_IN_TERMS`](crate::equation::BUILT_IN_TERMS) with their kinds.
    pub fn terms(mut self, terms: &[(&'a str, Kind)]) -> Self {
        self.terms = terms.to_vec();
        self
    }

    /// Uses the weak form with some of its settings given.
    pub fn weak_form(mut self, settings: WeakForm) -> Self {
        self.form = Form::Weak(settings);
        self
    }

    /// Uses the strong form.
    pub fn strong_form(mut self, settings: StrongSettings) -> Self {
        self.form = Form::Strong(settings);
        self
    }

    /// Does as the paper: strong form, inertia, damping and stiffness in every window, no terms.
    pub fn paper(mut self) -> Self {
        self.coefficients = [Parameter::Unknown(Kind::Windowed); 3];
        self.terms.clear();
        self.strong_form(StrongSettings::default())
    }

    /// Says by how many seconds the torque comes late.
    pub fn lag(mut self, seconds: f64) -> Self {
        self.lag = Some(seconds * self.sample_rate);
        self
    }

    /// Estimates by how much the torque comes late; the weak form can.
    pub fn estimate_lag(mut self) -> Self {
        self.lag = None;
        self
    }

    /// Says at which samples equations may be centred.
    pub fn mask(mut self, mask: &'a [bool]) -> Self {
        self.mask = Some(mask);
        self
    }

    /// Says to what step the angle was rounded, which is looked for otherwise.
    pub fn quantisation(mut self, step: f64) -> Self {
        self.quantisation = Some(step);
        self
    }

    /// Says every how many samples numbers are wanted.
    pub fn step(mut self, step: usize) -> Self {
        self.step = step;
        self
    }

    /// Says how many threads work; all processors otherwise. The numbers do not depend on it.
    pub fn workers(mut self, workers: NonZeroUsize) -> Self {
        self.workers = Some(workers);
        self
    }

    /// Makes the call.
    ///
    /// # Errors
    /// If channels or mask differ in length, the sample rate is no positive number, a term has no such name, nothing is unknown, settings are
    /// impossible or of the other form, or the record is too short for them.
    pub fn run(self) -> Result<Identification, Error> {
        self.run_watched(&mut |_, _| true)
    }

    /// Makes the call and tells a watch, at least every 20 ms, how much is done; it may cancel.
    ///
    /// # Errors
    /// As [`Identify::run`], and if the watch cancels.
    pub fn run_watched(self, watch: &mut Watch<'_>) -> Result<Identification, Error> {
        self.check()?;
        let delta = self.sample_rate.recip();
        let plan = match &self.form {
            Form::Weak(_) => None,
            Form::Strong(settings) => {
                let step = self.quantisation.unwrap_or_else(|| quantisation_step(&self.angle));
                Some(plan(settings, step, delta)?)
            }
        };
        let method = match (&self.form, &plan) {
            (Form::Strong(settings), Some(derivatives)) => Method::Strong(StrongForm {
                derivatives,
                regression_window: settings.regression_window,
                filter_torque: settings.filter_torque,
                linear: settings.linear,
            }),
            (Form::Weak(settings), _) => Method::Weak(settings.clone()),
            (Form::Strong(_), None) => Method::Weak(WeakForm::default()),
        };
        let known: Vec<&[f64]> = self.coefficients.iter().filter_map(Parameter::samples).collect();
        let mut known = known.iter();
        let coefficients = self.coefficients.map(|parameter| match parameter {
            Parameter::Unknown(_) => Coefficient::Unknown,
            Parameter::Known(value) => Coefficient::Number(value),
            Parameter::KnownAt(_) => known.next().map_or(Coefficient::Unknown, |samples| Coefficient::Record(samples)),
        });
        let named =
            |&(name, _): &(&str, Kind)| BuiltInTerm::named(name).map(Term::BuiltIn).ok_or_else(|| no_such_term(name));
        let terms = self.terms.iter().map(named).collect::<Result<Vec<_>, _>>()?;
        let measured = Measured::default();
        let motion = Motion { angle: &self.angle, measured, torque: &self.torque, coefficients, terms };
        let kind = |parameter: &Parameter<'_>| match parameter {
            Parameter::Unknown(kind) => Some(*kind),
            _ => None,
        };
        let kinds = self.coefficients.iter().filter_map(kind).chain(self.terms.iter().map(|(_, kind)| *kind));
        let options = Options {
            delta,
            kinds: kinds.collect(),
            quantisation: self.quantisation,
            propagate: false,
            step: self.step,
            wanted: None,
            diagnose: true,
            instructions: Instructions::current(),
        };
        let task = Task { motion, mask: self.mask, weights: None, method, lag: self.lag, angle_zero: None };
        let mut found = identify_all(&[task], &options, workers(self.workers), watch)?;
        found.pop().ok_or(Error::NotDetermined)
    }

    /// Refuses what cannot be meant.
    fn check(&self) -> Result<(), Error> {
        let samples = self.angle.len();
        let known = self.coefficients.iter().filter_map(Parameter::samples).map(<[f64]>::len);
        let others = known.chain([self.torque.len()]).chain(self.mask.map(<[bool]>::len));
        if let Some(other) = others.into_iter().find(|&other| other != samples) {
            return Err(Error::LengthsDiffer { samples, other });
        }
        if !(self.sample_rate.is_finite() && self.sample_rate > 0.0) {
            return Err(Error::SampleRate { sample_rate: self.sample_rate });
        }
        if self.terms.is_empty() && !self.coefficients.iter().any(|one| matches!(one, Parameter::Unknown(_))) {
            return Err(Error::NothingUnknown);
        }
        if self.step == 0 {
            return Err(Error::StepTooSmall);
        }
        if matches!(self.form, Form::Strong(_)) {
            if self.lag.is_none() {
                let cure = "give the lag that it finds, or leave estimate_lag out";
                return Err(Error::NeedsWeakForm { what: "an unknown lag", cure });
            }
            if self.coefficients.iter().any(|one| matches!(one, Parameter::Unknown(Kind::Varying))) {
                let cure = "use Kind::Windowed, or leave the form out";
                return Err(Error::NeedsWeakForm { what: "what varies slowly", cure });
            }
        }
        Ok(())
    }
}

impl<'a> Parameter<'a> {
    /// Its values, if it is known at every sample.
    fn samples(&self) -> Option<&'a [f64]> {
        match *self {
            Self::KnownAt(samples) => Some(samples),
            _ => None,
        }
    }
}

/// The error that names all terms.
fn no_such_term(name: &str) -> Error {
    let known: Vec<&str> = BUILT_IN_TERMS.iter().map(|term| term.name).collect();
    Error::NoSuchTerm { name: name.to_owned(), known: known.join(", ") }
}

/// The plan for the angle and its first two derivatives.
fn plan(settings: &StrongSettings, quantisation: f64, delta: f64) -> Result<LocalPolynomials, Error> {
    LocalPolynomials::new(PolynomialOptions {
        window_length: settings.window_length,
        order: Order::Chosen { criterion: settings.criterion, highest: settings.max_order },
        selection: settings.selection,
        derivatives: vec![0, 1, 2],
        delta,
        noise: true,
        quantisation,
        instructions: Instructions::current(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_call_is_refused_before_any_work() {
        let (angle, torque) = (vec![0.0; 1000], vec![0.0; 999]);
        let refused = |call: Identify<'_>| call.run().err();
        let lengths = Error::LengthsDiffer { samples: 1000, other: 999 };
        assert_eq!(refused(identify(&angle, &torque, 1e3)), Some(lengths.clone()));
        assert_eq!(refused(identify(&angle, &angle, 1e3).mask(&[true; 999])), Some(lengths.clone()));
        assert_eq!(refused(identify(&angle, &angle, 1e3).inertia(torque.as_slice())), Some(lengths));
        assert_eq!(refused(identify(&angle, &angle, 0.0)), Some(Error::SampleRate { sample_rate: 0.0 }));
        let quartic = no_such_term("quartic");
        assert_eq!(refused(identify(&angle, &angle, 1e3).terms(&[("quartic", Kind::Constant)])), Some(quartic));
        let all_known = identify(&angle, &angle, 1e3).inertia(1.0).damping(1.0).stiffness(1.0).terms(&[]);
        assert_eq!(refused(all_known), Some(Error::NothingUnknown));
        assert_eq!(refused(identify(&angle, &angle, 1e3).step(0)), Some(Error::StepTooSmall));
        let strong = || identify(&angle, &angle, 1e3).strong_form(StrongSettings::default());
        for wrong in [strong().estimate_lag(), strong().inertia(Kind::Varying)] {
            assert!(matches!(refused(wrong), Some(Error::NeedsWeakForm { .. })));
        }
    }

    #[test]
    fn what_is_known_is_no_unknown() {
        let angle: Vec<f64> = (0..2000).map(|k| (f64::from(k) * 0.005).sin() + (f64::from(k) * 0.011).cos()).collect();
        let found =
            identify(&angle, &angle, 100.0).paper().inertia(0.0).damping(vec![0.0; 2000].as_slice()).run().unwrap();
        assert!(found.inertia().is_none() && found.damping().is_none());
        let stiffness = found.stiffness().unwrap();
        assert!((stiffness.values[1000] - 1.0).abs() < 1e-9, "{}", stiffness.values[1000]);
    }
}
