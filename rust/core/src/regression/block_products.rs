//! The rows of a block of a record, as products of their columns: what is left of them once what is windowed is eliminated.

use std::ops::Range;

use crate::equation::rows::Rows;
use crate::regression::model::Model;
use crate::simd::f64x8::{Packet, WIDTH};
use crate::simd::instructions::Instructions;
use crate::simd::vectors::{Kernel, Lanes, dispatch};

/// What a pivot must keep of its column's square to be more than rounding.
const NOTHING: f64 = 1e-10;

/// The fewest rows for each unknown.
pub(crate) const ROWS_OF_AN_UNKNOWN: usize = 5;

/// The rows of one block, as products of their columns: windowed unknowns and their growth in turns, constants, the right-hand side.
pub(crate) struct Products<'a> {
    pub(crate) rows: &'a Rows,
    pub(crate) model: &'a Model,
}

impl Products<'_> {
    pub(crate) fn columns(&self) -> usize {
        2 * self.model.windowed.len() + self.model.constant.len() + 1
    }

    /// Half the time that a block lasts, in seconds, and the row at its centre.
    pub(crate) fn centre(&self, block: &Range<usize>) -> (f64, f64) {
        let half = (0.5 * block.len() as f64 * self.rows.period).max(f64::MIN_POSITIVE);
        (half, 0.5 * (block.start + block.end) as f64 - 0.5)
    }

    /// Does something with every usable row of a block: its place, its time from the centre in seconds, and its columns, which may be changed.
    pub(crate) fn for_each_row(&self, block: &Range<usize>, mut work: impl FnMut(usize, f64, &mut [f64])) {
        let (half, centre) = self.centre(block);
        let mut columns = vec![0.0; self.columns()];
        for row in block.clone().filter(|&row| self.rows.usable[row]) {
            let time = (row as f64 - centre) * self.rows.period;
            self.fill(row, time, half, &mut columns);
            work(row, time, &mut columns);
        }
    }

    /// The columns of a row.
    #[inline(always)]
    fn fill(&self, row: usize, time: f64, half: f64, into: &mut [f64]) {
        let mut place = 0;
        for &index in &self.model.windowed {
            let regressor = &self.rows.regressors[index];
            into[place] = regressor.value[row];
            into[place + 1] = (time * regressor.value[row] + regressor.companion[row]) / half;
            place += 2;
        }
        for &index in &self.model.constant {
            into[place] = self.rows.regressors[index].value[row];
            place += 1;
        }
        into[place] = self.rows.rhs[row];
    }

    /// The products of a block below and on the diagonal, and the powers of time summed over its rows, of which the first counts them.
    pub(crate) fn of(&self, block: &Range<usize>) -> (Vec<f64>, [f64; 3]) {
        let count = self.columns();
        let (mut products, mut times) = (vec![0.0; count * count], [0.0; 3]);
        if count <= WIDTH {
            let mut sums = [Packet::ZERO; WIDTH];
            dispatch(Instructions::current(), FewColumns { products: self, block, sums: &mut sums, times: &mut times });
            for (i, sum) in sums[..count].iter().enumerate() {
                products[i * count..=i * count + i].copy_from_slice(&sum.0[..=i]);
            }
            return (products, times);
        }
        self.for_each_row(block, |_, time, values| {
            for i in 0..count {
                let factor = values[i];
                products[i * count..=i * count + i].iter_mut().zip(&*values).for_each(|(p, v)| *p += factor * v);
            }
            add_powers(time, &mut times);
        });
        (products, times)
    }

    /// Products with the columns divided by `scale` and without what the angle's noise adds, above the diagonal too.
    fn corrected(
        &self,
        part: &(Vec<f64>, [f64; 3]),
        half: f64,
        (noise, entering): (f64, &mut NoiseOfPairs),
        scale: &[f64],
    ) -> Vec<f64> {
        let (count, (mut products, times)) = (self.columns(), part.clone());
        let mut pairs = if noise > 0.0 { entering.of(self, half) } else { &[] }.iter();
        for i in 0..count {
            for j in 0..=i {
                let added =
                    pairs.next().map_or(0.0, |pair| noise * pair.iter().zip(&times).map(|(a, b)| a * b).sum::<f64>());
                let value = (products[i * count + j] - added) / (scale[i] * scale[j]);
                products[i * count + j] = value;
                products[j * count + i] = value;
            }
        }
        products
    }

    /// Corrected products of the constants and the right-hand side, without the block's own unknowns. A block that does not determine those
    /// says nothing of the constants.
    pub(crate) fn of_constants(
        &self,
        block: &Range<usize>,
        moments: &(Vec<f64>, [f64; 3]),
        noise: (f64, &mut NoiseOfPairs),
        scale: &[f64],
    ) -> Option<Eliminated> {
        let first = 2 * self.model.windowed.len();
        let enough = moments.1[0] > (ROWS_OF_AN_UNKNOWN * first) as f64;
        enough.then(|| eliminate(self.corrected(moments, self.centre(block).0, noise, scale), self.columns(), first))
    }

    /// The kernels that the angle's noise enters each column by: one that counts alike, one in proportion to time.
    fn kernels(&self, half: f64) -> Vec<[Vec<f64>; 2]> {
        let mut kernels = Vec::new();
        for &index in &self.model.windowed {
            let [value, companion] = &self.rows.regressors[index].noise;
            let divided = |kernel: &[f64]| kernel.iter().map(|one| one / half).collect::<Vec<_>>();
            kernels.push([value.clone(), Vec::new()]);
            kernels.push([divided(companion), divided(value)]);
        }
        for &index in &self.model.constant {
            kernels.push([self.rows.regressors[index].noise[0].clone(), Vec::new()]);
        }
        kernels.push([self.rows.rhs_noise.clone(), Vec::new()]);
        kernels
    }

    /// The root of the mean square of each column.
    pub(crate) fn scale(&self, parts: &[(Vec<f64>, [f64; 3])]) -> Vec<f64> {
        let count = self.columns();
        let rows = parts.iter().map(|(_, times)| times[0]).sum::<f64>().max(1.0);
        let square = |i: usize| parts.iter().map(|(products, _)| products[i * count + i]).sum::<f64>();
        (0..count).map(square).map(|square| if square > 0.0 { (square / rows).sqrt() } else { 1.0 }).collect()
    }
}

