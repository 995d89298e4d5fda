from __future__ import annotations

from collections.abc import Iterator

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
