"""The command ``tvident``."""

from __future__ import annotations

import errno
import json
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, Literal, TypeVar, get_args

import click
import numpy as np
import numpy.typing as npt

import tvident
from tvident import recordings, table
from tvident.arguments import NanPolicy, RowPolicy
from tvident.derivatives import Criterion, Selection
from tvident.rig import Excitation, Pattern
from tvident.settings import Form, Preset, Variation
from tvident.settings import Selection as HowToSelect
from tvident.status import describe
from tvident.terms import COEFFICIENTS, Kind

Decorated = TypeVar("Decorated", bound=Callable[..., Any])


class _Command(click.Group):
    """Turns what the library and files raise into one line and an exit status: 2 for misuse, 1 for what cannot be read, written or done."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except (click.exceptions.Exit, click.Abort):
            raise
        except recordings.FileError as error:
            raise click.ClickException(str(error)) from None
        except KeyError as error:
            raise click.UsageError(str(error.args[0])) from None
        except (ValueError, TypeError, ImportError) as error:
            raise click.UsageError(str(error)) from None
        except MemoryError:
            raise click.ClickException(
                "the work needs more memory than there is; cut the recording into pieces, or ask for every --step-th result"
            ) from None
        except RuntimeError as error:
            raise click.ClickException(str(error)) from None
        except OSError as error:
            if error.errno == errno.EPIPE:
                raise  # whoever reads the output has had enough: click ends without a word
            raise click.ClickException(f"{error.filename or 'the output'}: {error.strerror}") from None


@click.group(cls=_Command, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(package_name="tvident", message="%(version)s")
def main() -> None:
    """Identify inertia, damping and stiffness that change while they are measured; differentiate noisy recordings.

    Files may be text columns (CSV), NPY, NPZ or MATLAB. Channels are called by name, or by number from 0. Results go to files or standard
    output, messages and progress to standard error.
    """


def _options(*options: Callable[[Decorated], Decorated]) -> Callable[[Decorated], Decorated]:
    def decorate(function: Decorated) -> Decorated:
        for option in reversed(options):
            function = option(function)
        return function

    return decorate


_TIME = _options(
    click.option("--sample-rate", type=float, help="Samples per second."),
    click.option("--delta", type=float, help="Sample period in seconds."),
    click.option("--time", "time_channel", metavar="NAME", help="Channel that holds the time in seconds."),
)
_RUN = _options(
    click.option("--step", type=int, default=1, show_default=True, help="Every how many samples a result is wanted."),
    click.option("--workers", type=int, help="Threads; by default all processors."),
    click.option("--progress/--no-progress", default=None, help="Show progress; by default on a terminal."),
    click.option(
        "-o", "--output", type=click.Path(dir_okay=False), help="CSV or NPZ file for the results, or - for CSV here."
    ),
    click.option("--plot", type=click.Path(dir_okay=False), help="Picture of the results: PNG, PDF or SVG."),
)
_CRITERION = click.option("--criterion", type=click.Choice(get_args(Criterion)), help="What chooses the order.")


@main.command()
@click.option(
    "--folder",
    type=click.Path(file_okay=False, path_type=Path),
    default="tvident-demo",
    show_default=True,
    help="Where pictures and data are written.",
)
@click.option("--seed", type=int, default=0, show_default=True, help="Of the simulated recording.")
def demo(folder: Path, seed: int) -> None:
    """Identify a simulated recording, compare with the truth and draw the paper's figures."""
    folder.mkdir(parents=True, exist_ok=True)
    recording = tvident.simulate_torsional_rig(seed=seed)
    call: dict[str, Any] = {"sample_rate": recording.sample_rate}
    result = tvident.identify(recording.angle, recording.torque, **call)
    paper = tvident.identify(recording.angle, recording.torque, preset="paper", **call)
    click.echo(
        f"Simulated rig: {recording.time.size} samples at {recording.sample_rate:g} Hz, a slider changes the stiffness.\n"
    )
    click.echo(result.summary() + "\n")
    rows: list[tuple[str, ...]] = [
        ("parameter", "unit", "true (median)", "identified (median)", "rms error", "with --preset paper")
    ]
    for name in ("inertia", "damping", "stiffness"):
        medians = [f"{np.nanmedian(getattr(one, name)):.5g}" for one in (recording, result)]
        errors = [f"{_rms_error(one, recording, name):.2%}" for one in (result, paper)]
        rows.append((name, tvident.result.UNITS[name], *medians, *errors))
    click.echo("\n".join([*table.aligned(rows), ""]))

    recording.save(folder / "recording.csv")
    result.save(folder / "result.csv")
    click.echo(f"Written to {folder}: recording.csv, result.csv")
    noise = 0.05 * recording.angle.std() * np.random.default_rng(seed + 1).standard_normal(recording.angle.size)
    middle_sample = recording.time.size // 2
    figures = _figures()
    pictures = {
        "recording.png": figures.plot_recording(recording),
        "window.png": figures.plot_window(recording.angle, middle_sample, **call),
        "window-with-noise.png": figures.plot_window(recording.angle + noise, middle_sample, **call),
        "parameters.png": figures.plot_identification(result, recording),
        "parameters-paper.png": figures.plot_identification(paper, recording),
    }
    for name, picture in pictures.items():
        _save_figure(picture, folder / name)
    click.echo(f"Drawn in {folder}: {', '.join(pictures)}")


