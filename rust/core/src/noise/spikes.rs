//! Spikes of a channel: a few samples in a row that stand out of their neighbours, as those of a disturbed sensor or line do.
//!
//! A mass cannot do that: its angle has no jump, its velocity changes where it is hit and keeps what it has then. So the neighbours on both sides must
//! lie on one polynomial of low degree, and what stands between them must be far from it.

use crate::error::Error;
use crate::exec::pool::Watch;
use crate::noise::breaks::windows::{Size, deviation, orthonormal, product};
use crate::noise::quantisation::quantisation_step;
use crate::noise::walk::each_part;
use crate::record::samples::{Samples, all_usable};

/// Neighbours on either side, and the degree of the polynomial through all of them.
const NEIGHBOURS: usize = 3;
const DEGREE: usize = 3;

/// Samples of a spike at most, of the angle and of the torque: a torque can be there for two, and the machine feels it.
pub(crate) const LONGEST: [usize; 2] = [3, 1];

/// How far a spike stands out, in units of what is usual in the record and nearby: noise alone does so once in 10^15 samples.
const STANDS_OUT: f64 = 8.0;

/// The root mean square that the neighbours may leave, as part of the spike. Where the velocity jumps they leave 0.14 of what looks like a spike,
/// where the angle jumps 0.26.
const CALM: f64 = 0.1;

/// How much further a spike stands out than its neighbours are from a straight line: what moves fast turns as fast.
const SMOOTH: f64 = 4.0;

/// Windows on either side that say what is usual nearby, and how many there must be.
const NEARBY: usize = 20;
const FEWEST_NEARBY: usize = 8;

/// A second difference from which on a spike may begin, in units of what is usual: less than what any spike has.
const BEGINS: f64 = 4.0;

/// Samples around those that are looked at together.
const AROUND: usize = NEARBY + 2 * NEIGHBOURS + LONGEST[0];

/// The part of the samples from which on they are no spikes but a noise with heavy tails, or what the machine does.
const SELDOM: usize = 250;

/// A sample of a spike, and what its neighbours say instead.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spike {
    pub(crate) place: usize,
    pub(crate) instead: f64,
}

/// A channel with what neighbours say in place of its spikes, which stand in order.
pub(crate) struct Repaired<'a> {
    pub(crate) channel: &'a dyn Samples,
    pub(crate) spikes: &'a [Spike],
}

impl Samples for Repaired<'_> {
    fn len(&self) -> usize {
        self.channel.len()
    }

    fn read(&self, first: usize, into: &mut [f64]) {
        self.channel.read(first, into);
        let [from, to] = [first, first + into.len()].map(|end| self.spikes.partition_point(|spike| spike.place < end));
        self.spikes[from..to].iter().for_each(|spike| into[spike.place - first] = spike.instead);
    }
}

/// How many samples of the angle and of the torque are spikes. Costs some 2 ns a sample.
///
/// # Errors
/// If the watch cancels.
pub fn spike_counts(angle: &dyn Samples, torque: &dyn Samples, watch: &mut Watch<'_>) -> Result<[usize; 2], Error> {
    Ok([spikes(angle, LONGEST[0], watch)?.len(), spikes(torque, LONGEST[1], watch)?.len()])
}

