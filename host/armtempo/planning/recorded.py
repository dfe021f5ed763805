"""A plan that follows a recording on its own times: slowed as a whole where the arm's limits ask for it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import PlanError
from armtempo.model.arm import Arm
from armtempo.model.job import GRADIENT, Job
from armtempo.model.leg import JobSolution, Search
from armtempo.model.parts import Limits
from armtempo.model.plan import Plan
from armtempo.model.thinning import JointTolerance, Tolerance
from armtempo.planning import board_limits, checks, lower_bounds, planner, workspace_check
from armtempo.splines import bspline, extremes, time_axis
from armtempo.splines.trajectory import JointSpline, Trajectory

DEGREE = 5
TOLERANCE_DEG = 0.1
_COARSEST_S = 0.5
"""Segments at first; they get shorter by _FINER until the spline is near enough."""
_FINER = 1.3
_SAMPLES = 4000
"""Points to which the spline is fitted at most."""
_INSIDE = 1.5
_TRIES = 4
_CANDIDATES = 4
_ORDERS = np.arange(1, 4)


def plan(
    arm: Arm, name: str, times_s: Array, angles_deg: Array, tolerance_deg: Tolerance = TOLERANCE_DEG,
    notes: tuple[str, ...] = (),
) -> Plan:  # fmt: skip
    """The motion through recorded angles (n, J) at their times (n,), within ``tolerance_deg`` at each of them.

    ``tolerance_deg``: one for all joints, or for each in its unit. It begins and ends at rest. If it would exceed a
    limit, all times are scaled by the same factor, which a note states. Raises PlanError if the spline cannot be near
    enough, as for a recording that begins in motion, or if the arm would leave its ranges or its workspace.
    """
    limits = checks.limits_of(arm)
    tolerance = JointTolerance.of(tolerance_deg, [joint.unit for joint in arm.driven])
    times = times_s - times_s[0]
    tried = [(_needed(fit, times[-1], limits), fit) for fit in _fits(arm, times, angles_deg, tolerance)]
    needed, fit = min(tried, key=lambda each: float(_factors(each[0]).max()))
    points, off_deg, segments = fit
    axis = time_axis.control_points(np.full(segments, times[-1] / segments), DEGREE)
    factor = float(_factors(needed).max())
    if factor > 1.0:
        joint, order = np.unravel_index(int(np.argmax(_factors(needed))), needed.shape)
        what = ("speed", "acceleration", "jerk")[int(order)]
        notes += (
            f"slowed to {100.0 / factor:.1f} % of its own speed: the {what} of {arm.driven[int(joint)].name} is "
            f"{needed[joint, order]:.3g} times its limit; 'armtempo import' and 'plan' find other times",
        )
        axis = axis * (factor * (1.0 + checks.TOLERANCE))
    splines = _splines(points, axis)
    trajectory = Trajectory(name, splines, shared=True)
    reached = extremes.of_joints(splines)
    checks.check_ranges(arm, points, DEGREE)
    checks.check_reached(arm, reached)
    workspace_check.check(arm, trajectory)
    via = np.stack([points[index : index + DEGREE] for index in range(segments + 1)])
    via_deg = np.einsum("c,scj->sj", bspline.basis(DEGREE)[0, :-1], via)
    job = Job(name, via_deg=via_deg.tolist(), path="through", timing="shared", refine=1, optimiser=GRADIENT)
    moving = np.flatnonzero(np.ptp(points, axis=0) > checks.TOLERANCE)
    bound = lower_bounds.of_path(
        points[:, moving], DEGREE, [limits[joint] for joint in moving], trajectory.duration_s
    )
    search = Search(
        joints=tuple(map(int, moving)),
        intervals_s=np.diff(axis),
        total_s=trajectory.duration_s,
        searched_s=trajectory.duration_s,
        evaluations=1,
        history_s=np.array([trajectory.duration_s]),
        optimum_s=0.0,
        lower_bound_s=bound.time_s,
        lower_bound_kind=bound.kind,
    )
    kept = f"follows the recording on its own times, within {tolerance.format(off_deg)} at its points"
    long = checks.long_ways(arm, angles_deg, [f"{time:g} s" for time in times_s])
    solution = JobSolution(job, via_deg, (search,), reached)
    return Plan.of_job(arm, solution, trajectory, (kept, *notes, *long), planner.versions())


def _splines(points: Array, axis: Array) -> tuple[JointSpline, ...]:
    return tuple(JointSpline(DEGREE, 1, np.ascontiguousarray(column), axis) for column in points.T)


class _Fit(NamedTuple):
    """Control points (S + 5, J) on even segments, their largest distance from the recording, and S."""

    points: Array
    off_deg: float
    segments: int


def _needed(fit: _Fit, duration_s: float, limits: Sequence[Limits]) -> Array:
    """Speed, acceleration and jerk of each joint on the recording's times, by their limits: (J, 3)."""
    axis = time_axis.control_points(np.full(fit.segments, duration_s / fit.segments), DEGREE)
    reached = extremes.of_joints(_splines(fit.points, axis))
    return np.array([one.values / np.array(most.values) for one, most in zip(reached, limits, strict=True)])