def _rms_error(result: tvident.Identification, truth: tvident.Recording, name: str) -> float:
    """Return the rms error of a parameter over its mean."""
    true = getattr(truth, name)
    return float(np.sqrt(np.nanmean((getattr(result, name) - true) ** 2)) / np.mean(true))


@main.command()
@click.argument("output", type=click.Path(dir_okay=False))
@click.option("--duration", type=float, default=20.0, show_default=True, help="Seconds.")
@click.option("--sample-rate", type=float, default=1000.0, show_default=True, help="Samples per second.")
@click.option("--seed", type=int, default=0, show_default=True, help="The same seed gives the same recording.")
@click.option(
    "--pattern", type=click.Choice(get_args(Pattern)), default="slider", show_default=True, help="How stiffness moves."
)
@click.option(
    "--excitation", type=click.Choice(get_args(Excitation)), default="multisine", show_default=True, help="Torque."
)
@click.option("--torque-snr-db", type=float, default=20.0, show_default=True, help="Torque over its noise, dB.")
@click.option(
    "--angle-noise", type=float, default=1e-4, show_default=True, help="Noise over the angle's standard deviation."
)
@click.option("--encoder-counts", type=int, help="Counts a turn, instead of noise.")
def simulate(output: str, **options: Any) -> None:
    """Write a simulated recording of the paper's rig, with its truth, to OUTPUT (CSV or NPZ)."""
    table.check_place(Path(output))
    recording = tvident.simulate_torsional_rig(**options)
    recording.save(output)
    click.echo(f"{recording.time.size} samples written to {output}", err=True)


@main.command()
@click.argument("file", type=click.Path())
def info(file: str) -> None:
    """List the channels of FILE: how many samples, their range, and what is missing."""
    channels = recordings.read(file)
    rows: list[tuple[str, ...]] = [
        ("channel", "type", "samples", "mean", "std", "least", "greatest", "missing", "remark")
    ]
    for name, values in channels.items():
        finite = values[np.isfinite(values)] if values.dtype.kind == "f" else values
        numbers = (finite.mean(), finite.std(), finite.min(), finite.max()) if finite.size else (np.nan,) * 4
        shown = [f"{float(number):.5g}" for number in numbers]
        rows.append(
            (name, str(values.dtype), str(values.size), *shown, str(values.size - finite.size), _remark(values))
        )
    click.echo("\n".join(table.aligned(rows)))


def _remark(values: npt.NDArray[Any]) -> str:
    """Return what a channel looks like: uniform time, a single number, a constant."""
    if values.ndim == 0:
        return "a number"
    steps = np.diff(values.astype(np.float64))
    if steps.size and (steps > 0).all():
        period = (values[-1] - values[0]) / steps.size
        grid = values[0] + period * np.arange(values.size)
        if np.abs(values - grid).max() <= 1e-3 * period:
            return f"uniform: {1 / period:.6g} per unit"
        return "increasing"
    return "constant" if steps.size and not steps.any() else ""


