//! Integration from one sample to the next: exact for the linear part, of fourth order with controlled error for the rest.
//!
//! Between two samples coefficients and factors are the mean of theirs there, and the torque is linear. What is not linear in the angle is
//! integrated by Lawson's method (1967): Runge–Kutta of fourth order in coordinates that move with the linear system. Each step is compared
//! with two of half the length, and halved until they agree.

use crate::response::system::{KnownSystem, between};
use crate::response::transition::Transition;

/// How much a step may differ from two half as long, of the largest angle so far.
const TOLERANCE: f64 = 1e-9;
/// Halvings of a sample period at most, and what may be wrong then.
const HALVINGS: u32 = 12;
const UNSOUND: f64 = 1e-4;
/// Steps that are halved in a sample period in the mean, half of all that there may be, and in a few that need more: a system that is faster is
/// too fast for its samples. Where damping outweighs the inertia within a hundredth of a period some 300 are.
const HALVED: usize = 2048;
const HALVED_AT_ONCE: usize = 1 << 13;

/// Which derivatives of the angle the equation has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Derivatives {
    Second,
    /// No inertia.
    First,
    /// No inertia and no damping.
    Static,
}

/// Angle in rad and velocity in rad/s.
pub(crate) type State = [f64; 2];

/// A part of the time between two samples, as fractions of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    pub(crate) begin: f64,
    pub(crate) width: f64,
}

impl Part {
    pub(crate) const WHOLE: Self = Self { begin: 0.0, width: 1.0 };

    pub(crate) fn halves(self) -> [Self; 2] {
        let width = 0.5 * self.width;
        [Self { begin: self.begin, width }, Self { begin: self.begin + width, width }]
    }
}

/// The system between two samples.
#[derive(Debug)]
pub(crate) struct Integrator<'a> {
    columns: &'a KnownSystem,
    order: Derivatives,
    coefficients: [f64; 3],
    of_angle: Vec<f64>,
    of_velocity: Vec<f64>,
    torque: [f64; 2],
    /// Transitions over parts of this width, for these coefficients.
    known: Vec<(f64, Transition)>,
    /// The largest angle so far, and whether a step could not be made to agree.
    largest: f64,
    failed: bool,
    /// Steps that may be halved before the next sample.
    left: usize,
}

impl<'a> Integrator<'a> {
    pub(crate) fn new(columns: &'a KnownSystem) -> Self {
        let zero = |column: &[f64]| column.iter().all(|&value| value == 0.0);
        let [inertia, damping, _] = &columns.coefficients;
        let order = match (zero(inertia), zero(damping)) {
            (false, _) => Derivatives::Second,
            (true, false) => Derivatives::First,
            (true, true) => Derivatives::Static,
        };
        Self {
            columns,
            order,
            coefficients: [f64::NAN; 3],
            of_angle: vec![0.0; columns.of_angle.len()],
            of_velocity: vec![0.0; columns.of_velocity.len()],
            torque: [0.0; 2],
            known: Vec::new(),
            largest: 0.0,
            failed: false,
            left: HALVED_AT_ONCE,
        }
    }

    /// Whether steps could be made small enough.
    pub(crate) fn is_sound(&self) -> bool {
        !self.failed
    }

    /// Goes to the time between a sample and the next.
    pub(crate) fn enter(&mut self, sample: usize) {
        let columns = self.columns;
        self.left = (self.left + HALVED).min(HALVED_AT_ONCE);
        let coefficients = [0, 1, 2].map(|index| between(&columns.coefficients[index], sample));
        #[allow(clippy::float_cmp, reason = "whether they are the same numbers")]
        if coefficients != self.coefficients {
            self.known.clear();
            self.coefficients = coefficients;
        }
        self.torque = [columns.torque[sample], columns.torque[sample + 1]];
        let factors = self.of_angle.iter_mut().zip(&columns.of_angle);
        factors.for_each(|(factor, (_, column))| *factor = between(column, sample));
        let factors = self.of_velocity.iter_mut().zip(&columns.of_velocity);
        factors.for_each(|(factor, (_, column))| *factor = between(column, sample));
    }

