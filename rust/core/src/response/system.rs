//! The system that is simulated: coefficients and terms with their factors, each constant or known at every sample.

use crate::equation::terms::{BuiltInTerm, TermFunction, signs};
use crate::record::derived::sign;
use crate::record::samples::{Samples, read_around};
use crate::response::gaps::bridge;

/// A factor of the equation of motion.
#[derive(Clone, Copy)]
pub enum Factor<'a> {
    /// The same all the time.
    Number(f64),
    /// Known at every sample.
    Record(&'a dyn Samples),
}

/// What a factor of a term is multiplied with.
#[derive(Clone, Copy)]
pub enum SystemTerm {
    /// A term that has a name.
    BuiltIn(&'static BuiltInTerm),
    /// Friction that fades with the square of the velocity, over the Stribeck velocity's: `exp(-(v/vₛ)²) sign(v)`.
    Stribeck {
        /// The Stribeck velocity in rad/s.
        velocity: f64,
    },
}

/// One record to simulate: the equation of motion with every factor known, and the torque.
#[derive(Clone)]
pub struct System<'a> {
    /// Inertia, damping and stiffness.
    pub coefficients: [Factor<'a>; 3],
    /// Terms and their factors.
    pub terms: Vec<(SystemTerm, Factor<'a>)>,
    /// Samples of the torque, which is linear between them.
    pub torque: &'a dyn Samples,
    /// Samples by which the torque comes late.
    pub lag: f64,
    /// Seconds from one sample to the next.
    pub delta: f64,
    /// Samples of the longest gap that is bridged.
    pub bridged: usize,
}

/// A function of the angle or of the velocity.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Shape {
    /// Applied in place.
    Named(fn(&mut [f64])),
    /// With the Stribeck velocity.
    Stribeck(f64),
}

impl Shape {
    /// The function of one value.
    pub(crate) fn at(self, value: f64) -> f64 {
        match self {
            Self::Named(function) => {
                let mut values = [value];
                function(&mut values);
                values[0]
            }
            Self::Stribeck(velocity) => sign(value) * (-(value / velocity).powi(2)).exp(),
        }
    }
}

/// A function and its factor: one value, or one a sample.
type Nonlinear = (Shape, Vec<f64>);

/// The numbers of a system, in memory.
#[derive(Clone, Debug)]
pub(crate) struct KnownSystem {
    /// Inertia, damping and stiffness: one value each, or one a sample.
    pub(crate) coefficients: [Vec<f64>; 3],
    /// Functions of the angle and of the velocity, with their factors.
    pub(crate) of_angle: Vec<Nonlinear>,
    pub(crate) of_velocity: Vec<Nonlinear>,
    /// The torque without constant terms, at every sample.
    pub(crate) torque: Vec<f64>,
    pub(crate) delta: f64,
}

/// What holds between two samples: the mean of both.
pub(crate) fn between(column: &[f64], sample: usize) -> f64 {
    match column {
        [value] => *value,
        _ => 0.5 * (column[sample] + column[sample + 1]),
    }
}

impl KnownSystem {
    /// Reads a system.
    pub(crate) fn read(system: &System<'_>) -> Self {
        let samples = system.torque.len();
        let column = |factor: Factor<'_>| match factor {
            Factor::Number(number) => vec![number],
            Factor::Record(record) => {
                let mut values = vec![0.0; samples];
                record.read(0, &mut values);
                bridge(&mut values, system.bridged);
                values
            }
        };
        let mut torque = late(system.torque, system.lag);
        bridge(&mut torque, system.bridged.min(SHORT));
        let mut columns = Self {
            coefficients: system.coefficients.map(column),
            of_angle: Vec::new(),
            of_velocity: Vec::new(),
            torque,
            delta: system.delta,
        };
        for (term, factor) in &system.terms {
            let factor = column(*factor);
            if factor == [0.0] {
                continue;
            }
            let function = match term {
                SystemTerm::Stribeck { velocity } => {
                    columns.of_velocity.push((Shape::Stribeck(*velocity), factor));
                    continue;
                }
                SystemTerm::BuiltIn(term) => term.function,
            };
            match function {
                TermFunction::One => {
                    let torque = columns.torque.iter_mut().enumerate();
                    torque.for_each(|(sample, torque)| *torque -= factor.get(sample).unwrap_or(&factor[0]));
                }
                TermFunction::OfAngle(function) => columns.of_angle.push((Shape::Named(function), factor)),
                TermFunction::OfVelocity(function) => columns.of_velocity.push((Shape::Named(function), factor)),
                TermFunction::Direction => columns.of_velocity.push((Shape::Named(signs), factor)),
            }
        }
        columns
    }

    /// Whether the response is the sum of what state and torque cause each.
    pub(crate) fn is_linear(&self) -> bool {
        self.of_angle.is_empty() && self.of_velocity.is_empty()
    }

    /// Every column that must have a value for the response to have one.
    pub(crate) fn needed(&self) -> impl Iterator<Item = &[f64]> {
        let factors = self.of_angle.iter().chain(&self.of_velocity).map(|(_, factor)| factor);
        self.coefficients.iter().chain(factors).chain(std::iter::once(&self.torque)).map(Vec::as_slice)
    }
}

/// Samples of the torque that may be missing in a row: what it did meanwhile moved the system.
const SHORT: usize = 3;

/// The torque that acts at every sample, of one that is recorded late: linear between samples.
fn late(torque: &dyn Samples, lag: f64) -> Vec<f64> {
    let whole = lag.floor();
    let mut values = vec![0.0; torque.len() + 1];
    #[allow(clippy::cast_possible_truncation, reason = "less than the record")]
    read_around(torque, whole as isize, &mut values);
    let part = lag - whole;
    if part > 0.0 {
        for sample in 0..torque.len() {
            values[sample] += part * (values[sample + 1] - values[sample]);
        }
    }
    values.truncate(torque.len());
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stribeck_friction_fades_with_the_velocity() {
        let shape = Shape::Stribeck(2.0);
        assert_eq!(shape.at(0.0), 0.0);
        assert!((shape.at(2.0) - (-1.0_f64).exp()).abs() < 1e-15 && shape.at(-2.0) == -shape.at(2.0));
        assert!((shape.at(f64::MIN_POSITIVE) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn a_torque_that_comes_late_is_moved_back() {
        let torque: &[f64] = &[0.0, 1.0, 4.0, 9.0];
        assert_eq!(late(&torque, 0.0), torque);
        assert_eq!(late(&torque, 1.0)[..3], [1.0, 4.0, 9.0]);
        assert_eq!(late(&torque, 0.5)[..3], [0.5, 2.5, 6.5]);
        assert!(late(&torque, 1.0)[3].is_nan() && late(&torque, -1.0)[0].is_nan());
        assert_eq!(late(&torque, -1.0)[1..], torque[..3]);
    }
}
