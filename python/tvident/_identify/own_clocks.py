"""A call whose angle and torque have clocks of their own, or whose clocks are to be aligned."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._clocks import Grid, Passed, TwoClocks, in_no_gap, two_clocks, weights_on_grid
from tvident._identify.aligned import Align, Aligned, Late, aligned
from tvident._identify.data import Data
from tvident._identify.weighted import Weights, weights_of
from tvident._units import ROTARY, factor_to, scaled

_LOOKED_AT = 1 << 10
"""Samples at the beginning in which a channel that was recorded more slowly shows it."""

_FEWEST = 16
"""Samples that are no chance if they are evenly spread."""


@dataclass(frozen=True)
class ClockAlignment:
    """What settings and words say of two clocks.

    Parameters
    ----------
    clocks : TwoClocks
    late : (float, float)
        By how many seconds stamps of the torque are late at the start, and by how many more each second.
    """

    clocks: TwoClocks
    late: Late

    @property
    def settings(self) -> dict[str, Any]:
        """What settings keep."""
        return {"times": "own", "clock_offset": self.late[0], "clock_drift": self.late[1]}

    @property
    def words(self) -> str:
        """What was done."""
        offset, drift = self.late
        late = f"; stamps of the torque were taken to be {offset:.6g} s late" if offset or drift else ""
        return self.clocks.words + late + (f", and {drift:.3g} s more each second" if drift else "")


@dataclass(frozen=True)
class OwnClocks:
    """Angle and torque as they were recorded, and their clocks.

    Parameters
    ----------
    clocks : TwoClocks
    recorded : (ndarray, ndarray)
    align : {"offset", "drift"}, float or None
    propagate : bool
    """

    clocks: TwoClocks
    recorded: tuple[npt.NDArray[np.number], npt.NDArray[np.number]]
    align: Align
    propagate: bool

    def channels(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Return angle and torque on the grid, by their stamps."""
        return self._angle()[0], self._torque((0.0, 0.0))[0]

    def weighted(self, given: Any, earlier: Mapping[str, Any] | None, policy: str) -> tuple[OwnClocks, Weights | None]:
        """Return the same without samples that have no weight, and the weights on the grid.

        Parameters
        ----------
        given : array_like, optional
            Weights of the samples of the angle, or of the torque: of the noise of both channels at their times.
        earlier : mapping, optional
            Settings of an earlier result, whose alignment is taken where none is asked for.
        policy : str
            For missing values: it refuses those of the recording that have a weight.
        """
        weights, counted = None, [np.ones(one.shape, np.bool_) for one in self.recorded]
        if given is not None:
            if isinstance(given, tuple | list) and any(one is None or np.ndim(one) > 0 for one in given):
                raise ValueError(
                    "weights must be those of the samples of one channel, for the noise of both; got a pair, "
                    f"{arguments.shown(given)}; give one array"
                )
            of_torque = np.shape(given)[-1:] == self.recorded[1].shape != self.recorded[0].shape
            found = weights_of(given, self.recorded[of_torque].shape)
            assert found is not None  # noqa: S101 - they were given
            late = self._late_by(earlier)
            if late is None and (of_torque or not (found.given > 0).all()):
                got = "weights of the torque's samples" if of_torque else "some of zero"
                raise ValueError(
                    f"weights must be those of the angle's samples, and above zero, where its clock is to be aligned with the torque's; "
                    f"got {got} and align={self.align!r}; find the offset without them, and give it in seconds: align=0.01, say"
                )
            late = late or (0.0, 0.0)
            each = (self._places(self.clocks.angle, (0.0, 0.0)), self._places(self.clocks.torque, late))
            own = each[of_torque]
            # Samples of the other channel have the weight of the one that is nearest to them.
            nearest = [np.rint(np.interp(one, own, np.arange(own.size))).astype(np.intp) for one in each]
            counted = [found.given[one] > 0 for one in nearest]
            on_grid = weights_on_grid(own, found.given, self.clocks.samples, left_out=self.propagate)
            weights = Weights(on_grid)
        angle, torque = zip(self.recorded, counted, strict=True)
        for name, (recorded, counts) in (("angle", angle), ("torque", torque)):
            arguments.check_nan(name, np.where(counts, recorded, 0), policy, arguments.RowPolicy)
        if weights is None:
            return self, None
        return replace(self, recorded=(_without(*angle), _without(*torque))), weights

    def _places(self, own: Grid, late: Late) -> npt.NDArray[np.float64]:
        """Return where on the grid the samples of a clock lie, whose stamps are late."""
        return (self.clocks.true_times(own, late) - self.clocks.start) / self.clocks.period

    def known(self, values: Any, earlier: Mapping[str, Any] | None, *, over_gaps: bool = True) -> Any:
        """Return what is known at every sample of the angle, or of the torque, on the grid along straight lines; else as it is.

        Parameters
        ----------
        values : object
        earlier : mapping, optional
            Settings of an earlier result, whose alignment is taken where none is asked for.
        over_gaps : bool, optional
            Something is known where the clock lost samples, and where it does not reach.
        """
        clocks = zip((self.clocks.angle, self.clocks.torque), self.recorded, strict=True)
        own = next((clock for clock, recorded in clocks if np.shape(values)[-1:] == recorded.shape), None)
        if own is None:
            return values
        late = (0.0, 0.0) if own is self.clocks.angle else self._late_by(earlier)
        if late is None:
            raise ValueError(
                f"what is known at every sample of the torque needs times that are right; got align={self.align!r}; give it at the samples "
                "of the angle, or the offset in seconds: align=0.01, say"
            )
        places = own.places
        if any(late):
            places = (self.clocks.true_times(own, late) - own.start) / own.period
        wanted = (self.clocks.time - own.start) / own.period
        found = np.interp(wanted, places, np.asarray(values, dtype=np.float64))
        if over_gaps:
            return found
        is_inside = (wanted > places[0] - 0.5) & (wanted < places[-1] + 0.5)
        return np.where(is_inside & in_no_gap(places, wanted, own.longest), found, np.nan)

    def finished(
        self,
        data: Data,
        factor: float,
        earlier: Mapping[str, Any] | None,
        lag_of: Callable[[Data], tuple[float, float]],
    ) -> Data:
        """Return the record with a torque in its place.

        Parameters
        ----------
        data : Data
            With the torque by its stamps.
        factor : float
            From the torque's unit to that of results.
        earlier : mapping, optional
            Settings of an earlier result, whose alignment is taken where none is asked for.
        lag_of : callable
            Gives the lag that is left in a record, and its standard error.
        """
        passed = self._angle()[1]

        def data_of(late: Late) -> Data:
            torque, of_torque = self._torque(late)
            return replace(
                data, torques=scaled(torque, factor), time=self.clocks.time, passed=(passed, of_torque), labels=None
            )

        late = self._late_by(earlier)
        found = aligned(data_of, lag_of, str(self.align)) if late is None else Aligned(late, (0.0, 0.0))
        constants = {"clock_offset": ([found.late[0]], [found.errors[0]])}
        if self.align == "drift":
            constants["clock_drift"] = ([found.late[1]], [found.errors[1]])
        final = data_of(found.late)
        motion = final.motion
        if self.align is not None:
            motion = replace(motion, biases={**motion.biases, **constants})
        of_stamps = self.clocks.doubt
        if of_stamps and self.align is None:
            of_stamps += "; give align='offset', or times that are right"
        doubts = [*final.doubts, *((0, doubt) for doubt in (of_stamps, found.doubt) if doubt)]

        def change(move: Late) -> npt.NDArray[np.float64]:
            later = data_of((found.late[0] + move[0], found.late[1] + move[1]))
            return np.asarray(later.torques - final.torques, dtype=np.float64)

        moved = [partial(change, move) for move in found.moves]
        return replace(final, motion=motion, doubts=doubts, clock=ClockAlignment(self.clocks, found.late), moved=moved)

    def _late_by(self, earlier: Mapping[str, Any] | None) -> Late | None:
        """Return by how much stamps of the torque are late; None where that is to be found."""
        if isinstance(self.align, str):
            return None
        if self.align is not None:
            return float(self.align), 0.0
        if earlier is not None and earlier.get("times") == "own":
            return float(earlier["clock_offset"]), float(earlier["clock_drift"])
        return 0.0, 0.0

    def _angle(self) -> tuple[npt.NDArray[np.float64], Passed | None]:
        return self.clocks.on_grid(self.clocks.angle, self.recorded[0], propagate=self.propagate)

    def _torque(self, late: Late) -> tuple[npt.NDArray[np.float64], Passed | None]:
        return self.clocks.on_grid(self.clocks.torque, self.recorded[1], late, propagate=self.propagate)


