//! Least squares in blocks of a record, with errors that rest on nothing but how the blocks scatter.
//!
//! Every block gives the products `M = Σ x xᵀ` of its rows. Windowed unknowns grow linearly within a block and are eliminated there;
//! what remains is added up and solved for the constants `c`. The score of a block, `s = M_cy - M_cc c` after the elimination, is what it
//! pulls the constants by, and `S⁻¹ (Σ s sᵀ) S⁻¹` is their covariance whatever the noise is like, as long as blocks that do not share
//! a row's samples know nothing of each other (the sandwich of Huber 1967, with the weights of Newey and West 1987 between neighbours).
//! Where a few blocks tell nearly all, their parts are compared in the same way.

use std::ops::Range;

use crate::equation::rows::Rows;
use crate::regression::block_products::{Eliminated, NoiseOfPairs, Products, ROWS_OF_AN_UNKNOWN, dot, inverse};
use crate::regression::block_scatter::Finer;
use crate::regression::model::Model;

/// The fewest blocks for each constant, for their scatter to say something.
const BLOCKS_OF_A_CONSTANT: usize = 2;

/// The fewest blocks that the information on a constant is spread over, for their scatter to be an error: one blow in a record is in one
/// or two. Windowed unknowns take up a good part of what a block scatters, so that there it takes more of them.
const SPREAD: f64 = 3.0;
const SPREAD_BESIDE_WINDOWED: f64 = 5.0;

/// Where errors rest on parts of blocks, unknowns take up all but one in so many independent rows, at most.
const MOST_OF_THE_PARTS: f64 = 3.0;

/// Unknowns below this are coefficients of the motion.
const MOTION: usize = 3;

/// Standard errors by which a coefficient of the motion differs from zero where errors rest on parts of blocks, or all widths agree because none
/// says anything.
const TOLD: f64 = 5.0;

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
        let mut entering = NoiseOfPairs::default();
        let part = |(block, moments): (&Range<usize>, &(Vec<f64>, [f64; 3]))| {
            let part = products.of_constants(block, moments, (noise, &mut entering), &scale)?;
            (used, unknowns) = (used + moments.1[0], unknowns + first);
            Some(part)
        };
        let eliminated: Vec<_> = blocks.iter().zip(&moments).map(part).collect();
        if used < (ROWS_OF_AN_UNKNOWN * unknowns) as f64 {
            return Err(NoFit::Undetermined);
        }
        let rest =
            |part: &Option<Eliminated>| part.as_ref().map_or_else(|| vec![0.0; size * size], |one| one.rest.clone());
        let parts: Vec<Vec<f64>> = eliminated.iter().map(rest).collect();
        let solved = solve(&parts, constants, lags);
        let told = parts.iter().map(|part| (0..constants).map(|i| part[i * size + i].max(0.0)).collect());
        let spread = spread(&told.collect::<Vec<_>>(), constants);
        let solved = if spread >= if first > 0 { SPREAD_BESIDE_WINDOWED } else { SPREAD } {
            solved.ok_or(NoFit::Undetermined)?
        } else {
            let few = if spread < SPREAD { NoFit::Undetermined } else { NoFit::TooFewBlocks };
            let finer = Finer { products: &products, blocks, scale: &scale, length: reach.max(1) };
            solved.and_then(|solved| with_finer(solved, &finer, &eliminated)).ok_or(few)?
        };
        let unscaled = |i: usize| scale[count - 1] / scale[first + i];
        Ok(BlockFit {
            values: solved.values.into_iter().enumerate().map(|(i, value)| value * unscaled(i)).collect(),
            covariance: solved
                .covariance
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
        let mut entering = NoiseOfPairs::default();
        let part = |(block, moments): (&Range<usize>, &(Vec<f64>, [f64; 3]))| {
            products
                .of_constants(block, moments, (noise, &mut entering), &scale)
                .map_or_else(|| vec![0.0; size * size], |part| part.rest)
        };
        let products = blocks.iter().zip(&moments).map(part).collect();
        Self { products, scale: scale[first..].to_vec() }
    }
}

/// Over how many blocks, or parts of them, the information on the constant is spread that is spread least.
fn spread(told: &[Vec<f64>], constants: usize) -> f64 {
    let of = |i: usize| {
        let each = told.iter().map(|one| one[i].max(0.0));
        let (sum, squares) = each.fold((0.0, 0.0), |(sum, squares), one| (sum + one, squares + one * one));
        if squares > 0.0 { sum * sum / squares } else { 0.0 }
    };
    (0..constants).map(of).fold(f64::INFINITY, f64::min)
}

/// Constants from the products that are left of all blocks.
struct SolvedBlocks {
    values: Vec<f64>,
    /// The inverse of the normal matrix, row by row.
    inverse: Vec<f64>,
    covariance: Vec<f64>,
}

