"""Nothing that is written costs what was there: inputs, other outputs, other people's files, modes, links, pipes."""

from __future__ import annotations

import csv
import io
import os
import pty
import resource
import signal
import stat
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import tvident
from commands import TVIDENT, run, run_program
from tvident import recordings
from tvident._command_line import main
from tvident._commands.own_files import check_own, note_own
from tvident._files import check_apart, printable, replaced, write_csv, write_table

IDENTIFY = ("identify", "rig.csv", "--angle", "angle", "--torque", "torque", "--time", "time", "--no-progress")


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[Path]:
    """Give a folder with a short recording, which nothing may change."""
    tvident.simulate_torsional_rig(2.0).save(tmp_path / "rig.csv")
    np.savetxt(tmp_path / "mask.csv", np.ones(2000), header="m", comments="")
    before = {name: (tmp_path / name).read_bytes() for name in ("rig.csv", "mask.csv")}
    yield tmp_path
    assert {name: (tmp_path / name).read_bytes() for name in before} == before
    assert not [path.name for path in tmp_path.iterdir() if path.name.startswith(".")]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("-o", "rig.csv"), "results must not replace the recording; got 'rig.csv'"),
        (("-o", "../{folder}/./rig.csv"), "results must not replace the recording"),
        (("-o", "link.csv"), "results must not replace the recording"),
        (("-o", "hard.csv"), "results must not replace the recording"),
        (("--settings-output", "rig.csv"), "the settings of this run must not replace the recording"),
        (("--settings-output", "link.csv"), "the settings of this run must not replace the recording"),
        (("--plot", "rig.png"), "the picture must not replace the recording"),
        (("--mask", "mask.csv", "-o", "mask.csv"), "results must not replace the mask"),
        (("--mask", "mask.csv", "--settings-output", "mask.csv"), "must not replace the mask"),
        (("-o", "out.csv", "--settings-output", "out.csv"), "the settings of this run and results must be two files"),
        (("-o", "out.csv", "--settings-output", "new.csv"), "the settings of this run and results must be two files"),
        (("--plot", "out.png", "--settings-output", "./out.png"), "must be two files"),
        (("--settings", "s.json", "--settings-output", "s.json"), "must not replace earlier settings"),
    ],
)
def test_no_output_names_an_input_or_another_output(
    folder: Path, monkeypatch: pytest.MonkeyPatch, options: tuple[str, ...], message: str
) -> None:
    (folder / "link.csv").symlink_to("rig.csv")
    (folder / "hard.csv").hardlink_to(folder / "rig.csv")
    (folder / "rig.png").symlink_to("rig.csv")
    (folder / "new.csv").symlink_to("out.csv")
    (folder / "s.json").write_text("{}")
    monkeypatch.chdir(folder)
    done = CliRunner().invoke(main, [*IDENTIFY, *(option.replace("{folder}", folder.name) for option in options)])
    assert done.exit_code == 2
    assert message in " ".join(done.stderr.split())
    assert not (folder / "out.csv").exists()
    assert not (folder / "out.png").exists()


def test_derivatives_replace_no_recording_either(folder: Path) -> None:
    (folder / "link.csv").symlink_to("rig.csv")
    (folder / "picture.svg").symlink_to("rig.csv")
    for output in (("-o", "link.csv"), ("--plot", "picture.svg")):
        done = run("derivatives", "rig.csv", "--channel", "angle", "--sample-rate", 1000, *output, cwd=folder)
        assert done.returncode == 2
        assert "must not replace the recording" in done.stderr


def test_files_that_do_not_exist_yet_are_compared_where_links_end(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "same").symlink_to("folder")
    one, other = tmp_path / "folder" / "x.csv", tmp_path / "same" / "x.csv"
    with pytest.raises(ValueError, match="a and b must be two files"):
        check_apart({"b": one, "a": other}, {})
    check_apart({"a": one, "b": tmp_path / "x.csv"}, {"c": None})