/// The samples of all spikes of at most so many samples, in order; none where there are so many that they are no accident. Costs some 2 ns a sample.
///
/// # Errors
/// If the watch cancels.
pub(crate) fn spikes(channel: &dyn Samples, longest: usize, watch: &mut Watch<'_>) -> Result<Vec<Spike>, Error> {
    let (samples, quantum) = (channel.len(), quantisation_step(channel));
    let second = |window: &[f64]| Size { size: window[0] - 2.0 * window[1] + window[2], left: 0.0 };
    let Some(begins) = Size::usual(channel, 3, quantum, second).map(|usual| BEGINS * usual.size) else {
        return Ok(Vec::new());
    };
    let widths: Option<Vec<Surrounded>> = (1..=longest).map(|width| Surrounded::new(width, channel, quantum)).collect();
    let (Some(widths), mut found) = (widths, Vec::new()) else {
        return Ok(Vec::new());
    };
    let mut others = Others::default();
    each_part(channel, AROUND, watch, |first, values| {
        for place in 0..values.len() - 2 * AROUND {
            let (at, sample) = (place + AROUND, first + place);
            let bend = values[at - 2] - 2.0 * values[at - 1] + values[at];
            if bend.abs() <= begins || found.last().is_some_and(|last: &Alone| last.end() > sample) {
                continue;
            }
            // The largest distance so far, NaN before any.
            let mut furthest = f64::NAN;
            let alone = widths.iter().find_map(|width| {
                let distance = width.distance_at(values, at);
                furthest = furthest.max(distance);
                let alone = || Alone { first: sample, distance, instead: width.instead(values, at) };
                width.is_alone(values, at, distance).then(alone)
            });
            if let Some(alone) = alone {
                others.forget(sample);
                found.push(alone);
            } else if furthest.is_finite() {
                others.add(sample, furthest, found.last());
            }
        }
    })?;
    Ok(seldom(found, &others.counted(), samples))
}

/// Samples that stand alone between calm neighbours.
struct Alone {
    first: usize,
    distance: f64,
    instead: Vec<f64>,
}

impl Alone {
    fn end(&self) -> usize {
        self.first + self.instead.len()
    }
}

/// Places at which a channel bends and is not calm on both sides, as it does where a machine is pushed: how many by how much.
#[derive(Default)]
struct Others {
    /// Those that may be near a spike that is yet to come.
    recent: Vec<(usize, f64)>,
    counts: Vec<usize>,
}

impl Others {
    /// Distances of about half an octave are counted together: those with the same exponent and first binary digit.
    fn place(distance: f64) -> usize {
        u16::try_from(distance.abs().to_bits() >> (f64::MANTISSA_DIGITS - 2)).map_or(0, usize::from)
    }

    fn add(&mut self, place: usize, distance: f64, before: Option<&Alone>) {
        // A spike bends what is near it.
        if before.is_none_or(|one| one.end() + 2 * NEIGHBOURS < place) {
            self.recent.push((place, distance));
        }
        if self.recent.len() > AROUND {
            self.count(place);
        }
    }

    fn forget(&mut self, spike: usize) {
        self.count(spike);
        self.recent.clear();
    }

    /// Counts what is not near a place.
    fn count(&mut self, place: usize) {
        let near = self.recent.partition_point(|&(one, _)| one + 2 * NEIGHBOURS < place);
        for (_, distance) in self.recent.drain(..near) {
            let place = Self::place(distance);
            self.counts.resize(self.counts.len().max(place + 1), 0);
            self.counts[place] += 1;
        }
    }

    fn counted(mut self) -> Self {
        self.count(usize::MAX);
        self
    }

    fn above(&self, least: f64) -> usize {
        self.counts.iter().skip(Self::place(least)).sum()
    }
}

/// Those that stand alone by accident: they are few, and at fewer places beside them the channel bends half as much.
fn seldom(found: Vec<Alone>, others: &Others, samples: usize) -> Vec<Spike> {
    let mut distances: Vec<f64> = found.iter().map(|one| one.distance).collect();
    distances.sort_unstable_by(f64::total_cmp);
    let as_far = |least: f64| distances.len() - distances.partition_point(|&distance| distance < least);
    let is_accident = |one: &Alone| others.above(one.distance / 2.0) <= as_far(one.distance / 2.0);
    let spikes = found.into_iter().filter(is_accident).flat_map(|one| {
        (one.first..).zip(one.instead).map(|(place, instead)| Spike { place, instead }).collect::<Vec<_>>()
    });
    let spikes: Vec<Spike> = spikes.collect();
    if spikes.len() * SELDOM > samples { Vec::new() } else { spikes }
}

/// What stands between neighbours.
struct Surrounded {
    width: usize,
    /// Orthonormal polynomials: their values at the neighbours, then at what stands between.
    basis: Vec<Vec<f64>>,
    /// How far the first of the samples between is usually from what the neighbours say.
    usual: f64,
}

