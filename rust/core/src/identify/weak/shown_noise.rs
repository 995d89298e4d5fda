//! The noise of the torque as the equations show it, where they leave more than the noise of the channels explains, or far less.
//!
//! The noise of a channel is read where its signal does not reach: at the highest frequencies. Coloured noise is stronger where the motion
//! is, and there are changes that no window follows. Both leave more of the equations than so weak a noise would. Test functions and windows
//! that are chosen for it are too wide and too short, and tests take what is left for a change of the parameters. So what is left counts as
//! noise of the torque, and everything is chosen again with it, unless it is so much that the equations are wrong.
//!
//! A drive of steps or random signs reaches the highest frequencies, where it is read as noise, and angles without noise hold what it moves there.
//! The equations leave far less then, and no noise makes more than what they leave.

use std::ops::Range;

use crate::error::Error;
use crate::identify::scanned::Scans;
use crate::identify::weak::angle_zero::outcome::FreeOffset;
use crate::identify::weak::choice::Chosen;
use crate::identify::weak::decided::Decided;
use crate::identify::weak::session::Session;
use crate::inference::cross_validation::left_of_rows;
use crate::noise::coherence::{CORRELATED_NOISE, noise_coherence};
use crate::noise::low_passed::density_above_motion;
use crate::regression::constants::Expected;
use crate::regression::fit::Fit;
use crate::regression::limits::{UNEXPLAINED, left_by_short_windows};
use crate::regression::model::Model;
use crate::regression::problem::Problem;
use crate::regression::residuals::{residuals, usual_variance};
use crate::regression::row_covariance::RowCovariance;
use crate::regression::subsample::more_stretches_of_rows;
use crate::regression::window_length::Scale;
use crate::weak_form::weak_rows::WeakRows;

/// What is left of the equations, over the variance that is expected, from which on it is more than the noise of the channels.
pub(crate) const MORE: f64 = 2.0;
/// The same from which on downwards the channels hold signal where their noise is read.
const LESS: f64 = 0.5;
/// The error of predicting rows, over the variance that the noise of the channels makes, up to which they explain what is left after all.
const EXPLAINED: f64 = 1.25;
/// Rounds of choosing the test function with the noise that the last one showed.
const ROUNDS: usize = 3;
/// Steps towards the noise that one test function shows, and the part of it that the last may change it by.
const STEPS: usize = 4;
const SETTLED: f64 = 0.1;
/// Rows over which what is left is correlated, in reaches of a test function: where two share no sample noise of the channels may last.
pub(crate) const REACHES: usize = 4;
/// Parts of a record with constants of their own: what varies over the record is not noise.
const PARTS: usize = 64;
/// Windows in such a part, at least, and windows among which the part's constants take next to nothing of the noise.
const FEW_WINDOWS: usize = 4;
const MANY_WINDOWS: usize = 64;

