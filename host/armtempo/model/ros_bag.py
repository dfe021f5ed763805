"""Motions in recordings of ROS (MCAP, ROS 2 and ROS 1 bags), read by rosbags (extra ``ros``)."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from armtempo.basics.errors import InputError, MissingPackageError
from armtempo.model import joint_trajectory
from armtempo.model.arm import Arm
from armtempo.model.joint_trajectory import Recorded

SUFFIXES = (".mcap", ".db3", ".bag")
_TRAJECTORY, _STATE = "trajectory_msgs/msg/JointTrajectory", "sensor_msgs/msg/JointState"


def is_bag(path: Path) -> bool:
    """Whether it is a recording of ROS, by its name, or a folder with its ``metadata.yaml``."""
    return path.suffix.lower() in SUFFIXES or (path / "metadata.yaml").is_file()


def read(path: Path, arm: Arm) -> Recorded:
    """The one JointTrajectory of a recording; without any, the motion that its JointStates tell.

    JointStates count that name all driven joints, by their stamps; of those with the same stamp the first. Raises
    MissingPackageError without rosbags, InputError for a file that cannot be read, for several trajectories, for stamps
    that go back, and as ``joint_trajectory.of_content``.
    """
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise MissingPackageError("reading recordings of ROS", "rosbags", "ros") from None
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            content = _content(reader, path, arm)
    except InputError:
        raise
    except Exception as error:  # the reader raises various errors for damaged files
        raise InputError(
            f"{path}: cannot be read as a recording of ROS: {error}", "record it again"
        ) from None
    return joint_trajectory.of_content(content, path, arm)


def _content(reader: Any, path: Path, arm: Arm) -> dict[str, Any]:
    trajectories = list(_messages(reader, _TRAJECTORY))
    if len(trajectories) > 1:
        raise InputError(f"{path}: has {len(trajectories)} trajectories", "give a recording with one of them")
    if trajectories:
        found = trajectories[0]
        points = [
            {
                "positions": point.positions.tolist(),
                "velocities": point.velocities.tolist(),
                "time_from_start": {
                    "sec": int(point.time_from_start.sec),
                    "nanosec": int(point.time_from_start.nanosec),
                },
            }
            for point in found.points
        ]
        return {"joint_names": list(found.joint_names), "points": points}
    states = [state for state in _messages(reader, _STATE) if joint_trajectory.names_all(state.name, arm)]
    if not states:
        raise InputError(
            f"{path}: has neither a JointTrajectory nor JointStates of all driven joints",
            "record the topic joint_states, with the joints' names of the arm file",
        )
    names = list(states[0].name)
    if any(list(state.name) != names for state in states):
        raise InputError(f"{path}: its JointStates name different joints", "record one topic of them")
    stamps = [state.header.stamp for state in states]
    times_ns = [10**9 * int(stamp.sec) + int(stamp.nanosec) for stamp in stamps]
    points = []
    before_ns = times_ns[0]
    for time_ns, state in zip(times_ns, states, strict=True):
        if time_ns < before_ns:
            raise InputError(
                f"{path}: the stamps of its JointStates go back by {1e-9 * (before_ns - time_ns):.3g} s, "
                f"{1e-9 * (before_ns - times_ns[0]):.6g} s after the first",
                "record one motion of one publisher, with a clock that is not set meanwhile",
            )
        if not points or time_ns > before_ns:
            since_s = 1e-9 * (time_ns - times_ns[0])
            points.append({"positions": state.position.tolist(), "time_from_start": since_s})
        before_ns = time_ns
    return {"joint_names": names, "points": points}


def _messages(reader: Any, kind: str) -> Iterator[Any]:
    connections = [each for each in reader.connections if each.msgtype == kind]
    if connections:
        for connection, _, data in reader.messages(connections=connections):
            yield reader.deserialize(data, connection.msgtype)
