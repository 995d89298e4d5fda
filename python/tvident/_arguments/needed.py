"""What a call without something that it needs is answered: what that is, what there was, and how it is called."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from inspect import signature
from typing import Any, TypeVar

from tvident._arguments.shown import listed

_Called = TypeVar("_Called", bound=Callable[..., Any])


def called_as(example: str) -> Callable[[_Called], _Called]:
    """Return what lets a function, or what makes an object of a class, answer a call that lacks something.

    Parameters
    ----------
    example : str
        A call that is right.
    """

    def decorated(called: _Called) -> _Called:
        if isinstance(called, type):
            called.__init__ = _answering(called.__init__, called.__name__, example)  # type: ignore[misc] # it takes what it took
            return called
        return _answering(called, called.__name__, example)

    return decorated


def _answering(function: _Called, name: str, example: str) -> _Called:
    declared = signature(function).parameters
    parameters = [one for one in declared.values() if one.name != "self"]
    by_place = [one.name for one in parameters if one.kind in {one.POSITIONAL_ONLY, one.POSITIONAL_OR_KEYWORD}]
    needed = [
        one.name
        for one in parameters
        if one.default is one.empty and one.kind not in {one.VAR_POSITIONAL, one.VAR_KEYWORD}
    ]
    # What has no place is given by name alone.
    places = {one: by_place.index(one) if one in by_place else len(by_place) for one in needed}
    of_class = int("self" in declared)

    @wraps(function)
    def call(*args: Any, **options: Any) -> Any:
        count = len(args) - of_class
        lacking = [one for one in needed if places[one] >= count and one not in options]
        if lacking:
            given = [one for one in needed if one not in lacking]
            got = f"{listed(given)} alone" if given else "none"
            raise TypeError(f"{name} needs {listed(lacking)}; got {got}; write {example}, say")
        return function(*args, **options)

    return call  # type: ignore[return-value] # takes what the function takes
