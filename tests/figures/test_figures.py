from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
import pytest
from matplotlib import pyplot as plt

import tvident
from tvident import figures

mpl.use("agg")

Array = npt.NDArray[np.float64]


@pytest.fixture(autouse=True)
def close_figures() -> Iterator[None]:
    yield
    plt.close("all")


@pytest.fixture(scope="module")
def rig() -> tvident.Recording:
    return tvident.simulate_torsional_rig(8.0)


@pytest.fixture(scope="module")
def result(rig: tvident.Recording) -> tvident.Identification:
    angle = rig.angle.copy()
    angle[3000:3400] = np.nan
    return tvident.identify(angle, rig.torque, sample_rate=1000)


@pytest.fixture(scope="module")
def paper(rig: tvident.Recording) -> tvident.Identification:
    return tvident.identify(rig.angle, rig.torque, sample_rate=1000, method="paper")


def panels(figure: Any) -> Any:
    """Give the axes of a figure."""
    return figure.axes


def titles(figure: Any) -> list[str]:
    return [ax.get_title(loc="left") for ax in figure.axes if ax.get_title(loc="left")]


def texts(ax: Any) -> str:
    """Give the words of a panel: those of its title and those beside it."""
    return " ".join([ax.get_title(loc="left"), *(text.get_text() for text in ax.texts)])


def line(ax: Any, label: str) -> tuple[Array, Array]:
    """Give what is drawn under a name."""
    (found,) = [one for one in ax.get_lines() if one.get_label() == label]
    return np.asarray(found.get_xdata(), float), np.asarray(found.get_ydata(), float)


def test_the_papers_figures_on_the_default_recording() -> None:
    recording = tvident.simulate_torsional_rig()
    assert titles(figures.paper_figure_2(recording)) == ["Slider position", "Torque", "Angle"]

    # Figures 4 and 5: the clean window takes a high order, the noisy one a low one.
    for draw, low, high in ((figures.paper_figure_4, 12, 14), (figures.paper_figure_5, 6, 8)):
        words = [text.get_text() for text in draw(recording).axes[1].texts]
        (order,) = [int(word.removeprefix("n = ")) for word in words]
        assert low <= order <= high

    result = tvident.identify(recording.angle, recording.torque, sample_rate=1000, method="paper")
    figure = figures.paper_figure_6(result, recording)
    assert titles(figure) == ["Inertia $I$", "Damping $C$", "Stiffness $K$"]
    units = ["kg·m²", "N·m·s/rad", "N·m/rad"]
    assert [ax.get_ylabel() for ax in figure.axes] == [name for unit in units for name in (unit, "error")]
    figure.savefig("/dev/null", format="png")


def test_known_parameters_are_not_drawn_and_terms_are() -> None:
    recording = tvident.simulate_torsional_rig(2.0)
    result = tvident.identify(
        recording.angle, recording.torque, sample_rate=1000, method="paper", damping=0, terms=["offset"]
    )
    assert titles(result.plot()) == ["Inertia $I$", "Stiffness $K$", "Offset"]


def test_over_time_alone_a_batch_can_be_drawn(rig: tvident.Recording) -> None:
    angle, torque = np.tile(rig.angle, (2, 1)), np.tile(rig.torque, (2, 1))
    result = tvident.identify(angle, torque, sample_rate=1000, method="paper")
    for what in ("torque", "status", "poles"):
        with pytest.raises(ValueError, match="only a single record"):
            result.plot(what)
    with pytest.raises(ValueError, match="only a single record"):
        figures.plot_identification(result)


