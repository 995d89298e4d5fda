"""Units that recordings of mechanical systems are written in: their factors and dimensions."""

from __future__ import annotations

import math

Dimension = tuple[int, ...]
"""Powers of kg, m, s, rad, V, A, K and counts."""

NONE: Dimension = (0,) * 8

_MASS, _LENGTH, _TIME, _ANGLE, _VOLT, _AMPERE, _KELVIN, _COUNT = (
    tuple(int(place == base) for place in range(8)) for base in range(8)
)
_FORCE, _TORQUE, _POWER = (1, 1, -2, *NONE[3:]), (1, 2, -2, *NONE[3:]), (1, 2, -3, *NONE[3:])
_PRESSURE, _RATE = (1, -1, -2, *NONE[3:]), (0, 0, -1, *NONE[3:])

GRAVITY = 9.80665
"""Standard gravity, m/s²: what makes a weight of a mass."""

_POUND, _INCH = 0.45359237, 0.0254

_SAME_IN_CAPITALS = (
    *("deg", "degs", "mdeg", "degree", "degrees", "rad", "rads", "radian", "radians", "mrad"),
    *("rev", "revs", "mrev", "revolution", "revolutions", "rpm", "count", "counts", "cts"),
    *("um", "kg", "hz", "khz", "sek", "sekunden", "pound", "pounds", "millimeter", "millimeters"),
    *(
        "sec",
        "secs",
        "second",
        "seconds",
        "ms",
        "msec",
        "msecs",
        "millisecond",
        "milliseconds",
        "usec",
        "minutes",
        "hours",
    ),
    *("mm", "inch", "inches", "ft", "feet", "meter", "meters", "metre", "metres"),
    *("newton", "newtons", "lbs", "lbf", "ozf", "kgf"),
)
"""Words that mean the same in capitals, which some programs write."""

_PREFIXES = {"n": 1e-9, "u": 1e-6, "m": 1e-3, "c": 1e-2, "d": 1e-1, "k": 1e3, "M": 1e6}

_WITH_PREFIX: dict[str, tuple[float, Dimension]] = {
    "rad": (1.0, _ANGLE),
    "m": (1.0, _LENGTH),
    "s": (1.0, _TIME),
    "sec": (1.0, _TIME),
    "g": (1e-3, _MASS),
    "N": (1.0, _FORCE),
    "Pa": (1.0, _PRESSURE),
    "J": (1.0, _TORQUE),
    "W": (1.0, _POWER),
    "Hz": (1.0, _RATE),
    "V": (1.0, _VOLT),
    "A": (1.0, _AMPERE),
}

_ALONE: dict[tuple[str, ...], tuple[float, Dimension]] = {
    ("radian", "radians", "rads"): (1.0, _ANGLE),
    ("milliradian", "milliradians"): (1e-3, _ANGLE),
    ("deg", "degs", "degree", "degrees", "°"): (math.pi / 180, _ANGLE),
    ("mdeg", "millidegree", "millidegrees"): (math.pi / 180_000, _ANGLE),
    ("Nms",): (1.0, (1, 2, -1, *NONE[3:])),
    ("gon",): (math.pi / 200, _ANGLE),
    ("arcmin",): (math.pi / 10_800, _ANGLE),
    ("arcsec",): (math.pi / 648_000, _ANGLE),
    ("rev", "revs", "revolution", "revolutions", "turn", "turns"): (2 * math.pi, _ANGLE),
    ("mrev",): (2e-3 * math.pi, _ANGLE),
    ("rpm",): (math.pi / 30, (0, 0, -1, 1, *NONE[4:])),
    ("meter", "meters", "metre", "metres"): (1.0, _LENGTH),
    ("centimeter", "centimeters", "centimetre", "centimetres"): (1e-2, _LENGTH),
    ("millimeter", "millimeters", "millimetre", "millimetres"): (1e-3, _LENGTH),
    ("in", "inch", "inches"): (_INCH, _LENGTH),
    ("ft", "foot", "feet"): (12 * _INCH, _LENGTH),
    ("second", "seconds", "secs", "sek", "Sek", "Sekunde", "Sekunden"): (1.0, _TIME),
    ("millisecond", "milliseconds", "msecs"): (1e-3, _TIME),
    ("microsecond", "microseconds"): (1e-6, _TIME),
    ("nanosecond", "nanoseconds"): (1e-9, _TIME),
    ("min", "mins", "minute", "minutes"): (60.0, _TIME),
    ("h", "hr", "hrs", "hour", "hours"): (3600.0, _TIME),
    ("day", "days"): (86_400.0, _TIME),
    ("lb", "lbs", "lbm", "pound", "pounds"): (_POUND, _MASS),
    ("oz", "ounce", "ounces"): (_POUND / 16, _MASS),
    ("newton", "newtons", "Newton", "Newtons"): (1.0, _FORCE),
    ("daN",): (10.0, _FORCE),
    ("kilonewton", "kilonewtons"): (1e3, _FORCE),
    ("millinewton", "millinewtons"): (1e-3, _FORCE),
    ("joule", "joules", "Joule", "Joules"): (1.0, _TORQUE),
    ("lbf",): (_POUND * GRAVITY, _FORCE),
    ("ozf",): (_POUND / 16 * GRAVITY, _FORCE),
    ("kgf", "kp"): (GRAVITY, _FORCE),
    ("gf",): (1e-3 * GRAVITY, _FORCE),
    ("dyn",): (1e-5, _FORCE),
    ("bar",): (1e5, _PRESSURE),
    ("psi",): (_POUND * GRAVITY / _INCH**2, _PRESSURE),
    ("volt", "volts", "Volt", "Volts"): (1.0, _VOLT),
    ("ampere", "amperes", "amp", "amps", "Amps"): (1.0, _AMPERE),
    ("K",): (1.0, _KELVIN),
    ("°C", "°F", "degC", "degF"): (math.nan, _KELVIN),
    ("counts", "count", "cts", "ticks", "LSB", "digits"): (1.0, _COUNT),
    ("%",): (0.01, NONE),
}

