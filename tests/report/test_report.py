"""What a report holds: packed series give back what they were made of, and the page needs nothing else."""

from __future__ import annotations

import base64
import gzip
import json
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import tvident
from merged.simulated import chain, simulated
from merged.test_masses import constant
from tvident._command_line import main
from tvident._report.packed import Packed, Series, in_words, packed

Array = npt.NDArray[np.float64]


def unpacked(one: Packed) -> tuple[Array, Array]:
    """Give the samples of a series as the page unpacks them, and half of what a level is."""
    about = one.about
    top, block = about["top"], about["block"]
    extremes = np.frombuffer(gzip.decompress(base64.b64decode(one.extremes)), "<f4").reshape(2, -1)
    low, high = about["middle"] + about["factor"] * extremes.astype(np.float64)
    planes = np.frombuffer(gzip.decompress(base64.b64decode(one.levels)), np.uint8).reshape(-1, low.size * block)
    levels = sum(plane.astype(np.int64) << (8 * place) for place, plane in enumerate(planes))
    if about["differences"]:
        levels = np.cumsum(levels) % (1 << 8 * len(planes))
    levels = np.asarray(levels)[: about["count"]]
    whose = np.arange(about["count"]) // block
    samples = low[whose] + (high - low)[whose] * levels / top
    return np.where(levels > top, np.nan, samples), (high - low)[whose] / top / 2


@given(
    values=arrays(
        np.float64,
        st.integers(1, 400),
        elements=st.one_of(st.floats(-1e3, 1e3), st.just(np.nan), st.just(np.inf), st.floats(-1e200, 1e200)),
    ),
    offset=st.sampled_from([0.0, 1e6]),
)
def test_what_is_packed_comes_back_to_half_a_level(values: Array, offset: float) -> None:
    values = values + offset
    (one,) = packed([Series("x", "", values, 0.0, 1e-3)])
    found, half = unpacked(one)
    there = np.isfinite(values)
    np.testing.assert_array_equal(np.isnan(found), ~there)
    # Extremes are single precision of the distance from the middle: half of 2^-24, twice as much in a difference.
    rounding = 4 * 2**-24 * np.abs(values[there] - one.about["middle"]).max(initial=0.0) + 1e-15 * abs(offset)
    assert (np.abs(found - values)[there] <= half[there] * (1 + 1e-6) + rounding).all()


def test_a_spike_does_not_cost_what_is_beside_it() -> None:
    values = np.sin(np.arange(100_000) / 100)
    values[50_000] = 1e6
    (one,) = packed([Series("x", "", values, 0.0, 1e-3)])
    found, _ = unpacked(one)
    assert found[50_000] == pytest.approx(1e6, rel=1e-6)
    elsewhere = np.abs(np.arange(values.size) - 50_000) > one.about["block"]
    # Of single precision beside 1e6.
    assert np.abs(found - values)[elsewhere].max() < 1e6 * 2**-23


@pytest.mark.parametrize(
    ("most_bytes", "levels"), [(850_000, 65_535), (720_000, 16_383), (570_000, 2047), (415_000, 255), (375_000, 127)]
)
def test_levels_have_as_many_bits_as_there_is_room_for(most_bytes: int, levels: int) -> None:
    generator = np.random.default_rng(0)
    values = [generator.standard_normal(100_000) for _ in range(4)]
    values[1][500:700] = np.nan
    many = [Series(str(number), "", one, 0.0, 1e-3) for number, one in enumerate(values)]
    parts = packed(many, most_bytes=most_bytes)
    assert sum(len(part.extremes) + len(part.levels) for part in parts) < 1.05 * 4 / 3 * most_bytes
    for one, part in zip(values, parts, strict=True):
        assert (part.about["top"] + 1, part.about["merged"]) == (levels, 1)
        found, half = unpacked(part)
        assert np.nanmax(half) <= np.ptp(one[np.isfinite(one)]) / 2 / (levels - 1) * (1 + 1e-6)
        np.testing.assert_array_equal(np.isnan(found), np.isnan(one))
        there = np.isfinite(found)
        assert (np.abs(found - one)[there] <= half[there] + 1e-6).all()
    assert f"one of {levels:,} levels".replace(",", " ") in in_words(parts)
    assert in_words(parts).startswith("Every sample is in this page")


