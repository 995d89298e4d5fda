//! The choice of one window and order for a whole record, by their estimated mean squared error.
//!
//! The mean squared error of a candidate `c` is `b_c² + σ² g_c`, and its bias is only known by comparison with a
//! reference estimate `r` of less bias:
//!
//! ```text
//! risk_c = ⟨(d_c - d_r)²⟩ + 2 σ² k_cᵀR k_r = b_c² + σ² g_c + what is the same for all c,   if b_r ≪ b_c,
//! ```
//!
//! with `k` the weights of the samples, `R` the correlations of the noise ([`crate::noise::colour`]) and `g_c = k_cᵀR k_c`. In the frequency domain this is `Σ_f P|H_c - (iω)^d|² + S|H_c|²`, `P` the spectrum
//! of the record and `S` that of its noise. The reference must have less bias than the candidates, and no more noise than can be averaged out.
//! Therefore it is refined iteratively. It begins with the shortest window and its highest order. Among the candidates
//! with at least a hundredth of its variance the best is found; the window `√2` times shorter, of the same order, is the
//! next reference. This is repeated until nothing changes. Since the least of many estimated risks is too small, the
//! variance counts 1.3 times. Finally the window is refined to 2 %.
//!
//! Windows of different lengths fit at different places. The noise of the reference, up to a hundred times that of a
//! candidate, has another mean square at each set of places: over 200 places it varies by a tenth, ten times the
//! variance that is sought. So a window is compared with the best of the shorter ones where both fit. Its risk is the
//! other one's plus their difference there.

use std::ops::Range;

use crate::auto_derivatives::candidates::{Bank, Target, correlated};
use crate::auto_derivatives::differences::SquaredDistances;
use crate::auto_derivatives::survey::{LONGEST, Survey, Surveyed};
use crate::auto_derivatives::symmetric_grid::within;
use crate::error::Error;
use crate::noise::correlated::CorrelatedNoise;
use crate::simd::vectors::dispatch;

/// Half-width of the shortest window.
pub(crate) const SHORTEST: usize = 4;

/// Places at which candidates are compared, at least.
const FEWEST_PLACES: usize = 16;

/// A reference judges candidates whose variance is at least its own over this.
const JUDGED: f64 = 100.0;

/// The factor on the variance, since the least of many estimated risks is taken.
pub(crate) const OPTIMISM: f64 = 1.3;

/// The steps, in halvings and doublings, with which the best window is refined.
const REFINEMENTS: [f64; 4] = [0.25, 0.125, 0.0625, 0.031_25];

/// Called repeatedly; an error ends the work.
pub(crate) type CheckCancelled<'a> = dyn FnMut() -> Result<(), Error> + 'a;

/// What candidates are compared with: the weights of its samples are the same for all of them.
struct ReferenceCandidate<'a> {
    looked: &'a Surveyed,
    candidate: usize,
    kernel: Vec<f64>,
}

impl Surveyed {
    fn compared(&self, candidate: usize) -> ReferenceCandidate<'_> {
        ReferenceCandidate { looked: self, candidate, kernel: self.bank.kernel(candidate) }
    }
}

/// A candidate of a window, and its risk.
#[derive(Clone, Copy)]
struct JudgedWindow<'a> {
    looked: &'a Surveyed,
    candidate: usize,
    risk: f64,
    /// The product of its kernel with that of the reference.
    shared: f64,
}

/// A candidate of a window by itself: the same.
struct RefinedWindow {
    looked: Surveyed,
    candidate: usize,
    risk: f64,
    shared: f64,
}

/// A window and an order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pair {
    pub(crate) half: usize,
    pub(crate) order: usize,
}

