"""Random calls of identify: forms, kinds, terms, masks, known parameters, settings given back."""

from __future__ import annotations

from typing import Any

import numpy as np

import tvident
from hostile import arguments, arrays, invariants

KINDS = ("windowed", "constant", "auto", "varying")

FUNCTIONS: tuple[Any, ...] = (
    lambda _t, _a, v: v * np.abs(v),
    lambda _t, a, _v: np.full(a.shape, np.nan),
    lambda _t, a, _v: a[..., :-1],
    lambda _t, a, _v: np.zeros(a.shape),
    lambda _t, a, _v: a + 1j,
    lambda t, a, _v: t * 0 + a,
    lambda _t, a, _v: np.full(a.shape, 1e60),
    lambda _t, a, _v: a > 0,
    lambda _t, a, _v: np.ma.masked_greater(np.sign(a), 0),
    lambda _t, _a, _v: None,
)

FLAGS = (True, False)

NAMES = ("own", "drag", "time", "a,b", "inertia", "", "=1", "x_stderr", 5)


def identified(generator: np.random.Generator) -> None:
    """Identify; again with other workers, with plain copies, and with the settings of the result."""
    shape = arrays.shape(generator)
    count = shape[-1] if shape else 1
    angles, torques = _records(generator, shape)
    careful = generator.random() < 0.6
    angle, torque = ((one if careful else arrays.dressed(generator, one)[0]) for one in (angles, torques))
    form = _form(generator, count)
    options = _options(generator, shape)
    period = arguments.some(generator, {"delta": lambda: arguments.one(generator, 0.01)}) or {"sample_rate": 100.0}

    def found(a: Any, b: Any, **changed: Any) -> tuple[tvident.Identification, dict[str, Any]]:
        result = tvident.identify(a, b, **({"method": form} | period | options | changed))
        return result, _everything(result)

    result, first = found(angle, torque)
    unknown = {name: values for name, values in first["values"].items() if result.settings["kinds"][name] != "known"}
    # In weak form inertia and damping that vary are one curve over the record.
    curves = {"inertia", "damping"} if result.settings["form"] == "weak" else set()
    apart = curves | {name for name in unknown if result.settings["kinds"][name] != "windowed"}
    invariants.check(unknown, first["errors"], result.status, apart)
    assert invariants.same(first, found(angle, torque, workers=3)[1]), "other workers give other numbers"
    copies = arrays.plain(angle), arrays.plain(torque)
    if copies[0] is not None and copies[1] is not None and options.get("quantisation") is not None:
        assert invariants.same(first, found(*copies)[1]), "another layout gives other numbers"
    _given_back(result, angle, torque, period, options)


def _records(generator: np.random.Generator, shape: tuple[int, ...]) -> tuple[arrays.Array, arrays.Array]:
    """Give angles and torques: half of them of a system, the others of nothing."""
    angles, torques = (arrays.values(generator, shape) for _ in range(2))
    if generator.random() < 0.5 and shape and shape[-1] > 2:
        with np.errstate(all="ignore"):
            torques = 100 * np.gradient(np.gradient(angles, axis=-1), axis=-1) + 15 * angles
            torques += generator.choice([0, 0.01]) * generator.standard_normal(shape)
    return angles, torques


def _form(generator: np.random.Generator, count: int) -> Any:
    lengths = {
        name: (lambda: arguments.one(generator, "auto", *(arguments.window(generator, count) for _ in range(3))))
        for name in ("window_length", "regression_window")
    }
    weak = {
        "exponent": lambda: arguments.one(generator, "auto", 3, 8, 20, 21),
        "averaging": lambda: arguments.one(generator, *FLAGS),
    }
    strong = {
        "max_order": lambda: arguments.one(generator, int(generator.integers(0, 17))),
        "criterion": lambda: arguments.one(generator, "aicc", "bic"),
        "selection": lambda: arguments.one(generator, "window", "pooled", "average"),
        "filter_torque": lambda: arguments.one(generator, *FLAGS),
    }
    variation = {"variation": lambda: arguments.one(generator, "constant", "linear")}
    drawn = generator.random()
    if drawn < 0.3:
        return tvident.WeakForm(**arguments.some(generator, weak | lengths | variation))
    if drawn < 0.5:
        short = {"window_length": min(51, count - 1 + count % 2), "regression_window": 40}
        return tvident.StrongForm(**(short | arguments.some(generator, strong | lengths | variation)))
    return arguments.one(generator, "auto", "auto", "paper")


