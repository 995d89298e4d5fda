//! The jumps of a torque that terms explain: dry friction changes from sample to sample, and would be taken for noise.
//!
//! Differences of high order leave noise and jumps of the torque, and nothing of what is smooth. What the same differences of the terms
//! explain of them beyond chance is no noise.

use faer::Mat;
use faer::linalg::solvers::{DenseSolveCore, Llt};

use crate::record::samples::{Samples, is_usable};

/// Differences of the eighth order, of noise their own variance.
const DIFFERENCES: [f64; 9] = [1.0, -8.0, 28.0, -56.0, 70.0, -56.0, 28.0, -8.0, 1.0];
const SQUARES: f64 = 12870.0;

/// A term explains jumps where its factor squared is so many times its variance. Neighbouring differences are correlated, which makes the
/// variance up to 5 times as large as it is taken to be.
const BEYOND_CHANCE: f64 = 100.0;

/// Less than this part of the noise is not worth a word.
const LEAST: f64 = 0.01;

/// The torque without what terms explain of its jumps; `None` where that is nothing beyond chance.
pub(crate) fn without_jumps(torque: &dyn Samples, terms: &[&dyn Samples]) -> Option<Vec<f64>> {
    let samples = torque.len();
    if terms.is_empty() || samples < DIFFERENCES.len() {
        return None;
    }
    let read = |channel: &dyn Samples| {
        let mut values = vec![0.0; samples];
        channel.read(0, &mut values);
        values
    };
    let mut columns: Vec<Vec<f64>> = terms.iter().map(|term| read(*term)).collect();
    let torque = read(torque);
    while !columns.is_empty() {
        let products = Differenced::new(&torque, &columns);
        let Some((factors, variances)) = products.solve() else {
            // Terms that depend on each other explain together what one of them does alone.
            columns.pop();
            continue;
        };
        let doubtful = (0..columns.len()).find(|&one| {
            let significance = factors[one] * factors[one] / variances[one];
            significance.is_nan() || significance < BEYOND_CHANCE
        });
        if let Some(doubtful) = doubtful {
            columns.remove(doubtful);
            continue;
        }
        let explained: f64 = factors.iter().zip(&products.with_torque).map(|(factor, product)| factor * product).sum();
        if explained < LEAST * products.torque {
            return None;
        }
        let mut left = torque.clone();
        for (column, factor) in columns.iter().zip(&factors) {
            left.iter_mut().zip(column).for_each(|(left, value)| *left -= factor * value);
        }
        return Some(left);
    }
    None
}

/// Products of the differences of terms with each other and with those of the torque.
struct Differenced {
    terms: Mat<f64>,
    with_torque: Vec<f64>,
    torque: f64,
    count: f64,
}

impl Differenced {
    fn new(torque: &[f64], columns: &[Vec<f64>]) -> Self {
        let terms = columns.len();
        let mut found =
            Self { terms: Mat::zeros(terms, terms), with_torque: vec![0.0; terms], torque: 0.0, count: 0.0 };
        let mut differences = vec![0.0; terms];
        for sample in 0..=torque.len() - DIFFERENCES.len() {
            let of_torque = difference(torque, sample);
            differences.iter_mut().zip(columns).for_each(|(one, column)| *one = difference(column, sample));
            if !is_usable(of_torque) || !differences.iter().all(|one| is_usable(*one)) {
                continue;
            }
            found.torque += of_torque * of_torque;
            found.count += 1.0;
            for one in 0..terms {
                found.with_torque[one] += of_torque * differences[one];
                for other in 0..terms {
                    found.terms[(one, other)] += differences[one] * differences[other];
                }
            }
        }
        found
    }

    /// Factors of least squares and their variances; `None` if terms depend on each other.
    fn solve(&self) -> Option<(Vec<f64>, Vec<f64>)> {
        let terms = self.with_torque.len();
        let inverse = Llt::new(self.terms.as_ref(), faer::Side::Lower).ok()?.inverse();
        let factors: Vec<f64> = (0..terms)
            .map(|one| (0..terms).map(|other| inverse[(one, other)] * self.with_torque[other]).sum())
            .collect();
        let explained: f64 = factors.iter().zip(&self.with_torque).map(|(factor, product)| factor * product).sum();
        let variance = (self.torque - explained).max(0.0) / (self.count - terms as f64).max(1.0);
        let variances = (0..terms).map(|one| inverse[(one, one)] * variance).collect();
        Some((factors, variances))
    }
}

/// A difference of samples from some place on.
fn difference(values: &[f64], first: usize) -> f64 {
    let sum: f64 = DIFFERENCES.iter().zip(&values[first..]).map(|(weight, value)| weight * value).sum();
    sum / SQUARES.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::quantisation::tests::uniform;

    #[test]
    fn friction_is_taken_off_and_what_is_smooth_stays() {
        let samples = 4000;
        let noise = uniform(samples);
        let direction: Vec<f64> = (0..samples).map(|n| (n as f64 * 0.01).sin().signum()).collect();
        let smooth: Vec<f64> = (0..samples).map(|n| (n as f64 * 0.003).cos()).collect();
        let torque: Vec<f64> = (0..samples).map(|n| smooth[n] + 2.0 * direction[n] + 0.1 * noise[n]).collect();
        let (torque, direction, smooth) = (torque.as_slice(), direction.as_slice(), smooth.as_slice());
        let left = without_jumps(&torque, &[&smooth, &direction]).unwrap();
        let spread = left.iter().zip(smooth).zip(&noise).map(|((left, smooth), noise)| left - smooth - 0.1 * noise);
        // The factor of 25 jumps, whose differences stand out by so much, is wrong by a hundredth of the noise.
        assert!(spread.fold(0.0_f64, |most, one| most.max(one.abs())) < 0.1);
        assert!(without_jumps(&torque, &[&smooth]).is_none() && without_jumps(&torque, &[]).is_none());
    }

    #[test]
    fn chance_is_left_alone() {
        let both = uniform(6000);
        let (torque, other) = both.split_at(3000);
        assert!(without_jumps(&torque, &[&other]).is_none());
        let rests = vec![f64::NAN; 3000];
        assert!(without_jumps(&torque, &[&rests.as_slice()]).is_none());
    }
}
