//! Statistical inference: cross-validation, tests of constancy, jumps, identifiability, missing terms and whether anything is explained.

pub(crate) mod across_trials;
pub(crate) mod bandwidths;
pub(crate) mod carried_on;
pub(crate) mod constancy;
pub(crate) mod cross_validation;
pub(crate) mod drive;
pub(crate) mod explained;
pub(crate) mod identifiability;
pub(crate) mod jumps;
pub(crate) mod largest_square;
pub(crate) mod missing_terms;
pub(crate) mod moving;
pub(crate) mod over_record;
pub(crate) mod part_constants;
pub(crate) mod scales;
pub(crate) mod short_parts;
pub(crate) mod signs;
pub(crate) mod slow_bandwidths;
pub(crate) mod slow_curve;
pub(crate) mod slow_equations;
pub(crate) mod slow_lengths;
pub(crate) mod slow_points;
pub(crate) mod slow_predictions;
pub(crate) mod slow_triangles;
pub(crate) mod slowly_varying;
pub(crate) mod trend;
pub(crate) mod weighted_windows;
pub(crate) mod window_averaging;
pub(crate) mod windows_around;

pub use constancy::{HARDLY_DIFFERS, NO_CHANCE, Test};
pub use missing_terms::{CONSPICUOUS, Missing, Suspect};
pub use scales::{AGREE, AtScale, LEAST_PLATEAU, Plateau};
