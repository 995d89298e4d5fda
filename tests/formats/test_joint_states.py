"""Joints of which a few messages lack a field: samples are missing there, and the clock is that of all."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

import tvident

RIG = tvident.simulate_torsional_rig(2.0)
STORE = get_typestore(Stores.ROS2_HUMBLE)
JOINTS: Any = STORE.types["sensor_msgs/msg/JointState"]
HEADER: Any = STORE.types["std_msgs/msg/Header"]
TIME: Any = STORE.types["builtin_interfaces/msg/Time"]


def written(folder: Path, lack: set[int]) -> Path:
    """Write positions and efforts of two joints, in an order that changes, some messages without efforts."""
    with Writer(folder / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topic = writer.add_connection("/joint_states", JOINTS.__msgtype__, typestore=STORE)
        for place, (angle, torque) in enumerate(zip(RIG.angle.tolist(), RIG.torque.tolist(), strict=True)):
            order = slice(None, None, -1 if place % 2 else 1)
            stamp = 1_700_000_000_000_000_000 + place * 1_000_000
            message = JOINTS(
                HEADER(TIME(stamp // 10**9, stamp % 10**9), ""),
                ["elbow", "wrist"][order],
                np.array([angle, 0.5][order]),
                np.zeros(0),
                np.zeros(0) if place in lack else np.array([torque, 0.1][order]),
            )
            writer.write(topic, stamp, STORE.serialize_cdr(message, JOINTS.__msgtype__))
    return next((folder / "bag").glob("*.mcap"))


def test_a_field_that_few_messages_lack_is_missing_there(tmp_path: Path) -> None:
    """Its clock was another: `--joint elbow` was refused for two messages of 2000."""
    with pytest.warns(tvident.recordings.FileWarning, match="effort is not in 2 messages of its topic: missing values"):
        recording = tvident.read_recording(written(tmp_path, {1000, 1001}))
    assert recording.sample_rate == pytest.approx(1000)
    assert np.flatnonzero(np.isnan(recording["elbow.effort"])).tolist() == [1000, 1001]
    np.testing.assert_array_equal(recording["elbow.position"], RIG.angle)
    found = tvident.identify(recording["elbow.position"], recording["elbow.effort"], sample_rate=1000)
    assert found.value("inertia").value == pytest.approx(0.0123, rel=0.02)


def test_a_field_that_many_messages_lack_has_a_clock_of_its_own(tmp_path: Path) -> None:
    recording = tvident.read_recording(written(tmp_path, set(range(0, 2000, 2))))
    assert recording["elbow.effort"].size == 1000
    assert recording["elbow.position"].size == 2000
