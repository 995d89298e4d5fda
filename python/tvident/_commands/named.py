"""Channels that options name: one by one, or together as a joint of a robot."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click
import numpy as np

from tvident import recordings
from tvident._commands.channels import channels_in
from tvident._files import increasing_times, joint_of, listed, printable, time_channels
from tvident._in_pieces import names_in
from tvident._units import named_unit

TIME = "time"
"""What the stamps of a joint are called in a bag."""


def named(options: Mapping[str, Any], file: str | None) -> dict[str, Any]:
    """Return options with what a joint's angle and torque are called; refuse options that name no channels."""
    missing = [name for name in ("angle", "torque") if options[name] is None]
    joint = options["joint"]
    if joint is None:
        if options.get("velocity") or options.get("acceleration"):
            missing = [name for name in missing if name != "angle"]
        if missing:
            # Names are all that is missing, so they are listed.
            there = file is not None and Path(file).exists()
            held = f"; {printable(file)} has {listed(channels_in(file))}" if there else ""
            raise click.UsageError(
                f"Missing option '--{missing[0]}'{held}; name the channel, or a --joint of a robot's log"
            )
        return dict(options)
    if len(missing) < 2:  # noqa: PLR2004 - angle and torque
        raise click.UsageError("--joint stands for --angle and --torque; got one of these too; drop it")
    return {**options, "angle": f"{joint}.position", "torque": f"{joint}.effort"}


def with_joint_of_file(options: Mapping[str, Any], file: str) -> dict[str, Any]:
    """Return options with the names that the channels of a joint have in a file that is read piece by piece; its velocity is not read."""
    rest = {name: value for name, value in options.items() if name != "joint"}
    if options["joint"] is None:
        return rest
    of_joint = joint_of(names_in(Path(file)), options["joint"], file)
    if "velocity" in of_joint:
        click.echo(f"{of_joint['velocity']} is not used: --in-pieces takes angle and torque", err=True)
    return {**rest, "angle": of_joint["position"], "torque": of_joint["effort"]}


def _lacks_clock(options: Mapping[str, Any]) -> bool:
    """Return whether a joint is named, and nothing that tells the times."""
    clocks = ("sample_rate", "delta", "time_channel")
    return options["joint"] is not None and not any(options.get(name) for name in clocks)


def with_joint(options: Mapping[str, Any], channels: recordings.Channels, file: str | None) -> dict[str, Any]:
    """Return options with the names that the channels of a joint have in a file, and its velocity where none is named."""
    rest = {name: value for name, value in options.items() if name != "joint"}
    joint = options["joint"]
    if joint is None:
        return rest
    of_joint = joint_of(channels, joint, file or "the command line")
    rest |= {"angle": of_joint["position"], "torque": of_joint["effort"]}
    if _lacks_clock(options):
        stamps = (
            [TIME] if any(_last(name) == TIME for name in channels) else list(dict.fromkeys(time_channels(channels)))
        )
        clocks = stamps or [named_unit(name)[0] for name in increasing_times(channels)]
        # Of several none is chosen: what asks for the sample period names them.
        rest["time_channel"] = clocks[0] if len(clocks) == 1 else None
    if "velocity" not in rest or rest["velocity"] is not None or "velocity" not in of_joint:
        return rest
    velocity, angle = channels[of_joint["velocity"]], channels[of_joint["position"]]
    # Drivers that measure no velocity send zeros, or no number, in its place.
    if velocity.shape != angle.shape or not np.any(np.nan_to_num(velocity)):
        return rest
    return rest | {"velocity": of_joint["velocity"]}


def _last(name: str) -> str:
    return named_unit(name)[0].rpartition(".")[2]
