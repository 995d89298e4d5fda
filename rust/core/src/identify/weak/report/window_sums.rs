//! Sums over windows of neighbouring rows, in which nothing is ever subtracted.

/// Sums over windows of up to `span` rows: a window is the end of one block of rows and the beginning of the next.
///
/// Differences of one running sum would lose what is small for good after a single large number: `1e16 + 1 - 1e16` is 0.
pub(crate) struct WindowSums<const N: usize> {
    span: usize,
    /// From the beginning of the block to before a row, and from a row to the end of its block.
    before: Vec<[f64; N]>,
    from: Vec<[f64; N]>,
}

impl<const N: usize> WindowSums<N> {
    pub(crate) fn new(rows: Vec<[f64; N]>, span: usize) -> Self {
        let span = span.max(1);
        let mut before = Vec::with_capacity(rows.len() + 1);
        for block in rows.chunks(span) {
            let mut sum = [0.0; N];
            for row in block {
                before.push(sum);
                sum = plus(sum, *row);
            }
        }
        before.push(match rows.chunks(span).next_back() {
            Some(last) if last.len() < span => last.iter().fold([0.0; N], |sum, row| plus(sum, *row)),
            _ => [0.0; N],
        });
        let mut from = rows;
        for block in from.chunks_mut(span) {
            for row in (1..block.len()).rev() {
                block[row - 1] = plus(block[row - 1], block[row]);
            }
        }
        Self { span, before, from }
    }

    /// The sum over the rows of the window around a row; at the ends of the record over those that there are.
    pub(crate) fn around(&self, row: usize) -> [f64; N] {
        let rows = self.from.len();
        let first = row.saturating_sub(self.span / 2).min(rows);
        let end = (row + self.span.div_ceil(2)).min(rows);
        let block = end - end % self.span;
        match first {
            _ if first >= end => [0.0; N],
            _ if first == block => self.before[end],
            // Only at the end of the record does a window end within the block that it begins in.
            _ if first > block => self.from[first],
            _ => plus(self.from[first], self.before[end]),
        }
    }
}

fn plus<const N: usize>(one: [f64; N], other: [f64; N]) -> [f64; N] {
    std::array::from_fn(|place| one[place] + other[place])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_window_holds_its_rows() {
        for count in 0..40 {
            let rows: Vec<[f64; 2]> = (0..count).map(|row| [f64::from(row * row + 1), 1.0]).collect();
            for span in 0..45 {
                let sums = WindowSums::new(rows.clone(), span);
                let span = span.max(1);
                for row in 0..rows.len() + 3 {
                    let end = (row + span.div_ceil(2)).min(rows.len());
                    let window = &rows[row.saturating_sub(span / 2).min(end)..end];
                    let expected = window.iter().fold([0.0; 2], |sum, row| plus(sum, *row));
                    assert_eq!(sums.around(row), expected, "{count} {span} {row}");
                }
            }
        }
    }

    #[test]
    fn a_large_number_is_in_the_sums_of_its_windows_only() {
        let mut rows = [[1.0]; 100];
        rows[30] = [1e16];
        let sums = WindowSums::new(rows.to_vec(), 9);
        for row in (0..26).chain(35..96) {
            assert_eq!(sums.around(row)[0], (row + 5).min(9) as f64, "{row}");
        }
    }
}
