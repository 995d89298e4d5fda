//! The response over spans of a record: each begins in a state of its own, given or estimated.

use std::num::NonZeroUsize;
use std::ops::Range;

use crate::error::Error;
use crate::exec::memory;
use crate::exec::pool::{GoOn, Piece, Watch, run_long};
use crate::record::samples::Samples;
use crate::response::gaps::runs;
use crate::response::initial_state::{Responds, initial_state};
use crate::response::integrator::{Integrator, State};
use crate::response::system::{KnownSystem, System};

/// Samples between two looks at whether to go on.
const LOOK: usize = 256;

/// Samples from which the state is estimated at most where a term is not linear, since that takes several simulations.
const MOST_OF_NONLINEAR: usize = 1 << 13;

/// A stretch of a record that is simulated.
#[derive(Clone, Debug)]
pub struct Span {
    /// Its samples.
    pub samples: Range<usize>,
    /// How many of the first of them tell the state in which it begins.
    pub known: usize,
}

/// The response of one record.
#[derive(Clone, Debug, PartialEq)]
pub struct Response {
    /// Angle at every sample; NaN where nothing tells it.
    pub angle: Vec<f64>,
    /// Velocity at every sample.
    pub velocity: Vec<f64>,
    /// The first sample at which the response left the range of numbers, or could not be followed.
    pub lost: Option<usize>,
}

/// Where the state of a span comes from.
#[derive(Clone, Copy)]
pub enum Begins<'a> {
    /// Angle and velocity at the first sample of the record.
    In(State),
    /// Least squares of the recorded angle.
    As(&'a dyn Samples),
}

/// Simulates systems over spans of their records; over all that they hold where `spans` is `None`. What parameters or torque leave out ends
/// a span, and another begins behind it if the angle tells in which state.
///
/// # Errors
/// If there is not the memory, or the watch cancels.
pub fn respond(
    tasks: &[(System<'_>, Begins<'_>)],
    spans: Option<&[Span]>,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<Vec<Response>, Error> {
    let mut responses = Vec::new();
    for (system, _) in tasks {
        let samples = system.torque.len();
        memory::ask_for_numbers(samples.saturating_mul(14 + system.terms.len()))?;
        responses.push(Response { angle: vec![f64::NAN; samples], velocity: vec![f64::NAN; samples], lost: None });
    }
    let mut pieces = Vec::new();
    for (task, response) in tasks.iter().zip(&mut responses) {
        pieces.push(Piece { size: response.angle.len(), content: (task, response) });
    }
    let work =
        |((system, begins), response): (&(System<'_>, Begins<'_>), &mut Response), (): &mut (), go_on: &GoOn<'_>| {
            // Cancelled work is forgotten as a whole.
            let _ = simulate(&KnownSystem::read(system), *begins, spans, response, go_on);
        };
    run_long(pieces, workers, || (), work, watch)?;
    Ok(responses)
}

/// Simulates one record.
fn simulate(
    columns: &KnownSystem,
    begins: Begins<'_>,
    spans: Option<&[Span]>,
    response: &mut Response,
    go_on: &GoOn<'_>,
) -> Option<()> {
    let samples = response.angle.len();
    let whole = [Span { samples: 0..samples, known: samples }];
    let there = runs(samples, columns.needed());
    let mut recorded = Vec::new();
    for span in spans.unwrap_or(&whole) {
        for run in &there {
            let places = run.start.max(span.samples.start)..run.end.min(span.samples.end);
            if places.is_empty() {
                continue;
            }
            let begin = match begins {
                Begins::In(state) if places.start == 0 => state,
                Begins::In(_) => continue,
                Begins::As(angle) => {
                    let end = places.end.min(span.samples.start + span.known);
                    let most = if columns.is_linear() { samples } else { MOST_OF_NONLINEAR };
                    let known = places.start..end.min(places.start + most);
                    if known.len() < 3 {
                        continue;
                    }
                    recorded.resize(known.len(), 0.0);
                    angle.read(known.start, &mut recorded);
                    initial_state(&mut Simulation { columns, places: known, go_on }, &recorded, columns.delta)?
                }
            };
            let mut stretch = Simulation { columns, places: places.clone(), go_on };
            let Response { angle, velocity, lost } = &mut *response;
            stretch.run(begin, &mut angle[places.clone()], &mut velocity[places], lost)?;
        }
    }
    Some(())
}

/// A stretch of a record without gaps.
struct Simulation<'a> {
    columns: &'a KnownSystem,
    places: Range<usize>,
    go_on: &'a GoOn<'a>,
}

