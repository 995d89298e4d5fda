//! Derivatives whose window length and order are both chosen from the record.

pub(crate) mod automatic;
pub(crate) mod block_means;
pub(crate) mod block_weights;
pub(crate) mod boundary;
pub(crate) mod candidate_weights;
pub(crate) mod candidates;
pub(crate) mod deconvolution;
pub(crate) mod differences;
pub(crate) mod global_choice;
pub(crate) mod interpolated_average;
pub(crate) mod knots;
pub(crate) mod local_average;
pub(crate) mod local_weights;
pub(crate) mod mixture;
pub(crate) mod reference_line;
pub(crate) mod slopes;
pub(crate) mod survey;
pub(crate) mod symmetric_grid;
pub(crate) mod trend;
pub(crate) mod whole_record;

pub use automatic::{
    AutomaticChoice, AutomaticEstimates, AutomaticOptions, AutomaticRecord, FEWEST_SAMPLES, estimate_automatically,
};