impl Survey<'_> {
    /// The pair of least risk, or `None` if no window is free of unusable samples. `check_cancelled` is called repeatedly.
    ///
    /// # Errors
    /// Those of `check_cancelled`, at once.
    pub(crate) fn best(
        &self,
        target: &Target<'_>,
        check_cancelled: &mut CheckCancelled<'_>,
    ) -> Result<Option<Pair>, Error> {
        let mut ladder = Vec::new();
        for half in ladder_of_windows(self.record().len(), target.shortest) {
            if let Some(bank) = Bank::new(half, target)? {
                ladder.push(self.look(bank)?);
            }
            check_cancelled()?;
        }
        let Some((pair, (window, candidate))) = best_of(&ladder, target.noise) else { return Ok(None) };
        let looked = ladder.swap_remove(window);
        drop(ladder);
        self.refine(target, pair, &looked.compared(candidate), check_cancelled).map(Some)
    }

    /// Finds the window, and the order, between those of the ladder.
    fn refine(
        &self,
        target: &Target<'_>,
        pair: Pair,
        reference: &ReferenceCandidate<'_>,
        check_cancelled: &mut CheckCancelled<'_>,
    ) -> Result<Pair, Error> {
        // The best of a window, compared with the best so far.
        let best_of = |half: usize, best: Option<&RefinedWindow>| {
            let Some(bank) = Bank::new(half, target)? else { return Ok(None) };
            let looked = self.look_once(bank);
            let best = best.map(|&RefinedWindow { ref looked, candidate, risk, shared }| JudgedWindow {
                looked,
                candidate,
                risk,
                shared,
            });
            let judged = judge(reference, &looked, best, 0.0, target.noise).into_iter();
            let least = judged.min_by(|a, b| a.risk.total_cmp(&b.risk));
            let least = least.map(|JudgedWindow { candidate, risk, shared, .. }| (candidate, risk, shared));
            Ok::<_, Error>(least.map(|(candidate, risk, shared)| RefinedWindow { looked, candidate, risk, shared }))
        };
        let Some(mut best) = best_of(pair.half, None)? else { return Ok(pair) };
        for step in REFINEMENTS {
            let centre = best.looked.bank.half;
            for half in [rounded(centre as f64 * (-step).exp2()), rounded(centre as f64 * step.exp2())] {
                if half == best.looked.bank.half || half < target.shortest || 2 * half >= self.record().len() / 2 {
                    continue;
                }
                if let Some(found) = best_of(half, Some(&best))?
                    && found.risk < best.risk
                {
                    best = found;
                }
                check_cancelled()?;
            }
        }
        let RefinedWindow { looked, candidate, .. } = best;
        Ok(Pair { half: looked.bank.half, order: looked.bank.orders[candidate] })
    }
}

/// The best pair of a ladder, by iterative refinement of the reference. Returns it with the place of its reference.
fn best_of(ladder: &[Surveyed], noise: &CorrelatedNoise) -> Option<(Pair, (usize, usize))> {
    let mut reference = (0, ladder.first()?.bank.orders.len() - 1);
    let mut tried = Vec::new();
    let mut best = None;
    while !tried.contains(&reference) {
        tried.push(reference);
        let least_gain = ladder.get(reference.0)?.bank.gains[reference.1] / JUDGED;
        let compared = ladder[reference.0].compared(reference.1);
        let (mut shorter_best, mut least): (_, Option<(f64, usize, usize)>) = (None, None);
        for (window, looked) in ladder.iter().enumerate() {
            let judged = judge(&compared, looked, shorter_best, least_gain, noise).into_iter();
            let judged = judged.filter(|judged| judged.risk.is_finite());
            let Some(judged) = judged.min_by(|a, b| a.risk.total_cmp(&b.risk)) else { continue };
            let JudgedWindow { candidate, risk, .. } = judged;
            shorter_best = Some(judged);
            if least.is_none_or(|(least, ..)| risk < least) {
                least = Some((risk, window, candidate));
            }
        }
        let (_, window, candidate) = least?;
        let order = ladder[window].bank.orders[candidate];
        best = Some(Pair { half: ladder[window].bank.half, order });
        reference = shorter(ladder, window, order)?;
    }
    best.map(|best| (best, reference))
}

/// Every candidate of a window with its risk where it is of at least some gain, by comparison with a reference; infinite where they cannot be compared. Given another
/// candidate whose risk is known, it is that risk plus the difference where both windows fit.
fn judge<'a>(
    reference: &ReferenceCandidate<'_>,
    looked: &'a Surveyed,
    beside: Option<JudgedWindow<'_>>,
    least_gain: f64,
    noise: &CorrelatedNoise,
) -> Vec<JudgedWindow<'a>> {
    let nothing = |candidate: usize| JudgedWindow { looked, candidate, risk: f64::INFINITY, shared: 0.0 };
    let mut found: Vec<JudgedWindow<'_>> = (0..looked.rows.len()).map(nothing).collect();
    if !looked.bank.gains.iter().any(|&gain| gain >= least_gain) {
        return found;
    }
    let variance = noise.variance();
    let longest = looked.bank.half.max(beside.map_or(0, |other| other.looked.bank.half));
    let kernel = correlated(reference.kernel.clone(), longest, noise);
    // Where all of them are known.
    let surveyed: Vec<&Surveyed> =
        [reference.looked, looked].into_iter().chain(beside.map(|other| other.looked)).collect();
    let grid = surveyed.iter().map(|one| one.grid).max_by_key(|grid| grid.step).unwrap_or(looked.grid);
    let of_reference = reference.looked.at(grid);
    let compare = &*of_reference[reference.candidate];
    let all = surveyed.iter().try_fold(0..usize::MAX, |all, one| Some(within(&all, one.whole.as_ref()?)));
    let all = all.map(|samples| grid.means(&samples));
    let some: Vec<usize> = if all.is_some() {
        Vec::new()
    } else {
        let known: Vec<_> = surveyed.iter().map(|one| one.at(grid)).collect();
        (0..grid.count).filter(|&place| !known.iter().any(|rows| rows[0][place].is_nan())).collect()
    };
    let count = all.as_ref().map_or(some.len(), Range::len);
    if count < FEWEST_PLACES {
        return found;
    }
    let distances = |looked: &Surveyed, candidates: &[usize]| -> Vec<f64> {
        let known = looked.at(grid);
        let rows: Vec<&[f64]> = candidates.iter().map(|&candidate| &*known[candidate]).collect();
        let mut sums = vec![0.0; rows.len()];
        if let Some(part) = &all {
            let (rows, sums) = (&*rows, &mut *sums);
            dispatch(looked.bank.instructions, SquaredDistances { rows, compare, part, sums });
        } else {
            for (sum, row) in sums.iter_mut().zip(rows) {
                *sum = some.iter().map(|&place| (row[place] - compare[place]).powi(2)).sum();
            }
        }
        sums
    };
    let risk = |looked: &Surveyed, candidate: usize, distance: f64, shared: f64| {
        distance / count as f64 + variance * (2.0 * shared + (OPTIMISM - 1.0) * looked.bank.gains[candidate])
    };
    let shift = beside.map_or(0.0, |other| {
        let distance = distances(other.looked, &[other.candidate])[0];
        other.risk - risk(other.looked, other.candidate, distance, other.shared)
    });
    let judged = |candidate: &usize| looked.bank.gains[*candidate] >= least_gain;
    let candidates: Vec<usize> = (0..looked.rows.len()).filter(judged).collect();
    let shared = looked.bank.products(&kernel);
    for (&candidate, distance) in candidates.iter().zip(distances(looked, &candidates)) {
        let shared = shared[candidate];
        let risk = risk(looked, candidate, distance, shared) + shift;
        found[candidate] = JudgedWindow { looked, candidate, risk, shared };
    }
    found
}

