//! The noise of a channel that was resampled, beside what white noise of variance one shows that went the same way.

/// So many standard deviations are added to the power of the quietest band: of sixteen bands of white noise one is two
/// of them too quiet by chance.
pub(crate) const CHANCE: f64 = 3.0;

/// What a channel shows of its noise.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shown {
    /// The mean of the squared highest coefficients of windows of each half-width; NaN where there is no whole window.
    pub(crate) variances: Vec<f64>,
    /// The mean power in every frequency band, and of how many independent powers it is the mean; none of a short record.
    pub(crate) bands: Vec<f64>,
    pub(crate) powers: f64,
}

impl Shown {
    /// The mean of what several records of the same length show.
    pub(crate) fn mean(records: &[Self]) -> Self {
        let count = records.len() as f64;
        let mean = |of: &dyn Fn(&Self) -> f64| records.iter().map(of).sum::<f64>() / count;
        let (halves, bands) = records.first().map_or((0, 0), |first| (first.variances.len(), first.bands.len()));
        Self {
            variances: (0..halves).map(|half| mean(&|one| one.variances[half])).collect(),
            bands: (0..bands).map(|band| mean(&|one| one.bands[band])).collect(),
            powers: records.iter().map(|one| one.powers).sum(),
        }
    }

    /// The variance of white noise that shows this, where noise of variance one shows the other; NaN where nothing is shown.
    pub(crate) fn over(&self, other: &Self) -> f64 {
        let ratios = self.variances.iter().zip(&other.variances).map(|(own, one)| own / one);
        let least = ratios.fold(f64::NAN, f64::min);
        let quietest = self.bands.iter().zip(&other.bands).map(|(own, one)| own / one).fold(f64::INFINITY, f64::min);
        // Both powers scatter by as much as they are, over the square root of their number.
        least.min(quietest * (1.0 + CHANCE * (self.powers.recip() + other.powers.recip()).sqrt()))
    }
}

/// What white noise of variance one becomes.
#[derive(Clone, Debug, PartialEq)]
pub struct PassedNoise {
    /// What it shows on the grid.
    pub(crate) shown: Shown,
    /// Its density at low frequencies: one where nothing was resampled.
    pub gain: f64,
}
