"""The command ``tvident identify``."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from tvident._commands.channels import channels_in
from tvident._commands.identification import identified, inputs
from tvident._commands.in_pieces import identify_in_pieces
from tvident._commands.named import named, with_joint
from tvident._commands.output import (
    PICTURE,
    RESULTS,
    SETTINGS,
    check_outputs,
    end_without_result,
    give,
    save_figure,
    say,
)
from tvident._commands.words import in_options
from tvident._files import check_beside, keeps_result, place_beside, replaced
from tvident._results import explained_steps
from tvident._status import Status


def identify(
    file: str | None,
    settings_output: str | None,
    output: str | None,
    plot: str | None,
    as_json: bool,  # noqa: FBT001 - click passes options by name
    explain: bool,  # noqa: FBT001 - likewise
    in_pieces: bool,  # noqa: FBT001 - likewise
    **options: Any,
) -> None:
    """Identify inertia, damping and stiffness from the angle and torque in FILE."""
    options = named(options, file)
    if in_pieces:
        others = {"plot": plot, "json": as_json, "explain": explain}
        identify_in_pieces(file, output, settings_output, others, options)
        return
    outputs = {RESULTS: output, PICTURE: plot, SETTINGS: settings_output}
    table = None if output is None or keeps_result(output) else Path(output)
    if table is not None and (beside := place_beside(table)):
        outputs["the settings beside results"] = str(beside)
    check_outputs(outputs, inputs(file, options))
    if table is not None:
        check_beside(table)
    channels = channels_in(file)
    result = identified(channels, file, **with_joint(options, channels, file))
    if settings_output is not None:
        with replaced(Path(settings_output)) as written:
            written.write((json.dumps(result.settings, indent=1) + "\n").encode())
    if as_json:
        content = _plain(result) | ({"explanation": explained_steps(result).splitlines()} if explain else {})
        words = json.dumps(content, indent=1, ensure_ascii=False)
    else:
        words = explained_steps(result) if explain else result.summary()
        for name, (value, error) in result.constants.items():
            words += f"\n{name} = {value:.8g} ± {error:.2g} {result.units.get(name, '')}".rstrip()
    if output is None or output == "-":
        give(result.columns(), result.units, words, output)
    else:
        result.save(output)  # with what repeats it
        say(words)
    if plot is not None:
        save_figure(result.plot(), Path(plot))
    end_without_result(result.status)


def _plain(result: Any) -> dict[str, Any]:
    """Return what the summary says as JSON has it; numbers that are none are null."""

    def number(value: float) -> float | None:
        return value if math.isfinite(value) else None

    values = {
        name: result.value(name)._asdict() for name in (*result.settings["kinds"], "natural_frequency", "damping_ratio")
    }
    held_back = result.held_back()
    summary = result.summary().splitlines()
    return {
        "verdict": in_options(summary[0]),
        "parameters": {
            name: {key: number(one) if isinstance(one, float) else one for key, one in value.items()}
            for name, value in values.items()
        },
        "held_back": {name: number(float(getattr(held_back, name))) for name in ("simulated", "predicted")},
        "advice": list(map(in_options, result.advice)),
        "reasons": list(map(in_options, result.reasons)),
        "jumps": list(result.jumps),
        "record_flags": [flag.name for flag in Status if result.record_status & flag],
        "trusted": float(np.mean(result.trusted)) if result.trusted.size else 0.0,
        "settings": result.settings,
    }
