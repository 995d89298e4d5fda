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

/// Tables of windows, by the samples that are there.
#[derive(Clone, Debug, Default)]
pub(crate) struct OrderTables(Vec<Option<Box<OrderTable>>>);

impl OrderTables {
    /// The table of a length, made once.
    pub(crate) fn make(&mut self, order: Order, length: usize) -> &OrderTable {
        if length >= self.0.len() {
            self.0.resize(length + 1, None);
        }
        self.0[length].get_or_insert_with(|| Box::new(OrderTable::new(order, length)))
    }

    /// The table of a length that was made.
    pub(crate) fn of(&self, length: usize) -> &OrderTable {
        self.0[length].as_deref().expect("made before it is asked for")
    }
}
