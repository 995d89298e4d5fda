//! Identification of one record in weak form: what is constant from all windows together, what changes from windows around every row.

use std::num::NonZeroUsize;

use crate::equation::motion::{Coefficient, Motion, Term, unknowns};
use crate::error::Error;
use crate::exec::pool::{Piece, Watch};
use crate::exec::stages::Stages;
use crate::identify::results::SampleResults;
use crate::identify::weak::lag::Lag;
use crate::identify::weak::outside_mask::Outside;
use crate::inference::constancy::Test;
use crate::inference::missing_terms::{Missing, Suspect};
use crate::lanes::output::Elements;
use crate::local_polynomials::criterion::Criterion;
use crate::local_polynomials::estimates::Estimates;
use crate::local_polynomials::options::{Options, Order, Selection};
use crate::local_polynomials::plan::LocalPolynomials;
use crate::noise::channel::channel_variance;
use crate::noise::spectrum::{power, power_in_pieces};
use crate::record::derived::{Cubed, sign};
use crate::record::samples::Samples;
use crate::regression::constants::Expected;
use crate::regression::fit::Fit;
use crate::regression::model::Model;
use crate::regression::row_covariance::RowCovariance;
use crate::regression::subsample::stretches_of_blocks;
use crate::regression::window_length::Scale;
use crate::simd::instructions::Instructions;
use crate::weak_form::coverage::Usable;
use crate::weak_form::test_function::{LEAST_HALF_WIDTH, TestFunction};
use crate::weak_form::test_function_choice::{Candidates, Evidence, half_widths, spectrum_length};
use crate::weak_form::weak_rows::{Record, TermSamples, WeakRows, mean};

/// Half-widths of the test function that windows span while it is chosen.
const PILOT_WINDOW: usize = 4;
/// Samples of a long record that the test function is chosen with, in so many stretches, each at least so many half-widths of the widest
/// long.
const PILOT_SAMPLES: usize = 1 << 16;
const PILOT_STRETCHES: usize = 8;
const PILOT_WIDTHS: usize = 64;
/// Rounds of choosing the test function and estimating what the choice depends on.
const ROUNDS: usize = 6;
/// Stages of a call, about: only for showing progress.
const STAGES: usize = 50;

/// How an unknown comes about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// One value in every window.
    Windowed,
    /// One value over the record.
    Constant,
    /// Constant unless the record says otherwise.
    Tested,
    /// Changes more slowly than what is windowed.
    Varying,
}

/// How to identify.
#[derive(Clone, Debug)]
pub struct WeakOptions {
    /// Seconds from one sample to the next.
    pub delta: f64,
    /// Samples on either side of a test function's centre; chosen from the spectra where not given.
    pub half_width: Option<usize>,
    /// Exponent of the test function; chosen likewise.
    pub exponent: Option<usize>,
    /// Samples that a window spans; chosen by cross-validation.
    pub equations: Option<usize>,
    /// Whether windows of many lengths, before, around and after a sample are averaged and, where nothing is windowed, equations are weighted by
    /// their noise; otherwise ordinary least squares in windows of one length.
    pub average: bool,
    /// Whether what is windowed may grow linearly within a window.
    pub linear: bool,
    /// How each unknown comes about: unknown coefficients in the order inertia, damping, stiffness, then terms.
    pub kinds: Vec<Kind>,
    /// Variances of the noise of angle and torque; estimated where not given.
    pub noise: [Option<f64>; 2],
    /// By how many samples the torque comes late; estimated where not given.
    pub lag: Option<f64>,
    /// The step that the angle was rounded to, zero for none; looked for where not given.
    pub quantisation: Option<f64>,
    /// Every how many samples numbers are wanted.
    pub step: usize,
    /// Whether to look for what may have been left out, and for what not to look.
    pub diagnose: bool,
    /// What cannot be missing because it is there.
    pub not_missing: Vec<Missing>,
    /// Vector instructions.
    pub instructions: Instructions,
}

