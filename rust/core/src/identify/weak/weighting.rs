//! Generalised least squares where all unknowns are constant: equations weighted by the inverse covariance of their noise.

use crate::equation::rows::Rows;
use crate::error::Error;
use crate::identify::weak::decided::Decided;
use crate::identify::weak::session::Session;
use crate::inference::constancy::chi_squared_beyond;
use crate::regression::constants::Expected;
use crate::regression::fit::Fit;
use crate::regression::limits::NOISE_MODEL_FAILS;
use crate::regression::residuals::residuals;
use crate::regression::row_covariance::RowCovariance;
use crate::regression::whitening::Whitening;
use crate::weak_form::weak_rows::WeakRows;

/// Rounds of making rows white with the parameters that the last one gave.
const WHITENINGS: usize = 2;

/// Correlations of white rows that chance gives so rarely are none, where their squares add up to more than this part.
const NOT_WHITE: f64 = 1e-4;
const NEARLY_WHITE: f64 = 0.01;

/// Constants of weighted equations and of those that count alike differ by more than chance beyond so many standard deviations, whose square
/// is at least this part of the variance.
const DIFFERENT: f64 = 3.5;
const LEAST_DIFFERENCE: f64 = 0.05;

/// A correlation of the residuals beyond the reach of a test function that no white noise shows, at least.
const COLOURED: f64 = 0.15;

impl Session<'_, '_, '_> {
    /// Takes constants from rows whose noise is white, as long as the noise of the channels explains what is left: if something else does, it
    /// need not be where that noise is.
    pub(crate) fn whiten(&mut self, weak: &WeakRows, decided: &mut Decided) -> Result<(), Error> {
        let (rows, instructions) = (&weak.rows, self.options.instructions);
        if self.noise != self.channel_noise {
            return Ok(());
        }
        if self.explained(weak, decided)?.is_none() {
            return Ok(());
        }
        let expected = Expected { variance: 1.0, torque: 1.0, variance_inflation: 1.0 };
        let mut white = Decided { covariance: RowCovariance::white(), expected, correlated: None, ..decided.clone() };
        for _ in 0..WHITENINGS {
            let Some(fit) = &white.fit else { return Ok(()) };
            let (covariance, _) = self.covariance(weak, self.parameters(&white.model, fit));
            let Some(whitening) = Whitening::new(&covariance, rows, weak.stride) else { return Ok(()) };
            let made = whitening.apply(rows, &mut self.stages)?;
            let problem = white.model.problem(&made, &made.rhs, self.noise[0], None);
            white.fit = Fit::new(&problem, None, expected, instructions, &mut self.stages)?;
            white.white = Some((made, whitening));
        }
        if self.is_white(weak, &white)? && self.agree(rows, decided, &white)? {
            *decided = white;
        }
        Ok(())
    }

    /// Whether what is left of white rows is white, as far as it matters and chance allows (Box and Pierce 1970).
    fn is_white(&mut self, weak: &WeakRows, white: &Decided) -> Result<bool, Error> {
        let Some(shown) = self.explained(weak, white)? else { return Ok(false) };
        let usable = weak.rows.usable.iter().filter(|usable| **usable).count() as f64;
        let (squares, lags) = (usable * shown.squared_correlations(), shown.lags.len() - 1);
        Ok(chi_squared_beyond(squares, lags) > NOT_WHITE || squares - (lags as f64) < NEARLY_WHITE * usable)
    }

    /// The covariance of what a fit leaves, where the noise of the channels explains it.
    fn explained(&mut self, weak: &WeakRows, decided: &Decided) -> Result<Option<RowCovariance>, Error> {
        let Some(fit) = &decided.fit else { return Ok(None) };
        let (shown, coloured) = self.shown(weak, decided, fit)?;
        let explained = !coloured && shown.variance() <= NOISE_MODEL_FAILS * decided.expected.variance;
        Ok(explained.then_some(shown))
    }

    /// Whether constants from rows as they are and from white ones differ by no more than chance (Hausman 1978).
    fn agree(&mut self, rows: &Rows, alike: &Decided, white: &Decided) -> Result<bool, Error> {
        let mut variances = Vec::new();
        for one in [alike, white] {
            let Some(fit) = &one.fit else { return Ok(false) };
            let problem = one.problem(one.rows(rows), self.noise[0]);
            variances.push((fit.covariance(&problem, &one.covariance, &mut self.stages)?, &fit.pooled.values));
        }
        let count = alike.model.constant.len();
        let [(all, values), (least, others)] = &variances[..] else { return Ok(false) };
        Ok((0..count).all(|constant| {
            let (all, least) = (all[constant * (count + 1)], least[constant * (count + 1)]);
            // What is efficient is not correlated with its difference from what is not.
            let variance = (all - least).max(LEAST_DIFFERENCE * all);
            (values[constant] - others[constant]).powi(2) <= DIFFERENT * DIFFERENT * variance
        }))
    }

    /// The covariance that the residuals of a fit show, and whether they are correlated where rows share no sample.
    pub(crate) fn shown(
        &mut self,
        weak: &WeakRows,
        decided: &Decided,
        fit: &Fit,
    ) -> Result<(RowCovariance, bool), Error> {
        let rows = decided.rows(&weak.rows);
        let problem = decided.model.problem(rows, decided.rhs(rows), self.noise[0], None);
        let (residuals, usable) = residuals(&problem, fit, &mut self.stages)?;
        let reach = 2 * weak.reach();
        let shown = RowCovariance::of_residuals(&residuals, &usable, 2 * reach);
        let coloured = shown.is_coloured(reach, COLOURED, usable.iter().filter(|usable| **usable).count());
        Ok((shown, coloured))
    }
}
