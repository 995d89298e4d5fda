//! Results from the coefficients of a window: its order, its noise, and linear functionals such as derivatives.

use crate::lanes::tile::Tile;
use crate::local_polynomials::basis::{Basis, MOST_DEGREES};
use crate::local_polynomials::criterion::{Tables, choose};
use crate::local_polynomials::mirrored_kernels::MirroredKernel;
use crate::local_polynomials::options::{Order, PolynomialOptions};
use crate::local_polynomials::order_average::Akaike;
use crate::local_polynomials::sliding_projection::State;
use crate::simd::unroll::unroll;
use crate::simd::vectors::{Lanes, TABLE};
use crate::status::Status;

/// A linear function of a window's coefficients that is even or odd in time.
#[derive(Clone, Debug)]
pub(crate) struct Functional {
    /// Weights of the coefficients; those of the other parity are zero.
    weights: [f64; MOST_DEGREES],
    /// Whether it is odd: in reversed time it changes its sign.
    odd: bool,
    /// What a constant signal of one gives.
    constant: f64,
}

/// The plan of the results of every window.
#[derive(Debug)]
pub(crate) struct Finish {
    functionals: Vec<Functional>,
    tables: Tables,
    fixed_order: u8,
    /// Where orders are averaged.
    akaike: Option<Akaike>,
    /// The degrees whose coefficients are given as they are, instead of functionals.
    bare: Option<Vec<usize>>,
}

/// An order and flags as one whole number.
fn code(order: u8, status: Status) -> f64 {
    f64::from(order) + 256.0 * f64::from(status.bits())
}

impl Functional {
    /// The derivative at the centre.
    fn derivative(basis: &Basis, derivative: usize, delta: f64) -> Self {
        let scale = delta.powi(i32::try_from(derivative).unwrap_or(i32::MAX)).recip();
        let values = basis.evaluate(0.0, derivative);
        let weights = std::array::from_fn(|j| values.get(j).map_or(0.0, |value| value * scale));
        Self { weights, odd: derivative % 2 == 1, constant: f64::from(u8::from(derivative == 0)) }
    }

    /// The same as a kernel over the samples of an odd window.
    pub(crate) fn kernel(&self, basis: &Basis) -> MirroredKernel {
        let of = |row: &[f64]| self.weights.iter().zip(row).map(|(weight, value)| weight * value).sum();
        MirroredKernel { odd: self.odd, constant: self.constant, outwards: basis.rows().skip(1).map(of).collect() }
    }

    /// Its value's standard deviation over that of the noise, for every order.
    pub(crate) fn gains(&self, orders: usize) -> Vec<f64> {
        let mut sum = 0.0;
        let gain = |weight: &f64| {
            sum += weight * weight;
            sum.sqrt()
        };
        self.weights[..orders].iter().map(gain).collect()
    }
}

impl Finish {
    pub(crate) fn new(options: &PolynomialOptions, basis: &Basis) -> Self {
        let (length, degrees) = (basis.length(), basis.degrees());
        let functional = |&derivative: &usize| Functional::derivative(basis, derivative, options.delta);
        let mut weights = [None; TABLE];
        let mut fixed_order = 0;
        match options.order {
            Order::Fixed(order) => {
                weights[order] = Some(1.0);
                fixed_order = u8::try_from(order).unwrap_or(u8::MAX);
            }
            Order::Chosen { criterion, .. } => {
                for (order, weight) in weights[..degrees].iter_mut().enumerate() {
                    *weight = Some(criterion.weight(order, length));
                }
            }
        }
        let chosen = matches!(options.order, Order::Chosen { .. });
        let mut tables = Tables::new(&weights);
        for (order, weight) in weights.iter().enumerate() {
            if let (Some(weight), true) = (weight, order + 1 < length) {
                tables.variance[order] = ((length - order - 1) as f64 * weight).recip();
            }
            let mut status = Status::GOOD;
            if chosen && degrees > 1 && order == 0 {
                status |= Status::LOWEST_ORDER;
            }
            if chosen && degrees > 1 && order + 1 == degrees {
                status |= Status::HIGHEST_ORDER;
            }
            tables.code[order] = code(u8::try_from(order).unwrap_or(u8::MAX), status);
        }
        tables.exact = code(0, Status::EXACT);
        tables.floor = options.quantisation_floor();
        let functionals = options.derivatives.iter().map(functional).collect();
        Self { functionals, tables, fixed_order, akaike: Akaike::of(options, degrees), bare: None }
    }

    /// Whether orders are averaged.
    pub(crate) fn averages(&self) -> bool {
        self.akaike.is_some()
    }

    /// Gives, instead of derivatives, the reference of the window's samples and then the coefficients of some degrees.
    pub(crate) fn bare(mut self, degrees: &[usize]) -> Self {
        self.functionals.clear();
        self.bare = Some(degrees.to_vec());
        self
    }

    /// Whether it gives coefficients as they are.
    pub(crate) fn is_bare(&self) -> bool {
        self.bare.is_some()
    }

    pub(crate) fn functionals(&self) -> &[Functional] {
        &self.functionals
    }

    /// The order of every window, where none is chosen.
    pub(crate) fn fixed_order(&self, residual: bool) -> Option<u8> {
        (!residual).then_some(self.fixed_order)
    }

    /// Numbers known of every window: its functionals and, where the residual is followed, noise, order and flags.
    pub(crate) fn fields(&self, residual: bool) -> usize {
        self.numbers() + if residual { 2 } else { 0 }
    }

