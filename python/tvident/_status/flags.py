"""Flags of samples and of records: their meaning, and what to do."""

from __future__ import annotations

import enum


class Status(enum.IntFlag):
    """Flags of one sample, or of a whole record; 0 is good.

    Bad data never raises an error: it gets a status, and the rest of the record is computed. Arrays hold the flags
    as ``uint16``, so ``fit.status & Status.EDGE`` works on whole arrays.

    There are two groups. Flags of a sample are in ``result.status`` and say what holds at that sample only: INVALID, EDGE, GAP,
    LOWEST_ORDER, HIGHEST_ORDER, EXACT, RANK_DEFICIENT, ILL_CONDITIONED, NOISE_MODEL. Flags of a record are in ``result.record_status``
    and say what holds for the whole record: NOISE_MODEL, COLOURED, KIND_CONTRADICTED, WINDOW_LIMIT, LAG_SUSPECTED, TERM_SUSPECTED,
    SCALES_DISAGREE, CHANNEL_SUSPECTED, RANK_DEFICIENT, ILL_CONDITIONED. Three are in both groups: RANK_DEFICIENT and ILL_CONDITIONED are
    flags of the record where they concern its constants or signs that contradict each other, of a sample where they concern the window
    around it; NOISE_MODEL is a flag of a sample where it holds outside a mask only, or where much more is left around the sample than
    elsewhere in the record; of several masses or trials of all samples where a channel that is late or whose gain is wrong makes a
    coefficient another one.

    See Also
    --------
    Identification : has flags of samples and of records.
    LocalPolynomialFit, RollingRegression : have flags of samples.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.
    The paper advises on LOWEST_ORDER and HIGHEST_ORDER; the tests behind the flags of a record are in docs/automatic.md.

    Examples
    --------
    >>> from tvident import Status
    >>> Status(9)
    <Status.INVALID|LOWEST_ORDER: 9>
    >>> print(Status.LOWEST_ORDER.advice)
    the lowest order was chosen: the signal hardly changes within the window, a longer one would be less noisy
    """

    INVALID = 1
    """There is no value: it is NaN. The only flag that goes with NaN. Look for missing values, and at the other flags."""

    EDGE = 2
    """Near an end of the record: evaluated off the centre of its window, or with fewer equations. Errors are larger there."""

    GAP = 4
    """Samples are missing or masked out here: the value comes from the samples around. Look at its standard error."""

    LOWEST_ORDER = 8
    """The lowest candidate order was chosen. The signal hardly changes within the window: a longer window would be less noisy."""

    HIGHEST_ORDER = 16
    """The highest candidate order was chosen. The signal may change more than a polynomial can follow: shorten the window."""

    EXACT = 32
    """The residual is at the floor set by rounding or quantisation, so there is no noise to compare orders with."""

    RANK_DEFICIENT = 64
    """The equations do not determine the parameters: those of the window around a sample, or the constants of the record. Their values
    are NaN, and INVALID says so. Excite the system, or leave a parameter out."""

    ILL_CONDITIONED = 128
    """The regressors are nearly collinear, so the equations hardly distinguish the parameters: those of the window around a sample, or
    the constants of the record. Or an inertia that changes has both signs in a record, or a stiffness does where errors of both are one.
    Look at the condition number, and at the standard errors before any value."""

    NOISE_MODEL = 256
    """The torque is predicted much worse than the noise of the channels explains: the noise is coloured, the torque is delayed, or a term
    is missing. Standard errors are estimated from the residuals. Look at what the summary suspects."""

    COLOURED = 512
    """The residuals are correlated over more than a test function. Look for a missing term, or a slow disturbance."""

    KIND_CONTRADICTED = 1024
    """A parameter that was taken to be constant differs between the parts of the record. Let it be ``"auto"`` or ``"varying"``."""

    WINDOW_LIMIT = 2048
    """The best test function or length of windows is the first or last that was tried. The parameters may change too fast to
    be followed, or the record is too short: then neither values nor standard errors can be trusted."""

    LAG_SUSPECTED = 4096
    """The torque seems to be delayed. Give ``lag=`` as the summary suggests."""

    TERM_SUSPECTED = 8192
    """Friction, an offset or a hardening spring seems to be missing. Add the term that the summary names."""

    SCALES_DISAGREE = 16384
    """Test functions of different widths find different parameters, and no range of widths agrees: the recording does not obey the
    equation of motion. Look at ``result.scan()``, and at what the summary advises."""

    CHANNEL_SUSPECTED = 32768
    """A channel seems to be clipped, held, interpolated, wrapped or filtered by more than a lag, its gain to change, or its stamps of time
    to jitter. The summary says which, and what to do."""

    @property
    def advice(self) -> str:
        """What the flags mean and what to do, in words: one string.

        See Also
        --------
        Identification.advice : what to do about one record.
        """
        return "; ".join(_ADVICE[flag] for flag in Status if flag in self) or "all is well"


