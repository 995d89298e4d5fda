"""What a command does as users of other commands expect: quick help, completion, JSON, settings from files, exit codes."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import click
import numpy as np
import pytest

import tvident
from commands import run
from tvident._command_line import main
from tvident._command_line.group import COMMANDS

TVIDENT = str(Path(sys.executable).with_name("tvident"))
IDENTIFY = ("identify", "rig.npz", "--angle", "angle", "--torque", "torque", "--sample-rate", "1000")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    tvident.simulate_torsional_rig(duration=2.0).save(tmp_path / "rig.npz")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_help_and_version_do_not_wait_for_numpy() -> None:
    calls = [["--version"], ["--help"], *([name, "--help"] for name in COMMANDS)]
    code = (
        f"import sys; from tvident._command_line import main\nfor call in {calls}: main(call, standalone_mode=False)\n"
        "print(sorted({'numpy', 'tvident._core', 'pandas', 'matplotlib'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    lines = done.stdout.splitlines()
    assert lines[0] == tvident.__version__
    assert lines[-1] == "[]"
    assert sum(line.startswith("Usage: ") for line in lines) == len(calls) - 1
    assert max(map(len, lines)) <= 80


def test_every_command_is_listed_with_what_it_says_of_itself() -> None:
    context = click.Context(main)
    folder = Path(main.callback.__code__.co_filename).parent if main.callback else Path()
    files = {path.stem for path in folder.glob("*.py") if "@main.command" in path.read_text(encoding="utf-8")}
    assert set(COMMANDS) == files
    for name, sentence in COMMANDS.items():
        command = main.get_command(context, name)
        assert command is not None
        assert (command.help or "").partition("\n\n")[0].replace("\n", " ") == sentence


ASKED = {
    "bash": "complete() { :; }\n. ./script\nCOMP_WORDS=(tvident identify --inert); COMP_CWORD=2\n"
    '_tvident_completion tvident; printf "%s\\n" "${COMPREPLY[@]}"',
    "zsh": "compdef() { :; }; _describe() { print -rl -- $completions_with_descriptions; }\n. ./script\n"
    "words=(tvident identify --inert); CURRENT=3\n_tvident_completion",
    "fish": 'source ./script\ncomplete -C "tvident identify --inert"',
}
"""What makes a shell say how it would complete a line."""


@pytest.mark.parametrize(
    ("shell", "said"), [("bash", "--inertia"), ("zsh", r"--inertia:{}"), ("fish", "--inertia\t{}")]
)
def test_completion_of_names_and_options(shell: str, said: str, tmp_path: Path) -> None:
    if shutil.which(shell) is None:
        if os.environ.get("TVIDENT_REQUIRE_SHELLS"):
            pytest.fail(f"completion cannot be tried without {shell}; install it")
        pytest.skip(f"completion cannot be tried without {shell}; install it")
    (tmp_path / "script").write_text(run("completion", shell).stdout)
    path = os.pathsep.join([str(Path(TVIDENT).parent), os.environ["PATH"]])
    plain = {"bash": ["--norc"], "zsh": ["-f"], "fish": ["--no-config"]}[shell]
    done = subprocess.run(
        [shell, *plain, "-c", ASKED[shell]],
        cwd=tmp_path,
        env=os.environ | {"PATH": path, "HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    # Commas part fields in some versions of click; descriptions have them, too.
    assert done.stdout.splitlines() == [
        said.format("auto, constant, windowed, varying, a known number, or a channel.")
    ], done.stderr


def test_json_says_what_the_summary_says(folder: Path) -> None:
    said = json.loads(run(*IDENTIFY, "--json", "-o", "result.npz").stdout)
    result = tvident.load(folder / "result.npz")
    assert said["settings"] == result.settings
    assert said["parameters"]["inertia"]["value"] == result.constants["inertia"][0]
    assert said["verdict"].startswith("K(t) known to")
    assert said["advice"] == list(result.advice)
    assert "explanation" not in said
    explained = json.loads(run(*IDENTIFY, "--json", "--explain").stdout)["explanation"]
    assert explained == run(*IDENTIFY, "--explain").stdout.split("\noffset = ")[0].splitlines()[: len(explained)]
    assert explained[0] == "1. What was asked"


def test_json_of_channels_and_of_models(folder: Path) -> None:
    np.savetxt(
        folder / "odd.csv",
        [[0.0, np.nan], [0.1, np.nan], [0.2, np.nan]],
        delimiter=",",
        header="t [s],a [deg]",
        comments="",
    )
    time, angle = json.loads(run("info", "odd.csv", "--json").stdout)["channels"]
    assert [time["name"], time["unit"], time["samples"], time["greatest"]] == ["t [s]", "s", 3, 0.2]
    assert [angle["missing"], angle["mean"], angle["remark"]] == [3, None, "holds no numbers"]
    compare = ("compare", *IDENTIFY[1:], "--model", "none", "--model", "coulomb", "--json")
    said = json.loads(run(*compare).stdout)
    assert said["best"] == said["models"][0]["model"]
    assert said["models"][0]["weight"] >= said["models"][1]["weight"]
    assert said["averaged"]["inertia"]["value"] == pytest.approx(0.0123, rel=0.01)
    methods = json.loads(run(*compare[:-5], "--methods", "--json").stdout)["methods"]
    assert {"tvident"} <= {one["method"] for one in methods}


def test_what_goes_wrong_is_json_too(folder: Path) -> None:
    np.savez(folder / "rest.npz", angle=np.zeros(500), torque=np.zeros(500))
    nothing = run("identify", "rest.npz", *IDENTIFY[2:], "--json")
    assert nothing.returncode == 1
    assert json.loads(nothing.stdout)["parameters"]["inertia"]["value"] is None
    for call, status in (
        (("identify", "none.npz", *IDENTIFY[2:]), 1),
        (("info", "none.npz"), 1),
        (("compare", *IDENTIFY[1:-2]), 2),
        ((*IDENTIFY, "--lag", "soon"), 2),
    ):
        done = run(*call, "--json")
        assert done.returncode == status
        said = json.loads(done.stdout)
        assert said["exit_status"] == status
        assert said["error"] in done.stderr


@pytest.mark.slow
def test_a_run_is_repeated_from_its_result_and_from_toml(folder: Path) -> None:
    options = ["--inertia", "0.0123", "--term", "coulomb", "--window-length", "41"]
    assert run(*IDENTIFY, *options, "-o", "first.npz").returncode == 0
    assert run(*IDENTIFY, "--settings", "first.npz", "-o", "again.npz").returncode == 0
    (folder / "run.toml").write_text(
        'angle = "angle"\ntorque = "torque"\nsample-rate = 1000\ninertia = 0.0123\nterm = ["coulomb"]\nwindow-length = 41\n'
    )
    assert run("identify", "rig.npz", "--settings", "run.toml", "-o", "toml.npz").returncode == 0
    first, *others = (tvident.load(f"{name}.npz") for name in ("first", "again", "toml"))
    for other in others:
        np.testing.assert_array_equal(other.stiffness, first.stiffness)
        assert other.settings["window_length"] == 41
    given = run("identify", "rig.npz", "--settings", "run.toml", "--inertia", "0.02", "-o", "given.npz")
    assert given.returncode == 0
    assert tvident.load("given.npz").inertia[0] == 0.02
    (folder / "run.toml").write_text("stifness = 0\n")
    wrong = run(*IDENTIFY, "--settings", "run.toml")
    assert wrong.returncode == 2
    assert (
        "must hold options of tvident identify, without dashes before them; got 'stifness'; did you mean 'stiffness'?"
        in wrong.stderr
    )


def test_one_file_has_options_of_several_commands(folder: Path) -> None:
    """A table of a command was "no option"."""
    (folder / "rig.toml").write_text(
        'sample-rate = 1000\n[identify]\nangle = "angle"\ntorque = "torque"\nmethod = "paper"\n[derivatives]\nchannel = "angle"\n'
        "order = 3\nwindow-length = 41\n"
    )
    assert run("identify", "rig.npz", "--settings", "rig.toml", "-o", "found.npz").returncode == 0
    assert tvident.load("found.npz").settings["method"] == "paper"
    done = run("derivatives", "rig.npz", "--settings", "rig.toml", "-o", "slopes.npz")
    assert done.returncode == 0, done.stderr
    assert "windows of 41" in done.stdout


def test_settings_are_read_from_a_file_of_any_name(folder: Path) -> None:
    """What --settings-output wrote to chosen.toml could not be read back."""
    assert run(*IDENTIFY, "--settings-output", "chosen.toml", "-o", "chosen.npz").returncode == 0
    assert run(*IDENTIFY, "--settings", "chosen.toml", "-o", "repeated.npz").returncode == 0
    first, second = (tvident.load(folder / f"{name}.npz") for name in ("chosen", "repeated"))
    np.testing.assert_array_equal(first.stiffness, second.stiffness)


def test_derivatives_take_options_from_toml(folder: Path) -> None:
    (folder / "slopes.toml").write_text('channel = "angle"\nsample-rate = 1000\norder = 7\nwindow-length = 41\n')
    typed = ("--channel", "angle", "--sample-rate", "1000", "--order", "7", "--window-length", "41")
    written = run("derivatives", "rig.npz", "--settings", "slopes.toml", "-o", "-")
    assert written.returncode == 0, written.stderr
    assert written.stdout == run("derivatives", "rig.npz", *typed, "-o", "-").stdout
    wrong = run("derivatives", "rig.npz", "--settings", "rig.npz")
    assert wrong.returncode == 2
    assert "must be a file that ends in .toml and holds options" in " ".join(wrong.stderr.split())


def test_a_command_that_is_none_hears_which_was_meant() -> None:
    for typed, said in (
        ("identfy", "did you mean identify?"),
        ("raport", "did you mean report?"),
        ("xyz", "there are"),
    ):
        done = run(typed)
        assert done.returncode == 2
        assert f"No such command '{typed}'; {said}" in done.stderr


@pytest.mark.usefixtures("folder")
def test_a_report_goes_to_standard_output() -> None:
    done = run("report", *IDENTIFY[1:], "-o", "-")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("<!doctype html>")
    assert done.stdout.rstrip().endswith("</html>")
    assert "K(t) known to" in done.stderr


@pytest.mark.first(1)
@pytest.mark.parametrize("ending", [".csv", ".xlsx"])
def test_a_table_is_repeated_from_the_settings_beside_it(folder: Path, ending: str) -> None:
    options = ["--inertia", "0.0123", "--term", "coulomb"]
    assert run(*IDENTIFY, *options, "-o", f"first{ending}").returncode == 0
    again = run(*IDENTIFY, "--settings", f"first{ending}", "-o", f"again{ending}")
    assert again.returncode == 0, again.stderr
    first, second = (tvident.read_recording(folder / f"{name}{ending}") for name in ("first", "again"))
    for name in first:
        np.testing.assert_array_equal(second[name], first[name])
    # Whoever changes the table may still repeat the run, and hears of it; settings themselves do as well.
    (folder / "first.csv").write_text("a,b\n1,2\n")
    if ending == ".csv":
        changed = run(*IDENTIFY, "--settings", "first.csv", "-o", "changed.csv")
        assert changed.returncode == 0
        assert "first.csv: was changed after its settings were written beside it" in changed.stderr
        assert (folder / "changed.csv").read_bytes() == (folder / "again.csv").read_bytes()
        direct = run(*IDENTIFY, "--settings", "first.csv.settings.json", "-o", "direct.csv")
        assert direct.returncode == 0
        assert "changed after" not in direct.stderr
        (folder / "first.csv.settings.json").unlink()
        none = run(*IDENTIFY, "--settings", "first.csv")
        assert none.returncode == 1
        assert "its settings stand in 'first.csv.settings.json' beside it; there is no such file" in none.stderr
        own = run(*IDENTIFY, "--settings", "again.csv.settings.json", "-o", "again.csv")
        assert own.returncode == 2
        assert "the settings beside results must not replace earlier settings" in own.stderr


def test_exit_codes(folder: Path) -> None:
    assert run(*IDENTIFY).returncode == 0
    np.savez(folder / "rig.npz", angle=np.zeros(500), torque=np.zeros(500))
    assert run(*IDENTIFY, "-o", "nothing.csv").returncode == 1
    assert (folder / "nothing.csv").exists()
    assert run("identify", "none.npz", *IDENTIFY[2:]).returncode == 1
    assert run(*IDENTIFY[:-2]).returncode == 2
    assert "Exit status: 0, 1 where there is no usable result" in run("--help").stdout


def test_derivatives_behave_as_identify_does(folder: Path) -> None:
    call = ("derivatives", "rig.npz", "--channel", "angle")
    none = run(*call)
    assert none.returncode == 2
    assert "derivatives need the sample period; got none; give --sample-rate, --delta or --time" in none.stderr
    assert run(*call, "--sample-rate", "1000", "-o", "found.npz").returncode == 0
    angle = np.load(folder / "rig.npz")["angle [rad]"]
    expected = tvident.fit_local_polynomials(angle, "auto", sample_rate=1000).derivatives[2]
    np.testing.assert_array_equal(np.load(folder / "found.npz")["derivative_2 [rad/s^2]"], expected)


def test_derivatives_without_a_channel_list_what_there_is(folder: Path) -> None:
    none = run("derivatives", "rig.npz", "--sample-rate", 1000, cwd=folder)
    assert none.returncode == 2
    listed = f"Missing option '--channel'; rig.npz has {', '.join(np.load(folder / 'rig.npz'))}; name the channel"
    assert listed in none.stderr
    # One channel beside times needs no name, whatever the times are called.
    values = np.column_stack([np.arange(200) / 100, np.sin(np.arange(200) / 20)])
    np.savetxt(folder / "one.csv", values, delimiter=",", header="t / s,flexion [deg]", comments="")
    np.savetxt(folder / "odd.csv", values, delimiter=",", header="clock,flexion [deg]", comments="")
    done = run("derivatives", "one.csv", "--time", "t", "-o", "found.csv", "--plot", "found.svg", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert (folder / "found.csv").read_text().startswith("time [s],value [deg],")
    odd = run("derivatives", "odd.csv", "--time", "clock", "-o", "odd-found.csv", cwd=folder)
    assert odd.returncode == 0, odd.stderr
    assert (folder / "odd-found.csv").read_text() == (folder / "found.csv").read_text()
    (folder / "times.csv").write_text("time\n0\n1\n2\n")
    times = run("derivatives", "times.csv", "--time", "time", cwd=folder)
    assert "Missing option '--channel'; times.csv has time; name the channel" in times.stderr


@pytest.mark.slow
@pytest.mark.usefixtures("folder")
def test_the_demo_says_at_once_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.modules["tvident._commands.demo"], "find_spec", lambda _: None)
    done = run("demo")
    assert done.returncode == 0
    assert done.stderr.startswith("Pictures need matplotlib, which is not installed: pip install 'tvident[plot]'")
    assert done.stdout.count("result.csv") == 1


def test_a_rate_that_the_times_of_the_file_contradict_is_said(folder: Path) -> None:
    """With half the rate the inertia was four times too large, without a word."""
    channels = ("--angle", "angle", "--torque", "torque")
    tvident.read_recording(folder / "rig.npz").write("rig.csv")
    told = "Warning: time of rig.csv shows 1000 Hz, not 500, which is used"
    for command in (("identify", *IDENTIFY[2:6]), ("compare", *channels), ("derivatives", "--channel", "angle")):
        call = (command[0], "rig.csv", *command[1:])
        assert told in run(*call, "--sample-rate", "500").stderr
        assert told in run(*call, "--delta", "0.002").stderr
        assert "Warning" not in run(*call, "--sample-rate", "1000").stderr
        assert "Warning" not in run(*call, "--time", "time").stderr
    # Times in ms that do not say so.
    text = (folder / "rig.csv").read_text().splitlines()
    rows = [f"{number},{line.partition(',')[2]}" for number, line in enumerate(text[1:])]
    (folder / "ms.csv").write_text("\n".join([text[0].replace("time [s]", "time"), *rows]) + "\n")
    assert "Warning" not in run("derivatives", "ms.csv", "--channel", "angle", "--sample-rate", "1000").stderr


@pytest.mark.parametrize(
    ("name", "factor", "jitter", "given", "told"),
    [
        ("time", 1.0, 0.2, ("--sample-rate", "500"), "shows about 1000 Hz, not 500"),
        ("time", 1.0, 0.2, ("--sample-rate", "1000"), ""),
        ("time [s]", 1.0, 0.0, ("--sample-rate", "1"), "shows 1000 Hz, not 1,"),
        ("time [ms]", 1e3, 0.0, ("--delta", "2", "--time-unit", "ms"), "shows 1000 Hz, not 500"),
        ("time [ms]", 1e3, 0.0, ("--delta", "1", "--time-unit", "ms"), ""),
        ("time", 1e3, 0.0, ("--sample-rate", "1000"), ""),
        ("time", 1 / 86400, 0.0, ("--sample-rate", "1000"), ""),
    ],
)
def test_times_of_any_unit_and_with_jitter_are_held_against_a_rate(
    folder: Path, name: str, factor: float, jitter: float, given: tuple[str, ...], told: str
) -> None:
    """Times that are not uniform said nothing, and days were another rate."""
    rig = tvident.read_recording(folder / "rig.npz")
    steps = np.arange(rig["angle"].size) + jitter * np.random.default_rng(0).uniform(-1, 1, rig["angle"].size)
    times = factor * 1e-3 * steps
    tvident.FileRecording({name: times, "angle": rig["angle"], "torque": rig["torque"]}).write("other.csv")
    said = run("identify", "other.csv", "--angle", "angle", "--torque", "torque", *given).stderr
    assert told in said
    assert ("Warning" in said) == bool(told)


@pytest.mark.parametrize(
    ("line", "typed"),
    [
        ('term = "coulomb"', ["--term", "coulomb"]),
        ('term = ["offset", "coulomb:windowed"]', ["--term", "offset", "--term", "coulomb:windowed"]),
        ("missing = -9999", ["--missing", "-9999"]),
        ("missing = [-9999, 1e20]", ["--missing", "-9999", "--missing", "1e20"]),
    ],
)
def test_an_option_that_may_be_repeated_is_a_list_or_one_value(folder: Path, line: str, typed: list[str]) -> None:
    (folder / "several.toml").write_text(line + "\n")
    from_file, by_hand = (run(*IDENTIFY, *more) for more in (["--settings", "several.toml"], typed))
    assert from_file.returncode == 0, from_file.stderr
    assert from_file.stdout == by_hand.stdout


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("missing = true", "missing must be one number or text or a list of them; got true"),
        ("missing = [-9999, false]", "missing must be one number or text or a list of them; got false"),
        ('angle = ["angle", "torque"]', "angle must be one number or text; got a list; write angle ="),
        ("angle = true", "angle must be one number or text; got true"),
        ("step = true", "step must be one number or text; got true; write step = 5"),
        ("[angle]\nname = 3", "angle must be one number or text; got a table"),
    ],
)
def test_an_option_is_no_other_kind_of_value(folder: Path, line: str, words: str) -> None:
    """What is true was 1, which marked missing values, and a list was the name of a channel."""
    (folder / "kinds.toml").write_text(line + "\n")
    done = run(*IDENTIFY, "--settings", "kinds.toml")
    assert done.returncode == 2
    assert words in " ".join(done.stderr.split())


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("s.json", '{"a": 1,\n}', "it is no JSON from line 2, column 1 on"),
        ("s.toml", "order = \n", "it is no TOML from line 1, column 9 on"),
    ],
)
def test_a_settings_file_that_is_broken_says_where(folder: Path, name: str, content: str, words: str) -> None:
    """The words of Python's parsers stood there."""
    (folder / name).write_text(content)
    done = run(*IDENTIFY, "--settings", name)
    assert done.returncode in {1, 2}
    assert words in " ".join(done.stderr.split())
