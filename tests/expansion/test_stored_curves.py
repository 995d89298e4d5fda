"""Curves of expansions come back from files as they were."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from tvident import Expansion

Array = npt.NDArray[np.float64]


@pytest.fixture(scope="module")
def rig() -> tvident.Recording:
    return tvident.simulate_torsional_rig(duration=6.0)


@pytest.mark.parametrize(
    ("family", "size", "of"),
    [
        ("bspline", "auto", "slider"),
        ("bspline", "auto", None),
        ("fourier", 5, None),
        ("haar", 8, "slider"),
        ("powers", 5, "slider"),
        ("db2", 4, None),
        ("bspline", (4, 3), "both"),
    ],
)
@pytest.mark.parametrize("ending", ["npz", "parquet"])
def test_curves_come_back_to_the_last_bit(
    rig: tvident.Recording, family: str, size: Any, of: str | None, ending: str, tmp_path: Path
) -> None:
    """They were lost, without a word."""
    channels: dict[str, Any] = {"slider": rig.slider_position, "both": (rig.slider_position, rig.angle)}
    spring = Expansion(family, size, of=None if of is None else channels[of])
    result = tvident.identify(rig.angle, rig.torque, sample_rate=1000, stiffness=spring)
    result.save(tmp_path / f"result.{ending}")
    stored = tvident.load(tmp_path / f"result.{ending}").expansions["stiffness"]
    curve = result.expansions["stiffness"]
    for name in ("value", "stderr", "coefficients", "covariance"):
        assert np.array_equal(getattr(stored, name), getattr(curve, name), equal_nan=True)
    for name in ("name", "family", "size", "limits", "unit", "unit_of"):
        assert getattr(stored, name) == getattr(curve, name)
    assert all(np.array_equal(stored.sizes[name], values) for name, values in curve.sizes.items())
    # A copy has the same functions: those of powers, Haar and Daubechies were taken for the user's own.
    copy.deepcopy(result).save(tmp_path / f"copied.{ending}")
    copied = tvident.load(tmp_path / f"copied.{ending}").expansions["stiffness"]
    assert np.array_equal(copied.value, curve.value, equal_nan=True)


def test_functions_of_the_users_own_are_said_to_be_lost(rig: tvident.Recording, tmp_path: Path) -> None:
    def powers(places: Array, size: int) -> Array:
        return np.stack([places**k for k in range(size)], axis=-1)

    result = tvident.identify(rig.angle, rig.torque, sample_rate=1000, stiffness=Expansion(powers, 3))
    with pytest.warns(tvident.recordings.FileWarning, match=r"are your own and cannot be stored: expansions\['stiff"):
        result.save(tmp_path / "result.npz")
    stored = tvident.load(tmp_path / "result.npz")
    assert not stored.expansions
    assert np.array_equal(stored.stiffness, result.stiffness)
