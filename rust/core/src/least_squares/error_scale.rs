//! Standard errors of windows from sums over their rows: between the inverses of the normal matrices, and scaled by what sums and fits leave out.

use std::ops::Range;

use crate::least_squares::bandwidth::Bandwidth;
use crate::least_squares::plan::RollingLeastSquares;

/// Windows that are finished together.
pub(crate) const TILE: usize = 256;

/// Windows that keep less of the variance than this beside what their fit takes have no standard error.
const LEAST_LEFT: f64 = 0.05;

/// Makes standard errors of the sums over windows.
pub(crate) struct ErrorScale<'a> {
    plan: &'a RollingLeastSquares,
    /// What is above the diagonal of the inverse of every window's normal matrix, row by row; the diagonal is where errors are to be.
    normal: &'a [Vec<f64>],
    /// Rows of the record.
    total: usize,
    correlated: f64,
    /// One over the roots of what the sums of neighbours keep of the variance, by regressor.
    kept: Vec<f64>,
    /// For a window all of whose rows count.
    whole: f64,
}

impl<'a> ErrorScale<'a> {
    #[inline(always)]
    pub(crate) fn new(
        plan: &'a RollingLeastSquares,
        normal: &'a [Vec<f64>],
        total: usize,
        bandwidth: &Bandwidth,
    ) -> Self {
        let kept = bandwidth.kept.iter().map(|kept| kept.sqrt().recip()).collect();
        let scale = Self { plan, normal, total, correlated: bandwidth.rows as f64, kept, whole: 0.0 };
        let rows = plan.window as f64;
        Self { whole: scale.of(rows, 0.0, rows), ..scale }
    }

    /// Writes the errors of some windows, where the diagonals of their normal matrices are, from the sums of squares of each. `counts` are the
    /// rows that count before each row from a first one on.
    #[inline(always)]
    pub(crate) fn write<'c>(
        &self,
        rows: Range<usize>,
        sums: &[[f64; TILE]],
        counts: (isize, &[u32]),
        errors: impl Iterator<Item = &'c mut [f64]>,
    ) {
        let (p, kept) = (self.plan.regressors, &self.kept);
        let mut scale = [0.0; TILE];
        for (scale, row) in scale.iter_mut().zip(rows.clone()) {
            *scale = self.of_window(row, counts);
        }
        let normal = |i: usize, k: usize| {
            let (i, k) = (i.min(k), i.max(k));
            &self.normal[i * (2 * p - i - 1) / 2 + k - i - 1][rows.clone()]
        };
        for (a, into) in errors.enumerate() {
            let row_of_normal = |k: usize| if k == a { &*into } else { normal(a, k) };
            let mut variance = [0.0; TILE];
            for b in 0..p {
                let mut inner = [0.0; TILE];
                for c in 0..p {
                    let kept = kept[b] * kept[c];
                    let (i, k) = (b.min(c), b.max(c));
                    let sum = &sums[i * p - i * i.saturating_sub(1) / 2 + k - i];
                    for ((inner, of), sum) in inner.iter_mut().zip(row_of_normal(c)).zip(sum) {
                        *inner += kept * of * sum;
                    }
                }
                for ((variance, of), inner) in variance.iter_mut().zip(row_of_normal(b)).zip(&inner) {
                    *variance += of * inner;
                }
            }
            for ((error, variance), scale) in into.iter_mut().zip(&variance).zip(&scale) {
                // Where there are no parameters there is no error, and it stays NaN.
                *error = (scale * variance).sqrt() + 0.0 * *error;
            }
        }
    }

    /// What the sum over the window of a row is to be multiplied by.
    #[inline(always)]
    fn of_window(&self, row: usize, (begin, counts): (isize, &[u32])) -> f64 {
        let plan = self.plan;
        let first = row.cast_signed() - plan.before.cast_signed();
        let end = first + plan.window.cast_signed();
        let there = first.max(0)..end.min(self.total.cast_signed());
        let at = |row: isize| (row - begin).unsigned_abs();
        let count = counts[at(there.end)] - counts[at(there.start)];
        if count as usize == plan.window {
            return self.whole;
        }
        // Sums that reach out of a window are left out, but for those over an end of the record, of which a part is there.
        let over = |rows: isize| {
            let rows = (rows as f64).min(self.correlated - 1.0);
            rows * (1.0 - (rows + 1.0) / (2.0 * self.correlated))
        };
        let outside = over(there.start - first) + over(end - there.end);
        self.of((there.end - there.start) as f64, outside, f64::from(count))
    }

    /// The same for a window that spans so many rows, beside sums over the ends that are partly there, of which so many count.
    #[inline(always)]
    fn of(&self, spanned: f64, outside: f64, count: f64) -> f64 {
        let complete = spanned - self.correlated + 1.0 + outside;
        // What fits take of the sums of neighbours: of one row the part p / w, of B rows about (B + p - 1) / w.
        let left = 1.0 - (self.correlated + self.plan.regressors as f64 - 1.0) / count;
        if left < LEAST_LEFT || complete <= 0.0 { f64::NAN } else { spanned / (complete * self.correlated * left) }
    }
}