impl Simulation<'_> {
    /// Fills angle and velocity, and says where numbers end; `None` if cancelled.
    fn run(
        &mut self,
        begin: State,
        angles: &mut [f64],
        velocities: &mut [f64],
        lost: &mut Option<usize>,
    ) -> Option<()> {
        let mut integrator = Integrator::new(self.columns);
        let (linear, mut x) = (self.columns.is_linear(), integrator.begin(begin, self.places.start));
        for (place, sample) in self.places.clone().enumerate() {
            if place % LOOK == 0 && !(self.go_on)() {
                return None;
            }
            if place > 0 {
                integrator.enter(sample - 1);
                x = integrator.advance(x, linear);
            }
            if !crate::record::samples::all_usable(&x) || !integrator.is_sound() {
                *lost = lost.or(Some(sample));
                return Some(());
            }
            (angles[place], velocities[place]) = (x[0], x[1]);
        }
        Some(())
    }
}

impl Responds for Simulation<'_> {
    fn angles(&mut self, begin: State, torque: bool) -> Option<Vec<f64>> {
        let mut angles = vec![f64::NAN; self.places.len()];
        if torque {
            let mut velocities = angles.clone();
            self.run(begin, &mut angles, &mut velocities, &mut None)?;
            return Some(angles);
        }
        let (mut integrator, mut x) = (Integrator::new(self.columns), begin);
        for (place, sample) in self.places.clone().enumerate() {
            if place % LOOK == 0 && !(self.go_on)() {
                return None;
            }
            if place > 0 {
                integrator.enter(sample - 1);
                x = integrator.homogeneous(x);
            }
            angles[place] = x[0];
        }
        Some(angles)
    }

    fn is_linear(&self) -> bool {
        self.columns.is_linear()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equation::terms::BuiltInTerm;
    use crate::response::system::{Factor, SystemTerm};

    const DELTA: f64 = 0.01;

    fn system<'a>(torque: &'a dyn Samples, coefficients: [f64; 3], terms: &[(&str, f64)]) -> System<'a> {
        let term = |&(name, factor): &(&str, f64)| {
            (SystemTerm::BuiltIn(BuiltInTerm::named(name).unwrap()), Factor::Number(factor))
        };
        System {
            coefficients: coefficients.map(Factor::Number),
            terms: terms.iter().map(term).collect(),
            torque,
            lag: 0.0,
            delta: DELTA,
            bridged: 3,
        }
    }

    fn alone(system: System<'_>, begins: Begins<'_>) -> Response {
        respond(&[(system, begins)], None, NonZeroUsize::MIN, &mut |_, _| true).unwrap().remove(0)
    }

    #[test]
    fn a_free_oscillator_is_exact_and_its_beginning_is_found() {
        let torque = vec![0.0; 500];
        let torque: &[f64] = &torque;
        let found = alone(system(&torque, [2.0, 0.0, 50.0], &[]), Begins::In([0.3, 1.0]));
        for (sample, angle) in found.angle.iter().enumerate() {
            let phase = 5.0 * sample as f64 * DELTA;
            assert!((angle - 0.3 * phase.cos() - 0.2 * phase.sin()).abs() < 1e-12);
        }
        let angle = found.angle.as_slice();
        let again = alone(system(&torque, [2.0, 0.0, 50.0], &[]), Begins::As(&angle));
        assert!(again.angle.iter().zip(angle).all(|(one, other)| (one - other).abs() < 1e-12));
        assert!((again.velocity[0] - 1.0).abs() < 1e-11);
    }

    /// A block on a spring loses four times the friction over the stiffness of its amplitude in a cycle, and stops where friction holds it.
    #[test]
    fn dry_friction_takes_as_much_of_every_cycle_and_then_holds() {
        let torque = vec![0.0; 2000];
        let torque: &[f64] = &torque;
        let found = alone(system(&torque, [1.0, 0.0, 25.0], &[("coulomb", 0.5)]), Begins::In([1.0, 0.0]));
        for (sample, angle) in found.angle.iter().enumerate() {
            let phase = 5.0 * sample as f64 * DELTA;
            // Every half cycle is a cosine about 0.5/25 on the side that it comes from, until the spring cannot overcome friction any more.
            let half_cycles = (phase / std::f64::consts::PI).floor().min(24.0);
            let start = 1.0 - 0.04 * half_cycles;
            let sign = if half_cycles % 2.0 == 0.0 { 1.0 } else { -1.0 };
            let since = (phase - half_cycles * std::f64::consts::PI).min(std::f64::consts::PI);
            let expected = sign * (0.02 + (start - 0.02) * since.cos());
            assert!((angle - expected).abs() < 1e-7, "{sample}: {angle} {expected}");
        }
        let held = alone(system(&torque, [1.0, 0.0, 25.0], &[("coulomb", 0.5)]), Begins::In([0.019, 0.0]));
        assert!(held.angle.iter().all(|&angle| angle == 0.019));
    }

    /// Steps as short as they may be are sound, but there are thousands of them in every sample period.
    #[test]
    fn a_pendulum_that_swings_hundreds_of_times_in_a_sample_period_is_lost_soon() {
        let torque = vec![0.0; 500];
        let torque: &[f64] = &torque;
        let of = |gravity: f64| {
            alone(system(&torque, [1.0, 0.0, 0.0], &[("gravity", gravity)]), Begins::In([0.5, 0.0])).lost
        };
        assert!(of(1e10).is_some_and(|sample| (2..10).contains(&sample)), "{:?}", of(1e10));
        // A tenth of a swing in a sample period.
        assert_eq!(of(4e3), None);
        // Damping that leaves nothing of a velocity after a hundredth of a period.
        let damped = system(&torque, [1e-4, 1.0, 2.0], &[("gravity", 1.0)]);
        assert_eq!(alone(damped, Begins::In([0.5, 0.0])).lost, None);
    }

    /// The energy of a pendulum that swings far.
    #[test]
    fn a_pendulum_keeps_its_energy() {
        let torque = vec![0.0; 5000];
        let torque: &[f64] = &torque;
        let found = alone(system(&torque, [1.0, 0.0, 0.0], &[("gravity", 30.0)]), Begins::In([2.5, 0.0]));
        let energy = |sample: usize| 0.5 * found.velocity[sample].powi(2) - 30.0 * found.angle[sample].cos();
        assert!((0..5000).all(|sample| (energy(sample) - energy(0)).abs() < 1e-6 * 30.0));
        let angle = found.angle.as_slice();
        let again = alone(system(&torque, [1.0, 0.0, 0.0], &[("gravity", 30.0)]), Begins::As(&angle));
        assert!(again.angle.iter().zip(angle).all(|(one, other)| (one - other).abs() < 1e-5));
    }

    #[test]
    fn a_gap_ends_a_span_and_the_next_begins_behind_it() {
        let mut torque: Vec<f64> = (0..400).map(|sample| (0.1 * f64::from(sample)).sin()).collect();
        let whole = torque.clone();
        let whole: &[f64] = &whole;
        let found = alone(system(&whole, [1.0, 0.2, 9.0], &[("offset", 0.3)]), Begins::In([0.0; 2]));
        torque[200..220].fill(f64::NAN);
        torque[300] = f64::NAN;
        let (torque, angle): (&[f64], &[f64]) = (&torque, &found.angle);
        let gap = alone(system(&torque, [1.0, 0.2, 9.0], &[("offset", 0.3)]), Begins::As(&angle));
        assert!(gap.angle[200..220].iter().all(|angle| angle.is_nan()));
        assert!((gap.angle[219 + 5] - angle[219 + 5]).abs() < 1e-2 && (gap.angle[100] - angle[100]).abs() < 1e-12);
        let given = alone(system(&torque, [1.0, 0.2, 9.0], &[("offset", 0.3)]), Begins::In([0.0; 2]));
        assert!(given.angle[220..].iter().all(|angle| angle.is_nan()));
    }

    #[test]
    fn an_unstable_system_is_lost_where_numbers_end() {
        let torque = vec![1.0; 4000];
        let torque: &[f64] = &torque;
        let found = alone(system(&torque, [1.0, 0.0, -1e3], &[]), Begins::In([0.0; 2]));
        let lost = found.lost.unwrap();
        assert!(found.angle[lost - 1].is_finite() && found.angle[lost].is_nan());
    }

    #[test]
    fn systems_without_inertia_creep_or_follow() {
        let torque = vec![2.0; 300];
        let torque: &[f64] = &torque;
        let creeping = alone(system(&torque, [0.0, 4.0, 8.0], &[]), Begins::In([1.0, 0.0]));
        for (sample, angle) in creeping.angle.iter().enumerate() {
            let expected = 0.25 + 0.75 * (-2.0 * DELTA * sample as f64).exp();
            assert!((angle - expected).abs() < 1e-12);
        }
        let static_one = alone(system(&torque, [0.0, 0.0, 8.0], &[]), Begins::In([0.0; 2]));
        assert!(static_one.angle.iter().all(|&angle| angle == 0.25));
    }
}