impl Surrounded {
    /// `None` where all windows hold a missing sample.
    fn new(width: usize, channel: &dyn Samples, quantum: f64) -> Option<Self> {
        let middle = (2 * NEIGHBOURS + width - 1) as f64 / 2.0;
        let outside = (0..NEIGHBOURS).chain(NEIGHBOURS + width..2 * NEIGHBOURS + width);
        let times: Vec<f64> =
            outside.chain(NEIGHBOURS..NEIGHBOURS + width).map(|place| place as f64 - middle).collect();
        let mut basis: Vec<Vec<f64>> = Vec::new();
        for degree in 0..=DEGREE {
            let power = times.iter().map(|time| time.powf(degree as f64)).collect();
            basis.push(orthonormal(power, &basis, 2 * NEIGHBOURS));
        }
        let mut one = Self { width, basis, usual: 0.0 };
        let size = |window: &[f64]| Size { size: one.distance(window, 0), left: 0.0 };
        one.usual = Size::usual(channel, 2 * NEIGHBOURS + width, quantum, size)?.size;
        Some(one)
    }

    fn length(&self) -> usize {
        2 * NEIGHBOURS + self.width
    }

    /// The neighbours in a window, without its first sample, which would cost digits.
    fn neighbours(&self, window: &[f64]) -> [f64; 2 * NEIGHBOURS] {
        std::array::from_fn(|place| window[if place < NEIGHBOURS { place } else { place + self.width }] - window[0])
    }

    /// What neighbours say of one of the samples between.
    fn said(&self, neighbours: &[f64], between: usize) -> f64 {
        self.basis.iter().map(|column| product(column, neighbours) * column[2 * NEIGHBOURS + between]).sum()
    }

    fn distance(&self, window: &[f64], between: usize) -> f64 {
        window[NEIGHBOURS + between] - window[0] - self.said(&self.neighbours(window), between)
    }

