//! What the choice of the order knows of windows of one length.

use crate::local_polynomials::options::Order;

/// An order whose criterion is so much above the best has no weight.
pub(crate) const NEGLIGIBLE: f64 = 80.0;

/// Windows of one length.
#[derive(Clone, Debug)]
pub(crate) struct OrderTable {
    pub(crate) length: usize,
    /// Candidates: orders from 0 on.
    pub(crate) degrees: usize,
    /// What residuals are multiplied by before orders are compared.
    pub(crate) weights: Vec<f64>,
    /// A ratio of such products below this gives no share.
    pub(crate) least: f64,
}

impl OrderTable {
    pub(crate) fn new(order: Order, length: usize) -> Self {
        let weights: Vec<f64> = match order {
            Order::Fixed(order) => vec![1.0; if length > order { order + 1 } else { 0 }],
            Order::Chosen { criterion, highest } => {
                let count = (0..=highest).take_while(|&order| criterion.penalty(order, length).is_some()).count();
                (0..count).map(|order| criterion.weight(order, length)).collect()
            }
        };
        Self { length, degrees: weights.len(), weights, least: (-NEGLIGIBLE / length as f64).exp() }
    }
}
