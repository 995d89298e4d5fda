//! Sums over neighbouring rows of numbers that stand side by side, by blocks: nothing is ever subtracted.

/// Sums of `length` rows from each row on, as a suffix of one block of rows and a prefix of the next. The first block begins with the first
/// row; there must be `length` rows more than there are sums.
#[inline(always)]
pub(crate) fn sliding_sums<const N: usize>(length: usize, rows: &[[f64; N]], sums: &mut [[f64; N]]) {
    for (block, sums) in sums.chunks_mut(length).enumerate() {
        let (here, next) = rows[block * length..].split_at(length);
        sums_of_block(here, next, sums);
    }
}

/// Sums over as many rows as a block has, from the first rows of the block on: `here` are its rows, `next` those after it.
#[inline(always)]
pub(crate) fn sums_of_block<const N: usize>(here: &[[f64; N]], next: &[[f64; N]], sums: &mut [[f64; N]]) {
    let mut suffix = [0.0; N];
    for row in here[sums.len()..].iter().rev() {
        add(&mut suffix, row);
    }
    for (sum, row) in sums.iter_mut().zip(here).rev() {
        add(&mut suffix, row);
        *sum = suffix;
    }
    let mut prefix = [0.0; N];
    for (sum, row) in sums.iter_mut().zip(next) {
        add(sum, &prefix);
        add(&mut prefix, row);
    }
}

#[inline(always)]
fn add<const N: usize>(sum: &mut [f64; N], row: &[f64; N]) {
    for (sum, number) in sum.iter_mut().zip(row) {
        *sum += number;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_slide_over_blocks() {
        for (length, count) in [(1, 7), (4, 16), (5, 1), (3, 20)] {
            let rows: Vec<[f64; 4]> = (0..count + length).map(|row| [row as f64, 1.0, 0.0, -1.0]).collect();
            let mut sums = vec![[f64::NAN; 4]; count];
            sliding_sums(length, &rows, &mut sums);
            for (first, sum) in sums.iter().enumerate() {
                let expected = (first..first + length).map(|row| row as f64).sum::<f64>();
                assert_eq!(*sum, [expected, length as f64, 0.0, -(length as f64)]);
            }
        }
    }
}
