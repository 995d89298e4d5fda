"""Curves of expansions as files hold them: with the functions that they are sums of."""

from __future__ import annotations

import base64
import warnings
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._expansion import Basis, Coordinate, Rival, Rivals, family_from, plain_family
from tvident._files import FileWarning
from tvident._results.curve import ExpandedParameter

Array: TypeAlias = npt.NDArray[Any]

Plain: TypeAlias = dict[str, Any]


def plain_curves(curves: Mapping[str, ExpandedParameter]) -> dict[str, Plain]:
    """Return curves as JSON has them; functions of the user's own cannot be stored, which is said."""
    found = {}
    for name, curve in curves.items():
        plain = _plain_curve(curve)
        if plain is None:
            warnings.warn(
                f"the functions of {name} are your own and cannot be stored: expansions[{name!r}] is lost, values at the samples are kept",
                FileWarning,
                stacklevel=4,
            )
        else:
            found[name] = plain
    return found


def curves_from(plain: Mapping[str, Plain]) -> dict[str, ExpandedParameter]:
    """Return curves from JSON."""
    return {name: _curve_from(one) for name, one in plain.items()}


def _plain_curve(curve: ExpandedParameter) -> Plain | None:
    basis, rivals = curve._basis, curve._rivals  # noqa: SLF001 - of this room
    families = [] if basis is None else [plain_family(one) for one in basis.families]
    if basis is None or None in families:
        return None
    return {
        "name": curve.name,
        "family": curve.family,
        "coefficients": _packed(curve.coefficients),
        "covariance": _packed(curve.covariance),
        "sizes": {name: _packed(values) for name, values in curve.sizes.items()},
        "unit": curve.unit,
        "unit_of": curve.unit_of,
        "families": families,
        "limits": [list(one.limits) for one in basis.coordinates],
        "size": [int(one) for one in basis.sizes],
        "own": _packed(curve._own),  # noqa: SLF001 - of this room
        "root": _packed(curve._own_root),  # noqa: SLF001 - likewise
        "is_averaged": rivals.is_averaged,
        "rivals": [
            [one.weight, [int(size) for size in one.basis.sizes], _packed(one.factors), _packed(one.root)]
            for one in rivals.curves
        ],
    }


def _curve_from(plain: Plain) -> ExpandedParameter:
    families = [family_from(one) for one in plain["families"]]
    nothing = np.zeros(0)
    # Places along the record are those of its channel, which is not stored.
    coordinates = [Coordinate(nothing, np.zeros((2, 0)), (low, high)) for low, high in plain["limits"]]

    def basis_of(sizes: Sequence[int]) -> Basis:
        return Basis(coordinates, families, sizes)

    limits = tuple((low, high) for low, high in plain["limits"])
    rivals = [
        Rival(weight, basis_of(sizes), _unpacked(factors), _unpacked(root))
        for weight, sizes, factors, root in plain["rivals"]
    ]
    return ExpandedParameter(
        name=plain["name"],
        family=plain["family"],
        coefficients=_unpacked(plain["coefficients"]),
        covariance=_unpacked(plain["covariance"]),
        sizes={name: _unpacked(values) for name, values in plain["sizes"].items()},
        limits=limits[0] if len(limits) == 1 else limits,
        unit=plain["unit"],
        unit_of=plain["unit_of"],
        _basis=basis_of(plain["size"]),
        _own=_unpacked(plain["own"]),
        _own_root=_unpacked(plain["root"]),
        _rivals=Rivals(rivals, plain["is_averaged"]),
    )


def _packed(values: Array) -> Plain:
    """Return an array as JSON holds many numbers, to the last bit."""
    array = np.ascontiguousarray(values)
    array = array.astype(array.dtype.newbyteorder("<"))
    return {"type": array.dtype.str, "shape": array.shape, "data": base64.b64encode(array.tobytes()).decode()}


def _unpacked(plain: Plain) -> Array:
    array = np.frombuffer(base64.b64decode(plain["data"]), np.dtype(plain["type"]))
    return array.reshape(plain["shape"]).astype(array.dtype.newbyteorder("="))
