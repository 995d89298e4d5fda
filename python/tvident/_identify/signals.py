"""What was recorded, as it was sampled or brought onto a uniform grid."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._clocks import Bridged, Grid, Passed, Timed, bridged, clock_of, in_no_gap, unheld
from tvident._derivatives import quantisation_step
from tvident._equation import has_kind
from tvident._expansion import Expansion, with_channels
from tvident._identify.settings import Request
from tvident._identify.weighted import Weights

_Channels = Mapping[str, npt.NDArray[np.number]]


@dataclass(frozen=True)
class Signals:
    r"""Channels of records and their times.

    Parameters
    ----------
    channels : mapping of str to ndarray, shape (\\*, n)
        Those of the motion.
    torques : ndarray, shape (\\*, n)
    instruments : ndarray, shape (\\*, n), optional
    mask : ndarray of bool, shape (\\*, n), optional
    time : ndarray, shape (n,)
        Seconds.
    period : float
        Seconds from one sample to the next.
    weights : Weights, optional
        Those of samples, where they were given.
    clock : Timed, optional
        How they were brought onto a grid, or their gaps bridged; None where neither was.
    passed : mapping of str to Passed
        What that made of white noise, by channel.
    doubts : sequence of (int, str)
        What is wrong with the times, of every record.
    """

    channels: _Channels
    torques: npt.NDArray[np.number]
    instruments: npt.NDArray[np.number] | None
    mask: npt.NDArray[np.bool_] | None
    time: npt.NDArray[np.float64]
    period: float
    weights: Weights | None = None
    clock: Timed | None = None
    passed: Mapping[str, Passed] = field(default_factory=dict)
    doubts: Sequence[tuple[int, str]] = ()

    def on_grid(
        self,
        grid: Grid,
        request: Request,
        earlier: Mapping[str, Any] | None,
        *,
        propagate: bool,
        workers: int | None,
    ) -> tuple[Signals, Request]:
        """Return the same on a grid, and the request with what is known at every sample there."""
        recorded = self._recorded
        request = with_own_step(request, self.channels)
        clock = clock_of(grid, recorded, request.quantisation, workers, earlier)
        evened = clock.evened(recorded, propagate=propagate, workers=workers)
        records = int(np.prod(self.torques.shape[:-1], dtype=int))
        signals = Signals(
            {name: evened.channels[name] for name in self.channels},
            evened.channels["torque"],
            evened.channels.get("instrument"),
            evened.mask(self.mask),
            evened.time,
            clock.period,
            self.weights and Weights(evened.weights(self.weights.given, propagate=propagate)),
            clock,
            {} if evened.passed is None else dict.fromkeys(recorded, evened.passed),
            [(record, clock.doubt) for record in range(records) if clock.doubt],
        )

        def channel(values: Any) -> Any:
            found = evened.known(values)
            wanted = np.arange(evened.time.size, dtype=np.float64)
            return found if found is values else np.where(in_no_gap(evened.places, wanted, grid.longest), found, np.nan)

        return signals, with_known(request, evened.known, channel)

    def over_holds(
        self, request: Request, earlier: Mapping[str, Any] | None, *, workers: int | None
    ) -> tuple[Signals, Request]:
        """Return the same with splines between what was read, and the request with what cannot be found any more."""
        if self.channels.keys() != {"angle"}:
            return self, request
        of_torque = (earlier or {}).get("torque_readings") is True
        return self._over(unheld(self._recorded, self.period, workers, of_torque=of_torque), request)

    def over_gaps(
        self, request: Request, earlier: Mapping[str, Any] | None, *, workers: int | None
    ) -> tuple[Signals, Request]:
        """Return the same with short gaps bridged, and the request with what cannot be found any more."""
        return self._over(bridged(self._recorded, earlier, workers), request)

    def _over(self, found: Bridged | None, request: Request) -> tuple[Signals, Request]:
        """Return the same with gaps that were bridged, if any were."""
        if found is None:
            return self, request
        request = with_own_step(request, self.channels)
        records = int(np.prod(self.torques.shape[:-1], dtype=int))
        signals = replace(
            self,
            channels={name: found.channels[name] for name in self.channels},
            torques=found.channels["torque"],
            instruments=found.channels.get("instrument"),
            clock=found.after(self.clock),
            passed={**self.passed, **found.passed},
            doubts=[*self.doubts, *((record, doubt) for record in range(records) for doubt in found.doubts)],
        )
        return signals, request

    @property
    def _recorded(self) -> dict[str, npt.NDArray[np.number]]:
        """Everything that was recorded, by name."""
        own = {} if self.instruments is None else {"instrument": self.instruments}
        return {**self.channels, "torque": self.torques, **own}


def with_known(request: Request, change: Callable[[Any], Any], of_channel: Callable[[Any], Any]) -> Request:
    """Return a request whose parameters that are known at every sample are changed, and in their own way channels of expansions."""

    def changed(one: Any) -> Any:
        return with_channels(one, of_channel) if isinstance(one, Expansion) else change(one)

    parameters = {name: changed(one) for name, one in request.parameters.items()}
    terms: Any = request.terms
    if isinstance(terms, tuple | list):
        terms = type(terms)((term[0], changed(term[1])) if has_kind(term) else term for term in terms)
    return replace(request, parameters=parameters, terms=terms)


def with_own_step(request: Request, channels: _Channels) -> Request:
    """Return a request that knows the step to which the angle was rounded, before it cannot be found any more."""
    if "angle" not in channels:
        return request
    return replace(request, quantisation=quantisation_step(channels["angle"], request.quantisation))


def channels_of_motion(motion: Mapping[str, npt.ArrayLike | None]) -> dict[str, npt.ArrayLike]:
    """Return what was measured of a motion, of which there must be something."""
    measured = {name: values for name, values in motion.items() if values is not None}
    if not measured:
        raise ValueError(
            "identify needs a motion; got angle=None; give velocity= or acceleration= where there is no angle"
        )
    return measured


def instrument_of(instrument: npt.ArrayLike | None, shape: tuple[int, ...]) -> npt.NDArray[np.number] | None:
    """Return an instrument of the torque's shape, where there is one."""
    if instrument is None:
        return None
    found = arguments.channel("instrument", instrument)
    if found.shape != shape:
        raise ValueError(f"an instrument must have the angle's shape {shape}; got {found.shape}; resample it")
    return found


def even_times(samples: int, seconds: float, begin: float) -> npt.NDArray[np.float64]:
    """Return the times of samples, in the memory of one array: records may be hours long."""
    times = np.arange(samples, dtype=np.float64)
    times *= seconds
    times += begin
    return times
