"""Results of masses and trials in files and pictures."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest

import tvident
from merged.simulated import chain, double_pendulum, simulated
from merged.test_masses import OPTIONS, changing, constant, springs
from merged.test_mechanisms import FRICTION, pendulum

mpl.use("agg")

identify: Any = tvident.identify
"""Its type is that of a single record."""

STRUCTURE = tvident.Chain(2, springs(2))


def masses() -> Any:
    one = chain([changing, constant(18.0)], 5000, seed=3)
    return identify(one.angle, one.torque, structure=STRUCTURE, stiffness=["windowed", "auto"], step=2, **OPTIONS)


def trials() -> Any:
    several = simulated(3, 1500, changing, seed=1)
    return identify(several.angle, several.torque, sample_rate=1000, ensemble_axis=0)


def mechanism(step: int = 2) -> Any:
    one = double_pendulum(2000, seed=1)
    return identify(one.angle, one.torque, t=one.time, structure=pendulum(), step=step, **FRICTION)


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize("made", [masses, trials, mechanism])
def test_what_was_saved_comes_back(made: Any, tmp_path: Path) -> None:
    result = made()
    for ending in ("npz", "parquet"):
        result.save(tmp_path / f"result.{ending}")
        loaded = tvident.load(tmp_path / f"result.{ending}")
        assert isinstance(loaded, tvident.MergedIdentification)
        for name in ("inertia", "damping", "stiffness", "status", "residual_std", "time", "trusted"):
            np.testing.assert_array_equal(getattr(loaded, name), getattr(result, name), err_msg=name)
        for name, values in result.stderr.items():
            np.testing.assert_array_equal(loaded.stderr[name], values, err_msg=name)
        assert loaded.constants == result.constants
        assert loaded.identifiable == result.identifiable
        assert loaded.settings == result.settings
        assert loaded.record_status == result.record_status
        assert loaded.summary() == result.summary()
        if made is masses:
            found, again = (one.modes.natural_frequency_stderr for one in (result, loaded))
            np.testing.assert_array_equal(again, found)
        if made is mechanism:
            assert loaded.scan().summary() == result.scan().summary()
        with pytest.raises(ValueError, match="record must be there"):
            loaded.predicted_torque()
    copied = pickle.loads(pickle.dumps(result))  # noqa: S301 - our own
    assert copied.summary().splitlines()[2:] == result.summary().splitlines()[2:]
    np.testing.assert_array_equal(
        copied.natural_frequency if made is trials else copied.inertia,
        getattr(result, "natural_frequency" if made is trials else "inertia"),
    )
    result.save(tmp_path / "result.csv")
    assert tvident.read_recording(tmp_path / "result.csv")["residual_std"].size == result.time.size


@pytest.mark.slow
def test_results_are_drawn() -> None:
    result = masses()
    shown = result.plot()
    assert [text.get_text() for text in shown.axes[0].texts] == ["Stiffness base 0"]
    assert "Inertia 1" in shown.axes[0].get_title(loc="left")
    assert len(result.plot("torque", mass=1).axes) == 2
    assert len(mechanism().plot("scan").axes) == 11
    assert trials().plot("torque", trial=2).axes
    with pytest.raises(ValueError, match="what must be"):
        result.plot("poles")
    plt.close("all")


@pytest.mark.first(1)
@pytest.mark.parametrize("made", [masses, trials, mechanism])
def test_a_part_is_that_of_the_whole(made: Any, tmp_path: Path) -> None:
    result = made()
    part = result.between(0.3, 0.8)
    samples = (result.time >= 0.3) & (result.time <= 0.8)
    assert 0 < np.count_nonzero(samples) < samples.size
    part.save(tmp_path / "part.npz")
    again = tvident.load(tmp_path / "part.npz")
    again.save(tmp_path / "again.npz")
    for one in (part, part.between(), again, tvident.load(tmp_path / "again.npz")):
        for name in ("time", "inertia", "damping", "stiffness", "status", "residual_std", "trusted"):
            np.testing.assert_array_equal(getattr(one, name), getattr(result, name)[..., samples], err_msg=name)
        for name, values in result.stderr.items():
            np.testing.assert_array_equal(one.stderr[name], values[..., samples], err_msg=name)
        assert one.constants == result.constants
        assert one.record_status == result.record_status
        assert one.advice == result.advice
        assert one.jumps == tuple(jump for jump in result.jumps if 0.3 <= jump <= 0.8)
    assert np.shares_memory(part.residual_std, result.residual_std)
    if made is not mechanism:
        np.testing.assert_allclose(part.natural_frequency, result.natural_frequency[..., samples], rtol=1e-3)
    assert "this is a part of a result" in part.summary()
    assert f"samples, {np.ptp(part.time):.4g} s at" in part.summary()
    part.report(tmp_path / "part.html")
    plt.close(part.plot())
    for name in ("predicted_torque", "vaf"):
        with pytest.raises(ValueError, match="record must be there"):
            getattr(part, name)()
    with pytest.raises(ValueError, match=r"a part must hold samples; got 9\.0 to None s"):
        result.between(9.0)


def test_a_line_and_a_table_have_the_numbers() -> None:
    rigs = [tvident.simulate_torsional_rig(duration=1.0, seed=seed) for seed in range(3)]
    angle, torque = np.stack([rig.angle for rig in rigs]), np.stack([rig.torque for rig in rigs])
    found = tvident.identify(angle, torque, sample_rate=1000, ensemble_axis=0)
    line, page = repr(found), found._repr_html_()
    assert line.startswith("<MergedIdentification of 3 trials of one mass, 1000 samples, 0.999 s: inertia 0.01")
    for name in found.elements:
        assert f"{name} {found.value(name)}" in line
        assert f"<td>{name}</td>" in page
        assert str(found.value(name)) in page
    with pytest.raises(ValueError, match="phase must have as many trials as the angle; got 2 beside 3"):
        tvident.identify(
            list(angle), list(torque), sample_rate=1000, ensemble_axis=0, phase=[np.arange(1000) / 1000] * 2
        )
