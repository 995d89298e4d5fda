//! Windows that lack samples, or whose samples have weights: each is fitted on what is there, by polynomials of its own.
//!
//! They are orthogonal on the samples that the window holds ([`crate::local_polynomials::weighted_windows`]), some windows side by side. With
//! coefficients `c_j` of the samples in them the fit of order `n` leaves `Σ_{j>n} c_j²` and the last residual, and has the derivative
//! `Σ_{j≤n} g_j c_j` with `g_j` the polynomials' derivatives at the sample. Where samples are missing a window is not symmetric, and noise
//! is amplified as near the ends of a record; so each derivative takes the order with the least estimated squared bias plus variance (see
//! `off_centre`). Errors know that the order was chosen, from the shares of all orders, as those of full windows do: with that of one order
//! alone intervals of 95 % covered 67 to 90 % beside gaps of simulated records, and 72 to 93 % where all weights were 1.

use std::num::NonZeroUsize;

use crate::error::Error;
use crate::exec::memory;
use crate::exec::pool::{self, GoOn, Piece, Watch};
use crate::local_polynomials::chebyshev_sums::MOST;
use crate::local_polynomials::held_samples::{HeldSamples, HeldWindow};
use crate::local_polynomials::incomplete_record::Incomplete;
use crate::local_polynomials::moment_tables::MomentTables;
use crate::local_polynomials::moment_windows::{MomentWindows, has_moments};
use crate::local_polynomials::options::Order;
use crate::local_polynomials::order_table::{OrderTable, OrderTables};
use crate::local_polynomials::own_orders::OwnOrders;
use crate::local_polynomials::plan::LocalPolynomials;
use crate::local_polynomials::table_columns::TableColumns;
use crate::local_polynomials::weighted_samples::{LONG, OwnPolynomials, WeightedMemory, WeightedSamples};
use crate::local_polynomials::weighted_windows::{HARDLY_THERE, OwnWindows};
use crate::simd::aligned::Aligned;
use crate::simd::instructions::Instructions;
use crate::simd::vectors::{MOST_LANES, dispatch};
use crate::status::Status;

/// Windows in a piece of work.
const PIECE: usize = 64;

/// Samples that a window must have beyond its candidates, or one of these may be none.
const LEFT: usize = 3;

/// What was found around one sample.
#[derive(Clone, Debug)]
pub struct IncompleteEstimate {
    /// Derivatives as the plan's options name them, and their standard errors.
    pub derivatives: Vec<(f64, f64)>,
    /// The order of the window.
    pub order: usize,
    /// Flags of [`crate::Status`].
    pub status: Status,
    /// Standard deviation of the noise of a sample of weight 1.
    pub sigma: f64,
}

impl IncompleteEstimate {
    fn invalid(derivatives: usize, status: Status) -> Self {
        let derivatives = vec![(f64::NAN, f64::NAN); derivatives];
        Self { derivatives, order: 0, status: status | Status::INVALID, sigma: f64::NAN }
    }
}

/// Memory of one thread.
#[derive(Clone, Debug, Default)]
pub(crate) struct IncompleteMemory {
    held: HeldSamples,
    own: WeightedMemory,
    moments: MomentMemory,
    /// By samples that are there.
    tables: OrderTables,
    /// Time of every sample of a whole window.
    times: Vec<f64>,
}

/// Memory for windows that are fitted from their moments.
#[derive(Clone, Debug, Default)]
struct MomentMemory {
    polynomials: MomentTables,
    samples: [Aligned; 2],
    columns: Option<TableColumns>,
}

impl MomentMemory {
    /// Numbers that windows of a length need in one thread.
    fn numbers(length: usize) -> usize {
        length.saturating_mul(2 * MOST_LANES + MOST)
    }
}

