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

use crate::exec::pool::GoOn;
use crate::local_polynomials::basis::Basis;
use crate::local_polynomials::estimates::Estimates;
use crate::local_polynomials::off_centre::{Evaluated, OffCentre, Tabulate, Top};
use crate::local_polynomials::options::{Order, PolynomialOptions};
use crate::local_polynomials::order_average::Akaike;
use crate::local_polynomials::order_shares::Wanted;
use crate::local_polynomials::side_by_side::SideBySide;
use crate::local_polynomials::single_window::{Window, WindowsOf};
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

/// After so many groups of samples it is asked whether to go on: a group takes about a microsecond.
const ASKED: usize = 1 << 12;

/// Samples at one end of a record, and what is wanted of them.
pub(crate) struct Edge<'a> {
    pub(crate) end: End,
    pub(crate) samples: Range<usize>,
    pub(crate) wanted: Wanted,
    /// Half a window of millions of samples takes long.
    pub(crate) go_on: &'a GoOn<'a>,
}

/// The first sample of the window at an end.
fn first_window(basis: &Basis, samples: usize, end: End) -> usize {
    match end {
        End::First => 0,
        End::Last => samples - basis.length(),
    }
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

    /// Writes what is wanted of some samples at one end of the record. `orders` are those that share in the window there and their shares,
    /// where it does not choose for itself.
    pub(crate) fn estimate(
        &self,
        basis: &Basis,
        record: &dyn Samples,
        edge: &Edge<'_>,
        orders: Option<Vec<(usize, f64)>>,
        estimates: &mut Estimates<'_>,
    ) {
        let first = first_window(basis, record.len(), edge.end);
        let mut window = vec![0.0; basis.length()];
        record.read(first, &mut window);
        let window = Window::project_while(basis, &window, self.floor, edge.go_on);
        self.write(basis, (window, first), edge, orders, estimates);
    }

    /// Writes the derivatives of several records at some samples, all of them at one end, so many elements a record.
    pub(crate) fn estimate_side_by_side(
        &self,
        basis: &Basis,
        records: &SideBySide,
        end: End,
        samples: Range<usize>,
        elements: usize,
        estimates: &mut Estimates<'_>,
    ) {
        let (first, floor) = (first_window(basis, records.samples(), end), self.floor);
        let windows = dispatch(self.instructions, WindowsOf { basis, strips: records.strips(), first, floor });
        for (record, window) in windows.into_iter().take(records.count()).enumerate() {
            let usable = records.unusable(record, first..first + basis.length()).next().is_none();
            let mut own = estimates.part(record * elements..(record + 1) * elements);
            let edge = Edge { end, samples: samples.clone(), wanted: Wanted::Derivatives, go_on: &|| true };
            self.write(basis, (usable.then_some(window), first), &edge, None, &mut own);
        }
    }

    /// Writes what the window at an end, with its first sample, says of some samples.
    fn write(
        &self,
        basis: &Basis,
        (window, first): (Option<Window>, usize),
        edge: &Edge<'_>,
        orders: Option<Vec<(usize, f64)>>,
        estimates: &mut Estimates<'_>,
    ) {
        let elements = estimates.elements.of(edge.samples.clone());
        let Some(window) = window else {
            for element in elements {
                estimates.nothing(element);
            }
            return;
        };
        let fit = self.fit(window, basis.length(), orders);
        self.evaluate(basis, (&fit, first), edge, elements.clone(), estimates);
        for element in elements {
            estimates.diagnose(element, fit.order, Status::EDGE | fit.status, fit.sigma);
        }
    }

    /// The orders of a window at an end, and its noise.
    fn fit(&self, window: Window, length: usize, orders: Option<Vec<(usize, f64)>>) -> BoundaryFit {
        let (order, chosen) = match self.order {
            Order::Fixed(order) => (order, false),
            Order::Chosen { .. } => (window.best(&self.weights), true),
        };
        let orders = orders.or_else(|| self.averaged(&window)).unwrap_or_else(|| vec![(order, 1.0)]);
        BoundaryFit::new(window, orders, chosen, length)
    }

    /// Writes every derivative, or its standard error, at some samples of the window that begins at sample `begin`.
    fn evaluate(
        &self,
        basis: &Basis,
        (fit, begin): (&BoundaryFit, usize),
        &Edge { end, wanted, go_on, .. }: &Edge<'_>,
        elements: Range<usize>,
        estimates: &mut Estimates<'_>,
    ) {
        let (lanes, numbers) = (self.instructions.lanes(), self.numbers(basis));
        let table = self.table(basis);
        let mut own = vec![0.0; if table.is_some() { 0 } else { numbers }];
        let mut found = vec![Evaluated::default(); self.highest() + 1];
        // The last window is looked at from its end, in reversed time: there odd polynomials and odd derivatives change their sign.
        let all = estimates.elements;
        let outward = |element: usize| {
            let place = all.sample(element) - begin;
            if end == End::First { place } else { basis.length() - 1 - place }
        };
        let mut coefficients = fit.window.coefficients.clone();
        if end == End::Last {
            coefficients.iter_mut().skip(1).step_by(2).for_each(|odd| *odd = -*odd);
        }
        let mut first = elements.start;
        while first < elements.end {
            let group = outward(first) / lanes;
            if (first == elements.start || group.is_multiple_of(ASKED)) && !go_on() {
                return;
            }
            let within = group * lanes..(group + 1) * lanes;
            let table = if let Some(table) = table {
                &table[group * numbers..][..numbers]
            } else {
                dispatch(self.instructions, Tabulate { basis, place: within.start, table: &mut own });
                &own
            };
            let (coefficients, tops, chosen) = (&coefficients, &fit.tops, fit.chosen);
            let errors = wanted == Wanted::Errors;
            dispatch(self.instructions, OffCentre { table, coefficients, tops, chosen, errors, found: &mut found });
            let some = (first..elements.end).take_while(|&element| within.contains(&outward(element))).count();
            for (values, &derivative) in estimates.derivatives.iter_mut().zip(&self.derivatives) {
                let found = &found[derivative];
                let scale = (0..derivative).fold(1.0, |scale, _| scale / self.delta);
                let sign = if end == End::Last && derivative % 2 == 1 { -scale } else { scale };
                let level = if derivative == 0 { fit.window.reference } else { 0.0 };
                for (element, value) in (first..).zip(&mut values[first..first + some]) {
                    let lane = outward(element) - within.start;
                    *value = match wanted {
                        Wanted::Derivatives => found.values[lane] * sign + level,
                        Wanted::Errors => found.errors[lane] * scale,
                    };
                }
            }
            first += some;
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
