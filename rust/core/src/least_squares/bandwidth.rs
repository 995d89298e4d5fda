//! Over how many rows residuals are correlated: the bandwidth of Bartlett's weights that Andrews (1991) derives.
//!
//! Each regressor times the residuals is taken for a process of first order, `u' = ρ u + ε`. Of its variance over long times,
//! `(1 + ρ) / (1 - ρ)` that of one row, weights over `B` rows keep a part that follows from `ρ` too, and is given back.

/// Larger correlations would ask for more rows than windows have (Andrews and Monahan 1992).
const MOST_CORRELATED: f64 = 0.97;

/// Sums of squares and of products of neighbours.
#[derive(Clone, Debug, Default)]
pub(crate) struct Neighbours {
    squares: f64,
    products: f64,
}

impl Neighbours {
    #[inline(always)]
    pub(crate) fn add(&mut self, one: f64, next: f64) {
        self.squares += 0.5 * (one * one + next * next);
        self.products += one * next;
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        self.squares += other.squares;
        self.products += other.products;
    }

    fn correlation(&self) -> f64 {
        if self.squares > 0.0 { (self.products / self.squares).clamp(-MOST_CORRELATED, MOST_CORRELATED) } else { 0.0 }
    }
}

/// Rows over which sums are made, and what they keep of the variance, by regressor.
#[derive(Clone, Debug)]
pub(crate) struct Bandwidth {
    pub(crate) rows: usize,
    pub(crate) kept: Vec<f64>,
}

impl Bandwidth {
    /// So many rows, as they were given; what they keep is taken for all.
    pub(crate) fn given(rows: usize, regressors: usize) -> Self {
        Self { rows, kept: vec![1.0; regressors] }
    }

    /// The rows that the correlations of all regressors ask for, at most a quarter of a window.
    pub(crate) fn of(all: &[Neighbours], window: usize) -> Self {
        let correlations: Vec<f64> = all.iter().map(Neighbours::correlation).collect();
        let asked = correlations.iter().map(|rho| {
            let bend = 2.0 * rho / (1.0 - rho * rho);
            1.1447 * (bend * bend * window as f64).cbrt()
        });
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small positive number")]
        let rows = (asked.fold(1.0, f64::max).ceil() as usize).min((window / 4).max(1));
        Self { rows, kept: correlations.iter().map(|&rho| kept(rho, rows)).collect() }
    }
}

/// The part of the variance of a sum over many rows that weights over some rows keep.
fn kept(rho: f64, rows: usize) -> f64 {
    let (mut sum, mut power) = (1.0, 1.0);
    for lag in 1..rows {
        power *= rho;
        sum += 2.0 * (1.0 - lag as f64 / rows as f64) * power;
    }
    sum * (1.0 - rho) / (1.0 + rho)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_more_neighbours_agree_the_more_rows_are_asked_for() {
        let of = |rho: f64, window: usize| Bandwidth::of(&[Neighbours { squares: 2.0, products: 2.0 * rho }], window);
        assert_eq!(of(0.0, 1000).rows, 1);
        // Andrews' formula with α = (2 · 0.5 / 0.75)² = 1.778: 1.1447 · (1778)^(1/3) = 13.9.
        assert_eq!(of(0.5, 1000).rows, 14);
        // 0.999 counts as 0.97: 1.1447 · (1000 · (1.94 / 0.0591)²)^(1/3) = 117.4, and at most a quarter of a window.
        assert_eq!(of(0.999, 1000).rows, 118);
        assert_eq!(of(0.999, 100).rows, 25);
        // Weights over very many rows keep all, over one row 1/3 of what (1 + 0.5) / (1 - 0.5) would be.
        assert!((kept(0.5, 100_000) - 1.0).abs() < 1e-4);
        assert!((kept(0.5, 1) - 1.0 / 3.0).abs() < 1e-15);
    }
}
