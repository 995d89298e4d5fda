//! Between which blocks of a record its constants jump.
//!
//! Once the unknowns of a block are eliminated, what it says of the constants `c` are products `S = M_cc` and `s = M_cy`. Blocks that share
//! constants explain `sᵀ S⁻¹ s` of the sum of squares, each summed over the blocks. A jump between two blocks adds what both parts explain
//! apart. It is accepted where that is beyond chance and beyond what is gained by leaving out any single block, which something may have
//! spoilt. Both parts are then searched like the whole (binary segmentation, Scott and Knott 1974). In the end the few blocks around each
//! jump must tell it from a parabola in time: slow changes are no jumps.

use std::ops::Range;

use crate::regression::block_products::inverse;

/// The least gain by a jump, and by how much more than by anything else, over the variance of an independent row.
const SIGNIFICANT: f64 = 60.0;
const BETTER: f64 = 20.0;

/// Blocks on either side of a jump, at least.
const FEWEST: usize = 3;

/// Blocks on either side of a jump that are compared with a curve.
const AROUND: usize = 6;

/// A record with more jumps changes all the time.
const MOST_JUMPS: usize = 8;

/// Powers of time up to parabolas.
const POWERS: usize = 3;

/// What the blocks of a record say of its constants.
pub(crate) struct Told<'a> {
    /// By block: products of the constants' columns and the right-hand side, which comes last.
    pub(crate) parts: &'a [Vec<f64>],
    pub(crate) constants: usize,
    /// The variance of an independent row, in the units of the products.
    pub(crate) variance: f64,
}

impl Told<'_> {
    /// The first blocks after jumps, in order; none where there are more than a few.
    pub(crate) fn jumps(&self) -> Vec<usize> {
        let mut found = Vec::new();
        self.search(0..self.parts.len(), &mut found);
        found.sort_unstable();
        if found.len() > MOST_JUMPS {
            return Vec::new();
        }
        let ends: Vec<usize> = [0].into_iter().chain(found).chain([self.parts.len()]).collect();
        ends.windows(3).filter(|three| self.is_sudden(three)).map(|three| three[1]).collect()
    }

    /// The constants of some blocks.
    pub(crate) fn values(&self, blocks: Range<usize>) -> Option<Vec<f64>> {
        self.solved(&self.sums(blocks, 0)).map(|(values, _)| values)
    }

    fn search(&self, blocks: Range<usize>, found: &mut Vec<usize>) {
        if found.len() > MOST_JUMPS || blocks.len() < 2 * FEWEST {
            return;
        }
        let Some((place, gain)) = self.best(&blocks) else { return };
        if gain < SIGNIFICANT * self.variance || gain < self.single(&blocks) + BETTER * self.variance {
            return;
        }
        found.push(place);
        self.search(blocks.start..place, found);
        self.search(place..blocks.end, found);
    }

    /// Whether the blocks around a jump, as far as the next ones, change at once and not in some curve.
    fn is_sudden(&self, jumps: &[usize]) -> bool {
        let (before, place, after) =
            (jumps[0].max(jumps[1].saturating_sub(AROUND)), jumps[1], jumps[2].min(jumps[1] + AROUND));
        let explained = |blocks: Range<usize>| self.solved(&self.sums(blocks, 0)).map(|(_, explained)| explained);
        let parts = (explained(before..place), explained(place..after), explained(before..after));
        let (Some(early), Some(late), Some(whole)) = parts else { return false };
        let gain = early + late - whole;
        gain > SIGNIFICANT * self.variance && gain > self.parabolas(&(before..after)) + BETTER * self.variance
    }

    /// The place of the jump that explains most, and by how much more than no jump.
    fn best(&self, blocks: &Range<usize>) -> Option<(usize, f64)> {
        let all = self.sums(blocks.clone(), 0);
        let (_, whole) = self.solved(&all)?;
        let mut early = self.sums(blocks.start..blocks.start + FEWEST, 0);
        let mut best: Option<(usize, f64)> = None;
        for place in blocks.start + FEWEST..=blocks.end - FEWEST {
            let late: Vec<f64> = all.iter().zip(&early).map(|(all, early)| all - early).collect();
            if let (Some((_, early)), Some((_, late))) = (self.solved(&early), self.solved(&late)) {
                let gain = early + late - whole;
                if best.is_none_or(|(_, best)| gain > best) {
                    best = Some((place, gain));
                }
            }
            early.iter_mut().zip(&self.parts[place]).for_each(|(sum, one)| *sum += one);
        }
        best
    }

    /// What is gained most by leaving out one block.
    fn single(&self, blocks: &Range<usize>) -> f64 {
        let all = self.sums(blocks.clone(), 0);
        let Some((_, whole)) = self.solved(&all) else { return f64::INFINITY };
        let gain = |block: usize| {
            let rest: Vec<f64> = all.iter().zip(&self.parts[block]).map(|(all, one)| all - one).collect();
            let own = self.solved(&self.parts[block]).map_or(0.0, |(_, explained)| explained);
            self.solved(&rest).map_or(0.0, |(_, rest)| rest + own - whole)
        };
        blocks.clone().map(gain).fold(0.0, f64::max)
    }

    /// What parabolas in time explain beyond constants.
    fn parabolas(&self, blocks: &Range<usize>) -> f64 {
        let (count, size) = (self.constants, self.constants + 1);
        let sums: Vec<Vec<f64>> = (0..2 * POWERS - 1).map(|power| self.sums(blocks.clone(), power)).collect();
        let wide = POWERS * count;
        let normal: Vec<f64> = (0..wide * wide)
            .map(|place| {
                let (row, column) = (place / wide, place % wide);
                sums[row / count + column / count][row % count * size + column % count]
            })
            .collect();
        let rhs: Vec<f64> = (0..wide).map(|row| sums[row / count][row % count * size + count]).collect();
        let whole = self.solved(&sums[0]).map(|(_, explained)| explained);
        match (explained(&normal, &rhs), whole) {
            (Some((_, parabolas)), Some(whole)) => parabolas - whole,
            _ => f64::INFINITY,
        }
    }

    /// Products summed over blocks, times a power of time from -1 to 1.
    fn sums(&self, blocks: Range<usize>, power: usize) -> Vec<f64> {
        let mut sums = vec![0.0; (self.constants + 1).pow(2)];
        let last = (blocks.len().max(2) - 1) as f64;
        for (place, block) in blocks.enumerate() {
            #[allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "a small power")]
            let weight = (2.0 * place as f64 / last - 1.0).powi(power as i32);
            sums.iter_mut().zip(&self.parts[block]).for_each(|(sum, one)| *sum += weight * one);
        }
        sums
    }

    /// The constants that products give, and what they explain.
    fn solved(&self, products: &[f64]) -> Option<(Vec<f64>, f64)> {
        let (count, size) = (self.constants, self.constants + 1);
        let normal: Vec<f64> = (0..count * count).map(|place| products[place / count * size + place % count]).collect();
        let rhs: Vec<f64> = (0..count).map(|row| products[row * size + count]).collect();
        explained(&normal, &rhs)
    }
}

