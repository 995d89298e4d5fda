"""Identification of what trials or masses share: from channels to elements, and from what the core found to a result."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._clocks import Timed
from tvident._equation import COEFFICIENTS, Term
from tvident._expansion import Expansion
from tvident._merged.earlier import Earlier
from tvident._merged.elements import Element, check_expansions, kind_or_number, on_grid
from tvident._merged.expanded import ExpandedEquations
from tvident._merged.merging import Merging, Part
from tvident._merged.predicted import Equations
from tvident._merged.recorded import MergedRecorded
from tvident._merged.result import MergedIdentification
from tvident._merged.sampling import Sampling, variance_in_trials
from tvident._merged.trials import Trials

Numbers = npt.NDArray[np.number]


class TermValues(Protocol):
    """Gives terms of an angle."""

    def __call__(self, name: str, angle: Numbers) -> npt.NDArray[np.float64]:
        """Return a term, by its name, at every sample."""

    def motion(self, angles: Numbers) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Return smoothed angles and velocities."""


@dataclass(frozen=True)
class AskedTogether:
    """What is the same for every call of the core.

    Parameters
    ----------
    sampling : Sampling
        When samples were taken.
    parameters : mapping of str to object
        What was given of inertia, damping and stiffness.
    terms : sequence of (str, str, Expansion or None)
        Names and kinds; none where an earlier result tells it.
    own : mapping of str to Term
        Those of the user's own.
    forms : sequence of mapping of str to int or None
        Window length, exponent and regression window in samples, None where they are chosen: of every part of the equations that shares
        no unknown with others, or one for all.
    earlier : Earlier, optional
        Settings of another result.
    units : mapping of str to str
        By inertia, damping, stiffness and the name of a term.
    step : int
    workers : int, optional
    report : callable, optional
        Takes the samples done and all of them.
    """

    sampling: Sampling
    parameters: Mapping[str, Any]
    terms: Sequence[tuple[str, str | Expansion | None]]
    own: Mapping[str, Term]
    forms: Sequence[Mapping[str, int | None]]
    earlier: Earlier | None
    units: Mapping[str, str]
    step: int
    workers: int | None
    report: Callable[[int, int], object] | None

    def part(
        self,
        equations: Equations,
        samples: int,
        noise: tuple[list[float], list[float]] | None = None,
        place: int = 0,
        *,
        is_white: bool = True,
    ) -> Part:
        """Call the core; the noise is that of every angle and every torque, as variances, where it is not to be estimated.

        The place is that of the part among those that share no unknown. Noise that may not be white is asked for its colour first, as the
        core reads that with the variance alone.
        """
        if equations.expansions:

            def windows(asked: AskedTogether, some: Equations) -> Part:
                return asked.part(some, samples, noise, place, is_white=is_white)

            return self._expanded(equations, partial(windows, replace(self, step=1)), partial(windows, self))
        asked = self.forms[min(place, len(self.forms) - 1)]
        identified = partial(
            _core.identify_merged,
            list(equations.trials),
            [element.given() for element in equations.elements],
            samples,
            delta=self.sampling.period,
            window_length=asked["window_length"],
            exponent=asked["exponent"],
            regression_window=asked["regression_window"],
            step=self.step,
            workers=self.workers,
        )
        if is_white:
            found = identified(noise=noise, progress=self.report)
        else:
            found = identified(noise=None, progress=self._report_of_half(0))
            if max(found.colours, default=1.0) <= 1:
                found = identified(noise=noise, progress=self._report_of_half(1))
            elif self.report is not None:
                self.report(samples, samples)
        self._check_window(asked["regression_window"], found.regression_window, found.window_length)
        # Nothing was determined: no window was long enough.
        again = replace(self, forms=[{name: getattr(found, name) or None for name in asked}], report=None)
        chosen = [name for name, value in asked.items() if value is None]
        # The colour of noise is not given, but read with its variance.
        same = noise or (None if max(found.colours, default=1.0) > 1 else found.noise)
        return Part(found, equations, lambda others: again.part(others, samples, same), chosen)

    def _expanded(
        self,
        equations: Equations,
        every_sample: Callable[[Equations], Part],
        wanted: Callable[[Equations], Part],
    ) -> Part:
        """Return what takes the place of windows where elements are sums of functions; windows themselves where they determine nothing.

        Parameters
        ----------
        equations : Equations
        every_sample, wanted : callable
            Give windows of equations at every sample, and at the samples that are wanted.
        """
        windows = every_sample(equations.in_windows)
        assert isinstance(windows.found, _core.MergedIdentification)  # noqa: S101 - for mypy
        time = self.sampling.times(windows.found.status.size)
        units = self.units_of(equations.elements)
        aligned = equations.trials[0][4] is not None
        phase = np.arange(time.size) / time.size if aligned else None
        each = ExpandedEquations(equations, windows.found, self.sampling.period, time, self.step, units, phase)
        found = each.found()
        if found is None:
            return windows if self.step == 1 else wanted(equations.in_windows)
        chosen = [one for one in windows.chosen if one != "regression_window"]
        fixed = equations.of_sizes({name: curve.size for name, curve in found.curves.items()})
        return Part(found, fixed, lambda others: self._expanded(others, windows.again, wanted), chosen)

    @staticmethod
    def _check_window(wanted: int | None, nearest: int, test_function: int) -> None:
        """Refuse a regression window that is far from the nearest that there is, in samples; 0 where nothing is windowed."""
        if wanted is None or nearest == 0 or wanted / 2 <= nearest <= 2 * wanted:
            return
        if abs(wanted - nearest) <= test_function / 8:
            # Equations lie as far apart as a test function needs: windows of one time and of one sample are the same.
            return
        bound, cure = ("at least", "more") if nearest > wanted else ("at most", "fewer")
        raise ValueError(
            f"regression_window must be {bound} about {nearest} samples here, since windows are compared with equations that share no "
            f"samples with them; got {wanted}; use {nearest} or {cure}, or leave it out"
        )

    def _report_of_half(self, half: int) -> Callable[[int, int], object] | None:
        """Return what reports the first or the second half of the work; None where nothing is to be reported."""
        report = self.report
        return None if report is None else lambda done, total: report(half * total + done, 2 * total)

    def bridged(self, bridges: Timed | None) -> AskedTogether:
        """Return the same with how short gaps were bridged, if any were."""
        return replace(self, sampling=replace(self.sampling, bridges=bridges))

    def as_before(self, elements: Sequence[Element], given: frozenset[str] = frozenset()) -> list[Element]:
        """Return elements as an earlier result found them, but for those of which something is given now."""
        if self.earlier is None:
            return list(elements)
        said = {name for name, kind in self.terms if kind is not None}
        return self.earlier.as_before(elements, frozenset(self.parameters) | said | given)

    @property
    def kinds_of_terms(self) -> dict[str, str]:
        """Kinds of the terms that were given one."""
        return {name: kind for name, kind in self.terms if isinstance(kind, str)}

    def units_of(self, elements: Sequence[Element]) -> dict[str, str]:
        """Return the units of everything by name."""
        return {**self.units, **{element.name: self.units.get(element.of, "") for element in elements}}