@main.command(epilog="Example: tvident derivatives rig.csv --channel angle --time time -o derivatives.csv")
@click.argument("file", type=click.Path())
@click.option("--channel", required=True, metavar="NAME", help="Channel to differentiate.")
@click.option(
    "--window-length", default="201", show_default=True, help="Samples, odd, a duration such as '0.2 s', or auto."
)
@_TIME
@click.option("--max-order", type=int, default=15, show_default=True, help="Highest candidate order.")
@click.option("--order", type=int, help="Fixes the order.")
@_CRITERION
@click.option(
    "--selection", type=click.Choice(get_args(Selection)), help="Whose criterion: the window's, or its neighbours' too."
)
@click.option("--quantisation", type=float, help="Step that the channel was rounded to; looked for if not given.")
@click.option("--max-deriv", type=int, default=2, show_default=True, help="Highest derivative.")
@click.option(
    "--nan-policy",
    type=click.Choice(get_args(NanPolicy)),
    default="propagate",
    show_default=True,
    help="Missing values.",
)
@_RUN
def derivatives(
    file: str,
    channel: str,
    window_length: str,
    sample_rate: float | None,
    delta: float | None,
    time_channel: str | None,
    output: str | None,
    plot: str | None,
    progress: bool | None,  # noqa: FBT001 - click passes options by name
    **options: Any,
) -> None:
    """Differentiate a channel of FILE with a polynomial order chosen in every window."""
    _check_output(output, plot, file)
    _check_time(sample_rate, delta, time_channel)
    channels = recordings.read(file)
    samples = _channel(channels, channel, file)
    times = None if time_channel is None else _channel(channels, time_channel, file)
    fit = tvident.fit_local_polynomials(
        samples,
        _length(window_length),
        delta=delta,
        sample_rate=sample_rate,
        t=times,
        progress=_progress(progress),
        **_given(options),
    )
    period = tvident.arguments.sample_period(samples.size, delta=delta, sample_rate=sample_rate, t=times)
    start = 0.0 if times is None else float(times[0])
    step = int(options["step"])
    names = ["value", *(f"derivative_{d}" for d in range(1, fit.derivatives.shape[0]))]
    columns: dict[str, npt.NDArray[Any]] = {"time": start + np.arange(0, samples.size, step) * period}
    for name, values, errors in zip(names, fit.derivatives, fit.stderr, strict=True):
        columns |= {name: values, f"{name}_stderr": errors}
    columns |= {"sigma": fit.sigma, "order": fit.order, "status": fit.status}
    counts = np.bincount(fit.order.ravel())
    orders = ", ".join(f"{order}: {count / fit.order.size:.0%}" for order, count in enumerate(counts) if count)
    windows = ", ".join(str(length) for length in np.atleast_1d(fit.window_length))
    words = [f"{samples.size} samples, windows of {windows}; orders {orders}", "", *describe(fit.status)]
    _give(columns, {"time": "s"}, "\n".join(words), output)
    if plot is not None:
        _save_figure(_figures().plot_derivatives(columns["time"], fit, channel), Path(plot))


