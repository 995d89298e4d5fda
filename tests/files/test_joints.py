"""Joints of robots by what logs call their channels: found where that says one thing, refused with the choices where it may be several."""

from __future__ import annotations

import pytest

from tvident._files import full_name, joint_of

ARM = [f"/arm/{joint}/{one}" for joint in ("joint1", "joint2") for one in ("position", "velocity", "effort")]
STATES = [f"joint_states.{one}[{number}]" for one in ("position", "velocity", "effort") for number in (0, 1)]
FRANKA = ["time", "q_0", "q_1", "dq_0", "dq_1", "tau_J_0", "tau_J_1"]
ECHO = [
    "time",
    "field.name0",
    "field.position0",
    "field.velocity0",
    "field.effort0",
    "field.position1",
    "field.effort1",
]
UR = ["timestamp", "actual_q_0", "actual_qd_0", "actual_current_0", "target_q_0", "target_moment_0"]


@pytest.mark.parametrize(
    ("channels", "joint", "expected"),
    [
        (ARM, "joint1", ("/arm/joint1/position", "/arm/joint1/velocity", "/arm/joint1/effort")),
        (ARM, "/arm/joint2", ("/arm/joint2/position", "/arm/joint2/velocity", "/arm/joint2/effort")),
        (STATES, "1", ("joint_states.position[1]", "joint_states.velocity[1]", "joint_states.effort[1]")),
        (STATES, "joint_states[0]", ("joint_states.position[0]", "joint_states.velocity[0]", "joint_states.effort[0]")),
        (["state.q.0", "state.dq.0", "state.tau.0"], "0", ("state.q.0", "state.dq.0", "state.tau.0")),
        (FRANKA, "1", ("q_1", "dq_1", "tau_J_1")),
        (ECHO, "0", ("field.position0", "field.velocity0", "field.effort0")),
        (ECHO, "field.1", ("field.position1", None, "field.effort1")),
        (["elbow_angle [deg]", "elbow_torque [Nmm]"], "Elbow", ("elbow_angle [deg]", None, "elbow_torque [Nmm]")),
    ],
)
def test_a_joint_is_found_by_what_its_channels_are_called(
    channels: list[str], joint: str, expected: tuple[str | None, ...]
) -> None:
    found = joint_of(channels, joint, "run.csv")
    assert (found["position"], found.get("velocity"), found["effort"]) == expected


@pytest.mark.parametrize("joint", ["q1", "torque_arm", "left_q1_joint", "elbow"])
@pytest.mark.parametrize("form", ["{}.{}", "/arm/{}/{}", "{1}/{0}"])
def test_a_joint_may_be_called_by_a_word_for_what_is_measured(joint: str, form: str) -> None:
    channels = [form.format(one, quantity) for one in (joint, "other") for quantity in ("position", "effort")]
    found = joint_of(channels, joint, "run.mcap")
    assert found == {quantity: form.format(joint, quantity) for quantity in ("position", "effort")}


@pytest.mark.parametrize("form", ["{}.{}", "/arm/{}/{}"])
def test_the_last_word_says_what_is_measured(form: str) -> None:
    channels = [form.format("theta", quantity) for quantity in ("position", "effort")]
    assert list(joint_of(channels, "theta", "run.mcap").values()) == channels


def test_a_joint_is_taken_before_those_that_end_as_it_is_called() -> None:
    every = [f"{joint}.{quantity}" for joint in ("elbow", "left.elbow") for quantity in ("position", "effort")]
    assert joint_of(every, "elbow", "run.mcap") == {"position": "elbow.position", "effort": "elbow.effort"}
    with pytest.raises(KeyError, match=r"position left\.elbow\.position and effort right\.elbow\.effort"):
        joint_of(["left.elbow.position", "right.elbow.effort"], "elbow", "run.mcap")


@pytest.mark.parametrize(
    ("channels", "joint", "words"),
    [
        (ARM, "elbow", r"no joint 'elbow'; it has arm\.joint1, arm\.joint2; name one of these, or give --angle"),
        (ARM, "1", r"no joint '1'; it has arm\.joint1, arm\.joint2"),
        # What a controller wants is no measurement.
        (UR, "0", r"position actual_q_0, target_q_0 and effort target_moment_0; give --angle and --torque, or more"),
        (UR, "actual_0", "position actual_q_0 and effort none"),
        (["l.elbow.q", "l.elbow.tau", "r.elbow.q", "r.elbow.tau"], "elbow", r"position l\.elbow\.q, r\.elbow\.q"),
        (["elbow.q", "elbow.pos", "elbow.tau"], "elbow", r"position elbow\.q, elbow\.pos"),
        (["time", "angle", "torque"], "elbow", r"no channel 'elbow\.position'; it has time, angle, torque"),
    ],
)
def test_what_may_be_several_is_refused_with_the_choices(channels: list[str], joint: str, words: str) -> None:
    with pytest.raises(KeyError, match=words):
        joint_of(channels, joint, "run.csv")


@pytest.mark.parametrize(
    ("channels", "name", "expected"),
    [
        (STATES, "position.0", "joint_states.position[0]"),
        (STATES, "effort[1]", "joint_states.effort[1]"),
        (ARM, "joint1/effort", "/arm/joint1/effort"),
        (ARM, "arm.joint1.effort", "/arm/joint1/effort"),
        (["state.q.0", "state.q.1"], "q[0]", "state.q.0"),
    ],
)
def test_names_are_found_however_their_groups_are_written(channels: list[str], name: str, expected: str) -> None:
    assert full_name(dict.fromkeys(channels), name, "run.csv") == expected


def test_the_end_of_a_name_that_several_have_is_refused() -> None:
    with pytest.raises(KeyError, match="must have one channel 'q/0'; it has left/q/0, right/q/0"):
        full_name(dict.fromkeys(["left/q/0", "right/q/0"]), "q/0", "run.csv")