def _terms(generator: np.random.Generator) -> list[Any]:
    found: list[Any] = []
    for _ in range(int(generator.integers(0, 4))):
        term: Any = arguments.one(generator, "offset", "coulomb", "cubic", "gravity")
        if generator.random() < 0.3:
            name: Any = NAMES[0 if generator.random() < 0.7 else int(generator.integers(len(NAMES)))]
            term = tvident.Term(name, FUNCTIONS[int(generator.integers(len(FUNCTIONS)))])
        found.append(term if generator.random() < 0.5 else (term, arguments.one(generator, "windowed", "constant")))
    return found


def _options(generator: np.random.Generator, shape: tuple[int, ...]) -> dict[str, Any]:
    def parameter() -> Any:
        if generator.random() < 0.15:
            return arrays.dressed(generator, arrays.values(generator, shape))[0]
        return arguments.one(generator, *KINDS, *KINDS, 0.0, 1.0, -1.0)

    def mask() -> Any:
        of_shape = shape if generator.random() < 0.7 else shape[-1:]
        return generator.random(of_shape) < generator.choice([0, 0.02, 0.5, 0.9, 1])

    return arguments.some(
        generator,
        {
            "inertia": parameter,
            "damping": parameter,
            "stiffness": parameter,
            "terms": lambda: _terms(generator),
            "lag": lambda: arguments.one(generator, "auto", 0.0, 0.001, -0.0137, 0.5, 1e9),
            "quantisation": lambda: arguments.one(generator, 0.0, 0.01),
            "mask": lambda: arguments.one(generator, mask(), mask(), np.ones(3)),
            "nan_policy": lambda: arguments.one(generator, "omit", "propagate", "raise"),
            "step": lambda: arguments.one(generator, 1, 2, 7, 5000, 2**62),
            "workers": lambda: arguments.one(generator, 1, 2, 64),
        },
    )


def _everything(result: tvident.Identification) -> dict[str, Any]:
    """Give all that a result holds, and have it put into words."""
    result.summary()
    repr(result)
    if result.inertia.ndim == 1:
        result.columns()
    values = {"inertia": result.inertia, "damping": result.damping, "stiffness": result.stiffness, **result.terms}
    return {
        "values": {name: np.asarray(value) for name, value in values.items()},
        "errors": {name: np.asarray(result.stderr[name]) for name in values},
        "oscillator": [result.natural_frequency, result.damping_ratio, result.stderr["natural_frequency"]],
        "condition": result.condition,
        "residual_std": result.residual_std,
        "status": result.status,
        "record_status": np.asarray(result.record_status),
        "time": result.time,
        "jumps": result.jumps,
        "settings": result.settings,
        "words": [*result.reasons, *result.advice],
    }


def _given_back(result: tvident.Identification, angle: Any, torque: Any, period: Any, options: dict[str, Any]) -> None:
    """Check that the settings of a result are accepted, with what they do not hold beside them."""
    held = {"lag", "quantisation", "terms"}
    given = {name: value for name, value in options.items() if name not in held}
    own = [one for one in options.get("terms", ()) if isinstance(one, tvident.Term) or isinstance(one[0], tvident.Term)]
    if own:
        given["terms"] = options["terms"]
    try:
        tvident.identify(angle, torque, **period, **given, settings=result.settings)
    except (ValueError, TypeError) as refused:
        raise AssertionError(f"the settings of a result are refused: {refused}") from refused