/// A parameter that is constant over the record.
#[derive(Clone, Debug, PartialEq)]
pub struct Constant {
    /// Which unknown: 0 inertia, 1 damping, 2 stiffness, then terms.
    pub unknown: usize,
    /// Its value.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
    /// Whether it is the same in all parts of the record.
    pub test: Option<Test>,
}

/// What was found in one record.
#[derive(Clone, Debug)]
pub struct WeakIdentified {
    /// The test function.
    pub function: TestFunction,
    /// Variances of the noise of angle and torque.
    pub noise: [f64; 2],
    /// Samples spanned by the windows that windowed unknowns are eliminated in: those that predict best where none were given.
    pub equations: usize,
    /// Lengths of windows that were tried, in samples, and how well each predicts.
    pub lengths: Vec<(usize, f64)>,
    /// Mean squared error of predicting a row from others, over the noise's.
    pub prediction_error: f64,
    /// Whether equations were weighted by the inverse of their covariance: where nothing changes and the noise explains what is left.
    pub weighted: bool,
    /// Samples that coefficients which change slowly are taken from.
    pub pooling: Option<f64>,
    /// What turned out to be constant.
    pub constants: Vec<Constant>,
    /// The covariance of the constants, row by row.
    pub covariance: Vec<f64>,
    /// Condition number of the equations for the constants; infinite where they are not determined.
    pub condition: f64,
    /// How much each constant takes part in the combination that is determined worst, its column scaled to a norm of one.
    pub weakest: Vec<f64>,
    /// Whether that combination is mostly the angle's noise.
    pub mostly_noise: bool,
    /// What may have been left out.
    pub suspects: Vec<Suspect>,
    /// The lag that was estimated; nothing where it was given or is not determined.
    pub lag: Option<Lag>,
    /// What the rows say that the mask keeps out; nothing without a mask.
    pub outside_mask: Option<Outside>,
    /// Unknowns that change, in the order of the values at the samples.
    pub changing: Vec<usize>,
    /// Pairs of constants and their covariance.
    pub constant_pairs: Vec<(usize, usize, f64)>,
    /// Pairs of unknowns whose covariances are at the samples.
    pub pairs: Vec<(usize, usize)>,
    /// Samples before which what changes jumps.
    pub jumps: Vec<usize>,
    /// Numbers at the samples.
    pub results: SampleResults,
}

/// Rows with the test function that was chosen.
pub(crate) struct Chosen {
    pub(crate) weak: WeakRows,
    /// Inertia, damping and stiffness, about.
    pub(crate) parameters: [f64; 3],
    /// Whether the narrowest or widest was chosen of all that were tried.
    pub(crate) at_end: bool,
}

/// One record under work.
pub(crate) struct Session<'a, 'b, 'c> {
    pub(crate) record: Record<'a>,
    pub(crate) options: &'a WeakOptions,
    pub(crate) noise: [f64; 2],
    pub(crate) stages: Stages<'b, 'c>,
}

