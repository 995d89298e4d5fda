"""What users do with a result: cut it, take a record of a batch, store it and get it back, read its numbers, complete its names."""

from __future__ import annotations

import json
import pickle
import subprocess
import sys
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import tvident
from calls import paper, strong
from parameters import long
from tvident import recordings
from tvident._arguments import with_error

xr = pytest.importorskip("xarray")

RIG = tvident.simulate_torsional_rig(duration=3.0)
ANGLES = np.stack([RIG.angle, RIG.angle + 1e-3 * np.random.default_rng(0).standard_normal(RIG.angle.size)])
TORQUES = np.stack([RIG.torque, RIG.torque])
RESULT = tvident.identify(RIG.angle, RIG.torque, t=RIG.time + 5)
BATCH = tvident.identify(ANGLES, TORQUES, sample_rate=1000, lag="auto", stiffness="windowed")
METHODS: dict[str, dict[str, Any]] = {
    "auto": {},
    "paper": paper(window_length=51, regression_window=60),
    "strong": strong(window_length=51, regression_window=60, variation="constant"),
    "known": {"inertia": 0.0123, "terms": ["coulomb", "offset"], "step": 3},
}


def assert_same(one: tvident.Identification, other: tvident.Identification) -> None:
    assert one.settings == other.settings
    assert (one.reasons, one.advice, one.jumps) == (other.reasons, other.advice, other.jumps)
    assert list(one.constants) == list(other.constants)
    assert_array_equal(list(one.constants.values()), list(other.constants.values()))
    assert_array_equal(one.record_status, other.record_status)
    mine, others = one.to_xarray(), other.to_xarray()
    xr.testing.assert_identical(mine, others)
    assert {name: one.dtype for name, one in mine.items()} == {name: one.dtype for name, one in others.items()}
    assert_array_equal(one.time, other.time)
    assert repr(one) == repr(other)


def test_between_two_times() -> None:
    part = RESULT.between(6.0, 7.5)
    assert part.time[[0, -1]].tolist() == pytest.approx([6.0, 7.5])
    assert_array_equal(part.stiffness, RESULT.stiffness[1000:2501])
    assert_array_equal(part.stderr["natural_frequency"], RESULT.stderr["natural_frequency"][1000:2501])
    assert part.constants == RESULT.constants
    assert RESULT.between(end=6).time.size == 1001
    assert "not known: this is a part" in part.summary()
    assert RESULT.between().summary().splitlines()[2:] == RESULT.summary().splitlines()[2:]
    for begin, end in ((9.0, 10.0), (7.0, 6.0)):
        with pytest.raises(ValueError, match=r"a part must hold samples; got .*; the result has 5 to 7.999 s"):
            RESULT.between(begin, end)


@pytest.mark.first(1)
@pytest.mark.parametrize("method", METHODS)
def test_a_record_of_a_batch_is_what_it_would_be_alone(method: str) -> None:
    options = METHODS[method]
    batch = tvident.identify(ANGLES, TORQUES, sample_rate=1000, **options)
    for place in (0, 1, -1):
        alone = tvident.identify(ANGLES[place], TORQUES[place], sample_rate=1000, **options)
        one = batch[place]
        assert_array_equal(one.stiffness, alone.stiffness)
        assert_array_equal(one.stderr["inertia"], alone.stderr["inertia"])
        assert one.settings["kinds"] == alone.settings["kinds"]
        assert one.constants == alone.constants
        assert one.settings["window_length"] == alone.settings["window_length"]
        assert one.record_status == alone.record_status
        assert one.held_back().simulated == pytest.approx(alone.held_back().simulated, rel=1e-9, nan_ok=True)
    if method == "auto":
        assert batch[1].reasons == tvident.identify(ANGLES[1], TORQUES[1], sample_rate=1000).reasons


def test_records_of_a_batch() -> None:
    assert BATCH[0:2].stiffness.shape == BATCH.stiffness.shape
    assert [one.settings["lag"] for one in BATCH] == BATCH.settings["lag"]
    again = tvident.identify(ANGLES[1], TORQUES[1], sample_rate=1000, settings=BATCH[1].settings)
    assert_array_equal(again.stiffness, BATCH.stiffness[1])
    cube = tvident.identify(np.stack([ANGLES, ANGLES]), np.stack([TORQUES, TORQUES]), sample_rate=1000, inertia=0.0123)
    assert_array_equal(cube[1][0].stiffness, cube.stiffness[1, 0])
    assert_array_equal(cube[:, 1].stiffness, cube.stiffness[:, 1])
    with pytest.raises(TypeError, match="only a result of several records can be indexed"):
        RESULT[0]
    with pytest.raises(IndexError):
        BATCH[2]


