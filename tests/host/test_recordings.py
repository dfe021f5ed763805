"""Trajectories of other programs: JointTrajectory messages and timed tables, planned anew or on their own times."""

from __future__ import annotations

import gc
import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from armtempo.basics.errors import InputError, PlanError
from armtempo.cli import main
from armtempo.model import joint_trajectory, shipped, via_table
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.plan import Plan
from armtempo.planning import point_to_point, recorded
from click.testing import CliRunner

from tests.host.made_runs import shipped_plan
from tests.host.problems import faults

ARM = Arm.paper()
START = (0.0, -60.0, 40.0)
MOVE = point_to_point.straight("move", START, (60, -90, 10), ARM)
TIMES = np.linspace(0.0, MOVE.duration_s, 80)


def message(
    times: np.ndarray,
    angles: np.ndarray,
    names: tuple[str, ...] = ("joint 1", "joint 2", "joint 3"),
    **more: Any,
) -> dict[str, Any]:
    """A JointTrajectory."""
    points = [
        {
            "positions": np.radians(row).tolist(),
            "time_from_start": {"sec": int(t), "nanosec": round(1e9 * (t % 1.0))},
        }
        for t, row in zip(times, angles, strict=True)
    ]
    return {"joint_names": list(names), "points": points, **more}


def test_the_message_of_the_export_comes_back() -> None:
    plan = shipped_plan()
    found = joint_trajectory.of_text(plan.to_ros(20.0), "feed.yaml", ARM)
    np.testing.assert_allclose(found.angles_deg, plan.trajectory(found.times_s), atol=1e-3)
    assert found.times_s[-1] == pytest.approx(plan.total_s, abs=1e-9)


@pytest.mark.parametrize(
    "inside", [(), ("trajectory",), ("goal", "trajectory"), ("trajectory", "joint_trajectory")]
)
def test_joints_are_found_by_name_in_any_message(inside: tuple[str, ...]) -> None:
    angles = MOVE(TIMES)
    content: Any = message(
        TIMES,
        np.column_stack([angles[:, 2], 0.0 * TIMES, angles[:, :2]]),
        ("J3", "gripper", "joint_1", "Joint2"),
    )
    for key in reversed(inside):
        content = {"header": {}, key: content}
    found = joint_trajectory.of_text(json.dumps(content), "m.json", ARM)
    np.testing.assert_allclose(found.angles_deg, angles, atol=1e-9)
    assert found.notes == ("joints that were not used: gripper",)


def test_messages_are_told_from_tables_however_they_begin() -> None:
    content = json.dumps(message(TIMES[:3], MOVE(TIMES[:3])))
    points_first = json.dumps(dict(reversed(json.loads(content).items())))
    flow = content.replace("joint 1", "joint_1")
    for name, text in (
        ("list.json", f"[{content}]"),
        ("display.json", f'{{"model_id": "a", "trajectory": [{{"joint_trajectory": {content}}}]}}'),
        ("first.txt", points_first),
        ("remark.yaml", f"# of the feeder\ntrajectory: {content}\n---\n"),
        ("quoted.yml", f'"trajectory": {flow}\n'),
        ("flow.yaml", flow.replace('"', "")),
        ("pasted text", f"stamp: 0\ntrajectory: {content}\n"),
    ):
        found = via_table.of_text(text, name, ARM)
        np.testing.assert_allclose(found.via_deg[0], MOVE(0.0), atol=1e-6, err_msg=name)


def test_points_with_speeds_are_joined_as_controllers_do() -> None:
    few = np.linspace(0.0, MOVE.duration_s, 6)
    content = message(few, MOVE(few))
    for point, speeds in zip(content["points"], np.radians(MOVE(few, 1)).tolist(), strict=True):
        point["velocities"] = speeds
    found = joint_trajectory.of_text(json.dumps(content), "m.json", ARM)
    assert len(found.times_s) > 100
    assert np.abs(found.angles_deg - MOVE(found.times_s)).max() < 0.5


def test_speeds_that_some_points_lack_are_not_used_and_this_is_told() -> None:
    content = message(TIMES[:3], MOVE(TIMES[:3]))
    content["points"][1]["velocities"] = [0.0, 0.0, 0.0]
    found = joint_trajectory.of_text(json.dumps(content), "m.json", ARM)
    assert found.notes == ("velocities were not used, as not all points have them",)


