"""What per-joint timing costs beside shared timing, and the summary that says so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.plan import Plan
from armtempo.planning import path_deviation, planner
from armtempo.report import text_summary

ARM = Arm.paper()
SHORT = replace(Job.paper(ARM), iterations=120)


@pytest.fixture(scope="module")
def apart() -> Plan:
    return planner.plan(ARM, SHORT)


@pytest.fixture(scope="module")
def together() -> Plan:
    return planner.plan(ARM, replace(SHORT, timing="shared"))


def test_shared_timing_keeps_joints_and_tool_together(together: Plan) -> None:
    assert path_deviation.via_spread_s(together.trajectory) == pytest.approx(np.zeros(7), abs=1e-12)
    assert path_deviation.tool_stray_mm(ARM, together.trajectory) < 0.05


def test_per_joint_timing_separates_joints(apart: Plan) -> None:
    spread = path_deviation.via_spread_s(apart.trajectory)
    durations = [joint.duration_s for joint in apart.trajectory.joints]
    assert spread[0] == 0
    assert spread[-1] == pytest.approx(max(durations) - min(durations))
    assert spread.max() > 0.5


@pytest.mark.slow
def test_tool_strays_as_far_as_the_nearest_point_of_the_path_is(apart: Plan) -> None:
    """Against a plain search over u for the worst of a few times."""
    from armtempo.kinematics.forward import forward
    from armtempo.kinematics.geometry import Geometry
    from armtempo.splines.trajectory import Trajectory

    first = apart.trajectory.joints[0]
    same = tuple(replace(joint, time_points_s=first.time_points_s) for joint in apart.trajectory.joints)
    path = Trajectory("path", same, True)

    def tool(driven: np.ndarray) -> np.ndarray:
        angles = np.concatenate([driven, np.zeros((len(driven), 3))], axis=1)
        return forward(Geometry.of(ARM), np.radians(angles))[:, :3, 3]

    on_path = tool(path(np.linspace(0, path.duration_s, 20_001)))
    strays = [
        np.sqrt(((tool(apart.trajectory(np.array([time]))) - on_path) ** 2).sum(axis=1)).min()
        for time in np.linspace(0, apart.trajectory.duration_s, 300)
    ]
    assert path_deviation.tool_stray_mm(ARM, apart.trajectory) == pytest.approx(max(strays), rel=2e-3)


@pytest.mark.slow
def test_summary_says_times_floors_limits_and_strays(apart: Plan, together: Plan) -> None:
    text = text_summary.lines(apart)
    assert f"{apart.trajectory.duration_s:.4f} s" in text[0]
    for joint, search, line in zip(ARM.driven, apart.searches, text[3:6], strict=True):
        assert line.startswith(joint.name)
        assert f"{search.total_s:.4f}" in line
        assert f"{search.lower_bound_s:.4f}" in line
        assert joint.limits is not None
        assert f"/ {joint.limits.speed_deg_s:g}" in line
    assert any("strays up to" in line for line in text)
    assert not any("strays" in line for line in text_summary.lines(together))
    assert all(len(line) <= 110 for line in text)
