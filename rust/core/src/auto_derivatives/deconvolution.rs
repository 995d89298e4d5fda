//! Polynomials from the polynomials of their means.

use crate::local_polynomials::basis::{Basis, MOST_DEGREES};

/// The polynomials of a basis at the centre.
pub(crate) struct AtCentre {
    /// By derivative and degree, of the means.
    pub(crate) of_means: [[f64; MOST_DEGREES]; MOST_DEGREES],
    /// [`deconvolution`], and samples of a mean.
    factors: [f64; MOST_DEGREES / 2],
    step: usize,
}

impl AtCentre {
    pub(crate) fn new(basis: &Basis, step: usize) -> Self {
        let mut of_means = [[0.0; MOST_DEGREES]; MOST_DEGREES];
        let degrees = basis.degrees();
        of_means[0][0] = 1.0 / (basis.length() as f64).sqrt();
        for d in 0..degrees {
            for (j, (ratio, inverse)) in basis.steps().iter().enumerate().take(degrees - 1) {
                let below = if d > 0 { d as f64 * of_means[d - 1][j] * inverse } else { 0.0 };
                let last = if j > 0 { ratio * of_means[d][j - 1] } else { 0.0 };
                of_means[d][j + 1] = below - last;
            }
        }
        Self { of_means, factors: deconvolution(step), step }
    }

    /// A derivative of the polynomial whose means one of the basis is, in samples.
    pub(crate) fn derivative(&self, derivative: usize, degree: usize) -> f64 {
        let terms = self.of_means[derivative..].iter().step_by(2).zip(&self.factors);
        let sum: f64 = terms.map(|(row, factor)| row[degree] * factor).sum();
        sum / (self.step as f64).powi(i32::try_from(derivative).unwrap_or(i32::MAX))
    }

    /// The polynomials whose means those of the basis are, in terms of the basis: a row each.
    pub(crate) fn polynomials(&self, degrees: usize) -> Vec<Vec<f64>> {
        let row = |degree: usize| {
            // Derivatives at the centre say what is added, the highest first.
            let mut row = vec![0.0; degrees];
            row[degree] = 1.0;
            for d in (0..degree).rev() {
                let terms = self.of_means[d..].iter().step_by(2).zip(&self.factors).skip(1);
                let added: f64 = terms.map(|(derivative, factor)| derivative[degree] * factor).sum();
                let known: f64 = (d + 1..degree).map(|i| row[i] * self.of_means[d][i]).sum();
                row[d] = (added - known) / self.of_means[d][d];
            }
            row
        };
        (0..degrees).map(row).collect()
    }
}

/// What the derivatives `0, 2, 4 …` of a polynomial contribute to the value of the polynomial whose means it is, per mean:
///
/// ```text
/// f = r sinh(D/2r) / sinh(D/2) · mean of f over r samples,   D the derivative.
/// ```
fn deconvolution<const TERMS: usize>(step: usize) -> [f64; TERMS] {
    let mut factors = [0.0; TERMS];
    let squared = (step * step) as f64;
    // Coefficients of sinh(D/2)/(D/2), and of the same with D/r: over them of r².
    let mut sinh = [1.0; TERMS];
    for k in 1..TERMS {
        sinh[k] = sinh[k - 1] / (4 * 2 * k * (2 * k + 1)) as f64;
    }
    let mut shrunk = 1.0;
    for k in 0..TERMS {
        let known: f64 = (0..k).map(|i| factors[i] * sinh[k - i]).sum();
        factors[k] = sinh[k] * shrunk - known;
        shrunk /= squared;
    }
    factors
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_follows_from_its_means() {
        // x⁴ at zero, from the derivatives of its means with respect to their number: of 9 samples each.
        let mean = |x: f64| (-4..=4).map(|i| (x + f64::from(i)).powi(4)).sum::<f64>() / 9.0;
        let factors = deconvolution::<3>(9);
        // Differences of means of x⁴ over nine samples, exact for degree four: second and fourth.
        let at = |number: f64| mean(9.0 * number);
        let fourth = at(2.0) - 4.0 * at(1.0) + 6.0 * at(0.0) - 4.0 * at(-1.0) + at(-2.0);
        let second = at(1.0) - 2.0 * at(0.0) + at(-1.0) - fourth / 12.0;
        let value = factors[0] * at(0.0) + factors[1] * second + factors[2] * fourth;
        assert!(value.abs() < 1e-10 * fourth, "{value}");
    }

    #[test]
    fn the_polynomials_of_a_basis_are_the_means_of_others() {
        let (length, degrees, step) = (97, 16, 9);
        let basis = Basis::new(length, degrees).expect("little memory");
        let polynomials = AtCentre::new(&basis, step).polynomials(degrees);
        for mean in [0, 7, 48, 90, 96] {
            for (degree, row) in polynomials.iter().enumerate() {
                let at = |sample: i32| {
                    let values = basis.evaluate(basis.position(mean) + f64::from(sample) / 9.0, 0);
                    row.iter().zip(values).map(|(factor, value)| factor * value).sum::<f64>()
                };
                let found = (-4..=4).map(at).sum::<f64>() / 9.0;
                // Degree 15 in Taylor's series about the centre: some five digits of what the means take off, a tenth at the ends.
                assert!((found - basis.value(degree, mean)).abs() < 1e-11, "{degree} at {mean}");
            }
        }
    }
}
