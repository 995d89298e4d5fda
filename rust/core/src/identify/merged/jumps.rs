//! Jumps of windowed elements, searched in the residuals of merged rows.

use crate::equation::rows::Rows;
use crate::error::Error;
use crate::identify::merged::decided::MergedFit;
use crate::identify::merged::session::MergedSession;
use crate::identify::merged::system::Multiplied;
use crate::inference::jumps::jump::{Jump, JumpSearch, row_from};
use crate::inference::jumps::search::rows_over;
use crate::record::samples::{Samples, read_around};
use crate::regression::limits::NOISE_MODEL_FAILS;
use crate::regression::predictor::without_constants;
use crate::regression::residuals::residuals;
use crate::regression::window_length::Scale;

/// Lengths of windows, from the best one on and each twice the last, that jumps are looked for with.
const JUMP_SCALES: usize = 3;
/// The part of the rows in windows that lengths must hold to be compared, of what the shortest hold.
const COVERED: f64 = 0.9;
/// Regressor of a stiffness, which jumps without a derivative.
const STIFFNESS: usize = 2;

impl MergedSession<'_, '_, '_> {
    /// Leaves out the rows whose test function reaches over a jump. Returns all rows if there are any.
    pub(crate) fn exclude_jumps(&mut self) -> Option<Rows> {
        if self.jumps.is_empty() {
            return None;
        }
        let whole = self.all.rows.clone();
        let function = &self.all.kernels.values[STIFFNESS];
        self.all.rows.exclude(rows_over(&self.jumps, function, self.times(), whole.len()));
        self.all.rows.jumps = self.rows_of_jumps();
        Some(whole)
    }

    /// The rows that jumps lie before.
    fn rows_of_jumps(&self) -> Vec<usize> {
        self.jumps.iter().map(|jump| row_from(jump.sample, self.times())).collect()
    }

    /// The sample of the first time, samples from one to the next, and the rows of each.
    fn times(&self) -> (usize, usize, usize) {
        (self.all.function.half_width(), self.all.function.stride(), self.all.group)
    }

    /// Lengths of windows that parts between jumps hold, short parts but for: what no window holds is not predicted, and speaks against no length.
    pub(crate) fn covering(&self, scales: &[Scale]) -> Vec<Scale> {
        let rows = self.all.rows.len();
        let mut ends = self.rows_of_jumps();
        ends.extend([0, rows]);
        ends.sort_unstable();
        let covered = |scale: &Scale| {
            let parts = ends.windows(2).map(|ends| ends[1].min(rows).saturating_sub(ends[0]));
            parts.filter(|part| *part >= scale.span()).sum::<usize>() as f64
        };
        let most = scales.iter().map(covered).fold(0.0, f64::max);
        scales.iter().copied().filter(|scale| covered(scale) >= COVERED * most).collect()
    }

    /// Finds jumps of windowed elements, those that are known again.
    pub(crate) fn find_jumps(&mut self, fitted: &MergedFit) -> Result<Vec<Jump>, Error> {
        // Windows over few times follow what looks like a jump to others.
        if fitted.error > NOISE_MODEL_FAILS || fitted.fit.scale.is_some_and(Scale::is_across) {
            return Ok(self.jumps.clone());
        }
        let Some(signals) = self.signals(fitted) else { return Ok(self.jumps.clone()) };
        let slices: Vec<&[f64]> = signals.iter().map(Vec::as_slice).collect();
        let signals: Vec<&dyn Samples> = slices.iter().map(|one| one as &dyn Samples).collect();
        let (model, constants) = (&fitted.model, &fitted.fit.pooled.values);
        let rows = &self.all.rows;
        let problem = model.problem(rows, &rows.rhs, 1.0, Some(&fitted.correlated));
        let rest_rhs = without_constants(&problem, constants);
        let rest = model.without_constants(rows, &problem, &rest_rhs, constants, 1.0);
        let whole = self.whole.as_ref().unwrap_or(rows);
        let whole = model.problem(whole, &whole.rhs, 1.0, None);
        let rhs = without_constants(&whole, constants);
        let best = fitted.scales.iter().position(|scale| Some(*scale) == fitted.fit.scale).unwrap_or(0);
        let lengths = doubled(&fitted.scales[best..]);
        let search = JumpSearch {
            problem: &rest,
            whole: &whole,
            rhs: &rhs,
            signals: &signals,
            function: &self.all.kernels.values[STIFFNESS],
            first: self.all.function.half_width(),
            stride: self.all.function.stride(),
            group: self.all.group,
            expected: fitted.expected,
            inflation: fitted.error.max(1.0),
            scales: &fitted.scales,
            lengths: &lengths,
            instructions: self.options.instructions,
        };
        search.find(&residuals(&problem, &fitted.fit, &mut self.stages)?.0, &self.jumps, &mut self.stages)
    }

    /// What every windowed element is multiplied with, sample by sample, in every row of a time; `None` if jumps of one would act
    /// through a derivative, trials are aligned on a phase, or nothing is windowed.
    fn signals(&self, fitted: &MergedFit) -> Option<Vec<Vec<f64>>> {
        let merged = self.merged;
        if fitted.model.windowed.is_empty() || merged.trials.iter().any(|trial| trial.position.is_some()) {
            return None;
        }
        let mut signals = Vec::new();
        for &element in &fitted.model.windowed {
            for trial in &merged.trials {
                for equation in 0..merged.equations() {
                    let mut signal = vec![0.0; merged.samples];
                    for entry in merged.elements[element].entries.iter().filter(|entry| entry.equation == equation) {
                        let channel = match entry.of {
                            Multiplied::Motion { channel, coefficient: STIFFNESS } => trial.angles[channel],
                            Multiplied::Motion { .. } => return None,
                            Multiplied::Term(term) => trial.terms[term],
                        };
                        let mut samples = vec![0.0; merged.samples];
                        read_around(channel, 0, &mut samples);
                        let factor = self.weights.equations[equation] * entry.factor;
                        signal.iter_mut().zip(samples).for_each(|(sum, sample)| *sum += factor * sample);
                    }
                    signals.push(signal);
                }
            }
        }
        Some(signals)
    }
}

/// Lengths of windows, each twice the last at least, that jumps are looked for with: many equations at a time make short ones stand alone.
fn doubled(scales: &[Scale]) -> Vec<Scale> {
    let mut lengths: Vec<Scale> = Vec::new();
    for scale in scales.iter().filter(|scale| scale.stands_alone()) {
        if lengths.last().is_none_or(|last| scale.span() >= 2 * last.span()) {
            lengths.push(*scale);
        }
    }
    lengths.truncate(JUMP_SCALES);
    lengths
}
