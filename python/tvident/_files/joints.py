"""Channels of a robot's joints, by what logs call them: ``/arm/elbow/effort``, ``joint_states.position[0]``, ``state.q.0``, ``dq_1``."""

from __future__ import annotations

import re
from collections.abc import Iterable

from tvident._files.channels import full_name, parts_of
from tvident._files.names import listed, printable
from tvident._units import named_unit

_QUANTITIES = {
    "position": ("position", "positions", "pos", "q", "qpos", "angle", "angles", "theta"),
    "velocity": ("velocity", "velocities", "vel", "qd", "dq", "qdot", "qvel", "speed", "omega"),
    "effort": ("effort", "efforts", "torque", "torques", "trq", "tau", "moment", "moments"),
}
"""Words of logs for what a joint does."""

_OF_WORD = {word: quantity for quantity, words in _QUANTITIES.items() for word in words}

_NUMBERED = re.compile(rf"({'|'.join(_OF_WORD)})(\d+)", re.IGNORECASE)
"""A word with the joint's number behind it, as ``rostopic echo -p`` writes them: ``position0``."""

_TAU_J = re.compile(r"tau_J(?![a-z])")
"""What Franka calls the torque of a joint."""


def joint_of(channels: Iterable[str], joint: str, source: str) -> dict[str, str]:
    """Return the channels of a joint by what they are: ``position``, ``effort``, and ``velocity`` where it has one.

    A joint is called as its channels are without the word for what they are, or by the end of that: ``elbow`` of ``/arm/elbow/effort``.

    Raises
    ------
    KeyError
        If there is no such joint, or what is called so may be several: the message lists them.
    """
    every = dict.fromkeys(channels)
    joints = _joints(every)
    wanted = _words(joint)
    ending = {name: parts for name, parts in joints.items() if _words(name)[-len(wanted) :] == wanted}
    found = {name: parts for name, parts in ending.items() if _words(name) == wanted} or ending
    place, asked = printable(source), printable(joint, 60)
    if not found:
        whole = [name for name, parts in joints.items() if {"position", "effort"} <= parts.keys()]
        if not whole:
            for quantity in ("position", "effort"):
                full_name(every, f"{joint}.{quantity}", source)  # which says what there is
        raise KeyError(
            f"{place} has no joint '{asked}'; it has {listed(whole)}; name one of these, or give --angle and --torque"
        )
    parts = next(iter(found.values()))
    if len(found) == 1 and all(len(names) == 1 for names in parts.values()) and {"position", "effort"} <= parts.keys():
        return {quantity: names[0] for quantity, names in parts.items()}
    held = []
    for quantity in ("position", "effort"):
        names = [name for one in found.values() for name in one.get(quantity, [])]
        held.append(f"{quantity} {listed(names) or 'none'}")
    raise KeyError(
        f"{place} must have one position and one effort of a joint '{asked}' that are called alike; it has {' and '.join(held)}; "
        "give --angle and --torque, or more of the joint's name"
    )


def _joints(channels: Iterable[str]) -> dict[str, dict[str, list[str]]]:
    """Return what may be joints: their channels by what they are."""
    found: dict[str, dict[str, list[str]]] = {}
    for name in channels:
        # The last part that is one of the words says what the channel is, whatever words the joint's name holds.
        parts = parts_of(named_unit(name)[0])
        places = [place for place, part in enumerate(parts) if part.lower() in _OF_WORD]
        if places and len(parts) > 1:
            quantity = _OF_WORD[parts.pop(places[-1]).lower()]
            found.setdefault(".".join(parts), {}).setdefault(quantity, []).append(name)
            continue
        bare = _NUMBERED.sub(r"\1_\2", _TAU_J.sub("tau", named_unit(name)[0]))
        left, quantities = [], []
        for part in parts_of(bare):
            words = part.split("_")
            quantities += [_OF_WORD[word.lower()] for word in words if word.lower() in _OF_WORD]
            left.append("_".join(word for word in words if word.lower() not in _OF_WORD))
        joint = ".".join(filter(None, left))
        if len(quantities) == 1 and joint:
            found.setdefault(joint, {}).setdefault(quantities[0], []).append(name)
    return found


def _words(name: str) -> list[str]:
    return [word for part in parts_of(name) for word in part.lower().split("_") if word]
