//! The covariance of sums of correlated scores, by tapers over the whole record.
//!
//! What noise does to neighbouring rows nearly cancels: kernels of derivatives sum to zero. Blocks that are cut off would count what sticks
//! out at their ends as if it did not cancel, and a truncated sum of autocovariances may be negative. The variance of a sum is the spectrum
//! of the scores at frequency zero; orthogonal sines over the record measure it in the narrowest band around that so many tapers can have, and the mean of
//! their squares is positive whatever the noise is (Riedel, Sidorenko 1995):
//!
//! ```text
//! w_k(i) = √(2/(n+1)) sin(π k (i+1)/(n+1)),   V = n Σ_k (Σ_i w_k(i) s_i)²/(K - 1).
//! ```
//!
//! One of the `K` tapers is lost to the estimate, which makes the scores sum to zero.

use std::f64::consts::PI;

/// Tapers: so many squares tell an error to 13 %; more would widen the band.
pub(crate) const TAPERS: usize = 30;

/// Rows that there are at least for every taper.
const ROWS: usize = 8;

/// A covariance, and of how many independent squares it is the mean.
#[derive(Clone, Debug)]
pub(crate) struct SumCovariance {
    /// Row by row.
    pub(crate) entries: Vec<f64>,
    pub(crate) freedom: f64,
}

/// The covariance of the sums of some columns of scores, from so many tapers at most.
pub(crate) fn sum_covariance(columns: &[Vec<f64>], most: usize) -> SumCovariance {
    let (count, rows) = (columns.len(), columns.first().map_or(0, Vec::len));
    let tapers = most.min(rows / ROWS).max(2);
    let mut sums = vec![vec![0.0; count]; tapers];
    for row in 0..rows {
        let phase = PI * (row + 1) as f64 / (rows + 1) as f64;
        // Sines of multiples follow from those of one less and two less.
        let (twice, mut before, mut taper) = (2.0 * phase.cos(), 0.0, phase.sin());
        for sums in &mut sums {
            sums.iter_mut().zip(columns).for_each(|(sum, column)| *sum += taper * column[row]);
            (before, taper) = (taper, twice * taper - before);
        }
    }
    let freedom = (tapers - 1) as f64;
    let scale = 2.0 * rows as f64 / (rows + 1) as f64 / freedom;
    let entry = |index: usize| scale * sums.iter().map(|sums| sums[index / count] * sums[index % count]).sum::<f64>();
    SumCovariance { entries: (0..count * count).map(entry).collect(), freedom }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::simulated::random;

    /// The variance of a sum of white noise is the number of rows. That of differences is the spectrum within the band of the tapers: π k/n squared, in the mean
    /// over k from 1 to 30, where cut blocks would see the differences' own variance of 2.
    #[test]
    fn white_noise_and_its_differences_are_told_apart() {
        let (rows, repeats) = (3000, 200);
        let (mut white, mut differences) = (0.0, 0.0);
        for repeat in 0..repeats {
            let noise = random(repeat, rows + 1);
            let difference = noise.windows(2).map(|pair| pair[1] - pair[0]).collect();
            white += sum_covariance(&[noise], TAPERS).entries[0] / repeats as f64;
            differences += sum_covariance(&[difference], TAPERS).entries[0] / repeats as f64;
        }
        // 30 squares where 29 are counted, and 6000 of them that tell the mean to 2 %.
        assert!((white / rows as f64 * 29.0 / 30.0 - 1.0).abs() < 0.06, "{white}");
        let band = (1..=30).map(|k| (PI * f64::from(k) / rows as f64).powi(2)).sum::<f64>() / 29.0;
        assert!((differences / (rows as f64 * band) - 1.0).abs() < 0.1, "{differences}");
    }
}
