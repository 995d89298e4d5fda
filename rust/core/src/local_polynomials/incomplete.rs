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
use crate::local_polynomials::held_samples::{HeldSamples, HeldWindow};
use crate::local_polynomials::incomplete_record::Incomplete;
use crate::local_polynomials::options::Order;
use crate::local_polynomials::order_table::{OrderTable, OrderTables};
use crate::local_polynomials::own_orders::OwnOrders;
use crate::local_polynomials::plan::LocalPolynomials;
use crate::local_polynomials::weighted_samples::{LONG, OwnPolynomials, WeightedMemory, WeightedSamples};
use crate::local_polynomials::weighted_windows::{HARDLY_THERE, OwnWindows};
use crate::simd::instructions::Instructions;
use crate::simd::vectors::{MOST_LANES, dispatch};
use crate::status::Status;

/// Windows in a piece of work.
const PIECE: usize = 64;

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
    /// By samples that are there.
    tables: OrderTables,
    /// Time of every sample of a whole window.
    times: Vec<f64>,
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
        let numbers =
            WeightedMemory::numbers(self.options().window_length).saturating_add(6 * self.options().window_length);
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
        let IncompleteMemory { held, own, tables, times } = memory;
        if times.len() != length {
            *times = (0..length).map(|sample| basis.position(sample) * scale).collect();
            *tables = OrderTables::default();
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
        let one_by_one = if length > LONG { Instructions::Scalar } else { side_by_side };
        let derivatives = self.options().derivatives.iter().copied().max().unwrap_or(0);
        for (instructions, twice) in [(side_by_side, false), (one_by_one, true)] {
            for some in windows.chunks(instructions.lanes()) {
                if !go_on() {
                    return;
                }
                let mut lanes = [WeightedSamples::default(); MOST_LANES];
                for (lane, window) in lanes.iter_mut().zip(some) {
                    *lane = held.own(window, times);
                }
                let (windows, degrees) = (&lanes[..some.len()], self.orders());
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

    /// Half the length of a window in samples, which polynomials of a window's own have the time 1 at.
    fn half_length(&self) -> f64 {
        ((self.basis().length() - 1) as f64 / 2.0).max(0.5)
    }

    /// The estimate from the polynomials of a window.
    fn estimate_held(&self, own: &OwnPolynomials, window: &HeldWindow, table: &OrderTable) -> IncompleteEstimate {
        let options = self.options();
        let quantised = options.quantisation_floor() / options.window_length as f64;
        let orders = OwnOrders::new(own, table, quantised);
        let mut flags = window.flags;
        let Some(order) = orders.order(options.order) else {
            return IncompleteEstimate::invalid(options.derivatives.len(), flags);
        };
        let is_full = flags == Status::GOOD;
        let is_chosen = matches!(options.order, Order::Chosen { .. });
        if is_chosen && self.orders() > 1 {
            if order == 0 {
                flags |= Status::LOWEST_ORDER;
            }
            if order + 1 == self.orders() {
                flags |= Status::HIGHEST_ORDER;
            }
        }
        if orders.is_exact(order) {
            flags |= Status::EXACT;
        }
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
