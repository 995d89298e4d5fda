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