    /// The same without noise, order and flags.
    fn numbers(&self) -> usize {
        self.bare.as_ref().map_or(self.functionals.len(), |degrees| degrees.len() + 1)
    }

    /// Finishes one window of each lane by the average over orders.
    #[inline(always)]
    pub(crate) fn finish_average<S: Lanes, const D: usize>(
        &self,
        simd: S,
        state: &State<S, D>,
        reference: S::f64s,
        backward: bool,
        tile: &mut Tile,
        place: usize,
    ) {
        let Some(akaike) = &self.akaike else { return };
        let average = akaike.average(simd, state);
        let fields = self.functionals.len();
        let exact = simd.select_f64s(average.exact, simd.splat_f64s(self.tables.exact), simd.splat_f64s(0.0));
        let code = simd.table_lookup(&self.tables.code, average.order);
        tile.put(simd, fields, place, simd.sqrt_f64s(average.variance));
        tile.put(simd, fields + 1, place, simd.add_f64s(code, exact));
        for (field, functional) in self.functionals.iter().enumerate() {
            let mut sum = simd.mul_f64s(reference, simd.splat_f64s(functional.constant));
            unroll!(J < D, {
                let shared = simd.mul_f64s(average.reach[J], state.coefficients[J]);
                sum = simd.mul_add_f64s(simd.splat_f64s(functional.weights[J]), shared, sum);
            });
            let turned = functional.odd && backward;
            tile.put(simd, field, place, if turned { simd.neg_f64s(sum) } else { sum });
        }
    }

    /// Gives the reference and the coefficients that are wanted of one window of each lane, the `index`-th of some stored states. Loading all of
    /// them, to sum them with weights of one and zero, would cost more than the steps between the windows.
    #[inline(always)]
    pub(crate) fn give<S: Lanes, const D: usize, const RESIDUAL: bool>(
        &self,
        simd: S,
        (states, index): (&[f64], usize),
        reference: S::f64s,
        backward: bool,
        tile: &mut Tile,
        place: usize,
    ) {
        if RESIDUAL {
            self.finish_order(simd, &State::<S, D>::load(simd, states, index), tile, place);
        }
        tile.put(simd, 0, place, reference);
        for (&degree, field) in self.bare.iter().flatten().zip(1..) {
            let value = State::<S, D>::coefficient(simd, states, index, degree);
            tile.put(simd, field, place, if backward && degree % 2 == 1 { simd.neg_f64s(value) } else { value });
        }
    }

    /// Chooses the order of one window of each lane, and finishes its noise, order and flags.
    #[inline(always)]
    fn finish_order<S: Lanes, const D: usize>(
        &self,
        simd: S,
        state: &State<S, D>,
        tile: &mut Tile,
        place: usize,
    ) -> S::f64s {
        let choice = choose(simd, &self.tables, state);
        tile.put(simd, self.numbers(), place, simd.sqrt_f64s(choice.variance));
        tile.put(simd, self.numbers() + 1, place, choice.code);
        choice.order
    }

    /// Finishes one window of each lane.
    #[inline(always)]
    pub(crate) fn finish<S: Lanes, const D: usize, const RESIDUAL: bool>(
        &self,
        simd: S,
        state: &State<S, D>,
        reference: S::f64s,
        backward: bool,
        tile: &mut Tile,
        place: usize,
    ) {
        let order = if RESIDUAL { Some(self.finish_order(simd, state, tile, place)) } else { None };
        let turn = |odd: bool, value: S::f64s| if odd && backward { simd.neg_f64s(value) } else { value };
        let mut left = self.functionals.as_slice();
        let mut field = 0;
        // Value and two derivatives are what is wanted nearly always: all three in one go, each coefficient masked once.
        if let [
            value @ Functional { odd: false, .. },
            first @ Functional { odd: true, .. },
            second @ Functional { odd: false, .. },
            rest @ ..,
        ] = left
        {
            let mut sums = [
                simd.mul_f64s(reference, simd.splat_f64s(value.constant)),
                simd.splat_f64s(0.0),
                simd.mul_f64s(reference, simd.splat_f64s(second.constant)),
            ];
            unroll!(J < D, {
                let c = state.coefficients[J];
                if J % 2 == 1 {
                    sums[1] = weighted::<S, J>(simd, order, first, c, sums[1]);
                } else {
                    sums[0] = weighted::<S, J>(simd, order, value, c, sums[0]);
                    sums[2] = weighted::<S, J>(simd, order, second, c, sums[2]);
                }
            });
            tile.put(simd, 0, place, sums[0]);
            tile.put(simd, 1, place, turn(true, sums[1]));
            tile.put(simd, 2, place, sums[2]);
            (left, field) = (rest, 3);
        }
        for functional in left {
            let mut sum = simd.mul_f64s(reference, simd.splat_f64s(functional.constant));
            unroll!(J < D, { sum = weighted::<S, J>(simd, order, functional, state.coefficients[J], sum) });
            tile.put(simd, field, place, turn(functional.odd, sum));
            field += 1;
        }
    }
}

/// Adds a functional's share of coefficient `J` where the order reaches it.
#[inline(always)]
fn weighted<S: Lanes, const J: usize>(
    simd: S,
    order: Option<S::f64s>,
    functional: &Functional,
    coefficient: S::f64s,
    sum: S::f64s,
) -> S::f64s {
    let more = simd.mul_add_f64s(simd.splat_f64s(functional.weights[J]), coefficient, sum);
    match order {
        Some(order) if J != 0 => {
            let reached = simd.less_than_or_equal_f64s(simd.splat_f64s(J as f64), order);
            simd.select_f64s(reached, more, sum)
        }
        _ => more,
    }
}
