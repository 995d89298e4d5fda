"""The weak form of a recording that goes on: blocks that are records of their own, with neighbours on both sides."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from tvident._identify import Held, Span
from tvident._pieces import (
    NOTHING_SAID,
    Columns,
    Gathered,
    Given,
    Note,
    finished,
    look_ahead,
    part_estimated,
    reach_of,
    with_neighbours,
)
from tvident._results import Estimates
from tvident._status import Status

Numbers = npt.NDArray[np.float64]

_DIAGNOSED = 5
"""Of so many blocks one is asked what may be missing in the equation, and whether test functions of all widths agree."""

_LEAST_REACH = 1024
"""Samples before a block that it is identified with, at least: with those of the block and after it they tell the noise of the channels.
A block that is asked what may be missing has as many as a piece of a file."""

_OF_DIAGNOSIS = Status.TERM_SUSPECTED | Status.LAG_SUSPECTED | Status.SCALES_DISAGREE


@dataclass(frozen=True)
class BlockParameters:
    """Parameters of some samples, as the core gives them in strong form.

    Parameters
    ----------
    first : int
        Number of the first sample.
    numbers : ndarray, shape (2 unknowns + 2, k)
        Values, errors, deviation of residuals and condition.
    order : ndarray of uint8, shape (k,)
    status : ndarray of uint16, shape (k,)
    """

    first: int
    numbers: Numbers
    order: npt.NDArray[np.uint8]
    status: npt.NDArray[np.uint16]


@dataclass
class State:
    """What a stream in weak form goes on from.

    Parameters
    ----------
    first : int
        Number of the first sample that is held.
    held : ndarray, shape (2, m) or (3, m)
        Angle and torque, and weights where samples have any.
    samples, done : int
        Samples that have come, and those whose parameters are known.
    given : int
        Results that were given.
    numbers : ndarray, shape (2 unknowns + 2, k)
        Values, errors, deviation of residuals and condition of results that are known and not given yet.
    order, status : ndarray, shape (k,)
        Likewise.
    gathered : Gathered
        What blocks so far say of constants.
    record_status : int
        Flags of the latest block, and of constants over all blocks.
    counted_from : int
        The first sample whose equations tell of constants: those before were forgotten or left out.
    asked_at : int, optional
        Number of the latest block that said what may be missing; None before there is one.
    """

    first: int
    held: Numbers
    samples: int
    done: int
    given: int
    numbers: Numbers
    order: npt.NDArray[np.uint8]
    status: npt.NDArray[np.uint16]
    gathered: Gathered = field(default_factory=Gathered)
    record_status: int = 0
    counted_from: int = 0
    asked_at: int | None = None


class WeakStream:
    """Angle and torque come in, and parameters go out a fixed number of samples later, in groups of a block.

    Blocks begin at multiples of their length, whatever the pieces: so pieces change no number.

    Parameters
    ----------
    given : Given
        Of the equation, with settings that leave nothing to be chosen, and whether samples have weights.
    names : sequence of str
        Unknowns.
    step : int
    half_life : float
        Samples after which equations of constants count half; infinite where none is forgotten.
    state : State, optional
    """

    def __init__(self, given: Given, names: Sequence[str], step: int, half_life: float, state: State | None) -> None:
        self._given, self._names, self._step, self._half_life = given, names, step, half_life
        self._channels = 3 if given.weighted else 2
        settings = given.settings or {}
        ahead = self._least = look_ahead(settings)
        self._near, self._reach = max(_LEAST_REACH, ahead), reach_of(settings)
        # Windows as long as those that predict best end within a third of what averaged ones reach, on either side of a sample.
        self._after = -(-ahead // 3)
        self._block = 2 * ahead - self._after
        self._hold = False
        self._state = state if state is not None else self._empty()
        self._begin, held = self._state.first, self._state.held
        # As much as a block and its neighbours, twice: so moving samples costs less than taking them in.
        self._buffer = np.empty((self._channels, 2 * (self._reach + self._step + self._block + self._after)))
        self._buffer[:, : held.shape[1]] = held

    def _empty(self) -> State:
        return State(
            0,
            np.empty((self._channels, 0)),
            0,
            0,
            0,
            np.empty((2 * len(self._names) + 2, 0)),
            np.empty(0, np.uint8),
            np.empty(0, np.uint16),
        )

    @property
    def delay(self) -> int:
        """Samples from one to its parameters."""
        return self._block + self._after - 1

    @property
    def samples(self) -> int:
        """Samples that have come so far."""
        return self._state.samples

    @property
    def record_status(self) -> Status:
        """Flags of the latest block as a record of its own, and of constants over all blocks."""
        return Status(self._state.record_status)

    def hold(self, hold: bool) -> None:  # noqa: FBT001 - as in strong form
        """Leave constants as they are, or not."""
        if self._hold and not hold:
            self._state.counted_from = self._state.samples
        self._hold = hold

    def reset(self) -> None:
        """Forget what blocks so far say of constants."""
        self._state.gathered = Gathered()
        self._state.counted_from = self._state.samples

    def state(self) -> State:
        """Return what going on needs."""
        first = max(self._begin, self._state.done - self._reach - self._step)
        held = self._buffer[:, first - self._begin : self._state.samples - self._begin].copy()
        return replace(self._state, first=first, held=held, gathered=replace(self._state.gathered))

    def push(
        self,
        angle: npt.NDArray[np.number],
        torque: npt.NDArray[np.number],
        weights: npt.NDArray[np.float64] | None = None,
    ) -> BlockParameters:
        """Take the next samples, and return the parameters that are due."""
        state, taken = self._state, 0
        found: list[Columns] = []
        while taken < angle.size:
            full = state.done + self._block + self._after
            count = min(angle.size - taken, full - state.samples)
            place = self._place(count)
            self._buffer[0, place : place + count] = angle[taken : taken + count]
            self._buffer[1, place : place + count] = torque[taken : taken + count]
            if weights is not None:
                self._buffer[2, place : place + count] = weights[taken : taken + count]
            state.samples, taken = state.samples + count, taken + count
            if state.samples == full:
                found.append(self._worked(state.done + self._block))
        self._keep(found)
        return self._due(max(0, state.samples - self.delay))

    def finish(self) -> BlockParameters:
        """Return the parameters of all samples that are left."""
        state = self._state
        if state.done < state.samples:
            self._keep([self._worked(state.samples)])
        return self._due(state.samples)

    def _place(self, count: int) -> int:
        """Return where the next samples go, after those that are no longer needed have made room."""
        place = self._state.samples - self._begin
        if place + count > self._buffer.shape[1]:
            # A block begins where a result is wanted.
            needed = max(self._state.done - self._reach - self._step, self._begin)
            left = self._state.samples - needed
            self._buffer[:, :left] = self._buffer[:, needed - self._begin : place].copy()
            self._begin, place = needed, left
        return place

    def _worked(self, end: int) -> Columns:
        """Return the columns of the samples up to one that are not done yet."""
        state, wanted = self._state, (self._state.done, end)
        block = state.done // self._block
        diagnose = state.asked_at is None or block - state.asked_at >= _DIAGNOSED
        span = with_neighbours(wanted, self._reach if diagnose else self._near, state.samples, self._step)
        try:
            found = self._estimated(span, wanted, diagnose=diagnose)
        except ValueError:
            # Samples in which test functions do not fit beside each other tell nothing.
            if state.samples >= self._least:
                raise
            state.done = end
            return self._nothing(len(range(0, end, self._step)))
        columns, note = part_estimated(found, span, wanted, self._step)
        columns["residual_std"] = columns["residual_std"] * self._root(span)
        if not self._hold and state.done >= state.counted_from:
            state.gathered.add(self._counted(note, span, wanted), 0.5 ** ((end - state.done) / self._half_life))
        means = dict.fromkeys(note["constants"], NOTHING_SAID) | state.gathered.means()
        flags = note["record_status"]
        if diagnose and not np.all(columns["status"] & Status.INVALID):
            state.asked_at = block
        else:
            # What a block did not ask, or could not answer in a gap, is as the last one that did had it: a hold of the torque, too.
            asked = state.record_status & (_OF_DIAGNOSIS | Status.CHANNEL_SUSPECTED)
            flags = flags & ~_OF_DIAGNOSIS | asked
        state.record_status = flags
        if not all(mean.agree for mean in means.values()):
            state.record_status |= Status.KIND_CONTRADICTED
        state.done = end
        return finished(columns, note, means)

    def _counted(self, note: Note, span: Span, wanted: Span) -> Note:
        """Return what a block says of constants without neighbours that do not count, or not any more."""
        first = max(self._state.counted_from, wanted[0] - min(self._half_life, wanted[0] - span[0]))
        if first <= span[0]:
            return note
        some = (-(-int(first) // self._step) * self._step, span[1])
        return part_estimated(self._estimated(some, wanted, diagnose=False), some, wanted, self._step)[1]

    def _estimated(self, span: Span, wanted: Span, *, diagnose: bool) -> Estimates:
        """Identify some of the samples that are held."""
        angle, torque, *weights = self._buffer[:, span[0] - self._begin : span[1] - self._begin]
        held, chosen = Held(angle, torque, [span], *weights), self._given.settings
        return self._given.estimated(held, chosen=chosen, step=self._step, wanted=wanted, diagnose=diagnose)

    def _root(self, span: Span) -> float:
        """Return what deviations of residuals are multiplied by: those of a sample of mean weight become those of weight one."""
        weights = self._buffer[2:, span[0] - self._begin : span[1] - self._begin]
        counted = weights[weights > 0]
        if not counted.size:
            return 1.0
        greatest = float(counted.max())
        return math.sqrt(greatest) * math.sqrt(float(np.mean(counted / greatest)))

    def _nothing(self, count: int) -> Columns:
        """Return columns without numbers."""
        names = [*self._names, *(f"{name}_stderr" for name in self._names), "residual_std"]
        columns: Columns = {name: np.full(count, np.nan) for name in names}
        status = np.full(count, Status.INVALID | Status.EDGE, np.uint16)
        return columns | {"condition": np.full(count, np.inf), "order": np.zeros(count, np.uint8), "status": status}

    def _keep(self, found: Sequence[Columns]) -> None:
        """Keep columns until they are due."""
        if not found:
            return
        state = self._state
        names = [*self._names, *(f"{name}_stderr" for name in self._names), "residual_std", "condition"]
        rows = [np.stack([columns[name] for name in names]) for columns in found]
        state.numbers = np.concatenate([state.numbers, *rows], axis=1)
        state.order = np.concatenate([state.order, *(columns["order"] for columns in found)])
        state.status = np.concatenate([state.status, *(columns["status"] for columns in found)])

    def _due(self, end: int) -> BlockParameters:
        """Return the results of samples before one that were not given yet."""
        state = self._state
        due = max(0, -(-end // self._step) - state.given)
        found = BlockParameters(state.given * self._step, state.numbers[:, :due], state.order[:due], state.status[:due])
        state.numbers, state.order, state.status = state.numbers[:, due:], state.order[due:], state.status[due:]
        state.given += due
        return found
