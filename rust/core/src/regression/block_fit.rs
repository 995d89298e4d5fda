//! Least squares in blocks of a record, with errors that rest on nothing but how the blocks scatter.
//!
//! Every block gives the products `M = Σ x xᵀ` of its rows. Windowed unknowns grow linearly within a block and are eliminated there;
//! what remains is added up and solved for the constants `c`. The score of a block, `s = M_cy - M_cc c` after the elimination, is what it
//! pulls the constants by, and `S⁻¹ (Σ s sᵀ) S⁻¹` is their covariance whatever the noise is like, as long as blocks that do not share
//! a row's samples know nothing of each other (the sandwich of Huber 1967, with the weights of Newey and West 1987 between neighbours).

use std::ops::Range;

use crate::equation::rows::Rows;
use crate::regression::model::Model;

/// What a pivot must keep of its column's square to be more than rounding.
const NOTHING: f64 = 1e-10;

/// The fewest rows for each unknown.
const ROWS_OF_AN_UNKNOWN: usize = 5;

/// The fewest blocks for each constant, for their scatter to say something.
const BLOCKS_OF_A_CONSTANT: usize = 2;

/// The fewest blocks that the information on a constant is spread over, for their scatter to be an error: one blow in a record is in one
/// or two. Windowed unknowns take up a good part of what a block scatters, so that there it takes more of them.
const SPREAD: f64 = 3.0;
const SPREAD_BESIDE_WINDOWED: f64 = 5.0;

/// A constant is known no better than to what makes this part of the right-hand side, root mean squares compared: sums in place of integrals, rounding
/// and models leave that much alike in all blocks, which their scatter does not show.
const ALIKE: f64 = 1e-6;

/// Constants and their standard errors.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BlockFit {
    pub(crate) values: Vec<f64>,
    /// Their covariance, row by row.
    pub(crate) covariance: Vec<f64>,
}

impl BlockFit {
    /// Standard errors.
    pub(crate) fn errors(&self) -> Vec<f64> {
        let count = self.values.len();
        (0..count).map(|i| self.covariance[i * (count + 1)].sqrt()).collect()
    }
}

/// The rows of one block, as products of their columns: windowed unknowns and their growth in turns, constants, the right-hand side.
struct Products<'a> {
    rows: &'a Rows,
    model: &'a Model,
}

impl Products<'_> {
    fn columns(&self) -> usize {
        2 * self.model.windowed.len() + self.model.constant.len() + 1
    }

    /// Half the time that a block lasts, in seconds, and the row at its centre.
    fn centre(&self, block: &Range<usize>) -> (f64, f64) {
        let half = (0.5 * block.len() as f64 * self.rows.period).max(f64::MIN_POSITIVE);
        (half, 0.5 * (block.start + block.end) as f64 - 0.5)
    }

    /// The columns of a row.
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
    fn of(&self, block: &Range<usize>) -> (Vec<f64>, [f64; 3]) {
        let (count, (half, centre)) = (self.columns(), self.centre(block));
        let (mut products, mut row_values) = (vec![0.0; count * count], vec![0.0; count]);
        let mut times = [0.0; 3];
        for row in block.clone().filter(|&row| self.rows.usable[row]) {
            let time = (row as f64 - centre) * self.rows.period;
            self.fill(row, time, half, &mut row_values);
            for i in 0..count {
                let factor = row_values[i];
                products[i * count..=i * count + i].iter_mut().zip(&row_values).for_each(|(p, v)| *p += factor * v);
            }
            times.iter_mut().zip([1.0, time, time * time]).for_each(|(sum, power)| *sum += power);
        }
        (products, times)
    }

    /// Products with the columns divided by `scale` and without what the angle's noise adds, above the diagonal too.
    fn corrected(&self, part: &(Vec<f64>, [f64; 3]), half: f64, noise: f64, scale: &[f64]) -> Vec<f64> {
        let (count, (mut products, times)) = (self.columns(), part.clone());
        let kernels = if noise > 0.0 { self.kernels(half) } else { Vec::new() };
        for i in 0..count {
            for j in 0..=i {
                let added = if noise > 0.0 { noise * expected(&kernels[i], &kernels[j], &times) } else { 0.0 };
                let value = (products[i * count + j] - added) / (scale[i] * scale[j]);
                products[i * count + j] = value;
                products[j * count + i] = value;
            }
        }
        products
    }

    /// Corrected products of the constants and the right-hand side, without the block's own unknowns. A block that does not determine those
    /// says nothing of the constants.
    fn of_constants(
        &self,
        block: &Range<usize>,
        moments: &(Vec<f64>, [f64; 3]),
        noise: f64,
        scale: &[f64],
    ) -> Option<Vec<f64>> {
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
    fn scale(&self, parts: &[(Vec<f64>, [f64; 3])]) -> Vec<f64> {
        let count = self.columns();
        let rows = parts.iter().map(|(_, times)| times[0]).sum::<f64>().max(1.0);
        let square = |i: usize| parts.iter().map(|(products, _)| products[i * count + i]).sum::<f64>();
        (0..count).map(square).map(|square| if square > 0.0 { (square / rows).sqrt() } else { 1.0 }).collect()
    }
}