def test_the_demo_replaces_its_own_files_and_no_others(tmp_path: Path) -> None:
    (tmp_path / "recording.csv").write_text("mine")
    refused = run("demo", "--folder", ".", cwd=tmp_path)
    assert refused.returncode == 2
    assert "holds recording.csv of somebody else; give another --folder" in " ".join(refused.stderr.split())
    assert [path.name for path in tmp_path.iterdir()] == ["recording.csv"]
    assert (tmp_path / "recording.csv").read_text() == "mine"


def test_what_the_demo_wrote_is_its_own_until_somebody_changes_it(tmp_path: Path) -> None:
    names = ("a.csv", "b.png")
    check_own(tmp_path, names)
    for content in (b"first", b"second"):
        for name in names:
            (tmp_path / name).write_bytes(content)
            note_own(tmp_path, name)
        check_own(tmp_path, names)
    (tmp_path / "b.png").write_bytes(b"changed by hand")
    with pytest.raises(ValueError, match=r"holds b\.png of somebody else"):
        check_own(tmp_path, names)
    (tmp_path / "b.png").unlink()
    check_own(tmp_path, names)
    # The very same content, but another's file.
    (tmp_path / "other.png").write_bytes(b"second")
    (tmp_path / "b.png").symlink_to("other.png")
    with pytest.raises(ValueError, match="of somebody else"):
        check_own(tmp_path, names)
    (tmp_path / "b.png").unlink()
    (tmp_path / ".tvident-demo.json").write_text("[")
    with pytest.raises(ValueError, match=r"holds a\.csv of somebody else"):
        check_own(tmp_path, names)


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o666])
def test_a_replaced_file_keeps_its_mode(folder: Path, mode: int) -> None:
    place = folder / "result.csv"
    place.write_text("old")
    place.chmod(mode)
    assert run(*IDENTIFY, "-o", "result.csv", cwd=folder).returncode == 0
    assert stat.S_IMODE(place.stat().st_mode) == mode
    assert place.read_text().startswith("time [s]")


def test_a_new_file_has_the_mode_that_the_user_asks_of_new_files(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        with replaced(tmp_path / "new.csv") as file:
            file.write(b"x")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "new.csv").stat().st_mode) == 0o640


def test_a_link_stays_a_link_and_its_target_is_written(folder: Path) -> None:
    (folder / "far").mkdir()
    target = folder / "far" / "target.csv"
    target.write_text("old")
    for name, leads_to in (("link.csv", "far/target.csv"), ("second.csv", "link.csv"), ("new.csv", "far/new.csv")):
        (folder / name).symlink_to(leads_to)
        assert run(*IDENTIFY, "-o", name, cwd=folder).returncode == 0
        assert (folder / name).is_symlink()
        assert (folder / name).read_text().startswith("time [s]")
    assert target.read_text().startswith("time [s]")
    assert {path.name for path in (folder / "far").iterdir()} == {"target.csv", "new.csv"}
    (folder / "loop.csv").symlink_to("loop.csv")
    refused = run(*IDENTIFY, "-o", "loop.csv", cwd=folder)
    assert refused.returncode == 1
    assert "these links lead in a circle" in refused.stderr


@pytest.mark.parametrize("content", ['{"mine": 1}', "[1, 2]", "notes", None])
def test_settings_beside_results_replace_settings_alone(folder: Path, content: str | None) -> None:
    beside = folder / "x.csv.settings.json"
    if content is None:
        beside.mkdir()
    else:
        beside.write_text(content)
    done = run(*IDENTIFY, "-o", "x.csv", cwd=folder)
    assert done.returncode == 1
    assert "x.csv.settings.json: settings of x.csv stand in a file of this name, and this one holds none" in done.stderr
    rig = tvident.simulate_torsional_rig(duration=1.0, pattern="constant")
    result = tvident.identify(rig.angle, rig.torque, sample_rate=1000, stiffness="constant")
    with pytest.raises(recordings.FileError, match="this one holds none; move it away"):
        result.save(folder / "x.csv")
    assert not (folder / "x.csv").exists()
    assert content is None or beside.read_text() == content


