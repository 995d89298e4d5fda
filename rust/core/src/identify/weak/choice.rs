//! The choice of the test function, from the spectra of the channels and the parameters of a first fit.

use std::borrow::Cow;

use crate::equation::motion::Coefficient;
use crate::error::Error;
use crate::identify::options::WidthFrom;
use crate::identify::weak::decided::Decided;
use crate::identify::weak::session::Session;
use crate::noise::spectrum::power_in_pieces;
use crate::regression::constants::Expected;
use crate::regression::fit::Fit;
use crate::regression::model::Model;
use crate::regression::subsample::{stretches_of_blocks, stretches_of_rows, thinned_rows};
use crate::regression::window_length::Scale;
use crate::weak_form::coverage::Usable;
use crate::weak_form::test_function::{LEAST_HALF_WIDTH, TestFunction};
use crate::weak_form::test_function_choice::{Candidates, Evidence, half_widths, spectrum_length};
use crate::weak_form::weak_rows::WeakRows;

/// Half-widths of the test function that windows span while it is chosen.
const PILOT_WINDOW: usize = 4;
/// Samples of a long record that the test function is chosen with, in so many stretches, each at least so many half-widths of the widest
/// long.
const PILOT_SAMPLES: usize = 1 << 16;
const PILOT_STRETCHES: usize = 8;
const PILOT_WIDTHS: usize = 64;
/// The test function for a typical cycle of the motion: its exponent, and the part of the cycle that is its half-width where nothing narrower is needed.
pub(crate) const EXPONENT: usize = 9;
const PART_OF_A_CYCLE: usize = 8;
/// Rounds of choosing the test function and estimating what the choice depends on.
const ROUNDS: usize = 6;
/// Rows with the test function that was chosen.
#[derive(Clone)]
pub(crate) struct Chosen {
    pub(crate) weak: WeakRows,
    /// Inertia, damping and stiffness, about.
    pub(crate) parameters: [f64; 3],
    /// Whether the narrowest or widest was chosen of all that were tried.
    pub(crate) at_end: bool,
    /// The fit that everything unknown but the windowed is constant in, once it was made.
    pub(crate) fitted: Option<Decided>,
    /// The same with the noise of the channels, while more is tried.
    pub(crate) fitted_before: Option<Decided>,
}

impl Chosen {
    /// Samples of the windows that predict best, once that is known.
    pub(crate) fn best_windows(&self) -> Option<usize> {
        let best = self.fitted.as_ref().and_then(|fitted| fitted.first);
        best.map(|scale| scale.span() * self.weak.stride)
    }
}