def test_series_that_compress_leave_their_room_to_others() -> None:
    noise, still = np.random.default_rng(0).standard_normal(100_000), np.full(100_000, 3.0)
    for values, levels in ((still, 65_535), (noise, 255)):
        parts = packed([Series(name, "", one, 0.0, 1e-3) for name, one in (("a", noise), ("b", values))], 220_000)
        assert {part.about["top"] + 1 for part in parts} == {levels}


def test_extremes_of_smooth_series_have_the_room_that_they_take() -> None:
    # A least and a greatest sample in turns compress less than the curve that they are of: half the numbers, not half the bytes.
    values = np.convolve(np.random.default_rng(0).standard_normal(400_000), np.hanning(101), "same")
    many = [Series(str(number), "", (1 + number) * values, 0.0, 1e-3) for number in range(6)]
    for most_bytes in (500_000, 650_000, 800_000):
        parts = packed(many, most_bytes=most_bytes)
        assert any(part.about["merged"] > 1 for part in parts)
        assert sum(len(part.extremes) + len(part.levels) for part in parts) < 4 / 3 * most_bytes


def test_what_does_not_fit_keeps_its_extremes() -> None:
    generator = np.random.default_rng(0)
    values = [generator.standard_normal(100_000) for _ in range(4)]
    values[0][70_001] = 9.0
    many = [Series(str(number), "", one, 0.0, 1e-3) for number, one in enumerate(values)]
    parts = packed(many, most_bytes=190_000)
    # As text three bytes are four; what is estimated from some blocks is known to some percent.
    assert sum(len(part.extremes) + len(part.levels) for part in parts) < 1.05 * 4 / 3 * 190_000
    assert {part.about["merged"] for part in parts} == {4}
    assert "of 4 of 4 series it has the least and the greatest of every few, each as one of 127 levels" in in_words(
        parts
    )
    for one, part in zip(values, parts, strict=True):
        found, half = unpacked(part)
        pairs = one.reshape(-1, 4)
        expected = np.stack([pairs.min(axis=1), pairs.max(axis=1)], axis=1).ravel()
        assert (np.abs(found - expected) <= half + 1e-6).all()
        assert found.max() == pytest.approx(one.max(), rel=1e-6)
        assert part.about["period"] * part.about["count"] == pytest.approx(100)


@pytest.fixture(scope="module")
def result() -> tvident.Identification:
    rig = tvident.simulate_torsional_rig(3.0)
    return tvident.identify(rig.angle, rig.torque, sample_rate=1000)


def test_a_page_is_whole_and_the_same_each_time(result: tvident.Identification, tmp_path: Path) -> None:
    result.report(tmp_path / "one.html", title="rig")
    result.report(tmp_path / "two.html", title="rig")
    text = (tmp_path / "one.html").read_text(encoding="utf-8")
    assert text == (tmp_path / "two.html").read_text(encoding="utf-8")
    assert not re.search(r"""(src|href)=(?!["']?data:)""", text.split('id="plotly"')[0])
    assert "default-src 'none'" in text
    for words in (result.summary().splitlines()[0], *result.reasons, *result.advice):
        assert words.replace("<", "\\u003c") in text.replace('\\"', '"')


def test_a_page_is_never_greener_than_its_verdict(tmp_path: Path) -> None:
    rig = tvident.simulate_torsional_rig(3.0)
    for sign, tone in ((1, "good"), (-1, "bad")):
        found = tvident.identify(rig.angle, sign * rig.torque, sample_rate=1000)
        found.report(tmp_path / "page.html")
        assert found.summary().startswith("do not trust") == (tone == "bad")
        assert f'"tone": "{tone}"' in (tmp_path / "page.html").read_text(encoding="utf-8")


def content_of(page: Path) -> Any:
    """Give what a page says."""
    text = page.read_text(encoding="utf-8")
    return json.loads(text.split('<script type="application/json" id="content">')[1].split("</script>")[0])


def titles(content: Any, group: str) -> list[str]:
    return [one["title"] for one in content["charts"] if one["group"] == group]