@main.command(epilog="Example: tvident identify rig.csv --angle angle --torque torque --time time -o result.csv")
@click.argument("file", type=click.Path(), required=False)
@click.option("--angle", required=True, metavar="NAME", help="Channel of the angle, or a file that holds it alone.")
@click.option("--torque", required=True, metavar="NAME", help="Channel of the torque, or a file that holds it alone.")
@click.option("--angle-scale", metavar="SCALE", help="Number or variable to multiply the angle by.")
@click.option("--torque-scale", metavar="SCALE", help="Number or variable to multiply the torque by.")
@_TIME
@click.option(
    "--preset",
    type=click.Choice(get_args(Preset)),
    help="Where what is not given comes from: the recording (auto, the default), or the paper.",
)
@click.option("--inertia", metavar="KIND", help="auto, constant, windowed, varying, a known number, or a channel.")
@click.option("--damping", metavar="KIND", help="The same for damping; 0 leaves it out.")
@click.option("--stiffness", metavar="KIND", help="The same for stiffness.")
@click.option(
    "--term",
    "terms",
    multiple=True,
    metavar="TERM[:KIND]",
    help="offset, coulomb or cubic; may be repeated; none leaves out the offset of --preset auto.",
)
@click.option("--lag", metavar="TIME", help="By how much the torque was recorded late: seconds, '2 ms', or auto.")
@click.option(
    "--quantisation", type=float, help="Step that the angle was rounded to; looked for if not given; 0: none."
)
@click.option("--mask", metavar="NAME", help="Channel, or file, that is not zero where a sample may be used.")
@click.option("--form", type=click.Choice(get_args(Form)), help="Test functions (weak) or derivatives (strong).")
@click.option(
    "--window-length", metavar="LENGTH", help="Test function, or window of the polynomials: samples, odd, or '0.2 s'."
)
@click.option("--exponent", metavar="NUMBER", help="Of the test function: 3 to 20, or auto.")
@click.option("--equations", metavar="LENGTH", help="Samples solved together: a number, '0.2 s', or auto.")
@click.option("--variation", type=click.Choice(get_args(Variation)), help="Of parameters within a window.")
@click.option(
    "--selection",
    type=click.Choice(get_args(HowToSelect)),
    help="Strong form: of orders. Weak form: one window around a sample, or an average of many.",
)
@click.option("--max-order", type=int, help="Strong form: highest candidate order.")
@_CRITERION
@click.option(
    "--filter-torque/--no-filter-torque", default=None, help="Strong form: smooth the torque as the angle is."
)
@click.option(
    "--settings", type=click.Path(), help="What an earlier run chose: a JSON file that --settings-output wrote."
)
@click.option("--settings-output", type=click.Path(dir_okay=False), help="JSON file for what this run chose.")
@click.option(
    "--nan-policy",
    type=click.Choice(get_args(RowPolicy)),
    default="omit",
    show_default=True,
    help="Missing values: omit their equations, propagate them to all windows that hold one, or raise.",
)
@_RUN
def identify(
    file: str | None,
    angle: str,
    torque: str,
    angle_scale: str | None,
    torque_scale: str | None,
    time_channel: str | None,
    terms: tuple[str, ...],
    lag: str | None,
    mask: str | None,
    settings: str | None,
    settings_output: str | None,
    output: str | None,
    plot: str | None,
    progress: bool | None,  # noqa: FBT001 - click passes options by name
    **options: Any,
) -> None:
    """Identify inertia, damping and stiffness from the angle and torque in FILE.

    What is not given is chosen from the recording, and the summary says what and why.
    """
    _check_output(output, plot, file, angle, torque)
    if settings_output is not None:
        table.check_folder(Path(settings_output))
    if not _check_time(options["sample_rate"], options["delta"], time_channel):
        raise click.UsageError("identify needs the sample period; got none; give --sample-rate, --delta or --time")
    if settings is not None and options["preset"] is not None:
        raise click.UsageError("--settings hold a preset; got --preset too; drop one of them")
    channels = {} if file is None else recordings.read(file)
    result = tvident.identify(
        _scaled(_source(channels, angle, file), angle_scale, channels, file),
        _scaled(_source(channels, torque, file), torque_scale, channels, file),
        t=None if time_channel is None else _channel(channels, time_channel, file),
        lag=None if lag is None else _lag(lag),
        mask=None if mask is None else _mask(_source(channels, mask, file)),
        settings=None if settings is None else _read_settings(settings),
        terms=_terms(terms),
        progress=_progress(progress),
        **{name: _understood(name, value, channels, file) for name, value in _given(options).items()},
    )
    if settings_output is not None:
        with table.replaced(Path(settings_output)) as written:
            written.write((json.dumps(result.settings, indent=1) + "\n").encode())
    words = [result.summary()]
    for name, (value, error) in result.constants.items():
        words.append(f"{name} = {value:.8g} ± {error:.2g} {tvident.result.UNITS.get(name, '')}".rstrip())
    _give(result.columns(), tvident.result.UNITS, "\n".join(words), output)
    if plot is not None:
        _save_figure(result.plot(), Path(plot))


def _channel(channels: recordings.Channels, name: str, file: str | None) -> npt.NDArray[Any]:
    """Return a channel that holds one value a sample."""
    values = recordings.channel(channels, name, file or "the command line")
    if values.ndim != 1:
        raise click.UsageError(f"channel {name!r} must hold one value for every sample; it is a single number")
    return values


def _source(channels: recordings.Channels, name: str, file: str | None) -> npt.NDArray[Any]:
    """Return a channel by name, or the only channel of a file of that name."""
    if file is not None:
        try:
            return _channel(channels, name, file)
        except KeyError:
            if not Path(name).is_file():
                raise
    elif Path(name).suffix == "":
        raise click.UsageError(f"channel {name!r} needs a FILE to be in; name the file first")
    alone = recordings.read(name)
    if len(alone) != 1:
        raise click.UsageError(
            f"{name} must hold one channel; it has {', '.join(alone)}; give it as FILE and name the channel"
        )
    return _channel(alone, next(iter(alone)), name)


def _scaled(
    values: npt.NDArray[Any], scale: str | None, channels: recordings.Channels, file: str | None
) -> npt.NDArray[Any]:
    """Multiply by a number, or by a variable of the file."""
    if scale is None:
        return values
    try:
        factor: Any = float(scale)
    except ValueError:
        factor = recordings.channel(channels, scale, file or "the command line")
    else:
        if not np.isfinite(factor):
            raise click.UsageError(f"a scale must be finite; got {scale}; give a number such as 0.001")
    if np.ndim(factor) and factor.shape != values.shape:
        raise click.UsageError(
            f"a scale must be one number, or have one value for every sample; {scale!r} has {factor.size} values "
            f"for {values.size} samples; use another variable"
        )
    return np.asarray(values * factor)