def test_constants_are_a_line_of_text_and_what_changes_has_a_panel_and_its_error(
    rig: tvident.Recording, result: tvident.Identification
) -> None:
    (alone,) = result.plot().axes
    value, _ = result.constants["inertia"]
    for words in ("Inertia $I$", f"{value:.3g}"[:5], "Damping $C$", "Offset", "Stiffness $K$"):
        assert words in texts(alone)
    assert "flagged" in [str(patch.get_label()) for patch in alone.patches]

    stiffness, wrong = result.plot(truth=rig).axes
    assert f"(truth {rig.inertia[0]:.5g})" in texts(stiffness)
    time, drawn = line(stiffness, "truth")
    np.testing.assert_allclose(drawn, np.interp(time, rig.time, rig.stiffness))
    time, drawn = (np.asarray(one, float) for one in wrong.get_lines()[0].get_data())
    np.testing.assert_allclose(drawn, (result.stiffness - rig.stiffness)[np.rint(time * 1000).astype(int)], atol=1e-12)

    kinds: Any = dict.fromkeys(("inertia", "damping", "stiffness"), "constant")
    constant = tvident.identify(rig.angle, rig.torque, sample_rate=1000, method="paper", **kinds)
    (alone,) = constant.plot().axes
    assert "Stiffness $K$" in texts(alone)


def test_a_spike_neither_hides_the_band_nor_is_lost(rig: tvident.Recording) -> None:
    channels = {"time [s]": np.arange(1_000_000) / 1000, "force [N]": np.sin(np.arange(1_000_000) / 5000)}
    channels["force [N]"][123_457] = 40.0
    (drawn,) = figures.plot_recording(channels).axes
    values = np.asarray(drawn.get_lines()[0].get_ydata(), float)
    assert values.size < 20_000
    assert values.max() == 40.0
    assert drawn.get_ylim()[1] > 40

    angle = rig.angle.copy()
    angle[4000] += 0.5
    hit = tvident.identify(angle, rig.torque, sample_rate=1000, method="paper")
    panel = hit.plot().axes[2]
    low, high = panel.get_ylim()
    inside = np.isfinite(hit.stiffness) & (np.abs(hit.time - 4) > 0.5)
    share = np.mean((low < hit.stiffness[inside]) & (hit.stiffness[inside] < high))
    # A hundredth of the values at each end, and of either edge of the band, may be left out.
    assert share > 0.98
    assert high - low < 5 * np.ptp(np.percentile(hit.stiffness[inside], [1, 99]))
    band = np.asarray(panel.collections[-1].get_paths()[0].vertices)
    widest = 2 * hit.stderr["stiffness"][2000]
    there = np.abs(band[:, 0] - 2.0) < 0.01
    assert np.ptp(band[there, 1]) > widest


def test_a_file_is_drawn_with_its_units(rig: tvident.Recording) -> None:
    channels = {"time [ms]": 1000 * rig.time, "angle [deg]": np.degrees(rig.angle)}
    recording = tvident.FileRecording(channels)
    (drawn,) = figures.plot_recording(recording).axes
    assert [drawn.get_title(loc="left"), drawn.get_ylabel()] == ["Angle", "deg"]
    assert np.asarray(drawn.get_lines()[0].get_xdata(), float)[-1] == pytest.approx(rig.time[-1])
    with pytest.raises(ValueError, match="a recording needs its time; got sample_rate=None; give sample_rate="):
        figures.plot_recording({"angle": rig.angle})
    # Times are found by what they are called, as in files.
    for name in ("t [s]", "t", "Zeit [ms]", "timestamp"):
        (drawn,) = figures.plot_recording({name: np.arange(rig.angle.size), "angle [rad]": rig.angle}).axes
        assert np.asarray(drawn.lines[0].get_xdata())[-1] == (rig.angle.size - 1) * (1e-3 if "ms" in name else 1)
        assert drawn.get_title(loc="left") + drawn.get_title() == "Angle"
    # What decreases is no time, and dates are seconds from the first on.
    assert len(figures.plot_recording({"angle": rig.angle, "t": rig.torque}, sample_rate=1000).axes) == 2
    dates = np.datetime64("2024-01-05T12:00:00", "ms") + np.arange(rig.angle.size)
    (drawn,) = figures.plot_recording({"timestamp": dates, "angle": rig.angle}).axes
    assert np.asarray(drawn.lines[0].get_xdata())[-1] == pytest.approx((rig.angle.size - 1) / 1000)


