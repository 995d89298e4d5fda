"""A channel of a recording: an array that knows its unit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from tvident._units.parse import unit_of
from tvident._units.quantities import UnitError


class Channel(np.ndarray[Any, Any]):
    """Samples with their unit, as :func:`tvident.read_recording` gives them: an array in every other way.

    Slices and copies keep the unit. What is computed from samples is a plain array, since its unit is another.

    Attributes
    ----------
    unit : str
        As the file writes it; empty where it has none.

    See Also
    --------
    tvident.read_recording : returns recordings with such channels.

    References
    ----------
    NumPy documentation, "Subclassing ndarray": how slices and copies keep what an array knows.
    docs/files.md, "Units".

    Examples
    --------
    >>> import tvident
    >>> tvident.simulate_torsional_rig(duration=1.0).save("rig.csv")
    >>> angle = tvident.read_recording("rig.csv")["angle"]
    >>> angle[:100].unit
    'rad'
    >>> type(angle * 2).__name__
    'ndarray'
    """

    unit: str

    def __new__(cls, samples: npt.ArrayLike, unit: str = "") -> Self:
        """Give samples a unit, without a copy."""
        channel = np.asarray(samples).view(cls)
        channel.unit = unit
        return channel

    def __array_finalize__(self, other: Any) -> None:
        self.unit = getattr(other, "unit", "")

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **kwargs: Any) -> Any:
        """Compute with plain arrays: a product or a mean of channels has another unit, or none."""
        if "out" in kwargs:
            kwargs["out"] = tuple(np.asarray(one) if isinstance(one, Channel) else one for one in kwargs["out"])
        plain = (np.asarray(one) if isinstance(one, Channel) else one for one in inputs)
        return getattr(ufunc, method)(*plain, **kwargs)

    def to(self, unit: str) -> Channel:
        """Return the samples in another unit.

        Parameters
        ----------
        unit : str
            Such as ``"rad"``, ``"N m"`` or ``"s"``.

        Returns
        -------
        Channel, same shape

        Raises
        ------
        ValueError
            If one of the units is unknown, or they measure different quantities.

        See Also
        --------
        tvident.identify : converts channels by itself.
        """
        here, there = unit_of(self.unit), unit_of(unit)
        if here is None or there is None or here.dimension != there.dimension or not here.factor > 0 < there.factor:
            raise UnitError(
                f"a unit is converted to one of the same quantity; got {self.unit!r} and {unit!r}; multiply by a factor of your own"
            )
        return Channel(np.asarray(self) * (here.factor / there.factor), unit)

    def __reduce__(self) -> Any:
        return Channel, (np.asarray(self), self.unit)


def unit_said(values: Any) -> str:
    """Return the unit that an array says it has, of ours, of pint or in the attributes of xarray; an empty string if it says none."""
    if isinstance(values, Channel):
        return values.unit
    if hasattr(values, "magnitude") and hasattr(values, "units"):
        return str(values.units)
    attributes = getattr(values, "attrs", None)
    if not isinstance(attributes, Mapping):
        return ""
    said = attributes.get("units") or attributes.get("unit")
    return said if isinstance(said, str) else ""
