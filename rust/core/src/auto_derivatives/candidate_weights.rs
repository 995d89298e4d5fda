//! The weight of every candidate in every block of a record, from its local risk.

use std::ops::Range;

use crate::auto_derivatives::block_means::{BlockMeans, COARSER, Grid};
use crate::auto_derivatives::candidates::{Bank, Target, correlated};
use crate::auto_derivatives::differences::{SquaredDifferences, known_squared_distance};
use crate::auto_derivatives::global_choice::{OPTIMISM, Pair, rounded};
use crate::auto_derivatives::survey::CLOSELY;
use crate::auto_derivatives::symmetric_grid::Blocks;
use crate::error::Error;
use crate::local_polynomials::coefficients::{CoefficientScratch, Projected};
use crate::simd::f64x8::WIDTH;
use crate::simd::instructions::Instructions;
use crate::simd::vectors::dispatch;

/// The windows over the record's best.
const WINDOWS: [f64; 5] = [0.125, 0.25, 0.5, 1.0, 2.0];

/// The reference has a window so much shorter.
const REFERENCE: f64 = 1.189_207_115_002_721;

/// Half-widths of the best window in half a neighbourhood, and blocks in a half-width.
const NEIGHBOURHOOD: f64 = 5.0;
const BLOCKS: usize = 4;

/// Samples in a block of records that are not short, at least: sums over more blocks cost more than the estimates in them.
const SHORTEST_BLOCK: usize = 7;

/// Samples that are worked on from sums to averages before the next are, at least, and in reaches of a block: so little is kept, and little is summed
/// twice.
const CHUNK: usize = 1 << 17;
const REACHES: f64 = 16.0;

/// Samples in a piece of work, at least, and in runs of the longest window: what a run computes before and after a piece is lost. Rows of some twenty
/// candidates stay in the second nearest cache.
const PIECE: usize = 1 << 13;
const RUNS: usize = 2;

/// A piece is longer by as many samples as a mean has, but not by more.
const MOST_IN_MEANS: usize = 3;

/// Places in a half-width at which candidates are compared, at least, and samples from one to the next, at most. The shortest wave that order 15
/// follows is `2π/15` half-widths long, three places: mean squares over them are nearly those over all samples.
const PLACES: usize = 8;
const LONGEST_STEP: usize = 9;

/// Places in a half-width of the record's best window, at least: the weights of shorter windows are decided by far more than they scatter.
const PLACES_OF_BEST: usize = 12;

/// The candidates of a record's neighbourhoods.
#[derive(Debug)]
pub(crate) struct Refinement {
    pub(crate) banks: Vec<Bank>,
    reference: Reference,
    pub(crate) blocks: Blocks,
    pub(crate) samples: usize,
    /// Half-width of the record's best window, and samples in half a neighbourhood.
    pub(crate) half: usize,
    pub(crate) reach: f64,
    /// By candidate of all banks: twice the covariance with the reference and what optimism adds; variance of the difference from the
    /// reference; `T`; variance; order.
    pub(crate) offsets: Vec<f64>,
    pub(crate) differences: Vec<f64>,
    pub(crate) temperatures: Vec<f64>,
    pub(crate) variances: Vec<f64>,
    pub(crate) orders: Vec<u8>,
    pub(crate) instructions: Instructions,
}

/// The reference that candidates are compared with.
#[derive(Debug)]
pub(crate) struct Reference {
    /// Of one candidate.
    pub(crate) bank: Bank,
}

impl Reference {
    /// The same order in a window so much shorter, or else in the same window.
    ///
    /// # Errors
    /// If there is not the memory.
    pub(crate) fn new(pair: Pair, shorter: f64, target: &Target<'_>) -> Result<Option<Self>, Error> {
        for half in [rounded(pair.half as f64 / shorter).max(target.shortest), pair.half] {
            let Some(bank) = Bank::new(half, target)? else { continue };
            if let Some(candidate) = bank.orders.iter().position(|&order| order == pair.order) {
                return Ok(Some(Self { bank: bank.only(candidate) }));
            }
        }
        Ok(None)
    }
}

