//! Shifts of time at the border of two samples: a channel goes on there as it would some samples later.
//!
//! How long a polynomial follows a motion depends on the motion and the rate, and how long it must be to see a shift beside the noise on both and
//! on the shift. So windows are as long as the record asks for: of ordinary ones samples are taken away, and the length is taken at which
//! that would be seen most often.

use crate::error::Error;
use crate::exec::pool::Watch;
use crate::noise::breaks::windows::{borders, orthonormal, product};
use crate::noise::median::median;
use crate::record::samples::{Samples, all_usable};
use crate::record::subsample::stretches;

/// A shift stands out by so many times what is usual, and what is left beside it.
const CONSPICUOUS: f64 = 6.0;

/// Samples on either side of a border, and the degree of the polynomial.
const HALVES: [usize; 4] = [7, 10, 14, 20];
const DEGREE: usize = 5;

/// A shift is by about as many samples as at the known breaks, in per cent, or by those of neighbouring ones together. Where the last explains a window best, it is
/// something else, as an impact.
const AS_MANY: [usize; 8] = [50, 67, 100, 134, 167, 200, 267, 400];

/// How many may be lost at a known break at most, and by which part of them more the next ones tried are.
const MOST_LOST: usize = 100;
const MORE: usize = 5;

/// Known breaks that are asked how many samples are usually lost.
const MOST_ASKED: usize = 64;

/// Fewer samples explain a window as well if so many times its noise more is left.
const AS_WELL: f64 = 4.0;

/// Samples of a window beside those that its polynomials and a shift take.
const FEWEST: usize = 3;

/// How often breaks are searched for beside those that were found before.
const ROUNDS: usize = 4;

/// Ordinary windows that are asked, in so many stretches.
const MOST: usize = 1 << 10;
const STRETCHES: usize = 16;

/// Samples in the middle that are left out, one after the other: several breaks close together hide each other, and are seen as one.
const LEFT_OUT: [usize; 4] = [0, 2, 4, 8];

/// Where samples are lost.
#[derive(Clone, Copy)]
struct Break {
    /// The first sample after it, or after the first of several close together, and how many are left out before the last.
    place: usize,
    left_out: usize,
    /// How many are lost.
    lost: usize,
}

impl Break {
    fn leaves_out(&self, sample: usize) -> bool {
        self.place <= sample && sample < self.place + self.left_out
    }
}

/// Polynomials at some times.
struct Polynomials(Vec<Vec<f64>>);

impl Polynomials {
    fn at(times: &[f64]) -> Self {
        let (first, last) = (times[0], times[times.len() - 1]);
        let mut basis = Vec::new();
        let scaled: Vec<f64> = times.iter().map(|time| (2.0 * time - first - last) / (last - first)).collect();
        let mut power = vec![1.0; times.len()];
        for _ in 0..=DEGREE {
            basis.push(orthonormal(power.clone(), &basis, times.len()));
            power.iter_mut().zip(&scaled).for_each(|(power, time)| *power *= time);
        }
        Self(basis)
    }

    /// Of windows of so many samples on either side that lost some in the middle.
    fn around(half: usize, lost: usize) -> Self {
        let times: Vec<f64> = (0..2 * half).map(|place| (place + if place < half { 0 } else { lost }) as f64).collect();
        Self::at(&times)
    }

    /// The squares that they leave of a window, at least those of rounding.
    fn left(&self, window: &[f64]) -> f64 {
        let squares = product(window, window);
        let explained: f64 = self.0.iter().map(|column| product(column, window).powi(2)).sum();
        (squares - explained).max(squares * f64::EPSILON)
    }
}

/// Windows of some length, whose middle is asked for a shift of time.
struct Shifts {
    half: usize,
    left_out: usize,
    /// The mean square that is left of the usual window.
    usual: f64,
    whole: Polynomials,
    /// By how many samples are lost in the middle, in order.
    shifted: Vec<(usize, Polynomials)>,
}

/// How much a shift stands out, and how many samples are lost.
type Seen = (f64, usize);

const NOTHING: Seen = (0.0, 0);

impl Shifts {
    /// Windows of a channel that was rounded to a `quantum`, of which the usual one lost some samples, which leaves more where the motion is fast.
    /// `None` if all hold a missing sample.
    fn of(
        channel: &dyn Samples,
        quantum: f64,
        (half, left_out, usually): (usize, usize, usize),
        lost: impl Iterator<Item = usize>,
    ) -> Option<Self> {
        let gone = left_out + usually;
        let explained = Polynomials::around(half, gone);
        let mut left = ordinary(channel, 2 * half + gone, |window| explained.left(&without_middle(window, half)));
        let usual = median(&mut left)? / (2 * half - DEGREE - 1) as f64;
        Some(Self {
            half,
            left_out,
            usual: usual.max(quantum * quantum / 4.0),
            whole: Polynomials::around(half, left_out),
            shifted: lost.map(|lost| (lost, Polynomials::around(half, left_out + lost))).collect(),
        })
    }