/// The window nearest to one √2 times shorter, and the candidate of an order in it.
fn shorter(ladder: &[Surveyed], window: usize, order: usize) -> Option<(usize, usize)> {
    let wanted = ladder[window].bank.half as f64 / std::f64::consts::SQRT_2;
    let candidates = ladder.iter().enumerate().filter_map(|(place, looked)| {
        let candidate = looked.bank.orders.iter().position(|&one| one == order)?;
        Some(((looked.bank.half as f64 / wanted).ln().abs(), (place, candidate)))
    });
    candidates.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, found)| found)
}

/// Half-widths from the shortest on, each √2 times the last, of windows that are at most half the record.
fn ladder_of_windows(samples: usize, shortest: usize) -> impl Iterator<Item = usize> {
    let half = move |index: i32| rounded(shortest as f64 * (0.5 * f64::from(index)).exp2());
    (0..).map(half).take_while(move |&half| 2 * half < samples / 2 && half <= LONGEST)
}

/// The nearest whole number, of one that is neither negative nor large.
pub(crate) fn rounded(number: f64) -> usize {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "as the name says")]
    let whole = number.round() as usize;
    whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::auto_derivatives::block_means::Grid;
    use crate::simd::instructions::Instructions;

    #[test]
    fn a_window_is_judged_where_it_and_what_it_is_compared_with_fit() {
        let noise = CorrelatedNoise::white(0.0);
        let target = Target {
            derivative: 1,
            highest: 3,
            fixed: false,
            shortest: 4,
            of_means: false,
            delta: 1.0,
            noise: &noise,
            instructions: Instructions::current(),
        };
        let surveyed = |half: usize, outside: f64, inside: f64| {
            let bank = Bank::new(half, &target).expect("little memory").expect("a window of enough samples");
            let row: Vec<f64> =
                (0..100).map(|place| if (30..70).contains(&place) { inside } else { outside }).collect();
            let rows = vec![row; bank.orders.len()];
            Surveyed::new(bank, rows, Grid::new(100, 1))
        };
        // The longest fits in the middle only, and what all are compared with is far off wherever it does not.
        let (reference, short, long) = (surveyed(4, 9.0, 0.0), surveyed(8, 0.0, 0.1), surveyed(30, f64::NAN, 0.3));
        let reference = reference.compared(0);
        let of_short = judge(&reference, &short, None, 0.0, &noise)[0];
        let of_long = judge(&reference, &long, Some(of_short), 0.0, &noise)[0].risk;
        let of_short = of_short.risk;
        assert!((of_short - 0.6 * 81.0 - 0.4 * 0.01).abs() < 1e-12);
        assert!((of_long - of_short - (0.09 - 0.01)).abs() < 1e-12);
        // The other way round as well.
        let alone = judge(&reference, &long, None, 0.0, &noise)[0];
        let beside = judge(&reference, &short, Some(alone), 0.0, &noise)[0].risk;
        let alone = alone.risk;
        assert!((alone - beside - (0.09 - 0.01)).abs() < 1e-12);
    }
}
