"""Checks of job and arm before planning, and of the plan after it; board_limits has those of the board."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from armtempo_shared import motion
from armtempo_shared.limits import MAX_MOTION_BYTES, MAX_SEGMENTS, MAX_STEP_RATE_SUM

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError, PlanError
from armtempo.model import drive_limits
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.parts import Limits
from armtempo.model.tool_pose import TOLERANCE_DEG, TOLERANCE_MM, WHOLE, Pose
from armtempo.planning import board_limits
from armtempo.splines import bspline, extremes
from armtempo.splines.extremes import Extremes
from armtempo.splines.trajectory import Trajectory

TOLERANCE = 1e-9
"""Allowance for rounding: relative excess over a limit, and excess over a range in degrees."""

MOVE_VIAS = "move the via points away from the end of the range, or add one where it swings out"
"""Hint of ``check_ranges``."""

FITNESS = ("stretched", "penalised")
"""Values of the job's parameter ``fitness``: ``stretched`` scales each candidate until it just keeps its
limits, ``penalised`` is Eq. (21) of the paper."""


def limits_of(arm: Arm) -> list[Limits]:
    """The limits of the driven joints.

    Raises InputError unless each is positive, its speed within the board's step rate, and its backlash small enough.
    """
    limits = []
    for joint in arm.driven:
        values = joint.limits.values
        if not all(math.isfinite(value) and value > 0 for value in values):
            raise InputError(
                f"arm {arm.name!r}: the limits of {joint.name} must be positive numbers, not {values}",
                f"set {', '.join(joint.unit.key(key) for key in _LIMITS)} in the arm file",
            )
        limits.append(joint.limits)
    if not limits:
        raise InputError(
            f"arm {arm.name!r}: no joint has a motor, so there is nothing to plan",
            "give at least one joint a motor in the arm file",
        )
    board_limits.highest_rates(arm)
    board_limits.check_crossings(arm)
    return limits


_LIMITS = ("speed_deg_s", "acceleration_deg_s2", "jerk_deg_s3")


def hardware_notes(arm: Arm) -> tuple[str, ...]:
    """Limits of the arm's tables that the driver, a motor's curve or the encoder does not allow."""
    return tuple(
        f"{joint.name}: {joint.unit.key(bound.key)} = {getattr(joint.limits, bound.key):g}, but {bound.reason}: "
        f"planned with {bound.value:.4g}"
        for joint, bound in drive_limits.exceeded(arm.table_joints, arm.coupling, arm.driver)
    )


def check_job(arm: Arm, job: Job) -> None:
    """Raise InputError for settings that contradict, or that the board cannot hold."""
    refine = 1 if isinstance(job.refine, str) else job.refine
    if arm.coupling and job.timing != "shared":
        raise InputError(f"job {job.name!r}: {board_limits.COUPLED_AXES}", board_limits.SHARE)
    if arm.slides and job.corridor_deg is not None:
        raise InputError(
            f"job {job.name!r}: corridor_deg is of arms whose joints all turn, and {arm.name!r} has a sliding one",
            "give corridor_mm, the tool's largest distance from the spline, or leave it out",
        )
    _check_path(job)
    kind = job.parameters.get("fitness", FITNESS[0])
    if kind not in FITNESS:
        raise InputError(
            f"job {job.name!r}: fitness {kind!r} must be one of {', '.join(FITNESS)}",
            "choose one of them, or leave fitness out",
        )
    if is_free(job):
        return
    segments = len(job.via) - 1
    if segments * refine > MAX_SEGMENTS:
        raise InputError(
            f"job {job.name!r}: {segments} segments with refine {refine} make more than the board's "
            f"{MAX_SEGMENTS}",
            "lower refine or use fewer via points",
        )
    size = motion.size(job.degree, len(arm.driven), job.timing == "shared", segments, refine)
    if size > MAX_MOTION_BYTES:
        raise InputError(
            f"job {job.name!r}: its motion record would have {size} bytes, the board takes "
            f"{MAX_MOTION_BYTES}",
            "lower refine, use shared timing or fewer via points",
        )


def leads_tool(job: Job) -> bool:
    """Whether the job has lines or arcs of the tool, or limits its speed."""
    return bool(job.tool_segments) or job.speed_mm_s is not None or job.acceleration_mm_s2 is not None


def planner_of(job: Job) -> str:
    """The planner of ``planner.PLANNERS`` for a job: "line" if it leads the tool, or its spline rests at via points."""
    if leads_tool(job) or (job.stops and not is_free(job)):
        return "line"
    return "free" if is_free(job) else "through"


def _check_tool_segments(job: Job, where: str) -> None:
    """Raise InputError for lines and speeds of the tool that contradict the rest of the job."""
    if job.timing != "shared" or job.degree != 5:
        raise InputError(
            f'{where}: lines and speeds of the tool need timing = "shared" and degree 5',
            "leave timing and degree out",
        )
    if is_free(job) and (job.corridor_deg is not None or job.corridor_mm is not None):
        raise InputError(
            f"{where}: lines and speeds of the tool do not go together with a corridor",
            "leave one of them out",
        )
    vias = [segment.via for segment in job.tool_segments]
    if vias != sorted(set(vias)) or (vias and vias[-1] >= len(job.via)):
        raise InputError(
            f"{where}: its tool_segments lead to via points {vias}", "give each via point one, in order"
        )
    led = {segment.via for segment in job.tool_segments if segment.line}
    for segment in job.tool_segments:
        if segment.blend_mm and segment.via + 1 not in led:
            raise InputError(
                f"{where}: blend_mm at P{segment.via} needs a line on both sides of it",
                "leave it out: the motion rests there; or give the next via point line = true",
            )
    for stop in job.stops:
        if any(segment.blend_mm and segment.via == stop.via for segment in job.tool_segments):
            raise InputError(
                f"{where}: the motion cannot rest at P{stop.via} and cut its corner", "leave one out"
            )


def is_free(job: Job) -> bool:
    """Whether the path may leave the spline through the via points; not with a corridor of 0."""
    return job.path == "free" and 0.0 not in (job.corridor_deg, job.corridor_mm)


def _check_path(job: Job) -> None:
    where = f"job {job.name!r}"
    corridors = [name for name in ("corridor_deg", "corridor_mm") if getattr(job, name) is not None]
    if corridors and job.path != "free":
        raise InputError(f"{where}: {corridors[0]} bounds a free path", 'add path = "free" or leave it out')
    if len(corridors) > 1:
        raise InputError(
            f"{where}: give one of corridor_deg and corridor_mm, not both", "leave one of them out"
        )
    if corridors and not 0.0 <= getattr(job, corridors[0]) < math.inf:
        raise InputError(
            f"{where}: {corridors[0]} must be 0 or more", f"give {corridors[0]} a width, or leave it out"
        )
    if leads_tool(job):
        _check_tool_segments(job, where)
    elif planner_of(job) == "line" and (job.timing != "shared" or job.degree != 5):
        raise InputError(
            f'{where}: a stop needs timing = "shared" and degree 5',
            "leave timing and degree out, or plan the legs between the stops one by one with --split",
        )
    _check_stops(job, where)
    if is_free(job):
        _check_free(job, where)


def is_wide(via: tuple[float, ...] | Pose) -> bool:
    """Whether a free path may use the tolerance of a via point: a pose with a larger tolerance than the default.

    Only if all or nothing of the orientation is constrained; other poses are passed at the inverse's angles.
    """
    return (
        isinstance(via, Pose)
        and via.fixed in ((), WHOLE)
        and (via.tolerance_mm > TOLERANCE_MM or via.tolerance_deg > TOLERANCE_DEG)
    )


def _check_free(job: Job, where: str) -> None:
    if job.degree != 5:
        raise InputError(
            f"{where}: a free path has degree 5, not {job.degree}",
            'leave degree out, or take path = "through"',
        )
    together = {
        "a stop": bool(job.stops),
        "a corridor": job.corridor_deg is not None or job.corridor_mm is not None,
        "a tolerance at a via point": any(is_wide(via) for via in job.via),
    }
    for what, asked in together.items():
        if asked and job.timing != "shared":
            raise InputError(
                f'{where}: {what} needs timing = "shared", where the joints pass via points together',
                'give timing = "shared" (--timing shared), or leave that out',
            )
    if together["a corridor"] and any(stop.dwell_s > 0.0 for stop in job.stops):
        raise InputError(f"{where}: a corridor and a dwell do not go together", "give stops without dwell_s")


def _check_stops(job: Job, where: str) -> None:
    inner = range(1, len(job.via) - 1)
    for stop in job.stops:
        if stop.via not in inner or not 0.0 <= stop.dwell_s < math.inf:
            raise InputError(
                f"{where}: a stop must be at a via point between the ends, for 0 s or more",
                "leave it out or move it to another via point",
            )
    if len({stop.via for stop in job.stops}) < len(job.stops):
        raise InputError(f"{where}: two stops at one via point", "leave one of them out")


def check_via(arm: Arm, job: Job, via_deg: Array) -> None:
    """Raise InputError for via angles (n + 1, J) that are not a motion of this arm."""
    if via_deg.ndim != 2 or len(via_deg) < 2 or via_deg.shape[1] != len(arm.driven):
        raise InputError(
            f"job {job.name!r}: needs at least 2 via points with {len(arm.driven)} "
            f"{arm.texts.position}s each, one for each driven joint",
            f"give each via point all of these {arm.texts.position}s",
        )
    if not np.all(np.isfinite(via_deg)):
        raise InputError(
            f"job {job.name!r}: a via angle is not a finite number",
            f"give every angle as a number of degrees{', every sliding joint one of mm' if arm.slides else ''}",
        )
    circles = any(segment.circle_through_mm is not None for segment in job.tool_segments)
    if np.all(np.ptp(via_deg, axis=0) <= TOLERANCE) and not circles:
        raise PlanError(
            f"job {job.name!r}: all via points are the same, so nothing moves", "change at least one angle"
        )


def long_ways(arm: Arm, via_deg: Array, places: Sequence[str] = ()) -> tuple[str, ...]:
    """Notes: joints that move by more than half a turn between two via points (n + 1, J), where a shorter way ends
    at the same place. ``places``: what the points are called; else by their numbers, "P0" and on."""
    notes = []
    for number, joint in enumerate(arm.driven):
        if joint.slides:
            continue
        for via, (start, end) in enumerate(pairwise(via_deg[:, number].tolist()), 1):
            turn = -360.0 * round((end - start) / 360.0)
            if turn:
                low, high = joint.range_deg
                short = end + turn
                between = " to ".join(places[via - 1 : via + 1]) if places else f"P{via - 1} to P{via}"
                can = "is in its range too" if low <= short <= high else "is out of its range"
                notes.append(
                    f"{between}: {joint.name} goes {abs(end - start):.4g} degrees from {start:.4g} to "
                    f"{end:.4g}; {short:.4g}, {abs(short - start):.4g} the other way, {can}"
                )
    return tuple(notes)


def check_ranges(arm: Arm, angle_points_deg: Array, degree: int, hint: str = MOVE_VIAS) -> None:
    """Raise PlanError, with this hint, if the path leaves a joint's range, also between the via points, or goes beyond
    a switch within it, which would stop the arm."""
    low, high = extremes.range_of(np.moveaxis(bspline.polynomials(angle_points_deg, degree), 2, 0))
    for joint, lowest, highest in zip(arm.driven, low, high, strict=True):
        least, most = joint.range_deg
        margin = TOLERANCE * max(1.0, abs(least), abs(most))
        if lowest < least - margin or highest > most + margin:
            raise PlanError(
                f"{joint.name}: the path reaches {lowest:.7g} to {highest:.7g} {joint.unit.word}, its range is "
                f"{least:g} to {most:g}",
                hint,
            )
        for side, at_deg in joint.switches_within:
            if lowest < at_deg - margin if side == "low" else highest > at_deg + margin:
                raise PlanError(
                    f"{joint.name}: the path reaches {lowest:.7g} to {highest:.7g} {joint.unit.word}, beyond its "
                    f"{side} switch, which stops it at {at_deg:g}",
                    f"stay on this side of it, or correct {joint.unit.key(f'{side}_deg')} in its [switches]",
                )


def check_reached(arm: Arm, reached: tuple[Extremes, ...]) -> None:
    """The check of every plan: raises PlanError if a limit or the board's step rate is exceeded."""
    for joint, extreme in zip(arm.driven, reached, strict=True):
        if not np.all(extreme.values <= np.array(joint.limits.values) * (1 + TOLERANCE)):
            raise PlanError(
                f"{joint.name}: no plan was found that keeps its limits {joint.limits.values}, the best one "
                f"reaches {extreme.values}",
                "angles and limits are too different in magnitude to compute with",
            )
    rates = board_limits.step_rates(arm, reached)
    if rates > MAX_STEP_RATE_SUM:
        raise PlanError(board_limits.format_rate(rates), "lower the speed limits or use fewer microsteps")


def check_time(trajectory: Trajectory) -> None:
    """Raise PlanError unless all differences of time control points are positive, so that time increases."""
    for spline in trajectory.joints:
        if not np.all(np.diff(spline.time_points_s) > 0.0):
            raise PlanError(
                f"trajectory {trajectory.name!r}: no time axis was found that increases everywhere",
                "via points, limits and dwells are too different in magnitude to compute with",
            )