_ADVICE = {
    Status.INVALID: "no value: samples are missing in the window, too few equations near an end, or see the other flags",
    Status.EDGE: "near an end of the record: errors are larger there",
    Status.GAP: "samples are missing or masked out here: the value comes from the samples around",
    Status.LOWEST_ORDER: (
        "the lowest order was chosen: the signal hardly changes within the window, a longer one would be less noisy"
    ),
    Status.HIGHEST_ORDER: (
        "the highest order was chosen: the signal may change more than a polynomial can follow, shorten the window"
    ),
    Status.EXACT: "the residual is rounding or quantisation: there is no noise to compare orders with",
    Status.RANK_DEFICIENT: "the equations do not determine the parameters: excite the system, or leave a parameter out",
    Status.NOISE_MODEL: (
        "the noise of the channels does not explain the residuals: coloured noise, a lag, or a missing term; standard errors are "
        "estimated from the residuals"
    ),
    Status.COLOURED: "the residuals are correlated over more than a test function: a term is missing, or there is a slow disturbance",
    Status.KIND_CONTRADICTED: (
        "a parameter taken as constant differs between parts of the record: use 'auto' or 'varying'; or windows contradict an expansion"
    ),
    Status.WINDOW_LIMIT: (
        "the best test function or window is the shortest or longest that was tried: the change is too fast, or the record is too short; "
        "values cannot be trusted then"
    ),
    Status.LAG_SUSPECTED: "the torque seems to be delayed: give lag= as the summary suggests",
    Status.TERM_SUSPECTED: "a term seems to be missing: add the one that the summary names",
    Status.SCALES_DISAGREE: (
        "test functions of different widths find different parameters: the recording does not obey this equation, do not trust the numbers"
    ),
    Status.CHANNEL_SUSPECTED: (
        "a channel seems to be clipped, held, interpolated, wrapped or filtered, its gain to change, or its stamps of time to jitter: do "
        "as the summary says"
    ),
    Status.ILL_CONDITIONED: (
        "the regressors are nearly collinear, or the motion tells nothing of what is windowed there: look at the standard errors first; or "
        "an inertia that changes has both signs, or a stiffness does where errors of both are one"
    ),
}

RECORD_FLAGS = (
    Status.RANK_DEFICIENT
    | Status.ILL_CONDITIONED
    | Status.NOISE_MODEL
    | Status.COLOURED
    | Status.KIND_CONTRADICTED
    | Status.WINDOW_LIMIT
    | Status.LAG_SUSPECTED
    | Status.TERM_SUSPECTED
    | Status.SCALES_DISAGREE
    | Status.CHANNEL_SUSPECTED
)
"""Flags that concern a whole record."""

DOUBTFUL = Status.INVALID | Status.RANK_DEFICIENT | Status.ILL_CONDITIONED | Status.NOISE_MODEL
"""Flags of a sample whose value is not to be trusted."""

DOUBTFUL_RECORD = Status.RANK_DEFICIENT | Status.ILL_CONDITIONED | Status.SCALES_DISAGREE
"""Flags of a record none of whose values is to be trusted."""