/// What noise of variance one adds to the product of two columns, for powers of time summed over the rows.
fn expected(one: &[Vec<f64>; 2], other: &[Vec<f64>; 2], times: &[f64; 3]) -> f64 {
    let dot = |i: usize, j: usize| -> f64 { one[i].iter().zip(&other[j]).map(|(a, b)| a * b).sum() };
    times[0] * dot(0, 0) + times[1] * (dot(0, 1) + dot(1, 0)) + times[2] * dot(1, 1)
}

/// Eliminates the first columns of symmetric products, and returns those of the rest. Columns that are nothing but rounding count as zero.
fn eliminate(mut products: Vec<f64>, count: usize, first: usize) -> Vec<f64> {
    let whole: Vec<f64> = (0..first).map(|k| products[k * count + k]).collect();
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
        }
    }
    (first..count).flat_map(|i| products[i * count + first..(i + 1) * count].to_vec()).collect()
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

/// Why blocks give no constants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NoFit {
    /// One or two blocks tell all there is, or they hardly tell constants apart.
    Undetermined,
    /// Beside windowed unknowns more of them would be needed.
    TooFewBlocks,
}

/// Fits the constants of a model to rows in blocks, once for every variance of the angle's noise: zero is ordinary least squares. A test
/// function spans `reach` rows to either side. Each may fail.
pub(crate) fn fit_in_blocks(
    rows: &Rows,
    model: &Model,
    noises: &[f64],
    blocks: &[Range<usize>],
    reach: usize,
) -> Vec<Result<BlockFit, NoFit>> {
    let products = Products { rows, model };
    let moments: Vec<_> = blocks.iter().map(|block| products.of(block)).collect();
    let scale = products.scale(&moments);
    let (count, constants) = (products.columns(), model.constant.len());
    let (first, size) = (2 * model.windowed.len(), constants + 1);
    let length = blocks.iter().map(Range::len).sum::<usize>() / blocks.len().max(1);
    let lags = (2 * reach).div_ceil(length.max(1)).min(blocks.len().saturating_sub(1));
    let fit = |&noise: &f64| {
        let (mut used, mut unknowns) = (0.0, constants);
        let part = |(block, moments): (&Range<usize>, &(Vec<f64>, [f64; 3]))| {
            let Some(part) = products.of_constants(block, moments, noise, &scale) else {
                return vec![0.0; size * size];
            };
            (used, unknowns) = (used + moments.1[0], unknowns + first);
            part
        };
        let parts: Vec<Vec<f64>> = blocks.iter().zip(&moments).map(part).collect();
        let few = used < (ROWS_OF_AN_UNKNOWN * unknowns) as f64;
        if few || !is_spread(&parts, constants, SPREAD) {
            return Err(NoFit::Undetermined);
        }
        if first > 0 && !is_spread(&parts, constants, SPREAD_BESIDE_WINDOWED) {
            return Err(NoFit::TooFewBlocks);
        }
        let fit = solve(&parts, constants, lags).ok_or(NoFit::Undetermined);
        let unscaled = |i: usize| scale[count - 1] / scale[first + i];
        fit.map(|(values, covariance)| BlockFit {
            values: values.into_iter().enumerate().map(|(i, value)| value * unscaled(i)).collect(),
            covariance: covariance
                .into_iter()
                .enumerate()
                .map(|(place, value)| {
                    let (row, column) = (place / constants, place % constants);
                    let alike = if row == column { ALIKE * ALIKE } else { 0.0 };
                    (value + alike) * unscaled(row) * unscaled(column)
                })
                .collect(),
        })
    };
    noises.iter().map(fit).collect()
}