/// Identifies one record in weak form.
///
/// # Errors
/// If the record is too short, its rows do not determine what is constant, or the watch cancels.
pub fn identify_weak(
    motion: &Motion<'_>,
    mask: Option<&[bool]>,
    options: &WeakOptions,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<WeakIdentified, Error> {
    let velocity = if motion.terms.iter().any(|term| matches!(term, Term::Coulomb)) {
        velocity(motion.angle, options, workers, watch)?
    } else {
        Vec::new()
    };
    let direction: Vec<f64> = velocity.iter().map(|&velocity| sign(velocity)).collect();
    let (cubed, direction) = (Cubed(motion.angle), direction.as_slice());
    let terms = motion.terms.iter().map(|term| match *term {
        Term::Offset => TermSamples::One,
        Term::Coulomb => TermSamples::Given(&direction),
        Term::Cubic => TermSamples::Given(&cubed),
        Term::Record(record) => TermSamples::Given(record),
    });
    let record = Record {
        angle: motion.angle,
        torque: motion.torque,
        coefficients: motion.coefficients,
        terms: terms.collect(),
        lag: options.lag.unwrap_or(0.0),
        mask,
    };
    identify(record, options, workers, watch)
}

/// The velocity at every sample, from local polynomials an eighth of a typical cycle to either side.
fn velocity(
    angle: &dyn Samples,
    options: &WeakOptions,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<Vec<f64>, Error> {
    let samples = angle.len();
    let evidence = Evidence {
        power: power(angle, spectrum_length(samples, 200)),
        samples,
        noise: [channel_variance(angle, None, options.instructions), 0.0],
        delta: options.delta,
        unknown: [true; 3],
    };
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to a few samples")]
    let half = (evidence.period() / 8.0).clamp(8.0, 100.0) as usize;
    let plan = LocalPolynomials::new(Options {
        window_length: (2 * half + 1).min((samples.max(1) - 1) / 2 * 2 + 1),
        order: Order::Chosen { criterion: Criterion::Aicc, highest: 15 },
        derivatives: vec![1],
        delta: options.delta,
        noise: false,
        selection: Selection::Window,
        quantisation: 0.0,
        instructions: options.instructions,
    })?;
    let mut velocity = vec![0.0; samples];
    let estimates = Estimates {
        elements: Elements { first: 0, step: 1 },
        derivatives: vec![&mut velocity],
        order: &mut [],
        status: &mut [],
        sigma: &mut [],
    };
    plan.run(vec![(angle, estimates)], true, workers, watch)?;
    Ok(velocity)
}

/// Identifies one record.
fn identify(
    record: Record<'_>,
    options: &WeakOptions,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<WeakIdentified, Error> {
    let samples = record.angle.len();
    let mut stages = Stages::new(workers, samples, STAGES, watch);
    let channels = [(record.angle, options.noise[0], options.quantisation), (record.torque, options.noise[1], None)];
    let pieces = channels.map(|channel| Piece { size: samples, content: channel });
    let level = |(channel, given, step): (_, Option<f64>, _), (): &mut ()| {
        given.unwrap_or_else(|| channel_variance(channel, step, options.instructions))
    };
    let levels = stages.map(pieces.into(), || (), level)?;
    let mut session = Session { record, options, noise: [levels[0], levels[1]], stages };
    let model = session.model();
    let (chosen, decided, lag) = session.choose_and_decide(&model)?;
    let mut found = session.report(chosen, &decided)?;
    session.stages.finish()?;
    found.lag = lag;
    Ok(found)
}

impl Session<'_, '_, '_> {
    /// Regressors of the unknowns: coefficients that are not known, then terms.
    pub(crate) fn unknowns(&self) -> Vec<usize> {
        unknowns(&self.record.coefficients, self.record.terms.len())
    }

    pub(crate) fn model(&self) -> Model {
        let windowed = self.options.kinds.iter().map(|kind| *kind == Kind::Windowed);
        Model::new(&self.unknowns(), windowed, self.options.linear)
    }

    /// Inertia, damping and stiffness as far as a fit knows them.
    pub(crate) fn parameters(&self, model: &Model, fit: &Fit) -> [f64; 3] {
        std::array::from_fn(|index| match self.record.coefficients[index] {
            Coefficient::Number(number) => number,
            Coefficient::Record(known) => mean(known),
            Coefficient::Unknown => {
                let constant = model.constant.iter().position(|&one| one == index);
                let windowed = model.windowed.iter().position(|&one| one == index);
                let value = constant.map(|place| fit.pooled.values[place]);
                let value = value.or(windowed.map(|place| fit.median(place))).unwrap_or(0.0);
                if index == 1 { value.max(0.0) } else { value }
            }
        })
    }

    /// The rows' covariance as the noise of both channels makes it, and what windows are expected to leave.
    pub(crate) fn covariance(&self, weak: &WeakRows, parameters: [f64; 3]) -> (RowCovariance, Expected) {
        let known = RowCovariance::known(&weak.kernels, &weak.torque, parameters, self.noise, weak.stride);
        let torque = RowCovariance::known(&weak.kernels, &weak.torque, [0.0; 3], self.noise, weak.stride).variance();
        let expected = Expected::new(&known, torque);
        (known, expected)
    }

    /// A first estimate, in windows of a few test functions.
    fn pilot(&mut self, weak: &WeakRows, model: &Model) -> Result<[f64; 3], Error> {
        let problem = model.problem(&weak.rows, &weak.rows.rhs, self.noise[0], None);
        let scales = Scale::all(weak.rows.len(), weak.reach());
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

    pub(crate) fn too_short(&self) -> Error {
        let samples = self.record.angle.len();
        let least = match self.options.half_width {
            // The shortest windows on both sides of a row that keep a test function apart.
            Some(half) => {
                let stride = TestFunction::stride_of(half);
                2 * half + 1 + (Scale::fewest_rows(half.div_ceil(stride)) - 1) * stride
            }
            None if self.model().windowed.is_empty() => 8 * LEAST_HALF_WIDTH,
            None => 16 * LEAST_HALF_WIDTH,
        };
        Error::RecordTooShortForWindows { samples, least: least.max(samples + 1) }
    }

    pub(crate) fn rows(&mut self, function: TestFunction) -> Result<WeakRows, Error> {
        let (delta, workers) = (self.options.delta, self.stages.workers);
        let mut record = self.record.clone();
        if self.options.lag.is_none() {
            record.terms.push(TermSamples::TorqueRate);
        }
        self.stages.stage(|watch| WeakRows::build(&record, function, delta, None, workers, watch))
    }

    /// The rows in stretches of a long record; nothing where all of it is as good. `widest` is the half-width of the widest test function.
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
    fn evidence(&mut self, length: usize) -> Result<Evidence, Error> {
        Ok(Evidence {
            power: power_in_pieces(self.record.angle, length, &mut self.stages)?,
            samples: self.record.angle.len(),
            noise: self.noise,
            delta: self.options.delta,
            unknown: std::array::from_fn(|index| matches!(self.record.coefficients[index], Coefficient::Unknown)),
        })
    }

    /// Chooses half-width and exponent where they are not given, and estimates the coefficients on the way.
    pub(crate) fn choose_test_function(&mut self, model: &Model) -> Result<Chosen, Error> {
        let (samples, delta) = (self.record.angle.len(), self.options.delta);
        let (width, exponent) = (self.options.half_width, self.options.exponent);
        if let (Some(width), Some(exponent)) = (width, exponent) {
            let weak = self.rows(TestFunction::new(width, exponent, delta)?)?;
            let parameters = self.pilot(&weak, model)?;
            return Ok(Chosen { weak, parameters, at_end: false });
        }
        // So many rows are left that windows of several test functions fit in.
        let widest = samples / if model.windowed.is_empty() { 8 } else { 16 };
        let typical = self.evidence(spectrum_length(samples, 200))?.period().min(widest as f64);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most the record's length")]
        let typical = (typical.round() as usize).max(1);
        let widths = width.map_or_else(|| half_widths((4 * typical).min(widest)), |width| vec![width]);
        let widest = *widths.last().ok_or(self.too_short())?;
        let usable = Usable::new(&self.record);
        let share = |half: usize| usable.share(half);
        let evidence = self.evidence(spectrum_length(samples, widest))?;
        let candidates = Candidates::new(evidence, &widths, exponent, share, &mut self.stages)?;
        let start = width.unwrap_or_else(|| usable.widest(typical.max(LEAST_HALF_WIDTH), &widths));
        let mut current = TestFunction::new(start, exponent.unwrap_or(9), delta)?;
        let mut seen = Vec::new();
        loop {
            let thinned = self.some_rows(current, widest)?;
            let weak = match thinned {
                Some(weak) => weak,
                None => self.rows(current)?,
            };
            let parameters = self.pilot(&weak, model)?;
            match candidates.best(parameters) {
                Some(best) if best != current && !seen.contains(&best) && seen.len() < ROUNDS => {
                    seen.push(current);
                    current = best;
                }
                _ => {
                    let end = [widths.first(), widths.last()].contains(&Some(&current.half_width()));
                    let weak =
                        if weak.rows.len() < WeakRows::count(current, samples) { self.rows(current)? } else { weak };
                    return Ok(Chosen { weak, parameters, at_end: width.is_none() && end });
                }
            }
        }
    }
}