SYMBOLS: dict[str, tuple[float, Dimension]] = {
    **{symbol: value for symbols, value in _ALONE.items() for symbol in symbols},
    **{
        prefix + symbol: (factor * value, dimension)
        for symbol, (value, dimension) in _WITH_PREFIX.items()
        for prefix, factor in {"": 1.0, **_PREFIXES}.items()
    },
}
"""Factor to kg, m, s, rad, and powers of these, by symbol. The tests compare every factor with Pint's."""
for _odd in ("dN", "dA", "cs", "ds", "ks", "Ms", "csec", "dsec", "ksec", "Msec", "Mm", "crad", "drad", "krad", "Mrad"):
    del SYMBOLS[_odd]  # nobody measures in these, and words would be read as them

ALONE_IN_CAPITALS = {word: word for word in _SAME_IN_CAPITALS} | {"nm": "Nm", "nmm": "Nmm", "knm": "kNm", "kn": "kN"}
"""Symbols in small letters, and what they mean where capitals were written; where they alone are the unit, no short names of channels."""

ALONE_IN_CAPITALS |= {"hz": "Hz", "khz": "kHz", "dan": "daN", "danm": "daNm"}

DOUBTFUL = {
    "MS": "ms in capitals, megasiemens as written",
    "mS": "ms, millisiemens as written",
    "Ms": "ms with a capital, megaseconds as written",
    "Mm": "mm with a capital, megametres as written",
    "Mrad": "mrad with a capital, megaradians as written",
    "MNm": "mNm with a capital, MN m as written",
    "rev?": "rev for revolutions, or a name that says reversed",
}
"""Units in letters that mean two things, of which hardly anybody measures the one that is written, and what they mean."""

NEVER_JOINED = frozenset(("K",))
"""Symbols that nothing is written to without a blank: KN is no K N."""

IN_CAPITALS = ALONE_IN_CAPITALS | {word: word for word in ("s", "m", "cm", "lb", "oz", "in", "kg")} | {"n": "N"}

_RPM, _TURNS, _DEGREES = ((factor, (0, 0, -1, 1, *NONE[4:])) for factor in (math.pi / 30, math.tau, math.pi / 180))

ROTATIONS: dict[str, tuple[float, Dimension]] = {
    **dict.fromkeys(("u/min", "umdr/min", "r/min", "tr/min"), _RPM),
    **dict.fromkeys(("rps", "r/s", "u/s", "tr/s"), _TURNS),
    "dps": _DEGREES,
    **dict.fromkeys(("umdr", "tr"), (math.tau, _ANGLE)),
}
"""Turns and speeds of turning in letters that mean nothing elsewhere, in small letters and without points."""

LONGEST = max(map(len, SYMBOLS))
