//! The colour of the noise of angles and torques: how much of it the equations bear out.
//!
//! The noise of a torque may be stronger where the motion is than at the highest frequencies, where it is read: errors of constants and tests of whether
//! they change rest on what it is there. But a drive that is rough, as random signs are or what goes through a filter, looks like such a noise. So all noise
//! of torques is white at first, and has as much of the colour that its channel shows as is left of its equation.

use crate::error::Error;
use crate::exec::pool::Piece;
use crate::identify::merged::decided::MergedFit;
use crate::identify::merged::session::MergedSession;
use crate::noise::colour::coloured_noise;
use crate::noise::correlated::CorrelatedNoise;
use crate::regression::limits::NOISE_MODEL_FAILS;

/// What is left, over the noise's, from which on down it is less than the noise: windows that follow some of it leave three quarters.
const LESS: f64 = 0.7;

/// The part of the noise that a torque's channel shows which must be left of its equation: between the highest frequencies and the motion a channel tells
/// its noise where the motion is to a factor of two or three, and a rough drive hardly leaves a tenth.
const BORNE_OUT: f64 = 0.25;

/// The noise of every angle, and of every torque, as the channels show it: of that of the trials the mean.
pub(crate) fn colours_of(session: &mut MergedSession<'_, '_, '_>) -> Result<[Vec<CorrelatedNoise>; 2], Error> {
    let [angles, torques] = &session.noise;
    let white = |variances: &[f64]| variances.iter().map(|&variance| CorrelatedNoise::white(variance)).collect();
    if session.options.noise.is_some() || session.merged.trials.iter().any(|trial| trial.weights.is_some()) {
        return Ok([white(angles), white(torques)]);
    }
    let instructions = session.options.instructions;
    let variances = [angles.as_slice(), torques].concat();
    let each = session.merged.trials.iter().flat_map(|trial| trial.angles.iter().chain(&trial.torques));
    let pieces = each.zip(variances.iter().cycle());
    let pieces = pieces.map(|(channel, variance)| Piece { size: channel.len(), content: (*channel, *variance) });
    let colour = |(channel, variance), (): &mut ()| coloured_noise(channel, variance, instructions);
    let found = session.stages.map(pieces.collect(), || (), colour)?;
    let of = |place: usize| {
        let each: Vec<_> = found.iter().skip(place).step_by(variances.len()).collect();
        // Short trials, or one that moves too fast, do not tell.
        let told: Vec<_> = each.iter().copied().filter(|noise| !noise.is_white()).collect();
        if 2 * told.len() > each.len() {
            CorrelatedNoise::mean(&told)
        } else {
            CorrelatedNoise::white(variances[place])
        }
    };
    let channels = session.merged.channels();
    Ok([(0..channels).map(of).collect(), (channels..variances.len()).map(of).collect()])
}

impl MergedSession<'_, '_, '_> {
    /// A fit beside noise of torques that has as much of the colour that their channels show as is left of their equations; `None` where none has any, or
    /// where what changes is lost beside it: with less to tell by, a constant that differs between parts of the record may stay one.
    pub(crate) fn with_colour_of_torques(
        &mut self,
        fitted: &MergedFit,
        shown: &[CorrelatedNoise],
    ) -> Result<Option<MergedFit>, Error> {
        let Some(colours) = self.borne_out(fitted, shown)? else { return Ok(None) };
        let before = self.state();
        let white = std::mem::replace(&mut self.colours[1], colours);
        // What was set free may have followed noise.
        self.freed.clear();
        let found = self.chosen_and_settled()?;
        if let Some(found) = found.filter(|found| fitted.contradicted || !found.contradicted) {
            return Ok(Some(found));
        }
        self.colours[1] = white;
        self.restore(before)?;
        Ok(None)
    }

    /// As much of the colour that the channels of torques show as is left of their equations; `None` where it is none of any.
    fn borne_out(
        &mut self,
        fitted: &MergedFit,
        shown: &[CorrelatedNoise],
    ) -> Result<Option<Vec<CorrelatedNoise>>, Error> {
        if shown.iter().all(CorrelatedNoise::is_white) || fitted.misfit > NOISE_MODEL_FAILS {
            return Ok(None);
        }
        let left = self.left_of_equations(&fitted.model, &fitted.fit)?;
        let of_white = self.noise_of_equations();
        let white = std::mem::replace(&mut self.colours[1], shown.to_vec());
        let of_shown = self.noise_of_equations();
        self.colours[1].clone_from(&white);
        let of = |(equation, white): (usize, CorrelatedNoise)| {
            let part = left[equation] * of_white[equation] / of_shown[equation];
            let is_borne_out = !shown[equation].is_white() && part >= BORNE_OUT;
            if is_borne_out { shown[equation].with_part(part.min(1.0)) } else { white }
        };
        let colours: Vec<CorrelatedNoise> = white.into_iter().enumerate().map(of).collect();
        let has_colour = !colours.iter().all(CorrelatedNoise::is_white);
        Ok(has_colour.then_some(colours))
    }

    /// Takes less of the colour of the angles' noise where equations leave less than it makes: where noise is strong, slow motion is taken for
    /// a part of it. Returns whether it does.
    pub(crate) fn fade(&mut self, fitted: &MergedFit) -> bool {
        if fitted.error >= LESS || self.colours[0].iter().all(CorrelatedNoise::is_white) {
            return false;
        }
        let of_all = self.covariance().1.variance;
        let white = self.colours[0].iter().map(|noise| noise.with_part(0.0)).collect();
        let all = std::mem::replace(&mut self.colours[0], white);
        let of_white = self.covariance().1.variance;
        let part = (fitted.error * of_all - of_white) / (of_all - of_white);
        let is_less = part < 1.0;
        self.colours[0] = if is_less { all.iter().map(|noise| noise.with_part(part.max(0.0))).collect() } else { all };
        is_less
    }
}
