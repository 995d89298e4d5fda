//! A test of whether a constant coefficient is the same in all parts of the record.
//!
//! Each constant is estimated separately in eight blocks of the record. If it does not change, the squared differences
//! between the blocks, over the variances that the noise explains, follow a χ² distribution (Wald's test). Windows that are too long for a
//! block are cut to it: each block is then a record of its own.
//!
//! Coloured noise scatters estimates more than its variance tells. Where blocks differ, short parts of them are compared with their
//! neighbours as well: what changes slowly hardly differs there. If those scatter more than noise explains, the blocks have to differ by more
//! than that (analysis of variance, Fisher's F).
//!
//! A line in the place of a constant of the motion, beside the windows of the whole record, loses nothing where blocks are hardly longer than
//! these: what a window takes, every block loses. Its slope over its standard error has one degree of freedom, where eight blocks have seven.
//!
//! Where no torque acts the equation is homogeneous: in a free decay, or at rest, it holds for any multiple of the parameters, and least squares finds
//! the smallest, zero. Parts whose torque is no more than its noise are left out, and of a block the longest run of others stands for it. Where a hammer
//! strikes now and then, the torque of most samples is noise in every part: blocks that are struck stand as they are then, as what rings was set in motion there.

use std::ops::Range;

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use crate::error::Error;
use crate::exec::pool::Piece;
use crate::exec::stages::Stages;
use crate::inference::drive::{Drive, drive, longest_run};
use crate::inference::part_constants::{Estimate, NoiseFrom, TestNoise, estimate};
use crate::noise::median::{MEDIAN_OF_SQUARES, median};
use crate::regression::fit::Fit;
use crate::regression::problem::Problem;
use crate::simd::instructions::Instructions;

/// Blocks that a record is cut into.
pub(crate) const BLOCKS: usize = 8;

/// Parts of a block that are compared with their neighbours.
const PARTS: usize = 8;

/// The scatter of parts, over that which noise explains, from which on it is no chance, and the degrees of freedom that the median of all
/// knows it with.
const SCATTERED: f64 = 2.0;
const FREEDOM: f64 = 10.0;

/// Parts that say how much neighbours scatter, at least; so many must be driven.
const FEWEST_DRIVEN: usize = 2 * PARTS;

/// Probability below which a difference is significant: once in 2000 records.
pub const NO_CHANCE: f64 = 5e-4;

/// The same for a line beside what blocks say: both together find what is not there hardly more often than blocks alone.
const NO_CHANCE_OF_A_LINE: f64 = 0.1 * NO_CHANCE;

/// The part of a constant that was to vary if it does by which parts of a record must differ to contradict it: next to no noise shows less, which curves
/// beside it leave.
pub const HARDLY_DIFFERS: f64 = 0.01;

/// The result of the test of one constant.
#[derive(Clone, Debug, PartialEq)]
pub struct Test {
    /// Probability that a constant coefficient differs as much between the blocks.
    pub probability: f64,
    /// Standard deviation between the blocks beyond what noise explains, over the mean.
    pub spread: f64,
    /// The same in the units of the constant.
    pub deviation: f64,
    /// The χ² of the difference over its degrees of freedom, and those.
    squares: f64,
    freedom: usize,
}

/// What a constant gains from the middle of the record to its end, where it may follow a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Trend {
    pub(crate) value: f64,
    pub(crate) growth: f64,
    pub(crate) error: f64,
}

impl Trend {
    /// The square of the growth over its variance.
    pub(crate) fn excess(self) -> f64 {
        (self.growth / self.error).powi(2)
    }

    /// Whether noise of the channels makes as much by no chance.
    pub(crate) fn is_conspicuous(self) -> bool {
        chi_squared_beyond(self.excess(), 1) < NO_CHANCE_OF_A_LINE
    }

    /// What it says of the constant.
    fn test(self, from: NoiseFrom) -> Test {
        let squares = self.excess();
        let probability = chi_squared_beyond(squares, 1);
        // The standard deviation of a line between minus one and one.
        let deviation = self.growth.abs() / 3.0_f64.sqrt();
        let mut test = Test::new(probability, (deviation, self.value), (squares, 1));
        test.beside_scatter(1.0, from);
        test
    }
}