@pytest.mark.slow
def test_every_picture_draws_on_axes_of_ones_own(
    rig: tvident.Recording, result: tvident.Identification, paper: tvident.Identification
) -> None:
    fit = tvident.fit_local_polynomials(rig.angle, 201, sample_rate=1000)
    pictures: list[Any] = [
        lambda ax: result.plot(ax=ax),
        lambda ax: result.plot(truth=rig, ax=ax),
        lambda ax: result.plot("torque", ax=ax),
        lambda ax: paper.plot("status", ax=ax),
        lambda ax: result.plot("poles", ax=ax),
        lambda ax: result.plot("scan", ax=ax),
        lambda ax: result.plot("over", position=rig.slider_position, ax=ax),
        lambda ax: figures.plot_recording(rig, ax=ax),
        lambda ax: figures.plot_derivatives(rig.time, fit, "angle", samples=rig.angle, ax=ax),
    ]
    figure, grid = plt.subplots(3, 3, figsize=(18, 16))
    for draw, ax in zip(pictures, grid.ravel(), strict=True):
        assert draw(ax) is figure
    figure.savefig("/dev/null", format="svg")
    # Axes that stand anywhere are divided too.
    apart = plt.figure()
    assert result.plot("torque", ax=apart.add_axes((0.2, 0.3, 0.5, 0.4))) is apart
    apart.savefig("/dev/null", format="pdf")
    # As many as there are panels, or one.
    _, three = plt.subplots(3)
    assert result.plot("torque", ax=three[:2]).axes == list(three)
    with pytest.raises(ValueError, match="ax must be one Axes, or 2 of them for this picture; got 3; give 2"):
        result.plot("torque", ax=three)


@pytest.mark.first(1)
@pytest.mark.parametrize("what", ["poles", "torque", "scan"])
def test_panels_inside_of_axes_keep_their_words_apart(result: tvident.Identification, what: Any) -> None:
    for is_free in (False, True):
        figure = plt.figure(figsize=(11, 6))
        ax = figure.add_axes((0.2, 0.2, 0.6, 0.6)) if is_free else figure.subplots(1, 2)[1]
        result.plot(what, ax=ax)
        figure.canvas.draw()
        panels = [one for one in [*figure.axes, *ax.child_axes] if one.get_title(loc="left")]
        assert len(panels) > 1
        for above, below in pairwise(panels):
            bottom = above.get_tightbbox().y0  # of words below the axis
            assert below.get_window_extent().y1 < bottom
            assert below._left_title.get_window_extent().y1 < bottom + 1  # noqa: SLF001 - there is no other way to it
        plt.close(figure)


def test_derivatives_have_units_and_constants_stay_within_the_picture(rig: tvident.Recording) -> None:
    fit = tvident.fit_local_polynomials(rig.angle, 201, sample_rate=1000)
    drawn = figures.plot_derivatives(rig.time, fit, "angle", samples=tvident.Channel(rig.angle, "deg"))
    assert [ax.get_ylabel() for ax in drawn.axes] == ["deg", "deg/s", "deg/s²", ""]
    quiet = tvident.simulate_torsional_rig(4.0, angle_noise=1e-6, torque_snr_db=55, damping=0.15, inertia=0.02)
    found = tvident.identify(quiet.angle, quiet.torque, sample_rate=1000)
    drawn = found.plot()
    drawn.canvas.draw()
    parts: list[Any] = drawn.axes[0].get_children()
    (above,) = [one for one in parts if "Offset" in getattr(one, "get_text", str)()]
    assert above.get_window_extent().x1 <= drawn.axes[0].get_window_extent().x1 + 1
    assert above.get_text().count("\n") < len(found.constants) - 1