    /// How much a shift stands out, of squares left by samples lost and of those where none is: by as few samples as explain the window. Nothing
    /// if hardly more is left than usually.
    fn best(&self, samples: usize, whole: f64, left: impl Iterator<Item = (usize, f64)>) -> Seen {
        let freedom = (samples - DEGREE - 2) as f64;
        // Beside a shift a quarter of the usual noise is left, too.
        if whole < (CONSPICUOUS * CONSPICUOUS + freedom / 4.0) * self.usual {
            return NOTHING;
        }
        let left: Vec<(usize, f64)> = left.collect();
        let noise = |left: f64| (left / freedom).max(self.usual);
        let least = left.iter().map(|&(_, left)| left).fold(f64::INFINITY, f64::min);
        let enough = |&&(_, left): &&(usize, f64)| left <= least + AS_WELL * noise(least);
        left.iter().find(enough).map_or(NOTHING, |&(lost, left)| (((whole - left).max(0.0) / noise(left)).sqrt(), lost))
    }

    /// The same of a window beside breaks that are known, where some samples are known to be lost in its middle.
    fn beside(&self, window: &[f64], first: usize, known: &[Break], here: usize) -> Seen {
        let (border, end) = (first + self.half, first + window.len());
        let own = Break { place: border, left_out: self.left_out, lost: 0 };
        let known = &known[known.partition_point(|one| one.place + one.left_out <= first)..];
        let known = &known[..known.partition_point(|one| one.place < end)];
        let is_other = |one: &&Break| one.place < border || one.place > border + self.left_out;
        let others: Vec<Break> = known.iter().filter(is_other).copied().collect();
        if others.is_empty() {
            let cut = without_middle(window, self.half);
            let left = self.shifted.iter().map(|(lost, polynomials)| (*lost, polynomials.left(&cut)));
            let at_known = |here: usize| Polynomials::around(self.half, self.left_out + here).left(&cut);
            let whole = if here == 0 { self.whole.left(&cut) } else { at_known(here) };
            return self.best(cut.len(), whole, left);
        }
        let is_there = |sample: &usize| !own.leaves_out(*sample) && !others.iter().any(|one| one.leaves_out(*sample));
        let there: Vec<usize> = (first..end).filter(is_there).collect();
        if there.len() < DEGREE + 2 + FEWEST {
            return NOTHING;
        }
        let values: Vec<f64> = there.iter().map(|sample| window[sample - first] - window[0]).collect();
        let left = |lost: usize| {
            let before = |sample: usize| -> usize {
                others.iter().filter(|one| one.place <= sample).map(|one| one.lost).sum::<usize>()
                    + if sample < border { 0 } else { lost }
            };
            let times: Vec<f64> = there.iter().map(|&sample| (sample - first + before(sample)) as f64).collect();
            Polynomials::at(&times).left(&values)
        };
        self.best(there.len(), left(here), self.shifted.iter().map(|&(lost, _)| (lost, left(lost))))
    }

    /// The same at a border; nothing where a sample is missing.
    fn at(&self, channel: &dyn Samples, border: usize, known: &[Break], here: usize) -> Seen {
        let length = 2 * self.half + self.left_out;
        if border < self.half || border - self.half + length > channel.len() {
            return NOTHING;
        }
        let mut window = vec![0.0; length];
        channel.read(border - self.half, &mut window);
        if all_usable(&window) { self.beside(&window, border - self.half, known, here) } else { NOTHING }
    }

    /// In how many of the ordinary windows that lost some samples that would be seen.
    fn power(&self, channel: &dyn Samples, lost: usize) -> f64 {
        let shifted = Polynomials::around(self.half, lost);
        let seen = ordinary(channel, 2 * self.half + lost, |window| {
            let cut = without_middle(window, self.half);
            let left = std::iter::once((lost, shifted.left(&cut)));
            f64::from(u8::from(self.best(cut.len(), self.whole.left(&cut), left).0 > CONSPICUOUS))
        });
        seen.iter().sum::<f64>() / seen.len().max(1) as f64
    }

    /// The borders at which something may stand out beside known breaks.
    fn restless(&self, channel: &dyn Samples, known: &[Break], watch: &mut Watch<'_>) -> Result<Vec<usize>, Error> {
        let mut restless = Vec::new();
        borders(channel, self.half, &[], watch, |first, values, _| {
            let windows = values.windows(2 * self.half).zip(first..).filter(|(window, _)| all_usable(window));
            restless.extend(windows.filter_map(|(window, first)| {
                (self.beside(window, first, known, 0).0 > 0.0).then_some(first + self.half)
            }));
        })?;
        Ok(restless)
    }

