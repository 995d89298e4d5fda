//! The colour of a channel's noise, from the coefficients of polynomials in windows of many lengths.
//!
//! As in [`crate::noise::channel`], the highest degrees of a window see noise only. From window to window, each √2 as long as the last, they see
//! lower frequencies, until the signal appears:
//!
//! ```text
//! v_i = mean of c_12² … c_15² in windows of half-width h_i = 8, 10, 12, 17 … n/16,   then degrees 8 … 11, 5 … 7, 3 … 4 and 2,
//! E v_i = Σ_m a_m E_im,   E_im the mean of q_jᵀ Γ_m q_j.
//! ```
//!
//! Noise is white where the four shortest windows agree, which are two octaves of frequency, and a sum of noises does not explain them clearly better. Otherwise the amounts `a_m ≥ 0` of white noise and of
//! first-order noises ([`crate::noise::correlated`]) are fitted to as many `v_i` as they explain, from the shortest window on. Such a sum falls at
//! most with the square of the frequency. A smooth signal falls faster, so it ends the sequence, and it has no part in the noise.
//!
//! Not every rough channel is noise. It is not if its coefficients are not normally distributed: steps are few and large. It is not if its
//! density still rises with the square of the period at the lowest frequencies, as that of a random walk: no window would tell that from motion.

use std::f64::consts::{LN_2, PI};
use std::ops::Range;
use std::sync::Arc;

use faer::linalg::solvers::{Llt, Solve};
use faer::{Mat, Side};

use crate::local_polynomials::basis::Basis;
use crate::local_polynomials::coefficients::{CoefficientScratch, Projected};
use crate::local_polynomials::tables::{Kept, TablesWanted, tables};
use crate::noise::correlated::CorrelatedNoise;
use crate::record::samples::Samples;
use crate::record::subsample::stretches;
use crate::simd::instructions::Instructions;

/// Half-widths of the windows; none is longer than an eighth of the record.
const HALVES: [usize; 15] = [8, 10, 12, 17, 24, 35, 50, 70, 100, 140, 200, 280, 400, 560, 800];
const PART: usize = 16;

/// Degrees that are measured in each, and lower ones in the longest.
const HIGH: Range<usize> = 12..16;
const LOW: [Range<usize>; 4] = [8..12, 5..8, 3..5, 2..3];

/// So many of the shortest windows agree where noise is white; so many at least must be explained by coloured noise.
const WHITE: usize = 4;
pub(crate) const FEWEST: usize = 7;

/// By how much the sum of squared misfits may fall where noise is white: in 1000 records of white noise it fell by 1.1 at most, in records of 2000
/// samples with correlation 0.3 and 0.5 from sample to sample by 7 and 20 at least.
const CLEARLY: f64 = 6.0;

/// The frequency where the density of a first-order noise is half its largest, in radians a sample: this one, and so many half as
/// large, each than the last.
const CORNER: f64 = 1.5;
const OCTAVES: i32 = 11;

/// The corners, as far below the highest frequency as the first of these from zero, of noises that rise towards it: as what comes of differences.
const RISING: usize = 3;

/// The most windows of a length that are used, and in how many stretches.
const MOST_WINDOWS: usize = 1 << 14;
const STRETCHES: usize = 16;

/// What the sum of few noises misses of a spectrum, and how many standard deviations a mean may be away from it.
const MISFIT: f64 = 0.05;
const AWAY: f64 = 3.5;

/// A noise is left out if the sum of squared misfits grows by no more: that of two parameters by Akaike's criterion.
const NEEDED: f64 = 2.0;

/// Kurtosis of a normal distribution is 3. Steps of a record have 10 and more.
const KURTOSIS: f64 = 4.5;
const TAILS: usize = 2;

/// The density may fall by so much in the lowest three octaves: noise of density `1/f` has 8, a random walk 64.
const STEEPEST: f64 = 24.0;

/// How much the density falls in the lowest two octaves and in the next two, where it is `1/f`: four times each. Above its corner a first-order
/// noise falls 8 times and more in the next two, below it hardly in the first.
const FALL: Range<f64> = 2.0..6.5;

/// Rounds of the search for amounts, and what is gained by one more at least.
const ROUNDS: usize = 50;
const CHANGE: f64 = 1e-6;

