//! Identification of one record: from samples to parameters with standard errors and status.

pub(crate) mod builder;
pub(crate) mod form;
pub(crate) mod identification;
pub(crate) mod instrumented;
pub(crate) mod kinds;
pub(crate) mod merged;
pub(crate) mod missing;
pub(crate) mod options;
pub(crate) mod results;
pub(crate) mod route;
pub(crate) mod scanned;
pub(crate) mod strong;
pub(crate) mod weak;
pub(crate) mod widths;

pub use builder::{Identify, Parameter, StrongSettings};
pub use identification::{Covariance, Identification, Unknown, WeakDetails};
pub use instrumented::record::{InstrumentTest, identify_with_instruments};
pub use instrumented::two_stage_rows::WEAK_INSTRUMENT;
pub use kinds::Kind;
pub use merged::form::identify_merged;
pub use merged::found::{FoundElement, MergedFound};
pub use merged::possible_terms::MotionOf;
pub use merged::suspected_terms::SuspectedTerm;
pub use merged::system::{Element, Entry, Merged, MergedOptions, Multiplied, Trial};
pub use options::{Method, Options, Repeated, StrongForm, Task, WeakForm, WidthFrom};
pub use route::identify_all;
pub use scanned::{Agreement, FEWEST_WIDTHS, OTHER_CONSTANT, Scan};
pub use strong::constant::{constants_of_rows, rows_of_part};
pub use strong::parts::{around, parts_of_scatter, scatter_of_windows};
pub use strong::scan::scan_windows;
pub use strong::streaming::StrongRecord;
pub use weak::angle_zero::outcome::AngleZero;
pub use weak::angle_zero::outcome::FreeOffset;
pub use weak::friction::Sliding;
pub use weak::lag::Lag;
pub use weak::outside_mask::Outside;
