"""What channels are multiplied by, and the unit of the product."""

from __future__ import annotations

import math
from typing import Any

import click
import numpy as np
import numpy.typing as npt

from tvident import recordings
from tvident._files import printable
from tvident._units import LINEAR, ROTARY, Channel, factor_to, is_convertible, unit_said

_CLOSE = 1e-3
"""By which share of it a scale may differ from what converts a unit, and still is what converts it: 0.01745 for degrees."""


def factor_of(scale: str, channels: recordings.Channels, file: str | None) -> Any:
    """Return a scale: a number, or a variable of the file."""
    try:
        factor = float(scale)
    except ValueError:
        try:
            return recordings.channel(channels, scale, file or "the command line")
        except KeyError as error:
            raise click.UsageError(f"{error.args[0]}; or write a number with a point, as 0.5") from None
    if not math.isfinite(factor):
        raise click.UsageError(f"a scale must be finite; got {scale}; give a number such as 0.001")
    return factor


def scaled(
    values: npt.NDArray[Any],
    scale: str | None,
    channels: recordings.Channels,
    file: str | None,
    *,
    quantity: str = "",
    unit: str | None = None,
) -> npt.NDArray[Any]:
    """Return a channel times a number, or a variable of the file.

    Parameters
    ----------
    values : ndarray
    scale : str, optional
        A number or the name of a variable.
    channels : mapping
        Of the file.
    file : str, optional
    quantity : {"angle", "torque"}, optional
        What the channel holds.
    unit : str, optional
        Of the product, where an option says it.

    Returns
    -------
    ndarray
        With its unit where only the sign is another. A unit that cannot be converted, as A of a current, is replaced by the scale.

    Raises
    ------
    click.UsageError
        If the scale is none, or the header says a unit and nobody knows whether the product still is in it.
    """
    if scale is None:
        return values
    factor = factor_of(scale, channels, file)
    if np.ndim(factor) and factor.shape != values.shape:
        raise click.UsageError(
            f"a scale must be one number, or have one value for every sample; {scale!r} has {factor.size} values "
            f"for {values.size} samples; use another variable"
        )
    product = np.asarray(np.asarray(values) * factor)
    said = unit_said(values) if quantity and unit is None else ""
    if said and np.ndim(factor) == 0 and abs(float(factor)) == 1:
        return Channel(product, said)
    converts = [
        factor_to(system, quantity, said, name=f"the {quantity}")
        for system in (ROTARY, LINEAR)
        if said and is_convertible(system, quantity, said)
    ]
    if (
        converts
        and converts[0] != 1
        and not (np.ndim(factor) == 0 and math.isclose(factor, converts[0], rel_tol=_CLOSE))
    ):
        now, plain = printable(said, 20), "rad" if quantity == "angle" else "N m"
        raise click.UsageError(
            f"of a channel that is multiplied the unit must be said; the {quantity} is in '{now}' and multiplied by "
            f"{printable(scale, 20)}; give --{quantity}-unit '{now}', or --{quantity}-unit '{plain}' if the product is in that"
        )
    return product
