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
    /// What is left of it beside a line through the origin of this slope.
    BesideLine(fn(&mut [f64]), f64),
    /// With the Stribeck velocity.
    Stribeck(f64),
}

impl Shape {
    /// The function of one value.
    pub(crate) fn at(self, value: f64) -> f64 {
        match self {
            Self::Named(function) => named(function, value),
            Self::BesideLine(function, slope) => named(function, value) - slope * value,
            Self::Stribeck(velocity) => sign(value) * (-(value / velocity).powi(2)).exp(),
        }
    }
}

/// A function that works in place, of one value.
fn named(function: fn(&mut [f64]), value: f64) -> f64 {
    let mut values = [value];
    function(&mut values);
    values[0]
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

/// An angle at which a function is its tangent at zero.
const NEAR: f64 = 1e-6;

/// What is left of a stiffness that a term cancels.
const CANCELS: f64 = 0.5;

/// A column's value at a sample.
fn at(column: &[f64], sample: usize) -> f64 {
    if column.len() == 1 { column[0] } else { column[sample] }
}

fn largest(column: &[f64]) -> f64 {
    column.iter().fold(0.0, |most, value| most.max(value.abs()))
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
        columns.against_stiffness();
        columns
    }

    /// Gives the stiffness the lines of terms that cancel it, such as that of a weight beside a spring of the other sign.
    ///
    /// Apart, both would be fast as their difference is not: every step would have to be as short as the faster one asks for.
    fn against_stiffness(&mut self) {
        for (shape, factor) in &mut self.of_angle {
            let Shape::Named(function) = *shape else { continue };
            let slope = named(function, NEAR) / NEAR;
            let stiffness = &self.coefficients[2];
            let beside: Vec<f64> = (0..stiffness.len().max(factor.len()))
                .map(|sample| at(stiffness, sample) + slope * at(factor, sample))
                .collect();
            if largest(&beside) < CANCELS * largest(stiffness) {
                self.coefficients[2] = beside;
                *shape = Shape::BesideLine(function, slope);
            }
        }
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

    /// A weight of -3e5 N m beside a spring of 3e5 N m/rad: what is left of both is their sum, and slow. A weight alone stays as it is.
    #[test]
    fn what_a_weight_cancels_of_a_spring_is_no_part_of_the_system() {
        let torque: &[f64] = &[0.0, 1.0];
        let read = |stiffness: f64, weight: f64| {
            let gravity = BuiltInTerm::named("gravity").expect("it is built in");
            KnownSystem::read(&System {
                coefficients: [1e-5, 0.01, stiffness].map(Factor::Number),
                terms: vec![(SystemTerm::BuiltIn(gravity), Factor::Number(weight))],
                torque: &torque,
                lag: 0.0,
                delta: 1e-3,
                bridged: 0,
            })
        };
        for (stiffness, weight, left) in [(3e5, -3e5 + 1.5, 1.5), (0.0, 2.0, 0.0), (3.0, 2.0, 3.0)] {
            let columns = read(stiffness, weight);
            let [found] = columns.coefficients[2][..] else { panic!("one stiffness") };
            assert!((found - left).abs() < 1e-6, "{found}");
            let (shape, factor) = &columns.of_angle[0];
            for angle in [-0.3_f64, 1e-3, 2.0] {
                let expected = stiffness * angle + weight * angle.sin();
                let whole = found * angle + factor[0] * shape.at(angle);
                assert!((whole - expected).abs() <= 8.0 * f64::EPSILON * stiffness.max(weight.abs()), "{whole}");
            }
        }
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
