//! Jumps of windowed coefficients, searched in the residuals of a fit.

use crate::equation::rows::Rows;
use crate::error::Error;
use crate::identify::weak::decided::Decided;
use crate::identify::weak::session::Session;
use crate::inference::jumps::jump::{Jump, JumpSearch};
use crate::inference::slowly_varying;
use crate::record::derived::{Ones, Shifted, Whole};
use crate::record::samples::Samples;
use crate::regression::limits::NOISE_MODEL_FAILS;
use crate::regression::model::Model;
use crate::regression::predictor::without_constants;
use crate::regression::residuals::residuals;
use crate::regression::window_length::Scale;
use crate::weak_form::weak_rows::{Record, TermSamples, WeakRows};

/// Lengths of windows, from the best one on and each twice the last, that jumps are looked for with.
const JUMP_SCALES: usize = 3;

/// What the variance is multiplied by where it is known from the equations alone: coloured noise wanders for as long as a jump is looked for.
const COLOURED: f64 = 2.0;

impl Session<'_, '_, '_> {
    /// Finds jumps of windowed coefficients beside the known ones. `whole` holds all rows where some are over jumps.
    pub(crate) fn find_jumps(
        &mut self,
        weak: &WeakRows,
        decided: &Decided,
        known: &[Jump],
        whole: Option<&Rows>,
    ) -> Result<Vec<Jump>, Error> {
        if decided.error > NOISE_MODEL_FAILS {
            // What is left is more than noise everywhere, so it tells nothing of jumps.
            return Ok(known.to_vec());
        }
        let signals = signals(&self.record, &decided.model).filter(|_| self.options.averaging);
        let (Some(signals), Some(fit)) = (signals, &decided.fit) else { return Ok(known.to_vec()) };
        let signals: Vec<&dyn Samples> = signals.iter().map(|signal| &**signal).collect();
        let (constants, noise) = (&fit.pooled.values, self.noise[0]);
        let problem = decided.problem(&weak.rows, noise);
        let rest_rhs = without_constants(&problem, constants);
        let rest = decided.model.without_constants(&weak.rows, &problem, &rest_rhs, constants, noise);
        let whole = whole.unwrap_or(&weak.rows);
        let rhs = match &decided.found {
            Some(found) => slowly_varying::without(whole, &whole.rhs, &decided.slow, &found.varying),
            None => whole.rhs.clone(),
        };
        let whole = decided.model.problem(whole, &rhs, noise, None);
        let best = decided.scales.iter().position(|scale| Some(*scale) == fit.scale).unwrap_or(0);
        let alone = decided.scales[best..].iter().filter(|scale| scale.stands_alone());
        let lengths: Vec<Scale> = alone.step_by(2).take(JUMP_SCALES).copied().collect();
        let search = JumpSearch {
            problem: &rest,
            whole: &whole,
            rhs: &without_constants(&whole, constants),
            signals: &signals,
            function: &weak.kernels.values[2],
            first: weak.first,
            stride: weak.stride,
            group: 1,
            expected: decided.expected,
            inflation: decided.inflation() * if self.noise == self.channel_noise { 1.0 } else { COLOURED },
            scales: &decided.scales,
            lengths: &lengths,
            instructions: self.options.instructions,
        };
        search.find(&residuals(&problem, fit, &mut self.stages)?.0, known, &mut self.stages)
    }
}

/// The factors of the windowed unknowns, sample by sample, or `None` if there are none or jumps of one would act through a derivative.
pub(crate) fn signals<'a>(record: &Record<'a>, model: &Model) -> Option<Vec<Box<dyn Samples + 'a>>> {
    if model.windowed.is_empty() {
        return None;
    }
    let of = |&index: &usize| -> Option<Box<dyn Samples + 'a>> {
        match index.checked_sub(2)? {
            0 => Some(Box::new(Shifted { channel: record.angle, zero: record.angle_zero })),
            term => match record.terms[term - 1] {
                TermSamples::One => Some(Box::new(Ones(record.angle.len()))),
                TermSamples::Given(samples) => Some(Box::new(Whole(samples))),
                TermSamples::OfTorque(_)
                | TermSamples::TorqueRate
                | TermSamples::TorqueCurvature
                | TermSamples::TorqueJerk => None,
            },
        }
    };
    model.windowed.iter().map(of).collect()
}