def test_numbers_of_a_page_have_the_digits_of_their_errors_and_stand_alone(tmp_path: Path) -> None:
    quiet = tvident.simulate_torsional_rig(4.0, pattern="constant", angle_noise=1e-6, torque_snr_db=55)
    tvident.identify(quiet.angle, quiet.torque, sample_rate=1000).report(tmp_path / "page.html")
    named = {line["name"]: line for line in content_of(tmp_path / "page.html")["numbers"]}
    low, high = re.findall(r"\d+\.\d+", named["Stiffness K"]["more"])
    assert low < high
    value, error = named["Offset"]["value"].split(" ± ")
    assert float(error) < 1e-4
    assert abs(float(value)) < 5 * float(error)


def test_a_torque_that_is_drawn_twice_is_in_the_page_once(tmp_path: Path) -> None:
    rig = tvident.simulate_torsional_rig(3.0)
    method = tvident.StrongForm()
    result = tvident.identify(rig.angle, rig.torque, sample_rate=rig.sample_rate, method=method)
    result.report(tmp_path / "page.html")
    content = content_of(tmp_path / "page.html")
    lines = {chart["title"]: chart["line"] for chart in content["charts"] if "line" in chart}
    assert lines["Torque"] == lines["Torque and its prediction"]
    assert [one["name"] for one in content["series"]].count("recorded") == 0


def test_where_windows_have_no_equations_there_is_no_condition_number(tmp_path: Path) -> None:
    rig = tvident.simulate_torsional_rig(6.0)
    angle = rig.angle.copy()
    angle[3000:3300] = np.nan
    result = tvident.identify(angle, rig.torque, sample_rate=1000)
    assert result.condition[3150] == 0
    result.report(tmp_path / "page.html")
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    about = content_of(tmp_path / "page.html")["series"]
    (number,) = [index for index, one in enumerate(about) if one["name"] == "condition"]
    parts = (text.split(f'id="{kind}-{number}">')[1].split("<")[0] for kind in ("extremes", "levels"))
    found, _ = unpacked(Packed(about[number], *parts))
    assert np.isnan(found[3150])
    assert np.nanmin(found) >= 1


@pytest.mark.slow
def test_masses_have_a_page_with_every_element_and_torque(tmp_path: Path) -> None:
    one = chain([constant(12.0), lambda t: 18 + 2 * np.sin(3 * t)], 2500, seed=1, base=True)
    structure = tvident.Chain(2, [("base", 0), (0, 1)], base=one.base)
    kinds: Any = {"structure": structure, "stiffness": ["constant", "windowed"], "sample_rate": 1000, "dof_axis": 0}
    for sign, tone in ((1, "good"), (-1, "bad")):
        found = tvident.identify(one.angle, sign * one.torque, **kinds)
        found.report(tmp_path / "page.html", channels={"lamp [V]": np.ones(2500)})
        content = content_of(tmp_path / "page.html")
        assert content["verdict"] == found.summary().splitlines()[0]
        assert content["verdict"].startswith("do not trust: the inertia of mass 0 is negative") == (tone == "bad")
        assert content["tone"] == tone
        assert titles(content, "Recorded") == [
            "Angle 0",
            "Torque 0",
            "Angle 1",
            "Torque 1",
            "Angle of the base",
            "lamp",
        ]
        assert titles(content, "Found")[0] == "Stiffness 0 1"
        assert "Torque 1, averaged over the test function" in titles(content, "How well")
        named = {line["name"]: line for line in content["numbers"]}
        assert named["Stiffness base 0"]["value"].startswith(f"{found.constants['stiffness_base_0'][0]:.2f}")
        # The settings of masses are not taken by another call.
        assert not content["repeat"]
    with pytest.raises(ValueError, match=r"its name must end in \.html"):
        found.report(tmp_path / "page.pdf")
    found.save(tmp_path / "found.npz")
    tvident.load(tmp_path / "found.npz").report(tmp_path / "loaded.html")
    assert not titles(content_of(tmp_path / "loaded.html"), "Recorded")


