//! The ends of a record: the first and the last full window evaluated off their centres.
//!
//! The gain of noise towards a window's end is steep: that of the second derivative grows 15 fold for order 5 and 49 fold for order 9.
//! The order that fits the window best need not be the best to evaluate there. So each derivative takes, at each position, the order
//! with the least estimated squared bias plus variance (see [`crate::local_polynomials::off_centre`]).
//!
//! Where several orders share in a window (see [`crate::local_polynomials::order_selection`]), each of them is `top` in
//! its turn, and what comes of it is averaged.

use std::ops::Range;
use std::sync::OnceLock;

use crate::local_polynomials::basis::Basis;
use crate::local_polynomials::estimates::Estimates;
use crate::local_polynomials::off_centre::{Evaluated, OffCentre, Tabulate, Top};
use crate::local_polynomials::options::{Order, PolynomialOptions};
use crate::local_polynomials::order_average::Akaike;
use crate::local_polynomials::order_shares::Wanted;
use crate::local_polynomials::single_window::Window;
use crate::record::samples::Samples;
use crate::simd::instructions::Instructions;
use crate::simd::vectors::dispatch;
use crate::status::Status;

/// One end of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The samples before the centre of the first full window.
    First,
    /// The samples after the centre of the last full window.
    Last,
}

/// Plan of the ends.
#[derive(Debug)]
pub(crate) struct Ends {
    order: Order,
    derivatives: Vec<usize>,
    delta: f64,
    /// Residuals are at least this.
    floor: f64,
    /// Where orders are averaged.
    akaike: Option<Akaike>,
    /// Where an order is chosen: what residuals are multiplied by before orders are compared.
    weights: Vec<f64>,
    /// Made when it is first needed.
    table: OnceLock<Vec<f64>>,
    instructions: Instructions,
}

/// A table of the polynomials that is kept has at most so many numbers: 1 MB.
const LARGEST_TABLE: usize = 1 << 17;

/// A derivative at one position and its standard error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Estimate {
    pub(crate) value: f64,
    pub(crate) error: f64,
}

impl Ends {
    pub(crate) fn new(options: &PolynomialOptions, basis: &Basis) -> Self {
        let (order, floor, instructions) = (options.order, options.quantisation_floor(), options.instructions);
        let akaike = Akaike::of(options, basis.degrees());
        let weights = match order {
            Order::Fixed(_) => Vec::new(),
            Order::Chosen { criterion, .. } => {
                (0..basis.degrees()).map(|order| criterion.weight(order, basis.length())).collect()
            }
        };
        let (derivatives, delta) = (options.derivatives.clone(), options.delta);
        Self { order, derivatives, delta, floor, akaike, weights, table: OnceLock::new(), instructions }
    }

    /// The orders that share in a window where they are averaged, and their shares.
    fn averaged(&self, window: &Window) -> Option<Vec<(usize, f64)>> {
        let least = window.floor.max(f64::MIN_POSITIVE);
        let residuals: Vec<f64> = window.residuals.iter().map(|residual| residual.max(least)).collect();
        let shares = self.akaike.as_ref()?.shares(&residuals).into_iter().enumerate();
        Some(shares.filter(|(_, share)| *share > 0.0).collect())
    }

    /// Writes what is wanted of the given samples, all of them at one end of the record. `orders` are those that share in the window
    /// there and their shares, where it does not choose for itself.
    #[allow(clippy::too_many_arguments, reason = "which samples of which record, and where they go")]
    pub(crate) fn estimate(
        &self,
        basis: &Basis,
        record: &dyn Samples,
        end: End,
        orders: Option<Vec<(usize, f64)>>,
        samples: Range<usize>,
        wanted: Wanted,
        estimates: &mut Estimates<'_>,
    ) {
        let (first, fit) = self.fit(basis, record, end, orders);
        let elements = estimates.elements.of(samples);
        let Some(fit) = fit else {
            for element in elements {
                estimates.nothing(element);
            }
            return;
        };
        let places: Vec<usize> = elements.clone().map(|element| estimates.elements.sample(element) - first).collect();
        self.evaluate(basis, (end, &fit), &places, |place, slot, estimate| {
            estimates.derivatives[slot][elements.start + place] = match wanted {
                Wanted::Derivatives => estimate.value,
                Wanted::Errors => estimate.error,
            };
        });
        for element in elements {
            estimates.diagnose(element, fit.order, Status::EDGE | fit.status, fit.sigma);
        }
    }

    /// The window at an end and its first sample.
    fn fit(
        &self,
        basis: &Basis,
        record: &dyn Samples,
        end: End,
        orders: Option<Vec<(usize, f64)>>,
    ) -> (usize, Option<BoundaryFit>) {
        let length = basis.length();
        let first = match end {
            End::First => 0,
            End::Last => record.len() - length,
        };
        let mut samples = vec![0.0; length];
        record.read(first, &mut samples);
        let window = Window::project(basis, &samples, self.floor);
        let fit = |window: Window| {
            let (order, chosen) = match self.order {
                Order::Fixed(order) => (order, false),
                Order::Chosen { .. } => (window.best(&self.weights), true),
            };
            let orders = orders.or_else(|| self.averaged(&window)).unwrap_or_else(|| vec![(order, 1.0)]);
            BoundaryFit::new(window, orders, chosen, length)
        };
        (first, window.map(fit))
    }

