"""The example of a bridge to ROS, with a stand-in for the rosbridge, on a virtual board."""

from __future__ import annotations

import importlib.util
import threading
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from armtempo import pipeline
from armtempo.model.arm import Arm
from armtempo.planning import point_to_point

from tests.interpreters import ROOT

ARM = Arm.paper()
MOVE = point_to_point.straight("move", (0, -60, 40), (20, -75, 30), ARM)
NAMES = [joint.name for joint in ARM.driven]


@pytest.fixture(scope="module")
def example() -> Any:
    spec = importlib.util.spec_from_file_location("ros_bridge", ROOT / "host" / "examples" / "ros_bridge.py")
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Rosbridge(list[dict[str, Any]]):
    """What the bridge has sent."""

    def results(self) -> list[dict[str, Any]]:
        return [message for message in self if message["op"] == "action_result"]

    def states(self) -> np.ndarray:
        found = [
            message["msg"] for message in self if message.get("topic") == "/joint_states" and "msg" in message
        ]
        assert all(state["name"] == NAMES for state in found)
        return np.degrees([state["position"] for state in found])


@pytest.fixture
def bridge(example: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    monkeypatch.chdir(tmp_path)
    with pipeline.connect("sim", ARM) as board:
        board.configure(ARM)
        board.home(ARM)
        found = example.Bridge(board, ARM, Rosbridge().append)
        found.sent = found.send.__self__
        yield found


def goal(name: str, angles: np.ndarray, names: list[str] | None = None) -> dict[str, Any]:
    times = np.linspace(0.0, 1.2 * MOVE.duration_s, len(angles))
    points = [
        {
            "positions": np.radians(row).tolist(),
            "velocities": [],
            "time_from_start": {"sec": int(t), "nanosec": int(1e9 * (t % 1.0))},
        }
        for t, row in zip(times, angles, strict=True)
    ]
    trajectory = {"header": {}, "joint_names": names or NAMES, "points": points}
    return {"op": "send_action_goal", "id": name, "action": "x", "args": {"trajectory": trajectory}}


MOVED = MOVE(np.linspace(0.0, MOVE.duration_s, 40))


def test_goals_are_followed_and_states_published(bridge: Any) -> None:
    bridge.begin_service()
    assert [message["op"] for message in bridge.sent] == ["advertise_action", "advertise"]
    bridge.on_goal(goal("first", MOVED[:, ::-1], NAMES[::-1]))
    bridge.on_goal(goal("second", MOVED))
    bridge.serve(once=True)
    refused, done = bridge.sent.results()
    assert (refused["id"], refused["status"]) == ("second", 6)
    assert (done["id"], done["status"], done["values"]["error_code"]) == ("first", 4, 0)
    assert bridge.board.posture_deg() == pytest.approx([20, -75, 30], abs=0.05)
    states = bridge.sent.states()
    assert len(states) > 3
    assert np.all(np.diff(states[:, 0]) >= -1e-9)


@pytest.mark.parametrize(
    ("name", "positions"),
    [("thor", (0, 10, 20, 30, 35, -50)), ("scara_z", (100, 20, 30, -40))],
)
def test_states_are_of_the_joints_and_in_rad_and_m(
    example: Any, name: str, positions: tuple[float, ...]
) -> None:
    """Also where one motor turns several joints, and where a joint slides."""
    arm = Arm.load(name)
    sent = Rosbridge()
    steps = arm.transmission.whole_steps(positions)
    sample = SimpleNamespace(positions=SimpleNamespace(commanded_steps=steps))
    example.Bridge(None, arm, sent.append).on_sample(sample, 1.0)
    state = sent[0]["msg"]
    assert state["name"] == [joint.name for joint in arm.driven]
    si = [
        0.001 * position if joint.slides else np.radians(position)
        for joint, position in zip(arm.driven, positions, strict=True)
    ]
    assert state["position"] == pytest.approx(si, abs=1e-3)


def test_what_cannot_be_followed_is_aborted_with_its_reason(bridge: Any) -> None:
    for message in (goal("names", MOVED, ["a", "b", "c"]), goal("range", MOVED + 300.0)):
        bridge.on_goal(message)
        bridge.serve(once=True)
    names, beyond = bridge.sent.results()
    assert names["status"] == beyond["status"] == 6
    assert "joint_names" in names["values"]["error_string"]
    assert not beyond["result"]
    assert bridge.board.posture_deg() == pytest.approx([0, -60, 40], abs=0.05)


def test_a_cancelled_goal_brakes(bridge: Any) -> None:
    bridge.on_goal(goal("late", MOVED))
    begun = threading.Event()
    sample = bridge.on_sample

    def on_sample(seen: Any, duration_s: float) -> None:
        sample(seen, duration_s)
        if seen.positions.commanded_steps[0] > 50:
            begun.set()

    bridge.on_sample = on_sample
    serving = threading.Thread(target=bridge.serve, kwargs={"once": True})
    serving.start()
    assert begun.wait(60.0)
    bridge.on_cancel({"op": "cancel_action_goal", "id": "late"})
    serving.join(60.0)
    assert not serving.is_alive()
    (ended,) = bridge.sent.results()
    assert ended["status"] == 5
    assert 0.0 < bridge.board.posture_deg()[0] < 20.0
