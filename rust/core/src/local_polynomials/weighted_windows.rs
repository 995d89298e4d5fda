//! Polynomials of windows that share no basis, side by side: orthogonal on the samples that each window holds, with their weights.
//!
//! With `⟨p, q⟩ = Σ w p q` over a window's samples,
//!
//! ```text
//! p_{j+1}(t) = (t - a_j) p_j(t) - (s_j / s_{j-1}) p_{j-1}(t),   s_j = ⟨p_j, p_j⟩,   a_j = ⟨t p_j, p_j⟩ / s_j,   p_0 = 1
//! ```
//!
//! (Stieltjes 1884), and the samples lose the part of each polynomial before that of the next is taken (modified Gram-Schmidt), so that
//! their noise is told beside any motion. In exact arithmetic all polynomials are orthogonal. How much rounding they lose of that follows
//! from the same numbers (Simon 1984, The Lanczos algorithm with partial reorthogonalization). Where few samples hold nearly all the weight,
//! or orders come near the number of samples, it is too much: then every polynomial is made orthogonal to all before it, twice.

use crate::local_polynomials::weighted_samples::{MOST, WeightedMemory, WeightedSamples, numbers, numbers_of};
use crate::local_polynomials::window_recurrence::Recurrence;
use crate::simd::vectors::{Kernel, Lanes};

/// Products of two polynomials of length 1 are taken for zero up to this.
const ORTHOGONAL: f64 = 1e-12;

/// Windows, one a lane: at most as many as there are lanes.
pub(crate) struct OwnWindows<'a> {
    pub(crate) memory: &'a mut WeightedMemory,
    pub(crate) windows: &'a [WeightedSamples<'a>],
    /// Polynomials, at most.
    pub(crate) degrees: usize,
    /// The highest derivative that is wanted.
    pub(crate) derivatives: usize,
    /// A polynomial ends the window's where so much of its square is left, or less, once those before it are taken off.
    pub(crate) dependent: f64,
    /// Every polynomial is made orthogonal to all before it, twice.
    pub(crate) twice: bool,
}

/// What is told apart of polynomials where samples count alike, and where some may hardly count or are missing.
pub(crate) const DEPENDENT: f64 = 1e-26;
pub(crate) const HARDLY_THERE: f64 = 1e-12;

impl Kernel for OwnWindows<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let degrees = self.degrees.clamp(1, MOST);
        self.memory.interleave(simd, self.windows, if self.twice { degrees } else { 2 });
        let mut found = Recurrence::begin(simd, self.memory, self.windows);
        let most = numbers_of(simd, self.windows, |window| window.most as f64);
        let dependent = simd.splat_f64s(self.dependent);
        for degree in 1..degrees {
            let (sums, whole) = if self.twice {
                found.make_twice(simd, self.memory, degree)
            } else {
                found.make(simd, self.memory, degree)
            };
            let is_there = simd.less_than_f64s(simd.splat_f64s(degree as f64), most);
            let is_told = found.end(simd, degree, &sums, simd.mul_f64s(whole, dependent), is_there);
            if !self.twice {
                found.lose(simd, degree, is_told);
            }
        }
        found.take_last(simd, self.memory, degrees, self.twice);
        self.collect(simd, degrees, &found);
    }
}

