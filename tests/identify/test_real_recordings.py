from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from calls import paper, plain_weak, weak
from parameters import long
from tvident import Status, recordings

Form = Callable[..., dict[str, Any]]
Array = npt.NDArray[np.float64]

# Published parameters of the electro-mechanical positioning system (Janot, Gautier, Brunot).
EMPS = {"inertia": (95.1089, 0.01), "damping": (203.5034, 0.03), "coulomb": (20.3935, 0.03)}


def recording(folder: Path, name: str) -> Path:
    path = folder / name
    if not path.exists():
        pytest.skip(f"the recording {name} is missing from {folder}")
    return path


# What the numbers are in windows of other lengths is tested below, without starting the command each time.
@pytest.mark.slow
@pytest.mark.parametrize("window", [*long(21), 201])
def test_the_positioning_system_from_the_command_line(folder_of_recordings: Path, tmp_path: Path, window: int) -> None:
    command = [
        str(Path(sys.executable).with_name("tvident")),
        "identify",
        str(recording(folder_of_recordings, "emps.mat")),
    ]
    command += [
        "--angle",
        "qm",
        "--torque",
        "vir",
        "--torque-scale",
        "gtau",
        "--sample-rate",
        "1000",
        "--method",
        "strong",
        "--quantisation",
        "0",
    ]
    command += [
        "--inertia",
        "constant",
        "--damping",
        "constant",
        "--stiffness",
        "0",
        "--term",
        "coulomb",
        "--term",
        "offset",
    ]
    command += ["--window-length", str(window), "-o", "result.csv", "--plot", "result.png"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    columns = recordings.read(tmp_path / "result.csv")
    for name, (published, tolerance) in EMPS.items():
        printed = re.search(rf"^{name} = (\S+) ±", done.stdout, re.MULTILINE)
        assert printed is not None
        assert float(printed[1]) == pytest.approx(published, rel=tolerance)
        assert recordings.channel(columns, name, "result.csv")[100] == pytest.approx(published, rel=tolerance)


@pytest.mark.parametrize("window", range(17, 33, 2))
def test_the_classic_angle_differentiated_twice(folder_of_recordings: Path, window: int) -> None:
    # A Savitzky-Golay filter tuned on this very truth reaches 4.2.
    channels = recordings.read(recording(folder_of_recordings, "pezzack.txt"))
    assert list(channels) == ["Time", "Raw", "Noisy", "Accel"]
    fit = tvident.fit_local_polynomials(channels["Raw"], window, sample_rate=49.75)
    interior = slice(window // 2, -(window // 2))
    error = (fit.derivatives[2] - channels["Accel"])[interior]
    assert np.sqrt(np.mean(error**2)) < 4.6


def carriage(folder: Path) -> tuple[Array, Array]:
    """Give position and force of the positioning system."""
    channels = recordings.read(recording(folder, "emps.mat"))
    return channels["qm"], channels["vir"] * float(channels["gtau"])


FRICTION: dict[str, Any] = {
    "stiffness": 0,
    "terms": [("offset", "constant"), ("coulomb", "constant")],
    "sample_rate": 1000,
}
OFFSET = (-3.1648, 0.01)


@pytest.mark.first(1)
@pytest.mark.parametrize("form", [weak, paper])
@pytest.mark.parametrize("window", [None, 21, *long(*range(41, 201, 20)), 201])
def test_the_positioning_system_in_both_forms(folder_of_recordings: Path, form: Form, window: int | None) -> None:
    position, force = carriage(folder_of_recordings)
    call = {} if window is None else {"window_length": window}
    found = tvident.identify(
        position, force, **form(inertia="constant", damping="constant", **call, **FRICTION)
    ).constants
    for name, (published, tolerance) in (EMPS | {"offset": OFFSET}).items():
        assert found[name][0] == pytest.approx(published, rel=tolerance), name


@pytest.mark.first(1)
@pytest.mark.parametrize("form", [weak, paper])
def test_the_mass_of_the_carriage_in_windows(folder_of_recordings: Path, form: Form) -> None:
    position, force = carriage(folder_of_recordings)
    result = tvident.identify(
        position, force, **form(inertia="windowed", damping="constant", regression_window="3 s", **FRICTION)
    )
    good = result.status & (Status.INVALID | Status.ILL_CONDITIONED | Status.RANK_DEFICIENT) == 0
    error = result.inertia[good] / EMPS["inertia"][0] - 1
    assert good.mean() >= 0.75
    assert np.sqrt(np.mean(error**2)) <= EMPS["inertia"][1]


@pytest.mark.parametrize("form", [plain_weak, paper])
def test_windows_within_one_stroke_do_not_tell_friction_from_offset(folder_of_recordings: Path, form: Form) -> None:
    position, force = carriage(folder_of_recordings)
    result = tvident.identify(
        position,
        force,
        sample_rate=1000,
        **form(window_length=51, regression_window="0.2 s", stiffness=0, terms=["coulomb", "offset"]),
    )
    velocity = tvident.fit_local_polynomials(position, 51, sample_rate=1000).derivatives[1]
    # Test functions and polynomials reach another 25 samples; near rest the sign of the velocity is noise.
    whole = np.lib.stride_tricks.sliding_window_view(np.sign(velocity), 251)
    one_stroke = np.flatnonzero(np.abs(whole.sum(axis=1)) == 251) + 125
    flagged = result.status[one_stroke] & (Status.INVALID | Status.ILL_CONDITIONED | Status.RANK_DEFICIENT) != 0
    assert one_stroke.size > 0.9 * position.size
    assert flagged.mean() > 0.99


def oscillator(folder: Path) -> tuple[Array, Array]:
    """Give output and input of the electronic oscillator, without their offsets."""
    channels = recordings.read(recording(folder, "silverbox_arrow.csv"))
    return channels["V2"] - channels["V2"].mean(), channels["V1"] - channels["V1"][:20].mean()


SILVERBOX = {
    "inertia": (5.375e-6, 0.015),
    "damping": (2.257e-4, 0.03),
    "stiffness": (0.9905, 0.01),
    "cubic": (3.92, 0.05),
}
SILVERBOX_RATE = 610.3515625
ALL_CONSTANT: dict[str, Any] = {"inertia": "constant", "damping": "constant", "stiffness": "constant"}


def test_the_oscillator_with_a_hardening_spring(folder_of_recordings: Path) -> None:
    angle, torque = oscillator(folder_of_recordings)
    result = tvident.identify(angle, torque, sample_rate=SILVERBOX_RATE, terms=["cubic"], **ALL_CONSTANT)
    for name, (reference, tolerance) in SILVERBOX.items():
        assert result.constants[name][0] == pytest.approx(reference, rel=tolerance), name


@pytest.mark.slow
def test_the_stiffness_of_the_oscillator_follows_its_amplitude(folder_of_recordings: Path) -> None:
    angle, torque = oscillator(folder_of_recordings)
    call: dict[str, Any] = {"inertia": "constant", "damping": "constant", "regression_window": "0.2 s"}
    result = tvident.identify(angle, torque, sample_rate=SILVERBOX_RATE, **weak(**call))
    window = np.ones(result.settings["regression_window"])
    secant = np.convolve(angle**4, window, "same") / np.convolve(angle**2, window, "same")
    secant = SILVERBOX["stiffness"][0] + SILVERBOX["cubic"][0] * secant
    valid = (result.status & (Status.INVALID | Status.EDGE)) == 0
    assert valid.mean() > 0.99
    assert np.var((result.stiffness - secant)[valid]) <= 0.10 * np.var(secant[valid])


@pytest.mark.long
def test_the_ankle_obeys_the_model_only_before_the_reflex(folder_of_recordings: Path) -> None:
    channels = recordings.read(recording(folder_of_recordings, "ankle_stationary.mat"))
    angle, torque = channels["angle"], -channels["torque"]
    velocity = np.abs(np.gradient(angle, 1e-3))
    moving = velocity > 0.3 * np.percentile(velocity, 99.5)
    onsets = [int(onset) for onset in np.flatnonzero(moving & ~np.roll(moving, 1))]
    first = [onset for before, onset in zip([-1000, *onsets], onsets, strict=False) if onset - before > 100]
    mask = np.zeros(angle.size, bool)
    for onset in first:
        mask[max(0, onset - 5) : onset + 40] = True
    call: dict[str, Any] = {"sample_rate": 1000, **weak(window_length=41)}
    result = tvident.identify(angle, torque, mask=mask, lag=1e-3, **call)
    assert "outside the mask the model fails" in result.summary()
    flags = result.status | result.record_status
    assert (flags[~mask] & Status.NOISE_MODEL != 0).all()
    assert (np.isnan(result.stiffness) == (result.status & Status.INVALID != 0)).all()
    # What others found in this record by trial, with an allowance of a tenth for the standard error.
    assert 0.9 * 62 < np.nanmedian(result.stiffness) < 1.1 * 159
    assert 0.9 * 0.016 < np.nanmedian(result.inertia) < 1.1 * 0.019
    # The torque comes late, and the record itself says so.
    late = tvident.identify(angle, torque, mask=mask, lag="auto", **call, **ALL_CONSTANT).settings
    assert 0.5e-3 < late["lag"] < 1.5e-3


@pytest.mark.slow
def test_what_disagrees_with_what_is_said_of_this_record(folder_of_recordings: Path) -> None:
    """Widths from 11 to 191 samples agree, on another damping than short windows of a stiffness that is none leave."""
    channels = recordings.read(recording(folder_of_recordings, "emps.mat"))
    force = channels["gtau"] * channels["vir"]
    result = tvident.identify(channels["qm"], force, sample_rate=1000, angle_unit="m", torque_unit="N")
    words, damping = result.summary(), result.value("damping")
    # It depends on where windows end beside the jumps of a stiffness that is none, by less than a fifth of its error.
    assert abs(damping.value - 193) < 0.2 * damping.stderr
    found = r"test functions of 11 to \d+ samples all find damping 37\d\.\d ± 4\.4 N s/m"
    assert re.search(rf"{found}, not the {damping.value:.0f} ± {damping.stderr:.0f} above", words)
    assert "none can be trusted" not in words


def test_a_servo_whose_stiffness_is_none_hears_so(folder_of_recordings: Path) -> None:
    """Where no other width determines anything, no line says that widths find different parameters, nor that 20 s are too short."""
    channels = recordings.read(recording(folder_of_recordings, "servo.mat"))
    angle, torque = channels["data.2"], channels["data.5"]
    alone = tvident.identify(angle, torque, sample_rate=1000, angle_unit="rad")
    assert alone.record_status & Status.SCALES_DISAGREE
    assert alone.advice[0].startswith("stiffness is none (")
    assert ": try stiffness=0; then 99.99" in alone.advice[0]
    assert "23 widths of the test function were tried; none of them determined the constants" in alone.reasons
    assert "different parameters" not in alone.summary()
    # The catalogue's numbers.
    found = tvident.identify(angle, torque, sample_rate=1000, stiffness=0)
    assert found.value("inertia").value == pytest.approx(1.2e-4, rel=0.2)
    assert found.value("damping").value == pytest.approx(7.03e-5, rel=0.05)
    assert "model explains 26 % of the torque, the rest is its noise" in found.summary().splitlines()[0]


def reflex(t: Array, angle: Array, velocity: Array, delay: float, corner: float) -> Array:
    """Return the stretch velocity, half-wave rectified and late, through a muscle of two poles."""
    del angle
    times = np.arange(0.0, 12 / corner, 1e-3)
    muscle = 1e-3 * corner**2 * times * np.exp(-corner * times)
    return np.convolve(np.maximum(np.interp(t - delay, t, velocity), 0.0), muscle)[: t.size]


@pytest.mark.long
def test_a_reflex_explains_more_of_the_ankle_where_the_test_function_is_the_same(folder_of_recordings: Path) -> None:
    channels = recordings.read(recording(folder_of_recordings, "ankle_stationary.mat"))
    term = tvident.Term("reflex", reflex, search={"delay": (0.02, 0.08), "corner": (8.0, 60.0)})

    def held_back(terms: list[Any], **method: Any) -> Any:
        angle, torque = channels["angle"][:20_000], -channels["torque"][:20_000]
        return tvident.identify(
            angle, torque, sample_rate=1000, lag=1e-3, terms=terms, **ALL_CONSTANT, **method
        ).held_back()

    alone, both = (held_back(terms) for terms in (["offset"], [term, "offset"]))
    # Each is predicted one test function of its own ahead, and says how long that is.
    assert both.simulated > alone.simulated
    assert both.ahead > 2 * alone.ahead
    both = held_back([term, "offset"], **weak(window_length=round(1000 * alone.ahead)))
    assert both.predicted > alone.predicted
