//! The state in which a stretch of a record began: least squares of the recorded angle.
//!
//! A linear system responds to its torque from rest, plus the two motions that an angle and a velocity begin: one step of least squares is
//! exact. With further terms the same is repeated on differences of responses, and a step is halved until it explains more.

use crate::record::samples::is_usable;
use crate::response::integrator::State;

/// Steps of Gauss and Newton, and halvings of each.
const STEPS: usize = 15;
const HALVINGS: usize = 8;
/// What a step must explain more of the squares to be followed by another.
const GAIN: f64 = 1e-8;
/// How far a state is moved to see what it does, of the largest angle.
const MOVED: f64 = 1e-5;
/// Samples of the line that the first state is taken from.
const LINE: usize = 9;
/// Beyond this share of a motion's squares both motions are one.
const SAME: f64 = 1e-20;

/// Angles that a state begins.
pub(crate) trait Responds {
    /// The response to a torque, or without one; `None` where it is cancelled.
    fn angles(&mut self, begin: State, torque: bool) -> Option<Vec<f64>>;
    /// Whether responses may be added.
    fn is_linear(&self) -> bool;
}

/// The state in which a record began whose angle was recorded every `delta` seconds; `None` if the work was cancelled.
pub(crate) fn initial_state(system: &mut impl Responds, recorded: &[f64], delta: f64) -> Option<State> {
    if system.is_linear() {
        let base = system.angles([0.0; 2], true)?;
        let columns = [system.angles([1.0, 0.0], false)?, system.angles([0.0, 1.0], false)?];
        return Some(least_squares(&columns, recorded, &base));
    }
    let size = recorded.iter().filter(|value| is_usable(**value)).fold(0.0_f64, |most, value| most.max(value.abs()));
    let mut state = line(recorded, delta);
    let mut base = system.angles(state, true)?;
    let mut squares = squares(recorded, &base);
    if squares.is_nan() {
        // A response that ends before the record does tells nothing of the beginning.
        return Some(state);
    }
    for _ in 0..STEPS {
        let duration = delta * recorded.len() as f64;
        let moved = [MOVED * size, MOVED * size / duration.max(delta)];
        if moved[0] == 0.0 {
            break;
        }
        let column = |angles: &[f64], base: &[f64], by: f64| -> Vec<f64> {
            angles.iter().zip(base).map(|(angle, base)| (angle - base) / by).collect()
        };
        let first = column(&system.angles([state[0] + moved[0], state[1]], true)?, &base, moved[0]);
        let second = column(&system.angles([state[0], state[1] + moved[1]], true)?, &base, moved[1]);
        let mut step = least_squares(&[first, second], recorded, &base);
        let before = squares;
        for _ in 0..HALVINGS {
            let tried = [state[0] + step[0], state[1] + step[1]];
            let angles = system.angles(tried, true)?;
            let left = self::squares(recorded, &angles);
            if left < squares {
                (state, base, squares) = (tried, angles, left);
                break;
            }
            step = step.map(|value| 0.5 * value);
        }
        if before - squares <= GAIN * before {
            break;
        }
    }
    Some(state)
}

/// How much of each column is in what is left of the record.
fn least_squares(columns: &[Vec<f64>; 2], recorded: &[f64], base: &[f64]) -> [f64; 2] {
    // The columns are scaled, so that a motion that grows or dies down a lot is no matter of range.
    let scales = [0, 1].map(|index| {
        let largest = columns[index].iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        if largest > 0.0 && largest.is_finite() { 1.0 / largest } else { 0.0 }
    });
    let rows = || {
        let each = columns[0].iter().zip(&columns[1]).zip(recorded.iter().zip(base));
        each.filter(|(_, (recorded, base))| is_usable(**recorded) && is_usable(**base))
            .map(|((one, other), (recorded, base))| (one * scales[0], other * scales[1], recorded - base))
    };
    // Orthogonal columns, one after the other: normal equations would square the condition number.
    let norm: f64 = rows().map(|(one, _, _)| one * one).sum();
    if norm == 0.0 || !norm.is_finite() {
        return [0.0; 2];
    }
    let mut shared = rows().map(|(one, other, _)| one * other).sum::<f64>() / norm;
    shared += rows().map(|(one, other, _)| one * (other - shared * one)).sum::<f64>() / norm;
    let whole: f64 = rows().map(|(_, other, _)| other * other).sum();
    let own: f64 = rows().map(|(one, other, _)| (other - shared * one).powi(2)).sum();
    let first = rows().map(|(one, _, left)| one * left).sum::<f64>() / norm;
    let second = if own > SAME * whole && own > 0.0 {
        rows().map(|(one, other, left)| (other - shared * one) * (left - first * one)).sum::<f64>() / own
    } else {
        0.0
    };
    [(first - shared * second) * scales[0], second * scales[1]]
}

/// Angle and velocity at the beginning of a line through the first samples.
fn line(recorded: &[f64], delta: f64) -> State {
    let first = recorded.iter().take(LINE).enumerate().filter(|(_, value)| is_usable(**value));
    let points: Vec<(f64, f64)> = first.map(|(sample, &value)| (sample as f64 * delta, value)).collect();
    let count = points.len().max(1) as f64;
    let mean = points.iter().fold([0.0; 2], |sum, point| [sum[0] + point.0 / count, sum[1] + point.1 / count]);
    let spread: f64 = points.iter().map(|point| (point.0 - mean[0]).powi(2)).sum();
    let slope = points.iter().map(|point| (point.0 - mean[0]) * (point.1 - mean[1])).sum::<f64>();
    let slope = if spread > 0.0 { slope / spread } else { 0.0 };
    [mean[1] - slope * mean[0], slope]
}

/// The squares that are left; NaN where a response is not a number.
fn squares(recorded: &[f64], angles: &[f64]) -> f64 {
    let pairs = recorded.iter().zip(angles).filter(|(recorded, _)| is_usable(**recorded));
    pairs.map(|(recorded, angle)| (recorded - angle).powi(2)).sum()
}
