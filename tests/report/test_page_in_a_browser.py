"""The report in a real browser without a network: it opens, it zooms to the sample, and nothing complains."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tvident
from merged.simulated import chain
from merged.test_masses import changing, constant

MILLION = 1e6

USABLE = 2.0
"""Seconds from opening to plots that can be zoomed."""

ALONE = 4.0
"""On a busy machine: so many times what the browser takes to load the drawing library alone, which is most of the work."""


def leave_out(reason: str) -> None:
    """Skip, unless skipping is forbidden: continuous integration must look."""
    if os.environ.get("TVIDENT_REQUIRE_CHROMIUM"):
        pytest.fail(reason)
    pytest.skip(reason)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if program is None:
        leave_out("reports cannot be opened without chromium; install it")
    try:
        from playwright.sync_api import sync_playwright  # noqa: PLC0415 - not everyone has it
    except ImportError:
        leave_out("reports cannot be opened without playwright; install requirements-development.txt")
    with sync_playwright() as playwright:
        # A container's only user is root, for whom chromium has no sandbox.
        opened = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield opened
        opened.close()


class Opened:
    """A page, and all that the browser said of it."""

    def __init__(self, browser: Any, path: Path, **options: Any) -> None:
        self.context = browser.new_context(offline=True, **({"viewport": {"width": 1280, "height": 900}} | options))
        self.page = self.context.new_page()
        self.words: list[str] = []
        self.requests: list[str] = []
        self.page.on("console", lambda message: self.words.append(message.text))
        self.page.on("pageerror", lambda error: self.words.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.goto(path.as_uri())
        self.page.wait_for_selector("body[data-usable]")
        self.usable = float(self.ask("document.body.dataset.usable")) / 1000

    def ask(self, question: str) -> Any:
        """Give what an expression is in the page: the driver evaluates it, as the page itself forbids that."""
        return self.page.evaluate(question)

    def drawn(self, title: str) -> dict[str, Any]:
        """Give what is drawn under a title."""
        question = """async (title) => {
            const chart = tvidentReport.charts.find((one) => one.about.title === title);
            chart.div.scrollIntoView();
            chart.isNear = true;
            await chart.draw();
            const traces = chart.div.data, line = traces[traces.length - 1];
            const {yaxis, shapes} = chart.div.layout;
            return {x: line.x, y: line.y, colour: line.line.color, traces: traces.length, range: yaxis.range, shapes: shapes.length};
        }"""
        found: dict[str, Any] = self.page.evaluate(question, title)
        return found

    def show(self, begin: float, end: float) -> None:
        """Show a stretch of time, in seconds."""
        self.page.evaluate("([begin, end]) => tvidentReport.show(begin, end)", [begin, end])

    def close(self) -> None:
        """End, and see that nobody complained and that nothing but the page was asked for."""
        assert not self.words
        assert [url.split(":")[0] for url in self.requests] == ["file"]
        self.context.close()


def alone(browser: Any, folder: Path) -> float:
    """Give the seconds that the drawing library takes by itself."""
    from tvident._report import check_plotly  # noqa: PLC0415 - only with a browser

    page = folder / "alone.html"
    script = check_plotly().read_text(encoding="utf-8")
    page.write_text(f"<script>{script}</script><script>document.title = performance.now()</script>", encoding="utf-8")
    opened = browser.new_page()
    opened.goto(page.as_uri())
    seconds = float(opened.title()) / 1000
    opened.close()
    return seconds


@pytest.fixture(scope="module")
def hour(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, np.ndarray[Any, Any]]]:
    """Give the report of an hour of five channels at 1 kHz, three of them noise, which nothing compresses."""
    rig = tvident.simulate_torsional_rig(60.0, pattern="constant")
    generator = np.random.default_rng(0)
    channels = {f"noise {number} [V]": generator.standard_normal(3_600_000) for number in range(3)}
    channels["noise 0 [V]"][1_234_567] = 50.0
    channels["noise 1 [V]"][2_000_000:2_000_300] = np.nan
    kinds: Any = dict.fromkeys(("inertia", "damping", "stiffness"), "constant")
    angle, torque = (np.tile(one, 60) for one in (rig.angle, rig.torque))
    result = tvident.identify(angle, torque, sample_rate=1000, method=tvident.StrongForm(), **kinds)
    path = tmp_path_factory.mktemp("hour") / "hour.html"
    result.report(path, channels=channels)
    return path, channels


@pytest.mark.slow
def test_an_hour_is_small_opens_at_once_and_shows_every_sample(
    browser: Any, hour: tuple[Path, dict[str, np.ndarray[Any, Any]]], tmp_path: Path
) -> None:
    path, channels = hour
    assert path.stat().st_size < 25 * MILLION
    opened = Opened(browser, path)
    assert opened.usable < USABLE or opened.usable < ALONE * alone(browser, tmp_path)

    # The one sample that stands out is seen at every zoom, at its place and with its value.
    before = np.inf
    for width in (3600.0, 600.0, 60.0, 10.0, 4.0, 0.05):
        opened.show(max(0.0, 1234.567 - width / 2), min(3600.0, 1234.567 + width / 2))
        line = opened.drawn("noise 0")
        top = int(np.argmax([-np.inf if value is None else value for value in line["y"]]))
        assert line["y"][top] == pytest.approx(50.0, rel=1e-6)  # of 24 bits
        between = float(np.median(np.diff(line["x"])))
        # Two points stand for a column, a quarter of it from its ends.
        assert abs(line["x"][top] - 1234.567) <= 1.5 * between
        assert between < before
        before = between
        assert line["range"][1] > 50
    assert before == pytest.approx(0.001)

    # Every sample, to half a level of seven bits between the extremes of its block.
    opened.show(100.0, 100.5)
    line = opened.drawn("noise 2")
    first = round(line["x"][0] * 1000)
    expected = channels["noise 2 [V]"][first : first + len(line["x"])]
    np.testing.assert_allclose(line["y"], expected, atol=np.ptp(expected) / 2 / 126 + 1e-6)
    assert "one of 127 levels between the extremes of 128 neighbours" in opened.page.inner_text("footer")
    # Thousands of seconds look the same with a fraction and without.
    opened.show(1234.0, 1235.0)
    opened.drawn("noise 2")
    ticks = opened.ask("[...document.querySelectorAll('.xtick text')].map((one) => one.textContent)")
    assert "1234 s" in ticks
    assert any(one.startswith("1234.") for one in ticks)
    assert not any("," in one for one in ticks)
    # Where samples are missing there is a gap, from the first to the last.
    opened.show(1999.9, 2000.4)
    line = opened.drawn("noise 1")
    missing = [round(1000 * time) for time, value in zip(line["x"], line["y"], strict=True) if value is None]
    assert missing == list(range(2_000_000, 2_000_300))
    opened.close()


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, tvident.Identification]:
    rig = tvident.simulate_torsional_rig(8.0)
    angle = rig.angle.copy()
    angle[3000:3400] = np.nan
    result = tvident.identify(angle, rig.torque, sample_rate=1000)
    path = tmp_path_factory.mktemp("short") / "short.html"
    result.report(path, channels={"</script><b>slider</b> [m]": rig.slider_position}, title='a <b>rig</b> & "more"')
    return path, result


@pytest.mark.slow
def test_dragging_shows_the_same_time_in_all_plots_and_a_double_click_the_whole(
    browser: Any, short: tuple[Path, tvident.Identification]
) -> None:
    path, result = short
    opened = Opened(browser, path)
    page = opened.page
    assert page.inner_text("h1") == 'a <b>rig</b> & "more"'
    assert page.inner_text(".verdict p") == result.summary().splitlines()[0]
    assert not page.query_selector("b")
    assert opened.drawn("</script><b>slider</b>")["y"]
    band = opened.drawn("Stiffness K")
    assert band["traces"] == 2
    assert band["shapes"] >= 1  # the gap is shaded
    inside = np.percentile(result.stiffness[np.isfinite(result.stiffness)], [1, 99])
    assert band["range"][0] < inside[0] < inside[1] < band["range"][1]

    plot = page.query_selector(".plot")
    plot.scroll_into_view_if_needed()
    box = plot.bounding_box()
    left, width = box["x"] + 64, box["width"] - 82
    middle = box["y"] + box["height"] / 2
    page.mouse.move(left + 0.25 * width, middle)
    page.mouse.down()
    page.mouse.move(left + 0.4 * width, middle, steps=4)
    page.mouse.move(left + 0.5 * width, middle, steps=4)
    page.mouse.up()
    page.wait_for_function("() => tvidentReport.shown.to < 5")
    shown = opened.ask("tvidentReport.shown")
    assert [shown["from"], shown["to"]] == pytest.approx([2.0, 4.0], abs=0.05)
    times = opened.drawn("Stiffness K")["x"]
    assert shown["from"] - 0.01 < times[0] < times[-1] < shown["to"] + 0.01
    page.mouse.dblclick(left + 0.5 * width, middle)
    page.wait_for_function("() => tvidentReport.shown.to > 7")

    # A warning's time leads to its place.
    page.click("text=/^2\\.9.* 3\\.4.* s$/")
    page.wait_for_function("() => tvidentReport.shown.to < 5")
    shown = opened.ask("tvidentReport.shown")
    assert shown["from"] < 3.0
    assert shown["to"] > 3.4
    opened.close()


@pytest.mark.slow
def test_a_plot_without_numbers_says_so(browser: Any, tmp_path: Path) -> None:
    rig = tvident.simulate_torsional_rig(4.0)
    result = tvident.identify(rig.angle, rig.torque, sample_rate=1000)
    silent = np.where(rig.time < 2, rig.slider_position, np.nan)
    result.report(tmp_path / "page.html", channels={"off [V]": np.full(rig.time.size, np.nan), "silent [m]": silent})
    opened = Opened(browser, tmp_path / "page.html")
    shown = "(title) => tvidentReport.charts.find((one) => one.about.title === title).div.textContent.includes('no numbers here')"
    said = []
    for begin, end in ((0.0, 4.0), (2.5, 3.5)):
        opened.show(begin, end)
        for title in ("off", "silent", "Angle"):
            opened.drawn(title)
            said.append(opened.page.evaluate(shown, title))
    assert said == [True, False, False, True, True, False]
    opened.close()


@pytest.mark.slow
def test_words_of_a_plot_stand_apart_and_on_one_line(browser: Any, short: tuple[Path, tvident.Identification]) -> None:
    opened = Opened(browser, short[0])
    overlapping = """() => {
        const bad = [];
        for (const chart of tvidentReport.charts) {
            const boxes = [...chart.div.querySelectorAll(".xtick text, .ytick text")].map((one) => one.getBoundingClientRect());
            boxes.forEach((a, i) => boxes.slice(i + 1).forEach((b) => {
                if (a.left < b.right && b.left < a.right && a.top < b.bottom - 1 && b.top < a.bottom - 1) bad.push(chart.about.title);
            }));
        }
        return bad;
    }"""
    for title in ("Stiffness K", "Natural frequency", "Torque, averaged over the test function", "Status over time"):
        # Plots above it that are drawn meanwhile may move it out of sight.
        seen = """(title) => {
            const chart = tvidentReport.charts.find((one) => one.about.title === title);
            chart.div.scrollIntoView();
            return chart.isListening;
        }"""
        opened.page.wait_for_function(seen, arg=title)
    opened.page.wait_for_selector(".annotation-text", state="attached")
    assert opened.ask(f"({overlapping})()") == []
    # The same time stands at the same place in every plot, that of the status too, whose names are in the page.
    assert (
        len(
            set(
                opened.ask(
                    "tvidentReport.charts.filter((one) => one.isListening).map((one) => one.div._fullLayout._size.l)"
                )
            )
        )
        == 1
    )
    names = opened.ask("[...document.querySelectorAll('.annotation-text')].map((one) => one.textContent)")
    assert {"edge", "gap"} <= set(names)
    keys = "[...document.querySelectorAll('.head')].map((head) => [...head.querySelectorAll('.key')].map((key) => key.offsetTop))"
    tops = opened.ask(keys)
    assert any(len(each) > 2 for each in tops)
    assert all(len(set(each)) <= 1 for each in tops)
    opened.close()


@pytest.mark.slow
def test_a_page_of_masses_opens_like_any_other(browser: Any, tmp_path: Path) -> None:
    one = chain([changing, constant(18.0)], 1500, seed=3)
    structure = tvident.Chain(2, [("base", 0), (0, 1)])
    kinds: Any = {"stiffness": ["windowed", "constant"], "inertia": "constant", "damping": "constant"}
    found = tvident.identify(one.angle, one.torque, sample_rate=1000, dof_axis=0, structure=structure, **kinds)
    found.report(tmp_path / "masses.html")
    opened = Opened(browser, tmp_path / "masses.html")
    assert opened.page.inner_text(".verdict p") == found.summary().splitlines()[0]
    assert opened.drawn("Stiffness base 0")["traces"] == 2
    assert opened.drawn("Torque 1, averaged over the test function")["traces"] == 2
    assert "All settings" not in opened.page.inner_text("body")
    opened.close()


@pytest.mark.slow
def test_a_page_of_a_list_of_records_opens_and_zooms(browser: Any, tmp_path: Path) -> None:
    rigs = [tvident.simulate_torsional_rig(2.0 + number, seed=number) for number in range(2)]
    found = tvident.identify([one.angle for one in rigs], [one.torque for one in rigs], sample_rate=1000)
    found.report(tmp_path / "list.html")
    opened = Opened(browser, tmp_path / "list.html")
    assert opened.page.inner_text("#facts") == "2 records of 1.999 to 2.999 s"
    assert opened.page.inner_text(".verdict p").startswith(
        "2 records, no reason to distrust any; record 0: K(t) known to"
    )
    assert opened.page.inner_text("#charts .group").upper() == "RECORD 0: RECORDED"
    opened.show(0.5, 0.6)
    line = opened.drawn("Angle")
    np.testing.assert_allclose(np.diff(line["x"]), 0.001, rtol=1e-6)
    assert not opened.words
    assert opened.requests == [(tmp_path / "list.html").as_uri()]
    opened.close()


def test_a_narrow_screen_needs_no_scrolling_aside_and_night_is_dark(
    browser: Any, short: tuple[Path, tvident.Identification]
) -> None:
    phone = {"viewport": {"width": 390, "height": 844}, "is_mobile": True, "has_touch": True}
    opened = Opened(browser, short[0], color_scheme="light", **phone)
    before = ""
    # What is drawn follows when the page has heard of it.
    drawn = """(before) => {
        const {data} = tvidentReport.charts.find((one) => one.about.title === "Stiffness K").div;
        return data[data.length - 1].line.color !== before;
    }"""
    for scheme in ("light", "dark"):
        opened.page.emulate_media(color_scheme=scheme)
        assert opened.ask("document.documentElement.scrollWidth") <= 390
        ground = opened.ask("getComputedStyle(document.body).backgroundColor")
        assert (sum(int(part) for part in ground.strip("rgb()").split(",")) > 3 * 128) == (scheme == "light")
        if before:
            opened.page.wait_for_function(drawn, arg=before)
        before = opened.drawn("Stiffness K")["colour"]
    opened.close()


@pytest.mark.parametrize("width", [320, 360, 400])
def test_nothing_leaves_its_card_on_a_narrow_screen(browser: Any, tmp_path: Path, width: int) -> None:
    """At 320 points cards with their errors were 31 wider than the screen; names of channels and files may be long, without a blank."""
    rig = tvident.simulate_torsional_rig(20.0)
    result = tvident.identify(rig.angle, rig.torque, sample_rate=1000.0)
    names = (
        "Knee moment, filtered at 20 Hz, of the treadmill's third plate [N m]",
        f"{'Motor' * 20}_0123456789 [mN m]",
    )
    path = tmp_path / f"{'Run' * 30}.html"
    result.report(path, channels=dict.fromkeys(names, rig.torque))
    phone = {"viewport": {"width": width, "height": 780}, "is_mobile": True, "has_touch": True}
    opened = Opened(browser, path, color_scheme="dark", **phone)
    opened.ask("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
    opened.ask("""async () => {
        for (const chart of tvidentReport.charts) {
            chart.isNear = true;
            await chart.draw();
        }
    }""")
    spilled = opened.ask("""[...document.querySelectorAll("body, body *:not(svg, svg *, pre *)")].filter((one) => {
        const {left, right, width} = one.getBoundingClientRect(), shown = getComputedStyle(one);
        const within = one.scrollWidth <= one.clientWidth + 1 || shown.overflowX !== "visible" || shown.display === "inline";
        return width && (left < -0.5 || right > innerWidth + 0.5 || (one.clientWidth && !within));
    }).map((one) => `${one.tagName}.${one.className}: ${one.textContent.slice(0, 40)}`)""")
    assert not spilled
    assert opened.ask("innerWidth") == width
    # A sign is never parted from its number.
    assert opened.ask("document.querySelector('#verdict .together').getClientRects().length") == 1
    opened.close()