def test_with_accelerations_it_is_the_quintic_that_controllers_follow() -> None:
    """Of a quintic of rest to rest, given at three times, with a joint's values in another order."""
    times = np.array([0.0, 0.7, 2.0])

    def quintic(t: np.ndarray, order: int) -> np.ndarray:
        law = np.polynomial.Polynomial([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])
        return np.outer(law.deriv(order)(t / 2.0) / 2.0**order, [20.0, -15.0, 10.0]) + (
            order == 0
        ) * np.array(START)

    content = message(times, quintic(times, 0))
    for point, speeds, accelerations in zip(
        content["points"], quintic(times, 1), quintic(times, 2), strict=True
    ):
        point["velocities"] = np.radians(speeds).tolist()
        point["accelerations"] = np.radians(accelerations).tolist()
    found = joint_trajectory.of_content(content, "m.json", ARM)
    np.testing.assert_allclose(found.angles_deg, quintic(found.times_s, 0), atol=1e-6)
    content["points"][1]["accelerations"] = [0.0]
    with pytest.raises(InputError, match="point 1: accelerations must be 3 numbers"):
        joint_trajectory.of_content(content, "m.json", ARM)
    content["points"][1]["accelerations"] = []
    assert joint_trajectory.of_content(content, "m.json", ARM).notes == (
        "accelerations were not used, as not all points have them",
    )


def test_positions_in_degrees_are_suspected() -> None:
    content = message(TIMES, np.degrees(MOVE(TIMES)))
    with pytest.raises(InputError, match="positions up to 90 leave the joints' ranges: are they in degrees"):
        joint_trajectory.of_content(content, "m.json", ARM)


def test_what_is_no_json_may_be_yaml_that_cannot_be_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "yaml", None)
    with pytest.raises(InputError, match=r"m\.yaml: is not JSON: .*; for YAML PyYAML is needed, install it"):
        joint_trajectory.of_text("{joint_names: [a]}", "m.yaml", ARM)


