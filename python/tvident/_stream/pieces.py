"""Pieces of a recording, one sample or many, and what all streams have that take them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Generic, TypeGuard, TypeVar

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._choices import VERSION

_FLOAT64 = np.dtype(np.float64)

_MADE_BY = "version"
"""What a state says beside its own: what another version keeps may mean something else."""

Out = TypeVar("Out")


class Stream(Generic[Out]):
    """A recording that goes on: it ends once, and pickles with what it still needs."""

    _stream: Any
    _ended = False

    def _begun(self, state: Any) -> Any:
        """Return the work that begins, or goes on from a state; None before it is known what to do."""
        raise NotImplementedError

    def _given(self, found: Any) -> Out:
        """Return what was found, with names."""
        raise NotImplementedError

    def finish(self) -> Out:
        """End the stream, and give what is left: the status says EDGE, as at the end of a record.

        Raises
        ------
        ValueError
            If the stream has ended before, or nothing has come that could end.

        See Also
        --------
        push : takes samples.
        delay : how late numbers are.
        """
        self._check_open()
        self._check_end()
        self._ended = True
        return self._given(self._stream.finish())

    def _check_open(self) -> None:
        """Check that the stream goes on."""
        if self._ended:
            raise ValueError("a stream takes no samples after its end; got some after finish(); make another stream")

    def _check_end(self) -> None:
        """Check that there is something to end."""

    def __getstate__(self) -> dict[str, Any]:
        stream = None if self._stream is None else self._stream.state()
        return {**self.__dict__, "_stream": stream, _MADE_BY: VERSION}

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        made_by, here = state.get(_MADE_BY), VERSION
        if made_by != here:
            raise ValueError(
                f"a stream goes on in the version that it was kept by; got one of tvident {made_by} in {here}; begin another, or install "
                f"tvident=={made_by}"
            )
        self.__dict__.update({name: value for name, value in state.items() if name != _MADE_BY})
        self._stream = self._begun(state["_stream"])

    def _progress(self) -> str:
        """Return in a word whether the stream goes on, and how late its numbers are."""
        return "ended" if self._ended else f"delay {self.delay}"

    @property
    def delay(self) -> int:
        """Samples, or rows, from one to its numbers.

        See Also
        --------
        push : gives numbers that late.
        finish : gives the rest.
        """
        return int(self._stream.delay)


class SampleStream(Stream[Out]):
    """Samples with times: the number of one is its time."""

    _period: float
    _start: float
    _step: int
    _policy: str

    @property
    def samples(self) -> int:
        """Samples that have come so far: an int.

        See Also
        --------
        delay : how far behind results are.
        """
        return int(self._stream.samples)

    def _piece(
        self, name: str, values: npt.ArrayLike, counted: npt.NDArray[np.bool_] | None = None
    ) -> npt.NDArray[Any]:
        """Return the next samples of a channel, of which only some may count.

        Raises
        ------
        ValueError
            If one is no number, and the policy says that this must not be.
        """
        samples = piece(name, values)
        if self._policy != "raise" or samples.dtype.kind != "f":
            return samples
        missing = ~np.isfinite(samples) if counted is None else ~np.isfinite(samples) & counted
        if missing.any():
            place = int(np.flatnonzero(missing)[0])
            raise ValueError(
                f"{name} must hold finite numbers where nan_policy='raise'; sample {self.samples + place} is {samples[place]}; "
                "repair it or use nan_policy='propagate'"
            )
        return samples

    def _times(self, first: int, count: int) -> npt.NDArray[np.float64]:
        """Return the times of some samples, every so many of them."""
        return times(first, count, self._step, self._period, self._start)


def not_weighted_alike(what: str, *, have: bool) -> ValueError:
    """Return what is wrong with samples or rows of a stream of which only some have weights: the last have, or have none."""
    now, before = ("with", "without") if have else ("without", "with")
    return ValueError(
        f"{what} of a stream must all have weights, or none of them; got some {now} after others {before}; give weights of 1 where all "
        f"{what} count the same"
    )


def times(first: int, count: int, step: int, period: float, start: float) -> npt.NDArray[np.float64]:
    """Return the times of some samples, every so many of them."""
    # Numbers of samples are exact as floats, which NumPy multiplies in a third of the time that whole numbers take.
    numbers = np.arange(float(first), float(first + count * step), float(step))
    return numbers * period if start == 0 else numbers * period + start


def is_plain(values: npt.ArrayLike) -> TypeGuard[npt.NDArray[np.float64]]:
    """Return whether a piece is an array of floats along one axis, and nothing more."""
    return type(values) is np.ndarray and values.ndim == 1 and values.dtype == _FLOAT64


def piece(name: str, values: npt.ArrayLike) -> npt.NDArray[Any]:
    """Return a piece of a record as an array with one axis; a single number is a piece of one sample."""
    # What comes a thousand times a second goes the short way.
    if type(values) is float:
        return np.array((values,))
    if is_plain(values):
        return values
    array = arguments.any_array(name, values)
    if array.ndim > 1:
        raise ValueError(
            f"{name} must be one sample or several along one axis; got shape {array.shape}; make a stream for every record"
        )
    return np.atleast_1d(array)


def span_of(places: npt.NDArray[Any], many: str, one: str) -> str:
    """Return how many samples or rows a piece has, and which, in words."""
    where = f", {one} {places[0]:g} to {places[-1]:g}" if places.size else ""
    return f"{places.size} {many}{where}"
