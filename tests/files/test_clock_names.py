"""Which channels are taken as times by their names, and what is said of those that may be."""

from __future__ import annotations

import numpy as np
import pytest

from tvident import FileRecording, read_recording

COUNT = np.arange(1000)
ANGLE = np.sin(0.1 * COUNT)


@pytest.mark.parametrize(
    "name", ["tout", "out.tout", "sim_time", "simTime", "wall_time", "log_time", "stamp", "header.stamp", "uptime"]
)
def test_times_of_simulations_and_robots_are_times(name: str) -> None:
    """Nothing told the sample rate."""
    assert FileRecording({name: COUNT / 500, "angle": ANGLE}).sample_rate == 500


def test_two_clocks_that_differ_are_no_choice() -> None:
    with pytest.raises(ValueError, match="needs a channel of times"):
        _ = FileRecording({"log_time": COUNT / 500, "robot_time": 7 + COUNT / 250, "angle": ANGLE}).sample_rate
    both = FileRecording({"log_time": 3 + COUNT / 500, "time": COUNT / 500, "angle": ANGLE})
    assert both.time is not None
    assert both.time[0] == 0


@pytest.mark.parametrize(("name", "step"), [("tick", 1), ("ticks", 2), ("loop_count", 1), ("HAL_tick", 4)])
def test_what_counts_is_no_time_but_asked_for(name: str, step: int) -> None:
    words = rf"'{name}' goes up by {step} from sample to sample: give t=recording\['{name}'\] and time_unit='ms' if it"
    with pytest.raises(ValueError, match=words):
        _ = FileRecording({name: step * COUNT, "angle": ANGLE}).sample_rate
    # One that stands still, or has fractions, counts nothing.
    with pytest.raises(ValueError, match=r"has .*; give sample_rate= where it is needed"):
        _ = FileRecording({name: COUNT / 500, "angle": ANGLE}).sample_rate


def test_times_of_simulink_beside_its_outputs(tmp_path: object) -> None:
    scipy_io = pytest.importorskip("scipy.io")
    path = f"{tmp_path}/run.mat"
    outputs = np.stack([ANGLE, 2 * ANGLE], axis=1)
    times = (COUNT / 500)[:, None]
    scipy_io.savemat(path, {"tout": times, "yout": {"time": times, "signals": {"values": outputs, "label": "y"}}})
    assert read_recording(path).sample_rate == 500
