//! Eigenvalues and eigenvectors of a small symmetric matrix, by rotations in turn (Jacobi 1846).

/// Sweeps over all pairs: eight are enough for any matrix of this size, and ten are never needed.
const SWEEPS: usize = 16;

/// Eigenvalues, and eigenvectors as columns, of a symmetric matrix given row by row.
pub(crate) fn symmetric(mut matrix: Vec<f64>, size: usize) -> (Vec<f64>, Vec<f64>) {
    let mut vectors = vec![0.0; size * size];
    for i in 0..size {
        vectors[i * size + i] = 1.0;
    }
    for _ in 0..SWEEPS {
        for p in 0..size {
            for q in p + 1..size {
                let off = matrix[p * size + q];
                if off == 0.0 {
                    continue;
                }
                let ratio = (matrix[q * size + q] - matrix[p * size + p]) / (2.0 * off);
                let tangent = ratio.signum() / (ratio.abs() + ratio.hypot(1.0));
                let cosine = tangent.hypot(1.0).recip();
                let sine = tangent * cosine;
                for k in 0..size {
                    rotate(&mut matrix, k * size + p, k * size + q, cosine, sine);
                }
                for k in 0..size {
                    rotate(&mut matrix, p * size + k, q * size + k, cosine, sine);
                    rotate(&mut vectors, k * size + p, k * size + q, cosine, sine);
                }
            }
        }
    }
    ((0..size).map(|i| matrix[i * size + i]).collect(), vectors)
}

fn rotate(matrix: &mut [f64], one: usize, other: usize, cosine: f64, sine: f64) {
    let (a, b) = (matrix[one], matrix[other]);
    matrix[one] = cosine * a - sine * b;
    matrix[other] = sine * a + cosine * b;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_is_made_of_its_eigenvectors() {
        for size in 1..=8 {
            // Eigenvalues over many orders of magnitude.
            let entry = |i: usize, j: usize| 0.1_f64.powf((i + j) as f64) * ((i * j + i + j) as f64).cos();
            let matrix: Vec<f64> = (0..size * size).map(|k| entry(k / size, k % size)).collect();
            let (values, vectors) = symmetric(matrix.clone(), size);
            for i in 0..size {
                for j in 0..size {
                    let sum = |f: &dyn Fn(usize) -> f64| (0..size).map(f).sum::<f64>();
                    let again = sum(&|k| vectors[i * size + k] * values[k] * vectors[j * size + k]);
                    let unity = sum(&|k| vectors[k * size + i] * vectors[k * size + j]);
                    assert!((again - matrix[i * size + j]).abs() < 1e-14);
                    assert!((unity - f64::from(u8::from(i == j))).abs() < 1e-14);
                }
            }
        }
    }

    #[test]
    fn zeros_stay_zeros() {
        let (values, vectors) = symmetric(vec![0.0; 9], 3);
        assert_eq!((values, vectors), (vec![0.0; 3], vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]));
    }
}