/// Contradicts tests of blocks where lines in the place of the constants say that one changes.
pub(crate) fn beside_lines(tests: &mut [Option<Test>], trends: &[Option<Trend>], from: NoiseFrom) {
    for (test, trend) in tests.iter_mut().zip(trends) {
        let line = trend.map(|trend| trend.test(from));
        if let Some(line) = line.filter(|line| line.probability < NO_CHANCE_OF_A_LINE) {
            *test = Some(line);
        }
    }
}

impl Test {
    /// What it says of a constant that rows are predicted with errors so many times as large as where windows follow it, with these `values`.
    pub(crate) fn of_prediction(ratio: f64, independent: f64, values: &[f64]) -> Self {
        let probability = FisherSnedecor::new(independent, independent).map_or(1.0, |chance| chance.sf(ratio));
        let (count, mean) = (values.len() as f64, values.iter().sum::<f64>() / values.len() as f64);
        let deviation = (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt();
        Self::new(probability, (deviation, mean), (ratio, 1))
    }

    /// What a probability says of a constant of some value and deviation, and the squares over their degrees of freedom that it is of.
    pub(crate) fn new(probability: f64, (deviation, value): (f64, f64), (squares, freedom): (f64, usize)) -> Self {
        Self { probability, spread: deviation / value.abs(), deviation, squares, freedom }
    }

    /// The least likely of several tests of a constant, with a probability that knows how many were made.
    pub(crate) fn least_likely(tests: impl IntoIterator<Item = Self>, made: usize) -> Option<Self> {
        let mut least = tests.into_iter().min_by(|a, b| a.probability.total_cmp(&b.probability))?;
        least.probability = (made as f64 * least.probability).min(1.0);
        Some(least)
    }

    /// How much more the parts differ than noise explains: the mean of their squared differences over the variances.
    pub(crate) fn excess(&self) -> f64 {
        self.squares
    }

    /// The test again where estimates scatter more, by a factor of the variance, than noise explains, or where that noise is known from the
    /// equations alone: it is coloured, and stronger the longer the parts that are compared.
    fn beside_scatter(&mut self, factor: f64, noise: NoiseFrom) {
        if factor < SCATTERED && noise == NoiseFrom::Channels || !self.squares.is_finite() {
            return;
        }
        let factor = factor.max(1.0);
        if let Ok(ratio) = FisherSnedecor::new(self.freedom as f64, FREEDOM) {
            self.probability = self.probability.max(ratio.sf(self.squares / factor));
        }
    }
}

/// Tests every constant of a fit; the result is `None` if the blocks do not determine it.
pub(crate) fn test(
    problem: &Problem<'_>,
    fit: &Fit,
    noise: TestNoise<'_>,
    instructions: Instructions,
    stages: &mut Stages<'_, '_>,
) -> Result<Vec<Option<Test>>, Error> {
    let TestNoise { expected, inflation, from, equations, .. } = noise;
    let rows = problem.rows();
    let constants = problem.layout.constant;
    let estimate = |block: Range<usize>, (): &mut ()| estimate(problem, fit, noise, block, instructions);
    let piece = |rows: Range<usize>| Piece { size: rows.len(), content: rows };
    let at = |index: usize| index * rows / (BLOCKS * PARTS);
    let part = |index: usize| at(index)..at(index + 1);
    let drives = |rows: Range<usize>| drive(problem, (&rows, equations), expected, inflation);
    let free: Vec<bool> = (0..BLOCKS * PARTS).map(|index| drives(part(index)) != Drive::Always).collect();
    // One alone is between two movements.
    let is_alone = |index: usize| !(index > 0 && free[index - 1] || free.get(index + 1) == Some(&true));
    let driven: Vec<bool> = (0..free.len()).map(|index| !free[index] || is_alone(index)).collect();
    let blocks = || (0..BLOCKS).map(|block| PARTS * block..PARTS * (block + 1));
    let mut runs: Vec<_> = blocks().filter_map(|parts| longest_run(&driven, parts)).collect();
    // What is driven now and then is compared where nothing else can be: elsewhere it is the end of a drive before a rest.
    if runs.len() < 2 {
        let struck = |parts: &Range<usize>| drives(at(parts.start)..at(parts.end)) != Drive::Never;
        runs = blocks().filter(struck).collect();
    }
    let runs = runs.into_iter().map(|run| piece(at(run.start)..at(run.end)));
    let estimates = stages.map(runs.collect(), || (), estimate)?;
    let of = |estimates: &[Estimate], constant: usize| -> Vec<(f64, f64)> {
        estimates.iter().flatten().map(|(values, variances)| (values[constant], variances[constant])).collect()
    };
    let mut tests: Vec<Option<Test>> = (0..constants).map(|constant| compare(&of(&estimates, constant))).collect();
    let differs = |test: &Option<Test>| test.as_ref().is_some_and(|test| test.probability < NO_CHANCE);
    if tests.iter().any(differs) {
        let parts: Vec<_> = (0..driven.len()).filter(|&index| driven[index]).map(|index| piece(part(index))).collect();
        let driven = parts.len();
        let parts = stages.map(parts, || (), estimate)?;
        for (constant, test) in tests.iter_mut().enumerate() {
            if let (Some(test), Some(factor)) = (test, scatter(&of(&parts, constant), driven)) {
                test.beside_scatter(factor, from);
            }
        }
    }
    Ok(tests)
}

/// How much neighbouring parts scatter about lines through them, over what noise explains; `None` if few of those that are `driven` say
/// something.
fn scatter(parts: &[(f64, f64)], driven: usize) -> Option<f64> {
    let bend = |three: &[(f64, f64)]| {
        let [(before, a), (here, b), (after, c)] = [three[0], three[1], three[2]];
        (before - 2.0 * here + after).powi(2) / (a + 4.0 * b + c)
    };
    let mut bends: Vec<f64> = parts.windows(3).map(bend).filter(|bend| bend.is_finite()).collect();
    if 2 * bends.len() < driven.max(FEWEST_DRIVEN) {
        return None;
    }
    median(&mut bends).map(|bend| bend / MEDIAN_OF_SQUARES)
}

/// Compares estimates of the same number, each with its variance.
pub(crate) fn compare(parts: &[(f64, f64)]) -> Option<Test> {
    let usable: Vec<(f64, f64)> =
        parts.iter().copied().filter(|(value, variance)| value.is_finite() && *variance > 0.0).collect();
    if usable.len() < 2 {
        return None;
    }
    let mut variances: Vec<f64> = usable.iter().map(|(_, variance)| *variance).collect();
    // A block with an accidentally small variance must not decide alone.
    let least = 0.5 * median(&mut variances)?;
    let weight = |variance: f64| 1.0 / variance.max(least);
    let total: f64 = usable.iter().map(|(_, variance)| weight(*variance)).sum();
    let mean = usable.iter().map(|(value, variance)| weight(*variance) * value).sum::<f64>() / total;
    let squares: f64 = usable.iter().map(|(value, variance)| weight(*variance) * (value - mean).powi(2)).sum();
    let freedom = usable.len() - 1;
    let scatter = usable.iter().map(|(value, _)| (value - mean).powi(2)).sum::<f64>() / freedom as f64;
    let noise = usable.iter().map(|(_, variance)| variance).sum::<f64>() / usable.len() as f64;
    let deviation = (scatter - noise).max(0.0).sqrt();
    Some(Test::new(chi_squared_beyond(squares, freedom), (deviation, mean), (squares / freedom as f64, freedom)))
}

/// The probability that a χ² variable is at least as large as a value.
pub(crate) fn chi_squared_beyond(value: f64, freedom: usize) -> f64 {
    match ChiSquared::new(freedom as f64) {
        Ok(chi_squared) => chi_squared.sf(value),
        // Without a degree of freedom it is zero.
        Err(_) => f64::from(u8::from(value <= 0.0)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::row_covariance::RowCovariance;

    #[test]
    fn probabilities_are_exact_far_into_the_tail() {
        // From 40 digits (mpmath). The exponent, up to 700, is rounded once, and the logarithm of Γ that is taken off it up to 4000.
        for (value, freedom, expected) in [
            (0.0, 7, 1.0),
            (0.001, 1, 0.974_772_879_369_960_4),
            (3.0, 1, 0.083_264_516_663_550_4),
            (18.0, 1, 2.209_049_699_858_544e-5),
            (1370.0, 1, 6.942_937_364_643_268e-300),
            (1.5, 2, 0.472_366_552_741_014_7),
            (1380.0, 2, 2.171_738_281_389_827e-300),
            (14.0, 7, 0.051_181_353_413_065_45),
            (1250.0, 7, 1.085_951_711_567_013e-265),
            (40.0, 64, 0.991_908_245_330_164_9),
            (500.0, 64, 8.030_011_643_761_767e-69),
            (1000.0, 1000, 0.494_052_853_829_239_6),
            (1600.0, 1500, 0.036_026_446_704_026_62),
            (3000.0, 1500, 1.636_117_508_648_498e-102),
        ] {
            let found = chi_squared_beyond(value, freedom);
            assert!((found / expected - 1.0).abs() < 4000.0 * f64::EPSILON, "{value} {freedom}: {found}");
        }
    }

    #[test]
    fn without_freedom_nothing_is_beyond_zero() {
        assert_eq!([0.0, 1e-9].map(|value| chi_squared_beyond(value, 0)), [1.0, 0.0]);
    }

    /// What is said of two constants, the first of which grows by some part over the record, where so many rows at the end have no torque.
    fn tests_of(growth: f64, from: NoiseFrom, free: usize) -> Vec<Option<Test>> {
        use crate::regression::simulated::{CONSTANTS, model, random, rows, staged, white};
        let (count, deviation) = (1600, 0.1);
        let mut rows = rows(count, |time| [1.0 + 0.01 * time, 0.01], deviation);
        for row in 0..count {
            let more = CONSTANTS[0] * growth * (row as f64 / count as f64 - 0.5);
            rows.rhs[row] += more * rows.regressors[1].value[row];
        }
        let noise = random(100, count);
        (count - free..count).for_each(|row| rows.rhs[row] = deviation * noise[row] - 3.0);
        let problem = model().problem(&rows, &rows.rhs, 0.0, None);
        let variance = deviation * deviation;
        let covariance = &RowCovariance::by_distance(vec![variance]);
        let fit = Fit::in_rows(&problem, 64, white(variance), Instructions::Scalar).expect("constants");
        let expected = white(variance);
        let noise = TestNoise { expected, covariance, inflation: 1.0, from, equations: 1 };
        staged(|stages| test(&problem, &fit, noise, Instructions::Scalar, stages))
    }

    #[test]
    fn parts_without_torque_say_nothing_of_constants() {
        let first = |growth: f64, free: usize| tests_of(growth, NoiseFrom::Channels, free)[0].clone();
        assert_eq!(first(0.0, 800).expect("four blocks").freedom, 3);
        assert!(first(0.0, 800).expect("four blocks").probability > 1e-3);
        assert!(first(0.3, 800).expect("four blocks").probability < NO_CHANCE);
        assert_eq!(first(0.3, 1600), None);
    }

    /// What is said of a constant that grows by some part over the record, where the machine is moved for a fifth of the time only, in short blows.
    fn beside_blows(growth: f64) -> Option<Test> {
        use crate::regression::simulated::{CONSTANTS, model, random, rows, staged, white};
        let (count, deviation) = (1600, 0.1);
        let mut rows = rows(count, |time| [1.0 + 0.01 * time, 0.01], deviation);
        let noise = random(100, count);
        for (row, noise) in noise.iter().enumerate() {
            if row % 40 < 8 {
                let more = CONSTANTS[0] * growth * (row as f64 / count as f64 - 0.5);
                rows.rhs[row] += more * rows.regressors[1].value[row];
            } else {
                rows.rhs[row] = deviation * noise;
                rows.regressors.iter_mut().for_each(|one| one.value[row] = 0.0);
            }
        }
        let variance = deviation * deviation;
        let problem = model().problem(&rows, &rows.rhs, 0.0, None);
        let fit = Fit::in_rows(&problem, 160, white(variance), Instructions::Scalar).expect("constants");
        let noise = TestNoise {
            expected: white(variance),
            covariance: &RowCovariance::by_distance(vec![variance]),
            inflation: 1.0,
            from: NoiseFrom::Channels,
            equations: 1,
        };
        staged(|stages| test(&problem, &fit, noise, Instructions::Scalar, stages)).remove(0)
    }

    #[test]
    fn blocks_that_are_struck_now_and_then_say_whether_a_constant_changes() {
        assert!(beside_blows(0.0).expect("eight blocks").probability > 1e-3);
        assert!(beside_blows(0.5).expect("eight blocks").probability < NO_CHANCE);
    }

    #[test]
    fn a_constant_that_grows_is_no_chance_and_one_that_does_not_is() {
        for (growth, differs) in [(0.0, false), (0.05, true), (0.3, true)] {
            let tests: Vec<Test> =
                tests_of(growth, NoiseFrom::Channels, 0).into_iter().map(|one| one.expect("eight blocks")).collect();
            assert_eq!(tests[0].probability < NO_CHANCE, differs, "{growth}: {:?}", tests[0]);
            assert!(tests[1].probability > 1e-3, "{:?}", tests[1]);
            if growth == 0.3 {
                // Steps of an eighth of a line have its deviation but for a sixty-fourth of its square.
                let line = growth / 12.0_f64.sqrt() * (1.0_f64 - 1.0 / 64.0).sqrt() * (8.0_f64 / 7.0).sqrt();
                assert!((tests[0].spread / line - 1.0).abs() < 0.15, "{}, {line}", tests[0].spread);
            }
        }
    }

    #[test]
    fn a_line_contradicts_blocks_that_know_little() {
        let block = Test { probability: 0.6, spread: 0.0, deviation: 0.0, squares: 0.9, freedom: 7 };
        let line = |growth: f64| Some(Trend { value: 2.0, growth, error: 0.1 });
        // Steep enough, level, unknown.
        let trends = [line(0.5), line(0.3), None];
        for (before, from, found) in [
            (Some(block.clone()), NoiseFrom::Channels, [true, false, false]),
            (None, NoiseFrom::Channels, [true, false, false]),
            (Some(block.clone()), NoiseFrom::Equations, [false; 3]),
        ] {
            let mut tests = vec![before.clone(); 3];
            beside_lines(&mut tests, &trends, from);
            for (test, found) in tests.iter().zip(found) {
                assert_eq!(test.as_ref().is_some_and(|test| test.probability < NO_CHANCE), found, "{test:?}");
                assert!(found || *test == before);
            }
        }
        let mut tests = [None];
        beside_lines(&mut tests, &trends[..1], NoiseFrom::Channels);
        // Five standard deviations; a line from -0.5 to 0.5 scatters by that over the root of three.
        let test = tests[0].as_ref().expect("a line");
        assert!((test.probability / 5.733_031_437_583_892e-7 - 1.0).abs() < 1e-12, "{}", test.probability);
        assert!((test.spread / (0.25 / 3.0_f64.sqrt()) - 1.0).abs() < 4.0 * f64::EPSILON);
    }

    #[test]
    fn noise_that_equations_show_asks_for_more_than_chance() {
        let probability = |growth: f64, from: NoiseFrom| {
            let first = tests_of(growth, from, 0).into_iter().next().flatten();
            first.expect("eight blocks").probability
        };
        for (growth, found) in [(0.03, false), (0.3, true)] {
            assert!(probability(growth, NoiseFrom::Channels) < NO_CHANCE, "{growth}");
            assert_eq!(probability(growth, NoiseFrom::Equations) < NO_CHANCE, found, "{growth}");
        }
    }
}
