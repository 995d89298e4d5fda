//! Standard errors of windows from sums over their rows: between the inverses of the normal matrices, and scaled by what sums and fits leave out.

use std::ops::Range;

use crate::least_squares::bandwidth::Bandwidth;
use crate::least_squares::givens_factor::MOST_REGRESSORS;
use crate::least_squares::plan::RollingLeastSquares;

/// Windows that are finished together.
pub(crate) const TILE: usize = 256;

/// Windows whose numbers stay in registers until they are finished.
const AT_ONCE: usize = 8;

/// Windows that keep less of the variance than this beside what their fit takes have no standard error.
const LEAST_LEFT: f64 = 0.05;

/// Some numbers from a place on; zero beyond the last.
#[inline(always)]
fn some(numbers: &[f64], first: usize) -> [f64; AT_ONCE] {
    let rest = &numbers[first..];
    rest.first_chunk().copied().unwrap_or_else(|| {
        let mut some = [0.0; AT_ONCE];
        some[..rest.len()].copy_from_slice(rest);
        some
    })
}

/// Makes standard errors of the sums over windows.
pub(crate) struct ErrorScale<'a> {
    plan: &'a RollingLeastSquares,
    /// What is above the diagonal of the inverse of every window's normal matrix, row by row; the diagonal is where errors are to be.
    normal: &'a [&'a [f64]],
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
        normal: &'a [&'a [f64]],
        total: usize,
        bandwidth: &Bandwidth,
    ) -> Self {
        let kept = bandwidth.kept.iter().map(|kept| kept.sqrt().recip()).collect();
        let scale = Self { plan, normal, total, correlated: bandwidth.rows as f64, kept, whole: 0.0 };
        let rows = plan.window as f64;
        Self { whole: scale.of(rows, 0.0, rows), ..scale }
    }

    /// Writes the errors of some windows, where the diagonals of their normal matrices are, from the sums of squares of each. `counts` are the
    /// rows that count before each row from a first one on. There are `R` regressors, or zero where the compiler does not know how many.
    #[inline(always)]
    pub(crate) fn write<'c, const R: usize>(
        &self,
        rows: Range<usize>,
        sums: &[[f64; TILE]],
        counts: (isize, &[u32]),
        errors: impl Iterator<Item = &'c mut [f64]>,
    ) {
        let p = if R == 0 { self.plan.regressors } else { R };
        let kept = &self.kept[..p];
        let mut scale = [0.0; TILE];
        for (scale, row) in scale.iter_mut().zip(rows.clone()) {
            *scale = self.of_window(row, counts);
        }
        let normal = |i: usize, k: usize| {
            let (i, k) = (i.min(k), i.max(k));
            &self.normal[i * (2 * p - i - 1) / 2 + k - i - 1][rows.clone()]
        };
        for (a, into) in errors.enumerate() {
            for first in (0..into.len().min(TILE)).step_by(AT_ONCE) {
                let mut of_normal = [[0.0; AT_ONCE]; MOST_REGRESSORS];
                for (k, of) in of_normal[..p].iter_mut().enumerate() {
                    *of = some(if k == a { into } else { normal(a, k) }, first);
                }
                let mut variance = [0.0; AT_ONCE];
                for b in 0..p {
                    let mut inner = [0.0; AT_ONCE];
                    for c in 0..p {
                        let kept = kept[b] * kept[c];
                        let (i, k) = (b.min(c), b.max(c));
                        let sum = &sums[i * p - i * i.saturating_sub(1) / 2 + k - i][first..first + AT_ONCE];
                        for ((inner, of), sum) in inner.iter_mut().zip(&of_normal[c]).zip(sum) {
                            *inner += kept * of * sum;
                        }
                    }
                    for ((variance, of), inner) in variance.iter_mut().zip(&of_normal[b]).zip(&inner) {
                        *variance += of * inner;
                    }
                }
                for ((error, variance), scale) in into[first..].iter_mut().zip(&variance).zip(&scale[first..]) {
                    // Where there are no parameters there is no error, and it stays NaN.
                    *error = (scale * variance).sqrt() + 0.0 * *error;
                }
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
