"""Files that rigs write and that their libraries read without a word: parts, axes, clocks and samples that are not what they seem."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import ezc3d
import h5py
import numpy as np
import pytest
import pyuff
import zarr
from asammdf import MDF, Signal
from nptdms import ChannelObject, TdmsWriter
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

import recorded_files as examples
import tvident
from tvident import recordings
from tvident._formats import FORMATS
from tvident._formats.told import Remark

T, ANGLE, TORQUE = examples.T, examples.ANGLE, examples.TORQUE

START = np.datetime64("2024-01-01T10:00:00.5")


def read(path: Path) -> tuple[Mapping[str, tvident.Channel], str, str]:
    """Return channels, what was not read, and what was not read as it stands, without the time to start a process."""
    told: list[str] = []
    module = import_module(f"tvident._formats.{FORMATS[path.suffix].module}")
    found = tvident.FileRecording(dict(module.variables(str(path), told)))
    remarks = [one for one in told if isinstance(one, Remark)]
    return found, "; ".join(one for one in told if one not in remarks), "; ".join(remarks)


def tdms(path: Path, *segments: Sequence[tuple[str, Any, Mapping[str, Any]]]) -> Path:
    with TdmsWriter(path) as writer:
        for segment in segments:
            writer.write_segment(
                [
                    ChannelObject("rig", name, samples, {"wf_increment": 1 / 250, "wf_start_offset": 0.0, **properties})
                    for name, samples, properties in segment
                ]
            )
    return path


def test_what_was_appended_later_has_later_times(tmp_path: Path) -> None:
    """A pause of a minute between two parts was lost: both came one after the other."""
    parts = [[("angle", ANGLE, {"wf_start_time": START + np.timedelta64(one, "s")})] for one in (0, 60)]
    found, _, remarks = read(tdms(tmp_path / "x.tdms", *parts))
    np.testing.assert_allclose(found["time"], np.concatenate([T, 60 + T]), atol=1e-9)
    np.testing.assert_array_equal(found["angle"], np.tile(ANGLE, 2))
    assert remarks == "channel angle: it was appended to 58.8 s after its end, as its times say"
    ends = START + np.timedelta64(1200, "ms")
    parts = [[("angle", ANGLE, {"wf_start_time": one})] for one in (START, ends)]
    found, _, remarks = read(tdms(tmp_path / "x.tdms", *parts))
    np.testing.assert_allclose(found["time"], np.arange(600) / 250, atol=1e-9)
    assert not remarks


@pytest.mark.parametrize(
    ("of_second", "why"),
    [
        ({"unit_string": "rad"}, "another unit: deg, then rad"),
        ({"wf_increment": 1 / 500}, "another sample period: 0.004"),
    ],
)
def test_parts_of_other_units_or_rates_are_no_channel(tmp_path: Path, of_second: Mapping[str, Any], why: str) -> None:
    """Degrees of the first part were read as the rad of the second, times of the first at the rate of the second."""
    first = {"unit_string": "deg"}
    kinds: list[dict[str, Any]] = [first, {**first, **of_second}]
    parts: Any = [[("angle", ANGLE, one), ("torque", TORQUE, {})] for one in kinds]
    found, skipped, _ = read(tdms(tmp_path / "x.tdms", *parts))
    assert list(found) == ["time", "torque"]
    assert why in skipped


def test_parts_whose_properties_differ_by_rounding_or_spelling_are_one_channel(tmp_path: Path) -> None:
    """Such channels were lost."""
    kinds = [{"wf_increment": (1 + 1e-13) / 250, "unit_string": "rad"}, {"unit_string": "radians"}]
    parts: Any = [[("angle", ANGLE, one)] for one in kinds]
    found, skipped, _ = read(tdms(tmp_path / "x.tdms", *parts))
    assert (found["angle"].shape, skipped) == ((2 * ANGLE.size,), "")


def test_properties_that_are_written_before_or_behind_samples_are_of_all(tmp_path: Path) -> None:
    parts: Any = [[("angle", samples, {"unit_string": unit})] for samples, unit in ((T[:0], "rad"), (T[:0], "deg"))]
    found, skipped, _ = read(tdms(tmp_path / "x.tdms", parts[0], [("angle", ANGLE, {})], parts[1]))
    assert (found["angle"].unit, skipped) == ("deg", "")


def test_an_axis_that_is_none_of_seconds_is_called_as_it_is(tmp_path: Path) -> None:
    """Milliseconds were seconds, and the frequencies of a spectrum times."""
    in_ms = {"wf_increment": 4.0, "wf_xunit_string": "ms"}
    found, _, _ = read(tdms(tmp_path / "x.tdms", [("angle", ANGLE, in_ms)]))
    assert (found["time"].unit, tvident.FileRecording(found).sample_rate) == ("ms", 250)
    spectrum = {"wf_increment": 2.5, "wf_xname": "Frequency", "wf_xunit_string": "Hz"}
    found, _, _ = read(tdms(tmp_path / "x.tdms", [("angle", ANGLE, {}), ("spectrum", TORQUE, spectrum)]))
    assert {name: one.unit for name, one in found.items() if not name.endswith(("angle", "spectrum"))} == {
        "rig.time": "s",
        "rig.Frequency": "Hz",
    }


@pytest.mark.parametrize("period", [0.0, -0.004, float("nan")])
def test_a_sample_period_that_is_none_gives_no_times(tmp_path: Path, period: float) -> None:
    found, _, remarks = read(tdms(tmp_path / "x.tdms", [("angle", ANGLE, {"wf_increment": period})]))
    assert list(found) == ["angle"]
    assert "so it has no times" in remarks


def test_channels_without_samples_or_scale_are_named(tmp_path: Path) -> None:
    """An empty channel was gone without a word; raw numbers were read as degrees where nothing knew their scale."""
    unknown = {"NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Alien", "unit_string": "deg"}
    content = [("angle", (100 * ANGLE).astype(np.int16), unknown), ("torque", TORQUE, {}), ("none", np.zeros(0), {})]
    found, skipped, _ = read(tdms(tmp_path / "x.tdms", content))
    assert list(found) == ["time", "torque"]
    assert skipped == "angle (Unsupported scale type: Alien); none (no samples)"


def test_a_file_cut_within_the_names_of_its_last_part_says_so(tmp_path: Path) -> None:
    path = tdms(tmp_path / "x.tdms", [("angle", ANGLE, {})], [("angle", ANGLE, {"unit_string": "deg"})])
    content = path.read_bytes()
    path.write_bytes(content[: len(content) - 8 * ANGLE.size - 20])
    assert "cut off" in read(path)[1]


def test_clocks_of_stamps_begin_together(tmp_path: Path) -> None:
    """Each began at 0, whatever lay between them."""
    stamps = START + (1e6 * T).astype("timedelta64[us]")
    with TdmsWriter(tmp_path / "x.tdms") as writer:
        late = stamps + np.timedelta64(1, "s")
        writer.write_segment([ChannelObject("rig", name, one) for name, one in (("clock", stamps), ("other", late))])
    found, _, _ = read(tmp_path / "x.tdms")
    np.testing.assert_allclose(found["other"] - found["clock"], 1)


@pytest.mark.parametrize("unit", ["[deg]", " (deg) ", "deg"])
def test_brackets_of_a_unit_are_no_part_of_it(tmp_path: Path, unit: str) -> None:
    """`angle` in `[deg]` was called `angle [ ]`."""
    found, _, _ = read(tdms(tmp_path / "x.tdms", [("angle", ANGLE, {"unit_string": unit})]))
    assert found["angle"].unit == "deg"


def mdf(path: Path, *signals: Signal, sync: int = 1, unit: str = "s") -> Path:
    made = MDF(version="4.10")
    made.append(list(signals))
    master: Any = made.groups[0].channels[0]
    master.sync_type, master.unit, master.name = sync, unit, "time" if sync == 1 else "crank"
    made.save(path, overwrite=True)
    made.close()
    return path


def test_invalid_samples_are_missing_where_they_are(tmp_path: Path) -> None:
    """They were left out: all later ones came earlier, and two channels with as many at other times had one clock."""
    invalid = np.zeros((2, T.size), dtype=bool)
    invalid[0, 5:9] = invalid[1, 100:104] = True
    signals = [
        Signal(samples=samples, timestamps=T, name=name, invalidation_bits=bits)
        for name, samples, bits in (("angle", ANGLE, invalid[0]), ("torque", TORQUE, invalid[1]))
    ]
    found, _, remarks = read(mdf(tmp_path / "x.mf4", *signals))
    np.testing.assert_array_equal(found["time"], T)
    np.testing.assert_array_equal(found["angle"], np.where(invalid[0], np.nan, ANGLE))
    np.testing.assert_array_equal(found["torque"], np.where(invalid[1], np.nan, TORQUE))
    assert "channel angle: 4 samples that the file calls invalid are missing" in remarks


@pytest.mark.parametrize(("sync", "unit", "said"), [(2, "deg", "deg"), (2, "", "rad"), (3, "", "m"), (4, "", "")])
def test_signals_over_angles_have_no_times(tmp_path: Path, sync: int, unit: str, said: str) -> None:
    """Angles of a shaft, ways and numbers of samples were seconds."""
    path = mdf(tmp_path / "x.mf4", Signal(samples=TORQUE, timestamps=T, name="torque"), sync=sync, unit=unit)
    found, _, _ = read(path)
    assert [(name, one.unit) for name, one in found.items()] == [("crank", said), ("torque", "")]
    with pytest.raises(ValueError, match="needs a channel of times"):
        _ = tvident.FileRecording(found).sample_rate


def uff(path: Path, **settings: Any) -> Path:
    common = dict.fromkeys(("rsp_node", "ref_node", "ref_dir", "orddenom_spec_data_type", "z_axis_spec_data_type"), 0)
    kind = {"type": 58, "func_type": 1, "rsp_dir": 1, "abscissa_spacing": 1, "abscissa_spec_data_type": 17}
    for name, samples in (("angle", ANGLE), ("torque", TORQUE)):
        content = common | kind | {"id1": name, "x": T, "data": samples, "ordinate_spec_data_type": 0}
        pyuff.UFF(str(path)).write_sets(content | (settings if name == "torque" else {}), "add")
    return path


def test_functions_of_another_abscissa_are_no_functions_of_time(tmp_path: Path) -> None:
    """A general function of a frequency had times, and milliseconds were seconds."""
    path = uff(tmp_path / "x.uff", func_type=0, abscissa_spec_data_type=18, abscissa_axis_units_lab="Hz")
    found, skipped, _ = read(path)
    assert (list(found), skipped) == (["time", "angle"], "torque (no function of time)")
    found, _, _ = read(uff(tmp_path / "y.uff", x=1e3 * T, abscissa_axis_units_lab="ms"))
    assert (found["set1.time"].unit, found["set0.time"].unit) == ("ms", "s")


def test_damage_within_a_universal_file_is_of_one_dataset(tmp_path: Path) -> None:
    """Lines that are lost moved all later samples, without a word; a wrong digit cost the whole file."""
    lines = uff(tmp_path / "x.uff").read_text().splitlines(keepends=True)
    (tmp_path / "x.uff").write_text("".join(lines[:20] + lines[21:]))
    found, skipped, _ = read(tmp_path / "x.uff")
    assert (list(found), skipped) == (["time", "torque"], "angle (it holds 296 of 300 samples: it is damaged)")
    (tmp_path / "x.uff").write_text("".join([*lines[:20], lines[20].replace("e", "#"), *lines[21:]]))
    found, skipped, _ = read(tmp_path / "x.uff")
    assert list(found) == ["time", "torque"]
    assert skipped.startswith("dataset 0 (")


def c3d(path: Path, names: Sequence[str], frames: int, **lists: Sequence[str]) -> Path:
    made = ezc3d.c3d()
    point, analog = made["parameters"]["POINT"], made["parameters"]["ANALOG"]
    point["RATE"]["value"], point["LABELS"]["value"], point["UNITS"]["value"] = [250.0], list(names), ["mm"]
    for name, values in lists.items():
        made.add_parameter("POINT", name, list(values))
    analog["RATE"]["value"], analog["LABELS"]["value"], analog["UNITS"]["value"] = [1000.0], ["torque"], ["N m"]
    made["data"]["points"] = np.ones((4, len(names), frames))
    made["data"]["analogs"] = np.ones((1, 1, 4 * frames))
    made.write(str(path))
    return path


def test_points_beyond_255_keep_their_names(tmp_path: Path) -> None:
    """They were point255 and on: names go on in a second parameter."""
    found, _, _ = read(c3d(tmp_path / "x.c3d", [f"m{one}" for one in range(260)], 3))
    assert found["points.m259.x"].unit == "mm"
    assert found["analog.time"].size == 12


def test_results_of_a_model_without_a_unit_are_no_lengths(tmp_path: Path) -> None:
    """Angles were in mm, which is the unit of markers, where the file did not say theirs."""
    found, _, _ = read(c3d(tmp_path / "x.c3d", ["knee", "marker"], 3, ANGLES=["knee"]))
    assert (found["points.knee.x"].unit, found["points.marker.x"].unit) == ("", "mm")


def test_a_file_of_motion_capture_that_was_cut_early_is_refused_at_once(tmp_path: Path) -> None:
    """Its library never ended: the message came after half a minute, and named that alone."""
    path = c3d(tmp_path / "x.c3d", ["knee"], 300)
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(recordings.FileError, match="it ends before its data begin; copy it again"):
        recordings.read(path)


def test_streams_without_corrections_of_their_clocks_are_named(tmp_path: Path) -> None:
    """The words were those of the library: "Segments and clock-segments differ", of a stream by its number, as if it were not read."""
    corrected = [(1000.0 + at, 5.0) for at in (0.0, 0.6, 1.2)]
    streams = [
        examples.XdfStream(name, at + T, [(name, "", ANGLE)], offsets)
        for name, at, offsets in (("encoder", 1000, corrected), ("cell", 1005, []))
    ]
    (tmp_path / "x.xdf").write_bytes(examples.xdf_of(streams))
    _, skipped, remarks = read(tmp_path / "x.xdf")
    assert not skipped
    assert remarks.startswith("stream cell: the file has no corrections of its clock")
    (tmp_path / "x.xdf").write_bytes(examples.xdf_of(streams[1:]))
    assert read(tmp_path / "x.xdf")[1:] == ("", "")


def bag(path: Path, messages: Sequence[tuple[str, float, Any]]) -> Path:
    store = get_typestore(Stores.ROS1_NOETIC)
    with Ros1Writer(path) as writer:
        known: dict[str, Any] = {}
        for topic, at, message in messages:
            if topic not in known:
                known[topic] = writer.add_connection(topic, message.__msgtype__, typestore=store)
            writer.write(known[topic], round(1e9 * at) + 10**18, store.serialize_ros1(message, message.__msgtype__))
    return path


def test_topics_keep_what_lies_between_their_beginnings(tmp_path: Path) -> None:
    """Every topic began at 0: a torque that began 40 ms after the angle had a lag of so much."""
    number: Any = get_typestore(Stores.ROS1_NOETIC).types["std_msgs/msg/Float64"]
    messages = [(topic, late + at, number(data=at)) for topic, late in (("/angle", 0.0), ("/torque", 0.04)) for at in T]
    found, _, _ = read(bag(tmp_path / "x.bag", messages))
    np.testing.assert_allclose(found["torque.time"] - found["angle.time"], 0.04, atol=1e-9)


def test_joints_of_one_name_or_none_are_told_apart(tmp_path: Path) -> None:
    """Samples of two joints stood in one channel in turn; joints without names were gone."""
    types: Any = get_typestore(Stores.ROS1_NOETIC).types
    header = types["std_msgs/msg/Header"](
        seq=0, stamp=types["builtin_interfaces/msg/Time"](sec=0, nanosec=0), frame_id=""
    )
    none = np.zeros(0)
    for names, called in ((["j", "j"], ["j", "j1"]), ([], ["joint0", "joint1"]), (["a"], ["a", "joint1"])):
        messages = [
            (
                "/joint_states",
                at,
                types["sensor_msgs/msg/JointState"](
                    header=header, name=names, position=np.array([at, -at]), velocity=none, effort=none
                ),
            )
            for at in T
        ]
        path = tmp_path / "x.bag"
        path.unlink(missing_ok=True)
        found, _, _ = read(bag(path, messages))
        assert list(found) == ["time", *(f"{one}.position" for one in called)]
        np.testing.assert_allclose(found[f"{called[1]}.position"], -T)


def test_arrays_that_are_too_long_for_channels_are_named(tmp_path: Path) -> None:
    """They were gone without a word."""
    types: Any = get_typestore(Stores.ROS1_NOETIC).types
    layout = types["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
    message = types["std_msgs/msg/Float64MultiArray"](layout=layout, data=np.zeros(100))
    assert "a.data (100 numbers in a message" in read(bag(tmp_path / "x.bag", [("/a", at, message) for at in T[:3]]))[1]


MATRIX = np.stack([1e3 * T, ANGLE, TORQUE], axis=1)


@pytest.mark.parametrize("is_across", [False, True])
@pytest.mark.parametrize(
    ("names", "units"),
    [
        (["time [ms]", "angle [deg]", "torque [N m]"], None),
        ("time,angle,torque", "ms,deg,N m"),
        (np.array(["time", "angle", "torque"], dtype="S"), ["ms", "deg", "N m"]),
    ],
)
def test_columns_of_a_matrix_are_called_as_attributes_say(
    tmp_path: Path, is_across: bool, names: Any, units: Any
) -> None:
    """They were data.0, data.1 and data.2, without units and without a word."""
    with h5py.File(tmp_path / "x.h5", "w") as file:
        made = file.create_dataset("run/data", data=MATRIX.T if is_across else MATRIX)
        (file["run"] if is_across else made).attrs["column_names"] = names
        if units is not None:
            made.attrs["units"] = units
    found, skipped, _ = read(tmp_path / "x.h5")
    assert {name: one.unit for name, one in found.items()} == {
        "run.data.time": "ms",
        "run.data.angle": "deg",
        "run.data.torque": "N m",
    }
    np.testing.assert_array_equal(found["angle"], ANGLE)
    assert not skipped


def test_chunks_that_were_never_written_are_said(tmp_path: Path) -> None:
    """They were zeros without a word."""
    with h5py.File(tmp_path / "x.h5", "w") as file:
        made = file.create_dataset("torque", TORQUE.shape, "f8", chunks=(50,), fillvalue=0.0)
        made[:100] = TORQUE[:100]
        file.create_dataset("angle", data=ANGLE, chunks=(50,))
    count = -(-TORQUE.size // 50)
    said = f"torque: {count - 2} of {count} chunks were never written and were read as 0.0"
    assert read(tmp_path / "x.h5")[2] == said


def test_a_list_of_matrices_calls_none_of_their_rows(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "x.h5", "w") as file:
        file["angle"], file["torque"] = np.stack([ANGLE, ANGLE]), np.stack([TORQUE, TORQUE])
        file.attrs["channels"] = "angle,torque"
    assert list(read(tmp_path / "x.h5")[0]) == ["angle", "torque"]


@pytest.mark.parametrize("key", ["title", "name"])
def test_a_title_calls_no_columns(tmp_path: Path, key: str) -> None:
    """`knee, slow` named two columns."""
    with h5py.File(tmp_path / "x.h5", "w") as file:
        file["data"] = MATRIX[:, 1:]
        file.attrs[key] = "knee, slow"
    assert list(read(tmp_path / "x.h5")[0]) == ["data"]


def test_a_list_beside_a_matrix_calls_its_columns(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "x.h5", "w") as file:
        file["data"], file["labels"], file["units"] = MATRIX, ["time", "angle", "torque"], ["ms", "deg", "N m"]
        file["notes"] = ["one", "two"]
    found, skipped, _ = read(tmp_path / "x.h5")
    assert ([one.unit for one in found.values()], skipped) == (["ms", "deg", "N m"], "notes (no numbers)")
    with h5py.File(tmp_path / "y.h5", "w") as file:
        file["data"] = MATRIX
        file["data"].attrs["unit"] = "deg"  # of all
        file["data"].attrs["columns"] = ["a", "b"]
    assert {name: one.unit for name, one in read(tmp_path / "y.h5")[0].items()} == dict.fromkeys(
        ("data.0", "data.1", "data.2"), "deg"
    )


def test_arrays_of_zarr_are_channels(tmp_path: Path) -> None:
    """A folder called x.zarr was refused: "name a file in it"."""
    group = zarr.open_group(str(tmp_path / "x.zarr"), mode="w")
    for name, samples, unit in (("angle", ANGLE, "deg"), ("torque", TORQUE, "N m")):
        made = group.require_group("rig").create_array(name, data=samples)
        made.attrs["units"] = unit
    group.attrs["fs"] = 250.0
    group.create_array("data", data=MATRIX).attrs["columns"] = ["time", "angle", "torque"]
    found = tvident.read_recording(tmp_path / "x.zarr")
    assert found.units == {
        "sample_rate": "Hz",
        **dict.fromkeys(("data.time", "data.angle", "data.torque"), ""),
        "rig.angle": "deg",
        "rig.torque": "N m",
    }
    np.testing.assert_array_equal(found["rig.torque"], TORQUE)
    assert found.sample_rate == 250


def test_a_store_that_is_not_whole_says_so(tmp_path: Path) -> None:
    group = zarr.open_group(str(tmp_path / "x.zarr"), mode="w")
    for name in ("angle", "torque"):
        group.create_array(name, data=ANGLE + 100, chunks=(100,))
    first, second = (
        min(one for one in (tmp_path / "x.zarr" / name).rglob("*") if one.is_file() and one.suffix != ".json")
        for name in ("angle", "torque")
    )
    first.write_bytes(first.read_bytes()[:-20])
    second.unlink()
    found, skipped, remarks = read(tmp_path / "x.zarr")
    assert list(found) == ["torque"]
    assert skipped.startswith("angle (")
    assert remarks.startswith("torque: 1 of 3 chunks are not in the store and were read as 0")
    (tmp_path / "empty.zarr").mkdir()
    with pytest.raises(recordings.FileError, match="must not be empty; this one has no bytes; copy it again"):
        recordings.read(tmp_path / "empty.zarr")


def test_bags_of_compressed_messages_and_damaged_ones_say_what_to_do(tmp_path: Path) -> None:
    """It said "Invalid or unsupported CDR encapsulation", and of a bag whose recorder was ended to copy it again."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    number: Any = store.types["std_msgs/msg/Float64"]
    for folder, is_packed in (("packed", True), ("plain", False)):
        writer = Ros2Writer(tmp_path / folder, version=9, storage_plugin=StoragePlugin.MCAP)
        if is_packed:
            writer.set_compression(CompressionMode.MESSAGE, CompressionFormat.ZSTD)
        with writer:
            topic = writer.add_connection("/angle", number.__msgtype__, typestore=store)
            for at in T:
                content = store.serialize_cdr(number(data=at), number.__msgtype__)
                writer.write(topic, round(1e9 * at) + 10**18, content)
    packed, plain = (next((tmp_path / one).glob("*.mcap")) for one in ("packed", "plain"))
    assert read(packed)[1] == "angle (each message is compressed; write it again with ros2 bag convert)"
    plain.write_bytes(plain.read_bytes()[:-20])
    with pytest.raises(recordings.FileError, match=r"says: [^;]*[^.]; copy it again, or repair it: mcap recover"):
        recordings.read(plain)