impl LocalPolynomials {
    /// Estimates at some samples of a record, each from what its window holds.
    ///
    /// # Errors
    /// If the record is shorter than the window, there is not the memory, or the watch cancels.
    pub fn run_incomplete(
        &self,
        record: &Incomplete<'_>,
        places: &[usize],
        workers: NonZeroUsize,
        watch: &mut Watch<'_>,
    ) -> Result<Vec<IncompleteEstimate>, Error> {
        self.windows(record.samples.len())?;
        let length = self.options().window_length;
        let numbers =
            WeightedMemory::numbers(length).saturating_add(MomentMemory::numbers(length)).saturating_add(6 * length);
        memory::ask_for_numbers(numbers.saturating_mul(workers.get()))?;
        let mut found: Vec<Option<IncompleteEstimate>> = vec![None; places.len()];
        let pieces: Vec<_> = places
            .chunks(PIECE)
            .zip(found.chunks_mut(PIECE))
            .map(|content| Piece { size: content.0.len(), content })
            .collect();
        let work = |(places, found): (&[usize], &mut [_]), memory: &mut IncompleteMemory, go_on: &GoOn<'_>| {
            self.fit_incomplete(record, places, memory, found, go_on);
        };
        pool::run_long(pieces, workers, IncompleteMemory::default, work, watch)?;
        let derivatives = self.options().derivatives.len();
        let or_nothing = |one: Option<_>| one.unwrap_or_else(|| IncompleteEstimate::invalid(derivatives, Status::GOOD));
        Ok(found.into_iter().map(or_nothing).collect())
    }

    /// Estimates at some samples; none where the work is to end.
    pub(crate) fn fit_incomplete(
        &self,
        record: &Incomplete<'_>,
        places: &[usize],
        memory: &mut IncompleteMemory,
        found: &mut [Option<IncompleteEstimate>],
        go_on: &GoOn<'_>,
    ) {
        let (basis, length, scale) = (self.basis(), self.basis().length(), self.half_length().recip());
        let IncompleteMemory { held, own, moments, tables, times } = memory;
        if times.len() != length {
            *times = (0..length).map(|sample| basis.position(sample) * scale).collect();
            *tables = OrderTables::default();
            *moments = MomentMemory::default();
        }
        held.clear();
        let mut windows: Vec<HeldWindow> = Vec::with_capacity(places.len());
        for ((number, place), found) in places.iter().enumerate().zip(&mut *found) {
            match held.window(record, (number, *place), (length, self.before_centre())) {
                Ok(window) => windows.push(window),
                Err(flags) => *found = Some(IncompleteEstimate::invalid(self.options().derivatives.len(), flags)),
            }
        }
        let side_by_side = self.options().instructions;
        let derivatives = self.options().derivatives.iter().copied().max().unwrap_or(0);
        let degrees = self.orders();
        if has_moments(degrees, derivatives) {
            if moments.columns.is_none() {
                moments.polynomials = MomentTables::new(&times[length / 2..], 2 * degrees - 1);
            }
            let is_enough = |window: &&HeldWindow| window.is_whole(length) && window.count >= degrees + LEFT;
            let whole: Vec<HeldWindow> = windows.iter().filter(is_enough).cloned().collect();
            for some in whole.chunks(side_by_side.lanes()) {
                if !go_on() {
                    return;
                }
                for window in some {
                    tables.make(self.options().order, window.count);
                }
                let weighted = record.weights.is_some();
                self.fit_from_moments(held, (some, weighted), derivatives, (times, tables), moments, found);
            }
            windows.retain(|window| found[window.number].is_none());
        }
        let one_by_one = if length > LONG { Instructions::Scalar } else { side_by_side };
        for (instructions, twice) in [(side_by_side, false), (one_by_one, true)] {
            for some in windows.chunks(instructions.lanes()) {
                if !go_on() {
                    return;
                }
                let mut lanes = [WeightedSamples::default(); MOST_LANES];
                for (lane, window) in lanes.iter_mut().zip(some) {
                    *lane = held.own(window, times);
                }
                let windows = &lanes[..some.len()];
                dispatch(
                    instructions,
                    OwnWindows { memory: own, windows, degrees, derivatives, dependent: HARDLY_THERE, twice },
                );
                for (window, own) in some.iter().zip(&own.found).filter(|(_, own)| own.orthogonal) {
                    let table = tables.make(self.options().order, window.count);
                    found[window.number] = Some(self.estimate_held(own, window, table));
                }
            }
            windows.retain(|window| found[window.number].is_none());
        }
    }

    /// Fits windows side by side from their moments; nothing is found of those for which that loses digits.
    fn fit_from_moments(
        &self,
        held: &HeldSamples,
        (windows, weighted): (&[HeldWindow], bool),
        derivatives: usize,
        (times, orders): (&[f64], &OrderTables),
        memory: &mut MomentMemory,
        found: &mut [Option<IncompleteEstimate>],
    ) {
        let (options, instructions) = (self.options(), self.options().instructions);
        let MomentMemory { polynomials, samples, columns } = memory;
        let columns = columns.get_or_insert_with(|| TableColumns::new(instructions.lanes()));
        let (mut at, mut off_centre) = ([0.0; MOST_LANES], [0.0; MOST_LANES]);
        for (lane, window) in windows.iter().enumerate() {
            at[lane] = times[window.at];
            off_centre[lane] = f64::from(u8::from(window.flags != Status::GOOD));
            if columns.lengths[lane] != window.count {
                columns.set(lane, orders.of(window.count));
            }
        }
        let kernel = MomentWindows {
            samples: held.side_by_side(windows, (instructions, weighted), samples),
            tables: polynomials,
            columns,
            times: at,
            off_centre,
            degrees: self.orders(),
            is_chosen: matches!(options.order, Order::Chosen { .. }),
            derivatives,
            quantised: self.quantised(),
        };
        let fits = dispatch(instructions, kernel);
        let step = (options.delta * self.half_length()).recip();
        for (lane, window) in windows.iter().enumerate().filter(|(lane, _)| fits.good >> lane & 1 == 1) {
            let one = |&derivative: &usize| {
                let scale = step.powi(i32::try_from(derivative).unwrap_or(i32::MAX));
                let level = if derivative == 0 { window.reference } else { 0.0 };
                (fits.values[derivative][lane] * scale + level, fits.errors[derivative][lane] * scale)
            };
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an order")]
            let order = fits.order[lane] as usize;
            found[window.number] = Some(IncompleteEstimate {
                derivatives: options.derivatives.iter().map(one).collect(),
                order,
                status: self.flags(window, order, fits.exact >> lane & 1 == 1),
                sigma: fits.sigma[lane],
            });
        }
    }

    /// What a quantisation leaves of a squared residual.
    fn quantised(&self) -> f64 {
        self.options().quantisation_floor() / self.options().window_length as f64
    }

    /// The flags of a window of which an order was taken.
    fn flags(&self, window: &HeldWindow, order: usize, is_exact: bool) -> Status {
        let mut flags = window.flags;
        if matches!(self.options().order, Order::Chosen { .. }) && self.orders() > 1 {
            if order == 0 {
                flags |= Status::LOWEST_ORDER;
            }
            if order + 1 == self.orders() {
                flags |= Status::HIGHEST_ORDER;
            }
        }
        if is_exact {
            flags |= Status::EXACT;
        }
        flags
    }

    /// Half the length of a window in samples, which polynomials of a window's own have the time 1 at.
    fn half_length(&self) -> f64 {
        ((self.basis().length() - 1) as f64 / 2.0).max(0.5)
    }

    /// The estimate from the polynomials of a window.
    fn estimate_held(&self, own: &OwnPolynomials, window: &HeldWindow, table: &OrderTable) -> IncompleteEstimate {
        let options = self.options();
        let orders = OwnOrders::new(own, table, self.quantised());
        let Some(order) = orders.order(options.order) else {
            return IncompleteEstimate::invalid(options.derivatives.len(), window.flags);
        };
        let is_full = window.flags == Status::GOOD;
        let is_chosen = matches!(options.order, Order::Chosen { .. });
        let flags = self.flags(window, order, orders.is_exact(order));
        let variance = orders.variance(order);
        let shares = if is_chosen { Some(orders.shares()) } else { None };
        let step = (options.delta * self.half_length()).recip();
        let one = |derivative: &usize| {
            let scale = step.powi(i32::try_from(*derivative).unwrap_or(i32::MAX));
            let sums = orders.sums(*derivative);
            // A full window around its sample has the order that fits it, as everywhere.
            let lowest = if is_chosen && !is_full { (*derivative).min(order) } else { order };
            let taken = sums.best(order, lowest, variance);
            let own = || (variance * sums.gains[taken]).sqrt();
            let error = shares.as_ref().map_or_else(own, |shares| orders.error(&sums, taken, shares));
            let level = if *derivative == 0 { window.reference } else { 0.0 };
            (sums.values[taken] * scale + level, error * scale)
        };
        let derivatives = options.derivatives.iter().map(one).collect();
        IncompleteEstimate { derivatives, order, status: flags, sigma: (variance / own.unit).sqrt() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::local_polynomials::chebyshev_sums::DERIVATIVES;
    use crate::local_polynomials::criterion::Criterion;
    use crate::local_polynomials::incomplete_record::parts_of;
    use crate::local_polynomials::kept_digits::LOST;
    use crate::local_polynomials::options::{PolynomialOptions, Selection};

    const SAMPLES: usize = 400;

    /// Numbers between zero and one.
    fn random(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((*seed >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    /// Noise of variance one.
    fn noise(seed: &mut u64) -> f64 {
        (-2.0 * random(seed).ln()).sqrt() * (std::f64::consts::TAU * random(seed)).cos()
    }

    /// Noise of two levels, an offset, a motion that windows are too long for, and outliers.
    const SIGNALS: [fn(f64, &mut u64) -> f64; 5] = [
        |time, seed| (0.04 * time).sin() + 1e-3 * noise(seed),
        |time, seed| (0.04 * time).sin() + 1e-10 * noise(seed),
        |time, seed| 1e6 + (0.04 * time).sin() + 1e-3 * noise(seed),
        |time, seed| (0.4 * time).sin() + 1e-3 * noise(seed),
        |time, seed| (0.04 * time).sin() + 1e-3 * noise(seed) + if random(seed) < 0.002 { 1e6 } else { 0.0 },
    ];

    /// Weights: few samples missing, half of them, others that hardly differ, that reach over ten decades, some that count a million times, and
    /// small ones.
    const WEIGHTS: [fn(&mut u64) -> f64; 6] = [
        |seed| f64::from(u8::from(random(seed) > 0.02)),
        |seed| f64::from(u8::from(random(seed) > 0.5)),
        |seed| 0.2 + random(seed),
        |seed| (4.0 * noise(seed)).exp(),
        |seed| if random(seed) < 0.1 { 1e6 } else { 1.0 },
        |seed| if random(seed) < 0.3 { 0.0 } else { 1e-200 * (0.1 + random(seed)) },
    ];

    /// What is found around every sample, from moments unless there are more derivatives than these have.
    fn found(
        record: &Incomplete<'_>,
        window_length: usize,
        order: Order,
        more: bool,
        instructions: Instructions,
    ) -> Vec<IncompleteEstimate> {
        let derivatives = if more { vec![0, 1, 2, DERIVATIVES] } else { vec![0, 1, 2] };
        let options = PolynomialOptions {
            window_length,
            order,
            derivatives,
            delta: 1e-3,
            noise: true,
            selection: Selection::Window,
            quantisation: 0.0,
            instructions,
        };
        let plan = LocalPolynomials::new(options).expect("possible settings");
        let places: Vec<usize> = (0..record.samples.len()).collect();
        plan.run_incomplete(record, &places, NonZeroUsize::MIN, &mut |_, _| true).expect("nothing cancels")
    }

    #[test]
    fn windows_fitted_from_moments_are_those_of_polynomials_of_their_own() {
        let chosen = |highest| Order::Chosen { criterion: Criterion::Aicc, highest };
        let mut from_moments = 0;
        for (signal, kind) in (0..SIGNALS.len()).flat_map(|signal| (0..WEIGHTS.len()).map(move |kind| (signal, kind))) {
            let mut seed = (7 * signal + kind) as u64;
            let samples: Vec<f64> = (0..SAMPLES).map(|place| SIGNALS[signal](place as f64, &mut seed)).collect();
            let weights: Vec<f64> = samples.iter().map(|_| WEIGHTS[kind](&mut seed)).collect();
            for (case, (length, order)) in
                [(11, chosen(4)), (51, chosen(10)), (101, chosen(15)), (41, Order::Fixed(15))].into_iter().enumerate()
            {
                let parts = parts_of(&samples, Some(&weights), length / 2);
                let record =
                    Incomplete { samples: &samples, weights: Some(&weights), parts: &parts, least: length / 2 };
                let all = Instructions::available();
                let instructions = all[(case + signal + kind) % all.len()];
                let expected = found(&record, length, order, true, instructions);
                for (place, (one, other)) in
                    found(&record, length, order, false, instructions).iter().zip(&expected).enumerate()
                {
                    let what =
                        format!("signal {signal}, weights {kind}, {length}, {order:?}, {instructions:?} at {place}");
                    assert_eq!((one.order, one.status), (other.order, other.status), "{what}");
                    if other.sigma.is_nan() {
                        continue;
                    }
                    // Samples are rounded by 1e-6 of a noise of 1e-10; weights of 1e6 beside 1 make a thousandth of that, on either side.
                    let rounding = if signal == 1 { 2e-3 } else { 0.0 };
                    let near =
                        |one: f64, other: f64, scale: f64| (one - other).abs() <= (10.0 * LOST + rounding) * scale;
                    assert!(near(one.sigma, other.sigma, other.sigma), "{what}: noise");
                    for ((value, error), (truth, scale)) in one.derivatives.iter().zip(&other.derivatives) {
                        assert!(near(*error, *scale, *scale), "{what}: error");
                        let digits = 8.0 * f64::EPSILON * truth.abs();
                        assert!(near((value - truth).abs().max(digits), digits, *scale), "{what}: {value} for {truth}");
                    }
                    from_moments += usize::from(one.derivatives[0].0.to_bits() != other.derivatives[0].0.to_bits());
                }
            }
        }
        // The last digits of a quarter and more tell that they were found in another way.
        assert!(from_moments > SIGNALS.len() * WEIGHTS.len() * SAMPLES, "{from_moments}");
    }
}