def test_trials_have_a_page_along_their_phase(tmp_path: Path) -> None:
    several = simulated(3, 900, constant(15.0), seed=2)
    lengths = (900, 800, 700)
    angles, torques = (
        [row[:n] for row, n in zip(rows, lengths, strict=True)] for rows in (several.angle, several.torque)
    )
    phases = [np.arange(n) / n for n in lengths]
    found: Any = tvident.identify(angles, torques, sample_rate=1000, ensemble_axis=0, phase=phases)
    found.report(tmp_path / "page.html")
    content = content_of(tmp_path / "page.html")
    assert len(titles(content, "Recorded")) == 6
    spans = {(one["count"], one["period"]) for one in content["series"]}
    assert spans == {(found.time.size, 1e-3)}
    assert all("from trial to trial" in line["more"] for line in content["numbers"])


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("x.pdf", {}, r"its name must end in \.html; got 'x\.pdf'; rename it"),
        ("x.html", {"channels": {"position": [1.0, 2.0]}}, r"got 'position' with shape \(2,\); leave out position"),
    ],
)
def test_a_report_that_cannot_be_is_refused(
    result: tvident.Identification, tmp_path: Path, monkeypatch: Any, name: str, options: Any, message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError, match=message):
        result.report(name, **options)
    assert not list(tmp_path.iterdir())


def test_a_batch_has_no_report(tmp_path: Path) -> None:
    rig = tvident.simulate_torsional_rig(2.0)
    angle, torque = (np.tile(one, (2, 1)) for one in (rig.angle, rig.torque))
    batch = tvident.identify(angle, torque, sample_rate=1000, method="paper")
    with pytest.raises(ValueError, match="only a single record has a report"):
        batch.report(tmp_path / "x.html")


def test_the_command_shows_every_channel_of_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    tvident.simulate_torsional_rig(3.0).save("rig.csv")
    call = ["report", "rig.csv", "--angle", "angle", "--torque", "torque", "--time", "time", "--term", "offset"]
    done = CliRunner().invoke(main, [*call, "-o", "page.html"])
    assert done.exit_code == 0, done.output
    assert done.output.endswith("Written: page.html\n")
    text = Path("page.html").read_text(encoding="utf-8")
    for name in (
        "Angle",
        "Torque",
        "slider_position",
        "Stiffness K",
        "Torque, averaged over the test function",
        "Status over time",
    ):
        assert text.count(f'"title": "{name}"') == 1
    assert '"title": "angle"' not in text
    for output, message in (("page.pdf", "-o must end in .html, or be -"), ("no/page.html", "there is no such folder")):
        refused = CliRunner().invoke(main, [*call, "-o", output])
        assert refused.exit_code in {1, 2}
        assert message in refused.output


def test_without_plotly_it_is_said_what_to_install(
    result: tvident.Identification, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # A module of that name that holds no drawing library stands for one that is not installed.
    (tmp_path / "plotly.py").write_text("")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "plotly", raising=False)
    with pytest.raises(ImportError, match=r"pip install 'tvident\[report\]'"):
        result.report(tmp_path / "page.html")
    call = ["report", "rig.csv", "--angle", "angle", "--torque", "torque", "--time", "time"]
    refused = CliRunner().invoke(main, [*call, "-o", str(tmp_path / "page.html")])
    assert refused.exit_code == 2
    assert "pip install 'tvident[report]'" in refused.output
    assert not (tmp_path / "page.html").exists()


def test_a_page_speaks_as_whoever_asked_for_it(tmp_path: Path) -> None:
    rig = tvident.simulate_torsional_rig(duration=4.0)
    degrees = np.rad2deg(rig.angle)
    tvident.FileRecording({"angle": degrees, "torque": rig.torque}).write(tmp_path / "run.csv")
    tvident.identify(degrees, rig.torque, sample_rate=1000).report(tmp_path / "python.html")
    call = ["report", "run.csv", "--angle", "angle", "--torque", "torque", "--sample-rate", "1000", "-o", "typed.html"]
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path)
        done = CliRunner().invoke(main, call)
    assert done.exit_code == 0, done.output
    python, typed = ((tmp_path / f"{name}.html").read_text(encoding="utf-8") for name in ("python", "typed"))
    assert python.count("give angle_unit=") > 1
    assert "give angle_unit=" not in typed
    # Beside the advice in the summary, of which the page has two copies.
    assert typed.count("give --angle-unit deg") == python.count("give angle_unit=")


