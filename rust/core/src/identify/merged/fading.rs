//! The colour of the angles' noise: how much of it the equations bear out.

use crate::error::Error;
use crate::exec::pool::Piece;
use crate::identify::merged::decided::MergedFit;
use crate::identify::merged::session::MergedSession;
use crate::noise::colour::coloured_noise;
use crate::noise::correlated::CorrelatedNoise;

/// What is left, over the noise's, from which on down it is less than the noise: windows that follow some of it leave three quarters.
const LESS: f64 = 0.7;

/// The noise of every angle: of that of the trials the mean.
pub(crate) fn colours_of(session: &mut MergedSession<'_, '_, '_>) -> Result<Vec<CorrelatedNoise>, Error> {
    let white = || session.noise[0].iter().map(|&variance| CorrelatedNoise::white(variance));
    if session.options.noise.is_some() || session.merged.trials.iter().any(|trial| trial.weights.is_some()) {
        return Ok(white().collect());
    }
    let instructions = session.options.instructions;
    let (channels, variances) = (session.merged.channels(), session.noise[0].clone());
    let angles = session.merged.trials.iter().flat_map(|trial| trial.angles.iter().zip(&variances));
    let pieces = angles.map(|(angle, variance)| Piece { size: angle.len(), content: (*angle, *variance) });
    let colour = |(angle, variance), (): &mut ()| coloured_noise(angle, variance, instructions);
    let found = session.stages.map(pieces.collect(), || (), colour)?;
    let of = |channel: usize| {
        let each: Vec<_> = found.iter().skip(channel).step_by(channels).collect();
        // Short trials, or one that moves too fast, do not tell.
        let told: Vec<_> = each.iter().copied().filter(|noise| !noise.is_white()).collect();
        if 2 * told.len() > each.len() {
            CorrelatedNoise::mean(&told)
        } else {
            CorrelatedNoise::white(variances[channel])
        }
    };
    Ok((0..channels).map(of).collect())
}

impl MergedSession<'_, '_, '_> {
    /// Takes less of the colour of the angles' noise where equations leave less than it makes: where noise is strong, slow motion is taken for
    /// a part of it. Returns whether it does.
    pub(crate) fn fade(&mut self, fitted: &MergedFit) -> bool {
        if fitted.error >= LESS || self.colours.iter().all(CorrelatedNoise::is_white) {
            return false;
        }
        let of_all = self.covariance().1.variance;
        let white = self.colours.iter().map(|noise| noise.with_part(0.0)).collect();
        let all = std::mem::replace(&mut self.colours, white);
        let of_white = self.covariance().1.variance;
        let part = (fitted.error * of_all - of_white) / (of_all - of_white);
        let is_less = part < 1.0;
        self.colours = if is_less { all.iter().map(|noise| noise.with_part(part.max(0.0))).collect() } else { all };
        is_less
    }
}