impl Session<'_, '_, '_> {
    /// A first estimate, in windows of a few test functions. Stretches of many rows tell enough.
    pub(crate) fn pilot(&mut self, weak: &WeakRows, model: &Model) -> Result<[f64; 3], Error> {
        let some = stretches_of_rows(weak.rows.len()).filter(|_| !model.windowed.is_empty());
        let rows = some.map_or(Cow::Borrowed(&weak.rows), |some| Cow::Owned(thinned_rows(&weak.rows, &some)));
        let problem = model.problem(&rows, &rows.rhs, self.noise[0], None);
        let scales = Scale::all(rows.len(), weak.reach());
        let wanted = PILOT_WINDOW * weak.function.half_width() / weak.stride;
        let scale = if model.windowed.is_empty() {
            None
        } else {
            Some(scales[Scale::nearest(&scales, wanted).ok_or(self.too_short())?])
        };
        let any = Expected::UNKNOWN;
        let fit = Fit::new(&problem, scale, any, self.options.instructions, &mut self.stages)?;
        Ok(fit.map_or([0.0; 3], |fit| self.parameters(model, &fit)))
    }

    /// The rows of a subsample of a long record, or `None` if the record is short enough to use all of it. `widest` is the half-width of the widest test function.
    fn some_rows(&mut self, function: TestFunction, widest: usize) -> Result<Option<WeakRows>, Error> {
        let samples = self.record.angle.len();
        let length = (PILOT_SAMPLES / PILOT_STRETCHES).max(PILOT_WIDTHS * widest);
        if samples <= 2 * PILOT_STRETCHES * length {
            return Ok(None);
        }
        let most = PILOT_STRETCHES * length / function.stride();
        let stretches = stretches_of_blocks(WeakRows::count(function, samples), most, PILOT_STRETCHES);
        let (record, delta, workers) = (&self.record, self.options.delta, self.stages.workers);
        self.stages.stage(|watch| WeakRows::build(record, function, delta, Some(&stretches), workers, watch)).map(Some)
    }

    /// What the choice of a test function is made from, with spectra of some length.
    pub(crate) fn evidence(&mut self, length: usize) -> Result<Evidence, Error> {
        let evidence = Evidence {
            power: power_in_pieces(self.record.angle, self.record.weights, length, &mut self.stages)?,
            samples: self.record.angle.len(),
            noise: self.noise,
            coloured: None,
            delta: self.options.delta,
            unknown: std::array::from_fn(|index| matches!(self.record.coefficients[index], Coefficient::Unknown)),
        };
        Ok(match self.shared_until {
            Some(until) => evidence.with_motion_until(until),
            None => evidence.with_noise(self.record.noise),
        })
    }

    /// The half-width of the narrowest test function that is tried, beside a typical cycle of the motion in samples.
    ///
    /// What the angle shows above the corner of a low-pass filter looks like motion, since its noise cannot be read there, and makes narrow test
    /// functions seem best. Their band ends with that in which both channels show the same motion, but not below what a part of a typical cycle needs.
    fn narrowest(&self, typical: usize) -> usize {
        let Some(until) = self.shared_until else { return LEAST_HALF_WIDTH };
        let half = TestFunction::half_width_of(until, self.options.exponent.unwrap_or(EXPONENT));
        half.min(typical / PART_OF_A_CYCLE).max(LEAST_HALF_WIDTH)
    }

    /// Chooses half-width and exponent where they are not given, and estimates the coefficients on the way.
    pub(crate) fn choose_test_function(&mut self, model: &Model) -> Result<Chosen, Error> {
        let (samples, delta) = (self.record.angle.len(), self.options.delta);
        let (width, exponent) = (self.options.half_width, self.options.exponent);
        if let (Some(width), Some(exponent)) = (width, exponent) {
            let weak = self.rows(TestFunction::new(width, exponent, delta)?)?;
            let parameters = self.pilot(&weak, model)?;
            let at_end = self.options.width_from == Some(WidthFrom::End);
            return Ok(Chosen { weak, parameters, at_end, fitted: None, fitted_before: None });
        }
        // So many rows are left that windows of several test functions fit in.
        let widest = samples / if model.windowed.is_empty() { 8 } else { 16 };
        let typical = self.evidence(spectrum_length(samples, 200))?.period().min(widest as f64);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most the record's length")]
        let typical = (typical.round() as usize).max(1);
        let mut widths = width.map_or_else(|| half_widths((4 * typical).min(widest)), |width| vec![width]);
        let widest = *widths.last().ok_or(self.too_short())?;
        if width.is_none() {
            let least = self.narrowest(typical).min(widest);
            widths.retain(|&half| half >= least);
        }
        let usable = Usable::new(&self.record);
        let share = |half: usize| usable.share(half);
        let evidence = self.evidence(spectrum_length(samples, widest))?;
        let candidates = Candidates::new(evidence, &widths, exponent, share, &mut self.stages)?;
        let start = width.unwrap_or_else(|| usable.widest(typical.max(LEAST_HALF_WIDTH), &widths));
        let mut current = TestFunction::new(start, exponent.unwrap_or(EXPONENT), delta)?;
        let mut tried = Vec::new();
        loop {
            let thinned = self.some_rows(current, widest)?;
            let weak = match thinned {
                Some(weak) => weak,
                None => self.rows(current)?,
            };
            let parameters = self.pilot(&weak, model)?;
            match candidates.best(parameters) {
                Some(best) if best != current && !tried.contains(&best) && tried.len() < ROUNDS => {
                    tried.push(current);
                    current = best;
                }
                _ => {
                    let end = [LEAST_HALF_WIDTH, widest].contains(&current.half_width());
                    let weak = if weak.rows.len() < WeakRows::count(current, samples) {
                        drop(weak);
                        self.rows(current)?
                    } else {
                        weak
                    };
                    return Ok(Chosen {
                        weak,
                        parameters,
                        at_end: width.is_none() && end,
                        fitted: None,
                        fitted_before: None,
                    });
                }
            }
        }
    }
}
