//! The built-in terms of the equation of motion: the one place that knows what each of them is.

use crate::record::derived::{Mapped, sign};
use crate::record::samples::Samples;

/// What a term multiplies its unknown factor with.
#[derive(Clone, Copy, Debug)]
pub(crate) enum TermFunction {
    /// One at every sample.
    One,
    /// A function of the angle, applied to samples of it in place.
    OfAngle(fn(&mut [f64])),
    /// A function of the velocity, applied to samples of it in place.
    OfVelocity(fn(&mut [f64])),
    /// The direction of motion: the sign of the velocity, or what is known of it.
    Direction,
}

impl TermFunction {
    /// The samples of a term, `None` if they are one everywhere.
    pub(crate) fn samples<'a>(self, angle: &'a dyn Samples, velocity: &'a dyn Samples) -> Option<Mapped<'a>> {
        match self {
            Self::One => None,
            Self::OfAngle(function) => Some(Mapped { channel: angle, function }),
            Self::OfVelocity(function) => Some(Mapped { channel: velocity, function }),
            Self::Direction => Some(Mapped { channel: velocity, function: signs }),
        }
    }
}

/// A term that has a name.
#[derive(Debug)]
pub struct BuiltInTerm {
    /// What it is called.
    pub name: &'static str,
    pub(crate) function: TermFunction,
    /// Whether it has neither jumps nor kinks.
    pub(crate) smooth: bool,
    /// Whether a record is searched for it where it is left out.
    pub(crate) looked_for: bool,
    /// Whether what the torque tells is told beside it: a damping that differs between directions leaves hardly anything of that where windows are short.
    pub(crate) beside_torque: bool,
}

impl BuiltInTerm {
    /// Whether it is a function of the velocity.
    pub(crate) fn is_of_velocity(&self) -> bool {
        matches!(self.function, TermFunction::OfVelocity(_) | TermFunction::Direction)
    }
}

/// Every built-in term. A new one is a row here and nothing else in the core.
pub static BUILT_IN_TERMS: [BuiltInTerm; 7] = [
    BuiltInTerm { name: "offset", function: TermFunction::One, smooth: true, looked_for: true, beside_torque: true },
    BuiltInTerm {
        name: "coulomb",
        function: TermFunction::Direction,
        smooth: false,
        looked_for: true,
        beside_torque: true,
    },
    BuiltInTerm {
        name: "cubic",
        function: TermFunction::OfAngle(|angle| each(angle, cube)),
        smooth: true,
        looked_for: true,
        beside_torque: true,
    },
    BuiltInTerm {
        name: "preload",
        function: TermFunction::OfAngle(signs),
        smooth: false,
        looked_for: true,
        beside_torque: true,
    },
    BuiltInTerm {
        name: "gravity",
        function: TermFunction::OfAngle(|angle| each(angle, f64::sin)),
        smooth: true,
        looked_for: false,
        beside_torque: true,
    },
    BuiltInTerm {
        name: "viscous_asymmetric",
        function: TermFunction::OfVelocity(|velocity| each(velocity, f64::abs)),
        smooth: false,
        looked_for: true,
        beside_torque: false,
    },
    BuiltInTerm {
        name: "quadratic_drag",
        function: TermFunction::OfVelocity(|velocity| each(velocity, |value| value * value.abs())),
        smooth: true,
        looked_for: true,
        beside_torque: true,
    },
];

impl BuiltInTerm {
    /// The term of a name, `None` if there is no such term.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        BUILT_IN_TERMS.iter().find(|term| term.name == name)
    }
}

/// Terms are the same if their names are.
impl PartialEq for BuiltInTerm {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for BuiltInTerm {}

fn cube(value: f64) -> f64 {
    value * value * value
}

/// The sign of every angle or velocity.
pub(crate) fn signs(motion: &mut [f64]) {
    each(motion, sign);
}

/// Applies a function to every value.
fn each(values: &mut [f64], function: impl Fn(f64) -> f64) {
    for value in values {
        *value = function(*value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(name: &str, value: f64) -> f64 {
        let mut values = [value];
        match BuiltInTerm::named(name).unwrap().function {
            TermFunction::One => values = [1.0],
            TermFunction::OfAngle(function) | TermFunction::OfVelocity(function) => function(&mut values),
            TermFunction::Direction => signs(&mut values),
        }
        values[0]
    }

    #[test]
    fn terms_are_what_their_names_say() {
        assert_eq!(at("offset", -3.0), 1.0);
        assert_eq!([at("coulomb", -3.0), at("coulomb", 0.0), at("coulomb", 0.1)], [-1.0, 0.0, 1.0]);
        assert_eq!(at("cubic", -3.0), -27.0);
        assert_eq!([at("preload", -3.0), at("preload", 0.0), at("preload", 0.1)], [-1.0, 0.0, 1.0]);
        assert_eq!([at("viscous_asymmetric", -3.0), at("viscous_asymmetric", 2.0)], [3.0, 2.0]);
        assert_eq!([at("quadratic_drag", -3.0), at("quadratic_drag", 2.0)], [-9.0, 4.0]);
        assert!((at("gravity", std::f64::consts::FRAC_PI_6) - 0.5).abs() < f64::EPSILON);
    }

    #[test]
    fn names_are_told_apart() {
        for term in &BUILT_IN_TERMS {
            assert_eq!(BuiltInTerm::named(term.name), Some(term));
        }
        assert_eq!(BuiltInTerm::named("quartic"), None);
    }
}
