//! Averages of candidates where windows are long: at their means, and in between by interpolation.
//!
//! Each bank is averaged on the grid of its own means, coarsest first, and brought onto the next finer grid by Lagrange's polynomials through eight
//! means. Half a window has at least 48 of them, so that is exact to 1e-8 of what an order of 15 does not follow. Weights have corners, which no polynomial
//! follows: of each grid one candidate is brought to all samples alone and weighted there, and only what the others differ from it by is weighted before.
//!
//! Standard errors are computed at a few places and are linear in between.

use std::ops::Range;

use crate::auto_derivatives::block_means::{BlockMeans, COARSER, Grid};
use crate::auto_derivatives::candidate_weights::{AverageScratch, Refinement};
use crate::auto_derivatives::local_weights::{DerivativeOutputs, LocalWeights};
use crate::auto_derivatives::symmetric_grid::within;

/// Means that a number in between is made of.
pub(crate) const POINTS: usize = 8;

/// Means of the coarsest grid on either side of a sample that it depends on, with those of all finer grids: 4 · (1 + 1/3 + 1/9 …), and one for errors.
const MARGIN: usize = 7;

/// Places in a half-width of the record's best window at which standard errors are computed, at least.
const ERRORS: usize = 16;

/// Numbers at consecutive means of a grid.
pub(crate) struct Line {
    pub(crate) grid: Grid,
    pub(crate) first: usize,
    pub(crate) values: Vec<f64>,
}

impl Line {
    fn means(&self) -> Range<usize> {
        self.first..self.first + self.values.len()
    }

    /// The same on the next finer grid, as far as there are means on both sides.
    pub(crate) fn finer(&self, grid: Grid) -> Self {
        let third = weights(1.0 / COARSER as f64 + (POINTS / 2 - 1) as f64);
        let from = self.first + POINTS / 2 - 1;
        let first = (self.grid.sample(from) - grid.first) / grid.step;
        let mut values = vec![0.0; COARSER * (self.values.len() + 1).saturating_sub(POINTS)];
        for (three, around) in values.chunks_exact_mut(COARSER).zip(self.values.windows(POINTS)) {
            let (mut after, mut before) = (0.0, 0.0);
            for i in 0..POINTS {
                after += third[i] * around[i];
                before += third[POINTS - 1 - i] * around[i];
            }
            three.copy_from_slice(&[around[POINTS / 2 - 1], after, before]);
        }
        Self { grid, first, values }
    }

    /// The number at a sample; NaN where there are no eight means around it, or one of them is NaN.
    pub(crate) fn at(&self, sample: usize, stencil: &Stencil) -> f64 {
        let (grid, count) = (self.grid, self.values.len());
        let Some(place) = sample.checked_sub(grid.sample(self.first)) else { return f64::NAN };
        if place % grid.step == 0 {
            return self.values.get(place / grid.step).copied().unwrap_or(f64::NAN);
        }
        if count < POINTS || place > (count - 1) * grid.step {
            return f64::NAN;
        }
        let (first, weights) = stencil.at(place, count);
        self.values[first..first + POINTS].iter().zip(weights).map(|(value, weight)| value * weight).sum()
    }

    /// Numbers at some samples, linear in between.
    fn linear(&self, samples: &Range<usize>) -> impl Iterator<Item = f64> {
        let (grid, first) = (self.grid, self.first);
        samples.clone().map(move |sample| {
            let (mean, rest) = ((sample - grid.first) / grid.step, (sample - grid.first) % grid.step);
            let (here, next) = (self.values[mean - first], self.values[mean - first + 1]);
            here + (next - here) * (rest as f64 / grid.step as f64)
        })
    }
}

/// The weights of eight equidistant numbers in the value at a place, counted from the first.
fn weights(place: f64) -> [f64; POINTS] {
    std::array::from_fn(|i| {
        let others = (0..POINTS).filter(|&other| other != i);
        others.map(|other| (place - other as f64) / (i as f64 - other as f64)).product()
    })
}

/// The weights of eight means in what lies at the samples between them.
pub(crate) struct Stencil {
    step: usize,
    /// By sample after the fourth of the eight.
    in_the_middle: Vec<[f64; POINTS]>,
}

impl Stencil {
    pub(crate) fn new(step: usize) -> Self {
        let of = |rest: usize| weights((POINTS / 2 - 1) as f64 + rest as f64 / step as f64);
        Self { step, in_the_middle: (0..step).map(of).collect() }
    }

