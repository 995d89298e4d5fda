//! Regressors times the residuals of rows, and the products of each pair of these, as standard errors of correlated residuals need them.

use std::ops::Range;

use crate::least_squares::sliding_sums::Summed;
use crate::record::samples::LARGEST;
use crate::simd::aligned::Aligned;
use crate::simd::vectors::{Lanes, MOST_LANES};

/// Regressors times residuals of some rows, side by side, zero where there are none.
#[derive(Debug, Default)]
pub(crate) struct RowProducts {
    pub(crate) first: isize,
    /// Whole vectors of numbers a row, of which the first are those of its regressors.
    pub(crate) values: Aligned,
    /// Rows that count before each row.
    pub(crate) counts: Vec<u32>,
    /// The columns that a row's products are made of, one after the other: regressors, the right-hand side, weights; then parameters where
    /// the windows that they are taken from do not follow one after the other.
    pub(crate) columns: Vec<f64>,
}

/// So many numbers of each of some rows, whatever they held before.
pub(crate) fn side_by_side<const N: usize>(numbers: &mut Aligned, rows: usize) -> &mut [[f64; N]] {
    if numbers.len() < rows * N {
        *numbers = Aligned::zeros(rows * N);
    }
    numbers[..rows * N].as_chunks_mut::<N>().0
}

/// The products of some rows, and how many rows up to each count; returns how many do. `columns` are regressors, the right-hand side and
/// weights, if there are any. Rows after these are overwritten: there must be as many as a vector has lanes.
#[inline(always)]
pub(crate) fn multiply<S: Lanes, const N: usize>(
    simd: S,
    columns: &[f64],
    parameters: &[&[f64]],
    values: &mut [[f64; N]],
    counts: &mut [u32],
) -> u32 {
    let (rows, lanes, values) = (counts.len(), S::F64_LANES, values.as_flattened_mut());
    let mut before = 0;
    for (first, counts) in (0..).step_by(lanes).zip(counts.chunks_mut(lanes)) {
        let (columns, some_rows) = ((columns, rows), first..first + counts.len());
        let counted = if counts.len() == lanes {
            multiply_some::<S, N, true>(simd, columns, parameters, some_rows, values)
        } else {
            multiply_some::<S, N, false>(simd, columns, parameters, some_rows, values)
        };
        for (lane, count) in counts.iter_mut().enumerate() {
            *count = before + (counted & ((2 << lane) - 1)).count_ones();
        }
        before = counts.last().copied().unwrap_or(before);
    }
    before
}

/// The first of some numbers in a vector: as many as it has lanes, or where these are not `WHOLE` so many, and zeros. A load under a mask takes as
/// long as another with AVX-512 only: with AVX2 it is a call.
#[inline(always)]
pub(crate) fn load_some<S: Lanes, const WHOLE: bool>(simd: S, numbers: &[f64], count: usize) -> S::f64s {
    if WHOLE { simd.load(numbers, 0) } else { simd.partial_load_f64s(&numbers[..count]) }
}

/// The same for as many of the rows as a vector has lanes, or where they are not `WHOLE` for fewer; returns which of them count.
#[inline(always)]
fn multiply_some<S: Lanes, const N: usize, const WHOLE: bool>(
    simd: S,
    (columns, rows): (&[f64], usize),
    parameters: &[&[f64]],
    some_rows: Range<usize>,
    values: &mut [f64],
) -> u32 {
    let (p, first) = (parameters.len(), some_rows.start);
    let some = |numbers: &[f64]| load_some::<S, WHOLE>(simd, &numbers[first..], some_rows.len());
    let column = |number: usize| some(&columns[number * rows..][..rows]);
    let (none, largest) = (simd.splat_f64s(0.0), simd.splat_f64s(LARGEST));
    let mut residual = column(p);
    for (number, parameters) in parameters.iter().enumerate() {
        residual = simd.negate_mul_add_f64s(column(number), some(parameters), residual);
    }
    let mut counted = simd.less_than_or_equal_f64s(simd.abs_f64s(residual), largest);
    if columns.len() > (p + 1) * rows {
        let weight = column(p + 1);
        counted = simd.and_m64s(counted, simd.less_than_f64s(none, weight));
        residual = simd.mul_f64s(weight, residual);
    }
    for number in (0..N).step_by(S::F64_LANES) {
        let mut square = [none; MOST_LANES];
        for (regressor, products) in (number..p).zip(&mut square[..S::F64_LANES]) {
            // A row that does not count may hold what is no number.
            *products = simd.select_f64s(counted, simd.mul_f64s(residual, column(regressor)), none);
        }
        simd.transpose(&mut square[..S::F64_LANES]);
        // Where vectors are longer than rows each is overwritten by the next.
        for (row, products) in (first..).zip(&square[..S::F64_LANES]) {
            simd.store(values, row * N + number, *products);
        }
    }
    simd.bits(counted)
}

