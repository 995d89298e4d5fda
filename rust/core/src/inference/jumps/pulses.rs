//! Pulses of a windowed coefficient: it changes for a while shorter than windows can follow, as the stiffness of a muscle does, and comes back.
//!
//! With windows that hold no row of the pulse, what is left of the rows over it is the change times a column that follows from the test
//! function `φ`, the signal `θ` and the samples `a` and `b` at which the pulse begins and ends:
//!
//! ```text
//! x(a, b) = Σ_{a ≤ t < b} φ(t - c) θ(t).
//! ```
//!
//! Every pair of samples is tried. Each has the probability that its sum of squares leaves it, so the change at a sample has a mean and a
//! variance that know how well the ends are known.

use std::ops::Range;

use crate::record::samples::{Samples, all_usable};

/// Places that are tried for either end at first.
const MOST_PLACES: usize = 200;

/// Steps around the best pair within which every sample is tried in the end.
const NEAR: usize = 2;

/// Least reduction of the sum of squares by a pulse, over the noise of one independent row, and the largest part of it that may be left.
const SIGNIFICANT: f64 = 40.0;
const LEFT: f64 = 0.25;

/// A pulse that reduces the sum of squares by so much on average is accepted in 19 of 20 cases: (√40 + 1.64)². And places for a length of it.
const SEEN: f64 = 63.4;
const STEPS_OF_PULSE: usize = 4;

/// Pairs so much worse than the best have no probability.
const IMPOSSIBLE: f64 = 40.0;

/// An end lies anywhere within a sample of its place: the share of each of three places, counted from the sample before.
const BETWEEN: [(f64, usize); 3] = [(0.25, 0), (0.5, 1), (0.25, 2)];

/// A pulse of a windowed coefficient.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Pulse {
    /// Its most probable samples.
    pub(crate) samples: Range<usize>,
    /// The first sample at which it may have begun, and from there on the mean of its change and its variance.
    pub(crate) first: usize,
    pub(crate) change: Vec<f64>,
    pub(crate) variance: Vec<f64>,
    /// By how much more it reduces the sum of squares than anything else in its place would, over the noise of one independent row.
    pub(crate) above_others: f64,
}

/// The rows in which pulses are searched.
pub(crate) struct PulseSearch<'a> {
    /// What is left of the rows by windows that hold no row of the pulse, and which rows are equations.
    pub(crate) left: &'a [f64],
    pub(crate) usable: &'a [bool],
    /// What every row was multiplied by; empty where all count alike.
    pub(crate) roots: &'a [f64],
    /// What the coefficient is multiplied by.
    pub(crate) signal: &'a dyn Samples,
    /// What another coefficient is multiplied by that may change in its place.
    pub(crate) others: &'a [&'a dyn Samples],
    /// The test function at its samples.
    pub(crate) function: &'a [f64],
    /// Sample of the first row, and samples from one to the next.
    pub(crate) first: usize,
    pub(crate) stride: usize,
    /// Variance of a row, and how many rows carry the information of an independent one.
    pub(crate) variance: f64,
    pub(crate) inflation: f64,
}

/// The products of the columns of all places with each other and with what is left of the rows.
struct ColumnProducts {
    places: Vec<usize>,
    with_left: Vec<f64>,
    between: Vec<f64>,
}

impl ColumnProducts {
    /// The change of a pulse between two places, by how much it reduces the sum of squares, and the square of its column.
    fn pulse(&self, from: usize, to: usize) -> (f64, f64, f64) {
        let count = self.places.len();
        let square =
            self.between[from * (count + 1)] - 2.0 * self.between[from * count + to] + self.between[to * (count + 1)];
        let product = self.with_left[to] - self.with_left[from];
        if square <= 0.0 { (0.0, 0.0, 0.0) } else { (product / square, product * product / square, square) }
    }

    /// The variance of a change whose pulse begins and ends anywhere between two samples.
    fn between_samples(&self, from: usize, to: usize) -> f64 {
        let last = self.places.len() - 1;
        let slope = |one: (usize, usize), other: (usize, usize)| {
            if one.0 >= one.1 || other.0 >= other.1 {
                return 0.0;
            }
            let samples = (self.places[other.0] - self.places[one.0]) + (self.places[other.1] - self.places[one.1]);
            (self.pulse(other.0, other.1).0 - self.pulse(one.0, one.1).0) / samples.max(1) as f64
        };
        let begin = slope((from.saturating_sub(1), to), ((from + 1).min(last), to));
        let end = slope((from, to - 1), (from, (to + 1).min(last)));
        (begin * begin + end * end) / 12.0
    }