def identify_trials(trials: Trials, asked: AskedTogether, term_values: TermValues) -> MergedIdentification:
    """Identify what repeated trials of one mass share."""
    elements = []
    for coefficient, name in enumerate(COEFFICIENTS):
        default = "windowed" if name == "stiffness" else "auto"
        given = asked.parameters.get(name)
        value = kind_or_number(name, default if given is None else given)
        elements.append(Element(name, name, ((0, coefficient, 0, 1.0),), value))
    for place, (name, kind) in enumerate(asked.terms):
        elements.append(Element(name, name, ((0, None, place, 1.0),), kind_or_number(name, kind or "constant")))
    elements = [on_grid(one, asked.sampling) for one in asked.as_before(elements)]
    check_expansions(elements, trials.samples)
    if all(element.is_known for element in elements):
        raise ValueError("at least one parameter must be unknown; all are given; use 'windowed' or 'constant' for one")
    given = []
    for place, (angle, torque) in enumerate(zip(trials.angles, trials.torques, strict=True)):
        terms = np.stack([term_values(name, angle) for name, _ in asked.terms]) if asked.terms else None
        mask = None if trials.masks is None else trials.masks[place]
        position = None if trials.positions is None else np.ascontiguousarray(trials.positions[place])
        weights = None if trials.weights is None else trials.weights[place]
        given.append((angle[np.newaxis], torque[np.newaxis], terms, mask, position, weights))
    passed, noise = asked.sampling.passed, trials.noise
    if passed is not None:
        own = trials.weights or [None] * len(given)
        noise = [variance_in_trials(trials.angles, own, passed)], [variance_in_trials(trials.torques, own, passed)]
    merging = Merging(
        elements,
        [asked.part(Equations(elements, [0], given), trials.samples, noise, is_white=trials.noise is None)],
        sampling=asked.sampling,
        step=asked.step,
        samples=trials.samples,
        trials=len(given),
        masses=0,
        units=asked.units_of(elements),
        phase=trials.phase,
        recorded=MergedRecorded(
            [[one] for one in trials.angles],
            [[one] for one in trials.torques],
            [None] * len(given),
            trials.positions,
            own=asked.own,
        ),
        terms=[name for name, _ in asked.terms],
        kinds_of_terms=asked.kinds_of_terms,
    )
    return MergedIdentification(merging)
