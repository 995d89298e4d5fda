"""Messages of ROS bags: MCAP and SQLite of ROS 2, and the bags of ROS 1."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tvident._formats.groups import Group, named
from tvident._formats.told import Remark, cut, in_words

_JOINTS = "sensor_msgs/msg/JointState"
_QUANTITIES = ("position", "velocity", "effort")

_ZSTD = b"\x28\xb5\x2f\xfd"
"""How what Zstandard compressed begins."""

_NEARLY_ALL = 0.9
"""Part of a topic's messages that have a field which the others lack."""

_MOST_ELEMENTS = 64
"""Of an array in a message: more is a picture or a cloud of points."""


def variables(path: str, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give position, velocity and effort of every joint, and every number of other messages; times are those of their headers."""
    from rosbags.highlevel import AnyReader  # noqa: PLC0415 - an extra
    from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415 - likewise

    store = get_typestore(Stores.ROS1_NOETIC if path.endswith(".bag") else Stores.ROS2_HUMBLE)
    collected: dict[str, _Topic] = {}
    with AnyReader([Path(path)], default_typestore=store) as reader:
        for connection, received, raw in reader.messages():
            topic = collected.setdefault(connection.topic, _Topic(connection.topic, connection.msgtype))
            if topic.failed:
                continue
            try:
                topic.add(reader.deserialize(raw, connection.msgtype), received)
            except Exception as error:  # noqa: BLE001 - of one topic; the others may be whole
                # Only the file of settings beside a bag says so.
                is_packed = bytes(raw[:4]) == _ZSTD
                topic.failed = (
                    "each message is compressed; write it again with ros2 bag convert" if is_packed else in_words(error)
                )
    groups = []
    read = [topic for topic in collected.values() if topic.columns and not topic.failed]
    # Topics that began later have later times.
    first = min((stamps[0] for topic in read for stamps, _ in topic.columns.values()), default=0)
    for topic in collected.values():
        if topic in read:
            groups += topic.groups(first)
            skipped += [f"{cut(topic.name)}.{cut(name)} ({why})" for name, why in topic.left_out.items()]
            skipped += [
                Remark(f"{cut(topic.name)}.{cut(name)} is not in {count} messages of its topic: missing values")
                for name, count in topic.gaps.items()
            ]
        else:
            skipped.append(f"{cut(topic.name)} ({topic.failed or 'no numbers'})")
    yield from named(groups, skipped)


class _Topic:
    def __init__(self, name: str, kind: str) -> None:
        self.name = name.strip("/")
        self.is_joints = kind == _JOINTS
        self.failed = ""
        self.columns: dict[str, tuple[list[int], list[float]]] = {}
        """Stamps in nanoseconds and values by name."""
        self.left_out: dict[str, str] = {}
        """Fields that are not read, and why."""
        self.gaps: dict[str, int] = {}
        """Messages that lack a field which the others have."""

    def add(self, message: Any, received: int) -> None:
        stamp = getattr(getattr(message, "header", None), "stamp", None)
        at = (
            received
            if stamp is None or not (stamp.sec or stamp.nanosec)
            else 10**9 * int(stamp.sec) + int(stamp.nanosec)
        )
        for name, value in _of_joints(message) if self.is_joints else _numbers("", message, self.left_out):
            stamps, values = self.columns.setdefault(name, ([], []))
            stamps.append(at)
            values.append(value)

    def groups(self, first: int) -> list[Group]:
        """Return the columns that have the same stamps together: joints may come in messages of their own."""
        import numpy as np  # noqa: PLC0415 - within the limits

        found: dict[bytes, Group] = {}
        longest = np.asarray(max((one for one, _ in self.columns.values()), key=len, default=[]), dtype=np.int64)
        for name, (stamps, values) in self.columns.items():
            exact, samples = np.asarray(stamps, dtype=np.int64), np.asarray(values)
            if _is_nearly_all(exact, longest):
                # A few messages lack it: its samples are missing there, and its clock is that of the others.
                self.gaps[name] = longest.size - exact.size
                places, samples = np.searchsorted(longest, exact), np.full(longest.size, np.nan)
                samples[places] = values
                exact = longest
            key = exact.tobytes()
            if key not in found:
                count = f"_{len(found)}" if found else ""
                found[key] = Group(f"{self.name}{count}", (exact - first) / 1e9)
            found[key].channels.append((name, "", samples))
        return list(found.values())


def _is_nearly_all(stamps: Any, longest: Any) -> bool:
    """Return whether stamps are some of others that increase, and hardly any are missing."""
    import numpy as np  # noqa: PLC0415 - within the limits

    if not _NEARLY_ALL * longest.size <= stamps.size < longest.size or not (np.diff(longest) > 0).all():
        return False
    return bool((np.diff(stamps) > 0).all() and np.isin(stamps, longest).all())


def _of_joints(message: Any) -> Iterator[tuple[str, float]]:
    """Give what is known of every joint, called by its number where it has no name, or another has the same."""
    names: dict[str, int] = {}
    for number, name in enumerate(message.name):
        names.setdefault(name if name and name not in names else f"{name}{number}", number)
    called = {number: name for name, number in names.items()}
    for quantity in _QUANTITIES:
        for number, value in enumerate(getattr(message, quantity)):
            yield f"{called.get(number, f'joint{number}')}.{quantity}", float(value)


def _numbers(prefix: str, message: Any, left_out: dict[str, str]) -> Iterator[tuple[str, float]]:
    """Give the numbers of a message by the names of their fields, and note what holds more numbers than channels."""
    for field in getattr(message, "__dataclass_fields__", {}):
        if field.startswith("__") or field == "header":
            continue
        value, name = getattr(message, field), f"{prefix}{field}"
        if isinstance(value, bool | int | float):
            yield name, float(value)
        elif hasattr(value, "__dataclass_fields__"):
            yield from _numbers(f"{name}.", value, left_out)
        elif hasattr(value, "dtype") and value.dtype.kind in "biuf":
            if value.size <= _MOST_ELEMENTS:
                yield from ((f"{name}.{index}", float(one)) for index, one in enumerate(value.reshape(-1)))
            else:
                left_out[name] = f"{value.size} numbers in a message; {_MOST_ELEMENTS} are channels at most"
        elif isinstance(value, list) and any(hasattr(one, "__dataclass_fields__") for one in value):
            left_out[name] = "a list of messages"
