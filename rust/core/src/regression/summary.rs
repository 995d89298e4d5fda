//! Summaries of rows: the triangular factor of their QR decomposition and what standard errors need, eight windows at
//! once.
//!
//! A row holds, in this order: the windowed regressors, their companions if they may grow linearly within the window,
//! the constant regressors, and the right-hand side. Summaries are only merged, never subtracted, so a sum over
//! millions of rows and a window next to a glitch keep their digits.

use crate::regression::layout::{Layout, symmetric, triangle};
use crate::simd::f64x8::Packet;

/// Adds rows to a factor by Householder reflections. `rows` holds them one after another and is overwritten.
///
/// If `triangular`, row `i` is zero before column `i`.
#[inline(always)]
pub(crate) fn absorb(layout: Layout, factor: &mut [Packet], rows: &mut [Packet], count: usize, triangular: bool) {
    let columns = layout.columns();
    for j in 0..columns {
        let active = if triangular { (j + 1).min(count) } else { count };
        let pivot = factor[layout.entry(j, j)];
        let mut below = Packet::ZERO;
        for i in 0..active {
            let value = rows[i * columns + j];
            below += value * value;
        }
        let squared = pivot * pivot + below;
        // The sign of the new pivot avoids cancellation.
        let turned = -squared.sqrt().with_sign_of(pivot);
        let head = pivot - turned;
        let weight = (squared - turned * pivot).inverse_or_zero();
        factor[layout.entry(j, j)] = turned;
        for k in j + 1..columns {
            let entry = layout.entry(j, k);
            let mut sum = head * factor[entry];
            for i in 0..active {
                sum += rows[i * columns + j] * rows[i * columns + k];
            }
            let sum = sum * weight;
            factor[entry] -= sum * head;
            for i in 0..active {
                let value = rows[i * columns + j];
                rows[i * columns + k] -= sum * value;
            }
        }
    }
}

/// Counts a row, at a time after the summary's origin.
#[inline(always)]
pub(crate) fn count(layout: Layout, summary: &mut [Packet], usable: Packet, time: f64) {
    let sums = layout.sums();
    summary[sums] += usable;
    summary[sums + 1] += usable * Packet::splat(time);
    summary[sums + 2] += usable * Packet::splat(time * time);
}

/// Adds a summary whose rows begin `later` seconds after this one's. `rows` is scratch memory for as many rows as there are columns.
#[inline(always)]
pub(crate) fn merge(layout: Layout, summary: &mut [Packet], other: &[Packet], later: f64, rows: &mut [Packet]) {
    let columns = layout.columns();
    for i in 0..columns {
        for j in i..columns {
            rows[i * columns + j] = other[layout.entry(i, j)];
        }
    }
    let shift = Packet::splat(later);
    if layout.linear {
        for regressor in 0..layout.windowed {
            for i in 0..=regressor {
                let value = rows[i * columns + regressor];
                rows[i * columns + layout.windowed + regressor] += shift * value;
            }
        }
    }
    absorb(layout, summary, rows, columns, true);
    let mut moved = [Packet::ZERO; 3];
    moved.copy_from_slice(&other[layout.sums()..layout.noise()]);
    move_sums(&mut moved, shift);
    for (sum, more) in summary[layout.sums()..layout.noise()].iter_mut().zip(moved) {
        *sum += more;
    }
    for i in 0..layout.local() {
        for j in 0..=i {
            summary[layout.noise() + symmetric(i, j)] += moved_noise(layout, other, shift, i, j);
        }
    }
}

/// Moves the origin of a summary's times by `later` seconds.
#[inline(always)]
pub(crate) fn recentre(layout: Layout, summary: &mut [Packet], later: f64, noise: &mut [Packet]) {
    let shift = Packet::splat(-later);
    for i in 0..layout.local() {
        for j in 0..=i {
            noise[symmetric(i, j)] = moved_noise(layout, summary, shift, i, j);
        }
    }
    summary[layout.noise()..layout.size()].copy_from_slice(&noise[..triangle(layout.local())]);
    if layout.linear {
        for regressor in 0..layout.windowed {
            for i in 0..=regressor {
                let value = summary[layout.entry(i, regressor)];
                summary[layout.entry(i, layout.windowed + regressor)] += shift * value;
            }
        }
    }
    move_sums(&mut summary[layout.sums()..layout.noise()], shift);
}

#[inline(always)]
fn move_sums(sums: &mut [Packet], shift: Packet) {
    let (count, times) = (sums[0], sums[1]);
    sums[1] += shift * count;
    sums[2] += shift * (times + times + shift * count);
}

