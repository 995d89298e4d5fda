//! The share of every order in the estimate of a window: by the window's own criterion, or pooled over its neighbours.

use std::ops::Range;

use crate::local_polynomials::basis::Basis;
use crate::local_polynomials::coefficients::{self, Coefficients, Projected};
use crate::local_polynomials::neighbour_sums::Pool;
use crate::local_polynomials::options::{Order, PolynomialOptions, Selection};
use crate::local_polynomials::order_average::Akaike;
use crate::local_polynomials::sliding_projection::ROUNDING;
use crate::record::samples::Samples;

/// What is written to the outputs of derivatives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wanted {
    Derivatives,
    Errors,
}

/// Plan of a selection that looks at all orders: for estimates where it is not the window's own, and for all standard errors.
#[derive(Debug)]
pub(crate) struct Selector {
    coefficients: Coefficients,
    pub(crate) selection: Selection,
    pub(crate) length: usize,
    /// What residuals are multiplied by before orders are compared.
    pub(crate) weights: Vec<f64>,
    pub(crate) derivatives: Vec<Derivative>,
    akaike: Akaike,
    /// Residuals are at least this.
    floor: f64,
}

/// A derivative at the centre: weights of the coefficients, and what a constant signal of one gives.
#[derive(Debug)]
pub(crate) struct Derivative {
    pub(crate) weights: Vec<f64>,
    pub(crate) constant: f64,
}

/// Memory of one thread. Rows hold one number a window.
#[derive(Debug)]
pub(crate) struct SelectionScratch {
    coefficients: coefficients::CoefficientScratch,
    pub(crate) projected: Projected,
    pool: Pool,
    /// Residual sums of squares, one row an order, none below the floor.
    pub(crate) residuals: Vec<Vec<f64>>,
    pub(crate) floor: Vec<f64>,
    /// Every order's share in the estimate, one row an order.
    pub(crate) shares: Vec<Vec<f64>>,
    /// Number of windows in each sum over neighbours.
    neighbours: Vec<f64>,
    /// The order of the largest share.
    pub(crate) chosen: Vec<usize>,
    pub(crate) row: Vec<f64>,
    pub(crate) mean: Vec<f64>,
    pub(crate) error: Vec<f64>,
}

impl Selector {
    /// Prepares the tables, or returns `None` if the order is fixed.
    pub(crate) fn new(options: &PolynomialOptions, basis: &Basis) -> Option<Self> {
        let Order::Chosen { criterion, .. } = options.order else { return None };
        let (length, degrees) = (basis.length(), basis.degrees());
        let all: Vec<usize> = (0..degrees).collect();
        let derivative = |&derivative: &usize| {
            let scale = options.delta.powi(i32::try_from(derivative).unwrap_or(i32::MAX)).recip();
            let weights = basis.evaluate(0.0, derivative).iter().map(|value| value * scale).collect();
            Derivative { weights, constant: f64::from(u8::from(derivative == 0)) }
        };
        let weights: Vec<f64> = all.iter().map(|&order| criterion.weight(order, length)).collect();
        Some(Self {
            akaike: Akaike::new(&weights, length, options.quantisation_floor()),
            coefficients: Coefficients::new(basis, &all, true, options.instructions),
            selection: options.selection,
            length,
            weights,
            derivatives: options.derivatives.iter().map(derivative).collect(),
            floor: options.quantisation_floor(),
        })
    }

    pub(crate) fn scratch(&self) -> SelectionScratch {
        let rows = vec![Vec::new(); self.weights.len()];
        SelectionScratch {
            coefficients: coefficients::CoefficientScratch::default(),
            projected: Projected::default(),
            pool: Pool::default(),
            residuals: rows.clone(),
            floor: Vec::new(),
            shares: rows,
            neighbours: Vec::new(),
            chosen: Vec::new(),
            row: Vec::new(),
            mean: Vec::new(),
            error: Vec::new(),
        }
    }

    /// Samples in a piece of work, at least: pooling looks at neighbours on both sides of a piece.
    pub(crate) fn least_piece(&self) -> usize {
        if self.selection == Selection::Pooled { 8 * self.length } else { 0 }
    }

    /// Finds the shares of every `step`-th of some windows. Returns the place of the first in every row, and the places
    /// from one to the next.
    pub(crate) fn share(
        &self,
        record: &dyn Samples,
        windows: Range<usize>,
        step: usize,
        wanted: Wanted,
        scratch: &mut SelectionScratch,
    ) -> (usize, usize) {
        if self.selection == Selection::Pooled {
            let known = Pool::needs(&windows, self.length, record.len() + 1 - self.length);
            let place = windows.start - known.start;
            self.project(record, known.clone(), 1, scratch);
            self.pool(known.start, windows, wanted, scratch);
            (place, step)
        } else {
            self.project(record, windows, step, scratch);
            self.weigh(scratch);
            (0, 1)
        }
    }

