//! What is asked of windows whose samples have times of their own, and what is found in them.

use crate::irregular::window_places::WindowSpan;
use crate::local_polynomials::options::Order;
use crate::status::Status;

/// Local polynomials at given times.
#[derive(Clone, Debug)]
pub struct WindowFit {
    /// Time of every sample in seconds, increasing.
    pub times: Vec<f64>,
    /// How long windows are.
    pub span: WindowSpan,
    /// How the order is determined.
    pub order: Order,
    /// The highest derivative that is wanted.
    pub derivatives: usize,
    /// Step of the samples' quantisation, or zero.
    pub quantisation: f64,
}

/// What was found in some windows, one after the other.
#[derive(Clone, Debug, Default)]
pub struct WindowFits {
    /// Derivatives from 0 on, and their standard errors.
    pub derivatives: Vec<Vec<f64>>,
    /// Standard errors of the derivatives.
    pub errors: Vec<Vec<f64>>,
    /// Order of the window.
    pub order: Vec<u8>,
    /// Bits of [`Status`].
    pub status: Vec<u16>,
    /// Standard deviation of the noise.
    pub sigma: Vec<f64>,
}

impl WindowFit {
    /// The status of a window of which an order was taken.
    pub(crate) fn status(&self, order: usize, degrees: usize, edge: bool, exact: bool) -> Status {
        let mut status = if edge { Status::EDGE } else { Status::GOOD };
        if matches!(self.order, Order::Chosen { .. }) && degrees > 1 {
            if order == 0 {
                status |= Status::LOWEST_ORDER;
            }
            if order + 1 == degrees {
                status |= Status::HIGHEST_ORDER;
            }
        }
        if exact {
            status |= Status::EXACT;
        }
        status
    }
}

impl WindowFits {
    /// So many windows of which nothing is known.
    pub(crate) fn new(derivatives: usize, windows: usize) -> Self {
        let columns = vec![vec![f64::NAN; windows]; derivatives + 1];
        Self {
            derivatives: columns.clone(),
            errors: columns,
            order: vec![0; windows],
            status: vec![Status::INVALID.bits(); windows],
            sigma: vec![f64::NAN; windows],
        }
    }

    pub(crate) fn append(&mut self, mut other: Self) {
        let pairs = self.derivatives.iter_mut().zip(&mut other.derivatives);
        pairs.chain(self.errors.iter_mut().zip(&mut other.errors)).for_each(|(one, other)| one.append(other));
        self.order.append(&mut other.order);
        self.status.append(&mut other.status);
        self.sigma.append(&mut other.sigma);
    }
}