def test_the_predicted_torque_leaves_the_noise(rig: tvident.Recording, result: tvident.Identification) -> None:
    time, recorded, predicted = result.predicted_torque()
    np.testing.assert_allclose(time, rig.time, atol=1e-12)
    left = (recorded - predicted)[np.isfinite(recorded)]
    # What is left is what the identification says is left.
    assert left.std() == pytest.approx(np.nanmedian(result.residual_std), rel=0.1)
    missing = np.isnan(recorded)
    half = result.settings["window_length"] // 2
    np.testing.assert_array_equal(np.flatnonzero(missing[half:-half]) + half, np.arange(3000 - half, 3400 + half))
    upper, lower = panels(result.plot("torque"))
    assert {text.get_text() for text in upper.get_legend().get_texts()} >= {"recorded", "predicted from the angle"}
    assert f"{np.sqrt(np.mean(left**2)):.3g}" in lower.get_title(loc="left")

    # With friction, gravity and a term of one's own, a lag and every tenth result.
    generator = np.random.default_rng(0)
    t = np.arange(20_000) / 1000
    angle, velocity, acceleration = (
        np.zeros(t.size)
        + sum(size * speed**d * np.cos(speed * t + d * np.pi / 2) for size, speed in ((1.0, 9.0), (0.3, 31.0)))
        for d in range(3)
    )
    torque = (
        0.02 * acceleration
        + 0.1 * velocity
        + 0.5 * np.sign(velocity)
        + 3 * np.sin(angle)
        + 0.3 * np.abs(velocity) * velocity
    )
    drag = tvident.Term("drag", lambda _t, _angle, velocity: np.abs(velocity) * velocity)
    call: Any = {"terms": ["coulomb", "gravity", drag], "stiffness": 0, "lag": 0.003, "step": 10}
    for method in ("auto", tvident.StrongForm(window_length=41)):
        found = tvident.identify(
            angle[3:],
            torque[:-3] + 0.01 * generator.standard_normal(t.size - 3),
            sample_rate=1000,
            method=method,
            **call,
        )
        _, recorded, predicted = found.predicted_torque()
        assert np.nanstd(recorded - predicted) < 0.1 * np.nanstd(recorded), method


def test_where_nothing_is_found_pictures_and_reports_say_so(tmp_path: Path) -> None:
    nothing = tvident.identify(np.zeros(2000), np.zeros(2000), sample_rate=1000)
    for what in ("parameters", "status", "poles"):
        nothing.plot(what).savefig("/dev/null", format="png")
    assert panels(nothing.plot("torque"))[1].get_title(loc="left") == "Nothing is predicted: there are no parameters"
    nothing.report(tmp_path / "nothing.html")
    assert '"tone": "bad"' in (tmp_path / "nothing.html").read_text(encoding="utf-8")

    rig = tvident.simulate_torsional_rig(2.0)
    linear = tvident.identify(rig.angle, rig.torque, sample_rate=1000, angle_unit="m", torque_unit="N")
    assert panels(linear.plot("torque"))[0].get_title(loc="left") == "Force, averaged over the test function"
    linear.report(tmp_path / "linear.html")
    text = (tmp_path / "linear.html").read_text(encoding="utf-8")
    assert all(f'"title": "{name}", "unit": "{unit}"' in text for name, unit in (("Position", "m"), ("Force", "N")))


def test_poles_are_the_roots_and_positions_the_places(rig: tvident.Recording, result: tvident.Identification) -> None:
    points = np.concatenate([np.asarray(one.get_offsets()) for one in result.plot("poles").axes[2].collections])
    i, c, k = (getattr(result, name)[100] for name in ("inertia", "damping", "stiffness"))
    for root in np.roots([i, c, k]):
        assert np.hypot(points[:, 0] - root.real, points[:, 1] - root.imag).min() < 0.05
    with pytest.raises(ValueError, match="position must have a value for each of the result's 8000 samples; got shape"):
        result.plot("over", position=rig.slider_position[:-1])
    with pytest.raises(TypeError, match="drawn over a channel; got none; give position="):
        result.plot("over")
    with pytest.raises(ValueError, match="name must be a parameter of the result; got 'mass'"):
        result.plot("over", position=rig.slider_position, name="mass")


def test_the_status_is_drawn_where_it_is_set(paper: tvident.Identification) -> None:
    orders, flags = paper.plot("status").axes
    assert orders.get_title(loc="left") == "Order of the polynomial"
    names = [label.get_text() for label in flags.get_yticklabels()]
    assert {"invalid", "edge"} <= set(names)
    assert f"{np.mean(paper.status == 0):.1%}" in flags.get_title(loc="left")
    edge = flags.collections[names.index("edge")].get_paths()
    total = sum(float(np.ptp(np.asarray(path.vertices)[:, 0])) for path in edge)
    assert total == pytest.approx(np.count_nonzero(paper.status & tvident.Status.EDGE) / 1000, abs=1e-6)