/// The powers of all noises, by half-width and lowest degree.
static POWERS: Kept<(usize, usize), Arc<[f64]>> = Kept::new();

/// What some degrees of windows of one length measure.
#[derive(Clone)]
pub(crate) struct Statistic {
    /// Of the windows, and the degrees.
    pub(crate) half: usize,
    pub(crate) degrees: Range<usize>,
    /// Angular frequency per sample, about.
    frequency: f64,
    /// Mean of the squared coefficients, relative standard deviation of that mean, and kurtosis of the coefficients.
    power: f64,
    deviation: f64,
    kurtosis: f64,
    /// The power of every noise of variance one: white, then by octave, then those that rise.
    of_noises: Arc<[f64]>,
}

impl Statistic {
    /// Half-width and first degree, which tell what is measured.
    pub(crate) fn key(&self) -> (usize, usize) {
        (self.half, self.degrees.start)
    }

    /// What was measured, beside noises of other powers.
    pub(crate) fn beside(&self, of_noises: Arc<[f64]>) -> Self {
        Self { of_noises, ..self.clone() }
    }
}

/// A noise that explains what is measured.
pub(crate) struct Colour {
    pub(crate) noise: CorrelatedNoise,
    /// The lowest angular frequency per sample at which it was seen.
    pub(crate) lowest: f64,
    /// Whether it explains all that is measured: no signal ends it.
    pub(crate) whole: bool,
}

/// The noise of a channel, whose variance is given for the case that it is white or that its colour cannot be told.
pub fn coloured_noise(record: &dyn Samples, variance: f64, instructions: Instructions) -> CorrelatedNoise {
    let measured = measure(record, variance, instructions);
    let coloured =
        measured.and_then(|measured| coloured(&measured, record.len())).filter(|found| !found.noise.is_white());
    coloured.map_or(CorrelatedNoise::white(variance), |found| found.noise)
}

/// What windows of all lengths measure of a channel; `None` where its noise is white, where it is not noise or the record too short to tell.
pub(crate) fn measure(record: &dyn Samples, variance: f64, instructions: Instructions) -> Option<Vec<Statistic>> {
    let halves: Vec<usize> = HALVES.into_iter().filter(|half| half * PART <= record.len()).collect();
    if halves.len() < FEWEST || variance.is_nan() || variance <= 0.0 {
        return None;
    }
    let mut measured = Vec::new();
    for &half in &halves[..WHITE] {
        measured.extend(look(record, half, &[HIGH], instructions));
    }
    if measured.len() < WHITE || is_white(&measured) || measured[TAILS].kurtosis > KURTOSIS {
        return None;
    }
    for &half in &halves[WHITE..] {
        let longest = half == halves[halves.len() - 1];
        let degrees: Vec<Range<usize>> = std::iter::once(HIGH).chain(LOW.into_iter().filter(|_| longest)).collect();
        measured.extend(look(record, half, &degrees, instructions));
    }
    Some(measured)
}

/// Whether the shortest windows agree, each within chance and all of them together.
fn is_white(measured: &[Statistic]) -> bool {
    explains(measured, &[0]).is_some() && fit(measured, &[0]).0 - missed(measured) <= CLEARLY
}

/// How many of what is measured, from the highest frequencies on, noises explain; `None` where these are too few.
pub(crate) fn explained(measured: &[Statistic]) -> Option<usize> {
    let all = all_noises(measured);
    let counts = WHITE..=measured.len();
    let explained = counts.take_while(|&count| explains(&measured[..count], &all).is_some()).last();
    explained.filter(|&explained| explained >= FEWEST)
}

/// By how much all noises together miss what is measured, squared and summed.
pub(crate) fn missed(measured: &[Statistic]) -> f64 {
    fit(measured, &all_noises(measured)).0
}

fn all_noises(measured: &[Statistic]) -> Vec<usize> {
    (0..measured.first().map_or(0, |one| one.of_noises.len())).collect()
}