def test_a_pipe_is_written_to_and_stays_a_pipe(folder: Path) -> None:
    os.mkfifo(folder / "pipe.csv")
    refused = run(*IDENTIFY, "-o", "pipe.csv", cwd=folder)
    assert refused.returncode == 1
    assert "nobody reads this pipe" in refused.stderr
    read: list[str] = []
    reader = threading.Thread(target=lambda: read.append((folder / "pipe.csv").read_text()))
    reader.start()
    time.sleep(0.2)
    assert run(*IDENTIFY, "-o", "pipe.csv", cwd=folder).returncode == 0
    reader.join()
    assert len(read[0].splitlines()) == 2001
    assert stat.S_ISFIFO((folder / "pipe.csv").stat().st_mode)


# No device that others need is named here: a test that fails would cost the machine its /dev/null.
@pytest.mark.slow
def test_devices_and_streams_of_the_process_are_written_to(folder: Path) -> None:
    parent, child = pty.openpty()
    device = os.ttyname(child)
    assert run(*IDENTIFY, "--settings-output", device, cwd=folder).returncode == 0
    assert stat.S_ISCHR(Path(device).stat().st_mode)
    assert os.read(parent, 100).startswith(b"{")
    os.close(parent)
    os.close(child)
    shown = run_program(*IDENTIFY, "--settings-output", "/proc/self/fd/1", cwd=folder)
    assert shown.returncode == 0
    assert shown.stdout.startswith("{\n")
    assert "stiffness" in shown.stdout.partition("\n}\n")[2]
    command = [TVIDENT, *IDENTIFY, "--settings-output", "/proc/self/fd/1"]
    with (folder / "all.txt").open("wb") as file:
        subprocess.run(command, cwd=folder, stdout=file, check=True)
    assert (folder / "all.txt").read_text() == shown.stdout
    with Path("/dev/full").open("wb") as file:
        full = subprocess.run(command, cwd=folder, stdout=file, stderr=subprocess.PIPE, text=True, check=False)
    assert full.returncode == 1
    assert "/proc/self/fd/1: No space left on device" in full.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("redirected", "status", "said"),
    [
        (">&-", 0, ""),
        ("-o - >&-", 2, "-o - needs standard output; it is closed"),
        ("-o - >/dev/full", 1, "the output: No space left on device"),
        (">/dev/full", 1, "the output: No space left on device"),
        ("2>&-", 0, ""),
    ],
)
def test_streams_that_are_closed_or_full(folder: Path, redirected: str, status: int, said: str) -> None:
    command = ["bash", "-c", f'"$@" {redirected}', "bash", TVIDENT, *IDENTIFY]
    # As users have it: a buffer that is not empty at the end is written then.
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == status, done.stderr
    assert said in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("name", ["old.csv", "old.npz", "old.png", "old.json"])
def test_a_full_disk_leaves_the_old_file(folder: Path, name: str) -> None:
    def fill() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (64, 64))

    (folder / name).write_text("old")
    option = {".png": "--plot", ".json": "--settings-output"}.get(Path(name).suffix, "-o")
    done = run_program(*IDENTIFY, option, name, preexec_fn=fill, cwd=folder)
    assert done.returncode == 1
    assert f"{name}: File too large" in done.stderr
    assert (folder / name).read_text() == "old"


def test_long_names_are_written(folder: Path) -> None:
    for name in ("x" * 251 + ".csv", "é" * 125 + ".csv"):
        assert run(*IDENTIFY, "-o", name, cwd=folder).returncode == 0
        assert (folder / name).is_file()


