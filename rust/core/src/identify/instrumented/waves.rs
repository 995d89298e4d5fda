//! Whether one constant leaves less where it may follow cosines over the record, each with the instrument's own cosine.
//!
//! Parts of the record that are solved on their own see what changes within them as noise, and the wider the test function the fewer parts there
//! are. Cosines take what changes out of the residuals, so that errors are those of the noise; as many coefficients as there are cosines are
//! tested together (Wald's test with an estimated covariance, Hotelling). Cosines and tapers are linear between nodes, so that a record of any length is
//! gone over once.

use std::f64::consts::PI;

use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, MatRef};

use crate::identify::instrumented::two_stage_rows::TwoStageRows;
use crate::inference::constancy::Test;
use crate::regression::tapered_sums::TAPERS;
use crate::regression::two_stage::{beyond, condition, distance, norm};

/// Cosines, one number after the other: few tell best what drifts, many what comes and goes.
const WAVES: [usize; 4] = [2, 6, 16, 40];

/// Rows of half a period of the shortest cosine at least, in units of those over which neighbours are correlated.
const REACHES: usize = 4;

/// Nodes at most: so many that the shortest taper has 25 for a period.
const NODES: usize = 2048;

/// Beyond this condition number cosines of one unknown take the place of others.
const MOST_CONDITION: f64 = 1e6;

/// Noise is not equally strong within the band of the tapers: near a resonance it is by so much stronger where the cosines are.
const UNEVEN: f64 = 1.5;

/// The least likely of the tests of each unknown, with a probability that knows how many were made; `None` where rows know too little.
pub(crate) fn tests(columns: &TwoStageRows, reach: usize) -> Vec<Option<Test>> {
    let count = columns.unknowns();
    let most = columns.len() / (REACHES * reach.max(1));
    let mut made: Vec<usize> =
        WAVES.into_iter().map(|waves| waves.min(most)).filter(|waves| *waves >= WAVES[0]).collect();
    made.dedup();
    let Some(nodes) = Nodes::new(columns) else { return vec![None; count] };
    let of = |one: usize| {
        let found = made.iter().filter_map(|&waves| nodes.test(one, waves));
        Test::least_likely(found, made.len())
    };
    (0..count).map(of).collect()
}

/// Products of instruments with regressors and the right-hand side, summed around nodes: each row's is shared by the nodes on either side of it.
struct Nodes {
    count: usize,
    /// By node, instrument and regressor; the right-hand side comes last.
    products: Vec<f64>,
}

impl Nodes {
    /// `None` where a column is empty.
    fn new(columns: &TwoStageRows) -> Option<Self> {
        let (rows, count) = (columns.len(), columns.unknowns());
        let scales = columns.columns().map(|of| of.iter().map(|column| norm(column)).collect::<Vec<f64>>());
        if scales.iter().flatten().any(|scale| *scale == 0.0 || !scale.is_finite()) {
            return None;
        }
        let (nodes, size) = (NODES.min(rows).max(2), count * (count + 1));
        let mut products = vec![0.0; nodes * size];
        let [regressors, instruments] = columns.columns();
        let step = (nodes - 1) as f64 / (rows - 1).max(1) as f64;
        for row in 0..rows {
            let place = row as f64 * step;
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "not negative, less than the nodes"
            )]
            let node = (place as usize).min(nodes - 2);
            let later = place - node as f64;
            for (i, (instrument, scale)) in instruments.iter().zip(&scales[1]).enumerate() {
                let z = instrument[row] / scale;
                for j in 0..=count {
                    let x = if j < count { regressors[j][row] / scales[0][j] } else { columns.rhs()[row] };
                    let index = node * size + i * (count + 1) + j;
                    products[index] += (1.0 - later) * z * x;
                    products[index + size] += later * z * x;
                }
            }
        }
        Some(Self { count, products })
    }

    /// The products of every node.
    fn each(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        self.products.chunks_exact(self.count * (self.count + 1))
    }

    /// The test of one unknown with so many cosines.
    fn test(&self, one: usize, waves: usize) -> Option<Test> {
        let (count, nodes) = (self.count, self.each().len());
        let total = count + waves;
        // Each column is that of an unknown, times one or a cosine.
        let unknown = |column: usize| if column < count { column } else { one };
        let cosines: Vec<Vec<f64>> = (0..nodes).map(|node| factors(node, nodes, (count, waves))).collect();
        let (mut square, mut side) = (Mat::<f64>::zeros(total, total), Mat::<f64>::zeros(total, 1));
        for (products, factors) in self.each().zip(&cosines) {
            for i in 0..total {
                let of = &products[unknown(i) * (count + 1)..];
                for j in 0..total {
                    square[(i, j)] += factors[i] * factors[j] * of[unknown(j)];
                }
                side[(i, 0)] += factors[i] * of[count];
            }
        }
        condition(square.as_ref()).filter(|condition| *condition <= MOST_CONDITION)?;
        let inverse = square.partial_piv_lu().inverse();
        let beta: Mat<f64> = &inverse * &side;
        // Each cosine makes one more sum of scores vanish, of those that tapers are near.
        let freedom = (TAPERS - 1).max(2 * waves);
        let tapers = freedom + 1 + waves;
        let mut sums = Mat::<f64>::zeros(total, tapers);
        for (node, (products, factors)) in self.each().zip(&cosines).enumerate() {
            let own: f64 = (count..total).map(|j| factors[j] * beta[(j, 0)]).sum();
            let score = |i: usize| {
                let of = &products[i * (count + 1)..];
                of[count] - own * of[one] - (0..count).map(|j| of[j] * beta[(j, 0)]).sum::<f64>()
            };
            let scores: Vec<f64> = (0..count).map(score).collect();
            let phase = PI * (node as f64 + 0.5) / nodes as f64;
            let (twice, mut before, mut taper) = (2.0 * phase.cos(), 0.0, phase.sin());
            for k in 0..tapers {
                for i in 0..total {
                    sums[(i, k)] += taper * factors[i] * scores[unknown(i)];
                }
                (before, taper) = (taper, twice * taper - before);
            }
        }
        let spread: Mat<f64> = &inverse * &sums;
        verdict(beta.as_ref(), spread.as_ref(), (one, waves), freedom as f64)
    }
}