/// The noise that explains what is measured of so many samples, from the highest frequencies on, or `None`.
pub(crate) fn coloured(measured: &[Statistic], samples: usize) -> Option<Colour> {
    let explained = explained(measured)?;
    // The last may hold some of the signal that ends the sequence.
    let whole = explained == measured.len();
    let part = &measured[..if whole { explained } else { explained - 1 }];
    let lowest = part[part.len() - 1].frequency;
    let slow = |corner: f64| corner < lowest / if whole { 2.0 } else { 4.0 };
    let octaves: Vec<f64> = corners().collect();
    let is_slow = |noise: usize| noise > 0 && octaves.get(noise - 1).is_some_and(|&corner| slow(corner));
    let mut used: Vec<usize> = all_noises(measured).into_iter().filter(|&noise| !is_slow(noise)).collect();
    let (misfit, mut amounts) = fit(part, &used);
    // Few noises: what scatters at low frequencies would otherwise be taken for a noise of its own.
    loop {
        let without = |place: usize| {
            let mut rest = used.clone();
            rest.remove(place);
            let (misfit, amounts) = fit(part, &rest);
            (misfit, amounts, rest)
        };
        let best = (0..used.len()).map(without).min_by(|a, b| a.0.total_cmp(&b.0));
        match best {
            Some((least, fitted, rest)) if !rest.is_empty() && least <= misfit + NEEDED => {
                used = rest;
                amounts = fitted;
            }
            _ => break,
        }
    }
    let correlations: Vec<f64> = correlations().collect();
    let (mut white, mut first_order) = (0.0, Vec::new());
    for (&one, &amount) in used.iter().zip(&amounts) {
        match one.checked_sub(1) {
            None => white = amount,
            Some(place) if amount > 0.0 => first_order.push((correlations[place], amount)),
            Some(_) => {}
        }
    }
    extend(&mut first_order, white, (lowest, samples));
    let found = CorrelatedNoise::new(white, first_order);
    let steep = found.density(lowest) > STEEPEST * found.density(8.0 * lowest);
    (!(whole && steep)).then_some(Colour { noise: found, lowest, whole })
}

/// Continues noise of density `1/f` to lower frequencies than are measured. The noises of one octave after the other have the same variance `a`
/// then, and the density at `ω` is `π a / (ω ln 2)`. What is slower than the record is an offset.
fn extend(first_order: &mut Vec<(f64, f64)>, white: f64, (lowest, samples): (f64, usize)) {
    let found = CorrelatedNoise::new(white, first_order.clone());
    let density = |octaves: f64| found.density(lowest * octaves.exp2());
    let falls = [density(0.0) / density(2.0), density(2.0) / density(4.0)];
    if !falls.iter().all(|fall| FALL.contains(fall)) {
        return;
    }
    // Few noises make a bumpy line of it.
    let bumps = [0.0, 1.0, 2.0, 3.0].map(|octaves: f64| (density(octaves) * octaves.exp2()).ln());
    let variance = (bumps.iter().sum::<f64>() / 4.0).exp() * lowest * LN_2 / PI;
    let slower = octaves().skip_while(|&corner| corner >= lowest / 2.0);
    let slower = slower.take_while(|corner| corner * samples as f64 >= 1.0);
    first_order.extend(slower.map(|corner| ((-corner).exp(), variance)));
}

/// The corners of first-order noises, and of those that are fitted.
fn octaves() -> impl Iterator<Item = f64> {
    (0..).map(|octave| CORNER * f64::from(-octave).exp2())
}

pub(crate) fn corners() -> impl Iterator<Item = f64> {
    (0..OCTAVES).zip(octaves()).map(|(_, corner)| corner)
}

/// The correlations from sample to sample of the noises that are fitted, those that rise last.
fn correlations() -> impl Iterator<Item = f64> {
    let falling = corners().map(|corner| (-corner).exp());
    falling.chain(corners().take(RISING).map(|corner| -(-corner).exp()))
}

