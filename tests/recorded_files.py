"""Files of other programs, written by the libraries that know them."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import ezc3d
import numpy as np
import numpy.typing as npt
import pyuff
from asammdf import MDF, Signal
from nptdms import ChannelObject, TdmsWriter
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

import tvident

Array = npt.NDArray[np.float64]

T = np.arange(300) / 250
ANGLE, TORQUE = 20 * np.sin(9 * T), np.cos(5 * T) + 0.1

RECORDING = tvident.FileRecording({"time [s]": T, "angle [deg]": ANGLE, "torque [N m]": TORQUE})


def tdms(path: Path) -> None:
    common = {"wf_increment": 1 / 250, "wf_start_offset": 0.0}
    with TdmsWriter(path) as writer:
        writer.write_segment(
            [
                ChannelObject("rig", "angle", ANGLE, {**common, "unit_string": "deg"}),
                ChannelObject("rig", "torque", TORQUE, {**common, "NI_UnitDescription": "N m"}),
            ]
        )


def mdf(path: Path) -> None:
    made = MDF(version="4.10")
    made.append(
        [
            Signal(samples=samples, timestamps=T, name=name, unit=unit)
            for name, unit, samples in (("angle", "deg", ANGLE), ("torque", "N m", TORQUE))
        ]
    )
    made.append(Signal(samples=np.arange(30.0), timestamps=T[::10], name="slow", unit="°C"))
    made.save(path)
    made.close()


def uff(path: Path) -> None:
    exponents = {
        f"{axis}_{of}_unit_exp": 0
        for axis in ("abscissa", "ordinate", "orddenom", "z_axis")
        for of in ("len", "force", "temp")
    }
    empty = {
        f"{axis}_{of}_lab": "NONE"
        for axis in ("abscissa", "ordinate", "orddenom", "z_axis")
        for of in ("axis", "axis_units")
    }
    kinds = {f"{axis}_spec_data_type": 0 for axis in ("abscissa", "ordinate", "orddenom", "z_axis")}
    words = {"id2": "", "id3": "", "id4": "", "id5": "", "rsp_ent_name": "NONE", "ref_ent_name": "NONE"}
    numbers = dict.fromkeys(("func_id", "ver_num", "load_case_id", "ref_node", "ref_dir", "z_axis_value"), 0)
    for name, unit, samples in (("angle", "deg", ANGLE), ("torque", "N m", TORQUE)):
        of_set = {
            "type": 58,
            "binary": 1,
            "func_type": 1,
            "id1": name,
            "rsp_node": 1,
            "rsp_dir": 1,
            "x": T,
            "data": samples,
        }
        place = {
            "abscissa_min": 0.0,
            "abscissa_inc": 1 / 250,
            "abscissa_spacing": 1,
            "num_pts": T.size,
            "ord_data_type": 4,
        }
        labels = {"ordinate_axis_units_lab": unit, "abscissa_axis_units_lab": "s"}
        made = exponents | empty | kinds | words | numbers | of_set | place | labels
        pyuff.UFF(str(path)).write_sets(made, "add")


def c3d(path: Path) -> None:
    made = ezc3d.c3d()
    made["parameters"]["POINT"]["RATE"]["value"] = [250.0]
    made["parameters"]["POINT"]["LABELS"]["value"] = ["angle", "marker"]
    made["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    made.add_parameter("POINT", "ANGLES", ["angle"])
    made.add_parameter("POINT", "ANGLE_UNITS", ["deg"])
    points = np.ones((4, 2, T.size))
    points[0, 0] = ANGLE
    made["data"]["points"] = points
    made["parameters"]["ANALOG"]["RATE"]["value"] = [250.0]
    made["parameters"]["ANALOG"]["LABELS"]["value"] = ["torque"]
    made["parameters"]["ANALOG"]["UNITS"]["value"] = ["N m"]
    made["data"]["analogs"] = TORQUE[None, None]
    made.write(str(path))


def xdf(path: Path) -> None:
    # The clock of the stream is 5 s behind that of the recorder.
    offsets = [(1000 + at, 5.0) for at in (0.0, 0.6, 1.2)]
    channels = [("angle", "deg", ANGLE), ("torque", "N m", TORQUE)]
    path.write_bytes(xdf_of([XdfStream("rig", 1000 + T, channels, offsets)]))


@dataclass(frozen=True)
class XdfStream:
    """Stamps of a stream's own clock, channels as (label, unit, values), and (own time, recorder's clock less that of the stream)."""

    name: str
    stamps: Array
    channels: list[tuple[str, str, Array]]
    offsets: list[tuple[float, float]]


def xdf_of(streams: list[XdfStream]) -> bytes:
    """Give the content of a file of streams with 250 samples a second."""

    def chunk(tag: int, content: bytes) -> bytes:
        return b"\x04" + struct.pack("<I", len(content) + 2) + struct.pack("<H", tag) + content

    found = b"XDF:" + chunk(1, b'<?xml version="1.0"?><info><version>1.0</version></info>')
    for number, one in enumerate(streams, start=1):
        channels = "".join(
            f"<channel><label>{name}</label><unit>{unit}</unit></channel>" for name, unit, _ in one.channels
        )
        count = len(one.channels)
        header = (
            f'<?xml version="1.0"?><info><name>{one.name}</name><type>x</type><channel_count>{count}</channel_count>'
            "<nominal_srate>250</nominal_srate><channel_format>double64</channel_format>"
            f"<desc><channels>{channels}</channels></desc></info>"
        )
        rows = zip(one.stamps, *(values for _, _, values in one.channels), strict=True)
        samples = b"".join(b"\x08" + struct.pack(f"<d{count}d", at, *row) for at, *row in rows)
        stream = struct.pack("<I", number)
        found += chunk(2, stream + header.encode())
        found += chunk(3, stream + b"\x04" + struct.pack("<I", one.stamps.size) + samples)
        found += b"".join(chunk(4, stream + struct.pack("<dd", *offset)) for offset in one.offsets)
        found += chunk(6, stream + b"<?xml version='1.0'?><info></info>")
    return found


def _joint_states(
    writer: Any,
    store: Any,
    motion: tuple[Array, Array, Array],
    velocity: Array | None,
) -> None:
    """Write messages of two joints, of which one moves: times, angle and torque; without a velocity where nothing measured it."""
    is_ros1 = isinstance(writer, Ros1Writer)
    types: Any = store.types
    joints, header, time = (
        types[name] for name in ("sensor_msgs/msg/JointState", "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
    )
    connection = writer.add_connection("/joint_states", joints.__msgtype__, typestore=store)
    speeds = [np.array([])] * motion[0].size if velocity is None else [np.array([0.0, one]) for one in velocity]
    for at, angle, torque, speed in zip(*motion, speeds, strict=True):
        stamp = round(1e9 * at) + 10**18
        message = joints(
            header=header(
                stamp=time(sec=stamp // 10**9, nanosec=stamp % 10**9), frame_id="", **({"seq": 0} if is_ros1 else {})
            ),
            name=["shoulder", "elbow"],
            position=np.array([0.0, angle]),
            velocity=speed,
            effort=np.array([0.0, torque]),
        )
        serialize = store.serialize_ros1 if is_ros1 else store.serialize_cdr
        writer.write(connection, stamp + 5000, serialize(message, joints.__msgtype__))


def mcap(
    path: Path,
    times: Array = T,
    angle: Array = ANGLE * np.pi / 180,
    torque: Array = TORQUE,
    velocity: Array | None = None,
) -> None:
    folder = path.parent / "bag"
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        _joint_states(writer, get_typestore(Stores.ROS2_HUMBLE), (times, angle, torque), velocity)
    next(folder.glob("*.mcap")).rename(path)


def bag(
    path: Path,
    times: Array = T,
    angle: Array = ANGLE * np.pi / 180,
    torque: Array = TORQUE,
    velocity: Array | None = None,
) -> None:
    with Ros1Writer(path) as writer:
        _joint_states(writer, get_typestore(Stores.ROS1_NOETIC), (times, angle, torque), velocity)


WRITTEN: dict[str, Callable[[Path], None]] = {
    **dict.fromkeys((".csv", ".npz", ".parquet", ".h5", ".mat", ".xlsx"), RECORDING.write),
    ".tdms": tdms,
    ".mf4": mdf,
    ".uff": uff,
    ".c3d": c3d,
    ".xdf": xdf,
    ".mcap": mcap,
    ".bag": bag,
}
"""How to write a file of each ending."""