    /// All pairs of places.
    fn pairs(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let count = self.places.len();
        (0..count).flat_map(move |from| (from + 1..count).map(move |to| (from, to)))
    }
}

/// The samples of a row times its test function, summed up.
struct Running {
    begin: usize,
    samples: Vec<f64>,
    sums: Vec<f64>,
}

impl Running {
    fn new(length: usize) -> Self {
        Self { begin: 0, samples: vec![0.0; length], sums: vec![0.0; length + 1] }
    }

    /// Takes a row. Returns whether its signal is all there.
    fn take(&mut self, search: &PulseSearch<'_>, row: usize) -> bool {
        self.begin = search.first + row * search.stride - search.function.len() / 2;
        search.signal.read(self.begin, &mut self.samples);
        let root = search.roots.get(row).copied().unwrap_or(1.0);
        for (place, (factor, sample)) in search.function.iter().zip(&self.samples).enumerate() {
            self.sums[place + 1] = self.sums[place] + root * factor * sample;
        }
        all_usable(&self.samples)
    }

    /// The sum of what lies before a sample.
    fn before(&self, sample: usize) -> f64 {
        self.sums[sample.saturating_sub(self.begin).min(self.samples.len())]
    }
}

impl PulseSearch<'_> {
    /// Stretches of rows that leave more than noise, and those whose test function touches theirs.
    pub(crate) fn conspicuous(&self) -> Vec<Range<usize>> {
        let reach = self.reach();
        // A pulse that is accepted leaves at least half of its squares in the rows around each of its samples.
        let least = SIGNIFICANT / 2.0 * self.variance * self.inflation;
        let squares: Vec<f64> =
            self.left.iter().zip(self.usable).map(|(left, usable)| if *usable { left * left } else { 0.0 }).collect();
        let sum = |row: usize| -> f64 {
            squares[row.saturating_sub(reach)..(row + reach + 1).min(squares.len())].iter().sum()
        };
        let mut found: Vec<Range<usize>> = Vec::new();
        for row in (0..squares.len()).filter(|&row| sum(row) > least) {
            match found.last_mut() {
                Some(last) if last.end + reach >= row => last.end = row + 1,
                _ => found.push(row..row + 1),
            }
        }
        found
    }

    /// Whether most of what stands out in some stretches of rows is in those that a pulse in them would not be accepted for: chance makes one or
    /// two of these in 20 s at 1 kHz, and pulses that are a tenth of the stiffness leave several times as much.
    pub(crate) fn is_chance(&self, over: &[Range<usize>]) -> bool {
        let plain = SIGNIFICANT * self.variance * self.inflation;
        let reach = self.reach();
        let (mut all, mut plainly) = (0.0, 0.0);
        for rows in over {
            let around = rows.start.saturating_sub(reach)..(rows.end + reach).min(self.left.len());
            let squares: f64 = around.filter(|&row| self.usable[row]).map(|row| self.left[row].powi(2)).sum();
            all += squares;
            plainly += if squares > plain { squares } else { 0.0 };
        }
        plainly < 0.5 * all
    }

    /// Rows on either side whose test function touches that of a row.
    fn reach(&self) -> usize {
        (self.function.len() / 2).div_ceil(self.stride)
    }

    /// The pulse in a stretch of rows, or `None` if no pulse explains what is left of them.
    pub(crate) fn within(&self, rows: &Range<usize>) -> Option<Pulse> {
        let (half, reach) = (self.function.len() / 2, self.reach());
        let over = rows.start.saturating_sub(reach)..(rows.end + reach).min(self.left.len());
        let over: Vec<usize> = over.filter(|&row| self.usable[row]).collect();
        let begin = (self.first + rows.start * self.stride).saturating_sub(half);
        let end = (self.first + rows.end * self.stride + half).min(self.signal.len());
        let step = (end - begin).div_ceil(MOST_PLACES).max(1);
        let total: f64 = over.iter().map(|&row| self.left[row] * self.left[row]).sum();
        let mut products = self.products(&over, (begin..end).step_by(step).collect())?;
        let best = |products: &ColumnProducts| {
            let gain = |&(from, to): &(usize, usize)| products.pulse(from, to).1;
            products.pairs().max_by(|one, other| gain(one).total_cmp(&gain(other)))
        };
        let mut pair = best(&products)?;
        if step > 1 {
            let near = |place: usize| {
                let middle = products.places[place];
                middle.saturating_sub(NEAR * step).max(begin)..(middle + NEAR * step + 1).min(end)
            };
            let (from, to) = (near(pair.0), near(pair.1));
            let places = from.clone().chain(to.start.max(from.end)..to.end).collect();
            products = self.products(&over, places)?;
            pair = best(&products)?;
        }
        let (_, gain, _) = products.pulse(pair.0, pair.1);
        let left = (total - gain).max(0.0);
        let noise = self.inflation * self.variance.max(left / over.len() as f64);
        if gain < SIGNIFICANT * noise || left > LEFT * total {
            return None;
        }
        let mut of_others = 0.0_f64;
        for &signal in self.others {
            let other = PulseSearch { signal, ..*self }.products(&over, products.places.clone())?;
            of_others = best(&other).map_or(0.0, |(from, to)| other.pulse(from, to).1).max(of_others);
        }
        let mut pulse = Pulse { above_others: (gain - of_others) / noise, ..Self::pulse(&products, pair, gain, noise) };
        let there = self.signal.len() - pulse.first;
        pulse.change.truncate(there);
        pulse.variance.truncate(there);
        Some(pulse)
    }

    /// The products of the columns that begin at each place and never end, so that a pulse is the difference of two. `None` where the signal
    /// is not all there.
    fn products(&self, over: &[usize], places: Vec<usize>) -> Option<ColumnProducts> {
        let count = places.len();
        let mut running = Running::new(self.function.len());
        let mut products = ColumnProducts { with_left: vec![0.0; count], between: vec![0.0; count * count], places };
        let mut column = vec![0.0; count];
        for &row in over {
            if !running.take(self, row) {
                return None;
            }
            for (value, &place) in column.iter_mut().zip(&products.places) {
                *value = running.before(place);
            }
            for (one, value) in column.iter().enumerate() {
                products.with_left[one] += value * self.left[row];
                let with_others = &mut products.between[one * count..(one + 1) * count];
                with_others.iter_mut().zip(&column).for_each(|(sum, other)| *sum += value * other);
            }
        }
        Some(products)
    }

    /// Samples at which a pulse of a length and a change would hardly be seen: the coefficient is multiplied by next to nothing there, or no row tells.
    pub(crate) fn hidden(&self, length: usize, change: f64) -> Vec<Range<usize>> {
        let step = (length / STEPS_OF_PULSE).max(1);
        // By how much a pulse from every so manieth sample on would reduce the sum of squares.
        let mut squares = vec![0.0; self.signal.len() / step];
        let mut running = Running::new(self.function.len());
        for row in (0..self.usable.len()).filter(|&row| self.usable[row]) {
            if !running.take(self, row) {
                continue;
            }
            let end = running.begin + self.function.len();
            for place in running.begin.saturating_sub(length).div_ceil(step)..end.div_ceil(step).min(squares.len()) {
                squares[place] += (running.before(place * step + length) - running.before(place * step)).powi(2);
            }
        }
        let least = SEEN * self.inflation * self.variance / (change * change);
        let unseen = squares.iter().enumerate().filter(|(_, square)| **square < least);
        unseen.map(|(place, _)| place * step..(place * step + length).min(self.signal.len())).collect()
    }

    /// The pulse whose mean and variance come from all pairs of places.
    fn pulse(products: &ColumnProducts, best: (usize, usize), most: f64, noise: f64) -> Pulse {
        let places = &products.places;
        let (first, end) = (places[0].saturating_sub(1), places[places.len() - 1] + 1);
        let mut moments = vec![[0.0; 2]; end - first + 1];
        let mut all = 0.0;
        for (from, to) in products.pairs() {
            let (change, gain, square) = products.pulse(from, to);
            if most - gain > IMPOSSIBLE * noise || square <= 0.0 {
                continue;
            }
            let weight = (-(most - gain) / (2.0 * noise)).exp();
            all += weight;
            let variance = noise / square + products.between_samples(from, to);
            let both = [weight * change, weight * (change * change + variance)];
            for (share, later) in BETWEEN {
                for (moment, value) in both.into_iter().enumerate() {
                    moments[(places[from] + later).saturating_sub(first + 1)][moment] += share * value;
                    moments[(places[to] + later).saturating_sub(first + 1)][moment] -= share * value;
                }
            }
        }
        let (mut change, mut variance, mut sum) = (Vec::new(), Vec::new(), [0.0; 2]);
        for moment in moments {
            sum = [sum[0] + moment[0], sum[1] + moment[1]];
            let mean = sum[0] / all;
            change.push(mean);
            variance.push((sum[1] / all - mean * mean).max(0.0));
        }
        Pulse { samples: places[best.0]..places[best.1], first, change, variance, above_others: 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::quantisation::tests::uniform;
    use crate::weak_form::test_function::TestFunction;

    const STRIDE: usize = 4;
    const NOISE: f64 = 0.02;

    /// What is left of rows beside a change of the coefficient at some samples, and the pulses that are found in it.
    fn found(change: impl Fn(usize) -> f64) -> Vec<Pulse> {
        let (samples, half) = (4000, 24);
        let signal: Vec<f64> = (0..samples).map(|n| 1.5 + (n as f64 * 0.05).sin()).collect();
        let noise = uniform(samples);
        let function = TestFunction::new(half, 5, 1e-3).unwrap().kernels(0.0).values[2].clone();
        let half = function.len() / 2;
        let rows = (samples - 2 * half) / STRIDE;
        let of = |value: &dyn Fn(usize) -> f64| -> Vec<f64> {
            let row = |row: usize| (0..function.len()).map(|k| function[k] * value(row * STRIDE + k)).sum();
            (0..rows).map(row).collect()
        };
        let left = of(&|n| change(n) * signal[n] + NOISE * 12.0_f64.sqrt() * noise[n]);
        let variance = NOISE * NOISE * function.iter().map(|value| value * value).sum::<f64>();
        let search = PulseSearch {
            left: &left,
            usable: &vec![true; rows],
            roots: &[],
            signal: &signal.as_slice(),
            others: &[],
            function: &function,
            first: half,
            stride: STRIDE,
            variance,
            inflation: 5.0,
        };
        search.conspicuous().iter().filter_map(|rows| search.within(rows)).collect()
    }

    #[test]
    fn pulses_are_found_with_their_ends_and_sizes() {
        for (range, size) in [(1000..1100, 0.8), (2300..2350, -0.5), (3000..3020, 2.0)] {
            let pulses = found(|n| if range.contains(&n) { size } else { 0.0 });
            assert_eq!(pulses.len(), 1, "{range:?}");
            let Pulse { samples, first, change, variance, .. } = &pulses[0];
            assert!(samples.start.abs_diff(range.start) <= 3 && samples.end.abs_diff(range.end) <= 3, "{samples:?}");
            let middle = range.start.midpoint(range.end) - first;
            assert!((change[middle] - size).abs() < 4.0 * variance[middle].sqrt(), "{}", change[middle]);
            assert!(variance[middle].sqrt() < 0.1 * size.abs());
            // Well outside nothing is changed, and this is certain.
            assert!(change[0].abs() < 1e-9 && variance[0] < 1e-9);
        }
    }

    #[test]
    fn what_stays_changed_and_what_is_noise_is_no_pulse() {
        assert_eq!(found(|_| 0.0), []);
        assert_eq!(found(|n| 0.5 * (n as f64 * 0.05).sin()), []);
    }

    #[test]
    fn what_hardly_stands_out_in_most_places_is_chance() {
        let (ones, function) = (vec![1.0; 1000], vec![0.2; 9]);
        let is_chance = |large: &[usize]| {
            let mut left = vec![0.0; 1000];
            (50..1000).step_by(50).for_each(|row| left[row] = (0.6 * SIGNIFICANT).sqrt());
            for &row in large {
                left[row] = (20.0 * SIGNIFICANT).sqrt();
            }
            let search = PulseSearch {
                left: &left,
                usable: &vec![true; 1000],
                roots: &[],
                signal: &ones.as_slice(),
                others: &[],
                function: &function,
                first: 4,
                stride: 1,
                variance: 1.0,
                inflation: 1.0,
            };
            let over = search.conspicuous();
            assert_eq!(over.len(), 19);
            (search.is_chance(&over), search.is_chance(&over[5..6]))
        };
        assert_eq!(
            [is_chance(&[]), is_chance(&[300]), is_chance(&[100, 500])],
            [(true, true), (false, false), (false, true)]
        );
    }
}