    /// The state at a sample at which the equation has no room for a velocity or an angle of its own.
    pub(crate) fn begin(&self, x: State, sample: usize) -> State {
        let (columns, [_, damping, stiffness]) = (self.columns, &self.columns.coefficients);
        let here = |column: &[f64]| if column.len() == 1 { column[0] } else { column[sample] };
        let torque = columns.torque[sample];
        match self.order {
            Derivatives::Second => x,
            Derivatives::First => {
                let held: f64 =
                    columns.of_angle.iter().map(|(function, factor)| here(factor) * function.at(x[0])).sum();
                [x[0], (torque - here(stiffness) * x[0] - held) / here(damping)]
            }
            Derivatives::Static => [torque / here(stiffness), 0.0],
        }
    }

    /// The state at the end of a part, without any torque or term.
    pub(crate) fn homogeneous(&mut self, x: State) -> State {
        let torque = std::mem::take(&mut self.torque);
        let end = self.linear(x, Part::WHOLE);
        self.torque = torque;
        end
    }

    /// The state at the end of a part, of a system without further terms.
    pub(crate) fn linear(&mut self, x: State, part: Part) -> State {
        let seconds = part.width * self.columns.delta;
        let torque = self.torque_over(part);
        let transition = self.transition(part.width);
        let scale = self.per_torque(seconds);
        match self.order {
            Derivatives::Second => {
                let [angle, velocity] = transition.advance([x[0], x[1] * seconds], torque.map(|torque| scale * torque));
                [angle, velocity / seconds]
            }
            Derivatives::First => {
                let [angle, _] = transition.advance([x[0], 0.0], torque.map(|torque| scale * torque));
                [angle, (torque[1] - self.coefficients[2] * angle) / self.coefficients[1]]
            }
            Derivatives::Static => torque.map(|torque| torque / self.coefficients[2]).into_end(seconds),
        }
    }

    /// The state at the end of a part, steps as short as they must be. In `direction` the velocity's functions are continued beyond zero.
    pub(crate) fn controlled(&mut self, x: State, part: Part, direction: f64, halvings: u32) -> State {
        let whole = self.step(x, part, direction);
        let [first, second] = part.halves();
        let middle = self.step(x, first, direction);
        let end = self.step(middle, second, direction);
        let seconds = self.columns.delta;
        self.largest = self.largest.max(end[0].abs()).max(seconds * end[1].abs());
        let difference = (end[0] - whole[0]).abs() + seconds * (end[1] - whole[1]).abs();
        if difference > TOLERANCE * self.largest && halvings < HALVINGS && !self.failed {
            let Some(left) = self.left.checked_sub(1) else {
                self.failed = true;
                return end;
            };
            self.left = left;
            let middle = self.controlled(x, first, direction, halvings + 1);
            return self.controlled(middle, second, direction, halvings + 1);
        }
        self.failed |= difference.is_nan() || difference > UNSOUND * self.largest;
        // The error of fourth order is a sixteenth after halving.
        std::array::from_fn(|row| end[row] + (end[row] - whole[row]) / 15.0)
    }