/// What columns are multiplied by at a node: ones, and the cosines.
fn factors(node: usize, nodes: usize, (count, waves): (usize, usize)) -> Vec<f64> {
    let phase = PI * (node as f64 + 0.5) / nodes as f64;
    (0..count).map(|_| 1.0).chain((1..=waves).map(|wave| (wave as f64 * phase).cos())).collect()
}

/// What the coefficients of the last columns say, whose covariance is that of tapered sums.
fn verdict(beta: MatRef<'_, f64>, spread: MatRef<'_, f64>, (one, waves): (usize, usize), freedom: f64) -> Option<Test> {
    let first = beta.nrows() - waves;
    let values: Vec<f64> = (first..beta.nrows()).map(|row| beta[(row, 0)]).collect();
    let sum = |i: usize, j: usize| -> f64 {
        (0..spread.ncols()).map(|k| spread[(first + i, k)] * spread[(first + j, k)]).sum()
    };
    let entry = |index: usize| UNEVEN * 2.0 / freedom * sum(index / waves, index % waves);
    let covariance: Vec<f64> = (0..waves * waves).map(entry).collect();
    let (squares, directions) = distance(&values, &covariance);
    let probability = Some(beyond((squares, directions, freedom))).filter(|chance| chance.is_finite())?;
    // Of a cosine half its square; noise has its share.
    let square: f64 = (0..waves).map(|i| values[i].powi(2) - covariance[i * (waves + 1)]).sum();
    let deviation = (0.5 * square.max(0.0)).sqrt();
    Some(Test::new(probability, (deviation, beta[(one, 0)]), (squares / directions as f64, directions)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equation::rows::Rows;
    use crate::regression::simulated::{PERIOD, random, rows};

    const ROWS: usize = 6000;

    /// Probabilities of a coefficient alone whose regressor an instrument explains in part, with white noise.
    fn probability(seed: u64, coefficient: impl Fn(f64) -> f64) -> f64 {
        let mut recorded: Rows = rows(ROWS, |_| [1.0, 0.0], 0.0);
        let explained = recorded.clone();
        let (own, noise) = (random(seed, ROWS), random(seed + 1, ROWS));
        let column = &mut recorded.regressors[1].value;
        for row in 0..ROWS {
            column[row] += 0.5 * own[row];
            let noise = noise[row] + own[row];
            recorded.rhs[row] = coefficient(row as f64 * PERIOD) * column[row] + noise;
        }
        let columns = TwoStageRows::new(&recorded, &explained, &[1]);
        tests(&columns, 10)[0].as_ref().expect("a test").probability
    }

    #[test]
    fn what_comes_and_goes_is_no_chance() {
        let length = ROWS as f64 * PERIOD;
        for waves in [1.0, 5.0, 15.0, 30.0] {
            let found = probability(1, |time| 3.0 + 0.5 * (PI * waves * time / length).sin());
            assert!(found < 1e-6, "{waves}: {found}");
        }
    }

    #[test]
    fn a_constant_is_not_said_to_change() {
        let chances: Vec<f64> = (0..40).map(|seed| probability(100 + 2 * seed, |_| 3.0)).collect();
        let below = |limit: f64| chances.iter().filter(|chance| **chance < limit).count();
        assert!(below(0.01) <= 1 && below(0.0005) == 0, "{} {}", below(0.01), below(0.0005));
    }
}