def test_what_holds_for_the_whole_record_is_written_below(rig: tvident.Recording) -> None:
    late = tvident.identify(rig.angle[2:], rig.torque[:-2], sample_rate=1000)
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


def test_several_records_are_drawn_together() -> None:
    rigs = [tvident.simulate_torsional_rig(duration=seconds, seed=seed) for seed, seconds in enumerate((1.5, 2.0))]
    angles, torques = [np.asarray(rig.angle) for rig in rigs], [np.asarray(rig.torque) for rig in rigs]
    found = tvident.identify([*angles, angles[0][:9]], [*torques, torques[0][:9]], sample_rate=1000, share=("inertia",))
    figure = found.plot()
    assert titles(figure) == ["Stiffness $K$", "Inertia $I$", "Damping $C$", "Offset"]
    moving, inertia = figure.axes[:2]
    assert [line.get_label() for line in moving.get_lines()] == ["record 0", "record 1", "record 2"]
    assert np.asarray(inertia.get_lines()[-1].get_ydata())[0] == found.constants["inertia"][0]
    assert inertia.get_xlabel() == "record"
    batch = tvident.identify(
        np.stack([one[:1500] for one in angles]), np.stack([one[:1500] for one in torques]), sample_rate=1000
    )
    assert "Stiffness $K$" in titles(batch.plot())
    with pytest.raises(ValueError, match=r"draw one of them: result\[0\].plot\('poles'\)"):
        found.plot("poles")
    with pytest.raises(ValueError, match=r"1 to 24 records; got 25; draw some: result\[:24\]"):
        figures.plot_records([batch[0]] * 25)


def test_the_truth_is_drawn_from_names_too(result: tvident.Identification, rig: tvident.Recording) -> None:
    """It was left out without a word."""
    stiffness, _ = result.plot(truth=rig.truth).axes
    assert f"(truth {rig.inertia[0]:.5g})" in texts(stiffness)
    interpolated = line(result.plot(truth=rig).axes[0], "truth")[1]
    # Times of the recording differ from those of the result by rounding.
    np.testing.assert_allclose(line(stiffness, "truth")[1], interpolated, rtol=1e-14)
    known = figures.plot_identification(result, {"inertia": 0.012}).axes[0]
    assert "(truth 0.012)" in texts(known)


@pytest.mark.parametrize(
    ("truth", "said"),
    [
        (3.0, "must be a simulated recording, or numbers and arrays by name; got 3.0"),
        (np.ones(8000), "must be a simulated recording, or numbers and arrays by name"),
        (
            {"stifness": 1.0},
            "must name parameters of the result, inertia, damping, stiffness and offset; got 'stifness'",
        ),
        (
            {"stiffness": np.ones(7)},
            r"'stiffness'\] must be a number or an array with a value for each of 8000 samples; got shape \(7,\)",
        ),
    ],
)
def test_what_is_no_truth_is_refused(result: tvident.Identification, truth: Any, said: str) -> None:
    with pytest.raises((TypeError, ValueError), match=said):
        result.plot(truth=truth)


def test_dask_is_never_computed_for_a_picture(result: tvident.Identification, rig: tvident.Recording) -> None:
    """It was, by pictures, channels and recordings of files."""
    da = pytest.importorskip("dask.array")
    computed = []

    def watched(block: Any) -> Any:
        computed.append(1)
        return block

    lazy = da.from_array(rig.angle).map_blocks(watched, dtype=float, meta=np.empty(0))
    computed.clear()  # of what is asked for its type
    fit = tvident.fit_local_polynomials(rig.angle, 101)
    for call in (
        lambda: figures.plot_recording({"angle": lazy}, sample_rate=1000),
        lambda: figures.plot_derivatives(rig.time, fit, samples=lazy),
        lambda: result.plot("over", position=lazy),
        lambda: result.plot(truth={"stiffness": lazy}),
        lambda: tvident.Channel(lazy, "rad"),
        lambda: tvident.FileRecording({"angle": lazy}),
    ):
        with pytest.raises(
            TypeError, match=r"must be in memory; got a dask .*never computed silently; pass .*\.compute\(\)"
        ):
            call()
    assert not computed
