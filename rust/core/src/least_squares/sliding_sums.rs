//! Sums over neighbouring rows of numbers that stand side by side, by blocks: nothing is ever subtracted.

/// Numbers that are added together.
pub(crate) const WIDTH: usize = 8;

/// What a row holds.
pub(crate) type Side<const V: usize> = [[f64; WIDTH]; V];

/// Sums of `length` rows from each row on, as a suffix of one block of rows and a prefix of the next. The first block begins with the first
/// row; there must be `length` rows more than there are sums.
#[inline(always)]
pub(crate) fn sliding_sums<const V: usize>(length: usize, rows: &[Side<V>], sums: &mut [Side<V>]) {
    for (block, sums) in sums.chunks_mut(length).enumerate() {
        let (here, next) = rows[block * length..].split_at(length);
        let mut suffix = [[0.0; WIDTH]; V];
        for row in here[sums.len()..].iter().rev() {
            add(&mut suffix, row);
        }
        for (sum, row) in sums.iter_mut().zip(here).rev() {
            add(&mut suffix, row);
            *sum = suffix;
        }
        let mut prefix = [[0.0; WIDTH]; V];
        for (sum, row) in sums.iter_mut().zip(next) {
            add(sum, &prefix);
            add(&mut prefix, row);
        }
    }
}

#[inline(always)]
fn add<const V: usize>(sum: &mut Side<V>, row: &Side<V>) {
    for (sum, row) in sum.iter_mut().zip(row) {
        for (sum, number) in sum.iter_mut().zip(row) {
            *sum += number;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_slide_over_blocks() {
        for (length, count) in [(1, 7), (4, 16), (5, 1), (3, 20)] {
            let rows: Vec<Side<2>> = (0..count + length).map(|row| [[row as f64; WIDTH], [1.0; WIDTH]]).collect();
            let mut sums = vec![[[f64::NAN; WIDTH]; 2]; count];
            sliding_sums(length, &rows, &mut sums);
            for (first, sum) in sums.iter().enumerate() {
                let expected = (first..first + length).map(|row| row as f64).sum::<f64>();
                assert_eq!((sum[0], sum[1]), ([expected; WIDTH], [length as f64; WIDTH]));
            }
        }
    }
}