    /// Gives every derivative at some samples of the window, by the place among those samples and among the derivatives asked for.
    fn evaluate(
        &self,
        basis: &Basis,
        (end, fit): (End, &BoundaryFit),
        places: &[usize],
        mut give: impl FnMut(usize, usize, Estimate),
    ) {
        let (lanes, numbers) = (self.instructions.lanes(), self.numbers(basis));
        let table = self.table(basis);
        let mut own = vec![0.0; if table.is_some() { 0 } else { numbers }];
        let mut found = vec![Evaluated::default(); self.highest() + 1];
        // The last window is looked at from its end, in reversed time: there odd polynomials and odd derivatives change their sign.
        let outward = |place: usize| if end == End::First { place } else { basis.length() - 1 - place };
        let mut coefficients = fit.window.coefficients.clone();
        if end == End::Last {
            coefficients.iter_mut().skip(1).step_by(2).for_each(|odd| *odd = -*odd);
        }
        let mut first = 0;
        while let Some(place) = places.get(first) {
            let group = outward(*place) / lanes;
            let some = places[first..].iter().take_while(|place| outward(**place) / lanes == group);
            let table = if let Some(table) = table {
                &table[group * numbers..][..numbers]
            } else {
                dispatch(self.instructions, Tabulate { basis, place: group * lanes, table: &mut own });
                &own
            };
            let (coefficients, tops, chosen) = (&coefficients, &fit.tops, fit.chosen);
            dispatch(self.instructions, OffCentre { table, coefficients, tops, chosen, found: &mut found });
            let mut next = first;
            for place in some {
                let lane = outward(*place) % lanes;
                let mut scale = 1.0;
                for (derivative, found) in found.iter().enumerate() {
                    if derivative > 0 {
                        scale /= self.delta;
                    }
                    let sign = if end == End::Last && derivative % 2 == 1 { -scale } else { scale };
                    let level = if derivative == 0 { fit.window.reference } else { 0.0 };
                    let (value, error) = (found.values[lane] * sign + level, found.errors[lane] * scale);
                    for (slot, _) in self.derivatives.iter().enumerate().filter(|(_, wanted)| **wanted == derivative) {
                        give(next, slot, Estimate { value, error });
                    }
                }
                next += 1;
            }
            first = next;
        }
    }

    fn highest(&self) -> usize {
        self.derivatives.iter().max().copied().unwrap_or(0)
    }

    /// Numbers that [`Tabulate`] gives for one group of places.
    fn numbers(&self, basis: &Basis) -> usize {
        (self.highest() + 1) * basis.degrees() * self.instructions.lanes()
    }

    /// The polynomials at all places before the centre, group by group, unless they take too much memory.
    fn table(&self, basis: &Basis) -> Option<&[f64]> {
        let (lanes, numbers) = (self.instructions.lanes(), self.numbers(basis));
        let groups = (basis.length() / 2).div_ceil(lanes);
        if groups * numbers > LARGEST_TABLE {
            return None;
        }
        let table = self.table.get_or_init(|| {
            let mut table = vec![0.0; groups * numbers];
            for (group, table) in table.chunks_exact_mut(numbers).enumerate() {
                dispatch(self.instructions, Tabulate { basis, place: group * lanes, table });
            }
            table
        });
        Some(table)
    }
}

/// A window at an end, its order and noise.
struct BoundaryFit {
    window: Window,
    /// The orders that share in the window, their shares and noise.
    tops: Vec<Top>,
    order: usize,
    sigma: f64,
    status: Status,
    chosen: bool,
}

impl BoundaryFit {
    fn new(window: Window, shares: Vec<(usize, f64)>, chosen: bool, length: usize) -> Self {
        let variance = |order: usize| {
            let freedom = length - order - 1;
            if freedom == 0 { f64::NAN } else { window.residuals[order].max(window.floor) / freedom as f64 }
        };
        let tops: Vec<Top> =
            shares.into_iter().map(|(order, share)| Top { order, share, variance: variance(order) }).collect();
        let largest = tops.iter().reduce(|best, top| if top.share > best.share { top } else { best });
        let order = largest.map_or(0, |top| top.order);
        let mut status = Status::GOOD;
        if chosen && window.residuals.len() > 1 {
            if order == 0 {
                status |= Status::LOWEST_ORDER;
            }
            if order + 1 == window.residuals.len() {
                status |= Status::HIGHEST_ORDER;
            }
        }
        if window.residuals[order] <= window.floor {
            status |= Status::EXACT;
        }
        let sigma = tops.iter().map(|top| top.share * top.variance).sum::<f64>().sqrt();
        Self { window, tops, order, sigma, status, chosen }
    }
}