/// An entry of the noise after all companions got `shift` times their regressor.
#[inline(always)]
fn moved_noise(layout: Layout, summary: &[Packet], shift: Packet, i: usize, j: usize) -> Packet {
    let at = |i: usize, j: usize| summary[layout.noise() + symmetric(i, j)];
    let q = layout.windowed;
    match (i >= q, j >= q) {
        (false, false) => at(i, j),
        (true, false) => at(i, j) + shift * at(i - q, j),
        (false, true) => at(i, j) + shift * at(i, j - q),
        (true, true) => at(i, j) + shift * (at(i - q, j) + at(i, j - q)) + shift * shift * at(i - q, j - q),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::regression::simulated::{assert_near, products, random};

    const LAYOUT: Layout = Layout { windowed: 1, linear: true, constant: 1 };
    /// Householder reflections of some dozen rows.
    const ROUNDING: f64 = 1e-13;

    /// Columns of rows whose times count from some second: value, companion, constant, right-hand side.
    fn columns(rows: std::ops::Range<usize>, from: f64) -> Vec<Vec<f64>> {
        let column = |seed| random(seed, 64)[rows.clone()].to_vec();
        let value: Vec<f64> = column(1);
        let times = rows.clone().map(|row| row as f64 - from);
        let companion =
            column(2).iter().zip(&value).zip(times).map(|((own, value), time)| own + time * value).collect();
        vec![value, companion, column(3), column(4)]
    }

    /// The summary of rows, the noise being twice the products of the local columns.
    fn summary(rows: std::ops::Range<usize>, from: f64) -> Vec<Packet> {
        let columns = columns(rows.clone(), from);
        let mut found = vec![Packet::ZERO; LAYOUT.size()];
        let mut scratch: Vec<Packet> =
            (0..rows.len()).flat_map(|row| columns.iter().map(move |one| Packet::splat(one[row]))).collect();
        absorb(LAYOUT, &mut found, &mut scratch, rows.len(), false);
        for row in rows {
            count(LAYOUT, &mut found, Packet::ONE, row as f64 - from);
        }
        let products = products(&columns);
        for i in 0..2 {
            for j in 0..=i {
                found[LAYOUT.noise() + symmetric(i, j)] = Packet::splat(2.0 * products[i][j]);
            }
        }
        found
    }

    /// What a summary says of the rows, whatever the signs of its factor. Times counted from another second before: what is left of their products
    /// carries the rounding of what these were. Of times on both sides of that second little is left as well.
    fn assert_is_of(found: &[Packet], rows: std::ops::Range<usize>, from: f64, before: f64) {
        let expected = products(&columns(rows.clone(), from));
        let was = products(&columns(rows.clone(), before));
        let sizes: Vec<f64> = (0..4).map(|i| expected[i][i].max(was[i][i])).collect();
        let at = |row: usize, column: usize| if row <= column { found[LAYOUT.entry(row, column)].0[3] } else { 0.0 };
        for (i, expected) in expected.iter().enumerate() {
            for (j, &expected) in expected.iter().enumerate() {
                let product: f64 = (0..4).map(|k| at(k, i) * at(k, j)).sum();
                assert_near(product, expected, ROUNDING * (1.0 + sizes[j] + sizes[i]));
            }
        }
        let powers = |power: i32, from: f64| rows.clone().map(move |row| (row as f64 - from).powi(power));
        let size = |power: i32, from: f64| powers(power, from).map(f64::abs).sum::<f64>();
        for power in 0..3 {
            let place = usize::try_from(power).expect("three sums");
            let (found, expected) = (found[LAYOUT.sums() + place].0[3], powers(power, from).sum::<f64>());
            let most = ROUNDING * (1.0 + size(power, from).max(size(power, before)));
            assert!((found - expected).abs() <= most, "{found}, not {expected}");
        }
        for (i, j) in [(0, 0), (1, 0), (1, 1)] {
            let noise = found[LAYOUT.noise() + symmetric(i, j)].0[3];
            assert_near(noise, 2.0 * expected[i][j], ROUNDING * (1.0 + sizes[1]));
        }
    }

    proptest! {
        #[test]
        fn a_summary_has_the_products_of_its_rows(begin in 0_usize..20, count in 1_usize..40, from in -5.0..50.0) {
            assert_is_of(&summary(begin..begin + count, from), begin..begin + count, from, from);
        }

        #[test]
        fn merging_summaries_is_adding_rows(begin in 0_usize..10, one in 1_usize..25, other in 1_usize..25) {
            let (middle, end) = (begin + one, begin + one + other);
            let mut found = summary(begin..middle, begin as f64);
            let mut scratch = vec![Packet::ZERO; 16];
            merge(LAYOUT, &mut found, &summary(middle..end, middle as f64), one as f64, &mut scratch);
            assert_is_of(&found, begin..end, begin as f64, middle as f64);
        }

        #[test]
        fn times_may_count_from_anywhere(begin in 0_usize..10, count in 1_usize..40, later in -30.0..30.0) {
            let mut found = summary(begin..begin + count, 4.0);
            let mut noise = vec![Packet::ZERO; LAYOUT.size()];
            recentre(LAYOUT, &mut found, later, &mut noise);
            assert_is_of(&found, begin..begin + count, 4.0 + later, 4.0);
        }
    }

    #[test]
    fn rows_of_zeros_change_nothing() {
        let mut found = summary(0..9, 0.0);
        let before: Vec<[f64; 8]> = found.iter().map(|one| one.0).collect();
        absorb(LAYOUT, &mut found, &mut [Packet::ZERO; 8], 2, false);
        for (found, before) in found.iter().zip(before) {
            assert_near(found.0[0].abs(), before[0].abs(), ROUNDING);
        }
    }
}
