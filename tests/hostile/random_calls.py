"""Random calls of the whole package: each gives a result that holds together, or one message that says what was wrong."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import tvident
from hostile import of_derivatives, of_identification, of_regression, of_simulation

Call = Callable[[np.random.Generator], None]

CALLS: tuple[Call, ...] = (
    of_derivatives.fit,
    of_derivatives.savitzky_golay,
    of_regression.rolling,
    of_identification.identified,
    of_identification.identified,
    of_identification.identified,
    of_simulation.simulated,
)

_PACKAGE = str(Path(tvident.__file__).parent)

_MESSAGE = 1000
"""Characters; no message needs more."""


def case(seed: int) -> None:
    """Make one call, with NumPy's errors as they are by default or all raised, and every warning an error."""
    generator = np.random.default_rng(seed)
    call = CALLS[int(generator.integers(len(CALLS)))]
    state: dict[str, Any] = {"all": "raise"} if generator.random() < 0.3 else {}
    with warnings.catch_warnings(), np.errstate(**state):
        warnings.simplefilter("error")
        try:
            call(generator)
        except (ValueError, TypeError) as refused:
            check_message(refused)


def check_message(refused: Exception) -> None:
    """Check that a message is the package's own: the rule, the value, the cure, in a few lines."""
    frame = refused.__traceback__
    while frame is not None and frame.tb_next is not None:
        frame = frame.tb_next
    place = "" if frame is None else frame.tb_frame.f_code.co_filename
    if not place.startswith(_PACKAGE):
        # Whatever did not begin here is no message of ours.
        raise AssertionError(f"{type(refused).__name__} of {place}: {refused}") from refused
    message = str(refused)
    assert len(message) < _MESSAGE, f"a message of {len(message)} characters"
    assert message.isprintable(), f"a message of more than one line: {message!r}"
    assert ";" in message, f"a message without a cure: {message}"
