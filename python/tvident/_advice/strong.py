"""Reasons and advice of the strong form, in words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from math import gcd
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._arguments import listed
from tvident._equation import COEFFICIENTS
from tvident._results import Estimates, Words
from tvident._status import Status

_LOOKED_AT = 1 << 10
"""Samples that statuses are counted at, evenly spread: shares are known within some percent, and a long record costs no more."""

_FEW = 30
"""With fewer samples that have values, shares of flags mean nothing."""

_OFTEN = 0.1
"""A share of the samples from which on a flag is worth a sentence: the paper's advice about orders, as a tenth."""

_ALIKE = 0.9
"""A correlation of two parameters from which on their errors compensate each other."""

_LARGE = 0.02
"""A standard error over its parameter that asks for what is known."""

_HIGHEST_OF_ALL = 15

_COMMON_FACTOR = 1.2
"""Standard errors closer than this to those of independent equations are not mentioned."""

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class ExplainedStrong:
    r"""Records as they were identified in strong form.

    Parameters
    ----------
    found : Estimates
        Of all records.
    kinds : mapping of str to str
        The kind of every unknown.
    untested : list of str
        Unknowns that the record was to decide upon, which nothing does here.
    settings : mapping
        What was used.
    mask : ndarray of bool, shape (\*, n), optional
        Where a sample may be the centre of an equation.
    """

    found: Estimates
    kinds: Mapping[str, str]
    untested: list[str]
    settings: Mapping[str, Any]
    mask: npt.NDArray[np.bool_] | None = None

    @cached_property
    def status(self) -> npt.NDArray[np.uint16]:
        """Flags of every sample and those of its record together."""
        records = np.asarray(self.found.record_status, dtype=np.uint16)
        return self.found.status | records[..., np.newaxis] if records.any() else self.found.status

    @np.errstate(all="ignore")  # what has left the range of doubles is NaN, whatever NumPy is told to do about it
    def words(self) -> Words:
        """Return what there is to say."""
        if not self.status.size:
            return Words()
        if (self.status & Status.INVALID != 0).all():
            return Words((), tuple(self._nothing()))
        reasons = (*self._orders(), *self._kinds(), *self._errors(), self._scales())
        return Words(reasons, (*self._undetermined(), *self._told_apart(), *self._limits()))

    def _some(self, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return the samples that are looked at, of all records."""
        return np.asarray(np.broadcast_to(values, self.status.shape).reshape(-1)[self._places])

    @cached_property
    def _places(self) -> npt.NDArray[np.intp]:
        """Samples spread over what the mask leaves; where hardly one of them has an answer, samples that have one."""
        n, status = self.status.shape[-1], self.status.reshape(-1)
        if self.mask is None:
            every = max(1, status.size // _LOOKED_AT)
            while gcd(every, n) > 1:  # not the same sample of every record
                every += 1
            places = np.arange(0, status.size, every)
        else:
            places = _spread(np.flatnonzero(np.broadcast_to(self.mask, self.status.shape)))
        if np.count_nonzero(status[places] & Status.INVALID == 0) < _FEW:
            return _spread(np.flatnonzero(status & Status.INVALID == 0))
        return places

    @cached_property
    def _flags(self) -> npt.NDArray[np.uint16]:
        return self._some(self.status)

    def _share(self, flag: Status) -> float:
        return float(np.mean(self._flags & flag != 0))

    def _orders(self) -> list[str]:
        order = self._some(self.found.order)[self._flags & Status.INVALID == 0]
        if not order.size:
            return []
        low, middle, high = (round(float(one)) for one in np.percentile(order, [5, 50, 95]))
        how = {"window": "in every window", "pooled": "for neighbouring windows together", "average": "averaged"}
        return [
            (
                f"orders {low} to {high} (5 and 95 %; median {middle}) of up to {self.settings['max_order']}, "
                f"{how[self.settings['selection']]} by {self.settings['criterion']}"
            )
        ]

    def _kinds(self) -> list[str]:
        if not self.untested:
            return []
        return [f"{listed(self.untested)} constant: the strong form does not test it; WeakForm does"]

    def _errors(self) -> list[str]:
        factors = {name: float(np.median(factor)) for name, factor in self.found.factors.items()}
        large = [f"{factor:.1f} ({name})" for name, factor in factors.items() if factor > _COMMON_FACTOR]
        if not large:
            return []
        return [
            f"standard errors are {listed(large)} times those of independent equations, from the scatter between windows that share none"
        ]

    def _scales(self) -> str:
        return (
            f"whether slow and fast motion give the same numbers was not tested, since windows of {self.settings['window_length']} samples "
            "were given: result.scan() compares windows of other lengths"
        )

    def _nothing(self) -> list[str]:
        if self._is_missing():
            return ["no window holds enough equations: look for missing values, use shorter windows, or record longer"]
        return [
            (
                f"the record does not determine {listed(list(self.kinds))}: nothing moves, or a single frequency does not separate inertia "
                "from stiffness: check that angle and torque are the right channels and hold numbers, excite two or more frequencies, "
                "leave a term out, or give what is known"
            )
        ]

    def _is_missing(self) -> bool:
        """Return whether every window lacks samples that determines nothing."""
        return not _lacks_motion(self.status).any()

    def _undetermined(self) -> list[str]:
        share = float(np.mean(_lacks_motion(self._flags)))
        if share < _OFTEN / 2:
            return []
        return [
            (
                f"{share:.0%} of the windows do not determine {listed(list(self.kinds))}: nothing moves there, or two "
                "terms are collinear as long as the motion keeps its direction: use a longer regression_window, take terms as constant, or "
                "exclude such parts with mask="
            )
        ]

    def _told_apart(self) -> list[str]:
        flags = self._flags
        good = flags & Status.INVALID == 0
        ill = good & (flags & Status.ILL_CONDITIONED != 0)
        share = float(np.mean(ill))
        if share >= _OFTEN:
            names = self._alike(ill)
            told = listed(names) if names else "the parameters"
            condition = float(np.median(self._some(self.found.condition)[ill]))
            # What is flagged may be constants, whose condition number is not that of the windows.
            number = f" (condition {condition:.3g}, the median there)" if condition > _core.HARDLY_TOLD_APART else ""
            return [
                (
                    f"{told} are nearly collinear in {share:.0%} of the record{number}: a single frequency does not separate them; "
                    "excite two or more, use a longer regression_window, or give one of them as known"
                )
            ]
        names = [name for name in self._alike(good) if self.kinds[name] == "windowed"]
        wide = {name: self._relative(name, good) for name in names}
        if "inertia" not in wide or not all(np.isfinite(error) and error >= _LARGE for error in wide.values()):
            return []
        return [
            (
                f"errors of {listed(list(wide))} compensate each other (nearly collinear): standard errors of "
                f"{listed([f'{error:.1%}' for error in wide.values()])}; give inertia='constant', or its value, unless it changes"
            )
        ]

    def _relative(self, name: str, where: npt.NDArray[np.bool_]) -> float:
        value, error = (self._some(np.asarray(one[name]))[where] for one in (self.found.values, self.found.errors))
        factor = float(np.median(self.found.factors[name])) if name in self.found.factors else 1.0
        middle = abs(float(np.median(value)))
        return factor * float(np.median(error)) / middle if middle > 0 else np.inf

    def _alike(self, where: npt.NDArray[np.bool_]) -> list[str]:
        """Return the two parameters whose errors are correlated most, if that is nearly completely."""
        unknown = [name for name in COEFFICIENTS if name in self.kinds]
        found: dict[tuple[str, str], float] = {}
        for one, other in combinations(unknown, 2):
            errors = self._some(np.asarray(self.found.errors[one])) * self._some(np.asarray(self.found.errors[other]))
            with np.errstate(invalid="ignore", divide="ignore"):
                correlation = self._some(self.found.covariances[frozenset((one, other))]) / errors
            correlation = np.abs(correlation[where])
            if np.isfinite(correlation).any():
                found[one, other] = float(np.nanmedian(correlation))
        best = max(found, key=lambda pair: found[pair], default=None)
        return list(best) if best is not None and found[best] > _ALIKE else []

    def _limits(self) -> list[str]:
        words = []
        highest, lowest = self._share(Status.HIGHEST_ORDER), self._share(Status.LOWEST_ORDER)
        length, most = self.settings["window_length"], self.settings["max_order"]
        if highest >= _OFTEN:
            reached = int(self._some(self.found.order).max())
            if reached < most:
                cure = f"orders above {reached} need more samples: use a longer window_length"
            elif most < _HIGHEST_OF_ALL:
                cure = f"raise max_order= above {most}, or use a shorter window_length"
            else:
                cure = "use a shorter window_length until that is rare"
            words.append(
                f"in {highest:.0%} of the windows of {length} samples the highest order was best, so the angle may change more than it can "
                f"follow: {cure}"
            )
        if lowest >= _OFTEN:
            words.append(
                f"in {lowest:.0%} of the windows of {length} samples order 0 was best: the angle is at rest there, which says nothing "
                "about the parameters (exclude it with mask=), or hardly changes: use a longer window_length"
            )
        exact = self._share(Status.EXACT)
        if exact >= _OFTEN:
            words.append(
                f"in {exact:.0%} of the windows the residual is rounding only: the angle is at rest, was simulated, or was filtered and "
                "resampled; orders mean little there"
            )
        return words


def _lacks_motion(status: npt.NDArray[np.uint16]) -> npt.NDArray[np.bool_]:
    """Return which windows lack rank though they have their samples: missing samples, or a mask, would be the reason."""
    return np.asarray(status & (Status.RANK_DEFICIENT | Status.GAP) == Status.RANK_DEFICIENT)


def _spread(places: npt.NDArray[np.intp]) -> npt.NDArray[np.intp]:
    """Return about as many places as are looked at."""
    return places[:: max(1, places.size // _LOOKED_AT)]