    /// The breaks at some borders that stand out most beside known ones, each of those within half a window.
    fn more(&self, channel: &dyn Samples, borders: &[usize], known: &[Break]) -> Vec<Break> {
        let too_many = self.shifted.last().map_or(0, |&(lost, _)| lost);
        let mut found: Vec<(f64, Break)> = Vec::new();
        for &place in borders {
            let before = known.partition_point(|one| one.place < place);
            let near = before.checked_sub(1).map(|last| known[last]);
            let here = known[before..].iter().take_while(|one| one.place <= place + self.left_out);
            let (count, here) = here.fold((0, 0), |(count, lost), one| (count + 1, lost + one.lost));
            // A break that is known is no other one.
            if near.is_some_and(|near| place <= near.place + near.left_out) || count > 0 && self.left_out == 0 {
                continue;
            }
            let (stands_out, lost) = self.at(channel, place, known, here);
            if stands_out <= CONSPICUOUS || lost >= too_many {
                continue;
            }
            let one = (stands_out, Break { place, left_out: self.left_out, lost });
            match found.last_mut() {
                Some(last) if last.1.place + self.half > place => {
                    if stands_out > last.0 {
                        *last = one;
                    }
                }
                _ => found.push(one),
            }
        }
        found.into_iter().map(|(_, one)| one).collect()
    }
}

/// The breaks beside known ones, at which about as many samples are lost, of a channel that was rounded to a `quantum`. Costs some 1 µs a sample.
///
/// # Errors
/// If the watch cancels.
pub(crate) fn shifts(
    channel: &dyn Samples,
    quantum: f64,
    known: &[usize],
    watch: &mut Watch<'_>,
) -> Result<Vec<usize>, Error> {
    let Some(typical) = usually_lost(channel, quantum, known) else { return Ok(Vec::new()) };
    let as_many = || {
        let mut lost: Vec<usize> = AS_MANY.iter().map(|part| ((part * typical + 50) / 100).max(1)).collect();
        lost.dedup();
        lost.into_iter()
    };
    let of_lengths = HALVES.iter().filter_map(|&half| Shifts::of(channel, quantum, (half, 0, typical), as_many()));
    let powers = of_lengths.map(|shifts| (shifts.power(channel, typical), shifts));
    // Of equal ones the shortest: neighbouring losses are beside it.
    let best = powers.reduce(|one, other| if other.0 > one.0 { other } else { one });
    let Some((_, shifts)) = best else { return Ok(Vec::new()) };
    let mut breaks: Vec<Break> = known.iter().map(|&place| Break { place, left_out: 0, lost: typical }).collect();
    let lost = |one: &Break| match shifts.at(channel, one.place, &breaks, 0) {
        (stands_out, lost) if stands_out > CONSPICUOUS => Break { lost, ..*one },
        _ => *one,
    };
    breaks = breaks.iter().map(lost).collect();
    let restless = shifts.restless(channel, &breaks, watch)?;
    let mut found = Vec::new();
    for left_out in LEFT_OUT {
        let Some(shifts) = Shifts::of(channel, quantum, (shifts.half, left_out, typical), as_many()) else { continue };
        for _ in 0..ROUNDS {
            let more = shifts.more(channel, &restless, &breaks);
            if more.is_empty() {
                break;
            }
            found.extend(more.iter().flat_map(|one| [one.place, one.place + one.left_out]));
            // Those that are known become part of them.
            breaks.retain(|one| {
                !more.iter().any(|other| (other.place..=other.place + other.left_out).contains(&one.place))
            });
            breaks.extend(more);
            breaks.sort_unstable_by_key(|one| one.place);
        }
    }
    found.sort_unstable();
    found.dedup();
    found.retain(|place| known.binary_search(place).is_err());
    Ok(found)
}

/// How many samples are lost at the usual one of some breaks, each seen in the windows in which it stands out most.
fn usually_lost(channel: &dyn Samples, quantum: f64, breaks: &[usize]) -> Option<usize> {
    let tried = std::iter::successors(Some(1), |lost| Some(lost + (lost / MORE).max(1)));
    let tried: Vec<usize> = tried.take_while(|lost| *lost < MOST_LOST).collect();
    let lengths: Vec<Shifts> =
        HALVES.iter().filter_map(|&half| Shifts::of(channel, quantum, (half, 0, 0), tried.iter().copied())).collect();
    let mut lost = Vec::new();
    for &place in breaks.iter().step_by(breaks.len().div_ceil(MOST_ASKED).max(1)) {
        let seen = lengths.iter().map(|shifts| shifts.at(channel, place, &[], 0));
        let best = seen.max_by(|one, other| one.0.total_cmp(&other.0));
        lost.extend(best.filter(|&(stands_out, _)| stands_out > CONSPICUOUS).map(|(_, lost)| lost));
    }
    lost.sort_unstable();
    lost.get(lost.len() / 2).copied()
}

/// What ordinary windows of a channel give, without those that lack a sample.
fn ordinary(channel: &dyn Samples, length: usize, mut of: impl FnMut(&[f64]) -> f64) -> Vec<f64> {
    let mut given = Vec::new();
    let windows = (channel.len() + 1).saturating_sub(length);
    for places in stretches(windows, MOST, STRETCHES).filter(|places| !places.is_empty()) {
        let mut samples = vec![0.0; places.len() + length - 1];
        channel.read(places.start, &mut samples);
        given.extend(samples.windows(length).filter(|window| all_usable(window)).map(&mut of));
    }
    given
}

/// As many samples on either side of a window, without its first value: an offset would cost digits.
fn without_middle(window: &[f64], half: usize) -> Vec<f64> {
    let sides = [&window[..half], &window[window.len() - half..]];
    sides.into_iter().flatten().map(|value| value - window[0]).collect()
}