def _understood(name: str, value: Any, channels: recordings.Channels, file: str | None) -> Any:
    """Return the argument that an option stands for."""
    if name in COEFFICIENTS:
        return _parameter(value, channels, file)
    return _length(value) if name in {"window_length", "equations", "exponent"} else value


def _parameter(value: str, channels: recordings.Channels, file: str | None) -> Any:
    """Return a kind, a number, or a channel."""
    if value in get_args(Kind):
        return value
    try:
        return float(value)
    except ValueError:
        return recordings.channel(channels, value, file or "the command line")


def _terms(texts: tuple[str, ...]) -> list[Any] | None:
    """Return terms from ``name`` or ``name:kind``; nothing where none are given, none where ``none`` is."""
    if texts == ("none",):
        return []
    parts = [text.partition(":") for text in texts]
    return [(name, kind) if kind else name for name, _, kind in parts] or None


def _length(text: str) -> int | str:
    """Return a number of samples, or a duration as it is."""
    return int(text) if text.strip().lstrip("+-").isdigit() else text


def _lag(text: str) -> float | Literal["auto"]:
    """Return a time in seconds from a number, or from one with a unit; ``auto`` as it is."""
    if text == "auto":
        return "auto"
    try:
        return float(text)
    except ValueError:
        pass
    sign, magnitude = (-1.0, text.strip()[1:]) if text.strip().startswith("-") else (1.0, text)
    try:
        return sign * tvident.arguments.seconds("lag", magnitude)
    except ValueError:
        raise click.UsageError(
            f"lag must be seconds, a time such as '2 ms', or 'auto'; got {text!r}; repair it"
        ) from None


def _mask(values: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
    """Return where a channel is neither zero nor missing."""
    return np.asarray((values != 0) & np.isfinite(values))


def _read_settings(path: str) -> dict[str, Any]:
    """Return what an earlier run chose."""
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except (ValueError, UnicodeDecodeError) as error:
        raise recordings.FileError(
            f"{path}: holds no settings ({error}); give a file that --settings-output wrote"
        ) from None
    if not isinstance(content, dict):
        raise recordings.FileError(f"{path}: holds no settings; give a file that --settings-output wrote")
    return content


def _given(options: dict[str, Any]) -> dict[str, Any]:
    """Return the options that were given."""
    return {name: value for name, value in options.items() if value is not None}


def _progress(wanted: bool | None) -> bool:  # noqa: FBT001 - an option's value
    """Return whether to show progress: on a terminal, unless told otherwise."""
    return sys.stderr.isatty() if wanted is None else wanted


def _check_time(sample_rate: float | None, delta: float | None, time_channel: str | None) -> bool:
    """Return whether the sample period was given; refuse several."""
    ways = {"--sample-rate": sample_rate, "--delta": delta, "--time": time_channel}
    given = [name for name, value in ways.items() if value is not None]
    if len(given) > 1:
        raise click.UsageError(f"give only one of {', '.join(ways)}; got {' and '.join(given)}; drop all but one")
    return bool(given)


def _check_output(output: str | None, plot: str | None, *sources: str | None) -> None:
    """Refuse what cannot be written, or would write over a recording, before any work is done."""
    if output is not None and output != "-":
        place = Path(output)
        table.check_place(place)
        recorded = [Path(source) for source in sources if source is not None and Path(source).is_file()]
        if place.exists() and any(place.samefile(source) for source in recorded):
            raise click.UsageError(f"results must not replace the recording; got {output!r}; give another file")
    if plot is not None:
        _figures()
        if Path(plot).suffix.lower() not in {".png", ".pdf", ".svg"}:
            raise click.UsageError(f"--plot must end in .png, .pdf or .svg; got {plot!r}; rename it")
        table.check_folder(Path(plot))


def _give(columns: dict[str, npt.NDArray[Any]], units: dict[str, str], words: str, output: str | None) -> None:
    """Write results to a file and words to standard output, or results to standard output and words to standard error."""
    if output == "-":
        table.write_csv(sys.stdout.buffer, columns, units)
    elif output is not None:
        table.write(output, columns, units)
    click.echo(words, err=output == "-")


def _figures() -> Any:
    """Return the module of figures, set up to draw without a screen."""
    from tvident import figures  # noqa: PLC0415 - matplotlib is optional

    import_module("matplotlib.pyplot").switch_backend("agg")
    return figures


def _save_figure(figure: Any, path: Path) -> None:
    """Write a picture, which appears whole or not at all."""
    with table.replaced(path) as file:
        figure.savefig(file, format=path.suffix.lower().lstrip("."))
