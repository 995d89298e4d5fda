//! One record, from samples to numbers with errors and a status.

pub(crate) mod results;
pub(crate) mod strong;
pub(crate) mod weak;

pub use results::SampleResults;
pub use strong::general::{StrongIdentified, StrongOptions, identify_strong};
pub use strong::scatter::{Track, identify_with_scatter, scatter};
pub use strong::streaming::{Identified, identify_constant, identify_windowed};
pub use weak::lag::Lag;
pub use weak::outside_mask::Outside;
pub use weak::session::{Constant, Kind, WeakIdentified, WeakOptions, identify_weak};
