//! Free vibration of few masses: poles and shapes of the generalised eigenproblem, at every time of matrices that change.
//!
//! With `q = φ e^{λt}` the free equation `M q̈ + C q̇ + K q = 0` is `(λ² M + λ C + K) φ = 0`, and with `x = [φ, λφ]`
//! (Tisseur and Meerbergen, The quadratic eigenvalue problem, SIAM Review 43 (2001), equation 3.4)
//!
//! ```text
//! [ 0   I ]       [ I  0 ]
//! [-K  -C ] x = λ [ 0  M ] x
//! ```
//!
//! The lower half of a left vector of this pencil is one of the quadratic problem. Time and matrices are scaled first, so that masses and
//! springs are of the same size (Fan, Lin, Van Dooren, SIAM Journal on Matrix Analysis and Applications 26 (2004)).

use std::num::NonZeroUsize;

use faer::diag::Diag;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::ComputeEigenvectors;
use faer::linalg::gevd::{gevd_real, gevd_scratch};
use faer::linalg::temp_mat_scratch;
use faer::{Mat, MatRef, Par, Spec, c64};

use crate::error::Error;
use crate::exec::pool::{self, Piece, Watch};

/// Imaginary part of a pole, over its magnitude, below which it does not oscillate.
const OVERDAMPED: f64 = 1e-9;

/// Times that are solved together.
const TIMES: usize = 32;

/// Complex vectors for which there is room beside what the eigenproblem asks for.
const VECTORS: usize = 16;

/// A mode that oscillates.
#[derive(Clone, Debug, PartialEq)]
pub struct Mode {
    /// The pole with a positive imaginary part, in rad/s.
    pub pole: c64,
    /// How far every mass moves, up to a factor.
    pub shape: Vec<c64>,
    /// The left vector `l` with `l (λ² M + λ C + K) = 0`, up to a factor: it says how the pole moves with the matrices.
    pub left: Vec<c64>,
}

