"""Messages show what was passed in one short line, whatever it is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import tvident
from tvident._arguments import to_digits_of, with_error

Y = np.sin(np.arange(300) / 20)


class Unprintable:
    """Something that cannot be shown."""

    def __repr__(self) -> str:
        raise RuntimeError


@pytest.mark.parametrize(
    "value",
    [
        10**400,
        10**5000,
        -(10**5000),
        "x" * 10**6,
        list(range(10**5)),
        np.arange(10**5),
        np.ones((300, 300)),
        "a\nb\x1b[31m",
        Unprintable(),
        {"a": list(range(1000))},
        b"\x00" * 10**5,
        np.datetime64(3, "s"),
        1j,
        np.ma.masked,
        object(),
        [[[[[[[]]]]]]],
    ],
    ids=lambda value: type(value).__name__,
)
@pytest.mark.parametrize(
    "name",
    [
        "max_order",
        "order",
        "max_deriv",
        "criterion",
        "selection",
        "step",
        "workers",
        "nan_policy",
        "delta",
        "quantisation",
    ],
)
def test_a_message_is_one_short_line(name: str, value: Any) -> None:
    options: dict[str, Any] = {name: value}
    with pytest.raises((ValueError, TypeError)) as refused:
        tvident.fit_local_polynomials(Y, 31, **options)
    message = str(refused.value)
    assert message.isprintable()
    assert len(message) < 300
    assert message.startswith(f"{name} must ")
    assert message.count(";") == 2


def test_numbers_of_numpy_are_shown_as_numbers() -> None:
    with pytest.raises(ValueError, match=r"step must be at least 1; got -3; pass 1 or more"):
        tvident.fit_local_polynomials(Y, 31, step=np.int64(-3))  # type: ignore[arg-type] # which NumPy's integers are
    with pytest.raises(TypeError, match=r"step must be a whole number; got 2.0; pass 2"):
        tvident.fit_local_polynomials(Y, 31, step=np.float32(2))  # type: ignore[arg-type] # likewise


def test_what_rounds_to_zero_has_no_sign() -> None:
    """A report showed a velocity bias of -0.0e-5."""
    assert with_error(-1e-7, 9.2e-5) == "(0.0 ± 9.2)e-5"
    assert with_error(-0.00004, 0.011) == "0.000 ± 0.011"
    assert with_error(-0.4, 0.011) == "-0.400 ± 0.011"
    assert to_digits_of(-0.00004, 0.011) == "0.000"
