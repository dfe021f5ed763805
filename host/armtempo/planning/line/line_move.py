"""A single straight line of the tool from where the arm is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from armtempo.basics.progress import Progress
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.tool_pose import Pose
from armtempo.model.tool_way import ToolWay
from armtempo.planning import planner
from armtempo.splines.trajectory import Trajectory

_REFINE = 4
"""Time segments for one of the path: within 1 % of the fastest, and planned soon."""


def straight_line(
    arm: Arm,
    start_deg: Sequence[float],
    end: Sequence[float] | Pose,
    speed_mm_s: float | None = None,
    progress: Progress | None = None,
    holds: str = "",
) -> Trajectory:
    """The tool in a straight line from a posture (J,) to another one, or to a pose; errors as in ``planner.plan``.

    ``speed_mm_s``: the tool's limit; ``holds``: the load of the arm in it.
    """
    target = end if isinstance(end, Pose) else tuple(map(float, end))
    job = Job(
        "goto",
        via=(tuple(map(float, start_deg)), target),
        ways=(ToolWay(1, line=True, speed_mm_s=speed_mm_s),),
        refine=_REFINE,
        holds=holds,
    )
    return planner.plan(arm, job, progress).trajectory


def slower(trajectory: Trajectory, speed: float) -> Trajectory:
    """The same motion at ``speed``, up to 1, of its own."""
    joints = tuple(
        replace(joint, time_points_s=np.asarray(joint.time_points_s / speed)) for joint in trajectory.joints
    )
    return replace(trajectory, joints=joints)
