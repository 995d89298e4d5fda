//! Dry friction: a system slides in one direction until its velocity is zero, then it sticks or turns.
//!
//! A term of the velocity that jumps at zero, from `F₋` to `F₊`, holds the system as long as the torque that is left is between them. Times
//! of stopping and of breaking away are found within the sample period, so that steps never reach over a jump.

use crate::response::integrator::{Integrator, Part, State};

/// Events in a sample period that are followed; there is no motion to speak of with more.
const EVENTS: usize = 40;
/// Parts of a sample period that are not cut further.
const SHORTEST: f64 = 1e-9;
/// Steps of the search for the time of stopping.
const SEARCH: usize = 40;

impl Integrator<'_> {
    /// The state at the next sample.
    pub(crate) fn advance(&mut self, x: State, linear: bool) -> State {
        if linear {
            return self.linear(x, Part::WHOLE);
        }
        let [below, above] = [-f64::MIN_POSITIVE, f64::MIN_POSITIVE].map(|velocity| self.of_the_velocity(velocity));
        if (above - below).abs() < 1e-12 * (above.abs() + below.abs()) || above == below {
            return self.controlled(x, Part::WHOLE, 0.0, 0);
        }
        self.slide(x, Part::WHOLE, [below, above])
    }

    /// The state at the end of a part, with friction between `below` and `above` at rest.
    fn slide(&mut self, mut x: State, mut part: Part, [below, above]: [f64; 2]) -> State {
        for _ in 0..EVENTS {
            if part.width < SHORTEST {
                return x;
            }
            let mut direction = x[1].signum();
            if x[1] == 0.0 {
                let [net, at_end] = self.net(x[0], part);
                if (below..=above).contains(&net) {
                    if (below..=above).contains(&at_end) {
                        return x;
                    }
                    // It breaks away on the way.
                    let limit = if at_end > above { above } else { below };
                    let stays = part.width * ((limit - net) / (at_end - net)).clamp(0.0, 1.0);
                    part = Part { begin: part.begin + stays, width: part.width - stays };
                    direction = if at_end > above { 1.0 } else { -1.0 };
                } else {
                    direction = (net - 0.5 * (below + above)).signum();
                }
            }
            let end = self.controlled(x, part, direction, 0);
            if direction * end[1] >= 0.0 || !end[1].is_finite() {
                return end;
            }
            let stopped;
            (x, stopped) = if x[1] == 0.0 {
                let [first, _] = part.halves();
                let middle = if first.width < SHORTEST { [x[0], 0.0] } else { self.controlled(x, first, direction, 0) };
                // It went and came back within the part, or never went.
                (if direction * middle[1] > 0.0 { middle } else { [x[0], 0.0] }, first.width)
            } else {
                self.stop(x, part, direction, direction * end[1])
            };
            part = Part { begin: part.begin + stopped, width: part.width - stopped };
        }
        [x[0], 0.0]
    }

    /// Where and when a motion stops that goes the other way at the end of a part: Illinois' rule of false position.
    fn stop(&mut self, x: State, part: Part, direction: f64, at_end: f64) -> (State, f64) {
        let (mut before, mut speed) = (0.0, direction * x[1]);
        let (mut after, mut beyond) = (part.width, at_end);
        let (start, mut found, mut last) = (speed, (x[0], 0.0), 0.0);
        for _ in 0..SEARCH {
            let width = before + (after - before) * speed / (speed - beyond);
            let there = self.controlled(x, Part { width, ..part }, direction, 0);
            let now = direction * there[1];
            found = (there[0], width);
            if now.abs() <= 1e-12 * start || after - before <= SHORTEST * part.width {
                break;
            }
            if now > 0.0 {
                (before, speed) = (width, now);
                beyond *= if last > 0.0 { 0.5 } else { 1.0 };
            } else {
                (after, beyond) = (width, now);
                speed *= if last < 0.0 { 0.5 } else { 1.0 };
            }
            last = now;
        }
        ([found.0, 0.0], found.1)
    }
}