    /// The window whose samples between begin at a place.
    fn window<'a>(&self, values: &'a [f64], at: usize) -> &'a [f64] {
        &values[at - NEIGHBOURS..][..self.length()]
    }

    /// How far the samples from a place on are from what their neighbours say: the first or the last, whichever is nearer, for what is between them may
    /// be anything. NaN where a sample is missing.
    fn distance_at(&self, values: &[f64], at: usize) -> f64 {
        let window = self.window(values, at);
        if !all_usable(window) {
            return f64::NAN;
        }
        self.distance(window, 0).abs().min(self.distance(window, self.width - 1).abs())
    }

    /// Whether samples from a place on stand out of neighbours that are calm on both sides.
    fn is_alone(&self, values: &[f64], at: usize, distance: f64) -> bool {
        if distance.is_nan() || distance <= STANDS_OUT * self.usual {
            return false;
        }
        let neighbours = self.neighbours(self.window(values, at));
        let squares = product(&neighbours, &neighbours);
        let left_by = |degree: usize| {
            let explained: f64 = self.basis[..=degree].iter().map(|column| product(column, &neighbours).powi(2)).sum();
            ((squares - explained).max(0.0) / (2 * NEIGHBOURS) as f64).sqrt()
        };
        left_by(DEGREE) <= CALM * distance
            && SMOOTH * left_by(1) < distance
            && self.usual_nearby(values, at).is_some_and(|usual| distance > STANDS_OUT * usual)
    }

    /// What neighbours say instead of the samples from a place on.
    fn instead(&self, values: &[f64], at: usize) -> Vec<f64> {
        let window = self.window(values, at);
        let neighbours = self.neighbours(window);
        (0..self.width).map(|between| window[0] + self.said(&neighbours, between)).collect()
    }

    /// How far samples nearby are from what their neighbours say, on the side where it is more; `None` where too few are there on both sides.
    fn usual_nearby(&self, values: &[f64], at: usize) -> Option<f64> {
        let (first, apart) = (at - NEIGHBOURS, NEIGHBOURS + self.width);
        let before = first.saturating_sub(NEARBY + apart)..first - apart;
        let after = first + apart..(first + apart + NEARBY).min(values.len() + 1 - self.length());
        let usual = |starts: std::ops::Range<usize>| {
            let windows = starts.map(|start| &values[start..start + self.length()]);
            let distances = windows.filter(|window| all_usable(window)).map(|window| self.distance(window, 0).abs());
            let mut distances: Vec<f64> = distances.collect();
            if distances.len() < FEWEST_NEARBY { None } else { deviation(&mut distances) }
        };
        [before, after].into_iter().filter_map(usual).reduce(f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::quantisation::tests::uniform;

    fn places(channel: &[f64]) -> Vec<usize> {
        spikes(&channel, LONGEST[0], &mut |_, _| true).unwrap().iter().map(|spike| spike.place).collect()
    }

    fn motion(time: f64) -> f64 {
        (0.05 * time).sin() + 0.4 * (0.017 * time).cos()
    }

    fn recorded(samples: usize) -> Vec<f64> {
        uniform(samples).iter().enumerate().map(|(place, noise)| 1e6 + motion(place as f64) + 2e-3 * noise).collect()
    }

    #[test]
    fn spikes_are_found_and_replaced_by_what_neighbours_say() {
        let clean = recorded(20_000);
        let mut spoilt = clean.clone();
        let all = [30, 4095, 4097, 8191, 8192, 8193, 11_000, 15_001, 19_950];
        for (place, height) in all.into_iter().zip([0.05, -1.0, 20.0].into_iter().cycle()) {
            spoilt[place] += height;
        }
        let found = spikes(&spoilt.as_slice(), LONGEST[0], &mut |_, _| true).unwrap();
        let mut expected = all.to_vec();
        expected.insert(2, 4096); // between two spikes
        assert_eq!(found.iter().map(|spike| spike.place).collect::<Vec<_>>(), expected);
        // Two neighbours of three samples say what the third is to 4 times the noise, of a uniform one half a millirad.
        for spike in found {
            assert!((spike.instead - clean[spike.place]).abs() < 8e-3, "{spike:?} {}", clean[spike.place]);
        }
        assert_eq!(places(&clean), []);
        assert_eq!(places(&spoilt[..9]), []);
    }

    #[test]
    fn what_machines_and_encoders_do_is_no_spike() {
        let noise = uniform(6000);
        let with = |change: &dyn Fn(f64) -> f64| -> Vec<f64> {
            (0..6000_u16).map(|place| change(f64::from(place)) + 1e-4 * noise[usize::from(place)]).collect()
        };
        // A jump, a change of velocity in one sample, impacts of some samples, a burst, a square wave.
        let burst = |time: f64| if (time - 3000.0).abs() < 100.0 { (2.9 * time).sin() } else { 0.0 };
        let changes: [&dyn Fn(f64) -> f64; 6] = [
            &|time| motion(time) + if time > 2000.0 { 1.0 } else { 0.0 },
            &|time| (time - 2000.0).abs(),
            &|time| (-(time - 2000.0).powi(2) / 8.0).exp(),
            &burst,
            &|time| (0.01 * time).sin().signum(),
            &|time| motion(time) + (0.5 * time).sin().powi(9),
        ];
        for (place, change) in changes.into_iter().enumerate() {
            assert_eq!(places(&with(change)), [], "{place}");
        }
        for step in [1e-3, 0.02, 0.3] {
            let rounded: Vec<f64> =
                (0..6000).map(|place| (motion(f64::from(place) / 8.0) / step).round() * step).collect();
            assert_eq!(places(&rounded), [], "{step}");
        }
        let gaps: Vec<f64> =
            (0..6000).map(|place| if place % 400 < 3 { f64::NAN } else { motion(f64::from(place)) }).collect();
        assert_eq!(places(&gaps), []);
    }

    #[test]
    fn so_many_that_they_are_no_accident_stay() {
        let mut values = recorded(6000);
        for place in (50..5950).step_by(50) {
            values[place] += 1.0;
        }
        assert_eq!(places(&values), []);
    }
}