/// Memory of one thread.
pub(crate) struct AverageScratch {
    pub(crate) banks: Vec<CoefficientScratch>,
    reference: CoefficientScratch,
    /// One for all banks: it stays near the processor.
    pub(crate) projected: Projected,
    /// The reference at its own places and at those of a bank.
    compare: Vec<f64>,
    compare_at: Vec<f64>,
    /// The places of every block, and the sums over them.
    parts: Vec<Range<usize>>,
    squares: Vec<f64>,
    /// Candidates at all samples of a run, or at their own means.
    pub(crate) rows: Vec<Vec<f64>>,
    /// By bank, the first of these means.
    pub(crate) firsts: Vec<usize>,
    /// The samples at which the rows of all candidates are known, where they are those that were compared.
    pub(crate) kept: Option<Range<usize>>,
}

impl Refinement {
    /// Prepares the candidates around a record's best pair.
    ///
    /// # Errors
    /// If there is not the memory.
    pub(crate) fn new(samples: usize, pair: Pair, target: &Target<'_>) -> Result<Option<Self>, Error> {
        let variance = target.noise.variance();
        let half = pair.half as f64;
        let Some(reference) = Reference::new(pair, REFERENCE, target)? else { return Ok(None) };
        let mut halves: Vec<usize> = WINDOWS.iter().map(|ratio| rounded(half * ratio)).collect();
        halves.dedup();
        halves.retain(|&half| half >= target.shortest && 2 * half < samples / 2);
        let mut banks = Vec::new();
        for half in halves {
            banks.extend(Bank::new(half, target)?);
        }
        let reference_gain = reference.bank.gains[0];
        let (mut offsets, mut differences, mut temperatures) = (Vec::new(), Vec::new(), Vec::new());
        let (mut variances, mut orders) = (Vec::new(), Vec::new());
        for bank in &banks {
            let compared = correlated(reference.bank.kernel(0), bank.half, target.noise);
            let shared = bank.products(&compared);
            for ((gain, leverage), shared) in bank.gains.iter().zip(&bank.leverages).zip(shared) {
                offsets.push(variance * (2.0 * shared + (OPTIMISM - 1.0) * gain));
                differences.push(variance * (gain + reference_gain - 2.0 * shared));
                temperatures.push((3.0 * variance * gain / leverage).max(f64::MIN_POSITIVE));
                variances.push(variance * gain);
            }
            orders.extend(bank.orders.iter().map(|&order| u8::try_from(order).unwrap_or(u8::MAX)));
        }
        let shortest = if samples > CLOSELY { SHORTEST_BLOCK } else { 1 };
        let blocks = Blocks::new(samples, (pair.half / BLOCKS).max(shortest));
        let reach = NEIGHBOURHOOD * half;
        let half = pair.half;
        Ok(Some(Self {
            banks,
            reference,
            blocks,
            samples,
            half,
            reach,
            offsets,
            differences,
            temperatures,
            variances,
            orders,
            instructions: target.instructions,
        }))
    }

    /// Ranges of blocks that are worked on one after the other.
    pub(crate) fn chunks(&self) -> impl Iterator<Item = Range<usize>> + use<> {
        self.together(&(0..self.blocks.count()), CHUNK.max(rounded(REACHES * self.reach)))
    }

    /// Ranges of some blocks that form one piece of work: of as many means as there would be samples.
    pub(crate) fn pieces(&self, blocks: &Range<usize>) -> impl Iterator<Item = Range<usize>> + use<> {
        let step = self.banks.iter().map(|bank| bank.step).max().unwrap_or(1).min(MOST_IN_MEANS);
        let run = self.banks.iter().filter(|bank| bank.step <= step).map(Bank::run).max().unwrap_or(0);
        self.together(blocks, (PIECE * step).max(RUNS * run))
    }

    /// Ranges of some blocks, of about so many samples each.
    fn together(&self, blocks: &Range<usize>, samples: usize) -> impl Iterator<Item = Range<usize>> + use<> {
        let (end, count) = (blocks.end, samples.div_ceil(self.blocks.length));
        blocks.clone().step_by(count).map(move |first| first..(first + count).min(end))
    }

    /// Some blocks and so many on either side, as far as there are.
    pub(crate) fn blocks_around(&self, blocks: &Range<usize>, more: usize) -> Range<usize> {
        blocks.start.saturating_sub(more)..(blocks.end + more).min(self.blocks.count())
    }