/// What every block says of the constants, corrected for the angle's noise of some variance: products of the constants' columns and the
/// right-hand side, which comes last, without the block's own unknowns.
pub(crate) struct Parts {
    pub(crate) products: Vec<Vec<f64>>,
    /// What the columns were divided by.
    pub(crate) scale: Vec<f64>,
}

impl Parts {
    pub(crate) fn new(rows: &Rows, model: &Model, noise: f64, blocks: &[Range<usize>]) -> Self {
        let products = Products { rows, model };
        let moments: Vec<_> = blocks.iter().map(|block| products.of(block)).collect();
        let scale = products.scale(&moments);
        let (size, first) = (model.constant.len() + 1, 2 * model.windowed.len());
        let part = |(block, moments): (&Range<usize>, &(Vec<f64>, [f64; 3]))| {
            products.of_constants(block, moments, noise, &scale).unwrap_or_else(|| vec![0.0; size * size])
        };
        let products = blocks.iter().zip(&moments).map(part).collect();
        Self { products, scale: scale[first..].to_vec() }
    }
}

/// The lines that windowed unknowns follow in a block for given constants: the value at its centre and the growth per second. `None` where
/// the block does not determine them.
pub(crate) fn lines(rows: &Rows, model: &Model, block: &Range<usize>, constants: &[f64]) -> Option<Vec<[f64; 2]>> {
    let products = Products { rows, model };
    let (count, first) = (products.columns(), 2 * model.windowed.len());
    let (moments, times) = products.of(block);
    if times[0] <= (ROWS_OF_AN_UNKNOWN * first) as f64 {
        return None;
    }
    let entry = |i: usize, j: usize| moments[i.max(j) * count + i.min(j)];
    let normal: Vec<f64> = (0..first * first).map(|place| entry(place / first, place % first)).collect();
    let inverse = inverse(&normal, first)?;
    let rhs = |i: usize| {
        entry(i, count - 1) - constants.iter().enumerate().map(|(k, value)| entry(i, first + k) * value).sum::<f64>()
    };
    let value = |i: usize| (0..first).map(|j| inverse[i * first + j] * rhs(j)).sum::<f64>();
    let half = products.centre(block).0;
    Some((0..model.windowed.len()).map(|one| [value(2 * one), value(2 * one + 1) / half]).collect())
}

/// Whether the information on every constant is spread over so many blocks.
fn is_spread(parts: &[Vec<f64>], constants: usize, least: f64) -> bool {
    let size = constants + 1;
    (0..constants).all(|i| {
        let told = parts.iter().map(|part| part[i * size + i].max(0.0));
        let (sum, squares) = told.fold((0.0, 0.0), |(sum, squares), one| (sum + one, squares + one * one));
        sum * sum >= least * squares && squares > 0.0
    })
}

