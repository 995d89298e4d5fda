//! Windows that share no basis with their neighbours, or whose samples have weights: each has polynomials of its own, some side by side.

use crate::irregular::window_estimates::{WindowFit, WindowFits};
use crate::irregular::window_places::{Numbered, OwnWindow, PlacedWindow};
use crate::local_polynomials::options::Order;
use crate::local_polynomials::order_table::OrderTable;
use crate::local_polynomials::own_orders::OwnOrders;
use crate::local_polynomials::weighted_samples::{WeightedMemory, WeightedSamples};
use crate::local_polynomials::weighted_windows::{DEPENDENT, HARDLY_THERE, OwnWindows};
use crate::record::samples::all_usable;
use crate::simd::instructions::Instructions;
use crate::simd::vectors::{MOST_LANES, dispatch};

/// Memory of one thread.
#[derive(Debug, Default)]
pub(crate) struct AloneMemory {
    own: WeightedMemory,
    /// Times of windows side by side, and weights of samples that all count alike.
    times: [Vec<f64>; MOST_LANES],
    alike: Vec<f64>,
}

/// A window that is fitted alone.
#[derive(Clone, Copy)]
struct WindowAlone<'a> {
    /// Its place among all windows, and the sample that it is for.
    place: usize,
    sample: usize,
    own: OwnWindow<'a>,
    table: &'a OrderTable,
    reference: f64,
}

impl WindowFit {
    /// Fits the windows that are not done. Each of `passes` says whether polynomials are made orthogonal twice, and is for those that were not
    /// orthogonal after the one before.
    pub(crate) fn apart<'a>(
        &self,
        record: &[f64],
        placed: &'a [PlacedWindow],
        numbered: Numbered,
        (done, passes): (&[bool], &[(Instructions, bool)]),
        (table, memory): (&dyn Fn(usize) -> &'a OrderTable, &mut AloneMemory),
        fits: &mut WindowFits<'_>,
    ) {
        let mut windows = Vec::new();
        for (place, window) in placed.iter().enumerate().filter(|(place, _)| !done[*place]) {
            match self.alone(record, (place, numbered.sample(place)), window, table(window.samples.len())) {
                Some(window) => windows.push(window),
                None => fits.invalidate(place),
            }
        }
        for &(instructions, twice) in passes {
            let mut again = Vec::new();
            for some in windows.chunks(instructions.lanes()) {
                self.fit_alone(record, some, instructions, twice, memory);
                for (window, own) in some.iter().zip(&memory.own.found) {
                    if own.orthogonal {
                        self.put(window, &OwnOrders::new(own, window.table, self.quantised()), fits);
                    } else {
                        again.push(*window);
                    }
                }
            }
            windows = again;
        }
    }

    /// The criterion of every candidate order in the window around a sample; NaN where it cannot be fitted.
    #[must_use]
    pub fn scores(&self, record: &[f64], sample: usize) -> Vec<f64> {
        let placed = self.span.around(&self.times, sample);
        let table = OrderTable::new(self.order, placed.samples.len());
        let Some(window) = self.alone(record, (0, sample), &placed, &table) else {
            let candidates = if let Order::Chosen { highest, .. } = self.order { highest + 1 } else { 1 };
            return vec![f64::NAN; candidates];
        };
        let mut memory = AloneMemory::default();
        self.fit_alone(record, &[window], Instructions::Scalar, true, &mut memory);
        OwnOrders::new(&memory.own.found[0], &table, self.quantised()).criteria(self.order)
    }

    /// A window that is to be fitted, or `None` where it holds an unusable sample or too few.
    fn alone<'a>(
        &self,
        record: &[f64],
        (place, sample): (usize, usize),
        placed: &'a PlacedWindow,
        table: &'a OrderTable,
    ) -> Option<WindowAlone<'a>> {
        let (samples, length) = (&record[placed.samples.clone()], placed.samples.len());
        if length < self.least || table.degrees == 0 || !all_usable(samples) {
            return None;
        }
        let own = self.span.own(&self.times, sample, placed);
        Some(WindowAlone { place, sample, own, table, reference: samples[length / 2] })
    }

    /// Fits windows, one a lane.
    fn fit_alone(
        &self,
        record: &[f64],
        some: &[WindowAlone<'_>],
        instructions: Instructions,
        twice: bool,
        memory: &mut AloneMemory,
    ) {
        let AloneMemory { own, times, alike } = memory;
        for (times, window) in times.iter_mut().zip(some) {
            let (range, scale) = (window.own.placed.samples.clone(), window.own.half.recip());
            alike.resize(alike.len().max(range.len()), 1.0);
            times.clear();
            times.extend(self.times[range].iter().map(|time| (time - window.own.middle) * scale));
        }
        let mut lanes = [WeightedSamples::default(); MOST_LANES];
        for ((lane, times), window) in lanes.iter_mut().zip(&*times).zip(some) {
            let range = window.own.placed.samples.clone();
            *lane = WeightedSamples {
                times,
                weights: self.weights.as_ref().map_or(&alike[..range.len()], |weights| &weights[range.clone()]),
                values: &record[range],
                reference: window.reference,
                at: (self.times[window.sample] - window.own.middle) / window.own.half,
                most: window.table.degrees,
            };
        }
        let degrees = some.iter().map(|window| window.table.degrees).max().unwrap_or(1);
        let (windows, derivatives) = (&lanes[..some.len()], self.derivatives);
        let dependent = if self.weights.is_some() { HARDLY_THERE } else { DEPENDENT };
        dispatch(instructions, OwnWindows { memory: own, windows, degrees, derivatives, dependent, twice });
    }

    /// What a quantisation leaves of a squared residual.
    fn quantised(&self) -> f64 {
        self.quantisation * self.quantisation / 12.0
    }

    /// Writes the estimates of a window.
    fn put(&self, window: &WindowAlone<'_>, orders: &OwnOrders<'_>, fits: &mut WindowFits<'_>) {
        let (edge, place) = (window.own.placed.edge, window.place);
        let Some(order) = orders.order(self.order) else { return fits.invalidate(place) };
        let is_chosen = matches!(self.order, Order::Chosen { .. });
        let variance = orders.variance(order);
        let shares = if is_chosen && !edge && !fits.errors.is_empty() { Some(orders.shares()) } else { None };
        for (derivative, row) in fits.derivatives.iter_mut().enumerate() {
            let scale = window.own.half.powi(-i32::try_from(derivative).unwrap_or(i32::MAX));
            let level = if derivative == 0 { window.reference } else { 0.0 };
            let sums = orders.sums(derivative);
            let taken = if is_chosen && edge { sums.best(order, derivative, variance) } else { order };
            row[place] = level + sums.values[taken] * scale;
            if let Some(errors) = fits.errors.get_mut(derivative) {
                let own = || (variance * sums.gains[taken]).sqrt();
                let error = shares.as_ref().map_or_else(own, |shares| orders.error(&sums, taken, shares));
                errors[place] = error * scale;
            }
        }
        fits.order[place] = u8::try_from(order).unwrap_or(u8::MAX);
        fits.status[place] = self.status(order, orders.orders(), edge, orders.is_exact(order)).bits();
        fits.sigma[place] = (variance / orders.unit()).sqrt();
    }
}