impl Session<'_, '_, '_> {
    /// Chooses the test function, with the noise of the channels or with what the equations show of it.
    pub(crate) fn choose(&mut self, model: &Model) -> Result<Chosen, Error> {
        let mut scans = None;
        let mut chosen = self.choose_first(model, &mut scans)?;
        if self.options.shown_noise.is_some() {
            self.best_before = self.options.near;
            if self.best_before.is_some() {
                chosen.fitted = Some(self.fit_first(&chosen, model)?);
                self.best_before = None;
            }
            return Ok(chosen);
        }
        let mut rounds = 0;
        while rounds < ROUNDS && self.bound_noise(&mut chosen, model)? {
            (rounds, scans) = (rounds + 1, None);
            chosen = self.choose_first(model, &mut scans)?;
        }
        // What was lowered to what the equations leave is what they show.
        if rounds > 0 || !self.show_noise(&mut chosen, model)? {
            return Ok(chosen);
        }
        for _ in 0..ROUNDS {
            let before = (self.noise, self.scan.clone(), self.suggested);
            self.best_before = chosen.best_windows();
            let mut again = self.choose_once(model, &mut scans, Some(&chosen))?;
            self.best_before = None;
            if again.weak.function == chosen.weak.function {
                break;
            }
            self.show_noise(&mut again, model)?;
            if self.is_no_noise(&mut again, model)? {
                (self.noise, self.scan, self.suggested) = before;
                break;
            }
            chosen = again;
        }
        if self.is_no_noise(&mut chosen, model)? {
            (self.noise, chosen.fitted) = (self.channel_noise, chosen.fitted_before.take());
        }
        chosen.fitted_before = None;
        Ok(chosen)
    }

    /// Chooses it with the noise of the channels, or with what was told of what the equations show.
    pub(crate) fn choose_first(&mut self, model: &Model, scans: &mut Option<Scans>) -> Result<Chosen, Error> {
        let torque = self.options.shown_noise.unwrap_or(self.channel_noise[1]);
        self.channel_noise[1] = self.channel_noise[1].min(torque);
        self.noise = [self.channel_noise[0], torque];
        self.choose_once(model, scans, None)
    }

    /// Decides, and where what was taken for noise of the torque is explained by what was set free, chooses and decides again with the noise of the channels.
    pub(crate) fn decide_with_noise(&mut self, chosen: &mut Chosen, model: &Model) -> Result<Decided, Error> {
        let decided = self.decide(chosen, model)?;
        let is_explained = decided.error * self.raised(&chosen.weak, &decided) <= EXPLAINED;
        if self.noise == self.channel_noise || !is_explained || self.options.shown_noise.is_some() {
            return Ok(decided);
        }
        let before = (self.noise, self.scan.clone(), self.suggested);
        let mut again = self.choose_first(model, &mut None)?;
        let found = self.decide(&mut again, model)?;
        if found.fit.is_some() && found.error <= MORE {
            // Whether an offset was missed was asked with more noise.
            self.free_offset = FreeOffset::default();
            *chosen = again;
            return Ok(found);
        }
        (self.noise, self.scan, self.suggested) = before;
        Ok(decided)
    }

    /// Lowers the noise of the torque to what the equations leave, if that is far less than the noise of the channels makes. Returns whether it is.
    fn bound_noise(&mut self, chosen: &mut Chosen, model: &Model) -> Result<bool, Error> {
        if self.options.noise[1].is_some() {
            return Ok(false);
        }
        let fitted = self.take_sketch(chosen, model)?;
        let weak = &chosen.weak;
        let (left, usable) = match &fitted.fit {
            // Constants follow nothing.
            Some(fit) if fitted.model.windowed.is_empty() => {
                let problem = fitted.model.problem(&weak.rows, &weak.rows.rhs, self.noise[0], None);
                residuals(&problem, fit, &mut self.stages)?
            }
            Some(_) if fitted.error < LESS => self.usual_unseen(weak, &fitted)?,
            _ => Default::default(),
        };
        chosen.fitted = Some(fitted);
        let gain = gain_of_torque(weak);
        let is_lower = |shown: &f64| *shown > 0.0 && *shown < LESS * gain * self.channel_noise[1];
        let shown = usual_variance(&left, &usable).filter(is_lower);
        let Some(shown) = shown.filter(|_| !self.is_fed_back(chosen.parameters[0])) else { return Ok(false) };
        self.channel_noise[1] = shown / gain;
        Ok(true)
    }

    /// Whether the torque holds the noise of the angle: then the noise of both cancels in part in the equations.
    fn is_fed_back(&self, inertia: f64) -> bool {
        let inertia = inertia / self.options.delta.powi(2);
        noise_coherence(self.record.angle, self.record.torque, self.channel_noise[0], (inertia, self.record.lag))
            .is_some_and(|coherence| coherence >= CORRELATED_NOISE)
    }

    fn choose_once(
        &mut self,
        model: &Model,
        scans: &mut Option<Scans>,
        before: Option<&Chosen>,
    ) -> Result<Chosen, Error> {
        let chosen = self.choose_test_function(model)?;
        self.onto_plateau(chosen, model, scans, before)
    }

    /// Takes what the equations leave for noise of the torque, if that is more than the noise of the channels. Returns whether it is.
    fn show_noise(&mut self, chosen: &mut Chosen, model: &Model) -> Result<bool, Error> {
        let gain = gain_of_torque(&chosen.weak);
        let raised = self.noise != self.channel_noise;
        for step in 0..STEPS {
            let fitted = self.take_sketch(chosen, model)?;
            let left = self.left_over_expected(&chosen.weak, &fitted)?;
            let expected = fitted.expected.variance;
            let alone = fitted.model.windowed.is_empty();
            chosen.fitted = Some(fitted);
            let Some(left) = left.filter(|left| left.is_finite() && (raised || step > 0 || *left > MORE)) else {
                return Ok(raised || step > 0);
            };
            if (raised || step > 0) && (left - 1.0).abs() <= SETTLED {
                break;
            }
            let shown = self.noise[1] + (left - 1.0) * expected / gain;
            self.noise[1] = shown.max(self.channel_noise[1]);
            let before = self.fit_near(chosen, model)?;
            if !raised && step == 0 {
                chosen.fitted_before = before;
            }
            if alone {
                // Constants leave the same whatever noise they are told of.
                break;
            }
        }
        Ok(true)
    }

    /// Whether so much is left of the equations that they are wrong rather than noisy: a term is missing, or the torque is late. Windows hardly
    /// longer than the test function follow what is wrong as if it were motion: they must leave less. What a low-passed torque shows above the motion
    /// is noise, however much it is.
    fn is_no_noise(&mut self, chosen: &mut Chosen, model: &Model) -> Result<bool, Error> {
        let fitted = self.take_sketch(chosen, model)?;
        let recorded = chosen.weak.rows.mean_square();
        let most = if fitted.has_windows_of_a_function(&chosen.weak) {
            left_by_short_windows(recorded, chosen.weak.largest_torque(chosen.parameters, self.noise[0]))
        } else {
            UNEXPLAINED * recorded
        };
        let is_more = fitted.expected.torque > most;
        chosen.fitted = Some(fitted);
        Ok(is_more && self.noise[1] > MORE * self.density_above_motion())
    }

    /// The density of a low-passed torque's noise between the motion and where the filter ends it.
    fn density_above_motion(&self) -> f64 {
        density_above_motion(self.record.angle, self.record.torque, self.record.weights)
    }

    /// What a fit leaves of rows that it did not see, over the variance that is expected: of the usual row, so that jumps, touches and spikes
    /// do not count. `None` if it cannot be more than that.
    fn left_over_expected(&mut self, weak: &WeakRows, fitted: &Decided) -> Result<Option<f64>, Error> {
        if self.noise[1] == self.channel_noise[1] && !fitted.model.windowed.is_empty() && fitted.error <= MORE {
            return Ok(None);
        }
        let (left, usable) = self.usual_unseen(weak, fitted)?;
        Ok(usual_variance(&left, &usable).map(|variance| variance / fitted.expected.variance))
    }

    /// The covariance of what a fit leaves of rows that it did not see. Of those that it did see windows take a part for what they follow, most
    /// of it where the motion is. `None` if nothing is windowed, or no row can be told from others.
    pub(crate) fn shown_unseen(&mut self, weak: &WeakRows, fitted: &Decided) -> Result<Option<RowCovariance>, Error> {
        if fitted.model.windowed.is_empty() {
            return Ok(None);
        }
        let all = 0..weak.rows.len();
        let (left, usable) = self.left_unseen(weak, fitted, (MANY_WINDOWS, &[all]))?;
        let shown = RowCovariance::of_residuals(&left, &usable, REACHES * weak.reach());
        Ok(Some(shown).filter(|shown| shown.variance() > 0.0))
    }

    /// The same as [`Session::left_unseen`], of stretches of many rows where they hold as many windows.
    fn usual_unseen(&mut self, weak: &WeakRows, fitted: &Decided) -> Result<(Vec<f64>, Vec<bool>), Error> {
        let rows = weak.rows.len();
        let span = fitted.fit.as_ref().and_then(|fit| fit.scale).map_or(rows, Scale::span);
        let holds = |stretches: &Vec<Range<usize>>| stretches.iter().all(|one| one.len() >= MANY_WINDOWS * span);
        let all = || std::iter::once(0..rows).collect();
        let stretches = more_stretches_of_rows(rows).filter(holds).unwrap_or_else(all);
        self.left_unseen(weak, fitted, (FEW_WINDOWS, &stretches))
    }

    /// What a fit leaves of every row of some stretches where it did not see that row, and whether it says anything of it. Parts of the record that hold so
    /// many windows have constants of their own.
    fn left_unseen(
        &mut self,
        weak: &WeakRows,
        fitted: &Decided,
        (windows, stretches): (usize, &[Range<usize>]),
    ) -> Result<(Vec<f64>, Vec<bool>), Error> {
        let (mut left, mut usable) = (Vec::new(), Vec::new());
        let Some(fit) = fitted.fit.as_ref().filter(|_| fitted.white.is_none()) else { return Ok((left, usable)) };
        let problem = fitted.problem(&weak.rows, self.noise[0]);
        let span = fit.scale.map_or(weak.reach(), Scale::span);
        for stretch in stretches {
            let (first, length) = (stretch.start, stretch.len());
            let parts = (length / (windows * span).max(1)).clamp(1, PARTS / stretches.len());
            for part in 0..parts {
                let rows = first + length * part / parts..first + length * (part + 1) / parts;
                let jumps = problem.jumps_of(&rows);
                let found = self.left_of_part(&problem.part(&rows, &jumps), fit.scale, fitted.expected)?;
                left.extend(found.0);
                usable.extend(found.1);
            }
        }
        Ok((left, usable))
    }

    /// What is left of some rows with constants of their own.
    fn left_of_part(
        &mut self,
        part: &Problem<'_>,
        scale: Option<Scale>,
        expected: Expected,
    ) -> Result<(Vec<f64>, Vec<bool>), Error> {
        let instructions = self.options.instructions;
        let nothing = || (vec![0.0; part.rows()], vec![false; part.rows()]);
        let Some(scale) = scale else {
            let fit = Fit::new(part, None, expected, instructions, &mut self.stages)?;
            return fit.map_or_else(|| Ok(nothing()), |fit| residuals(part, &fit, &mut self.stages));
        };
        let fit = Fit::with_leave_gap_out(part, scale, expected, instructions, &mut self.stages)?;
        let left = fit.as_ref().and_then(|fit| left_of_rows(part, scale, fit));
        let Some(left) = left else { return Ok(nothing()) };
        let rows = (0..part.rows()).map(|row| if part.usable[row] { left(row) } else { None });
        Ok(rows.map(|left| (left.unwrap_or(0.0), left.is_some())).unzip())
    }

    /// By how much more noise the equations were chosen with than the channels show.
    pub(crate) fn raised(&self, weak: &WeakRows, decided: &Decided) -> f64 {
        if self.noise == self.channel_noise || decided.white.is_some() {
            return 1.0;
        }
        let of_torque = |noise: [f64; 2]| {
            RowCovariance::known(&weak.kernels, &weak.torque, [0.0; 3], [0.0, noise[1]], weak.stride).variance()
        };
        let more = of_torque(self.noise) - of_torque(self.channel_noise);
        decided.covariance.variance() / (decided.covariance.variance() - more).max(f64::MIN_POSITIVE)
    }
}

/// The variance of a row's noise, over that of the torque's.
fn gain_of_torque(weak: &WeakRows) -> f64 {
    RowCovariance::known(&weak.kernels, &weak.torque, [0.0; 3], [0.0, 1.0], weak.stride).variance()
}