/// The solution of normal equations, and what it explains of the sum of squares.
pub(crate) fn explained(normal: &[f64], rhs: &[f64]) -> Option<(Vec<f64>, f64)> {
    let count = rhs.len();
    let inverse = inverse(normal, count)?;
    let values: Vec<f64> = (0..count)
        .map(|row| inverse[row * count..(row + 1) * count].iter().zip(rhs).map(|(entry, rhs)| entry * rhs).sum())
        .collect();
    let sum = values.iter().zip(rhs).map(|(value, rhs)| value * rhs).sum();
    Some((values, sum))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::simulated::random;

    const BLOCKS: usize = 40;
    const VARIANCE: f64 = 0.01;

    /// Blocks of a hundred rows that say of two constants what they are at the block, and noise.
    fn parts(constants: impl Fn(usize) -> [f64; 2]) -> Vec<Vec<f64>> {
        let noise = random(3, BLOCKS * 100);
        let block = |block: usize| {
            let [one, other] = constants(block);
            let mut products = vec![0.0; 9];
            for row in 0..100_u32 {
                let columns = [(0.7 * f64::from(row)).sin(), (1.9 * f64::from(row)).cos()];
                let rhs = columns[0] * one + columns[1] * other + VARIANCE.sqrt() * noise[100 * block + row as usize];
                let all = [columns[0], columns[1], rhs];
                (0..9).for_each(|place| products[place] += all[place / 3] * all[place % 3]);
            }
            products
        };
        (0..BLOCKS).map(block).collect()
    }

    fn found(constants: impl Fn(usize) -> [f64; 2]) -> Vec<usize> {
        Told { parts: &parts(constants), constants: 2, variance: VARIANCE }.jumps()
    }

    #[test]
    fn jumps_are_found_between_the_blocks_where_they_are() {
        assert_eq!(found(|block| [1.0 + 0.1 * f64::from(u8::from(block >= 9)), 2.0]), [9]);
        assert_eq!(found(|block| [1.0, [2.0, 2.4, 1.9][block / 14]]), [14, 28]);
        let parts = parts(|block| [if block < 20 { 1.0 } else { 3.0 }, 2.0]);
        let told = Told { parts: &parts, constants: 2, variance: VARIANCE };
        let values = told.values(20..40).expect("constants");
        assert!((values[0] - 3.0).abs() < 0.01 && (values[1] - 2.0).abs() < 0.01);
    }

    #[test]
    fn none_is_found_where_nothing_or_one_block_changes_or_all_do_slowly() {
        assert!(found(|_| [1.0, 2.0]).is_empty());
        assert!(found(|block| [if block == 17 { 5.0 } else { 1.0 }, 2.0]).is_empty());
        assert!(found(|block| [1.0 + 0.02 * block as f64, 2.0]).is_empty());
        assert!(found(|block| [1.0 + 0.001 * (block as f64 - 10.0).powi(2), 2.0]).is_empty());
        assert!(found(|block| [1.0 + 0.5 * (0.3 * block as f64).sin(), 2.0]).is_empty());
    }
}