impl OwnWindows<'_> {
    /// What was found, lane by lane.
    #[inline(always)]
    fn collect<S: Lanes>(self, simd: S, degrees: usize, found: &Recurrence<S>) {
        let (lanes, rows) = (S::F64_LANES, self.derivatives + 1);
        let time = numbers_of(simd, self.windows, |window| window.at);
        found.at(simd, degrees, rows, time, self.memory, self.twice);
        let [columns, unit, weight, energy, left, worst] =
            [found.columns, found.unit, found.squares[0], found.energy, found.left, found.orthogonal.worst]
                .map(|vector| numbers(simd, vector));
        let WeightedMemory { derivatives, found: all, .. } = self.memory;
        for (lane, one) in all[..self.windows.len()].iter_mut().enumerate() {
            one.columns = (0..degrees).take_while(|&column| (column as f64) < columns[lane]).count();
            (one.unit, one.weight, one.energy, one.left) = (unit[lane], weight[lane], energy[lane], left[lane]);
            one.orthogonal = worst[lane] <= ORTHOGONAL;
            one.derivatives.resize(rows, [0.0; MOST]);
        }
        for degree in 0..degrees {
            let length = simd.sqrt_f64s(found.squares[degree]);
            let projections = numbers(simd, simd.mul_f64s(found.coefficients[degree], length));
            let shorter = simd.mul_f64s(length, found.inverse[degree]);
            for (one, projection) in all.iter_mut().zip(projections) {
                one.projections[degree] = projection;
            }
            for derivative in 0..rows {
                let value = simd.load(derivatives, (derivative * MOST + degree) * lanes);
                let values = numbers(simd, simd.mul_f64s(value, shorter));
                for (one, value) in all[..self.windows.len()].iter_mut().zip(values) {
                    one.derivatives[derivative][degree] = value;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use faer::Mat;
    use faer::linalg::solvers::Qr;

    use super::*;
    use crate::local_polynomials::weighted_samples::OwnPolynomials;
    use crate::simd::instructions::Instructions;
    use crate::simd::vectors::dispatch;

    /// Twice the value of a polynomial of degree 5, and its derivatives.
    fn truth(time: f64) -> [f64; 3] {
        let first = 3.0 - 4.0 * time + 5.0 * time.powi(4);
        [3.0 * time - 2.0 * time.powi(2) + time.powi(5), first, -4.0 + 20.0 * time.powi(3)]
    }

    /// Times of windows of a length; weights that hardly differ, are zero for many, reach over many decades, and hold a few samples only.
    fn cases(length: usize) -> Vec<(Vec<f64>, Vec<f64>)> {
        let wave = |place: usize| (1.7 * place as f64).sin();
        let times = |jitter: f64| -> Vec<f64> {
            let half = (length - 1) as f64 / 2.0;
            (0..length).map(|place| (place as f64 + jitter * wave(place)) / half - 1.0).collect()
        };
        let weights: [&dyn Fn(usize) -> f64; 4] = [
            &|place| 1.0 + 0.5 * wave(place),
            &|place| if place > length / 3 || place % 3 == 0 { 1.0 } else { 0.0 },
            &|place| (9.0 * wave(place)).exp(),
            &|place| if place % (length / 7) == 0 { 1.0 } else { 1e-9 },
        ];
        let of = |weight: &&dyn Fn(usize) -> f64| (0..length).map(weight).collect::<Vec<f64>>();
        weights.iter().map(of).enumerate().map(|(case, weights)| (times(0.4 * (case % 2) as f64), weights)).collect()
    }

    fn found(cases: &[(Vec<f64>, Vec<f64>)], instructions: Instructions, twice: bool) -> Vec<OwnPolynomials> {
        let values: Vec<Vec<f64>> =
            cases.iter().map(|(times, _)| times.iter().map(|time| truth(*time)[0]).collect()).collect();
        let windows: Vec<WeightedSamples<'_>> = (cases.iter().zip(&values))
            .map(|((times, weights), values)| WeightedSamples {
                times,
                weights,
                values,
                reference: 0.5,
                at: 0.3,
                most: weights.iter().filter(|weight| **weight > 0.0).count(),
            })
            .collect();
        let mut memory = WeightedMemory::default();
        let mut all = Vec::new();
        for windows in windows.chunks(instructions.lanes()) {
            dispatch(
                instructions,
                OwnWindows {
                    memory: &mut memory,
                    windows,
                    degrees: 12,
                    derivatives: 2,
                    dependent: HARDLY_THERE,
                    twice,
                },
            );
            all.extend_from_slice(&memory.found[..windows.len()]);
        }
        all
    }

    #[test]
    fn a_polynomial_and_its_derivatives_are_found_whatever_the_weights_are() {
        for length in [19, 51, 201] {
            let cases = cases(length);
            for (instructions, twice) in
                Instructions::available().into_iter().flat_map(|one| [(one, false), (one, true)])
            {
                for (case, one) in found(&cases, instructions, twice).iter().enumerate() {
                    if !one.orthogonal {
                        assert!(!twice && (case > 1 || length < 20), "{length}, case {case}");
                        continue;
                    }
                    let what = format!("{length}, case {case}, {instructions:?}, {twice}");
                    assert!(one.columns > 5, "{what}");
                    assert!(one.left < 1e-24 * one.energy, "{what}: {}", one.left);
                    for (row, (truth, level)) in one.derivatives.iter().zip(truth(0.3).into_iter().zip([0.5, 0.0, 0.0]))
                    {
                        let sum: f64 = row[..6].iter().zip(&one.projections).map(|(row, part)| row * part).sum();
                        // Few samples hold nearly all the weight of the last case: what they do not tell is rounding over the others' roots.
                        let tolerance = if case == 3 { 1e-7 } else { 1e-10 };
                        assert!((sum + level - truth).abs() < tolerance, "{what}: {} {truth}", sum + level);
                    }
                    assert!(one.projections[6..one.columns].iter().all(|part| part.abs() < 1e-11), "{what}");
                }
            }
        }
    }

    /// Coefficients by the QR decomposition of the window's design, and the sum of the squares that it leaves.
    fn by_qr(times: &[f64], weights: &[f64], values: &[f64], degrees: usize) -> (Vec<f64>, f64) {
        // Chebyshev polynomials, and then the values.
        let polynomials = |time: f64| {
            let two = move |(last, before): &(f64, f64)| Some((2.0 * time * last - before, *last));
            std::iter::successors(Some((1.0, time)), two).map(|(last, _)| last)
        };
        let rows = Mat::from_fn(times.len(), degrees + 1, |row, column| {
            let value = if column < degrees { polynomials(times[row]).nth(column) } else { Some(values[row]) };
            weights[row].sqrt() * value.unwrap_or(0.0)
        });
        let factor = Qr::new(rows.as_ref()).thin_R().to_owned();
        let parts = (0..degrees).map(|row| factor[(row, degrees)] * factor[(row, row)].signum()).collect();
        (parts, factor[(degrees, degrees)].powi(2))
    }

    #[test]
    fn coefficients_of_noise_are_those_of_a_qr_decomposition() {
        for (length, degrees) in [(19, 8), (51, 16), (201, 16), (1001, 16)] {
            let cases = cases(length);
            let noise = |place: usize| (1e4 * (0.7 * place as f64).sin()).sin();
            let values: Vec<f64> = (0..length).map(noise).collect();
            for (instructions, twice) in
                Instructions::available().into_iter().flat_map(|one| [(one, false), (one, true)])
            {
                let mut memory = WeightedMemory::default();
                for (times, weights) in &cases[..3] {
                    let (values, most) = (&values[..], degrees);
                    let window = WeightedSamples { times, weights, values, reference: 0.0, at: 0.0, most };
                    let windows = &[window][..];
                    let kernel = OwnWindows {
                        memory: &mut memory,
                        windows,
                        degrees,
                        derivatives: 0,
                        dependent: DEPENDENT,
                        twice,
                    };
                    dispatch(instructions, kernel);
                    let one = &memory.found[0];
                    let weights: Vec<f64> = weights.iter().map(|weight| weight * one.unit).collect();
                    let (parts, left) = by_qr(times, &weights, values, degrees);
                    // Rounding of the samples, of which there are so many, beside what orthogonality may lack.
                    let tolerance = if one.orthogonal { 1e-11 * one.energy.sqrt() } else { 1e-6 * one.energy.sqrt() };
                    for (part, own) in parts.iter().zip(&one.projections) {
                        assert!((part - own).abs() < tolerance, "{length}, {instructions:?}, {twice}: {own} {part}");
                    }
                    assert!((one.left - left).abs() < tolerance * left.sqrt(), "{length}: {} {left}", one.left);
                }
            }
        }
    }

    #[test]
    fn polynomials_end_where_samples_do() {
        let times: Vec<f64> = (0..9).map(|place| f64::from(place) / 4.0 - 1.0).collect();
        let weights: Vec<f64> = (0..9).map(|place| f64::from(u8::from(place < 7))).collect();
        for instructions in Instructions::available() {
            for twice in [false, true] {
                let found = found(&[(times.clone(), weights.clone())], instructions, twice);
                assert_eq!(found[0].columns, 7);
            }
        }
    }
}
