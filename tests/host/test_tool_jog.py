"""Jogs of the tool: along a line, about its point, and where a posture is singular."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.kinematics.of_arm import forward
from armtempo.model.arm import Arm
from armtempo.model.frame import ArmFrame
from armtempo.planning.jog import jog_line, jog_motion
from armtempo.planning.jog.jog_line import FollowedLine
from armtempo.planning.jog.jog_motion import JogMove
from armtempo.splines.trajectory import Trajectory
from scipy.spatial.transform import Rotation

from tests.host.jogs import AR4, ELBOW_DEG, PAPER, check_limits, on_steps

INF = math.inf


@pytest.mark.slow
@pytest.mark.parametrize(
    ("axis", "by"),
    [
        ("x", -INF),
        ("y", 5.0),
        ("z", -0.1),
        ("tool-x", 5.0),
        ("tool-y", -0.1),
        ("tool-z", -INF),
        ("in-tray-y", 8.0),
    ],
)
def test_the_tool_moves_along_a_line_and_keeps_its_orientation(axis: str, by: float) -> None:
    here = on_steps(AR4, ELBOW_DEG)
    turn = Rotation.from_euler("xyz", [20, -30, 50], degrees=True)
    tray = np.vstack([np.column_stack([turn.as_matrix(), [300, 20, 10]]), [0, 0, 0, 1]])
    arm = replace(AR4, frames=(ArmFrame("in-tray", tuple(map(tuple, tray.tolist()))),))
    motion = jog_motion.plan("x", arm, here, JogMove(by, axis=axis))
    check_limits(motion, AR4, jog_motion.SPEED)
    start = forward(AR4, here)
    unit = np.eye(3)["xyz".index(axis[-1])] * math.copysign(1, by)
    direction = {"tool": start[:3, :3], "in-tray": tray[:3, :3]}.get(axis[:-2], np.eye(3)) @ unit
    poses = forward(AR4, motion.trajectory(np.linspace(0.0, motion.trajectory.duration_s, 500)))
    gaps = poses[:, :3, 3] - start[:3, 3]
    along = gaps @ direction
    assert np.abs(gaps - along[:, None] * direction).max() < 0.5
    assert np.abs(poses[:, :3, :3] - start[:3, :3]).max() < 0.01
    assert np.all(np.diff(along) > -0.02)
    if math.isinf(by):
        assert motion.ends
        assert along[-1] > 10.0
    else:
        assert along[-1] == pytest.approx(abs(by), abs=0.01)


@pytest.mark.parametrize("by", [10.0, -INF])
def test_the_tool_turns_about_its_own_point(by: float) -> None:
    here = on_steps(AR4, ELBOW_DEG)
    motion = jog_motion.plan("x", AR4, here, JogMove(by, axis="tool-y", about=True))
    check_limits(motion, AR4, jog_motion.SPEED)
    start = forward(AR4, here)
    poses = forward(AR4, motion.trajectory(np.linspace(0.0, motion.trajectory.duration_s, 300)))
    assert np.abs(poses[:, :3, 3] - start[:3, 3]).max() < 0.5
    assert np.abs(poses[:, :3, 1] - start[:3, 1]).max() < 0.01  # the axis stays
    if by > 0:
        turned = math.degrees(math.acos(poses[-1, :3, 0] @ start[:3, 0]))
        assert turned == pytest.approx(by, abs=0.02)


def test_an_arm_of_three_joints_moves_its_tool_and_lets_it_turn() -> None:
    here = on_steps(PAPER, [0.0, -60.0, 40.0])
    motion = jog_motion.plan("x", PAPER, here, JogMove(10.0, axis="z"))
    way = forward(PAPER, motion.end_deg)[:3, 3] - forward(PAPER, here)[:3, 3]
    np.testing.assert_allclose(way, [0.0, 0.0, 10.0], atol=0.05)
    with pytest.raises(InputError, match="cannot turn the tool about z"):
        jog_motion.plan("x", PAPER, here, JogMove(10.0, axis="z", about=True))


def test_a_fast_jog_stays_on_its_line_where_its_ramps_take_all_of_it() -> None:
    here = on_steps(PAPER, [42.186, -67.396, 17.178])
    motion = jog_motion.plan("x", PAPER, here, JogMove(-INF, axis="x"), 1.0)
    check_limits(motion, PAPER, 1.0)
    start = forward(PAPER, here)[:3, 3]
    tool = forward(PAPER, motion.trajectory(np.linspace(0.0, motion.trajectory.duration_s, 800)))[:, :3, 3]
    assert np.linalg.norm((tool - start)[:, 1:], axis=1).max() < 1.1 * jog_line.STRAY_MM
    assert start[0] - tool[-1, 0] > 700.0


def test_a_line_ends_before_a_singular_posture() -> None:
    motion = jog_motion.plan("x", AR4, on_steps(AR4, ELBOW_DEG), JogMove(INF, axis="x"))
    assert "singular" in motion.ends
    assert (
        np.abs(np.diff(motion.trajectory(np.linspace(0, motion.trajectory.duration_s, 400)), axis=0)).max()
        < 2.0
    )


@pytest.mark.parametrize(("by", "said"), [(20.0, "cannot follow the line any further"), (INF, "singular")])
def test_a_line_that_the_joints_cannot_follow_is_made_shorter(
    by: float, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And says so, if nothing else has ended it before."""
    lengths: list[float] = []
    on_line = jog_motion._on_line

    def hindered(name: str, followed: FollowedLine, length: float, speed: float) -> Trajectory | None:
        lengths.append(length)
        return on_line(name, followed, length, speed) if len(lengths) > 1 else None

    monkeypatch.setattr(jog_motion, "_on_line", hindered)
    motion = jog_motion.plan("x", AR4, on_steps(AR4, ELBOW_DEG), JogMove(by, axis="x"))
    assert len(lengths) == 2
    assert lengths[1] < lengths[0]
    assert said in motion.ends


@pytest.mark.parametrize(
    ("start", "said"), [([0.0, -60.0], "3 angles, not 2"), ([0.0, -60.0, 400.0], "outside of its range")]
)
def test_the_tool_moves_from_a_posture_of_the_arm_only(start: list[float], said: str) -> None:
    with pytest.raises(InputError, match=said):
        jog_motion.plan("x", PAPER, start, JogMove(1.0, axis="x"), 0.25)


@pytest.mark.parametrize("stretched", [(0.0, 0.0), (30.0, 0.0)])
def test_a_stretched_arm_is_said_to_be_singular(stretched: tuple[float, float]) -> None:
    arm = Arm.load("scara")
    here = [*stretched, *[joint.home_deg for joint in arm.driven[2:]]]
    axis = "x" if stretched[0] == 0.0 else "tool-x"
    with pytest.raises(
        InputError, match="the posture is singular, stretched or folded; bend it first"
    ) as refused:
        jog_motion.plan("jog", arm, here, JogMove(10.0, axis=axis))
    assert jog_motion.problem(arm, here, JogMove(INF, axis=axis)) == str(refused.value)


@pytest.mark.parametrize(("axis", "about"), [("z", False), ("x", True)])
def test_an_arm_without_the_joints_is_not_said_to_be_singular(axis: str, about: bool) -> None:
    """No joint of the SCARA moves its tool up, stretched or bent."""
    arm = Arm.load("scara")
    for bent in (0.0, 40.0):
        here = [0.0, bent, *[joint.home_deg for joint in arm.driven[2:]]]
        with pytest.raises(InputError, match="too few joints"):
            jog_motion.plan("jog", arm, here, JogMove(5.0, axis=axis, about=about))
