# The compiled module: every name that Python has of the core. What they take and give is in `_core_stubs/`.

from tvident._core_stubs.derivatives import (
    AutomaticEstimates,
    IncompleteEstimates,
    LocalEstimates,
    LocalPolynomials,
    WindowEstimates,
    WindowFit,
    estimate_automatically,
    sliding_velocity,
)
from tvident._core_stubs.identification import (
    ChannelDefect,
    ChannelNoise,
    ChannelSpike,
    ConstancyTest,
    ConstantsOfRows,
    Estimate,
    FactoredRows,
    Identification,
    Instrument,
    Motions,
    OffsetErrors,
    OtherValue,
    OutsideMask,
    Scan,
    StrongForm,
    Suspect,
    TriedLength,
    Unknown,
    WeakForm,
    built_in_terms,
    identify,
    merged_rows,
)
from tvident._core_stubs.merged import MergedElement, MergedIdentification, identify_merged
from tvident._core_stubs.noise import (
    Noise,
    PassedNoise,
    Resampling,
    break_counts,
    fuse,
    noise,
    noise_coherence,
    parts_of_quantisation,
    quantisation_step,
    spike_counts,
    unread_counts,
)
from tvident._core_stubs.regression import RollingRegressions, RowSpans, RowTimes, rolling_least_squares
from tvident._core_stubs.response import Modes, Responses, modes, respond
from tvident._core_stubs.streams import (
    ParameterStream,
    PolynomialStream,
    RollingStream,
    StreamedEstimates,
    StreamedParameters,
    StreamedRegressions,
)

__all__ = [
    "AGREE",
    "CONSPICUOUS",
    "CORRELATED_NOISE",
    "FEWEST_SAMPLES",
    "FEWEST_WIDTHS",
    "HARDLY_DIFFERS",
    "HARDLY_TOLD_APART",
    "LEAST_PLATEAU",
    "NEGATIVE_BEYOND",
    "NOISE_MODEL_FAILS",
    "NO_CHANCE",
    "OFTEN",
    "OTHER_CONSTANT",
    "WEAK_INSTRUMENT",
    "AutomaticEstimates",
    "ChannelDefect",
    "ChannelNoise",
    "ChannelSpike",
    "ConstancyTest",
    "ConstantsOfRows",
    "Estimate",
    "FactoredRows",
    "Identification",
    "IncompleteEstimates",
    "Instrument",
    "LocalEstimates",
    "LocalPolynomials",
    "MergedElement",
    "MergedIdentification",
    "Modes",
    "Motions",
    "Noise",
    "OffsetErrors",
    "OtherValue",
    "OutsideMask",
    "ParameterStream",
    "PassedNoise",
    "PolynomialStream",
    "Resampling",
    "Responses",
    "RollingRegressions",
    "RollingStream",
    "RowSpans",
    "RowTimes",
    "Scan",
    "StreamedEstimates",
    "StreamedParameters",
    "StreamedRegressions",
    "StrongForm",
    "Suspect",
    "TriedLength",
    "Unknown",
    "WeakForm",
    "WindowEstimates",
    "WindowFit",
    "available_instructions",
    "break_counts",
    "built_in_terms",
    "estimate_automatically",
    "force_instructions",
    "fuse",
    "identify",
    "identify_merged",
    "instructions",
    "merged_rows",
    "modes",
    "noise",
    "noise_coherence",
    "parts_of_quantisation",
    "quantisation_step",
    "respond",
    "rolling_least_squares",
    "sliding_velocity",
    "spike_counts",
    "status_flags",
    "unread_counts",
]

AGREE: float
CONSPICUOUS: float
CORRELATED_NOISE: float
FEWEST_SAMPLES: int
FEWEST_WIDTHS: int
HARDLY_DIFFERS: float
HARDLY_TOLD_APART: float
LEAST_PLATEAU: float
NEGATIVE_BEYOND: float
NOISE_MODEL_FAILS: float
NO_CHANCE: float
OFTEN: float
OTHER_CONSTANT: float
WEAK_INSTRUMENT: float

def status_flags() -> list[tuple[str, int]]: ...
def available_instructions() -> list[str]: ...
def instructions() -> str: ...
def force_instructions(name: str | None) -> None: ...
