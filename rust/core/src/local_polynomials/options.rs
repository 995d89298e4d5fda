//! Options of local polynomials: the estimates wanted in every window, and the choice of its order.

use crate::local_polynomials::criterion::Criterion;
use crate::simd::instructions::Instructions;

/// The highest polynomial order that is offered.
pub const HIGHEST_ORDER: usize = 15;

/// How the order of a window is determined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// The same in every window: the classic filter of Savitzky and Golay.
    Fixed(usize),
    /// The candidate in `0 ..= highest` that minimises a criterion.
    Chosen {
        /// What is minimised.
        criterion: Criterion,
        /// The highest candidate.
        highest: usize,
    },
}

/// What to estimate, and how.
#[derive(Clone, Debug)]
pub struct PolynomialOptions {
    /// Samples in a window, `M`.
    pub window_length: usize,
    /// How the order is determined.
    pub order: Order,
    /// What chooses the order of a window, where it is chosen.
    pub selection: Selection,
    /// Which derivatives are wanted; 0 is the value.
    pub derivatives: Vec<usize>,
    /// Sample period in seconds.
    pub delta: f64,
    /// Whether the noise is wanted too, where the order is fixed. It is always known where the order is chosen.
    pub noise: bool,
    /// Step of the samples' quantisation, or zero. Its noise is a lower bound of residuals.
    pub quantisation: f64,
    /// Instructions to use.
    pub instructions: Instructions,
}

impl PolynomialOptions {
    /// The residual sum of squares of a window with quantisation noise only: `M q²/12`.
    pub(crate) fn quantisation_floor(&self) -> f64 {
        self.window_length as f64 * self.quantisation * self.quantisation / 12.0
    }
}

/// What chooses the order of a window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Selection {
    /// The window's own criterion, as the paper does.
    #[default]
    Window,
    /// The criterion summed over the neighbouring windows, those that share a sample with the window.
    Pooled,
    /// No order alone: the average over orders with Akaike's weights.
    Average,
}