def _without(recorded: npt.NDArray[np.number], counts: npt.NDArray[np.bool_]) -> npt.NDArray[np.number]:
    """Return a channel without the samples that do not count."""
    return recorded if counts.all() else np.where(counts, recorded, np.nan)


def _late(align: object) -> float:
    """Return by how many seconds stamps are late."""
    if not isinstance(align, str):
        return arguments.finite_number("align", align)
    try:
        return arguments.delay("align", align)
    except ValueError:
        raise ValueError(
            f"align must be 'offset' or 'drift', seconds, or a time such as '2 ms'; got {arguments.shown(align)}; use one of these"
        ) from None


def own_clocks(
    channels: Mapping[str, npt.ArrayLike | None],
    time: Mapping[str, Any],
    align: Align,
    *,
    time_unit: str | None,
    propagate: bool,
    by_angle: bool = False,
) -> OwnClocks | None:
    """Return the clocks of angle and torque where a call gives each its own, or asks for their alignment; None elsewhere.

    Parameters
    ----------
    channels : mapping of str to array_like
        Everything that was recorded, by the argument's name.
    time : mapping of str to object
        `sample_rate`, `delta` and `t` as they were given.
    align : {"offset", "drift"}, float or None
    time_unit : str, optional
    propagate : bool
    by_angle : bool, optional
        Derivatives are taken of the angle, so that both are brought onto its clock.
    """
    given = {name: value for name, value in time.items() if value is not None}
    pairs = {name: value for name, value in given.items() if _is_pair(name, value)}
    if not pairs and align is None:
        return None
    if align is not None and not (isinstance(align, str) and align in {"offset", "drift"}):
        align = _late(align)
    others = [name for name, values in channels.items() if values is not None and name not in {"angle", "torque"}]
    if others or channels["angle"] is None:
        raise ValueError(
            f"clocks are aligned for angle and torque alone; got {' and '.join(others) or 'angle=None'}; leave it out, or resample it"
        )
    if len(given) != 1:
        raise TypeError(
            f"angle and torque need their clocks; got {' and '.join(given) or 'none'}; give t=(times of the angle, times of the torque) or "
            "sample_rate=(that of the angle, that of the torque)"
        )
    (name, value), *_ = given.items()
    if channels["torque"] is None:
        raise TypeError("torque must hold numbers; got None; give an array of numbers")
    angle, torque = (arguments.channel(one, values) for one, values in channels.items() if values is not None)
    for one, array in (("angle", angle), ("torque", torque)):
        if array.ndim != 1:
            raise ValueError(
                f"clocks are aligned for a single record; got {one} of shape {array.shape}; give lists of records and of their clocks, "
                "sample_rate=[(1000, 250), (1000, 250)], say, or take one at a time"
            )
    of_angle, of_torque = value if name in pairs else (value, value)
    if name == "t" and name in pairs:
        angle, of_angle = _without_empty_rows(angle, of_angle)
        torque, of_torque = _without_empty_rows(torque, of_torque)
    if name == "delta":
        unit = factor_to(ROTARY, "time", time_unit, name="the time")
        periods = (arguments.in_unit_of_time(each, unit) for each in (of_angle, of_torque))
        of_angle, of_torque = (1 / arguments.positive_number("delta", each) for each in periods)
    clocks = two_clocks(of_angle, of_torque, (angle, torque), time_unit, by_angle=by_angle)
    return OwnClocks(clocks, (angle, torque), align, propagate)


