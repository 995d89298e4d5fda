"""Records of different lengths: each as on its own, and what they share from all of them, with errors that hold."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from tvident import IdentifiedRecords, Status
from tvident._identify.records import names_shared

Array = npt.NDArray[np.float64]

RATE = 500.0
INERTIA = 0.012
SYSTEMS = [(10.0, 0.05, 700), (15.0, 0.1, 900), (20.0, 0.05, 1100), (30.0, 0.2, 800)]
"""Stiffness, damping and samples of each record."""


def record(generator: np.random.Generator, stiffness: float, damping: float, samples: int) -> tuple[Array, Array]:
    """Return an angle of six sines and the torque of a system with this inertia, both with noise."""
    t = np.arange(samples) / RATE
    omega, phase = 2 * np.pi * generator.uniform(1, 9, (6, 1)), generator.uniform(0, 2 * np.pi, (6, 1))
    size = generator.uniform(0.05, 0.15, (6, 1))
    angle = (size * np.sin(omega * t + phase)).sum(axis=0)
    velocity = (size * omega * np.cos(omega * t + phase)).sum(axis=0)
    acceleration = -(size * omega**2 * np.sin(omega * t + phase)).sum(axis=0)
    torque = INERTIA * acceleration + damping * velocity + stiffness * angle
    return angle + 3e-4 * generator.standard_normal(samples), torque + 0.1 * generator.standard_normal(samples)


def records(seed: int) -> tuple[list[Array], list[Array]]:
    generator = np.random.default_rng(seed)
    made = [record(generator, *system) for system in SYSTEMS]
    return [angle for angle, _ in made], [torque for _, torque in made]


def identified(angles: Any, torques: Any, **options: Any) -> IdentifiedRecords:
    return cast("IdentifiedRecords", tvident.identify(angles, torques, **{"sample_rate": RATE, **options}))


def test_a_list_gives_what_single_calls_give() -> None:
    angles, torques = records(0)
    masks = [np.arange(angle.size) > 100 for angle in angles]
    done: list[tuple[int, int]] = []
    found = identified(angles, torques, mask=masks, step=3, progress=lambda *of: done.append(of))
    assert isinstance(found, IdentifiedRecords)
    assert done[-1] == (3500, 3500)
    assert found.constants == {}
    for one, angle, torque, mask in zip(found, angles, torques, masks, strict=True):
        alone = tvident.identify(angle, torque, sample_rate=RATE, mask=mask, step=3)
        for name in ("inertia", "damping", "stiffness", "status"):
            np.testing.assert_array_equal(getattr(one, name), getattr(alone, name))
        np.testing.assert_array_equal(one.stderr["stiffness"], alone.stderr["stiffness"])
        assert one.settings == alone.settings
    assert "record 3" in found.summary()
    assert len(found[1:]) == 3
    rates = identified(angles, torques, sample_rate=[RATE, RATE, 2 * RATE, RATE])
    np.testing.assert_array_equal(rates[1].stiffness, identified(angles, torques)[1].stiffness)
    assert rates[2].time[1] == 1 / (2 * RATE)


def test_records_of_one_length_stay_a_batch() -> None:
    angles, torques = (np.stack([one[:700] for one in channel]) for channel in records(1))
    batch = tvident.identify(list(angles), list(torques), sample_rate=RATE)
    assert batch.stiffness.shape == (4, 700)
    shared = identified(angles, torques, share="inertia")
    assert [one.stiffness.shape for one in shared] == [(700,)] * 4
    assert (
        shared.constants["inertia"] == identified(list(angles), list(torques), share=["inertia"]).constants["inertia"]
    )


@pytest.mark.first(1)
@pytest.mark.parametrize("stiffness", ["constant", "windowed"])
def test_what_is_shared_and_the_rest_have_errors_that_hold(stiffness: str) -> None:
    form = tvident.WeakForm(
        window_length=61, exponent=6, regression_window="auto" if stiffness == "constant" else 300, averaging=None
    )
    over: dict[str, list[float]] = {"inertia": [], "damping": [], "stiffness": [], "natural_frequency": []}
    smaller = []
    for seed in range(15):
        angles, torques = records(seed)
        options = {"method": form, "stiffness": stiffness, "damping": "constant", "terms": ()}
        found = identified(angles, torques, share=("inertia",), **options)
        value, error = found.constants["inertia"]
        over["inertia"].append((value - INERTIA) / error)
        for one, (spring, damper, _) in zip(found, SYSTEMS, strict=True):
            assert one.constants["inertia"] == (value, error)
            middle = one.time.size // 2
            truth = {"stiffness": spring, "damping": damper, "natural_frequency": np.sqrt(spring / INERTIA) / 2 / np.pi}
            for name, expected in truth.items():
                over[name].append((getattr(one, name)[middle] - expected) / one.stderr[name][middle])
        if seed == 0:
            alone = identified(angles, torques, inertia="constant", **options)
            smaller = [error / one.constants["inertia"][1] for one in alone]
            assert not found.record_status & Status.KIND_CONTRADICTED
    assert max(smaller) < 1
    # Mean squares of 15 and 60 normal numbers scatter by 0.37 and 0.18: within four times that.
    assert np.mean(np.square(over.pop("inertia"))) < 1 + 4 * 0.37
    for name, scores in over.items():
        assert 1 - 4 * 0.18 < np.mean(np.square(scores)) < 1 + 4 * 0.18, name


def test_records_that_differ_in_what_they_share_are_flagged() -> None:
    angles, torques = records(2)
    found = identified(angles, [*torques[:3], 1.3 * torques[3]], share=("inertia",))
    assert found.record_status & Status.KIND_CONTRADICTED
    assert all(one.record_status & Status.KIND_CONTRADICTED for one in found)
    assert found.advice[0].startswith("records differ in inertia by more than their errors explain")
    still = identified([np.zeros(700), np.zeros(800)], [np.zeros(700), np.zeros(800)], share=("inertia",))
    assert np.isnan(still.constants["inertia"]).all()
    assert still.advice[0].startswith("no record determines inertia")


def test_names_of_what_is_shared_may_come_in_any_row() -> None:
    names = ("inertia", "damping")
    for share in (list(names), np.array(names), dict.fromkeys(names), iter(names)):
        assert names_shared(share) == names  # type: ignore[arg-type]
    assert names_shared("inertia") == ("inertia",)


def test_several_parameters_are_shared_at_once() -> None:
    generator = np.random.default_rng(3)
    made = [record(generator, stiffness, 0.1, samples) for stiffness, _, samples in SYSTEMS]
    angles, torques = [angle for angle, _ in made], [torque for _, torque in made]
    found = identified(angles, torques, share=("inertia", "damping"), terms=())
    for name, truth in (("inertia", INERTIA), ("damping", 0.1)):
        value, error = found.constants[name]
        assert abs(value - truth) < 4 * error
        np.testing.assert_array_equal(getattr(found[2], name), value)
        np.testing.assert_allclose(found[2].stderr[name], error, rtol=1e-9)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ({"share": ("mass",)}, "share must be 'inertia', 'damping' or 'stiffness'; got 'mass'"),
        ({"share": ("inertia",), "inertia": 0.1}, "unknown and constant in every record; got 'inertia', which is 0.1"),
        ({"share": ("stiffness",), "stiffness": "windowed"}, "got 'stiffness', which is 'windowed'; let stiffness be"),
        ({"torque": [np.ones(700)] * 3}, "as many records as the others; got 3 of torque for 4"),
        ({"torque": np.ones(700)}, "as many records as the others; got 1 of torque for 4"),
        ({"angle": np.ones(700), "torque": np.ones(700), "share": ("inertia",)}, "several records to share among"),
        ({"sample_rate": [RATE, RATE]}, "as many records as the others; got 2 of sample_rate for 4"),
    ],
)
def test_records_that_do_not_go_together_are_refused(call: dict[str, Any], message: str) -> None:
    angles, torques = records(4)
    with pytest.raises(ValueError, match=message):
        tvident.identify(**{"angle": angles, "torque": torques, "sample_rate": RATE, **call})


def test_records_within_records_are_refused_in_words() -> None:
    """They ended in messages of NumPy: "inhomogeneous shape", "diag requires an array of at least two dimensions"."""
    rig = tvident.simulate_torsional_rig(duration=1.0)
    angle, torque = rig.angle, rig.torque
    options: dict[str, Any] = {"sample_rate": 1000, "share": "inertia", "stiffness": "constant"}
    ragged: list[Any] = [[one, one[:700]] for one in (angle, torque)]
    within: Any = [1.0, [2.0]]
    nothing: Any = None
    with pytest.raises(ValueError, match=r"angle\[0\] must be a regular array .*; .* one list of them"):
        tvident.identify(*([one, one] for one in ragged), **options)
    with pytest.raises(ValueError, match=r"torque\[1\] must be a regular array of numbers; got \[1.0, \[2.0\]\]; "):
        tvident.identify([angle, angle[:700]], [torque, within], sample_rate=1000)
    for nested in (np.stack([angle, angle]), [angle.tolist()]):
        with pytest.raises(
            ValueError, match=r"must have one dimension .* got angle\[1\] of shape \([12], 1000\); put its"
        ):
            tvident.identify([angle, nested], [torque, torque], **options)
    with pytest.raises(ValueError, match="share must be 'inertia', 'damping' or 'stiffness'; got 5"):
        tvident.identify([angle, angle], [torque, torque], **{**options, "share": 5})
    with pytest.raises(TypeError, match="torque must hold numbers"):
        tvident.identify([angle, angle], nothing, **options)


def test_an_error_of_one_record_names_it_and_one_of_progress_does_not() -> None:
    rigs = [tvident.simulate_torsional_rig(duration=seconds) for seconds in (2.0, 1.0)]
    angles, torques = [rig.angle for rig in rigs], [rig.torque for rig in rigs]
    with pytest.raises(ValueError, match=r"must have the same shape; .* \(record 1 of 2\)"):
        tvident.identify(angles, [torques[0], torques[1][:-1]], sample_rate=1000)

    def progress(*_: int) -> None:
        raise ValueError("mine")

    with pytest.raises(ValueError, match=r"^mine$"):
        tvident.identify(angles, torques, sample_rate=1000, progress=progress)
    found = tvident.identify(angles, torques, sample_rate=1000)
    with pytest.raises(IndexError, match="one of the 2 records, or a slice; got 2; count from 0"):
        found[2]
    with pytest.raises(TypeError, match="one of the 2 records, or a slice; got 'x'"):
        cast("Any", found)["x"]


def of_different_lengths() -> tuple[list[Array], list[Array]]:
    rigs = [tvident.simulate_torsional_rig(duration=seconds, seed=seed) for seed, seconds in enumerate((2.0, 3.0, 2.5))]
    return [rig.angle for rig in rigs], [rig.torque for rig in rigs]


def test_a_lag_may_be_one_a_record() -> None:
    """It was refused with words of "1 records"."""
    angles, torques = of_different_lengths()
    found = tvident.identify(angles, torques, sample_rate=1000, lag=[0.0, "1 ms", 0.0])
    assert [one.settings["lag"] for one in found] == [0.0, 0.001, 0.0]
    again = tvident.identify(angles, torques, sample_rate=1000, lag=np.array([0.0, 1e-3, 0.0]))
    assert np.array_equal(found[1].stiffness, again[1].stiffness)
    with pytest.raises(ValueError, match="got 2 of lag for 3; give one a record"):
        tvident.identify(angles, torques, sample_rate=1000, lag=[0.0, 0.0])
    batch = tvident.identify([angles[0]] * 2, [torques[0]] * 2, sample_rate=1000, lag=np.array([0.0, 1e-3]))
    assert batch.settings["lag"] == [0.0, 0.001]
    with pytest.raises(ValueError, match="'auto' for all records of one length, or for none"):
        tvident.identify([angles[0]] * 2, [torques[0]] * 2, sample_rate=1000, lag=["auto", 0.0])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ({"sample_rate": 0}, "sample_rate must be positive and finite; got 0; pass a number above zero"),
        ({"stiffness": "konst"}, "stiffness must be .*; got 'konst'; use one of these"),
        ({"terms": ["coulom"]}, "a term must be .*; got 'coulom'; use one of these"),
        ({"lag": "Auto"}, "lag must be 'auto', seconds, or a time such as '2 ms'; got 'Auto'; units are .*"),
        ({"step": 0}, "step must be at least 1; got 0; pass 1 or more"),
    ],
)
def test_what_all_records_have_in_common_is_wrong_for_none_of_them(call: dict[str, Any], message: str) -> None:
    """Errors ended with "(record 0 of 3)"."""
    angles, torques = of_different_lengths()
    with pytest.raises(ValueError, match=f"^{message}$"):
        tvident.identify(angles, torques, **{"sample_rate": 1000, **call})
    # Others are longer.
    with pytest.raises(ValueError, match=r"lag must be shorter than the record of 2 s; .* \(record 0 of 3\)"):
        tvident.identify(angles, torques, sample_rate=1000, lag=2.5)


def test_weights_and_masks_of_some_records_leave_the_others_as_they_are() -> None:
    """They ended in a message of NumPy: "inhomogeneous shape"."""
    angles, torques = of_different_lengths()
    weights = np.where(np.arange(3000) % 2, 1.0, 2.0)
    found = tvident.identify(angles, torques, sample_rate=1000, weights=[None, weights, None])
    ones = [np.ones(len(one)) for one in angles]
    whole = tvident.identify(angles, torques, sample_rate=1000, weights=[ones[0], weights, ones[2]])
    assert np.array_equal(found[1].stiffness, whole[1].stiffness)
    alike = tvident.identify([angles[0]] * 2, [torques[0]] * 2, sample_rate=1000, mask=[None, np.arange(2000) > 500])
    assert np.array_equal(alike[0].stiffness, tvident.identify(angles[0], torques[0], sample_rate=1000).stiffness)
    none = tvident.identify(angles, torques, sample_rate=1000, weights=[None] * 3, mask=[None] * 3)
    assert np.array_equal(none[1].stiffness, tvident.identify(angles[1], torques[1], sample_rate=1000).stiffness)
    with pytest.raises((TypeError, ValueError), match=r"\(record 1 of 2\)"):
        tvident.identify([angles[0], None], [torques[0]] * 2, sample_rate=1000)  # type: ignore[list-item]


def test_a_record_that_says_nothing_of_what_is_shared_is_named() -> None:
    angles, torques = of_different_lengths()
    angles[1] = np.full(3000, np.nan)
    found = tvident.identify(angles, torques, sample_rate=1000, share="inertia")
    assert "record 1 says nothing of inertia, which is of the others alone" in found.advice[0]
    assert found.advice[0] in found.summary()
    assert not tvident.identify(angles[::2], torques[::2], sample_rate=1000, share="inertia").advice


def test_records_of_a_list_are_one_table() -> None:
    angles, torques = of_different_lengths()
    found = tvident.identify(angles, torques, sample_rate=1000)
    frame = found.to_pandas()
    assert list(frame.index.names) == ["record", "time"]
    assert np.array_equal(frame.loc[1, "stiffness"].to_numpy(), found[1].stiffness)
    assert frame.attrs["units"]["stiffness"] == "N m/rad"
    table = found.to_polars()
    assert table.columns[:2] == ["record", "time"]
    assert np.array_equal(table["record"].to_numpy(), np.repeat(np.arange(3), [len(one) for one in angles]))
    assert np.array_equal(table["stiffness"].to_numpy(), np.concatenate([one.stiffness for one in found]))
    records: Any = found
    with pytest.raises(
        AttributeError, match=r"scan must be asked of one record; got a list of 3; write result\[0\]\.scan"
    ):
        records.scan()
    with pytest.raises(AttributeError, match="has no attribute 'foo'"):
        _ = records.foo
    assert found[3:].to_pandas().empty


@pytest.mark.parametrize("share", [(), ("inertia", "damping")])
def test_a_list_comes_back_from_one_file(share: tuple[str, ...], tmp_path: Path) -> None:
    angles, torques = of_different_lengths()
    angles[2] = np.full(len(angles[2]), np.nan)
    found = tvident.identify(angles, torques, sample_rate=1000, share=share)
    found.save(tmp_path / "records.npz")
    stored = tvident.load(tmp_path / "records.npz")
    assert isinstance(stored, IdentifiedRecords)
    assert (repr(stored), stored.constants, stored.advice) == (repr(found), found.constants, found.advice)
    assert stored.record_status == found.record_status
    for one, other in zip(stored, found, strict=True):
        assert np.array_equal(one.stiffness, other.stiffness, equal_nan=True)
        assert np.array_equal(one.stderr["inertia"], other.stderr["inertia"], equal_nan=True)
        assert (one.settings, one.units) == (other.settings, other.units)
    with pytest.raises(
        ValueError, match=r"a file that ends in \.npz; got 'records\.csv'; rename it, or save one of them"
    ):
        found.save(tmp_path / "records.csv")


@pytest.mark.parametrize("terms", [None, ["offset", "coulomb"]])
def test_terms_keep_their_kinds_beside_what_is_shared(terms: Any) -> None:
    """Where the rest was windowed, as beside a shared inertia and damping, so were the terms: errors of the stiffness grew by a third."""
    angles, torques = of_different_lengths()
    found = tvident.identify(angles, torques, sample_rate=1000, share=("inertia", "damping"), terms=terms)
    for one in found:
        assert {kind for _, kind in one.settings["terms"]} == {"constant"}
        assert one.settings["kinds"]["stiffness"] == "windowed"