@pytest.mark.first(1)
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_a_signal_leaves_no_temporary_file(tmp_path: Path, number: signal.Signals) -> None:
    (tmp_path / "old.csv").write_text("old")
    program = (
        "import time; from pathlib import Path; from tvident._files import replaced\n"
        "with replaced(Path('old.csv')) as file:\n"
        "    file.write(b'half'); file.flush(); print('writing', flush=True); time.sleep(30)\n"
    )
    command = [sys.executable, "-c", program]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"writing\n"
        assert len(list(tmp_path.iterdir())) == 2
        process.send_signal(number)
        assert process.wait(timeout=10) == -number
    assert [path.name for path in tmp_path.iterdir()] == ["old.csv"]
    assert (tmp_path / "old.csv").read_text() == "old"


def test_signals_mean_afterwards_what_they_meant_before(tmp_path: Path) -> None:
    heard: list[int] = []
    before = signal.signal(signal.SIGTERM, lambda number, _: heard.append(number))
    try:
        with replaced(tmp_path / "x.csv") as file:
            file.write(b"x")
            signal.raise_signal(signal.SIGTERM)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert heard == [signal.SIGTERM]
    assert (tmp_path / "x.csv").read_bytes() == b"x"


@pytest.mark.parametrize(
    "name", ["a,b", 'say "so"', "two\nlines", "=1+1", "+x", "-x", "@SUM(1)", "\tx", "\x1b[31mred", " x ", "a;b", "#x"]
)
def test_names_of_columns_are_one_cell_and_no_formula(name: str) -> None:
    file = io.BytesIO()
    write_csv(file, {"time": np.arange(2.0), name: np.ones(2)}, {"time": "s"})
    rows = list(csv.reader(io.StringIO(file.getvalue().decode())))
    assert [len(row) for row in rows] == [2, 2, 2]
    assert rows[0][0] == "time [s]"
    assert rows[0][1].lstrip("'").strip() == printable(name).strip()
    assert not rows[0][1].startswith(("=", "+", "-", "@", "\t"))
    assert rows[0][1].isprintable()


def test_names_of_columns_are_no_arguments_of_who_writes_them(tmp_path: Path) -> None:
    columns = {"file": np.arange(3.0), "allow_pickle": np.ones(3)}
    write_table(tmp_path / "x.npz", columns, {})
    assert list(recordings.read(tmp_path / "x.npz")) == list(columns)


@pytest.mark.parametrize(
    "arguments",
    [
        ("info", "\x1b[31mmissing.csv"),
        ("info", "\x1b[31mmissing"),
        ("info", "two\nlines.csv"),
        ("info", "named.npz"),
        ("derivatives", "named.npz", "--channel", "\x1b[31mwrong", "--sample-rate", "1"),
        ("derivatives", "rig.csv", "--channel", "angle", "--sample-rate", "1", "-o", "\x1b[31m.txt"),
        ("derivatives", "rig.csv", "--channel", "angle", "--sample-rate", "1", "-o", "\x1b/x.csv"),
        ("derivatives", "rig.csv", "--channel", "angle", "--sample-rate", "1", "--plot", "\x1b.gif"),
        ("identify", "rig.csv", "--angle", "angle", "--torque", "torque", "--delta", "1", "--lag", "\x1b[2J"),
        ("identify", "rig.csv", "--angle", "angle", "--torque", "torque", "--delta", "1", "--inertia", "\x1b[2J"),
        ("identify", "rig.csv", "--angle", "angle", "--torque", "torque", "--delta", "1", "--term", "\x1b[2J"),
        ("identify", "rig.csv", "--angle", "angle", "--torque", "torque", "--delta", "1", "--settings", "\x1b[2J"),
        ("--\x1b[31m",),
        ("\x1b[31mcommand",),
        ("info", "--\x1b[31m"),
        ("simulate", "\x1b[31m.csv", "--duration", "1"),
        ("simulate", "\x1b[31m.csv", "--pattern", "\x1b[31m"),
    ],
)
def test_no_name_speaks_to_the_terminal(
    folder: Path, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...]
) -> None:
    names = ("\x1b]0;owned\x07\x1b[31mred\u202e", "x" * 1000)
    write_table(folder / "named.npz", dict.fromkeys(names, np.arange(5.0)), {})
    monkeypatch.chdir(folder)
    said = CliRunner().invoke(main, arguments).output
    assert said
    assert all(line.isprintable() for line in said.splitlines())
    assert max(map(len, said.splitlines())) < 2000
    assert "Traceback" not in said


