"""Records, and what is to be done with them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._clocks import Passed, Timed
from tvident._equation import LINEAR_UNITS, UNITS
from tvident._identify.channels import MotionChannels
from tvident._identify.weighted import Weights
from tvident._units import ROTARY, Axis


@dataclass(frozen=True)
class Data:
    r"""Records, and what is to be done with them.

    Parameters
    ----------
    angles, torques : ndarray, shape (\\*, n)
    motion : MotionChannels
        What the angles were made of.
    instruments : ndarray, shape (\\*, n), optional
    time : ndarray, shape (n,)
    period : float
        Seconds from one sample to the next.
    mask : ndarray of bool, shape (\\*, n), optional
    propagate : bool
        Missing values make windows that hold one missing.
    step : int
        Every how many samples a result is wanted.
    workers : int, optional
    doubts : sequence of (int, str)
        What cannot be known of the channels, and of which record.
    said : sequence of str
        What was done to the channels of a single record.
    labels : Labels, optional
        What the angle came with: an index, coordinates.
    axis : Axis, optional
        What the channels were measured in.
    clipped : sequence of float, optional
        The part of the torque's samples of every record whose residual counts linearly; None for least squares.
    clock : Timed, optional
        How the channels were brought onto a uniform grid; None where their times are uniform.
    passed : (Passed, Passed), optional
        What that makes of white noise of angle and torque.
    weights : Weights, optional
        Those of samples, where they were given.
    moved : sequence of callable
        Give by how much the torque changes with each independent error of the alignment of its clock, one standard error of each.
    wanted : (int, int), optional
        The first sample at which numbers are wanted and the one after the last; None for all.
    """

    angles: npt.NDArray[np.number]
    torques: npt.NDArray[np.number]
    motion: MotionChannels
    instruments: npt.NDArray[np.number] | None
    time: npt.NDArray[np.float64]
    period: float
    mask: npt.NDArray[np.bool_] | None
    propagate: bool
    step: int
    workers: int | None
    doubts: Sequence[tuple[int, str]] = ()
    said: Sequence[str] = ()
    labels: arguments.Labels | None = None
    axis: Axis = field(default_factory=Axis)
    clipped: Sequence[float] | None = None
    clock: Timed | None = None
    passed: tuple[Passed | None, Passed | None] = (None, None)
    weights: Weights | None = None
    moved: Sequence[Callable[[], npt.NDArray[np.float64]]] = ()
    wanted: tuple[int, int] | None = None

    @property
    def batch(self) -> tuple[int, ...]:
        """Shape of the batch; empty for a single record."""
        return self.angles.shape[:-1]

    @property
    def masks(self) -> list[npt.NDArray[np.bool_]] | None:
        """The mask of every record, or None without one."""
        if self.mask is None:
            return None
        return [np.ascontiguousarray(one) for one in self.mask.reshape(-1, self.time.size)]

    def weights_of_core(self, *, strong: bool) -> npt.NDArray[np.float64] | None:
        """Return the weights as the core asks for them."""
        return None if self.weights is None else self.weights.of_core(strong=strong, propagate=self.propagate)

    @property
    def records(self) -> int:
        """How many records there are."""
        return math.prod(self.batch)

    @property
    def is_plain(self) -> bool:
        """Whether a record has nothing beside an angle and a torque, of which any stretch can be taken."""
        return not (self.motion.recorded or self.batch or self.weights or self.clock) and self.instruments is None

    @property
    def beside(self) -> list[npt.NDArray[Any]]:
        """What has a value for every sample beside angle and torque."""
        weights = None if self.weights is None else self.weights.given
        each = (*self.motion.recorded.values(), self.instruments, self.mask, weights)
        return [one for one in each if one is not None]

    def of(self, place: Any) -> Data:
        """Return some of several records, as NumPy's indexing takes them."""
        return replace(
            self,
            angles=self.angles[place],
            torques=self.torques[place],
            motion=self.motion.part(place, self.batch),
            instruments=None if self.instruments is None else self.instruments[place],
            mask=None if self.mask is None else self.mask[place],
            weights=None if self.weights is None else self.weights.part(place),
            doubts=(),
            labels=None,
        )

    def stretch(self, some: slice) -> Data:
        """Return a stretch of a plain record."""
        return replace(
            self,
            angles=self.angles[..., some],
            torques=self.torques[..., some],
            time=self.time[some],
            mask=None if self.mask is None else self.mask[..., some],
            step=1,
            labels=None,
            doubts=(),
            moved=(),
        )

    @property
    def settings(self) -> dict[str, Any]:
        """What settings keep of records and their times."""
        channels = {"instrument": self.instruments is not None, "weights": self.weights is not None}
        own = {} if self.clock is None else self.clock.settings
        return {**channels, "sample_rate": 1 / self.period, "step": self.step, **own}

    def measured(self, *, on_grid: bool) -> dict[str, Any]:
        """Return what was measured of the motion, and what is known of the channels' noise, as the core asks for it.

        Parameters
        ----------
        on_grid : bool
            Whether what a grid makes of noise is asked for: windows of polynomials whose length is given see the noise themselves.
        """
        channels = [self.motion.recorded.get(name) for name in ("angle", "velocity", "acceleration")]
        passed = [one.noise if one is not None and on_grid else None for one in self.passed]
        return {"channels": channels, "noise": self.motion.noise, "passed": tuple(passed)}

    @property
    def units(self) -> Mapping[str, str]:
        """Units of results."""
        return UNITS if self.axis.system is ROTARY else LINEAR_UNITS


def cut(value: Any, some: Any) -> Any:
    """Return some of a known parameter, which may be one number."""
    return value if isinstance(value, float) else value[..., some]