    /// The first of the eight means, and their weights, at a sample counted from the first of so many means.
    fn at(&self, sample: usize, count: usize) -> (usize, [f64; POINTS]) {
        let (mean, rest) = (sample / self.step, sample % self.step);
        let first = mean.saturating_sub(POINTS / 2 - 1).min(count - POINTS);
        if first + POINTS / 2 - 1 == mean {
            return (first, self.in_the_middle[rest]);
        }
        (first, weights((mean - first) as f64 + rest as f64 / self.step as f64))
    }
}

/// Fills a row of samples from numbers at means, wherever there are eight beside each other. All of a bank are missing at the same places.
pub(crate) fn fill_between(
    rows: &mut [Vec<f64>],
    samples: &Range<usize>,
    grid: Grid,
    first: usize,
    known: &[Vec<f64>],
) {
    let Some(one) = known.first() else { return };
    let stencil = Stencil::new(grid.step);
    let mut begin = 0;
    while begin < one.len() {
        let count = one[begin..].iter().take_while(|value| !value.is_nan()).count();
        if count >= POINTS {
            let (from, to) = (grid.sample(first + begin), grid.sample(first + begin + count - 1));
            for sample in within(samples, &(from..to + 1)) {
                let (first, weights) = stencil.at(sample - from, count);
                for (row, known) in rows.iter_mut().zip(known) {
                    let around = &known[begin + first..begin + first + POINTS];
                    row[sample - samples.start] =
                        around.iter().zip(&weights).map(|(value, weight)| value * weight).sum();
                }
            }
        }
        begin += count.max(1);
    }
}

impl Refinement {
    /// Averages some samples where every candidate used fits around them, and returns the ranges that it left out.
    pub(crate) fn interpolate(
        &self,
        means: &BlockMeans<'_>,
        samples: &Range<usize>,
        local: &LocalWeights<'_>,
        outputs: &mut DerivativeOutputs<'_>,
        scratch: &mut AverageScratch,
    ) -> Vec<Range<usize>> {
        let steps = self.banks.iter().zip(local.banks(self)).filter(|(_, used)| *used).map(|(bank, _)| bank.step);
        let Some(coarsest) = steps.max().filter(|&step| step > 1) else { return vec![samples.clone()] };
        let margin = self.margin(coarsest);
        let around = samples.start.saturating_sub(margin)..(samples.end + margin).min(self.samples);
        // Where a window does not fit, all that depends on it is left out.
        let mut left_out = Vec::new();
        let mut leave_out = |missing: Range<usize>| {
            let part = within(samples, &(missing.start.saturating_sub(margin)..missing.end + margin));
            left_out.extend(Some(part).filter(|part| !part.is_empty()));
        };
        for (bank, _) in local.banks(self).enumerate().filter(|(_, used)| *used) {
            let grid = self.grid(bank);
            let (first, row) = self.fill_own(means, bank, &around, scratch);
            let known = &scratch.rows[row];
            if known.is_empty() {
                return vec![samples.clone()];
            }
            // The first mean that is missing on either side.
            let to = grid.sample(first + known.len());
            if let Some(from) = grid.sample(first).checked_sub(grid.step).filter(|&from| from >= around.start) {
                leave_out(around.start..from + 1);
            }
            if to < around.end {
                leave_out(to..around.end);
            }
            for (mean, _) in known.iter().enumerate().filter(|(_, value)| value.is_nan()) {
                leave_out(grid.sample(first + mean)..grid.sample(first + mean) + 1);
            }
        }
        left_out.sort_by_key(|part| part.start);
        let mut rest: Vec<Range<usize>> = Vec::new();
        for part in left_out {
            match rest.last_mut().filter(|last| last.end >= part.start) {
                Some(last) => last.end = last.end.max(part.end),
                None => rest.push(part),
            }
        }
        let mut done = samples.start;
        for part in rest.iter().cloned().chain(std::iter::once(samples.end..samples.end)) {
            if done < part.start {
                self.interpolate_run(done..part.start, samples.start, local, outputs, scratch);
            }
            done = part.end;
        }
        rest
    }

