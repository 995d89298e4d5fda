//! A first guess of the angle at which the spring is relaxed: how an offset that is free in every window follows the stiffness.

use crate::error::Error;
use crate::identify::weak::angle_zero::spring::STIFFNESS;
use crate::identify::weak::session::Session;
use crate::regression::fit::Fit;
use crate::regression::model::Model;
use crate::regression::solved::{is_determined, local};

/// Rounds of weighting windows with the variance that the last guess gives them.
const ROUNDS: usize = 8;

/// Stiffness and offset of one window, and their covariance: of the stiffness, of both, of the offset.
#[derive(Clone, Copy, Debug)]
struct InWindow {
    stiffness: f64,
    offset: f64,
    covariance: [f64; 3],
}

/// A model with the offset free in every window.
pub(crate) fn with_free_offset(model: &Model, offset: usize) -> Model {
    let constant = model.constant.iter().copied().filter(|&one| one != offset).collect();
    let windowed = model.windowed.iter().copied().chain([offset]).collect();
    Model { windowed, constant, ..model.clone() }
}

impl Session<'_, '_, '_> {
    /// The angle that the spring's offset follows from, or `None` if the stiffness does not change by more than its noise.
    pub(crate) fn guess_angle_zero(&mut self, model: &Model, offset: usize) -> Result<Option<f64>, Error> {
        let free = with_free_offset(model, offset);
        // If the zero alone is amiss, a free offset leaves no more than the noise of the channels.
        let mut chosen = self.roughly(|session| session.choose_first(&free, &mut None))?;
        let decided = self.take_fitted(&mut chosen, &free)?;
        Ok(decided.fit.as_ref().and_then(|fit| slope(&windows(&decided.model, fit)?)))
    }
}

/// Stiffness and offset of every window that determines them; the offset is the last that is windowed.
fn windows(model: &Model, fit: &Fit) -> Option<Vec<InWindow>> {
    let stiffness = model.windowed.iter().position(|&one| one == STIFFNESS)?;
    let offset = model.windowed.len() - 1;
    let (full, values) = (&fit.full, &fit.pooled.values);
    let both = |window: usize| {
        let covariance = |one, other| full.field(full.fields.covariance(one, other))[window];
        InWindow {
            stiffness: local(full, window, values, stiffness),
            offset: local(full, window, values, offset),
            covariance: [covariance(stiffness, stiffness), covariance(stiffness, offset), covariance(offset, offset)],
        }
    };
    Some((0..full.len()).filter(|&window| is_determined(full, window)).map(both).collect())
}

/// The negative slope of the offset over the stiffness, both of which are noisy.
fn slope(windows: &[InWindow]) -> Option<f64> {
    let mut zero = 0.0;
    for _ in 0..ROUNDS {
        let weighted = windows.iter().filter_map(|both| {
            let [stiffness, mixed, offset] = both.covariance;
            // Of the offset plus the zero times the stiffness.
            let variance = offset + 2.0 * zero * mixed + zero * zero * stiffness;
            let weight = 1.0 / variance;
            (weight.is_finite() && weight > 0.0).then_some((weight, both))
        });
        let weighted: Vec<_> = weighted.collect();
        let sum = |of: &dyn Fn(&InWindow) -> f64| weighted.iter().map(|(weight, both)| weight * of(both)).sum::<f64>();
        let total = sum(&|_| 1.0);
        let means = [sum(&|both| both.stiffness) / total, sum(&|both| both.offset) / total];
        let [squares, products] = [
            sum(&|both| (both.stiffness - means[0]).powi(2) - both.covariance[0]),
            sum(&|both| (both.stiffness - means[0]) * (both.offset - means[1]) - both.covariance[1]),
        ];
        zero = -products / squares;
        // As many squares as the noise makes, or fewer, are no change.
        if !zero.is_finite() || squares <= 0.0 {
            return None;
        }
    }
    Some(zero)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::simulated::random;

    #[test]
    fn an_offset_becomes_windowed_beside_what_is_windowed_already() {
        let model = Model { windowed: vec![2], constant: vec![0, 1, 3, 4], linear: true, ..Model::default() };
        let free = with_free_offset(&model, 3);
        assert_eq!((free.windowed, free.constant), (vec![2, 3], vec![0, 1, 4]));
    }

    #[test]
    fn the_slope_is_found_in_noise_of_both_and_not_where_the_stiffness_is_noise_alone() {
        let (count, zero, noise) = (4000, 0.4, 0.5);
        let (own, other) = (random(5, count), random(6, count));
        let windows = |change: f64| -> Vec<InWindow> {
            let both = |place: usize| {
                let stiffness = 13.0 + change * (place as f64 * 0.01).sin();
                InWindow {
                    stiffness: stiffness + noise * own[place],
                    // Half of the stiffness's noise goes into the offset.
                    offset: 2.0 - zero * stiffness - 0.5 * noise * own[place] + 0.1 * other[place],
                    covariance: [noise * noise, -0.5 * noise * noise, 0.25 * noise * noise + 0.01],
                }
            };
            (0..count).map(both).collect()
        };
        let found = slope(&windows(2.0)).expect("a slope");
        // 4000 windows, each off by the noise of the offset beside the zero times the stiffness, 0.11.
        assert!((found - zero).abs() < 4.0 * 0.11 / (1.4 * 4000.0_f64.sqrt()), "{found}");
        // Noise alone gives squares of either sign; where they are positive the slope is that of the noise or larger.
        let mut none = windows(0.0);
        for both in &mut none {
            both.covariance[0] *= 1.1;
        }
        assert_eq!(slope(&none), None);
    }
}
