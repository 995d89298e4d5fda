//! How parts of blocks scatter, where the blocks themselves are too few to say what the error of a constant is.
//!
//! A sweep passes every frequency once, and a motion that fades tells most at its beginning: a few blocks hold nearly all that is known of a constant.
//! Their windowed unknowns stay eliminated as they are, and every block is cut into parts as long as a test function. What these pull the
//! constants by scatters as noise does, whatever it is like.

use std::ops::Range;

use crate::regression::block_products::{Eliminated, Products, dot};

/// Independent rows in a part as long as a test function: its rows are correlated over a third of that.
const INDEPENDENT: f64 = 2.0;

/// What a part of a block says of the constants.
pub(crate) struct BlockPart {
    /// What it pulls them by, corrected for the angle's noise.
    pub(crate) score: Vec<f64>,
    /// The information on each.
    pub(crate) told: Vec<f64>,
}

/// All parts of all blocks.
pub(crate) struct BlockParts {
    pub(crate) parts: Vec<BlockPart>,
    /// Independent rows that they hold.
    pub(crate) independent: f64,
    /// Windowed unknowns of their blocks.
    pub(crate) unknowns: f64,
}

/// Blocks that are cut into parts.
pub(crate) struct Finer<'a> {
    pub(crate) products: &'a Products<'a>,
    pub(crate) blocks: &'a [Range<usize>],
    /// What columns are divided by.
    pub(crate) scale: &'a [f64],
    /// Rows of a part, at least: with those of the next but one it shares no sample.
    pub(crate) length: usize,
}

impl Finer<'_> {
    /// What the parts of all blocks say beside given constants. `eliminated` is what is left of each block; `None` if it says nothing.
    pub(crate) fn scores(&self, eliminated: &[Option<Eliminated>], constants: &[f64]) -> BlockParts {
        let mut found = BlockParts { parts: Vec::new(), independent: 0.0, unknowns: 0.0 };
        for (block, eliminated) in self.blocks.iter().zip(eliminated) {
            let Some(eliminated) = eliminated else { continue };
            let parts = self.of_block(block, eliminated, constants);
            found.independent += INDEPENDENT * parts.len() as f64;
            found.unknowns += eliminated.factors.len() as f64;
            found.parts.extend(parts);
        }
        found
    }

    fn of_block(&self, block: &Range<usize>, eliminated: &Eliminated, constants: &[f64]) -> Vec<BlockPart> {
        let (size, first) = (constants.len() + 1, eliminated.factors.len());
        let count = (block.len() / self.length).max(1);
        let empty = || BlockPart { score: vec![0.0; constants.len()], told: vec![0.0; constants.len()] };
        let mut parts: Vec<BlockPart> = (0..count).map(|_| empty()).collect();
        let mut rows = vec![0.0_f64; count];
        self.products.for_each_row(block, |row, _, values| {
            values.iter_mut().zip(self.scale).for_each(|(value, scale)| *value /= scale);
            for (place, factors) in eliminated.factors.iter().enumerate() {
                let own = values[place];
                values[place + 1..].iter_mut().zip(factors).for_each(|(value, factor)| *value -= factor * own);
            }
            let (left, rhs) = values[first..].split_at(constants.len());
            let residual = rhs[0] - dot(left, constants);
            let place = (row - block.start) * count / block.len();
            rows[place] += 1.0;
            for (i, value) in left.iter().enumerate() {
                parts[place].score[i] += value * residual;
                parts[place].told[i] += value * value;
            }
        });
        // What the angle's noise adds is spread over the rows alike.
        let whole = rows.iter().sum::<f64>().max(1.0);
        for i in 0..constants.len() {
            let entries = &eliminated.rest[i * size..(i + 1) * size];
            let corrected = entries[constants.len()] - dot(entries, constants);
            let sum = |of: fn(&BlockPart) -> &Vec<f64>| parts.iter().map(|part| of(part)[i]).sum::<f64>();
            let pulled = sum(|part| &part.score) - corrected;
            let told = sum(|part| &part.told) - entries[i];
            for (part, rows) in parts.iter_mut().zip(&rows) {
                part.score[i] -= pulled * rows / whole;
                part.told[i] = (part.told[i] - told * rows / whole).max(0.0);
            }
        }
        parts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::block_products::NoiseOfPairs;
    use crate::regression::simulated::{CONSTANTS, model, rows};

    #[test]
    fn parts_add_up_to_what_their_block_says() {
        let rows = rows(600, |time| [1.0 + 0.1 * time, 0.1], 0.3);
        let model = model();
        let products = Products { rows: &rows, model: &model };
        let blocks = [0..200, 200..600];
        let moments: Vec<_> = blocks.iter().map(|block| products.of(block)).collect();
        let scale = products.scale(&moments);
        let constants: Vec<f64> = CONSTANTS.iter().map(|one| 0.9 * one).collect();
        let finer = Finer { products: &products, blocks: &blocks, scale: &scale, length: 25 };
        for (block, moments) in blocks.iter().zip(&moments) {
            let eliminated =
                products.of_constants(block, moments, (0.01, &mut NoiseOfPairs::default()), &scale).unwrap();
            let parts = finer.of_block(block, &eliminated, &constants);
            assert_eq!(parts.len(), block.len() / 25);
            let size = constants.len() + 1;
            for i in 0..constants.len() {
                let row = &eliminated.rest[i * size..(i + 1) * size];
                let whole = row[constants.len()] - row.iter().zip(&constants).map(|(a, b)| a * b).sum::<f64>();
                let (scores, told): (f64, f64) =
                    parts.iter().fold((0.0, 0.0), |(a, b), part| (a + part.score[i], b + part.told[i]));
                assert!((scores - whole).abs() < 1e-9 * row[i].abs().max(1.0), "{scores} {whole}");
                // Of parts nothing is told less than nothing.
                assert!(told > row[i] - 1e-9 * row[i].abs());
            }
        }
    }
}