    /// Blocks in half a neighbourhood.
    pub(crate) fn reach(&self) -> usize {
        rounded((self.reach / self.blocks.length as f64).floor())
    }

    pub(crate) fn samples(&self, blocks: &Range<usize>) -> Range<usize> {
        self.blocks.samples(blocks.start).start..self.blocks.samples(blocks.end - 1).end
    }

    pub(crate) fn scratch(&self) -> AverageScratch {
        AverageScratch {
            banks: self.banks.iter().map(|_| CoefficientScratch::default()).collect(),
            reference: CoefficientScratch::default(),
            projected: Projected::default(),
            compare: Vec::new(),
            compare_at: Vec::new(),
            parts: Vec::new(),
            squares: Vec::new(),
            rows: vec![Vec::new(); self.offsets.len()],
            firsts: vec![0; self.banks.len()],
            kept: None,
        }
    }

    /// Numbers of a block, one for every candidate and some more to fill whole vectors.
    pub(crate) fn stride(&self) -> usize {
        self.offsets.len().next_multiple_of(WIDTH)
    }

    /// Whether candidates are compared at every sample: then neighbourhoods are short beside pieces, and what is compared is what is averaged.
    pub(crate) fn at_every_sample(&self) -> bool {
        self.banks.iter().all(|bank| self.step(bank) == 1)
    }

    /// Sums the squared differences from the reference over the places in every block, and counts the places that can be compared: candidate by
    /// candidate, and bank by bank, for each block.
    pub(crate) fn compare(
        &self,
        means: &BlockMeans<'_>,
        blocks: Range<usize>,
        sums: &mut [f64],
        counts: &mut [f64],
        scratch: &mut AverageScratch,
    ) {
        let (samples, own) = (self.samples(&blocks), &self.reference);
        let finest = self.banks.iter().map(|bank| self.step(bank)).min().unwrap_or(own.bank.step);
        let AverageScratch { banks, reference, projected, compare, compare_at, parts, squares, .. } = scratch;
        let (kept_rows, mut kept) = (&mut scratch.rows, Vec::new());
        scratch.kept = None;
        let every = Grid::new(self.samples, finest);
        let (known, centres) = own.bank.places(self.samples, every, &every.means(&samples));
        compare.clear();
        if known.is_empty() {
            return;
        }
        let estimates = own.bank.estimates(means, centres, finest / own.bank.step, reference, projected);
        std::mem::swap(compare, &mut estimates[0]);
        let mut column = 0;
        for (index, (bank, scratch)) in self.banks.iter().zip(banks).enumerate() {
            let grid = Grid::new(self.samples, self.step(bank));
            let of_reference = grid.means(&(every.sample(known.start)..every.sample(known.end - 1) + 1));
            let (places, centres) = bank.places(self.samples, grid, &of_reference);
            if !places.is_empty() {
                let first = (grid.sample(places.start) - every.first) / finest - known.start;
                let compare_at = if grid.step == finest {
                    &compare[first..first + places.len()]
                } else {
                    compare_at.clear();
                    compare_at.extend(compare[first..].iter().step_by(grid.step / finest).take(places.len()));
                    &*compare_at
                };
                let rows = bank.estimates(means, centres, grid.step / bank.step, scratch, projected);
                let blocks_here =
                    self.blocks.of(grid.sample(places.start))..self.blocks.of(grid.sample(places.end - 1)) + 1;
                parts.clear();
                parts.extend(blocks_here.clone().map(|block| {
                    let part = grid.means(&self.blocks.samples(block));
                    part.start.max(places.start) - places.start..part.end.min(places.end) - places.start
                }));
                let differences = SquaredDifferences { rows, compare: compare_at, parts, sums: squares };
                dispatch(self.instructions, differences);
                for ((block, part), squares) in blocks_here.zip(&*parts).zip(squares.chunks_exact(rows.len())) {
                    let from = block - blocks.start;
                    let sums = &mut sums[from * self.stride() + column..];
                    let mut count = part.len() as f64;
                    for ((row, &square), sum) in rows.iter().zip(squares).zip(sums) {
                        // NaN of a bank is NaN of all its rows.
                        let known = if square.is_nan() {
                            known_squared_distance(row, compare_at, part)
                        } else {
                            (square, count)
                        };
                        *sum += known.0;
                        count = known.1;
                    }
                    counts[from * self.banks.len() + index] += count;
                }
                if grid.step == 1 {
                    kept_rows[column..].iter_mut().zip(rows).for_each(|(kept, row)| std::mem::swap(kept, row));
                    kept.push(places);
                }
            }
            column += bank.orders.len();
        }
        let same = kept.len() == self.banks.len() && kept.iter().all(|places| *places == kept[0]);
        scratch.kept = kept.pop().filter(|_| same);
    }