    /// One step of Lawson's method.
    fn step(&mut self, x: State, part: Part, direction: f64) -> State {
        let seconds = 0.5 * part.width * self.columns.delta;
        let half = self.transition(0.5 * part.width);
        let [begin, end] = self.torque_over(part);
        let scale = self.per_torque(seconds);
        let middle = 0.5 * (begin + end);
        let [first, second] = [[begin, middle], [middle, end]].map(|pair| pair.map(|torque| scale * torque));
        // In half steps: velocities are angles a half step.
        let x = if self.order == Derivatives::Second { [x[0], x[1] * seconds] } else { [x[0], 0.0] };
        let rate = |x: State, this: &mut Self| {
            let force = -scale * this.nonlinear([x[0], x[1] / seconds], direction);
            if this.order == Derivatives::Second { [0.0, force] } else { [force, 0.0] }
        };
        let one = rate(x, self);
        let at_middle = half.advance(x, first);
        let two = rate(sum(at_middle, half.apply(one)), self);
        let three = rate(sum(at_middle, two), self);
        let at_end = half.advance(at_middle, second);
        let four = rate(sum(at_end, half.apply(three).map(|value| 2.0 * value)), self);
        let inner = half.apply(sum(two, three)).map(|value| 2.0 * value);
        let total = sum(sum(half.apply(half.apply(one)), inner), four);
        let [angle, velocity] = sum(at_end, total.map(|value| value / 3.0));
        if self.order == Derivatives::Second {
            return [angle, velocity / seconds];
        }
        let left = end - self.coefficients[2] * angle - self.of_the_angle(angle);
        [angle, left / self.coefficients[1]]
    }

    /// What further terms take of the torque.
    fn nonlinear(&self, x: State, direction: f64) -> f64 {
        let velocity = if direction == 0.0 { x[1] } else { direction * (direction * x[1]).max(f64::MIN_POSITIVE) };
        self.of_the_angle(x[0]) + self.of_the_velocity(velocity)
    }

    /// What terms of the angle take of the torque.
    fn of_the_angle(&self, angle: f64) -> f64 {
        let terms = self.columns.of_angle.iter().zip(&self.of_angle);
        terms.map(|((function, _), factor)| factor * function.at(angle)).sum()
    }

    /// What terms of the velocity take of the torque.
    pub(crate) fn of_the_velocity(&self, velocity: f64) -> f64 {
        let terms = self.columns.of_velocity.iter().zip(&self.of_velocity);
        terms.map(|((function, _), factor)| factor * function.at(velocity)).sum()
    }

    /// The torque at the beginning and the end of a part that stiffness and terms of the angle leave.
    pub(crate) fn net(&self, angle: f64, part: Part) -> [f64; 2] {
        let held = self.coefficients[2] * angle + self.of_the_angle(angle);
        self.torque_over(part).map(|torque| torque - held)
    }

    fn torque_over(&self, part: Part) -> [f64; 2] {
        let [begin, end] = self.torque;
        [part.begin, part.begin + part.width].map(|place| begin + place * (end - begin))
    }

    /// What a torque of one does in so many seconds.
    fn per_torque(&self, seconds: f64) -> f64 {
        let [inertia, damping, _] = self.coefficients;
        if self.order == Derivatives::Second { seconds * seconds / inertia } else { seconds / damping }
    }

    fn transition(&mut self, width: f64) -> Transition {
        #[allow(clippy::float_cmp, reason = "the same number, or computed anew")]
        if let Some((_, known)) = self.known.iter().find(|(one, _)| *one == width) {
            return *known;
        }
        let seconds = width * self.columns.delta;
        let [inertia, damping, stiffness] = self.coefficients;
        let found = match self.order {
            Derivatives::Second => {
                Transition::of_second_order(damping * seconds / inertia, stiffness * seconds * seconds / inertia)
            }
            Derivatives::First => Transition::of_first_order(stiffness * seconds / damping),
            Derivatives::Static => Transition::of_first_order(0.0),
        };
        // Halvings of a period return, parts that end at an event do not.
        if self.known.len() <= HALVINGS as usize && width.log2().fract() == 0.0 {
            self.known.push((width, found));
        }
        found
    }
}

/// Angles at the beginning and the end, as the state at the end.
trait IntoEnd {
    fn into_end(self, seconds: f64) -> State;
}

impl IntoEnd for [f64; 2] {
    fn into_end(self, seconds: f64) -> State {
        [self[1], (self[1] - self[0]) / seconds]
    }
}

fn sum(one: State, other: State) -> State {
    [one[0] + other[0], one[1] + other[1]]
}