/// The products of each pair of the first numbers of a row are summed: of `R` numbers, or of so many where that is zero.
#[derive(Clone, Copy)]
pub(crate) struct Pairs<const R: usize>(pub(crate) usize);

/// Vectors that hold the pairs of a vector's numbers.
const VECTORS: usize = (MOST_LANES + 1).div_ceil(2);

impl<const R: usize> Pairs<R> {
    /// Of every vector of pairs, which numbers stand on the left and on the right: the first number where there are no more pairs.
    const ORDERS: [[[usize; MOST_LANES]; 2]; VECTORS] = {
        let mut orders = [[[0; MOST_LANES]; 2]; VECTORS];
        let (mut pair, mut i) = (0, 0);
        while i < R && R <= MOST_LANES {
            let mut k = i;
            while k < R {
                let order = &mut orders[pair / MOST_LANES];
                (order[0][pair % MOST_LANES], order[1][pair % MOST_LANES]) = (i, k);
                (pair, k) = (pair + 1, k + 1);
            }
            i += 1;
        }
        orders
    };
}

impl<const R: usize, const N: usize, const P: usize> Summed<[f64; N], P> for Pairs<R> {
    #[inline(always)]
    fn of<S: Lanes>(self, simd: S, row: &[f64; N]) -> [f64; P] {
        let numbers = if R == 0 { self.0 } else { R };
        let (mut products, mut pair) = ([0.0; P], 0);
        if N == MOST_LANES && N == S::F64_LANES && R > 0 && R < N {
            // Left to the compiler, both sides are gathered from memory number by number, unless they fill whole rows.
            let row = simd.load(row, 0);
            for (products, [left, right]) in products.chunks_exact_mut(N).zip(&Self::ORDERS) {
                simd.store(products, 0, simd.mul_f64s(simd.permute(row, left), simd.permute(row, right)));
            }
            return products;
        }
        for i in 0..numbers {
            for k in i..numbers {
                products[pair] = row[i] * row[k];
                pair += 1;
            }
        }
        // Nobody reads what is beyond them. Where there are several vectors of products, zeros would leave the last of them in parts.
        if P >= 2 * MOST_LANES {
            products[pair..].fill(row[0] * row[0]);
        }
        products
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::instructions::Instructions;
    use crate::simd::vectors::{Kernel, dispatch};

    struct Multiply<'a>(&'a [f64], [&'a [f64]; 2], &'a mut [[f64; 4]], &'a mut [u32]);

    impl Kernel for Multiply<'_> {
        type Output = u32;

        #[inline(always)]
        fn run<S: Lanes>(self, simd: S) -> u32 {
            multiply(simd, self.0, &self.1, self.2, self.3)
        }
    }

    struct OfPairs<const R: usize, const P: usize>([f64; 8]);

    impl<const R: usize, const P: usize> Kernel for OfPairs<R, P> {
        type Output = [f64; P];

        #[inline(always)]
        fn run<S: Lanes>(self, simd: S) -> [f64; P] {
            Pairs::<R>(R).of(simd, &self.0)
        }
    }

    #[test]
    fn each_pair_has_its_product_on_every_path() {
        fn check<const R: usize, const P: usize>() {
            let row = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0];
            let expected: Vec<f64> = (0..R).flat_map(|i| row[i..R].iter().map(move |other| row[i] * other)).collect();
            for instructions in Instructions::available() {
                assert_eq!(dispatch(instructions, OfPairs::<R, P>(row))[..expected.len()], expected);
            }
        }
        check::<5, 16>();
        check::<6, 24>();
        check::<7, 32>();
        check::<8, 40>();
    }

    #[test]
    fn rows_that_do_not_count_have_no_products() {
        for instructions in Instructions::available() {
            // 13 rows of the regressors 1 and the row's number with the right-hand side 7: parameters 2 and 1/2 leave 5 - row / 2.
            let rows = 13;
            let mut columns: Vec<f64> = [vec![1.0; rows], (0..rows).map(|row| row as f64).collect()].concat();
            columns.extend(vec![7.0; rows]);
            columns.extend(vec![3.0; rows]);
            columns[rows + 4] = f64::NAN;
            columns[2 * rows + 8] = f64::INFINITY;
            columns[3 * rows + 12] = 0.0;
            let parameters = [vec![2.0; rows], vec![0.5; rows]];
            let (mut values, mut counts) = (vec![[f64::NAN; 4]; rows + MOST_LANES], vec![0; rows]);
            let kernel = Multiply(&columns, [&parameters[0], &parameters[1]], &mut values, &mut counts);
            assert_eq!(dispatch(instructions, kernel), 10);
            let mut before = 0;
            for row in 0..rows {
                let counted = ![4, 8, 12].contains(&row);
                before += u32::from(counted);
                let product = if counted { 3.0 * (5.0 - 0.5 * row as f64) } else { 0.0 };
                let of_number = if counted { product * row as f64 } else { 0.0 };
                assert_eq!((values[row], counts[row]), ([product, of_number, 0.0, 0.0], before));
            }
        }
    }
}