/// Modes of a system of `masses` at some times, the lowest frequency first; fewer than `masses` where some do not oscillate, none where
/// inertia is singular. Matrices are row-major, one after the other.
///
/// # Errors
/// If there is not the memory, or the watch cancels.
pub fn modes(
    masses: usize,
    inertia: &[f64],
    damping: &[f64],
    stiffness: &[f64],
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<Vec<Vec<Mode>>, Error> {
    let size = (masses * masses).max(1);
    let each = inertia.chunks(size * TIMES).zip(damping.chunks(size * TIMES)).zip(stiffness.chunks(size * TIMES));
    let pieces = each.map(|((m, c), k)| Piece { size: m.len() / size, content: [m, c, k] }).collect();
    let found = pool::map(
        pieces,
        workers,
        || (),
        |[m, c, k], ()| {
            let times = m.chunks_exact(size).zip(c.chunks_exact(size)).zip(k.chunks_exact(size));
            times.map(|((m, c), k)| modes_at([m, c, k], masses)).collect::<Vec<_>>()
        },
        watch,
    )?;
    Ok(found.into_iter().flatten().collect())
}

/// Modes at one time.
fn modes_at(matrices: [&[f64]; 3], masses: usize) -> Vec<Mode> {
    let [inertia, damping, stiffness] = matrices.map(|values| MatRef::from_row_major_slice(values, masses, masses));
    let (mass, spring) = (inertia.norm_max(), stiffness.norm_max());
    let is_finite = matrices.iter().all(|values| values.iter().all(|value| value.is_finite()));
    if !is_finite || mass == 0.0 || spring == 0.0 || is_singular(inertia) {
        return Vec::new();
    }
    // Seconds that are a unit of time.
    let unit = (mass / spring).sqrt();
    let both = 2 * masses;
    let (mut left, mut right) = (Mat::<f64>::zeros(both, both), Mat::<f64>::zeros(both, both));
    for i in 0..masses {
        (left[(i, masses + i)], right[(i, i)]) = (1.0, 1.0);
        for k in 0..masses {
            left[(masses + i, k)] = -stiffness[(i, k)] / spring;
            left[(masses + i, masses + k)] = -damping[(i, k)] / (spring * unit);
            right[(masses + i, masses + k)] = inertia[(i, k)] / mass;
        }
    }
    let (mut real, mut imaginary, mut beta) = (Diag::zeros(both), Diag::zeros(both), Diag::zeros(both));
    let (mut lefts, mut shapes) = (Mat::<f64>::zeros(both, both), Mat::<f64>::zeros(both, both));
    let yes = ComputeEigenvectors::Yes;
    // What faer asks for is not enough for small matrices: vectors of the last step are not counted.
    let vectors = temp_mat_scratch::<c64>(both, VECTORS);
    let mut memory = MemBuffer::new(gevd_scratch::<f64>(both, yes, yes, Par::Seq, Spec::default()).and(vectors));
    let solved = gevd_real(
        left.as_mut(),
        right.as_mut(),
        real.as_mut(),
        imaginary.as_mut(),
        beta.as_mut(),
        Some(lefts.as_mut()),
        Some(shapes.as_mut()),
        Par::Seq,
        MemStack::new(&mut memory),
        Spec::default(),
    );
    if solved.is_err() {
        return Vec::new();
    }
    // Left vectors come transposed, not conjugated.
    let column = |of: &Mat<f64>, first: usize, k: usize| -> Vec<c64> {
        (first..first + masses).map(|i| c64::new(of[(i, k)], of[(i, k + 1)])).collect()
    };
    // Pairs stand side by side, the one with the positive imaginary part first.
    let mut found: Vec<Mode> = (0..both.saturating_sub(1))
        .filter_map(|k| {
            let pole = c64::new(real[k] / beta[k], imaginary[k] / beta[k]) / unit;
            let oscillates = pole.is_finite() && pole.im > OVERDAMPED * pole.norm();
            oscillates.then(|| Mode { pole, shape: column(&shapes, 0, k), left: column(&lefts, masses, k) })
        })
        .collect();
    found.sort_by(|one, other| one.pole.norm().total_cmp(&other.pole.norm()));
    found
}

/// Whether a matrix has no inverse that could be told from rounding.
fn is_singular(matrix: MatRef<'_, f64>) -> bool {
    let Ok(values) = matrix.singular_values() else { return true };
    let (largest, least) = (values.first().copied().unwrap_or(0.0), values.last().copied().unwrap_or(0.0));
    least <= largest * matrix.nrows() as f64 * f64::EPSILON
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: NonZeroUsize = NonZeroUsize::MIN;

    /// What the quadratic problem leaves of a mode's shape and left vector, over the size of its parts.
    fn left_over(mode: &Mode, matrices: [&[f64]; 3], masses: usize) -> f64 {
        let [m, c, k] = matrices;
        let at = |i: usize| mode.pole * mode.pole * m[i] + mode.pole * c[i] + k[i];
        let size = |i: usize| mode.pole.norm_sqr() * m[i].abs() + mode.pole.norm() * c[i].abs() + k[i].abs();
        let largest = (0..masses * masses).map(size).fold(0.0, f64::max);
        let norm = |vector: &[c64]| vector.iter().map(|one| one.norm()).fold(0.0, f64::max);
        let mut most = 0.0_f64;
        for i in 0..masses {
            let shape: c64 = (0..masses).map(|j| at(i * masses + j) * mode.shape[j]).sum();
            let left: c64 = (0..masses).map(|j| mode.left[j] * at(j * masses + i)).sum();
            most = most.max(shape.norm() / norm(&mode.shape)).max(left.norm() / norm(&mode.left));
        }
        most / largest
    }

    #[test]
    fn one_mass_has_the_pole_of_the_textbook() {
        let found = modes(1, &[0.0123], &[0.00825], &[30.0], ONE, &mut |_, _| true).unwrap();
        let (decay, square) = (0.00825 / (2.0 * 0.0123), 30.0 / 0.0123_f64);
        let expected = c64::new(-decay, (square - decay * decay).sqrt());
        assert!((found[0][0].pole - expected).norm() < 1e-13 * expected.norm(), "{:?}", found[0][0].pole);
    }

    #[test]
    fn shapes_and_left_vectors_solve_the_quadratic_problem() {
        // Two masses with a gyroscopic part, so that left vectors are not the shapes; units that lie far apart.
        for scale in [1e-6, 1.0, 1e6] {
            let m = [0.02 * scale, 0.003 * scale, 0.003 * scale, 0.01 * scale];
            let c = [0.02, 0.3, -0.3, 0.05];
            let k = [40.0, -15.0, -10.0, 25.0];
            let found = modes(2, &m, &c, &k, ONE, &mut |_, _| true).unwrap();
            assert_eq!(found[0].len(), 2, "{scale}");
            for mode in &found[0] {
                let rest = left_over(mode, [&m, &c, &k], 2);
                assert!(rest < 1e-13, "{scale}: {rest}");
            }
            assert!(found[0][0].pole.norm() < found[0][1].pole.norm());
        }
    }

    #[test]
    fn no_number_is_given_where_there_is_no_mode() {
        let none = |m: &[f64], c: &[f64], k: &[f64]| modes(1, m, c, k, ONE, &mut |_, _| true).unwrap()[0].is_empty();
        assert!(none(&[1.0], &[3.0], &[1.0]), "overdamped");
        assert!(none(&[1.0], &[0.1], &[-1.0]), "an unstable spring");
        assert!(none(&[0.0], &[0.1], &[1.0]), "without inertia");
        assert!(none(&[f64::NAN], &[0.1], &[1.0]), "unknown");
        let singular = modes(2, &[1.0, 1.0, 1.0, 1.0], &[0.0; 4], &[2.0, 0.0, 0.0, 1.0], ONE, &mut |_, _| true);
        assert!(singular.unwrap()[0].is_empty(), "singular");
    }
}
