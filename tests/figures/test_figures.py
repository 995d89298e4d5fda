from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib import pyplot as plt

import tvident
from tvident import figures

mpl.use("agg")


@pytest.fixture(autouse=True)
def close_figures() -> Iterator[None]:
    yield
    plt.close("all")


def test_the_papers_figures_on_the_default_recording() -> None:
    recording = tvident.simulate_torsional_rig()
    figure = figures.plot_recording(recording)
    assert [ax.get_title(loc="left") for ax in figure.axes] == ["Slider position", "Torque", "Angle"]

    # Figures 4 and 5: the clean window takes a high order, the noisy one a low one.
    middle = recording.time.size // 2
    noise = 0.05 * recording.angle.std() * np.random.default_rng(1).standard_normal(recording.angle.size)
    for y, low, high in ((recording.angle, 12, 14), (recording.angle + noise, 6, 8)):
        order = int(tvident.fit_local_polynomials(y, 201, sample_rate=1000).order[middle])
        assert low <= order <= high
        figure = figures.plot_window(y, middle, 201, sample_rate=1000)
        assert f"n = {order}" in [text.get_text() for text in figure.axes[1].texts]

    result = tvident.identify(recording.angle, recording.torque, sample_rate=1000, method="paper")
    figure = figures.plot_identification(result, recording)
    assert [ax.get_ylabel() for ax in figure.axes] == ["kg·m²", "N·m·s/rad", "N·m/rad"]
    figure.savefig("/dev/null", format="png")


def test_known_parameters_are_not_drawn_and_terms_are() -> None:
    recording = tvident.simulate_torsional_rig(2.0)
    result = tvident.identify(
        recording.angle, recording.torque, sample_rate=1000, method="paper", damping=0, terms=["offset"]
    )
    assert [ax.get_title(loc="left") for ax in result.plot().axes] == ["Inertia $I$", "Stiffness $K$", "Offset"]


def test_a_batch_cannot_be_drawn() -> None:
    recording = tvident.simulate_torsional_rig(2.0)
    angle, torque = np.tile(recording.angle, (2, 1)), np.tile(recording.torque, (2, 1))
    result = tvident.identify(angle, torque, sample_rate=1000, method="paper")
    with pytest.raises(ValueError, match="only a single record can be drawn"):
        result.plot()


def test_constants_are_lines_with_their_value_and_flagged_stretches_are_shaded() -> None:
    recording = tvident.simulate_torsional_rig(8.0)
    angle = recording.angle.copy()
    angle[3000:3400] = np.nan
    result = tvident.identify(angle, recording.torque, sample_rate=1000)
    inertia, damping, stiffness, offset = figures.plot_identification(result, recording).axes
    value, error = result.constants["inertia"]
    assert inertia.get_title(loc="left") == f"Inertia $I$: {value:.5g} ± {error:.2g} kg·m²"
    # The band and the truth are both in the frame.
    low, high = inertia.get_ylim()
    assert low < min(value - 2 * error, recording.inertia[0])
    assert high > max(value + 2 * error, recording.inertia[0])
    assert stiffness.get_title(loc="left") == "Stiffness $K$"
    for ax in (inertia, damping, stiffness, offset):
        labels = [str(patch.get_label()) for patch in ax.patches]
        assert "flagged" in labels
    legend = inertia.get_legend()
    assert legend is not None
    assert "flagged" in [text.get_text() for text in legend.get_texts()]


def test_what_holds_for_the_whole_record_is_written_below() -> None:
    recording = tvident.simulate_torsional_rig(8.0)
    late = tvident.identify(recording.angle[2:], recording.torque[:-2], sample_rate=1000)
    axes = late.plot().axes
    assert "LAG_SUSPECTED" in axes[-1].get_xlabel()
    assert not axes[0].patches


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        ({"window_length": 32}, ValueError, "window_length must be odd"),
        ({"window_length": 3}, ValueError, "window_length must be at least 5 samples; got 3"),
        ({"window_length": 1001}, ValueError, "less than or equal to the length of the record; got 1001"),
        ({"window_length": 10**400}, ValueError, "window_length must be less than 2.63"),
        ({"window_length": "x"}, ValueError, "window_length must be samples or a duration"),
        ({"i": 1.5}, TypeError, "i must be a whole number; got 1.5"),
        ({"i": None}, TypeError, "i must be a whole number; got None"),
        ({"y": [[1.0, 2.0], [3.0, 4.0]]}, ValueError, "y must be a single record"),
        ({"y": ["a", "b"]}, TypeError, "y must hold numbers; got text"),
        ({"sample_rate": 0}, ValueError, "sample_rate must be positive"),
    ],
)
def test_a_window_that_cannot_be_drawn_is_refused(call: dict[str, Any], error: type[Exception], message: str) -> None:
    given: dict[str, Any] = {"y": np.sin(np.arange(300) / 20), "i": 100, "window_length": 31} | call
    with pytest.raises(error, match=message):
        figures.plot_window(**given)


def test_what_is_masked_is_not_in_the_window() -> None:
    y: Any = np.ma.masked_array(np.sin(np.arange(300) / 20), mask=np.arange(300) == 100)
    spoilt: Any = np.ma.masked_array(np.where(np.arange(300) == 100, 99.0, y.data), mask=y.mask)
    tops = [figures.plot_window(samples, 150, 31).axes[0].get_ylim() for samples in (y, spoilt)]
    assert tops[0] == tops[1]
    beside = figures.plot_window(spoilt, 100, 31).axes[0].get_ylim()
    assert beside[1] < 2
