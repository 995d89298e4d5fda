"""The plan of an experiment."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._files import aligned
from tvident._units import in_words_of

Array: TypeAlias = npt.NDArray[np.float64]

PERIODS = 10
"""Of the lowest frequency: from so many on the bound is that of a long record."""

_ROUNDING = 1e-9

_MOST_SAMPLES = 1e12
"""Of a torque: no memory holds more."""


@dataclass(frozen=True)
class ExperimentPlan:
    r"""What :func:`tvident.plan_experiment` returns.

    Attributes
    ----------
    duration : float
        Seconds.
    frequencies, amplitudes : ndarray, shape (f,)
        Sines of the torque: Hz, and N m, or N of an axis that slides. Empty of a plan to go on with a recording.
    torque_rms, angle_rms : float
        Of the torque, and of the motion that it is expected to make; NaN of a plan to go on.
    errors : dict of str to float
        Expected relative standard errors of ``"inertia"``, ``"damping"`` and ``"stiffness"``.
    before : dict of str to float
        The same of the recording at hand, if there is one.
    wanted : float
        The relative standard error of the stiffness that was asked for.
    reached : bool
        Whether it is expected.
    units : dict of str to str
        Units of angle, torque and parameters: those of an axis that turns, or of one that slides (m, N).

    See Also
    --------
    plan_experiment : makes one.

    References
    ----------
    H. Cramér: Mathematical methods of statistics, Princeton 1946: the inverse of the information bounds the variance of unbiased estimates.

    Examples
    --------
    >>> import tvident
    >>> plan = tvident.plan_experiment(
    ...     inertia=0.0123, damping=0.008, stiffness=13, band=(0.5, 12), torque_noise=0.02, torque_rms=0.2
    ... )
    >>> bool(plan.reached and plan.errors["stiffness"] <= 0.02)
    True
    >>> torque = plan.excitation(sample_rate=1000)
    """

    duration: float
    frequencies: Array
    amplitudes: Array
    torque_rms: float
    angle_rms: float
    errors: Mapping[str, float]
    before: Mapping[str, float]
    wanted: float
    reached: bool
    units: Mapping[str, str]

    def __repr__(self) -> str:
        errors = ", ".join(f"{name} ± {100 * error:.2g} %" for name, error in self.errors.items())
        return f"<ExperimentPlan of {self.duration:.4g} s: {errors}>"

    def excitation(self, *, sample_rate: float, seed: int = 0) -> Array:
        """Return the torque as samples: sines of random phase.

        Parameters
        ----------
        sample_rate : float
            Samples per second, more than twice the highest frequency.
        seed : int, optional
            Of the phases.

        Returns
        -------
        ndarray of float64, shape (duration times sample_rate,)
            In N m, or N of an axis that slides.

        Raises
        ------
        ValueError
            If the rate is too low for the frequencies, or the plan is to go on with a recording and has none.

        See Also
        --------
        plan_experiment : chooses the frequencies.
        simulate_torsional_rig : a rig to try it on.

        References
        ----------
        R. Pintelon, J. Schoukens: System identification, a frequency domain approach (2012): random-phase multisines.
        """
        rate = arguments.positive_number("sample_rate", sample_rate)
        if not self.frequencies.size:
            raise ValueError(
                "a torque must be of a plan with frequencies; got one to go on with a recording; go on as before, or plan from a guess"
            )
        if not rate > 2 * self.frequencies[-1]:
            raise ValueError(
                f"sample_rate must be more than twice the highest frequency, {self.frequencies[-1]:.4g} Hz; got {rate:g} Hz; raise it, or "
                "plan with a lower band"
            )
        if not self.duration * rate < _MOST_SAMPLES:
            raise ValueError(
                f"a torque must have fewer than {_MOST_SAMPLES:g} samples; got {self.duration * rate:.3g}; lower sample_rate="
            )
        time = np.arange(round(self.duration * rate)) / rate
        phases = np.random.default_rng(arguments.whole_number("seed", seed, least=0)).uniform(
            0, 2 * np.pi, self.frequencies.size
        )
        found = np.zeros(time.size)
        for frequency, amplitude, phase in zip(self.frequencies, self.amplitudes, phases, strict=True):
            found += amplitude * np.sin(2 * np.pi * frequency * time + phase)
        return found

    def summary(self) -> str:
        """Return the plan in words.

        Returns
        -------
        str

        See Also
        --------
        excitation : the torque as samples.
        Identification.summary : what the recording then says.
        """
        name = f"stiffness within {100 * self.wanted:.3g} %"
        periods = self.duration * self.frequencies[0] if self.frequencies.size else math.inf
        if self.before and (self.reached or not math.isfinite(self.before.get("stiffness", math.inf))):
            lines = [f"{name}: {self._of_more()}"]
        elif self.reached:
            is_least = abs(periods / PERIODS - 1) <= _ROUNDING and self.errors["stiffness"] < self.wanted
            why = f", ten periods of {self.frequencies[0]:.4g} Hz: less torque would do" if is_least else ""
            lines = [f"{name}: record {self.duration:.4g} s{why}"]
        else:
            cure = "it belongs to windows, which more time does not lengthen: excite more, or let windows be longer"
            lines = [f"{name} cannot be reached by recording longer: {cure}"]
        if self.frequencies.size:
            lines.append(
                f"torque of {self.torque_rms:.3g} {self.units['torque']} rms, which moves the angle by about "
                f"{self.angle_rms:.3g} {self.units['angle']} rms:"
            )
            if periods < PERIODS * (1 - _ROUNDING):
                lines.append(
                    f"these hold {periods:.2g} periods of {self.frequencies[0]:.4g} Hz: errors will be larger than said here, "
                    f"which holds for {PERIODS} or more; record longer, or begin with a higher frequency"
                )
            each = zip(self.frequencies, self.amplitudes, strict=True)
            lines += aligned([("Hz", self.units["torque"]), *((f"{one:.4g}", f"{other:.3g}") for one, other in each)])
        heads = ("parameter", *(["now"] if self.before else []), "expected error")
        rows = [
            (one, *([f"{100 * self.before[one]:.3g} %"] if self.before else []), f"{100 * error:.3g} %")
            for one, error in self.errors.items()
        ]
        return in_words_of(self.units, "\n".join([*lines, "", *aligned([heads, *rows])]))

    def _of_more(self) -> str:
        """Return what more of a recording at hand is worth for the stiffness."""
        now = self.before.get("stiffness", math.inf)
        longer = f"{self.duration:.4g} s in all"
        if not math.isfinite(now):
            return f"no error of it is known, as where the stiffness was given; expected of {longer}:"
        if now <= self.wanted:
            return f"reached already; expected of {longer}:"
        return f"{'reached with' if self.errors['stiffness'] <= self.wanted else 'needs'} {longer}"