/// Solves the products that are left of all blocks for the constants, and gives their covariance.
fn solve(parts: &[Vec<f64>], constants: usize, lags: usize) -> Option<(Vec<f64>, Vec<f64>)> {
    let size = constants + 1;
    let told = parts.iter().filter(|part| part.iter().any(|&value| value != 0.0)).count();
    if told < BLOCKS_OF_A_CONSTANT * constants + 2 {
        return None;
    }
    let sum = |i: usize, j: usize| parts.iter().map(|part| part[i * size + j]).sum::<f64>();
    let normal: Vec<f64> = (0..constants * constants).map(|place| sum(place / constants, place % constants)).collect();
    let inverse = inverse(&normal, constants)?;
    let row = |i: usize| &inverse[i * constants..(i + 1) * constants];
    let rhs: Vec<f64> = (0..constants).map(|i| sum(i, constants)).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let solution: Vec<f64> = (0..constants).map(|i| dot(row(i), &rhs)).collect();
    let pull = |part: &Vec<f64>| -> Vec<f64> {
        let score = |i: usize| part[i * size + constants] - dot(&part[i * size..i * size + constants], &solution);
        let scores: Vec<f64> = (0..constants).map(score).collect();
        (0..constants).map(|i| dot(row(i), &scores)).collect()
    };
    let pulls: Vec<Vec<f64>> = parts.iter().map(pull).collect();
    let few = told as f64 / (told - 1) as f64;
    let weighted = |i: usize, j: usize| {
        let of = |lag: usize| pulls.iter().zip(&pulls[lag..]).map(|(a, b)| a[i] * b[j] + b[i] * a[j]).sum::<f64>();
        let weight = |lag: usize| 1.0 - lag as f64 / (lags + 1) as f64;
        [0.5 * of(0), (1..=lags).map(|lag| weight(lag) * of(lag)).sum::<f64>()]
    };
    // Neighbours may make an error larger, not smaller: what they seem to share is then chance.
    let larger: Vec<bool> = (0..constants).map(|i| weighted(i, i)[1] > 0.0).collect();
    let entry = |i: usize, j: usize| {
        let [alone, shared] = weighted(i, j);
        few * if larger[i] && larger[j] { alone + shared } else { alone }
    };
    let covariance = (0..constants * constants).map(|place| entry(place / constants, place % constants)).collect();
    Some((solution, covariance))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::simulated::{CONSTANTS, assert_near, model, rows};

    const WHOLE: usize = 600;

    fn blocks(count: usize) -> Vec<Range<usize>> {
        (0..count).map(|index| index * WHOLE / count..(index + 1) * WHOLE / count).collect()
    }

    #[test]
    fn constants_beside_what_grows_linearly_in_every_block_are_exact() {
        let rows = rows(WHOLE, |time| [1.0 + 0.1 * time, 0.1], 0.0);
        let fit = fit_in_blocks(&rows, &model(), &[0.0], &blocks(20), 1).remove(0).unwrap();
        for (place, (value, error)) in fit.values.iter().zip(&fit.errors()).enumerate() {
            assert_near(*value, CONSTANTS[place], 1e-8);
            // Nothing scatters, and no more is known than blocks may have wrong alike.
            assert!(*error > 1e-7 && *error < 1e-4, "{error}");
        }
    }

    #[test]
    fn errors_are_as_large_as_the_noise_makes_them() {
        let rows = rows(WHOLE, |time| [1.0 + 0.1 * time, 0.1], 0.3);
        let fit = fit_in_blocks(&rows, &model(), &[0.0], &blocks(20), 1).remove(0).unwrap();
        for (place, (value, error)) in fit.values.iter().zip(&fit.errors()).enumerate() {
            assert!((value - CONSTANTS[place]).abs() < 4.0 * error && *error > 0.0);
        }
    }

    #[test]
    fn too_few_rows_or_blocks_determine_nothing() {
        let rows = rows(WHOLE, |_| [1.0, 0.1], 0.1);
        assert_eq!(
            fit_in_blocks(&rows, &model(), &[0.0, 0.1], &blocks(2), 1),
            [Err(NoFit::Undetermined), Err(NoFit::Undetermined)]
        );
        assert_eq!(fit_in_blocks(&rows, &model(), &[0.0], &blocks(200), 1), [Err(NoFit::Undetermined)]);
        assert_eq!(fit_in_blocks(&rows, &model(), &[0.0], &[], 1), [Err(NoFit::Undetermined)]);
        assert_eq!(fit_in_blocks(&rows, &model(), &[0.0], &blocks(4), 1), [Err(NoFit::TooFewBlocks)]);
    }
}