@pytest.mark.parametrize("ending", ["npz", "parquet"])
@pytest.mark.parametrize("method", METHODS)
def test_a_stored_result_comes_back_to_the_last_bit(method: str, ending: str, tmp_path: Path) -> None:
    if ending == "parquet":
        pytest.importorskip("pyarrow")
    result = tvident.identify(RIG.angle, RIG.torque, t=RIG.time + 5, **METHODS[method])
    place = tmp_path / f"result.{ending}"
    result.save(place)
    back = tvident.load(place)
    assert_same(back, result)
    assert back.summary().splitlines()[2:] == result.summary().splitlines()[2:]
    if result.settings["step"] == 1:
        initial = (0.1, 0)
        assert_array_equal(back.simulate(RIG.torque, initial=initial), result.simulate(RIG.torque, initial=initial))
    again = tvident.identify(
        RIG.angle, RIG.torque, t=RIG.time + 5, settings=back.settings, step=result.settings["step"]
    )
    assert_array_equal(again.stiffness, result.stiffness)
    assert_same(pickle.loads(pickle.dumps(result)), result)  # noqa: S301 - made here


@cache
def with_a_hole(method: str) -> tuple[tvident.Identification, str, Any]:
    """Give a result of samples of which some are missing, its settings as text, and the stiffness that these give again."""
    angle = RIG.angle.copy()
    angle[1000:1400] = np.nan
    result = tvident.identify(angle, RIG.torque, t=RIG.time + 5, **METHODS[method])
    settings = json.dumps(result.settings)
    again = tvident.identify(
        angle, RIG.torque, t=RIG.time + 5, settings=json.loads(settings), step=result.settings["step"]
    )
    return result, settings, again.stiffness


@pytest.mark.parametrize(
    ("method", "ending"),
    [
        *((method, ending) for method in METHODS for ending in (".csv", ".h5", ".hdf5", ".mat")),
        ("auto", ".xlsx"),
        *long(*((method, ".xlsx") for method in METHODS if method != "auto")),
    ],
)
def test_tables_of_other_programs_give_back_every_column_unit_and_setting(
    method: str, ending: str, tmp_path: Path
) -> None:
    result, settings, again = with_a_hole(method)
    result.save(tmp_path / f"result{ending}")
    back, columns = tvident.read_recording(tmp_path / f"result{ending}"), result.columns()
    assert list(back) == list(columns)
    for name, values in columns.items():
        assert back.units[name] == result.units.get(name.removesuffix("_stderr"), "")
        found, expected = np.asarray(back[name], np.float64), values.astype(np.float64)
        if ending == ".xlsx":  # 16 digits, as openpyxl writes them
            expected[~np.isfinite(expected)] = np.nan
            np.testing.assert_allclose(found, expected, rtol=1e-15)
        else:
            np.testing.assert_array_equal(found, expected)
    kept = json.loads((tmp_path / f"result{ending}.settings.json").read_text())
    assert json.dumps(kept["settings"]) == settings
    assert_array_equal(again, result.stiffness)


def test_batches_and_labels_come_back(tmp_path: Path) -> None:
    BATCH.save(tmp_path / "batch.npz")
    back = tvident.load(tmp_path / "batch.npz")
    assert_same(back, BATCH)
    assert_same(back[1], BATCH[1])
    with pytest.raises(ValueError, match=r"a Parquet file holds a single record; .*\.npz, or take one: result\[0\]"):
        BATCH.save(tmp_path / "batch.parquet")
    pd = pytest.importorskip("pandas")
    dates = pd.date_range("2024-01-01", periods=RIG.time.size, freq="1ms", tz="Asia/Tokyo", name="when")
    joints = xr.DataArray(ANGLES, {"time": RIG.time, "joint": ["a", "b"]}, ("joint", "time"), attrs={"lab": 1})
    for angle, torque in ((pd.Series(RIG.angle, dates), RIG.torque), (joints, TORQUES)):
        result = tvident.identify(angle, torque, sample_rate=1000, inertia=0.0123)
        result.save(tmp_path / "result.npz")
        back = tvident.load(tmp_path / "result.npz")
        pd.testing.assert_frame_equal(back.to_pandas(), result.to_pandas(), check_freq=False)
        xr.testing.assert_identical(back.to_xarray(), result.to_xarray())