def spoiled(change: dict[str, Any], point: dict[str, Any] | None = None) -> str:
    content = message(TIMES[:3], MOVE(TIMES[:3])) | change
    content["points"][1].update(point or {})
    return json.dumps(content)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "is neither JSON nor YAML"),
        (spoiled({}, {"time_from_start": {"sec": 1, "ns": 5}}), "point 1: time_from_start .* is no time"),
        ("{}", "has no JointTrajectory"),
        ("[1, 2]", "has no JointTrajectory"),
        (f"[{spoiled({})}, {spoiled({})}]", "has 2 messages"),
        (f"---\n{spoiled({})}\n" * 2, "has 2 messages"),
        (spoiled({}, {"positions": [0.0, 0.0]}), "point 1: positions must be 3 numbers"),
        (spoiled({}, {"positions": [0.0, 0.0, "x"]}), "point 1: positions must be 3 numbers"),
        (spoiled({}, {"positions": [0.0, 0.0, 10**400]}), "point 1: positions must be 3 numbers"),
        (spoiled({}, {"positions": [0.0, 0.0, float("nan")]}), "point 1: positions must be 3 numbers"),
        (spoiled({}, {"time_from_start": None}), "point 1: time_from_start None is no time"),
        (spoiled({}, {"time_from_start": 0.0}), "point 1: time_from_start does not increase"),
        (spoiled({"joint_names": ["a", "b", "c"]}), "joint_names: the header does not name"),
        (spoiled({"joint_names": ["joint 1", "j1", "joint 3"]}), "both name joint 1"),
    ],
)
def test_messages_that_will_not_do_say_where(text: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        joint_trajectory.of_text(text, "m.json", ARM)


def test_a_recording_keeps_its_times_and_its_pause() -> None:
    pause_s = 0.8
    times = np.arange(0.0, 2.0 * MOVE.duration_s + pause_s, 0.02)
    there, back = MOVE(times), MOVE(2.0 * MOVE.duration_s + pause_s - times)
    angles = np.where(times[:, None] < MOVE.duration_s + 0.5 * pause_s, there, back)
    slow = times * 1.2
    plan = recorded.plan(ARM, "replay", slow, angles)
    assert faults(plan) == []
    assert plan.total_s == pytest.approx(slow[-1])
    assert not any("slowed" in note for note in plan.notes)
    assert np.abs(plan.trajectory(slow) - angles).max() <= 0.1
    assert np.abs(plan.trajectory(1.2 * (MOVE.duration_s + 0.5 * pause_s), 1)).max() < 0.5


def test_a_recording_beyond_the_limits_is_slowed_and_says_so(tmp_path: Path) -> None:
    plan = recorded.plan(ARM, "fast", 0.5 * TIMES, MOVE(TIMES))
    assert faults(plan) == []
    (note,) = (note for note in plan.notes if "slowed" in note)
    percent = float(note.split()[2])
    assert 45.0 < percent < 60.0  # the spline may smooth the peaks of jerk within its tolerance
    assert plan.total_s == pytest.approx(0.5 * MOVE.duration_s * 100.0 / percent, rel=0.01)
    plan.save(tmp_path / "fast.json")
    assert Plan.load(tmp_path / "fast.json").notes == plan.notes


def test_a_recording_at_the_end_of_a_range_stays_in_it() -> None:
    first = replace(ARM.joints[0], range_deg=(0.0, 60.0))
    plan = recorded.plan(replace(ARM, joints=(first, *ARM.joints[1:])), "end", TIMES, MOVE(TIMES))
    moved = plan.trajectory(np.linspace(0.0, plan.total_s, 3000))[:, 0]
    assert moved.min() >= -1e-9
    assert moved.max() <= 60.0 + 1e-9


@pytest.mark.slow
def test_a_recording_that_begins_in_motion_is_slowed_far_down_or_refused() -> None:
    """Within the tolerance nothing that the limits allow starts so suddenly."""
    line = np.linspace((0, -60, 40), (60, -90, 10), 40)
    (note,) = (note for note in recorded.plan(ARM, "moving", TIMES[:40], line).notes if "slowed" in note)
    assert float(note.split()[2]) < 40.0
    with pytest.raises(PlanError, match="from rest to rest"):
        recorded.plan(ARM, "moving", 50.0 * TIMES[:40], line, tolerance_deg=1e-4)


@pytest.mark.slow
def test_the_commands_take_recordings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("move.json").write_text(json.dumps(message(TIMES, MOVE(TIMES))))
    run = CliRunner(env={"ARMTEMPO_ARM": str(shipped.arm_path())}).invoke
    made = run(main, ["import", "move.json"])
    assert made.exit_code == 0, made.output
    assert Job.load("move.toml", ARM).timing == "shared"
    kept = run(main, ["import", "move.json", "--own-timing", "-o", "replay.json"])
    assert kept.exit_code == 0, kept.output
    assert "follows the recording on its own times" in kept.output
    assert Plan.load("replay.json").total_s == pytest.approx(MOVE.duration_s, rel=0.02)
    there = run(main, ["fk", "move.json"])
    assert there.exit_code == 0, there.output
    assert "at 0.0000 -60.0000 40.0000" in there.output


def test_a_recording_beyond_a_range_says_where(tmp_path: Path) -> None:
    table, trajectory = tmp_path / "beyond.csv", tmp_path / "beyond.json"
    times, angles = np.array([0.0, 3.0, 6.0]), np.array([[0, -60, 40], [40, -60, 40], [40, -60, 400]])
    table.write_text("time_s,j1,j2,j3\n0,0,-60,40\n3,40,-60,40\n60,40,-60,400\n")
    trajectory.write_text(json.dumps(message(20.0 * times, angles)))
    for path, where in ((table, "line 4"), (trajectory, "at 120 s")):
        with pytest.raises(InputError, match=rf"{where}: joint 3 at 400 degrees is outside of its range"):
            via_table.recorded(path, ARM)


def test_a_table_without_times_has_no_timing(tmp_path: Path) -> None:
    table = tmp_path / "via.csv"
    table.write_text("j1,j2,j3\n0,-60,40\n20,-75,50\n")
    with pytest.raises(InputError, match="has no times of a motion"):
        via_table.recorded(table, ARM)


def bag(path: Path, kind: str, messages: list[Any], mcap: bool) -> Path:
    """A recording of one topic."""
    from rosbags import rosbag2  # takes long, and every process that collects the tests would do it

    store = typestore()
    plugin = rosbag2.StoragePlugin.MCAP if mcap else rosbag2.StoragePlugin.SQLITE3
    with rosbag2.Writer(path, version=9, storage_plugin=plugin) as writer:
        connection = writer.add_connection("/topic", kind, typestore=store)
        for number, one in enumerate(messages):
            writer.write(connection, number, store.serialize_cdr(one, kind))
    return path


def typestore() -> Any:
    from rosbags import typesys

    return typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)