@pytest.mark.slow
def test_names_of_channels_are_no_names_of_files_and_no_formulas(folder: Path) -> None:
    channels = recordings.read(folder / "rig.csv")
    names = ("a$b_{$" + "x" * 300, "t" * 300)
    write_table(folder / "x.npz", dict(zip(names, list(channels.values())[1:3], strict=True)), {})
    period = ("--sample-rate", 1000, "--no-progress")
    done = run("derivatives", "x.npz", "--channel", names[0], *period, "--plot", "x.png", cwd=folder)
    assert done.returncode == 0, done.stderr
    done = run("identify", "x.npz", "--angle", names[0], "--torque", names[1], *period, "-o", "y.csv", cwd=folder)
    assert done.returncode == 0, done.stderr
    done = run("identify", "x.npz", "--angle", names[0], "--torque", "z" * 300, *period, cwd=folder)
    assert done.returncode == 2
    assert "has no channel" in done.stderr


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("{}", "settings must be those of an earlier result"),
        ("[" * 100_000, "holds no settings: brackets are nested too deeply"),
        ("\0", "holds no settings"),
        (
            '{"kinds": {}, "known": {}, "terms": [], "lag": 0, "quantisation": 0, "form": []}',
            "those of an earlier result",
        ),
        (
            '{"kinds": {}, "known": {}, "terms": [], "lag": 0, "quantisation": 0, "form": "x"}',
            "those of an earlier result",
        ),
        (
            '{"kinds": {}, "known": {}, "terms": [], "lag": 0, "quantisation": 0, "form": "weak"}',
            "of an earlier result",
        ),
    ],
)
def test_settings_that_are_none(folder: Path, content: str, message: str) -> None:
    (folder / "s.json").write_text(content)
    done = run(*IDENTIFY, "--settings", "s.json", cwd=folder)
    assert done.returncode in {1, 2}
    assert message in " ".join(done.stderr.split())
    assert "Traceback" not in done.stderr


def test_settings_of_a_list_of_records_are_of_none_of_them(folder: Path) -> None:
    """They ended in a traceback."""
    rig = tvident.simulate_torsional_rig(duration=2.0)
    parts = [(rig.angle[:count], rig.torque[:count]) for count in (1000, 1500)]
    found = tvident.identify([one for one, _ in parts], [other for _, other in parts], sample_rate=1000)
    found.save(folder / "list.npz")
    ran = run(*IDENTIFY, "--settings", "list.npz", cwd=folder)
    assert ran.returncode != 0
    assert "list.npz: settings must be those of one result; it holds a list of 2; save one of them" in ran.stderr


@pytest.mark.slow
@pytest.mark.parametrize("ending", [".json", ".toml", ".csv", ".npz"])
def test_settings_are_not_waited_for_at_a_pipe(folder: Path, ending: str) -> None:
    pipe = folder / f"pipe_of_settings{ending}"
    os.mkfifo(pipe)
    done = run_program(*IDENTIFY, "--settings", pipe.name, cwd=folder)
    assert done.returncode == 1
    assert "must be a file" in " ".join(done.stderr.split())


def test_any_encoding_of_the_terminal_will_do(folder: Path) -> None:
    done = run_program(*IDENTIFY, env=os.environ | {"PYTHONIOENCODING": "iso8859-5"}, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert " \\xb1 " in done.stdout


def test_explain_walks_through_what_was_found(folder: Path) -> None:
    done = run(*IDENTIFY, "--explain", cwd=folder)
    steps = [line[:2] for line in done.stdout.splitlines() if line[1:3] == ". "]
    assert steps == ["1.", "2.", "3.", "4.", "5.", "6."], done
    assert "I θ̈ + C θ̇ + K θ + offset = T" in done.stdout
    assert "K(t) known to" in done.stdout