def test_what_is_no_stored_result_is_refused(tmp_path: Path) -> None:
    RESULT.save(tmp_path / "result.csv")
    RIG.save(tmp_path / "rig.npz")
    RESULT.save(tmp_path / "cut.npz")
    whole = (tmp_path / "cut.npz").read_bytes()
    (tmp_path / "cut.npz").write_bytes(whole[: len(whole) // 2])
    for name, message in (
        ("result.csv", "a result comes back from .npz or .parquet; got '.csv'"),
        ("rig.npz", r"must hold a result as result\.save writes it"),
        ("cut.npz", "must be whole"),
        ("none.npz", "there is no such file"),
    ):
        with pytest.raises(recordings.FileError, match=message):
            tvident.load(tmp_path / name)


def test_a_value_whatever_the_kind() -> None:
    value, error, unit, kind, *_ = RESULT.value("inertia")
    assert (value, error) == RESULT.constants["inertia"]
    assert (unit, kind) == ("kg m^2", "constant")
    assert str(RESULT.value("damping_ratio")).split()[-1] != "1"
    changing = RESULT.value("stiffness")
    assert changing.kind == "windowed"
    assert changing.least < changing.value < changing.greatest
    assert changing.stderr == np.median(RESULT.stderr["stiffness"][RESULT.trusted])
    assert tvident.identify(RIG.angle, RIG.torque, sample_rate=1000, inertia=0.0123).value("inertia")[:2] == (0.0123, 0)
    assert BATCH.value("stiffness", 1) == BATCH[1].value("stiffness")
    with pytest.raises(ValueError, match="a value is of one record; got 2"):
        BATCH.value("stiffness")
    with pytest.raises(KeyError, match="there is no 'mass'; there are inertia, damping"):
        RESULT.value("mass")


@pytest.mark.parametrize(
    ("value", "error", "words"),
    [
        (0.0122954, 1.13e-5, "0.012295 ± 0.000011"),
        (12.3456, 0.0995, "12.35 ± 0.10"),
        (12.3456, 0.0996, "12.35 ± 0.10"),
        (1234.5, 67.8, "1234 ± 68"),
        (51234.5, 678, "51230 ± 680"),
        (1.5e-6, 2.3e-8, "(1.500 ± 0.023)e-6"),
        (3.21e8, 4.5e5, "(3.2100 ± 0.0045)e8"),
        (0.0, 1e-7, "(0.0 ± 1.0)e-7"),
        (0.5, 0.0, "0.5"),
        (np.nan, np.nan, "none"),
    ],
)
def test_digits_go_together(value: float, error: float, words: str) -> None:
    assert with_error(value, error) == words


def test_a_result_shows_its_numbers() -> None:
    line = repr(RESULT)
    assert "\n" not in line
    assert "3000 samples, 2.999 s" in line
    assert f"inertia {RESULT.value('inertia')}" in line
    assert "2 records of 3000 samples" in repr(BATCH)
    page = RESULT._repr_html_()
    assert f"<td>{RESULT.value('inertia')}</td>" in page
    assert page.count("<tr>") == page.count("</tr>") == 5
    assert BATCH._repr_html_().count("<table>") == 2
    assert "<script" not in page


def test_completion_shows_what_users_call_and_the_version() -> None:
    shown = [name for name in dir(tvident) if not name.startswith("__")]
    assert set(shown) == {*tvident.__all__, "baselines", "figures", "recordings"}
    assert tvident.__version__ == version("tvident")
    assert json.dumps(tvident.__version__)
    code = (
        "import sys, tvident; print('numpy' in sys.modules); print(len(dir(tvident))); from tvident import *; identify"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split()[0] == "False"


def test_every_result_is_one_line_of_words_in_a_console(tmp_path: Path) -> None:
    """Eight of them were all their arrays, over up to sixty lines."""
    rig = tvident.simulate_torsional_rig(duration=4.0)
    found = tvident.identify(rig.angle, rig.torque, sample_rate=1000)
    rows = np.stack([rig.angle, np.ones(rig.angle.size)], axis=1)
    rig.save(tmp_path / "x.csv")
    in_pieces = tvident.identify_file(
        tmp_path / "x.csv", tmp_path / "y.csv", angle="angle", torque="torque", sample_rate=1000
    )
    lines = {
        "<Recording of 4000 samples at 1000 Hz: angle, torque; true stiffness": rig,
        f"<Scan of {', '.join(found.scan().estimates)} by": found.scan(),
        f"<constant: {found.value('inertia')}>": found.value("inertia"),
        f"<windowed: {found.value('stiffness')}>": found.value("stiffness"),
        "<RollingRegression of 4000 rows, 4000 with a window, medians of params": tvident.rolling_least_squares(
            rows, rig.torque, 200
        ),
        "<ExperimentPlan of": tvident.plan_experiment(result=found),
        "<FileIdentification of 4000 samples, 4000 rows in": in_pieces,
        "<StreamedDerivatives at 3971 samples, time 0 to 3970>": tvident.LocalPolynomialStream(51).push(rig.angle),
        "<StreamedRegression at 3901 rows, row 0 to 3900>": tvident.RollingStream(200).push(rows, rig.torque),
    }
    for begin, one in lines.items():
        assert repr(one).startswith(begin)
        assert "\n" not in repr(one)
        assert len(repr(one)) < 300
    assert "inertia" in repr(in_pieces)
