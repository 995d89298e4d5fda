//! The motion of a linear system over one step, exact for constant coefficients and a torque that grows linearly.
//!
//! With time in steps and the state `x = (θ, θ′)` the equation `I θ̈ + C θ̇ + K θ = u` is `x′ = A x + b`, and
//!
//! ```text
//! x(1) = φ₀(A) x(0) + φ₁(A) b(0) + φ₂(A) (b(1) - b(0)),   φ₀ = exp A,  φ₁ = Σ Aʲ/(j+1)!,  φ₂ = Σ Aʲ/(j+2)!.
//! ```
//!
//! Series for a matrix of norm one or less, then doubling of the step (Al-Mohy, Higham 2011): no division by a determinant, so any coefficients will do.

/// A matrix of two rows.
type Matrix = [[f64; 2]; 2];

/// Terms of the series: the next is below 1e-17 for norms up to one.
const TERMS: i32 = 17;

const ONE: Matrix = [[1.0, 0.0], [0.0, 1.0]];

/// What a step does to angle and velocity. Velocities are in angles a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Transition {
    /// Of the state.
    pub(crate) state: Matrix,
    /// Of the acceleration at the step's beginning, and of its growth until the end.
    forced: [[f64; 2]; 2],
}

impl Transition {
    /// Of `θ″ + damping θ′ + stiffness θ = acceleration`, time in steps.
    pub(crate) fn of_second_order(damping: f64, stiffness: f64) -> Self {
        // Balanced, the norm is about the phase of a step, not its square.
        let balance = stiffness.abs().sqrt().max(1.0);
        let matrix = [[0.0, balance], [-stiffness / balance, -damping]];
        let [state, first, second] = functions(matrix);
        let back = |[[a, b], [c, d]]: Matrix| [[a, b / balance], [c * balance, d]];
        let forced = [back(first), back(second)].map(|[[_, angle], [_, velocity]]| [angle, velocity]);
        Self { state: back(state), forced }
    }

    /// Of `θ′ + stiffness θ = velocity`, time in steps. The state's second element stays zero.
    pub(crate) fn of_first_order(stiffness: f64) -> Self {
        let [state, first, second] = functions([[-stiffness, 0.0], [0.0, 0.0]]);
        Self { state: [[state[0][0], 0.0], [0.0; 2]], forced: [[first[0][0], 0.0], [second[0][0], 0.0]] }
    }

    /// The state after the step, for accelerations (of first order velocities) at its beginning and its end.
    pub(crate) fn advance(&self, x: [f64; 2], acceleration: [f64; 2]) -> [f64; 2] {
        let [begin, growth] = [acceleration[0], acceleration[1] - acceleration[0]];
        let homogeneous = self.apply(x);
        std::array::from_fn(|row| homogeneous[row] + self.forced[0][row] * begin + self.forced[1][row] * growth)
    }

    /// The state after a step without a torque.
    pub(crate) fn apply(&self, x: [f64; 2]) -> [f64; 2] {
        let [[a, b], [c, d]] = self.state;
        [a * x[0] + b * x[1], c * x[0] + d * x[1]]
    }
}

/// The three functions of a matrix.
fn functions(matrix: Matrix) -> [Matrix; 3] {
    let norm = matrix.map(|[a, b]| a.abs() + b.abs()).into_iter().fold(0.0, f64::max);
    let doublings = if norm > 1.0 && norm.is_finite() { norm.log2().ceil() } else { 0.0 };
    let small = matrix.map(|row| row.map(|value| value * (-doublings).exp2()));
    let mut second = ONE;
    for term in (1..TERMS).rev() {
        second = plus(ONE, scaled(times(small, second), 1.0 / f64::from(term + 2)));
    }
    second = scaled(second, 0.5);
    let mut first = plus(ONE, times(small, second));
    let mut state = plus(ONE, times(small, first));
    #[allow(clippy::cast_possible_truncation, reason = "at most 1024")]
    for _ in 0..doublings as i32 {
        second = scaled(plus(times(first, first), scaled(second, 2.0)), 0.25);
        first = scaled(times(plus(state, ONE), first), 0.5);
        state = times(state, state);
    }
    [state, first, second]
}

fn times(left: Matrix, right: Matrix) -> Matrix {
    left.map(|[a, b]| [a * right[0][0] + b * right[1][0], a * right[0][1] + b * right[1][1]])
}

fn plus(left: Matrix, right: Matrix) -> Matrix {
    [[left[0][0] + right[0][0], left[0][1] + right[0][1]], [left[1][0] + right[1][0], left[1][1] + right[1][1]]]
}

fn scaled(matrix: Matrix, factor: f64) -> Matrix {
    matrix.map(|row| row.map(|value| factor * value))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of some ten doublings of a step of ten radians.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn an_oscillator_turns_and_a_free_mass_flies_on() {
        for phase in [0.01, 0.3, 1.0, 10.0] {
            let transition = Transition::of_second_order(0.0, phase * phase);
            let [angle, velocity] = transition.apply([1.0, 0.0]);
            assert!(
                (angle - phase.cos()).abs() < ROUNDING && (velocity + phase * phase.sin()).abs() < phase * ROUNDING
            );
        }
        let free = Transition::of_second_order(0.0, 0.0);
        let [angle, velocity] = free.advance([1.0, 2.0], [3.0, 3.0 + 6.0]);
        // ½ · 3 and ⅙ · 6.
        assert!((angle - (1.0 + 2.0 + 1.5 + 1.0)).abs() < ROUNDING && (velocity - (2.0 + 3.0 + 3.0)).abs() < ROUNDING);
    }

    #[test]
    fn a_static_load_stays_where_it_is() {
        for (damping, stiffness) in [(0.1, 0.5), (1e3, 2.0), (3.0, 1e6), (1e9, 1e3)] {
            let [angle, velocity] =
                Transition::of_second_order(damping, stiffness).advance([2.0, 0.0], [2.0 * stiffness; 2]);
            // Each doubling of the step doubles the rounding error.
            let rounding = 4.0 * f64::EPSILON * (1.0 + damping + stiffness);
            assert!(
                (angle - 2.0).abs() < rounding && velocity.abs() < rounding * stiffness.max(1.0),
                "{angle} {velocity}"
            );
            let [angle, _] = Transition::of_first_order(stiffness).advance([2.0, 0.0], [2.0 * stiffness; 2]);
            assert!((angle - 2.0).abs() < rounding);
        }
    }

    #[test]
    fn two_steps_are_one_of_twice_the_length() {
        for (damping, stiffness) in [(0.3, 0.7), (-0.2, -0.4), (5.0, 0.1)] {
            let half = Transition::of_second_order(damping / 2.0, stiffness / 4.0);
            let whole = Transition::of_second_order(damping, stiffness);
            // Velocities and accelerations in angles a half step.
            let middle = half.advance([0.4, -0.1], [0.25, 0.5]);
            let [angle, velocity] = half.advance(middle, [0.5, 0.75]);
            let expected = whole.advance([0.4, -0.2], [1.0, 3.0]);
            assert!((angle - expected[0]).abs() < ROUNDING && (2.0 * velocity - expected[1]).abs() < ROUNDING);
        }
    }
}