/// Looks at the noise of a record through some degrees of windows of one length.
fn look(record: &dyn Samples, half: usize, groups: &[Range<usize>], instructions: Instructions) -> Vec<Statistic> {
    let length = 2 * half + 1;
    let first = groups.iter().map(|group| group.start).min().unwrap_or(0);
    // Windows are short, and little memory is not asked for.
    let Ok(tables) = tables(TablesWanted { half, highest: HIGH.end - 1, first, step: 1, instructions }) else {
        return Vec::new();
    };
    let plan = tables.coefficients();
    let (mut scratch, mut projected) = (CoefficientScratch::default(), Projected::default());
    let (mut squares, mut fourths) = (vec![0.0; HIGH.end - first], vec![0.0; HIGH.end - first]);
    let (mut windows, mut used) = (0_usize, 0);
    for places in stretches(record.len() + 1 - length, MOST_WINDOWS, STRETCHES) {
        used += places.len() + length;
        plan.project(record, places, 1, &mut projected, &mut scratch);
        windows += projected.level.iter().filter(|level| !level.is_nan()).count();
        for ((row, square), fourth) in projected.coefficients.iter().zip(&mut squares).zip(&mut fourths) {
            let (two, four) = moments(row);
            *square += two;
            *fourth += four;
        }
    }
    if windows == 0 {
        return Vec::new();
    }
    let mean = |sums: &[f64]| sums.iter().sum::<f64>() / (sums.len() * windows) as f64;
    let group = |group: &Range<usize>| {
        let own = group.start - first..group.end - first;
        let power = mean(&squares[own.clone()]);
        let independent = (group.len() * used.min(record.len())) as f64 / length as f64;
        Statistic {
            half,
            degrees: group.clone(),
            frequency: (group.start + group.end + 1) as f64 / 2.0 / half as f64,
            power,
            deviation: (2.0 / independent + MISFIT * MISFIT).sqrt(),
            kurtosis: mean(&fourths[own]) / (power * power),
            of_noises: POWERS.get((half, group.start), half, || powers(&tables.basis, group)),
        }
    };
    groups.iter().map(group).collect()
}

/// The sums of the squares and of the fourth powers of all that are numbers, in eight sums side by side.
fn moments(row: &[f64]) -> (f64, f64) {
    let (mut squares, mut fourths) = ([0.0; 8], [0.0; 8]);
    for some in row.chunks(8) {
        for ((c, square), fourth) in some.iter().zip(&mut squares).zip(&mut fourths) {
            let two = if c.is_nan() { 0.0 } else { c * c };
            *square += two;
            *fourth += two * two;
        }
    }
    (squares.iter().sum(), fourths.iter().sum())
}

/// The mean square of some degrees' coefficients for every noise of variance one.
fn powers(basis: &Basis, degrees: &Range<usize>) -> Arc<[f64]> {
    let rows: Vec<Vec<f64>> =
        degrees.clone().map(|degree| (0..basis.length()).map(|index| basis.value(degree, index)).collect()).collect();
    let of = |noise: CorrelatedNoise| {
        let power = |row: &Vec<f64>| row.iter().zip(noise.correlate(row)).map(|(a, b)| a * b).sum::<f64>();
        rows.iter().map(power).sum::<f64>() / rows.len() as f64
    };
    let first_order = correlations().map(|correlation| of(CorrelatedNoise::new(0.0, vec![(correlation, 1.0)])));
    std::iter::once(1.0).chain(first_order).collect()
}

/// The amounts of some noises, if they explain everything that is measured.
fn explains(measured: &[Statistic], noises: &[usize]) -> Option<Vec<f64>> {
    let amounts = fit(measured, noises).1;
    measured.iter().all(|one| misfit(one, noises, &amounts).abs() <= AWAY).then_some(amounts)
}

/// How far the noises are from what is measured, in standard deviations.
fn misfit(measured: &Statistic, noises: &[usize], amounts: &[f64]) -> f64 {
    let sum: f64 = noises.iter().zip(amounts).map(|(&noise, amount)| amount * measured.of_noises[noise]).sum();
    (sum / measured.power - 1.0) / measured.deviation
}

