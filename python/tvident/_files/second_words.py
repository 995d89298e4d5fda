"""What seconds and their parts are called in columns of clocks, and how many parts a second has."""

from __future__ import annotations

import re

PER_SECOND = {"millisecond": 1e3, "microsecond": 1e6, "nanosecond": 1e9}
"""How many there are in a second."""

_SECOND = r"s(?:ecs?|econds?|econde[ns]?|econd[io]|ek|ekund(?:e[nr]?|y)?|egundos?)?"

SECOND = re.compile(rf"ss|{_SECOND}", re.IGNORECASE)

PARTS = {
    "millisecond": re.compile(rf"f{{3}}|zzz|millis|(?:m|mill?i[_ ]?){_SECOND}", re.IGNORECASE),
    "microsecond": re.compile(rf"f{{6}}|micros|(?:[uµμ]|mi[ck]ro[_ ]?){_SECOND}", re.IGNORECASE),
    "nanosecond": re.compile(rf"f{{9}}|nanos|(?:n|nano[_ ]?){_SECOND}", re.IGNORECASE),
}
"""How parts of a second are called, also as formats of times write them (``fff``, ``zzz``)."""

_BEFORE = re.compile(r"(?:t|ts|time|stamp|time_?stamp|clock|date|utc|gps|local|sys|system|rtc)[_ ](?=.)", re.IGNORECASE)


def without_clock(name: str) -> str:
    """Return a name without what says that it is of a clock: ``time_ms`` is ``ms``."""
    return _BEFORE.sub("", name)