/// Sums the products of so few columns that a packet holds a row of them.
struct FewColumns<'a, 'b> {
    products: &'a Products<'b>,
    block: &'a Range<usize>,
    sums: &'a mut [Packet; WIDTH],
    times: &'a mut [f64; 3],
}

impl Kernel for FewColumns<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, _simd: S) {
        let Self { products, block, sums, times } = self;
        let (half, centre) = products.centre(block);
        let count = products.columns();
        let mut values = Packet::ZERO;
        for row in block.start..block.end {
            if !products.rows.usable[row] {
                continue;
            }
            let time = (row as f64 - centre) * products.rows.period;
            products.fill(row, time, half, &mut values.0);
            for (sum, &factor) in sums[..count].iter_mut().zip(&values.0) {
                *sum += Packet::splat(factor) * values;
            }
            add_powers(time, times);
        }
    }
}

/// Adds the powers of a time to their sums.
#[inline(always)]
fn add_powers(time: f64, sums: &mut [f64; 3]) {
    sums[0] += 1.0;
    sums[1] += time;
    sums[2] += time * time;
}

/// What noise of variance one adds to the products of pairs of columns, times the powers of time summed over the rows. Blocks of one length share it.
#[derive(Clone, Debug, Default)]
pub(crate) struct NoiseOfPairs {
    half: f64,
    pairs: Vec<[f64; 3]>,
}

