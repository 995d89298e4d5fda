"""``tvident live``: lines and the Lab Streaming Layer in, tables, JSON lines and another stream out."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tvident
from tvident._live import Inlet, Outlet

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


def test_units_of_keys_are_converted() -> None:
    names = ("t [ms]", "motor.angle [deg]", "torque[Nmm]")
    factors = (1e3, 180 / np.pi, 1e3)
    columns = [each * factor for each, factor in zip((RIG.time, RIG.angle, RIG.torque), factors, strict=True)]
    rows = [dict(zip(names, row, strict=True)) for row in np.array(columns).T[:900].tolist()]
    options = ("--angle", names[1], "--torque", names[2], "--time", names[0], "--sample-rate", "1000")
    found, words = run("".join(json.dumps(row) + "\n" for row in rows), *options)
    expected = tvident.identify(RIG.angle[:900], RIG.torque[:900], sample_rate=1000, method="paper").stiffness
    np.testing.assert_allclose(np.array([row["stiffness"] for row in found], dtype=float), expected, rtol=1e-7)
    assert "lost samples: 0" in words
    # What is in brackets may be a name, too.
    listed = "".join(json.dumps({"joint [left]": row[names[1]], "T": row[names[2]]}) + "\n" for row in rows)
    found, _ = run(listed, "--angle", "joint [left]", "--torque", "T", "--sample-rate", "1000")
    assert len(found) == 900


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


def test_a_damaged_byte_is_a_lost_sample() -> None:
    """A NUL anywhere in the first block ended the session."""
    rows = [f"{a!r},{b!r}\n" for a, b in zip(RIG.angle[:900].tolist(), RIG.torque[:900].tolist(), strict=True)]
    rows[500] = "\0\1,\0\n"
    found, words = run("".join(rows), "--angle", "0", "--torque", "1", "--sample-rate", "1000")
    assert len(found) == 900
    assert "1 lines could not be read and count as missing" in words


def test_samples_that_came_twice_with_their_stamps_are_left_out() -> None:
    """They were samples, and the parameters of their windows those of another motion."""
    order = np.repeat(np.arange(900), np.where(np.arange(900) % 50, 1, 2))
    angle, torque = RIG.angle.tolist(), RIG.torque.tolist()
    rows = [f"{n / 1000!r},{angle[n]!r},{torque[n]!r}\n" for n in order.tolist()]
    options = ("--time", "0", "--angle", "1", "--torque", "2", "--sample-rate", "1000")
    found, words = run("".join(rows), *options)
    once, _ = run("".join(rows[int(k)] for k in np.flatnonzero(np.diff(order, prepend=-1))), *options)
    assert found == once
    assert "18 samples came twice" in words
    assert "lost samples: 0" in words


def test_a_damaged_byte_in_the_first_line_is_a_lost_sample() -> None:
    """A NUL there was UTF-16, and ended the session."""
    rows = [f"{a!r},{b!r}\n" for a, b in zip(RIG.angle[:900].tolist(), RIG.torque[:900].tolist(), strict=True)]
    rows[0] = "0.\0" + rows[0][3:]
    found, words = run("".join(rows), "--angle", "0", "--torque", "1", "--sample-rate", "1000")
    assert len(found) == 900
    assert "1 lines could not be read and count as missing" in words


def test_a_name_that_two_channels_have_is_refused() -> None:
    """The first of them was taken, without a word."""
    done = session(
        "angle,torque,angle\n" + "1,2,3\n" * 5, "--angle", "angle", "--torque", "torque", "--sample-rate", "1"
    )
    assert done.returncode != 0
    assert "got 'angle', which 2 have; give the number of one, 0 or 2" in done.stderr


def test_streams_of_one_name_and_channels_of_one_label_are_refused() -> None:
    """The first that answered was taken, without a word."""
    pylsl = pytest.importorskip("pylsl")
    name = f"tvident-twins-{os.getpid()}"

    def outlet(source: str) -> Any:
        info = pylsl.StreamInfo(name, "Rig", 3, 1000.0, pylsl.cf_string, source)
        info.set_channel_labels(["angle", "torque", "angle"])
        return pylsl.StreamOutlet(info)

    first = outlet(f"{name}-1")
    with pytest.raises(ValueError, match="which 2 have; give the number of one, 0 or 2"):
        Inlet(name, ["angle", "torque"])
    inlet = Inlet(name, ["0", "torque"])
    pieces = inlet.pieces(0.05)
    while not first.have_consumers():
        time.sleep(0.01)
    first.push_sample(["1.5", "2.5", "x"])
    first.push_sample(["off", "2.5", "x"])
    came: list[list[float]] = []
    while len(came) < 2:
        came += next(pieces)
    assert came[0][1:] == [1.5, 2.5]
    assert math.isnan(came[1][1])
    assert (inlet.read, inlet.unreadable) == (1, 1)
    second = outlet(f"{name}-2")
    with pytest.raises(ValueError, match=f"got 2 with name '{name}'; give one of source_id={name}-"):
        Inlet(name, ["0", "torque"])
    del second


@pytest.mark.slow
@pytest.mark.parametrize("labels", [["angle", "torque"], ["torque", "angle"]])
def test_an_outlet_that_begins_again_keeps_its_channels_or_is_refused(labels: list[str]) -> None:
    """The layer goes on with whatever has the same source: angle and torque were exchanged without a word."""
    pylsl = pytest.importorskip("pylsl")
    name = f"tvident-again-{os.getpid()}-{labels[0]}"

    def outlet(names: list[str]) -> Any:
        info = pylsl.StreamInfo(name, "Rig", 2, 1000.0, pylsl.cf_double64, f"{name}-source")
        info.set_channel_labels(names)
        return pylsl.StreamOutlet(info)

    def come(found: Any, count: int) -> list[list[float]]:
        while not found.have_consumers():
            time.sleep(0.01)
        for number in range(count):
            found.push_sample([1.0, 2.0], 100.0 + number / 1000)
        # All in one piece, which the layer compares clocks within: that took the sign of a new outlet.
        until = time.monotonic() + 20
        while inlet._inlet.samples_available() < count and time.monotonic() < until:  # noqa: SLF001
            time.sleep(0.01)
        came: list[list[float]] = []
        while len(came) < count and time.monotonic() < until:
            came += next(pieces)
        return came

    first = outlet(["angle", "torque"])
    inlet = Inlet(name, ["angle", "torque"])
    pieces = inlet.pieces(0.05)
    come(first, 30)
    # The clocks of both are compared some time after the first sample; a loss before that is none of a clock.
    inlet._inlet.time_correction(20.0)  # noqa: SLF001 - the program gets to it by itself
    del first
    second = outlet(labels)
    if labels == ["angle", "torque"]:
        came = come(second, 300)
        assert inlet.restarts == 1
        assert sum(math.isnan(row[1]) for row in came) == 1
    else:
        with pytest.raises(
            ValueError, match="an outlet that begins again must have the channels, units and rate of before"
        ):
            come(second, 300)


@pytest.mark.slow
def test_an_outlet_that_goes_without_a_source_ends_the_session_with_a_word() -> None:
    """It ended as if all had come."""
    pylsl = pytest.importorskip("pylsl")
    name = f"tvident-gone-{os.getpid()}"
    info = pylsl.StreamInfo(name, "Rig", 2, 1000.0, pylsl.cf_double64, "")
    info.set_channel_labels(["angle", "torque"])
    outlet = pylsl.StreamOutlet(info)
    command = [sys.executable, "-m", "tvident", "live", "--lsl", name, "--angle", "angle", "--torque", "torque"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as program:
        while not outlet.have_consumers():
            time.sleep(0.02)
        for _ in range(30):
            outlet.push_sample([1.0, 2.0])
        time.sleep(1.0)
        del outlet
        _, words = program.communicate(timeout=60)
    assert "the outlet went, and the session with it: give the outlet a source_id" in words
    assert program.returncode == 0


def test_silence_and_a_stream_that_is_its_own_input_are_said() -> None:
    command = [sys.executable, "-m", "tvident", "live", "--angle", "0", "--torque", "1", "--sample-rate", "1000"]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    ) as program:
        assert program.stdin is not None
        assert program.stderr is not None
        program.stdin.write("1,2\n3,4\n")
        program.stdin.flush()
        assert "nothing has come for 5 s; waiting for more; Ctrl-C ends" in program.stderr.readline()
    done = session("", "--lsl", "rig", "--lsl-output", "rig", "--angle", "0", "--torque", "1")
    assert done.returncode == 2
    assert "--lsl-output must have a name of its own" in done.stderr


@pytest.mark.parametrize(
    ("lines", "words"), [('{"angle": 1.0, "torque": 2.0}\n' * 5, "which has no 'tork'"), ("", "got none that does")]
)
def test_lines_without_the_channel_end_with_the_key_that_is_missing(lines: str, words: str) -> None:
    """Nothing but nulls went out, and the session ended well."""
    done = session(lines, "--angle", "angle", "--torque", "tork", "--sample-rate", "1000")
    assert done.returncode == 1
    assert words in done.stderr
    assert "lines must hold the channels; got none that does" in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_an_interrupt_waits_for_what_is_being_written(unbuffered: str) -> None:
    """Half a line was left in the middle of the output, and what followed it was another sample's."""
    command = [sys.executable, "-m", "tvident", "live", "--angle", "0", "--torque", "1", "--sample-rate", "1000"]
    rows = "".join(f"{a!r},{b!r}\n" for a, b in zip(RIG.angle.tolist(), RIG.torque.tolist(), strict=True))
    pipe = subprocess.PIPE
    environment = {**os.environ, "PYTHONUNBUFFERED": unbuffered}
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True, env=environment) as program:
        assert program.stdin is not None
        program.stdin.write(rows)
        program.stdin.flush()
        # Nobody reads what it writes, so it stands within a line.
        time.sleep(2.0)
        program.send_signal(signal.SIGINT)
        time.sleep(0.3)
        out, words = program.communicate(timeout=60)
    assert program.returncode == 0
    assert "ended by Ctrl-C" in words
    times = [json.loads(line)["timestamp"] for line in out.splitlines()]
    np.testing.assert_allclose(times, np.arange(len(times)) / 1000, atol=1e-9)
    assert f"parameters of {len(times)} given" in words
