//! Rows of the equation of motion `I θ̈ + C θ̇ + K θ + terms = T`, from derivatives of the angle.
//!
//! Unknown coefficients have a column of regressors; known terms move to the right-hand side.

use std::ops::Range;

use crate::equation::terms::{BuiltInTerm, TermFunction, signs};
use crate::noise::fused::AngleNoise;
use crate::noise::passed::PassedNoise;
use crate::record::derived::Cut;
use crate::record::samples::Samples;

/// What is known of inertia, damping or stiffness beforehand.
#[derive(Clone, Copy)]
pub enum Coefficient<'a> {
    /// Unknown.
    Unknown,
    /// The same all the time. Zero leaves it out.
    Number(f64),
    /// Known at every sample.
    Record(&'a dyn Samples),
}

/// A term on the left-hand side beside inertia, damping and stiffness, with an unknown factor.
#[derive(Clone, Copy)]
pub enum Term<'a> {
    /// One that has a name.
    BuiltIn(&'static BuiltInTerm),
    /// Anything else, given at every sample.
    Record(&'a dyn Samples),
}

/// What was measured of a motion beside its angle, or in its place.
#[derive(Clone, Copy, Default)]
pub struct Measured<'a> {
    /// The channels as they were recorded: angle, velocity and acceleration.
    pub channels: [Option<&'a dyn Samples>; 3],
    /// The noise of an angle that was made of several channels, or integrated from one; `None` where it was measured alone.
    pub noise: Option<&'a AngleNoise>,
    /// What white noise of variance one became where angle and torque were resampled; `None` where they were not.
    pub passed: [Option<&'a PassedNoise>; 2],
}

/// The equation of motion of one record.
#[derive(Clone)]
pub struct Motion<'a> {
    /// Samples of the angle.
    pub angle: &'a dyn Samples,
    /// What the angle was made of, where it is not what was measured.
    pub measured: Measured<'a>,
    /// Samples of the torque.
    pub torque: &'a dyn Samples,
    /// Inertia, damping and stiffness.
    pub coefficients: [Coefficient<'a>; 3],
    /// Further terms.
    pub terms: Vec<Term<'a>>,
}

impl Motion<'_> {
    /// Number of unknowns: columns of a row.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        self.coefficients.iter().filter(|one| matches!(one, Coefficient::Unknown)).count() + self.terms.len()
    }

    /// Does something with the motion in a part of its samples.
    pub(crate) fn within<R>(&self, part: &Range<usize>, work: impl FnOnce(&Motion<'_>) -> R) -> R {
        let cut = |channel| Cut { channel, samples: part.clone() };
        let (angle, torque) = (cut(self.angle), cut(self.torque));
        let channels = self.measured.channels.map(|channel| channel.map(cut));
        let known = self.coefficients.map(|one| match one {
            Coefficient::Record(record) => Some(cut(record)),
            _ => None,
        });
        let given = self.terms.iter().map(|term| match *term {
            Term::Record(record) => Some(cut(record)),
            Term::BuiltIn(_) => None,
        });
        let given: Vec<_> = given.collect();
        let terms = self.terms.iter().zip(&given);
        let [inertia, damping, stiffness] = &known;
        let mut coefficients = self.coefficients;
        for (coefficient, part) in coefficients.iter_mut().zip([inertia, damping, stiffness]) {
            if let Some(part) = part {
                *coefficient = Coefficient::Record(part);
            }
        }
        work(&Motion {
            angle: &angle,
            torque: &torque,
            measured: Measured {
                channels: std::array::from_fn(|index| channels[index].as_ref().map(|one| one as &dyn Samples)),
                ..self.measured
            },
            coefficients,
            terms: terms.map(|(term, part)| part.as_ref().map_or(*term, |part| Term::Record(part))).collect(),
        })
    }

    /// Builds the rows of the samples from `first` on: one column an unknown, in the order of inertia, damping, stiffness and terms,
    /// then the right-hand side. `derivatives` are the angle and its first and second derivative at these samples; those that are
    /// columns as they are change places with them and are not copied.
    pub(crate) fn rows(
        &self,
        first: usize,
        derivatives: &mut [Vec<f64>; 3],
        known: &mut Vec<f64>,
        columns: &mut [Vec<f64>],
    ) {
        let [angle, velocity, acceleration] = derivatives;
        let count = angle.len();
        let Some((rhs, unknowns)) = columns.split_last_mut() else { return };
        rhs.resize(count, 0.0);
        self.torque.read(first, rhs);
        for (coefficient, factor) in self.coefficients.iter().zip([&*acceleration, velocity, angle]) {
            match *coefficient {
                Coefficient::Unknown => {}
                Coefficient::Number(number) => {
                    if number != 0.0 {
                        rhs.iter_mut().zip(factor).for_each(|(rhs, factor)| *rhs -= number * factor);
                    }
                }
                Coefficient::Record(record) => {
                    known.resize(count, 0.0);
                    record.read(first, known);
                    for ((rhs, factor), known) in rhs.iter_mut().zip(factor).zip(&*known) {
                        *rhs -= known * factor;
                    }
                }
            }
        }
        let (coefficients, terms) = unknowns.split_at_mut(unknowns.len() - self.terms.len());
        for (term, column) in self.terms.iter().zip(terms) {
            column.resize(count, 0.0);
            match *term {
                Term::BuiltIn(BuiltInTerm { function: TermFunction::One, .. }) => column.fill(1.0),
                Term::BuiltIn(BuiltInTerm { function: TermFunction::OfAngle(function), .. }) => {
                    column.copy_from_slice(angle);
                    function(column);
                }
                Term::BuiltIn(BuiltInTerm { function: TermFunction::OfVelocity(function), .. }) => {
                    column.copy_from_slice(velocity);
                    function(column);
                }
                Term::BuiltIn(BuiltInTerm { function: TermFunction::Direction, .. }) => {
                    column.copy_from_slice(velocity);
                    signs(column);
                }
                Term::Record(record) => record.read(first, column),
            }
        }
        self.exchange(derivatives, coefficients);
    }

    /// Gives derivatives that became columns their places back, so that there is memory for each only once.
    pub(crate) fn take_back(&self, derivatives: &mut [Vec<f64>; 3], columns: &mut [Vec<f64>]) {
        if derivatives.iter().any(Vec::is_empty) {
            self.exchange(derivatives, columns);
        }
    }

    /// Lets the derivatives that are multiplied by unknowns change places with their columns.
    fn exchange(&self, [angle, velocity, acceleration]: &mut [Vec<f64>; 3], columns: &mut [Vec<f64>]) {
        let factors = self.coefficients.iter().zip([acceleration, velocity, angle]);
        let unknown = factors.filter(|(coefficient, _)| matches!(coefficient, Coefficient::Unknown));
        unknown.zip(columns).for_each(|((_, factor), column)| std::mem::swap(factor, column));
    }
}

/// Which columns of the equations have unknown factors: coefficients, then that many terms.
pub(crate) fn unknowns(coefficients: &[Coefficient<'_>; 3], terms: usize) -> Vec<usize> {
    let unknown = (0..3).filter(|&index| matches!(coefficients[index], Coefficient::Unknown));
    unknown.chain(3..3 + terms).collect()
}