/// The amounts, none below zero, of least squared misfit, and that misfit: by active sets (Lawson and Hanson 1974, chapter 23).
fn fit(measured: &[Statistic], noises: &[usize]) -> (f64, Vec<f64>) {
    let count = noises.len();
    let column = |&noise: &usize| measured.iter().map(move |one| one.of_noises[noise] / one.power / one.deviation);
    let numbers: Vec<f64> = noises.iter().flat_map(column).collect();
    let column = |i: usize| &numbers[i * measured.len()..(i + 1) * measured.len()];
    let product = |i: usize, j: usize| column(i).iter().zip(column(j)).map(|(a, b)| a * b).sum::<f64>();
    let right = |i: usize| column(i).iter().zip(measured).map(|(a, one)| a / one.deviation).sum::<f64>();
    let right: Vec<f64> = (0..count).map(right).collect();
    // In the unit of what is measured: noises of different memory are of different size.
    let sizes: Vec<f64> = (0..count).map(|i| product(i, i).sqrt()).collect();
    let (mut amounts, mut free) = (vec![0.0; count], Vec::new());
    // The products of all noises with those that were free: few are.
    let mut normal: Vec<Vec<f64>> = vec![Vec::new(); count];
    for _ in 0..ROUNDS {
        let gain = |i: usize| {
            let known: f64 = free.iter().map(|&j: &usize| normal[j][i] * amounts[j]).sum();
            (right[i] - known) / sizes[i]
        };
        let held = (0..count).filter(|i| !free.contains(i)).map(|i| (i, gain(i)));
        let best = held.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|&(_, gain)| gain > CHANGE);
        let Some((next, _)) = best else { break };
        free.push(next);
        if normal[next].is_empty() {
            normal[next] = (0..count).map(|i| product(i, next)).collect();
        }
        while !free.is_empty() {
            let part = Mat::from_fn(free.len(), free.len(), |i, j| normal[free[j]][free[i]]);
            let Ok(factor) = Llt::new(part.as_ref(), Side::Lower) else {
                // Two noises that cannot be told apart here.
                return (squared_misfit(measured, noises, &amounts), amounts);
            };
            let wanted = factor.solve(Mat::from_fn(free.len(), 1, |i, _| right[free[i]]));
            // As far towards these as none goes below zero; the first that would is held.
            let below = free.iter().enumerate().filter(|&(place, _)| wanted[(place, 0)] <= 0.0);
            let share = |(place, &one): (usize, &usize)| (amounts[one] / (amounts[one] - wanted[(place, 0)]), one);
            let first = below.map(share).min_by(|a, b| a.0.total_cmp(&b.0));
            let part = first.map_or(1.0, |(part, _)| part);
            for (place, &one) in free.iter().enumerate() {
                amounts[one] += part * (wanted[(place, 0)] - amounts[one]);
            }
            let Some((_, held)) = first else { break };
            amounts[held] = 0.0;
            free.retain(|&one| one != held);
        }
    }
    (squared_misfit(measured, noises, &amounts), amounts)
}

fn squared_misfit(measured: &[Statistic], noises: &[usize], amounts: &[f64]) -> f64 {
    measured.iter().map(|one| misfit(one, noises, amounts).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::quantisation::tests::uniform;

    #[test]
    fn no_subset_of_the_noises_fits_better() {
        let mut last = 0.0;
        let first_order = |e: f64| {
            last = 0.8 * last + e;
            last
        };
        let record: Vec<f64> = uniform(8000).into_iter().map(first_order).collect();
        let measured = measure(&record.as_slice(), 0.1, Instructions::current()).expect("coloured noise");
        let noises = [0, 1, 2, 3, 5, 9];
        let (least, amounts) = fit(&measured, &noises);
        assert!(amounts.iter().all(|&amount| amount >= 0.0) && amounts.contains(&0.0), "{amounts:?}");
        let misfit_of = |subset: usize| {
            let some: Vec<usize> = (0..noises.len()).filter(|place| subset >> place & 1 == 1).collect();
            let of = |one: &Statistic, place: usize| one.of_noises[noises[place]] / one.power / one.deviation;
            let columns = Mat::from_fn(measured.len(), some.len(), |i, j| of(&measured[i], some[j]));
            let right = Mat::from_fn(measured.len(), 1, |i, _| 1.0 / measured[i].deviation);
            let factor = Llt::new((columns.transpose() * &columns).as_ref(), Side::Lower).ok()?;
            let solved = factor.solve(columns.transpose() * &right);
            let mut amounts = vec![0.0; noises.len()];
            for (row, &place) in some.iter().enumerate() {
                amounts[place] = solved[(row, 0)];
            }
            let possible = amounts.iter().all(|&amount| amount >= 0.0);
            possible.then(|| squared_misfit(&measured, &noises, &amounts))
        };
        let best = (1..1 << noises.len()).filter_map(misfit_of).fold(f64::INFINITY, f64::min);
        assert!((least / best - 1.0).abs() < 1e-6, "{least} {best}");
    }
}
