"""Settings of any result are accepted again, those of one that found nothing among them; what is no settings is refused."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from calls import paper, strong, weak

Array = npt.NDArray[np.float64]

N = 400
TIME = np.arange(N) / 1000
ANGLE = 0.2 * np.sin(2 * np.pi * 9 * TIME) + 0.1 * np.sin(2 * np.pi * 31 * TIME)
TORQUE = 15 * ANGLE + 0.01 * np.gradient(np.gradient(ANGLE, TIME), TIME)
NOTHING = np.full(N, np.nan)

METHODS: dict[str, dict[str, Any]] = {
    "auto": {},
    "weak": weak(),
    "weak, given": weak(window_length=51, exponent=5, regression_window=30),
    "paper": paper(window_length=51, regression_window=40),
    "strong": strong(window_length=51, regression_window=40),
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "records",
    [
        (NOTHING, NOTHING),
        (np.zeros(N), np.zeros(N)),
        (NOTHING, TORQUE),
        (np.stack([ANGLE, NOTHING]), np.stack([TORQUE, TORQUE])),
    ],
    ids=["missing", "resting", "no angle", "one of two"],
)
def test_settings_of_a_result_that_found_nothing(method: str, records: tuple[Any, Any]) -> None:
    result = tvident.identify(*records, sample_rate=1000, **METHODS[method])
    settings = json.loads(json.dumps(result.settings))
    again = tvident.identify(*records, sample_rate=1000, settings=settings)
    np.testing.assert_array_equal(again.stiffness, result.stiffness)
    np.testing.assert_array_equal(again.status, result.status)
    assert "samples" in result.summary()
    other = tvident.identify(ANGLE, TORQUE, sample_rate=1000, settings=settings) if result.stiffness.ndim == 1 else None
    assert other is None or np.isfinite(other.stiffness).any()


def test_what_was_given_stands_where_nothing_was_found() -> None:
    result = tvident.identify(NOTHING, NOTHING, sample_rate=1000, **METHODS["weak, given"])
    assert (result.settings["window_length"], result.settings["exponent"]) == (51, 5)
    assert result.settings["regression_window"] == 30
    chosen = tvident.identify(NOTHING, NOTHING, sample_rate=1000)
    assert chosen.settings["regression_window"] == "auto"


RESULT = tvident.identify(ANGLE, TORQUE, sample_rate=1000, lag="auto").settings


@pytest.mark.parametrize(
    "settings",
    [{}, 5, "settings", [], object(), RESULT | {"form": "other"}, RESULT | {"form": []}, RESULT | {"kinds": {}}]
    + [
        RESULT | {"known": 3},
        RESULT | {"chosen": None},
        RESULT | {"lag_samples": 3},
        RESULT | {"terms": [1]},
        RESULT | {"own_terms": 1},
        np.float64(3),
        np.zeros((2, 2)),
        RESULT | {"width_from": 5},
        RESULT | {"windows_near": -1},
        RESULT | {"windows_near": 10**30},
        RESULT | {"windows_near": [1.5]},
        RESULT | {"shown_noise": 0},
        RESULT | {"needed": True},
        RESULT | {"needed": {"cubic": "x"}},
    ]
    + [
        {name: value for name, value in RESULT.items() if name != left}
        for left in ("form", "method", "exponent", "lag", "terms")
    ],
)
def test_what_is_no_settings_is_refused(settings: Any) -> None:
    with pytest.raises(TypeError, match=r"settings must be those of an earlier result; got .*; pass result.settings"):
        tvident.identify(ANGLE, TORQUE, sample_rate=1000, settings=settings)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"chosen": [5]}, r"got \[5\] as 'chosen'"),
        ({"known": None}, "got None as 'known'"),
        ({"form": ["weak"]}, r"got \['weak'\] as 'form'"),
        ({"windows_near": -1}, "got -1 as 'windows_near'"),
        ({"inner": {"cubic": "x"}}, r"got \{'cubic': 'x'\} as 'inner'"),
    ],
)
def test_an_entry_that_was_spoiled_is_named(changed: dict[str, Any], words: str) -> None:
    """The whole settings were shown."""
    with pytest.raises(TypeError, match=f"settings must be those of an earlier result; {words}; pass result.settings"):
        tvident.identify(np.ones(500), np.ones(500), sample_rate=1000, settings=RESULT | changed)


def test_an_entry_that_is_missing_is_named() -> None:
    settings = {name: value for name, value in RESULT.items() if name != "exponent"}
    with pytest.raises(TypeError, match=r"got no .exponent.; pass result\.settings as they are"):
        tvident.identify(np.ones(500), np.ones(500), sample_rate=1000, settings=settings)


@pytest.mark.parametrize(
    "changed",
    [
        {"window_length": -3},
        {"exponent": "many"},
        {"quantisation": "x"},
        {"lag": [0.0, 1.0]},
        {"kinds": RESULT["kinds"] | {"inertia": "other"}},
        {"lag_samples": ["x"]},
        {"terms": [["other", "constant"]]},
    ],
)
def test_settings_that_were_changed_are_checked_as_arguments_are(changed: Any) -> None:
    with pytest.raises((ValueError, TypeError), match=r" must .*; got .*; "):
        tvident.identify(ANGLE, TORQUE, sample_rate=1000, settings=RESULT | changed)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"window_lenght": 31}, r"got 'window_lenght'; did you mean 'window_length'\?"),
        ({"regression": 31}, r"got 'regression'; did you mean 'regression_window'\?"),
        ({"max_order": 7}, r"got 'max_order'; it belongs to the strong form"),
        ({"comment": "second trial"}, r"got 'comment'; "),
        (
            {"kinds": RESULT["kinds"] | {"inertai": "constant"}},
            r"settings kinds .* got 'inertai'; did you mean 'inertia'\?",
        ),
        ({"known": {"stifness": 3.0}}, r"settings known .* got 'stifness'; did you mean 'stiffness'\?"),
    ],
)
def test_names_that_no_result_has_are_refused(more: dict[str, Any], words: str) -> None:
    settings = RESULT | more
    with pytest.raises(TypeError, match=words):
        tvident.identify(ANGLE, TORQUE, sample_rate=1000, settings=settings)
    with pytest.raises(TypeError, match=words):
        tvident.IdentificationStream(sample_rate=1000, settings=settings)


def _rig(seed: int, seconds: float = 20.0) -> tvident.Recording:
    return tvident.simulate_torsional_rig(seconds, seed=seed, torque_snr_db=40.0, angle_noise=1e-3)


def _of_two_that_change(seed: int) -> tuple[Array, Array]:
    """Return a motion whose inertia and damping change, the damping more plainly."""
    generator, time = np.random.default_rng(seed), np.arange(20_000) / 1000
    frequencies, phases = np.linspace(0.5, 12, 47), generator.uniform(0, 2 * np.pi, 47)
    waves = 0.05 / (1 + (frequencies / 4) ** 2) * np.exp(1j * (2 * np.pi * frequencies * time[:, np.newaxis] + phases))
    angle, velocity, acceleration = (
        (waves * (2j * np.pi * frequencies) ** power).sum(axis=1).real for power in range(3)
    )
    inertia, damping = 0.0123 * (1 + 0.3 * np.sin(time)), 0.05 * (1 + 0.5 * time / 20)
    torque = inertia * acceleration + damping * velocity + 13.0 * angle
    noise = generator.standard_normal((2, time.size))
    return angle + 1e-3 * np.std(angle) * noise[0], torque + 1e-2 * np.std(torque) * noise[1]


def _records() -> dict[str, tuple[Array, Array, dict[str, Any]]]:
    slider, noisy = _rig(0), tvident.simulate_torsional_rig(8.0, seed=3, angle_noise=3e-2)
    held = np.repeat(slider.angle[::5], 5)
    return {
        "stiffness wrongly constant": (slider.angle, slider.torque, {"stiffness": "constant"}),
        "and late": (slider.angle[3:], slider.torque[:-3], {"stiffness": "constant", "lag": "auto"}),
        "late": (slider.angle[3:], slider.torque[:-3], {"lag": "auto"}),
        "torque noisier than its quietest band": (slider.angle, slider.torque, {}),
        "held": (held, slider.torque, {}),
        "short and noisy": (noisy.angle, noisy.torque, {}),
        "two that change": (*_of_two_that_change(2), {}),
        "two that change beside a constant": (*_of_two_that_change(2), {"stiffness": "constant"}),
    }


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize("name", _records())
def test_a_repeated_call_finds_and_says_the_same(name: str) -> None:
    angle, torque, asked = _records()[name]
    first = tvident.identify(angle, torque, sample_rate=1000, **asked)
    again = tvident.identify(angle, torque, sample_rate=1000, settings=json.loads(json.dumps(first.settings)))
    assert again.record_status == first.record_status
    for column, values in first.columns().items():
        np.testing.assert_array_equal(again.columns()[column], values, err_msg=column)
    assert again.constants == first.constants
    assert again.advice == first.advice
    assert again.settings == first.settings
    if name.startswith("stiffness"):
        assert first.record_status & tvident.Status.SCALES_DISAGREE


@pytest.mark.slow
def test_a_kind_that_is_given_beside_settings_is_not_decided_again() -> None:
    angle, torque = _of_two_that_change(2)
    settings = tvident.identify(angle, torque, sample_rate=1000).settings
    # In which order they are found to change, the noise decides.
    assert sorted(settings["tested"]) == ["damping", "inertia", "offset"]
    again = tvident.identify(angle, torque, sample_rate=1000, settings=settings, damping="constant")
    assert again.settings["tested"] == [one for one in settings["tested"] if one != "damping"]
    assert again.settings["kinds"]["damping"] == "constant"


@pytest.mark.slow
def test_settings_of_another_record_leave_its_lag_to_be_suspected() -> None:
    record = _rig(1)
    settings = tvident.identify(record.angle[3:], record.torque[:-3], sample_rate=1000, lag="auto").settings
    other = tvident.identify(record.angle[6:], record.torque[:-6], sample_rate=1000, settings=settings)
    assert other.record_status & tvident.Status.LAG_SUSPECTED


@pytest.mark.parametrize("pattern", ["constant", "slider"])
def test_a_stiffness_that_was_automatic_and_changes_stays_so(pattern: Any) -> None:
    """It was set free beside its own windows, and nothing was identified; nor by `held_back()`, which gives settings back."""
    rig = tvident.simulate_torsional_rig(12.0, pattern=pattern)
    first = tvident.identify(rig.angle, rig.torque, sample_rate=rig.sample_rate, stiffness="auto")
    again = tvident.identify(rig.angle, rig.torque, sample_rate=rig.sample_rate, settings=first.settings)
    assert again.trusted.mean() > 0.9
    np.testing.assert_allclose(again.stiffness, first.stiffness, rtol=1e-6)
    assert again.record_status == first.record_status
    assert first.held_back().predicted > 95
