//! What is asked of windows whose samples have times of their own, and where what is found in them goes.

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
    /// Weight of every sample, above zero: one over the variance of its noise, relative to the others. Without, all count alike.
    pub weights: Option<Vec<f64>>,
    /// Samples that a window must hold.
    pub least: usize,
}

/// Where what is found in some windows goes, one after the other.
#[derive(Debug)]
pub struct WindowFits<'a> {
    /// Derivatives from 0 on.
    pub derivatives: Vec<&'a mut [f64]>,
    /// Their standard errors; empty where nobody asks for them.
    pub errors: Vec<&'a mut [f64]>,
    /// Order of the window.
    pub order: &'a mut [u8],
    /// Bits of [`Status`].
    pub status: &'a mut [u16],
    /// Standard deviation of the noise of a sample of weight 1.
    pub sigma: &'a mut [f64],
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

impl<'a> WindowFits<'a> {
    /// Takes so many windows off the front; there must be as many.
    pub(crate) fn take_first(&mut self, windows: usize) -> Self {
        let rows = |rows: &mut Vec<&'a mut [f64]>| {
            rows.iter_mut().map(|row| row.split_off_mut(..windows).unwrap_or_default()).collect()
        };
        Self {
            derivatives: rows(&mut self.derivatives),
            errors: rows(&mut self.errors),
            order: self.order.split_off_mut(..windows).unwrap_or_default(),
            status: self.status.split_off_mut(..windows).unwrap_or_default(),
            sigma: self.sigma.split_off_mut(..windows).unwrap_or_default(),
        }
    }

    /// Says of a window that nothing is known.
    pub(crate) fn invalidate(&mut self, window: usize) {
        for row in self.derivatives.iter_mut().chain(&mut self.errors) {
            row[window] = f64::NAN;
        }
        (self.order[window], self.status[window], self.sigma[window]) = (0, Status::INVALID.bits(), f64::NAN);
    }
}
