//! The response of a system whose parameters are known to a torque: integration over samples, the state to begin in, and modes of free vibration.

pub(crate) mod friction;
pub(crate) mod gaps;
pub(crate) mod initial_state;
pub(crate) mod integrator;
pub(crate) mod modes;
pub(crate) mod spans;
pub(crate) mod system;
pub(crate) mod transition;

pub use modes::{Mode, modes};
pub use spans::{Begins, Response, Span, respond};
pub use system::{Factor, System, SystemTerm};
