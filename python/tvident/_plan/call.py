"""The function ``plan_experiment``."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._equation import COEFFICIENTS, LINEAR_UNITS, UNITS
from tvident._plan.information import Guess, best_powers, variances
from tvident._plan.plan import PERIODS, ExperimentPlan
from tvident._results import Identification
from tvident._units import ROTARY, axis_of

_GRID = 60
"""Frequencies at which power may be."""

_SPREAD = 12
"""Frequencies over which half of the power is spread evenly."""

_SMALLEST = 1e-24
"""The smallest number that is taken, and one over the largest: eighth powers stay within doubles."""

_LEAST_SHARE = 0.01
"""Lines with less than this part of the power are left out."""

_MORE = 60.0
"""Seconds that are recorded in addition where nothing is said."""

_RATE = 1000.0
"""Samples per second where nothing is said."""

_LONGEST = 1e7
"""Seconds: a third of a year."""

_SHOWN = ("angle", "torque", *COEFFICIENTS)
"""Quantities of a plan that have units."""


# All are options, as users call it.
def plan_experiment(
    *,
    inertia: float | None = None,
    damping: float | None = None,
    stiffness: float | None = None,
    band: Sequence[float] | None = None,
    torque_noise: float | None = None,
    angle_noise: float | None = None,
    wanted: float = 0.02,
    duration: float | None = None,
    torque_rms: float | None = None,
    resolution: float | None = None,
    sample_rate: float | None = None,
    angle_unit: str | None = None,
    torque_unit: str | None = None,
    result: Identification | None = None,
    more: float | None = None,
) -> ExperimentPlan:
    r"""Plan an experiment: how long, which frequencies and which amplitude, for a wanted error of the stiffness.

    The bound of Cramér and Rao follows from the information in the rows of the equation of motion, equation (1): at a frequency with
    torque T the row T = Z θ, Z = K - Iω² + iCω, has the noise of the torque and Z times that of the angle. Power goes where it makes
    the variance of the stiffness smallest; half of it is spread evenly over the band, since a guess may be wrong and few frequencies
    tell little of what the equation lacks.

    With a `result` it says what another minute would bring instead.

    Parameters
    ----------
    inertia, damping, stiffness : float
        A guess of the system, in kg m², N m s/rad and N m/rad; of an axis that slides in kg, N s/m and N/m.
    band : (float, float)
        The lowest and the highest frequency that can be excited, in Hz.
    torque_noise : float
        Standard deviation of the torque's noise at each sample, in `torque_unit`.
    angle_noise : float, optional
        The same of the angle, in `angle_unit`; by default none.
    wanted : float, optional
        Relative standard error of the stiffness that is wanted.
    duration : float, optional
        Seconds. With a duration and without `torque_rms` the amplitude is planned. Less than ten periods of the lowest frequency are said
        in the summary: the bound is for many.
    torque_rms : float, optional
        Root mean square of the torque, in `torque_unit`. Without a duration that is planned, ten periods of the lowest frequency at least.
    resolution : float, optional
        The stiffness changes, and this is the time in seconds over which it may be averaged: the length of a regression window, or the
        record over the number of functions of an :class:`Expansion`. By default it is constant.
    sample_rate : float, optional
        Samples per second, by default 1000.
    angle_unit, torque_unit : str, optional
        Units of `angle_noise`, `torque_noise` and `torque_rms`, by default rad and N m. Those of a length or a force (``"mm"``, ``"N"``)
        say that the axis slides. What is planned is in rad and N m, or in m and N: ``units`` says it.
    result : Identification, optional
        Of a recording at hand, instead of all of these but `wanted`.
    more : float, optional
        Seconds that would be recorded in addition to that of `result`, by default 60.

    Returns
    -------
    ExperimentPlan
        ``duration``, ``frequencies`` and ``amplitudes`` of shape (f,), ``errors``; ``summary()`` says it in words, ``excitation()`` gives
        the torque.

    Raises
    ------
    ValueError
        If a number is missing or not positive, the band is none or beyond half the sample rate, neither a duration nor a torque is
        given, or units are unknown or of different axes.
    TypeError
        If a result is given beside a guess, or `more` without a result.

    Notes
    -----
    The bound holds for a record many periods long, and noise that is white. In weak form errors reach it where equations are
    weighted: constants, and expansions. A plan costs some 10 ms; the record that it plans costs identify about 1 µs a sample.

    See Also
    --------
    identify : reaches these errors.

    References
    ----------
    G. C. Goodwin, R. L. Payne: Dynamic system identification: experiment design and data analysis, Academic Press 1977.

    Examples
    --------
    >>> import tvident
    >>> guess = dict(inertia=0.0123, damping=0.008, stiffness=13, band=(0.5, 12), torque_noise=0.02)
    >>> plan = tvident.plan_experiment(**guess, duration=20, wanted=0.001)
    >>> bool(0.001 < plan.torque_rms < 1)
    True
    >>> rig = tvident.simulate_torsional_rig(duration=4.0)
    >>> result = tvident.identify(rig.angle, rig.torque, sample_rate=1000)
    >>> longer = tvident.plan_experiment(result=result, more=12)
    >>> bool(abs(longer.errors["inertia"] / longer.before["inertia"] - 0.5) < 1e-6)
    True
    """
    wanted = arguments.positive_number("wanted", wanted)
    of_guess = {"duration": duration, "torque_rms": torque_rms, "resolution": resolution}
    given = {"inertia": inertia, "damping": damping, "stiffness": stiffness, "torque_noise": torque_noise}
    others = {"band": band, "angle_noise": angle_noise, "sample_rate": sample_rate}
    _check_one_source(
        result, more, {**given, **of_guess, **others, "angle_unit": angle_unit, "torque_unit": torque_unit}
    )
    if result is not None:
        return _longer(result, wanted, _MORE if more is None else arguments.positive_number("more", more))
    numbers = {name: _needed(name, one) for name, one in given.items()}
    _check_size(given | {"wanted": wanted, "angle_noise": angle_noise, "sample_rate": sample_rate})
    _check_size(of_guess)
    rate = _RATE if sample_rate is None else arguments.positive_number("sample_rate", sample_rate)
    low, high = _band(band, rate)
    axis = axis_of(None, None, angle_unit=angle_unit, torque_unit=torque_unit)
    units = UNITS if axis.system is ROTARY else LINEAR_UNITS
    angle_error = arguments.finite_number("angle_noise", 0.0 if angle_noise is None else angle_noise, least=0)
    noise = (angle_error * axis.angle, numbers["torque_noise"] * axis.torque)
    guess = Guess(np.array([numbers[name] for name in COEFFICIENTS]), noise)
    frequencies, share = _powers(guess, low, high)
    each = np.einsum("f,fij->ij", share, guess.information(frequencies))
    window = None if resolution is None else arguments.positive_number("resolution", resolution) * rate
    if torque_rms is None:
        if duration is None:
            raise ValueError(
                f"a plan needs the torque or the time; got neither; give torque_rms= in {torque_unit or units['torque']}, or "
                "duration= in s"
            )
        seconds = arguments.positive_number("duration", duration)
        unit = math.sqrt(variances(each, seconds * rate, window)[2]) / numbers["stiffness"]
        rms = unit / wanted
    else:
        rms = arguments.positive_number("torque_rms", torque_rms) * axis.torque
        seconds = (
            max(_duration(each * rms**2, rate, window, wanted * numbers["stiffness"]), PERIODS / low)
            if duration is None
            else arguments.positive_number("duration", duration)
        )
    errors = np.sqrt(variances(each * rms**2, seconds * rate, window)) / guess.parameters
    moved = rms * math.sqrt(float(np.sum(share / np.abs(guess.impedance(frequencies)) ** 2)))
    return ExperimentPlan(
        duration=seconds,
        frequencies=frequencies,
        amplitudes=np.asarray(rms * np.sqrt(2 * share)),
        torque_rms=rms,
        angle_rms=moved,
        errors=dict(zip(COEFFICIENTS, errors.tolist(), strict=True)),
        before={},
        wanted=wanted,
        reached=bool(errors[2] <= wanted * (1 + 1e-9)),
        units={name: units[name] for name in _SHOWN},
    )


def _check_one_source(result: Identification | None, more: float | None, of_guess: Mapping[str, object]) -> None:
    """Check that a plan is of a result, or of a guess."""
    there = [f"{name}=" for name, one in of_guess.items() if one is not None]
    if result is not None and there:
        raise TypeError(
            f"a plan must be of a guess or of a result; got result= and {', '.join(there)}; leave out one of them"
        )
    if result is None and more is not None:
        raise TypeError(
            "more must go with result=, the recording that it is added to; got none; give duration= instead"
        )


def _needed(name: str, value: float | None) -> float:
    if value is None:
        raise ValueError(f"a plan needs a guess of {name}; got none; give {name}=, or result= of a recording at hand")
    return arguments.positive_number(name, value)


def _check_size(numbers: Mapping[str, float | None]) -> None:
    """Check that powers of numbers stay within doubles: of machines they do."""
    for name, number in numbers.items():
        size = arguments.real_number(name, number) if number is not None else 0.0
        if size > 0 and not _SMALLEST <= size <= 1 / _SMALLEST:
            raise ValueError(
                f"{name} must be between {_SMALLEST:g} and {1 / _SMALLEST:g}; got {arguments.shown(number)}; take other units"
            )


def _band(band: Sequence[float] | None, rate: float) -> tuple[float, float]:
    there = isinstance(band, Sequence | np.ndarray) and not isinstance(band, str) and arguments.is_several(band)
    if band is None or not there or len(band) != 2 or any(map(arguments.is_several, band)):  # noqa: PLR2004 - two ends
        raise ValueError(
            f"band must be the lowest and the highest frequency; got {arguments.shown(band)}; give band=(0.5, 12), say"
        )
    low, high = (arguments.positive_number("band", one) for one in band)
    _check_size({"band": low})
    if not low < high < rate / 2:
        raise ValueError(
            f"band must rise, and end below half the sample rate of {rate:g} Hz; got {low:g} to {high:g} Hz; narrow it"
        )
    return low, high


def _powers(guess: Guess, low: float, high: float) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return frequencies and their shares of the power."""
    grid = np.linspace(low, high, _GRID)
    share = best_powers(guess.information(grid), guess.parameters) / 2
    places = np.unique(np.linspace(0, _GRID - 1, _SPREAD).round().astype(int))
    share[places] += 0.5 / places.size
    there = share > _LEAST_SHARE
    return grid[there], share[there] / share[there].sum()


