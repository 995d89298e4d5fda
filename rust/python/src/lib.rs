//! The Python module `tvident._core`: NumPy arrays in, NumPy arrays out, no arithmetic.

#![allow(
    clippy::needless_pass_by_value,
    clippy::too_many_arguments,
    reason = "what Python passes arrives by value, and keyword arguments are many"
)]

mod arrays;
mod automatic;
mod identified;
mod identify;
mod irregular;
mod local_polynomials;
mod merged;
mod modes;
mod motions;
mod noise;
mod records;
mod reserve;
mod respond;
mod rolling;
mod sliding;
mod streamed_parameters;
mod streams;
mod watch;
mod window_fit;

use pyo3::prelude::*;

/// The compiled core of tvident.
#[pymodule(gil_used = false)]
mod _core {
    use pyo3::exceptions::PyValueError;
    use pyo3::prelude::*;
    use tvident::Status;
    use tvident::equation::BUILT_IN_TERMS;
    use tvident::simd::Instructions;

    #[pymodule_export]
    use crate::automatic::{AutomaticEstimates, estimate_automatically};
    #[pymodule_export]
    use crate::identified::{
        ChannelDefect, ChannelNoise, ChannelSpike, ConstancyTest, Estimate, Identification, Instrument, OffsetErrors,
        OtherValue, OutsideMask, Scan, Suspect, TriedLength, Unknown,
    };
    #[pymodule_export]
    use crate::identify::{ConstantsOfRows, FactoredRows, StrongForm, WeakForm, identify, merged_rows};
    #[pymodule_export]
    use crate::irregular::{PassedNoise, Resampling};
    #[pymodule_export]
    use crate::local_polynomials::{IncompleteEstimates, LocalEstimates, LocalPolynomials};
    #[pymodule_export]
    use crate::merged::{MergedElement, MergedIdentification, identify_merged};
    #[pymodule_export]
    use crate::modes::{Modes, modes};
    #[pymodule_export]
    use crate::motions::Motions;
    #[pymodule_export]
    use crate::noise::{
        Noise, break_counts, fuse, noise, noise_coherence, parts_of_quantisation, quantisation_step, spike_counts,
        unread_counts,
    };
    #[pymodule_export]
    use crate::respond::{Responses, respond};
    #[pymodule_export]
    use crate::rolling::{RollingRegressions, RowSpans, RowTimes, rolling_least_squares};
    #[pymodule_export]
    use crate::sliding::sliding_velocity;
    #[pymodule_export]
    use crate::streamed_parameters::{ParameterStream, StreamedParameters};
    #[pymodule_export]
    use crate::streams::{PolynomialStream, RollingStream, StreamedEstimates, StreamedRegressions};
    #[pymodule_export]
    use crate::window_fit::{WindowEstimates, WindowFit};

    /// Probability below which parts of a record differ by more than chance.
    #[pymodule_export]
    const NO_CHANCE: f64 = tvident::inference::NO_CHANCE;
    /// The part of a constant by which parts of a record must differ to contradict that it was left constant.
    #[pymodule_export]
    const HARDLY_DIFFERS: f64 = tvident::inference::HARDLY_DIFFERS;
    /// A term is suspected if its coefficient exceeds its standard error so many times.
    #[pymodule_export]
    const CONSPICUOUS: f64 = tvident::inference::CONSPICUOUS;
    /// Error of prediction, over the noise's, above which the noise of the channels does not explain it.
    #[pymodule_export]
    const NOISE_MODEL_FAILS: f64 = tvident::regression::NOISE_MODEL_FAILS;
    /// Condition number from which on equations hardly tell parameters apart.
    #[pymodule_export]
    const HARDLY_TOLD_APART: f64 = tvident::regression::HARDLY_TOLD_APART;
    /// Standard errors below zero from which on a value is negative, not merely uncertain.
    #[pymodule_export]
    const NEGATIVE_BEYOND: f64 = tvident::regression::NEGATIVE_BEYOND;
    /// A part of the values that is no chance.
    #[pymodule_export]
    const OFTEN: f64 = tvident::regression::OFTEN;
    /// F statistic of the first stage below which an instrument is weak.
    #[pymodule_export]
    const WEAK_INSTRUMENT: f64 = tvident::identify::WEAK_INSTRUMENT;
    /// Coherence of the noise of both channels from which on one is fed back into the other.
    #[pymodule_export]
    const CORRELATED_NOISE: f64 = tvident::noise::CORRELATED_NOISE;
    /// Standard errors, the smaller of two, within which widths agree.
    #[pymodule_export]
    const AGREE: f64 = tvident::inference::AGREE;
    /// Widths that agree differ by this factor or more, or it may be chance.
    #[pymodule_export]
    const LEAST_PLATEAU: f64 = tvident::inference::LEAST_PLATEAU;
    /// Widths that determine the constants, at least, to be compared.
    #[pymodule_export]
    const FEWEST_WIDTHS: usize = tvident::identify::FEWEST_WIDTHS;
    /// Standard errors beyond which a constant is another than that of the widths that agree.
    #[pymodule_export]
    const OTHER_CONSTANT: f64 = tvident::identify::OTHER_CONSTANT;
    /// The shortest record that a window is chosen for.
    #[pymodule_export]
    const FEWEST_SAMPLES: usize = tvident::auto_derivatives::FEWEST_SAMPLES;

    #[pymodule_init]
    fn first(module: &Bound<'_, PyModule>) -> PyResult<()> {
        crate::reserve::grow_stack();
        crate::arrays::look_up_numpy(module.py())
    }

    /// Every flag of a status: name and bits.
    #[pyfunction]
    fn status_flags() -> Vec<(&'static str, u16)> {
        Status::NAMED.iter().map(|(name, flag)| (*name, flag.bits())).collect()
    }

    /// Names of the built-in terms of the equation of motion.
    #[pyfunction]
    fn built_in_terms() -> Vec<&'static str> {
        BUILT_IN_TERMS.iter().map(|term| term.name).collect()
    }

    /// Vector instructions that this processor has, the fastest first.
    #[pyfunction]
    fn available_instructions() -> Vec<String> {
        Instructions::available().iter().map(|one| format!("{one:?}").to_lowercase()).collect()
    }

    /// Vector instructions that new plans use.
    #[pyfunction]
    fn instructions() -> String {
        format!("{:?}", Instructions::current()).to_lowercase()
    }

    /// Makes new plans use other instructions, or the fastest again after None. Meant for tests.
    #[pyfunction]
    #[pyo3(signature = (name))]
    fn force_instructions(name: Option<&str>) -> PyResult<()> {
        let choice = match name {
            None => None,
            Some(name) => {
                let named = Instructions::available().into_iter().find(|one| format!("{one:?}").to_lowercase() == name);
                Some(
                    named
                        .ok_or_else(|| PyValueError::new_err(format!("this processor has no instructions {name:?}")))?,
                )
            }
        };
        Instructions::force(choice);
        Ok(())
    }
}
