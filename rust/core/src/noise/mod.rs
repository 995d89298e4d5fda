//! The noise of a channel: its variance, its colour, its quantisation and its spectrum.

pub(crate) mod breaks;
pub(crate) mod channel;
pub(crate) mod coherence;
pub(crate) mod colour;
pub(crate) mod correlated;
pub(crate) mod defects;
pub(crate) mod filtered;
pub(crate) mod fused;
pub(crate) mod low_passed;
pub(crate) mod median;
pub(crate) mod passed;
pub(crate) mod quantisation;
pub(crate) mod shared_band;
pub(crate) mod spectrum;
pub(crate) mod spikes;
pub(crate) mod transform;
pub(crate) mod unread;
pub(crate) mod walk;

pub use breaks::search::break_counts;
pub use channel::{FEWEST_SAMPLES, noise, noise_after, variance_after};
pub use coherence::{CORRELATED_NOISE, noise_coherence};
pub use colour::coloured_noise;
pub use correlated::CorrelatedNoise;
pub use defects::Defect;
pub use filtered::coloured_or_low_passed_noise;
pub use fused::{AngleNoise, Beside, fuse};
pub use passed::PassedNoise;
pub use quantisation::{quantisation_step, searched};
pub use spikes::spike_counts;
pub use unread::unread_counts;
