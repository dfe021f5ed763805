"""The trajectory of a job on the spline through its via points: one path, and time axes by search and gradients."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.progress import Progress
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.leg import Search
from armtempo.model.parts import Limits
from armtempo.planning import checks, lower_bounds, time_parameterization
from armtempo.planning.time_parameterization import Group, Timed
from armtempo.splines import bspline
from armtempo.splines.trajectory import JointSpline, Trajectory


@dataclass(frozen=True, eq=False)
class Planned:
    """A trajectory, its searches, and notes for the user."""

    trajectory: Trajectory
    searches: tuple[Search, ...]
    notes: tuple[str, ...]


def motion(arm: Arm, job: Job, via_deg: Array, progress: Progress) -> Planned:
    """The motion through via angles (n + 1, J); raises PlanError if the spline leaves a joint's range."""
    limits = checks.limits_of(arm)
    points = bspline.fit(via_deg, job.degree)
    checks.check_ranges(
        arm, points, job.degree, f'take path = "free", which bends within it; or {checks.MOVE_VIAS}'
    )
    groups = _groups(points, via_deg, limits, job)
    most = time_parameterization.most_refine(job, len(via_deg) - 1, len(limits))
    timed = time_parameterization.axes(groups, job, most, progress)
    trajectory = _trajectory(job, points, groups, timed)
    searches = tuple(_search(group, job, axis) for group, axis in zip(groups, timed, strict=True))
    return Planned(trajectory, searches, tuple(note for axis in timed for note in axis.notes))


def _groups(points: Array, via: Array, limits: list[Limits], job: Job) -> list[Group]:
    """The moving joints, as one group or one group each."""
    moving = [int(joint) for joint in np.flatnonzero(np.ptp(via, axis=0) > checks.TOLERANCE)]
    together = [moving] if job.timing == "shared" else [[joint] for joint in moving]
    return [
        Group(tuple(joints), points[:, joints], [limits[joint] for joint in joints]) for joints in together
    ]


def _trajectory(job: Job, points: Array, groups: list[Group], timed: list[Timed]) -> Trajectory:
    """All joints on their time axes; a joint that does not move gets the longest axis."""
    longest = max(timed, key=lambda axis: axis.total_s)
    axes = {joint: axis for group, axis in zip(groups, timed, strict=True) for joint in group.joints}
    joints = tuple(
        JointSpline(
            job.degree,
            longest.refine,
            np.ascontiguousarray(points[:, joint]),
            axes.get(joint, longest).time_points_s,
        )
        for joint in range(points.shape[1])
    )
    return Trajectory(job.name, joints, job.timing == "shared")


def _search(group: Group, job: Job, timed: Timed) -> Search:
    bound = lower_bounds.of_path(group.angle_points_deg, job.degree, group.limits, timed.total_s)
    return Search(
        joints=group.joints,
        intervals_s=timed.intervals_s,
        total_s=timed.total_s,
        searched_s=timed.searched_s,
        evaluations=timed.found.evaluations,
        history_s=timed.found.history,
        starts_s=timed.starts_s,
        optimum_s=timed.optimum_s,
        lower_bound_s=bound.time_s,
        lower_bound_kind=bound.kind,
    )