    /// Averages a run of samples, where all candidates used are known around them.
    fn interpolate_run(
        &self,
        run: Range<usize>,
        begin: usize,
        local: &LocalWeights<'_>,
        outputs: &mut DerivativeOutputs<'_>,
        scratch: &AverageScratch,
    ) {
        let used: Vec<usize> = local.used.iter().enumerate().filter(|(_, used)| **used).map(|(one, _)| one).collect();
        let step_of = |candidate: usize| self.banks[self.bank_of(candidate)].step;
        let Some(coarsest) = used.iter().map(|&one| step_of(one)).max() else { return };
        let (mut bases, mut sum): (Vec<(usize, Line)>, Option<Line>) = (Vec::new(), None);
        let mut step = coarsest;
        loop {
            let grid = Grid::new(self.samples, step);
            for (_, line) in &mut bases {
                *line = line.finer(grid);
            }
            let mut line = sum.map_or_else(
                || {
                    let margin = MARGIN * step;
                    let part = grid.means(&(run.start.saturating_sub(margin)..(run.end + margin).min(self.samples)));
                    Line { grid, first: part.start, values: vec![0.0; part.len()] }
                },
                |sum| sum.finer(grid),
            );
            let own = || used.iter().copied().filter(|&one| step_of(one) == step);
            if let Some(base) = own().max_by(|&a, &b| local.total(a).total_cmp(&local.total(b))) {
                let of_base = self.on(grid, line.means(), base, scratch);
                for one in own().filter(|&one| one != base) {
                    self.add_difference(&mut line, &of_base, one, local, scratch);
                }
                bases.push((step, of_base));
            }
            sum = Some(line);
            if step == 1 {
                break;
            }
            step /= COARSER;
        }
        let Some(line) = sum else { return };
        let values = &mut outputs.values[run.start - begin..run.end - begin];
        values.copy_from_slice(&line.values[run.start - line.first..][..run.len()]);
        for (step, base) in &bases {
            let base = &base.values[run.start - base.first..];
            self.between_centres(line.grid, run.clone(), |part, place| {
                let own = used.iter().filter(|&&one| step_of(one) == *step).map(|&one| local.weight(one, place));
                let (weight, growth) = own.fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
                if weight == 0.0 && growth == 0.0 {
                    return;
                }
                let (part, growth) = (part.start - run.start..part.end - run.start, growth * place.advance);
                let numbers = values[part.clone()].iter_mut().zip(&base[part]);
                numbers.enumerate().for_each(|(i, (value, base))| *value += (weight + growth * i as f64) * base);
            });
        }
        self.errors_of_run(&run, begin, &used, local, outputs, scratch);
    }

    /// A candidate on a grid that is not finer than its own.
    fn on(&self, grid: Grid, means: Range<usize>, candidate: usize, scratch: &AverageScratch) -> Line {
        let bank = self.bank_of(candidate);
        let own = self.grid(bank);
        let row = &scratch.rows[candidate];
        let from = (grid.sample(means.start) - own.first) / own.step - scratch.firsts[bank];
        let values = row[from..].iter().step_by(grid.step / own.step).take(means.len()).copied().collect();
        Line { grid, first: means.start, values }
    }

    /// Adds what a candidate differs from another of its grid by, times its weight.
    fn add_difference(
        &self,
        line: &mut Line,
        base: &Line,
        candidate: usize,
        local: &LocalWeights<'_>,
        scratch: &AverageScratch,
    ) {
        let (grid, means) = (line.grid, line.means());
        let row = &scratch.rows[candidate][means.start - scratch.firsts[self.bank_of(candidate)]..];
        let base = &base.values[means.start - base.first..];
        self.between_centres(grid, means.clone(), |part, place| {
            let (weight, growth) = local.weight(candidate, place);
            if weight == 0.0 && growth == 0.0 {
                return;
            }
            let part = part.start - means.start..part.end - means.start;
            let growth = growth * place.advance;
            let numbers = line.values[part.clone()].iter_mut().zip(row[part.clone()].iter().zip(&base[part]));
            for (i, (sum, (value, base))) in numbers.enumerate() {
                *sum += (weight + growth * i as f64) * (value - base);
            }
        });
    }