def _factors(needed: Array) -> Array:
    """How much longer each would have to take."""
    return np.asarray(needed ** (1.0 / _ORDERS))


def _fits(arm: Arm, times: Array, angles: Array, tolerance: JointTolerance) -> list[_Fit]:
    """The coarsest splines near enough: a finer one may keep a limit that a coarse one does not."""
    low, high = np.array([joint.range_deg for joint in arm.driven]).T
    if np.ptp(angles, axis=0).max() <= checks.TOLERANCE:
        raise PlanError("the recording does not move", "give one that does")
    segments = max(int(np.ceil(times[-1] / _COARSEST_S)), 2)
    off_deg = np.inf
    found: list[_Fit] = []
    most = board_limits.most_segments(arm)
    while segments <= most and len(found) < _CANDIDATES:
        inside = 0.0
        for _ in range(_TRIES):
            points = _least_squares(times, np.clip(angles, low + inside, high - inside), segments)
            off_deg = float(np.abs((_at(points, times) - angles) / tolerance.scale).max())
            least, highest = extremes.range_of(np.moveaxis(bspline.polynomials(points, DEGREE), 2, 0))
            beyond = float(max(np.max(low - least), np.max(highest - high)))
            if off_deg > tolerance.one or beyond <= checks.TOLERANCE:
                break
            inside += _INSIDE * beyond
        if off_deg <= tolerance.one and beyond <= checks.TOLERANCE:
            found.append(_Fit(points, off_deg, segments))
        segments = int(np.ceil(_FINER * segments))
    if found:
        return found
    raise PlanError(
        f"a spline from rest to rest stays {tolerance.format(off_deg)} from the recording, "
        f"{tolerance.format(tolerance.one)} are allowed",
        "record from rest to rest within the ranges, give a larger --tolerance-deg or --tolerance-mm, or cut it into "
        "several",
    )


def _least_squares(times: Array, angles: Array, segments: int) -> Array:
    """Control points of the spline from rest to rest nearest to the angles, (S + 5, J); its ends are theirs."""
    dense = np.linspace(0.0, times[-1], min(max(8 * segments, 50), _SAMPLES))
    wanted = np.stack([np.interp(dense, times, column) for column in angles.T], axis=1)
    of_knots = bspline.fit(np.eye(segments + 1), DEGREE)
    values = _at(of_knots, dense)
    rest = wanted - values[:, [0]] * angles[0] - values[:, [-1]] * angles[-1]
    inner = np.linalg.lstsq(values[:, 1:-1], rest, rcond=None)[0]
    return np.asarray(of_knots @ np.concatenate([angles[:1], inner, angles[-1:]]))


def _at(points: Array, times: Array) -> Array:
    """The spline at times (K,) from 0 to the last: (K, J)."""
    pieces = bspline.polynomials(points, DEGREE)
    u = times * (len(pieces) / times[-1])
    segment = np.minimum(u.astype(np.intp), len(pieces) - 1)
    powers = (u - segment)[:, None] ** np.arange(DEGREE + 1)
    return np.asarray(np.einsum("kp,kpj->kj", powers, pieces[segment]))