    /// Projects windows and sums up the residuals of every order.
    fn project(&self, record: &dyn Samples, windows: Range<usize>, step: usize, scratch: &mut SelectionScratch) {
        let SelectionScratch { coefficients, projected, residuals, floor, row: sum, .. } = scratch;
        self.coefficients.project(record, windows, step, projected, coefficients);
        sum.clone_from(&projected.residual);
        for (residuals, row) in residuals.iter_mut().zip(&projected.coefficients).rev() {
            residuals.clone_from(sum);
            for (sum, c) in sum.iter_mut().zip(row) {
                *sum += c * c;
            }
        }
        // With the constant's coefficient the sum is the window's energy. For a window of zeros the logarithm must stay finite.
        let least = self.floor.max(f64::MIN_POSITIVE);
        floor.clear();
        floor.extend(sum.iter().map(|energy| least.max(ROUNDING * energy)));
        for residuals in residuals {
            for (residual, floor) in residuals.iter_mut().zip(&*floor) {
                *residual = residual.max(*floor);
            }
        }
    }

    /// Gives every order its share by the sum over a window's neighbours: all of it to the best, or for errors by Akaike's weights.
    fn pool(&self, first: usize, windows: Range<usize>, wanted: Wanted, scratch: &mut SelectionScratch) {
        let SelectionScratch { projected, pool, residuals, shares, neighbours, row: scores, mean: total, .. } = scratch;
        for shares in shares.iter_mut() {
            shares.clear();
            shares.resize(projected.level.len(), 0.0);
        }
        let places = windows.start - first..windows.end - first;
        pool.begin(&windows, self.length);
        for ((order, &weight), (residuals, shares)) in
            self.weights.iter().enumerate().zip(residuals.iter().zip(&mut *shares))
        {
            scores.clear();
            // A window with an unusable value does not count.
            let score = |(residual, level): (&f64, &f64)| if level.is_nan() { 0.0 } else { (residual * weight).ln() };
            scores.extend(residuals.iter().zip(&projected.level).map(score));
            pool.add(order, scores, first);
            shares[places.clone()].copy_from_slice(pool.totals());
        }
        if wanted == Wanted::Derivatives {
            for (order, shares) in shares.iter_mut().enumerate() {
                for (share, window) in shares[places.clone()].iter_mut().zip(windows.clone()) {
                    *share = f64::from(u8::from(pool.order(window) == order));
                }
            }
            return;
        }
        scores.clear();
        scores.extend(projected.level.iter().map(|level| f64::from(u8::from(!level.is_nan()))));
        pool.sum(scores, first);
        neighbours.clear();
        neighbours.extend(pool.totals().iter().map(|count| worth(*count, self.length as f64) / count));
        total.clear();
        total.resize(places.len(), 0.0);
        let half = self.length as f64 / 2.0;
        scores.clear();
        scores.resize(places.len(), f64::INFINITY);
        for shares in &*shares {
            for (least, sum) in scores.iter_mut().zip(&shares[places.clone()]) {
                *least = least.min(*sum);
            }
        }
        for shares in shares.iter_mut() {
            let row = shares[places.clone()].iter_mut().zip(&*scores).zip(&*neighbours).zip(&mut *total);
            for (((share, least), worth), total) in row {
                *share = (half * worth * (least - *share)).exp();
                *total += *share;
            }
        }
        for shares in shares.iter_mut() {
            for (share, total) in shares[places.clone()].iter_mut().zip(&*total) {
                *share /= total;
            }
        }
    }

    /// Gives every order its share by Akaike's weights.
    fn weigh(&self, scratch: &mut SelectionScratch) {
        let SelectionScratch { residuals, shares, row: best, mean: total, .. } = scratch;
        best.clear();
        best.resize(residuals[0].len(), f64::INFINITY);
        total.clear();
        total.resize(best.len(), 0.0);
        for (residuals, weight) in residuals.iter().zip(&self.weights) {
            for (best, residual) in best.iter_mut().zip(residuals) {
                *best = best.min(residual * weight);
            }
        }
        for ((residuals, weight), shares) in residuals.iter().zip(&self.weights).zip(&mut *shares) {
            shares.clear();
            shares.extend(residuals.iter().zip(&*best).map(|(residual, best)| best / (residual * weight)));
            self.akaike.raise(shares);
            for (total, share) in total.iter_mut().zip(&*shares) {
                *total += share;
            }
        }
        for shares in shares {
            for (share, total) in shares.iter_mut().zip(&*total) {
                *share /= total;
            }
        }
    }
}

/// Finds the order of the largest share, the lowest of equals, at all places.
pub(crate) fn choose(scratch: &mut SelectionScratch) {
    let SelectionScratch { shares, chosen, row: largest, .. } = scratch;
    chosen.clear();
    chosen.resize(shares[0].len(), 0);
    largest.clear();
    largest.resize(chosen.len(), 0.0);
    for (order, shares) in shares.iter().enumerate() {
        for ((share, largest), chosen) in shares.iter().zip(&mut *largest).zip(&mut *chosen) {
            if share > largest {
                (*largest, *chosen) = (*share, order);
            }
        }
    }
}

/// The number of independent windows that carry the information of `count` neighbouring ones.
fn worth(count: f64, length: f64) -> f64 {
    let (short, long) = (count.min(length), count.max(length));
    short * long * long / (length * (short * long - (short * short - 1.0) / 3.0))
}
