"""Lines that stand in one panel are distinguished by colour-blind eyes too: in pictures as they are drawn, and in the page of reports.

Colour blindness is simulated as in G. M. Machado, M. M. Oliveira, L. A. F. Fernandes: A physiologically-based model for simulation of color
vision deficiency, IEEE Transactions on Visualization and Computer Graphics 15(6), 2009, with the matrices of severity 1.0 for linear RGB.
Distances are Euclidean in CIELAB (CIE 1976), where 2.3 is just noticed.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
import pytest
from matplotlib import pyplot as plt
from matplotlib.colors import to_hex, to_rgb, to_rgba

import tvident
from tvident import figures

mpl.use("agg")

Array = npt.NDArray[np.float64]

EYES = {
    "all cones": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "tritanopia": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}

APART = 20.0
"""Of lines in one panel: nine times what is just noticed."""

BAND = 0.5
"""Less opaque is a band, or shades what is flagged."""

VISIBLE = 30.0
"""Of a line and what it is drawn on."""


def linear(colour: str) -> Array:
    """Give the light of a colour of sRGB (IEC 61966-2-1)."""
    values = np.array(to_rgb(colour))
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def lab(light: Array) -> Array:
    """Give CIELAB of linear RGB, white D65."""
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    ratio = to_xyz @ np.clip(light, 0, 1) / (to_xyz @ np.ones(3))
    root = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * root[1] - 16, 500 * (root[0] - root[1]), 200 * (root[1] - root[2])])


def distance(one: str, other: str, eyes: str) -> float:
    """Give how far apart two colours are to some eyes."""
    seen = [lab(EYES[eyes] @ linear(colour)) for colour in (one, other)]
    return float(np.linalg.norm(seen[0] - seen[1]))


def test_the_simulation_is_that_of_the_paper() -> None:
    # Grey stays grey, red and green of one lightness become alike, and white is 100 light.
    for eyes, matrix in EYES.items():
        np.testing.assert_allclose(matrix.sum(axis=1), 1, atol=2e-6)
        assert distance("#808080", to_hex((0.502, 0.502, 0.502)), eyes) < 0.1
    np.testing.assert_allclose(lab(np.ones(3)), [100, 0, 0], atol=0.05)
    assert distance("#c00000", "#606000", "all cones") > 60
    assert distance("#c00000", "#606000", "deuteranopia") < 0.5 * distance("#c00000", "#606000", "all cones")


@pytest.fixture(scope="module")
def pictures() -> Iterator[dict[str, Any]]:
    """Give every picture, drawn."""
    rig = tvident.simulate_torsional_rig(6.0)
    angle = rig.angle.copy()
    angle[3000:3300] = np.nan
    result = tvident.identify(angle, rig.torque, sample_rate=1000)
    paper = tvident.identify(rig.angle, rig.torque, sample_rate=1000, method="paper")
    pulses = tvident.identify(
        rig.angle, rig.torque, sample_rate=1000, stiffness=tvident.Expansion("bspline", of=rig.slider_position)
    )
    fit = tvident.fit_local_polynomials(rig.angle, 101, sample_rate=1000)
    yield {
        "parameters": result.plot(truth=rig),
        "torque": result.plot("torque"),
        "status": result.plot("status"),
        "status of orders": paper.plot("status"),
        "poles": result.plot("poles"),
        "over position": result.plot("over", position=rig.slider_position),
        "recording": figures.plot_recording(rig),
        "scan": figures.plot_scan(result.scan()),
        "expansion": pulses.expansions["stiffness"].plot(),
        "derivatives": figures.plot_derivatives(rig.time, fit, "angle", samples=rig.angle),
        "2": figures.paper_figure_2(rig),
        "4": figures.paper_figure_4(rig),
        "5": figures.paper_figure_5(rig),
        "6": figures.paper_figure_6(paper, rig),
    }
    plt.close("all")


def colours_of(panel: Any) -> set[str]:
    """Give the colours of lines, points and bars in a panel, on white; bands lie under their line, and maps of time are a scale."""
    lines = [to_rgba(one.get_color(), one.get_alpha()) for one in panel.get_lines() if one.get_visible()]
    series = [one for one in panel.collections if one.get_array() is None and (one.get_alpha() or 1) > BAND]
    drawn = [*lines, *(face for one in series for face in one.get_facecolor()[:1])]
    drawn += [one.get_facecolor() for one in panel.patches if one.get_visible() and one.get_facecolor()[3] > BAND]
    return {to_hex(np.clip(face[3] * np.array(face[:3]) + 1 - face[3], 0, 1)) for face in map(np.asarray, drawn)}


@pytest.mark.slow
@pytest.mark.parametrize("eyes", list(EYES))
def test_series_of_a_panel_are_told_apart(pictures: dict[str, Any], eyes: str) -> None:
    several = 0
    for name, figure in pictures.items():
        for panel in figure.axes:
            for one, other in itertools.combinations(sorted(colours_of(panel)), 2):
                assert distance(one, other, eyes) > APART, (name, one, other)
                several += 1
    assert several > 10


PAGE = (Path(tvident.__file__).parent / "_report" / "page.css").read_text(encoding="utf-8")


@pytest.mark.parametrize("eyes", list(EYES))
@pytest.mark.parametrize("is_dark", [False, True])
def test_series_of_the_page_are_told_apart_by_day_and_by_night(eyes: str, is_dark: bool) -> None:
    light, _, dark = PAGE.partition("@media (prefers-color-scheme: dark)")
    colours = dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6})", light.split("}")[0]))
    if is_dark:
        colours |= dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6})", dark.split("}")[0]))
    on = {
        "found": "card",
        "recorded": "card",
        "strip": "card",
        "muted": "card",
        "ink": "ground",
        "accent": "accent-ground",
    }
    on |= {name: f"{name}-ground" for name in ("good", "doubtful", "bad")}
    for name, ground in on.items():
        assert distance(colours[name], colours[ground], eyes) > VISIBLE, name
    assert distance(colours["found"], colours["recorded"], eyes) > APART


def test_verdicts_are_told_apart_without_their_colour() -> None:
    script = (Path(tvident.__file__).parent / "_report" / "page.js").read_text(encoding="utf-8")
    (signs,) = re.findall(r'"?good"?: "(.)", "?doubtful"?: "(.)", "?bad"?: "(.)"', script)
    assert len(set(signs)) == 3