/// Solves the products that are left of all blocks for the constants, and gives their covariance.
fn solve(parts: &[Vec<f64>], constants: usize, lags: usize) -> Option<SolvedBlocks> {
    let size = constants + 1;
    let told = parts.iter().filter(|part| part.iter().any(|&value| value != 0.0)).count();
    if told < BLOCKS_OF_A_CONSTANT * constants + 2 {
        return None;
    }
    let sum = |i: usize, j: usize| parts.iter().map(|part| part[i * size + j]).sum::<f64>();
    let normal: Vec<f64> = (0..constants * constants).map(|place| sum(place / constants, place % constants)).collect();
    let inverse = inverse(&normal, constants)?;
    let rhs: Vec<f64> = (0..constants).map(|i| sum(i, constants)).collect();
    let values: Vec<f64> = inverse.chunks_exact(constants.max(1)).map(|row| dot(row, &rhs)).collect();
    let score = |part: &Vec<f64>| -> Vec<f64> {
        let of = |i: usize| part[i * size + constants] - dot(&part[i * size..i * size + constants], &values);
        (0..constants).map(of).collect()
    };
    let scores: Vec<Vec<f64>> = parts.iter().map(score).collect();
    let few = told as f64 / (told - 1) as f64;
    let covariance = scattered(&inverse, &scores, lags).into_iter().map(|value| few * value).collect();
    Some(SolvedBlocks { values, inverse, covariance })
}

/// The covariance of constants by how the scores of blocks, or of parts of them, scatter, where so many neighbours share samples.
fn scattered(inverse: &[f64], scores: &[Vec<f64>], lags: usize) -> Vec<f64> {
    let constants = scores.first().map_or(0, Vec::len);
    let pull = |score: &Vec<f64>| inverse.chunks_exact(constants.max(1)).map(|row| dot(row, score)).collect();
    let pulls: Vec<Vec<f64>> = scores.iter().map(pull).collect();
    let weighted = |i: usize, j: usize| {
        let of = |lag: usize| pulls.iter().zip(&pulls[lag..]).map(|(a, b)| a[i] * b[j] + b[i] * a[j]).sum::<f64>();
        let weight = |lag: usize| 1.0 - lag as f64 / (lags + 1) as f64;
        [0.5 * of(0), (1..=lags).map(|lag| weight(lag) * of(lag)).sum::<f64>()]
    };
    // Neighbours may make an error larger, not smaller: what they seem to share is then chance.
    let larger: Vec<bool> = (0..constants).map(|i| weighted(i, i)[1] > 0.0).collect();
    let entry = |i: usize, j: usize| {
        let [alone, shared] = weighted(i, j);
        if larger[i] && larger[j] { alone + shared } else { alone }
    };
    (0..constants * constants).map(|place| entry(place / constants, place % constants)).collect()
}

/// Constants with errors by how parts of the blocks scatter, or the blocks where these scatter more; `None` where parts are too few, too.
fn with_finer(solved: SolvedBlocks, finer: &Finer<'_>, eliminated: &[Option<Eliminated>]) -> Option<SolvedBlocks> {
    let constants = solved.values.len();
    let found = finer.scores(eliminated, &solved.values);
    let (scores, told): (Vec<_>, Vec<_>) = found.parts.into_iter().map(|part| (part.score, part.told)).unzip();
    let free = found.independent - found.unknowns - constants as f64;
    if spread(&told, constants) < SPREAD_BESIDE_WINDOWED || free < found.independent / MOST_OF_THE_PARTS {
        return None;
    }
    let by_parts = scattered(&solved.inverse, &scores, 1.min(scores.len().saturating_sub(1)));
    let few = found.independent / free;
    let more: Vec<f64> = (0..constants)
        .map(|i| i * (constants + 1))
        .map(|place| (solved.covariance[place] / (few * by_parts[place])).max(1.0).sqrt())
        .collect();
    let of = |(place, value): (usize, &f64)| few * value * more[place / constants] * more[place % constants];
    let covariance: Vec<f64> = by_parts.iter().enumerate().map(of).collect();
    let moves = |place: usize| finer.products.model.constant[place] < MOTION;
    let is_told = |place: usize| solved.values[place].powi(2) > TOLD * TOLD * covariance[place * (constants + 1)];
    let mut moving = (0..constants).filter(|&place| moves(place)).peekable();
    (moving.peek().is_none() || moving.any(is_told)).then_some(SolvedBlocks { covariance, ..solved })
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
    fn what_few_blocks_tell_is_as_certain_as_their_parts_make_it() {
        // All but the first eighty rows say a thousandth of what these do.
        let mut rows = rows(WHOLE, |time| [1.0 + 0.1 * time, 0.1], 0.0);
        for row in 0..WHOLE {
            let size = if row < 80 { 1.0 } else { 1e-3 };
            rows.regressors.iter_mut().for_each(|one| {
                one.value[row] *= size;
                one.companion[row] *= size;
            });
            rows.rhs[row] = size * rows.rhs[row] + 0.1 * crate::regression::simulated::random(7, WHOLE)[row];
        }
        let fit = fit_in_blocks(&rows, &model(), &[0.0], &blocks(15), 2).remove(0).unwrap();
        for (place, (value, error)) in fit.values.iter().zip(&fit.errors()).enumerate() {
            // Of so many rows with regressors of variance one.
            let expected = 0.1 / 80.0_f64.sqrt();
            assert!((value - CONSTANTS[place]).abs() < 4.0 * expected, "{value}");
            assert!(*error > 0.7 * expected && *error < 1.6 * expected, "{error} {expected}");
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