def three_records() -> tvident.IdentifiedRecords:
    """Give three records that share the inertia; the torque of the last one is late, and it begins at another time."""
    rigs = [tvident.simulate_torsional_rig(2.0 + number, seed=number, pattern="square") for number in range(3)]
    torques = [rigs[0].torque, rigs[1].torque, np.roll(rigs[2].torque, 8)]
    found = tvident.identify([one.angle for one in rigs], torques, sample_rate=1000, share=("inertia",))
    assert isinstance(found, tvident.IdentifiedRecords)
    return found


def test_a_list_of_records_has_one_page(tmp_path: Path) -> None:
    found = three_records()
    found.report(tmp_path / "list.html")
    page = content_of(tmp_path / "list.html")
    assert re.match(r"1 of 3 records not to be trusted; record 2: do not trust: ", page["verdict"])
    assert (page["title"], page["tone"], page["span"]) == ("list", "bad", [0.0, 3.999])
    assert page["facts"] == "3 records of 1.999 to 3.999 s"
    value, error = found.constants["inertia"]
    assert page["numbers"][0] == {
        "name": "Inertia I",
        "unit": "kg·m²",
        "value": tvident._arguments.with_error(value, error),  # noqa: SLF001 - as all numbers are written
        "kind": "shared by 3 records",
        "more": "",
    }
    names = [one["name"] for one in page["numbers"]]
    assert {f"Record {number}: {name}" for number in range(3) for name in ("Damping C", "Stiffness K")} <= set(names)
    assert not any(name.endswith(": Inertia I") for name in names)
    assert any(line.startswith("record 2: the torque is late by ") for line in page["advice"])
    assert page["summary"] == found.summary()
    assert any(one["words"].startswith("record 1: near an end of the record") for one in page["warnings"])
    # Each plot has the series of its record.
    for number, record in enumerate(found):
        assert titles(page, f"Record {number}: recorded") == ["Angle", "Torque"]
        chart = next(
            one for one in page["charts"] if (one["group"], one["title"]) == (f"Record {number}: found", "Stiffness K")
        )
        every = [chart["line"], *chart["band"]]
        assert {page["series"][one]["name"] for one in every} == {"Stiffness K"}
        assert {page["series"][one]["count"] for one in every} == {record.time.size}
        strips = next(one for one in page["charts"] if one["group"] == f"Record {number}: how well" and "strips" in one)
        assert all(page["series"][one["series"]]["name"] == one["flag"] for one in strips["strips"])
    rest: Any = found
    with pytest.raises(ValueError, match=r"must end in \.html; got '.*x\.txt'"):
        rest.report(tmp_path / "x.txt")
    with pytest.raises(ValueError, match=r"shows 1 to 24 records; got 0; take some of them: result\[:24\]"):
        rest[3:].report(tmp_path / "x.html")


def test_records_that_begin_at_different_times_lie_beside_each_other(tmp_path: Path) -> None:
    rig = tvident.simulate_torsional_rig(3.0, pattern="square")
    found = [
        tvident.identify(rig.angle, rig.torque, t=begin + np.arange(rig.angle.size) / 1000) for begin in (0.0, 1.7e9)
    ]
    tvident.IdentifiedRecords(found).report(tmp_path / "list.html", title="both")
    page = content_of(tmp_path / "list.html")
    assert page["span"] == [0.0, pytest.approx(2.999)]
    assert page["facts"].endswith("times of the plots count from the beginning of each")
    assert {one["start"] for one in page["series"]} == {0.0}
    assert all(0 <= time <= 3 for one in page["warnings"] for times in one["times"] for time in times)


def test_what_records_share_is_doubted_first_and_lengths_are_counted(tmp_path: Path) -> None:
    rig = tvident.simulate_torsional_rig(3.0, pattern="square")
    found = tvident.identify([rig.angle] * 2, [rig.torque, 1.05 * rig.torque], sample_rate=1000, share=("inertia",))
    assert isinstance(found, tvident.IdentifiedRecords)
    found.report(tmp_path / "list.html")
    page = content_of(tmp_path / "list.html")
    assert page["verdict"].startswith("records differ in inertia by more than their errors explain (")
    assert (page["tone"], page["facts"]) == ("bad", "2 records of 2.999 s")
    found[:1].report(tmp_path / "one.html")
    assert content_of(tmp_path / "one.html")["facts"] == "1 record of 2.999 s"
