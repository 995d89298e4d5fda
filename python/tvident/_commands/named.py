"""Channels that options name: one by one, or together as a joint of a robot."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click
import numpy as np

from tvident import recordings
from tvident._commands.channels import channels_in, source_of
from tvident._files import listed, printable


def named(options: Mapping[str, Any], file: str | None) -> dict[str, Any]:
    """Return options with what a joint's angle, torque and stamps are called; refuse options that name no channels."""
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
                f"Missing option '--{missing[0]}'{held}; name the channel, or a --joint of a ROS bag"
            )
        return dict(options)
    if len(missing) < 2:  # noqa: PLR2004 - angle and torque
        raise click.UsageError("--joint stands for --angle and --torque; got one of these too; drop it")
    of_joint = {"angle": f"{joint}.position", "torque": f"{joint}.effort"}
    if not any(options.get(name) for name in ("sample_rate", "delta", "time_channel")):
        of_joint["time_channel"] = "time"
    return {**options, **of_joint}


def with_velocity(options: Mapping[str, Any], channels: recordings.Channels, file: str | None) -> dict[str, Any]:
    """Return options with the velocity of a joint, where none is named and the file has one beside its angle."""
    rest = {name: value for name, value in options.items() if name != "joint"}
    joint = options["joint"]
    if joint is None or rest["velocity"] is not None:
        return rest
    name = f"{joint}.velocity"
    try:
        velocity, angle = (source_of(channels, one, file) for one in (name, rest["angle"]))
    except (KeyError, click.UsageError):
        return rest
    # Drivers that measure no velocity send zeros, or no number, in its place.
    if velocity.shape != angle.shape or not np.any(np.nan_to_num(velocity)):
        return rest
    return rest | {"velocity": name}