def types() -> Any:
    return typestore().types


def header(time_s: float) -> Any:
    stamp = types()["builtin_interfaces/msg/Time"](sec=1000 + int(time_s), nanosec=int(1e9 * (time_s % 1.0)))
    return types()["std_msgs/msg/Header"](stamp=stamp, frame_id="")


def states(names: list[str]) -> list[Any]:
    state, none = types()["sensor_msgs/msg/JointState"], np.empty(0)
    gripper = state(header=header(0.0), name=["gripper"], position=np.zeros(1), velocity=none, effort=none)
    return [
        gripper,
        *(
            state(header=header(t), name=names, position=np.radians(row), velocity=none, effort=none)
            for t, row in zip(TIMES, MOVE(TIMES), strict=True)
        ),
    ]


def trajectory() -> Any:
    point = types()["trajectory_msgs/msg/JointTrajectoryPoint"]
    duration = types()["builtin_interfaces/msg/Duration"]
    none = np.empty(0)
    points = [
        point(
            positions=np.radians(row), velocities=none, accelerations=none, effort=none,
            time_from_start=duration(sec=int(t), nanosec=int(1e9 * (t % 1.0))),
        )
        for t, row in zip(TIMES, MOVE(TIMES), strict=True)
    ]  # fmt: skip
    names = [joint.name for joint in ARM.driven]
    return types()["trajectory_msgs/msg/JointTrajectory"](
        header=header(0.0), joint_names=names, points=points
    )


@pytest.mark.parametrize("mcap", [True, False])
@pytest.mark.parametrize("kind", ["trajectory_msgs/msg/JointTrajectory", "sensor_msgs/msg/JointState"])
def test_bags_are_read(tmp_path: Path, kind: str, mcap: bool) -> None:
    messages = [trajectory()] if "Trajectory" in kind else states(["J1", "J2", "J3"])
    folder = bag(tmp_path / "bag", kind, messages, mcap)
    for path in (folder, *folder.glob("*.mcap")):
        found = via_table.recorded(path, ARM)
        np.testing.assert_allclose(found.angles_deg, MOVE(TIMES), atol=1e-6)
        np.testing.assert_allclose(found.times_s, TIMES, atol=1e-6)


# rosbags leaves a file open that it cannot read: closed, with a warning, when the garbage is collected.
@pytest.mark.slow
@pytest.mark.filterwarnings(r"ignore:[\s\S]*broken.mcap:pytest.PytestUnraisableExceptionWarning")
def test_bags_that_will_not_do_are_refused(tmp_path: Path) -> None:
    two = bag(tmp_path / "two", "trajectory_msgs/msg/JointTrajectory", [trajectory(), trajectory()], True)
    with pytest.raises(InputError, match="two: has 2 trajectories"):
        via_table.recorded(two, ARM)
    later = states(["J1", "J2", "J3"])
    twice = bag(tmp_path / "twice", "sensor_msgs/msg/JointState", [later[1], *later[1:]], True)
    assert len(via_table.recorded(twice, ARM).times_s) == len(TIMES)
    back = bag(tmp_path / "back", "sensor_msgs/msg/JointState", [*later[20:], *later[1:20]], True)
    with pytest.raises(
        InputError, match=r"back: the stamps of its JointStates go back by .* after the first"
    ):
        via_table.recorded(back, ARM)
    other = bag(tmp_path / "other", "sensor_msgs/msg/JointState", states(["a", "b", "c"]), True)
    with pytest.raises(InputError, match="neither a JointTrajectory nor JointStates of all driven joints"):
        via_table.read(other, ARM)
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(b"nothing")
    with pytest.raises(InputError, match=r"broken\.mcap: cannot be read as a recording of ROS"):
        via_table.recorded(broken, ARM)
    gc.collect()  # here, not in another test