impl NoiseOfPairs {
    fn of(&mut self, products: &Products<'_>, half: f64) -> &[[f64; 3]] {
        if self.pairs.is_empty() || self.half.to_bits() != half.to_bits() {
            let kernels = products.kernels(half);
            self.half = half;
            self.pairs.clear();
            for (place, one) in kernels.iter().enumerate() {
                let entering = |other: &[Vec<f64>; 2]| {
                    let of = |i: usize, j: usize| dot(&one[i], &other[j]);
                    [of(0, 0), of(0, 1) + of(1, 0), of(1, 1)]
                };
                self.pairs.extend(kernels[..=place].iter().map(entering));
            }
        }
        &self.pairs
    }
}

/// What eliminating the first columns of symmetric products leaves.
pub(crate) struct Eliminated {
    /// The products of the rest.
    pub(crate) rest: Vec<f64>,
    /// What each of the first columns, less those before it, is taken off the later ones times; empty for one that is nothing but rounding,
    /// which counts as zero.
    pub(crate) factors: Vec<Vec<f64>>,
}

/// Eliminates the first columns of symmetric products.
pub(crate) fn eliminate(mut products: Vec<f64>, count: usize, first: usize) -> Eliminated {
    let whole: Vec<f64> = (0..first).map(|k| products[k * count + k]).collect();
    let mut factors = vec![Vec::new(); first];
    for (k, whole) in whole.into_iter().enumerate() {
        let pivot = products[k * count + k];
        if pivot.is_nan() || pivot <= NOTHING * whole {
            continue;
        }
        for i in k + 1..count {
            let factor = products[i * count + k] / pivot;
            for j in k + 1..count {
                products[i * count + j] -= factor * products[k * count + j];
            }
            factors[k].push(factor);
        }
    }
    let rest = (first..count).flat_map(|i| products[i * count + first..(i + 1) * count].to_vec()).collect();
    Eliminated { rest, factors }
}

/// The inverse of a symmetric positive definite matrix, or `None` if it is not.
pub(crate) fn inverse(matrix: &[f64], count: usize) -> Option<Vec<f64>> {
    let wide = 2 * count;
    let mut work = vec![0.0; count * wide];
    for i in 0..count {
        work[i * wide..i * wide + count].copy_from_slice(&matrix[i * count..(i + 1) * count]);
        work[i * wide + count + i] = 1.0;
    }
    for k in 0..count {
        let pivot = work[k * wide + k];
        if pivot.is_nan() || pivot <= NOTHING * matrix[k * count + k] {
            return None;
        }
        work[k * wide..(k + 1) * wide].iter_mut().for_each(|value| *value /= pivot);
        for i in (0..count).filter(|&i| i != k) {
            let factor = work[i * wide + k];
            for j in 0..wide {
                work[i * wide + j] -= factor * work[k * wide + j];
            }
        }
    }
    Some((0..count).flat_map(|i| work[i * wide + count..(i + 1) * wide].to_vec()).collect())
}

/// The sum of products.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eliminating_leaves_the_inverse_of_that_part_of_the_inverse() {
        let matrix = [4.0, 1.0, 0.5, 1.0, 3.0, 0.2, 0.5, 0.2, 2.0];
        let eliminated = eliminate(matrix.to_vec(), 3, 1);
        let whole = inverse(&matrix, 3).unwrap();
        let part = inverse(&eliminated.rest, 2).unwrap();
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            assert!((part[2 * i + j] - whole[3 * (i + 1) + j + 1]).abs() < 1e-14);
        }
        assert_eq!(eliminated.factors, [[0.25, 0.125]]);
        // What is nothing but rounding is left as it is.
        let nothing = eliminate(vec![0.0, 0.0, 0.0, 1.0], 2, 1);
        assert_eq!((nothing.rest, nothing.factors), (vec![1.0], vec![Vec::new()]));
        assert_eq!(inverse(&[1.0, 1.0, 1.0, 1.0], 2), None);
    }
}
