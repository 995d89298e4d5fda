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

    result = tvident.identify(recording.angle, recording.torque, sample_rate=1000)
    figure = figures.plot_identification(result, recording)
    assert [ax.get_ylabel() for ax in figure.axes] == ["kg·m²", "N·m·s/rad", "N·m/rad"]
    figure.savefig("/dev/null", format="png")


def test_known_parameters_are_not_drawn_and_terms_are() -> None:
    recording = tvident.simulate_torsional_rig(2.0)
    result = tvident.identify(recording.angle, recording.torque, sample_rate=1000, damping=0, terms=["offset"])
    assert [ax.get_title(loc="left") for ax in result.plot().axes] == ["Inertia $I$", "Stiffness $K$", "Offset"]


def test_a_batch_cannot_be_drawn() -> None:
    recording = tvident.simulate_torsional_rig(2.0)
    angle, torque = np.tile(recording.angle, (2, 1)), np.tile(recording.torque, (2, 1))
    result = tvident.identify(angle, torque, sample_rate=1000)
    with pytest.raises(ValueError, match="only a single record can be drawn"):
        result.plot()