def _without_empty_rows(samples: npt.NDArray[np.number], times: Any) -> tuple[npt.NDArray[np.number], Any]:
    """Return samples and their times without the rows of a faster channel, in which this one has none."""
    sparse = every_kth(samples)
    if sparse is None or np.shape(times) != samples.shape:
        return samples, times
    first, step = sparse
    return samples[first::step], times[first::step]


def every_kth(samples: npt.NDArray[np.number]) -> tuple[int, int] | None:
    """Return the first sample and every how many there is one, of a channel that was recorded more slowly than its rows; None of others."""
    if samples.dtype.kind != "f" or np.isfinite(samples[..., :_LOOKED_AT]).all():
        return None
    count = samples.shape[-1]
    places = np.flatnonzero(np.isfinite(samples).reshape(-1, count).any(axis=0))
    step = int(np.gcd.reduce(np.diff(places))) if places.size >= _FEWEST else 1
    return (int(places[0]), step) if step > 1 else None


def check_every_sample(
    channels: Mapping[str, npt.NDArray[np.number]], period: float, *, others: bool, in_parts: bool
) -> None:
    """Refuse a channel of which no two neighbouring samples are there: no equation could be made of it.

    Parameters
    ----------
    channels : mapping of str to ndarray
        By name, the torque among them.
    period : float
        Seconds.
    others : bool
        Whether the call gives something that clocks of their own do not go with.
    in_parts : bool
        Whether the record is longer than memory: its channels have one clock.
    """
    has_clocks = not others and all(samples.ndim == 1 for samples in channels.values())
    cure = (
        "give it times of its own: t=(t, t), which leaves out the rows between"
        if has_clocks and channels.keys() == {"angle", "torque"}
        else "resample it, or leave it out"
    )
    if in_parts:
        cure = "resample it, or identify a part of the recording in memory, where it can have times of its own"
    for name, samples in channels.items():
        sparse = every_kth(samples)
        if sparse is not None:
            step = sparse[1]
            raise ValueError(
                f"the {name} must have a value in neighbouring samples; it has one in every {step} only, as if recorded at "
                f"{1 / (period * step):.6g} Hz; {cure}"
            )


def _is_pair(name: str, value: Any) -> bool:
    """Return whether angle and torque have each its own: two rates, or two arrays of times."""
    if not isinstance(value, tuple | list) or len(value) != 2:  # noqa: PLR2004 - a pair
        return False
    return name != "t" or all(np.ndim(one) > 0 for one in value)


def lag_found(settings: Mapping[str, Any]) -> tuple[float, float]:
    """Return the lag that a result found, and its standard error."""
    error = settings.get("lag_stderr")
    return float(settings["lag"]), math.nan if error is None else float(error)