    /// The means that a bank's windows are made of.
    pub(crate) fn grid(&self, bank: usize) -> Grid {
        Grid::new(self.samples, self.banks[bank].step)
    }

    /// The candidates of a bank.
    pub(crate) fn candidates_of(&self, bank: usize) -> Range<usize> {
        let first: usize = self.banks[..bank].iter().map(|bank| bank.orders.len()).sum();
        first..first + self.banks[bank].orders.len()
    }

    /// The bank of a candidate.
    pub(crate) fn bank_of(&self, candidate: usize) -> usize {
        (0..self.banks.len()).find(|&bank| candidate < self.candidates_of(bank).end).unwrap_or(0)
    }

    /// Samples from one place to the next at which the candidates of a bank are compared.
    fn step(&self, bank: &Bank) -> usize {
        let wanted = match self.samples {
            ..=CLOSELY => 1,
            _ => (bank.half / PLACES).clamp(1, LONGEST_STEP).max(self.half / PLACES_OF_BEST),
        };
        COARSER.pow(wanted.ilog(COARSER)).max(bank.step).max(self.reference.bank.step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::correlated::CorrelatedNoise;
    use crate::noise::quantisation::tests::uniform;

    #[test]
    fn a_few_places_tell_what_all_samples_do() {
        let samples = 20_000;
        let noisy = |(i, e): (usize, f64)| (i as f64 / 300.0).sin() + 0.1 * e;
        let record: Vec<f64> = uniform(samples).into_iter().enumerate().map(noisy).collect();
        let (record, noise) = (record.as_slice(), CorrelatedNoise::white(0.01 / 12.0));
        let means = BlockMeans::new(&record, 200).expect("little memory");
        for derivative in 0..3 {
            let instructions = Instructions::current();
            let target = Target {
                derivative,
                highest: 15,
                fixed: false,
                shortest: 4,
                of_means: true,
                delta: 1.0,
                noise: &noise,
                instructions,
            };
            let of = Refinement::new(samples, Pair { half: 100, order: derivative + 2 }, &target);
            let of = of.expect("little memory").expect("long enough");
            let (mut sums, mut counts) =
                (vec![0.0; of.blocks.count() * of.stride()], vec![0.0; of.blocks.count() * of.banks.len()]);
            of.compare(&means, 0..of.blocks.count(), &mut sums, &mut counts, &mut of.scratch());
            let mut column = 0;
            for (index, bank) in of.banks.iter().enumerate() {
                let grid = Grid::new(samples, bank.step.max(of.reference.bank.step));
                let inside = grid.means(&(400..samples - 400));
                let at = |bank: &Bank| (bank.places(samples, grid, &inside).1, grid.step / bank.step);
                let ((own, every), (centres, every_centre)) = (at(bank), at(&of.reference.bank));
                let (mut scratch, mut reference) = (CoefficientScratch::default(), CoefficientScratch::default());
                let (mut of_reference, mut of_bank) = (Projected::default(), Projected::default());
                let compare =
                    of.reference.bank.estimates(&means, centres, every_centre, &mut reference, &mut of_reference);
                let rows = bank.estimates(&means, own, every, &mut scratch, &mut of_bank);
                let count: f64 = counts[index..].iter().step_by(of.banks.len()).sum();
                assert!(count > (samples / 10) as f64);
                for row in rows {
                    let compare = &compare[0];
                    let (all, of_all) = known_squared_distance(row, compare, &(0..row.len()));
                    let few: f64 = sums[column..].iter().step_by(of.stride()).sum();
                    let ratio = few / count / (all / of_all);
                    // As much as a mean square over so many places scatters if no place tells of another.
                    let chance = 3.5 * (2.0 / count).sqrt();
                    assert!((ratio - 1.0).abs() < chance, "{derivative}, {}: {ratio}", bank.half);
                    column += 1;
                }
            }
        }
    }
}