def _duration(each: npt.NDArray[np.float64], rate: float, window: float | None, error: float) -> float:
    """Return the shortest time that gives an error of the stiffness; the longest of all where none does."""

    def too_large(seconds: float) -> bool:
        return bool(variances(each, seconds * rate, window)[2] > error**2)

    low, high = (1 if window is None else window) / rate, _LONGEST
    if too_large(high):
        return high
    while high / low > 1 + 1e-9:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if too_large(middle) else (low, middle)
    return high


def _longer(result: Identification, wanted: float, more: float) -> ExperimentPlan:
    """Return what more of the same would bring: constants know of all of it, windows of their own seconds only."""
    if not isinstance(result, Identification):
        raise TypeError(
            f"result must be what identify returns for one record; got {arguments.shown(result)}; leave it out, or identify first"
        )
    if result.inertia.ndim != 1:
        raise ValueError(f"a plan is for one record; got shape {result.inertia.shape}; take one of them")
    if result._found.is_part:  # noqa: SLF001 - nobody else asks
        raise ValueError(
            f"a plan goes on from a whole record, whose constants the result has; got a part of {result.time.size} samples; pass the whole "
            "result, or identify the part alone"
        )
    seconds = result.time.size * result.settings["step"] / result.settings["sample_rate"]
    now, then = {}, {}
    longest = seconds + more
    for name in COEFFICIENTS:
        kind = result.settings["kinds"][name]
        if kind == "known":
            continue
        one = result.value(name)
        now[name] = abs(one.stderr / one.value) if one.value else math.inf
        lasts = kind in {"constant", "expanded"}
        then[name] = now[name] * (math.sqrt(seconds / longest) if lasts else 1.0)
    error, kind = now.get("stiffness", math.nan), result.settings["kinds"]["stiffness"]
    time_helps = math.isfinite(error) and kind in {"constant", "expanded"}
    if time_helps and then["stiffness"] > wanted:
        longest = seconds * (error / wanted) ** 2
    return ExperimentPlan(
        duration=longest,
        frequencies=np.zeros(0),
        amplitudes=np.zeros(0),
        torque_rms=math.nan,
        angle_rms=math.nan,
        errors=then,
        before=now,
        wanted=wanted,
        reached=bool(time_helps or then.get("stiffness", math.inf) <= wanted),
        units={name: result.units[name] for name in _SHOWN},
    )
