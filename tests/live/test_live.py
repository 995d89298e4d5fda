"""``tvident live``: lines and the Lab Streaming Layer in, tables, JSON lines and another stream out."""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from tvident._live import Inlet, LiveClock, Outlet

SECONDS = float(os.environ.get("TVIDENT_LIVE", "10"))
"""Of the test with a real outlet at 1 kHz; a minute in ``make test-live``."""

RIG = tvident.simulate_torsional_rig(duration=2.0, seed=2)


def run(text: str, *options: str) -> tuple[list[dict[str, Any]], str]:
    """Give the JSON lines and the words of a run on these lines."""
    done = session(text, *options)
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()], done.stderr


def session(text: str, *options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", "from tvident._command_line import main; main()", "live", "-", *options]
    return subprocess.run(command, input=text, capture_output=True, text=True, check=False, timeout=120)


@pytest.mark.slow
def test_csv_and_json_lines_become_json_lines_with_the_batchs_numbers() -> None:
    t, angle, torque = (np.asarray(each) for each in (RIG.time, RIG.angle, RIG.torque))
    csv = "t,torque [N m],angle\n" + "".join(
        f"{a!r},{c!r},{b!r}\n" for a, b, c in zip(t.tolist(), angle.tolist(), torque.tolist(), strict=True)
    )
    lines = "".join(
        json.dumps({"stamp": a, "joint": {"angle": b, "torque": c}}) + "\n"
        for a, b, c in zip(t.tolist(), angle.tolist(), torque.tolist(), strict=True)
    )
    batch = tvident.identify(angle, torque, sample_rate=1000, method="paper")
    cases = ((csv, ("angle", "torque", "t")), (lines, ("joint.angle", "joint.torque", "stamp")))
    for text, (one, other, stamp) in cases:
        found, words = run(text, "--angle", one, "--torque", other, "--time", stamp, "--sample-rate", "1000")
        assert np.allclose([row["timestamp"] for row in found], t, atol=1e-9)
        stiffness = np.array([row["stiffness"] for row in found], dtype=float)
        assert np.array_equal(stiffness, batch.stiffness, equal_nan=True)
        assert [row["status"] for row in found] == batch.status.tolist()
        assert "1000 Hz nominal, 1000 Hz effective" in words
        assert "lost samples: 0" in words


@pytest.mark.parametrize(
    ("header", "separator", "decimal", "factors"),
    [
        ("Zeit;Winkel;Moment\nms;°;Nmm\n", ";", ",", (1e3, 180 / np.pi, 1e3)),
        ('"Zeit/ms","Winkel [mrad]","Moment (mNm)"\n', ",", ".", (1e3, 1e3, 1e3)),
        ("Zeit\tWinkel [mm]\tMoment [N]\n", "\t", ".", (1, 1e3, 1)),
        ('"Zeit","Winkel [mrad]","Moment"\n', ",", ",", (1, 1e3, 1)),
    ],
)
def test_units_of_a_header_are_converted(
    header: str, separator: str, decimal: str, factors: tuple[float, float, float]
) -> None:
    columns = [each * factor for each, factor in zip((RIG.time, RIG.angle, RIG.torque), factors, strict=True)]
    quoted = '"{}"' if '"' in header else "{}"
    numbers = np.array(columns).T[:900].tolist()
    text = "\n".join(separator.join(quoted.format(repr(one).replace(".", decimal)) for one in row) for row in numbers)
    options = ("--angle", "Winkel", "--torque", "Moment", "--time", "Zeit", "--sample-rate", "1000")
    found, words = run(header + text, *options)
    expected = tvident.identify(RIG.angle[:900], RIG.torque[:900], sample_rate=1000, method="paper").stiffness
    stiffness = np.array([row["stiffness"] for row in found], dtype=float)
    # Rounding of what was converted there and back, by the condition of windows.
    np.testing.assert_allclose(stiffness, expected, rtol=1e-7)
    np.testing.assert_allclose([row["timestamp"] for row in found], RIG.time[:900], atol=1e-9)
    assert "could not be read" not in words


@pytest.mark.slow
def test_settings_of_a_result_in_weak_form_give_its_stream(tmp_path: Path) -> None:
    earlier = tvident.identify(RIG.angle, RIG.torque, sample_rate=1000)
    (tmp_path / "chosen.json").write_text(json.dumps(earlier.settings))
    text = "".join(f"{a!r} {b!r}\n" for a, b in zip(RIG.angle.tolist(), RIG.torque.tolist(), strict=True))
    options = ("--angle", "0", "--torque", "1", "--sample-rate", "1000", "--settings", str(tmp_path / "chosen.json"))
    found, words = run(text, *options)
    stream = tvident.IdentificationStream(sample_rate=1000, settings=earlier.settings)
    expected = np.concatenate([stream.push(RIG.angle, RIG.torque).stiffness, stream.finish().stiffness])
    assert np.array_equal(np.array([row["stiffness"] for row in found], dtype=float), expected, equal_nan=True)
    assert f"each {stream.delay} samples" in words


def test_a_table_and_a_counter() -> None:
    rows = [f"{k} {a!r} {b!r}\n" for k, (a, b) in enumerate(zip(RIG.angle.tolist(), RIG.torque.tolist(), strict=True))]
    del rows[700:703]
    command = [
        sys.executable,
        "-c",
        "from tvident._command_line import main; main()",
        "live",
        "--to",
        "table",
        "--every",
        "0.5",
    ]
    command += ["--angle", "1", "--torque", "2", "--counter", "0", "--sample-rate", "1000"]
    done = subprocess.run(command, input="".join(rows), capture_output=True, text=True, check=False, timeout=120)
    assert "stiffness [N m/rad]" in done.stdout.splitlines()[0]
    assert 3 <= len(done.stdout.splitlines()) <= 8
    assert "lost samples: 3" in done.stderr
    assert "samples: 2000 taken in" in done.stderr


def clocked(stamps: Sequence[float], period: float = 1e-3) -> tuple[LiveClock, list[float]]:
    """Give a clock that saw these stamps, and which samples came out: NaN for lost ones."""
    clock = LiveClock(period)
    rows = [row for number, stamp in enumerate(stamps) for row in clock.rows((stamp, float(number), 0.0))]
    return clock, [row[1] for row in [*rows, *clock.rest()]]


def test_losses_are_found_where_they_are_and_jitter_is_none() -> None:
    generator = np.random.default_rng(1)
    stamps = np.arange(20_000) * 1e-3 * (1 + 80e-6) + 7.0
    jittered = stamps + 0.2e-3 * generator.uniform(-1, 1, stamps.size)
    held = jittered.copy()
    held[5000:5006] = held[5006]  # a driver that gives six at once
    clock, numbers = clocked(held.tolist())
    assert (clock.lost, len(numbers)) == (0, 20_000)
    assert clock.rate.period == pytest.approx(1e-3 * (1 + 80e-6), abs=5 * clock.rate.error)
    assert clock.rate.error < 1e-8
    gone = np.delete(jittered, [*range(3000, 3004), 12_000])
    clock, numbers = clocked(gone.tolist())
    assert clock.lost == 5
    lost = np.flatnonzero(np.isnan(numbers))
    assert np.array_equal(lost, [3000, 3001, 3002, 3003, 12_000])
    assert clock.rate.period == pytest.approx(1e-3 * (1 + 80e-6), abs=5 * clock.rate.error)
    assert re.search(r"drift -(79|80)\.", "\n".join(clock.words()))


def test_samples_that_came_twice_and_clocks_that_were_set_keep_windows_apart() -> None:
    stamps = np.arange(6000) * 1e-3 + 7.0
    twice = np.insert(stamps, 3000, stamps[2990:3000])
    set_back, set_forward = (stamps + np.where(np.arange(6000) < 3000, 0.0, by) for by in (-50.0, 5000.0))
    faster = np.r_[stamps[:3000], stamps[3000] + np.arange(3000) * 5e-4]
    for given, repeated, jumps, said in (
        (twice, 10, 0, "10 samples more came"),
        (set_back, 0, 1, "jumped 1 times"),
        (set_forward, 0, 1, "jumped 1 times"),
    ):
        clock, numbers = clocked(given.tolist())
        assert (clock.lost, clock.repeated, clock.jumps) == (0, repeated, jumps)
        assert np.array_equal(np.flatnonzero(np.isnan(numbers)), [3000])
        assert said in "\n".join(clock.words())
        assert clock.rate.period == pytest.approx(1e-3, rel=1e-9)
    clock, numbers = clocked(faster.tolist())
    assert clock.repeated == pytest.approx(1500, abs=2)
    # No window of more than three samples holds none that is missing.
    assert np.diff(np.flatnonzero(np.isnan(numbers))).max() <= 3
    # Samples of one buffer have one stamp, and come out as they came.
    for place in (0, 31):
        clock, numbers = clocked(np.repeat(stamps[place::32], 32)[:5900].tolist())
        assert (clock.lost, clock.repeated, len(numbers)) == (0, 0, 5900)
    clock, _ = clocked([*stamps[:3000], stamps[3001], stamps[3000], *stamps[3002:]])
    assert "1 stamps are before the one that came last" in "\n".join(clock.words())
    clock, _ = clocked((1000 * stamps[:100]).tolist())
    assert "say their unit" in "\n".join(clock.words())


def test_samples_without_a_stamp_keep_their_places() -> None:
    stamps = np.delete(np.arange(6000) * 1e-3 + 7.0, slice(3020, 3030))
    stamps[3001:3040] = np.nan
    stamps[3045] = np.nan
    _, numbers = clocked(stamps.tolist())
    there = np.array(numbers)[~np.isnan(numbers)]
    assert np.array_equal(there, np.arange(5990))


def test_counters_that_begin_anew_repeat_or_overtake() -> None:
    numbers, stamps = np.arange(2000), np.arange(2000) * 1e-3

    def counted(order: npt.NDArray[np.int_], counter: npt.NDArray[np.int_]) -> tuple[LiveClock, list[float]]:
        clock = LiveClock(1e-3)
        rows = [
            row
            for number, count in zip(order.tolist(), counter.tolist(), strict=True)
            for row in clock.rows((float(stamps[number]), float(number), 0.0), float(count))
        ]
        return clock, [row[1] for row in rows]

    # Eight bits: 253 to 257 are lost where the counter begins anew.
    some = np.delete(numbers, slice(253, 258))
    clock, found = counted(some, some % 256)
    assert (clock.lost, clock.jumps, len(found)) == (5, 0, 2000)
    assert np.array_equal(np.flatnonzero(np.isnan(found)), np.arange(253, 258))
    # One came twice, and one too late for its place.
    order = np.r_[numbers[:900], 899, numbers[900:1000], 1001, 1000, numbers[1002:]]
    clock, found = counted(order, order)
    assert (clock.lost, clock.repeated, clock.jumps, len(found)) == (1, 2, 0, 2000)
    assert np.array_equal(np.flatnonzero(np.isnan(found)), [1000])
    assert np.array_equal(np.delete(found, 1000), np.delete(numbers, 1000))


def test_a_rate_that_is_not_the_nominal_one_is_said() -> None:
    clock, _ = clocked((np.arange(5000) / 990).tolist())
    assert "give --sample-rate 990" in "\n".join(clock.words())


def test_what_cannot_be_read_is_missing_and_said() -> None:
    rows = [f"{a!r},{b!r}\n" for a, b in zip(RIG.angle[:900].tolist(), RIG.torque[:900].tolist(), strict=True)]
    rows[300] = "1.0;oops\n"
    rows[302] = "0,001,0,002\n"
    rows[304] = rows[304].replace("\n", ",\n")
    found, words = run("".join(rows), "--angle", "0", "--torque", "1", "--sample-rate", "1000")
    assert len(found) == 900
    # Nothing came at 300: windows that hold it are solved from the others, and say so.
    assert found[300]["stiffness"] is not None
    assert tvident.Status(found[300]["status"]) & tvident.Status.GAP
    assert "2 lines could not be read" in words


@pytest.mark.slow
def test_a_mark_of_the_alphabet_hides_no_sample_and_no_name() -> None:
    """The first sample was taken for a header, and `t` not found."""
    rows = "".join(f"{a!r},{b!r}\n" for a, b in zip(RIG.angle[:50].tolist(), RIG.torque[:50].tolist(), strict=True))
    for header, (one, other) in (("", ("0", "1")), ("angle,torque\n", ("angle", "torque"))):
        found, words = run(f"\ufeff{header}{rows}", "--angle", one, "--torque", other, "--sample-rate", "1000")
        assert len(found) == 50
        assert "could not be read" not in words


def test_numbers_that_python_alone_reads_are_missing() -> None:
    found, words = run(
        "0.1,0.2\n1_000,0.3\n" + "0.1,0.2\n" * 20, "--angle", "0", "--torque", "1", "--sample-rate", "1000"
    )
    assert len(found) == 22
    assert "1 lines could not be read" in words


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        (
            "angle,torque\n1,2\n".encode("utf-16"),
            "lines must be UTF-8; they hold the character NUL, as UTF-16 does; write them",
        ),
        (b'"1"\r2,"3"\n4,5\n', "quotes must close within a line of CSV; got"),
    ],
)
def test_lines_of_another_alphabet_are_refused_with_the_cure(lines: bytes, words: str) -> None:
    command = [sys.executable, "-m", "tvident", "live", "--angle", "0", "--torque", "1", "--sample-rate", "1000"]
    done = subprocess.run(command, input=lines, capture_output=True, check=False, timeout=120)
    assert done.returncode == 2
    assert words in done.stderr.decode()
    assert "universal-newline" not in done.stderr.decode()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--sample-rate", "1000", "--method", "auto"], "whole record"),
        (["--sample-rate", "1000", "--exponent", "5"], "got a WeakForm in a stream"),
        ([], "needs its sample rate"),
        (["--sample-rate", "1000", "--time", "9"], "there are"),
    ],
)
def test_wrong_calls_say_what_would_be_right(options: list[str], words: str) -> None:
    command = [
        sys.executable,
        "-c",
        "from tvident._command_line import main; main()",
        "live",
        "--angle",
        "0",
        "--torque",
        "1",
    ]
    done = subprocess.run(
        [*command, *options], input="1,2\n3,4\n", capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 2
    assert words in done.stderr


def test_a_real_outlet_loses_nothing_and_comes_back_with_the_stated_delay() -> None:
    pylsl = pytest.importorskip("pylsl")
    name = f"tvident-test-{os.getpid()}"
    count, block = int(1000 * SECONDS), 20
    t = np.arange(count) / 1000
    angle = 0.2 * np.sin(2 * np.pi * 2 * t) + 0.1 * np.sin(2 * np.pi * 7 * t)
    torque = 15 * angle + 0.05 * np.gradient(angle, t) + 0.01 * np.gradient(np.gradient(angle, t), t)
    outlet = Outlet(name, [("angle", "rad"), ("torque", "N m")], 1000.0)
    code = "from tvident._command_line import main; main()"
    command = [sys.executable, "-c", code, "live", "--lsl", name, "--angle", "angle", "--torque", "torque"]
    command += ["--to", "nothing", "--lsl-output", f"{name}-out", "--duration", str(SECONDS + 6)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as program:
        back = Inlet(f"{name}-out", ["stiffness", "stiffness_stderr", "status"], timeout=30.0)
        came: list[list[float]] = []

        def listen() -> None:
            for piece in back.pieces(0.2):
                came.extend(piece)
                if len(came) >= count or program.poll() is not None:
                    return

        listener = threading.Thread(target=listen)
        listener.start()
        while not outlet._outlet.have_consumers():  # noqa: SLF001 - the program looks for it
            time.sleep(0.05)
        begin = pylsl.local_clock() + 0.2
        for first in range(0, count, block):
            time.sleep(max(0.0, begin + t[min(first + block, count) - 1] - pylsl.local_clock()))
            some = slice(first, first + block)
            outlet.show((begin + t[some]).tolist(), [angle[some].tolist(), torque[some].tolist()])
        listener.join(timeout=30)
        _, words = program.communicate(timeout=60)
    delay = tvident.IdentificationStream(sample_rate=1000, method="paper").delay
    assert f"samples: {count} taken in, parameters of {count} given, each {delay} samples" in words, words
    assert "lost samples: 0" in words
    stamps = np.array([row[0] for row in came])
    assert stamps.size == count
    # Both clocks are this machine's: LSL's synchronisation of stamps is good to a millisecond.
    assert np.abs(stamps - begin - t).max() < 2e-3
    found = np.array([row[1] for row in came])
    assert np.nanmedian(np.abs(found[300:-300] - 15)) < 0.05
    assert not math.isnan(found[count // 2])


def test_few_losses_by_a_counter_alone_are_no_wrong_rate() -> None:
    clock = LiveClock(0.001)
    for number in (count for count in range(1000) if count % 100):
        clock.rows((math.nan, 1.0, 2.0), number)
    assert clock.lost == 9
    assert not any("more samples are missing" in said for said in clock.words())


def test_a_damaged_byte_is_a_lost_sample() -> None:
    """A NUL anywhere in the first block ended the session."""
    rows = [f"{a!r},{b!r}\n" for a, b in zip(RIG.angle[:900].tolist(), RIG.torque[:900].tolist(), strict=True)]
    rows[500] = "\0\1,\0\n"
    found, words = run("".join(rows), "--angle", "0", "--torque", "1", "--sample-rate", "1000")
    assert len(found) == 900
    assert "1 lines could not be read and count as missing" in words


def test_stamps_of_another_rate_are_said_at_once() -> None:
    clock, _ = clocked((np.arange(400) / 1000).tolist(), period=1 / 500)
    words = "stamps show 1000 Hz, not 500: parameters are wrong; give --sample-rate 1000"
    assert words in clock.comes_faster
    assert words in clock.words()[0]
    twice, _ = clocked(np.repeat(np.arange(2000) / 1000, np.where(np.arange(2000) % 10, 1, 2)).tolist())
    assert not twice.comes_faster


@pytest.mark.parametrize("every", [1, 5])
def test_lines_that_come_twice_are_no_higher_rate(every: int) -> None:
    """Where every line came twice, `--sample-rate 2001.022` was to be given."""
    numbers = np.arange(4000)
    order = np.repeat(numbers, np.where(numbers % every, 1, 2)).tolist()
    clock, counted = LiveClock(1e-3), LiveClock(1e-3)
    for number in order:
        row = (number * 1e-3, math.sin(number), math.nan)
        clock.rows(row)
        counted.rows(row, float(number))
        assert not clock.comes_faster
        assert not counted.comes_faster
    assert clock.repeated == pytest.approx(4000 / every, abs=20)
    assert counted.repeated == 4000 / every
    assert "samples more came" in "\n".join(clock.words())


def test_buffers_whose_samples_are_equal_are_counted_whole() -> None:
    clock = LiveClock(1 / 500)
    for number in range(2000):
        # At rest but for one sample of a buffer of eight.
        clock.rows((number // 8 * 8e-3, float(number % 8 == 7), 0.0))
    assert "give --sample-rate 100" in clock.comes_faster


def test_what_came_twice_before_the_clock_was_set_says_nothing_of_the_rate() -> None:
    """Two buffers of one stamp each look like a higher rate."""
    clock = LiveClock(1e-3)
    for number in range(4000):
        clock.rows((number // 2 * 1e-3, float(number), 0.0))
    assert clock.comes_faster
    for number in range(300):
        clock.rows((-100 + number // 150 * 0.15, float(number), 0.0))
        assert not clock.comes_faster
    assert clock.repeated > 1000


@pytest.mark.parametrize(
    ("lines", "words"), [('{"angle": 1.0, "torque": 2.0}\n' * 5, "which has no 'tork'"), ("", "got none that does")]
)
def test_lines_without_the_channel_end_with_the_key_that_is_missing(lines: str, words: str) -> None:
    """Nothing but nulls went out, and the session ended well."""
    done = session(lines, "--angle", "angle", "--torque", "tork", "--sample-rate", "1000")
    assert done.returncode == 1
    assert words in done.stderr
    assert "lines must hold the channels; got none that does" in done.stderr