    /// Standard errors and orders of a run.
    fn errors_of_run(
        &self,
        run: &Range<usize>,
        begin: usize,
        used: &[usize],
        local: &LocalWeights<'_>,
        outputs: &mut DerivativeOutputs<'_>,
        scratch: &AverageScratch,
    ) {
        let coarsest = used.iter().map(|&one| self.banks[self.bank_of(one)].step).max().unwrap_or(1);
        let grid = Grid::new(self.samples, self.errors_step(coarsest));
        let part = grid.means(&((run.start + 1).saturating_sub(grid.step)..run.end + grid.step));
        let (count, zeros) = (part.len(), vec![0.0; part.len()]);
        let rows: Vec<Line> = used.iter().map(|&one| self.on(grid, part.clone(), one, scratch)).collect();
        let (mut values, mut squares, mut largest) = (zeros.clone(), zeros.clone(), zeros);
        let mut order = vec![0; count];
        self.between_centres(grid, part.clone(), |places, place| {
            let places = places.start - part.start..places.end - part.start;
            let active: Vec<_> =
                used.iter().zip(&rows).map(|(&one, row)| (one, local.weight(one, place), row)).collect();
            let active = active.iter().filter(|(_, weight, _)| *weight != (0.0, 0.0));
            for &(one, (weight, growth), row) in active.clone() {
                for (i, at) in places.clone().enumerate() {
                    let weight = weight + growth * (place.advance * i as f64);
                    values[at] += weight * row.values[at];
                    if weight > largest[at] {
                        (largest[at], order[at]) = (weight, self.orders[one]);
                    }
                }
            }
            for &(one, (weight, growth), row) in active {
                let (bias, more) = local.bias(one, place);
                for (i, at) in places.clone().enumerate() {
                    let distance = place.advance * i as f64;
                    let away = row.values[at] - values[at];
                    let square = bias + more * distance + self.variances[one] + away * away;
                    squares[at] += (weight + growth * distance) * square;
                }
            }
        });
        let inside = run.start - begin..run.end - begin;
        if !outputs.errors.is_empty() {
            let errors = Line { grid, first: part.start, values: squares.iter().map(|square| square.sqrt()).collect() };
            outputs.errors[inside.clone()].iter_mut().zip(errors.linear(run)).for_each(|(slot, error)| *slot = error);
        }
        if !outputs.order.is_empty() {
            let nearest = |sample: usize| (sample + grid.step / 2 - grid.first) / grid.step - part.start;
            let samples = outputs.order[inside].iter_mut().zip(run.clone());
            samples.for_each(|(slot, sample)| *slot = order[nearest(sample)]);
        }
    }

    /// Samples on either side of one that it depends on, where means have at most so many.
    fn margin(&self, coarsest: usize) -> usize {
        (MARGIN * coarsest).max(2 * self.errors_step(coarsest))
    }

    /// Blocks whose weights the averages of others depend on, on either side.
    pub(crate) fn blocks_beside(&self) -> usize {
        let coarsest = self.banks.iter().map(|bank| bank.step).max().unwrap_or(1);
        self.margin(coarsest) / self.blocks.length + 2
    }

    /// Samples from one place to the next at which standard errors are computed.
    fn errors_step(&self, coarsest: usize) -> usize {
        COARSER.pow((self.half / ERRORS).max(1).ilog(COARSER)).max(coarsest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eight_means_follow_a_polynomial_of_degree_seven() {
        let (coarse, fine) = (Grid::new(999, 9), Grid::new(999, 3));
        let polynomial = |sample: usize| (sample as f64 / 500.0 - 1.0).powi(7);
        let values: Vec<f64> = (0..coarse.count).map(|mean| polynomial(coarse.sample(mean))).collect();
        let finer = Line { grid: coarse, first: 0, values: values.clone() }.finer(fine);
        assert_eq!(finer.values.len(), 3 * (coarse.count - POINTS + 1));
        for (mean, value) in (finer.first..).zip(&finer.values) {
            assert!((value - polynomial(fine.sample(mean))).abs() < 8.0 * f64::EPSILON);
        }
        // Without what is missing, and as far as there are means.
        let mut known = values;
        known[60] = f64::NAN;
        let mut rows = vec![vec![f64::NAN; 999]];
        fill_between(&mut rows, &(0..999), coarse, 0, &[known]);
        let missing = coarse.sample(59) + 1..coarse.sample(61);
        for (sample, value) in rows[0].iter().enumerate() {
            let inside = (coarse.first..=coarse.sample(coarse.count - 1)).contains(&sample);
            assert_eq!(value.is_nan(), !inside || missing.contains(&sample), "sample {sample}");
            // Beside what is missing seven of eight means are on one side.
            assert!(value.is_nan() || (value - polynomial(sample)).abs() < 200.0 * f64::EPSILON, "sample {sample}");
        }
    }
}
