"""Motion time as a function of the corridor around the spline through the via points."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from armtempo.basics.errors import InputError, PlanError
from armtempo.basics.progress import Progress, part
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.plan import Plan
from armtempo.planning import planner
from armtempo.planning.free import corridor
from armtempo.planning.free.angle_bounds import of_path
from armtempo.planning.free.layout import DEGREE
from armtempo.planning.tool import Tool
from armtempo.splines import bspline

_NARROWER = 8
"""Number of corridors narrower than the widest."""
_FACTOR = 2.0
"""Ratio of successive corridors."""
_WIDE = {"deg": 1e3, "mm": 1e6}
"""Corridors so wide that they restrict no motion."""


@dataclass(frozen=True)
class CorridorTime:
    """The motion time in a corridor; None: a free path, 0: the spline itself."""

    corridor: float | None
    total_s: float


def curve(arm: Arm, job: Job, progress: Progress) -> list[CorridorTime]:
    """The job's motion time on the spline, in ever wider corridors, and free.

    In mm of the tool if the job has ``corridor_mm``, else in degrees of any joint. The widest corridor is the
    width that an unrestricted path uses. With stops there is no motion on the spline itself, nor in the
    narrowest corridors. Raises as ``planner.plan``; InputError if the path is not free.
    """
    if job.path != "free":
        raise InputError(
            f'job {job.name!r}: a corridor curve needs path = "free"',
            'add --path free, or path = "free" to the job',
        )
    unit = unit_of(job)
    whole = _NARROWER + 4
    wide = planner.plan(arm, _in(job, unit, _WIDE[unit]), part(progress, 0, whole))
    widest = _deviation(arm, wide, unit)
    widths: list[float | None] = [widest / _FACTOR**power for power in range(_NARROWER, -1, -1)]
    found = []
    for number, width in enumerate([*([] if job.stops else [0.0]), *widths, None], 1):
        try:
            plan = planner.plan(arm, _in(job, unit, width), part(progress, number, whole))
        except PlanError:
            if width is None or not job.stops:
                raise
            continue  # the spline does not stop there: a path that stops leaves it by more
        found.append(CorridorTime(width, plan.total_s))
    progress(whole, whole)
    return found


def _in(job: Job, unit: str, corridor: float | None) -> Job:
    """The job in another corridor."""
    free = replace(job, corridor_deg=None, corridor_mm=None)
    return replace(free, corridor_mm=corridor) if unit == "mm" else replace(free, corridor_deg=corridor)


def _deviation(arm: Arm, plan: Plan, unit: str) -> float:
    """Bound of the distance of a plan in a corridor from the spline through its via points."""
    points = np.stack([joint.angle_points_deg for joint in plan.trajectory.joints], axis=1)
    spline = bspline.fit(plan.via_deg, DEGREE)
    pieces = (len(points) - DEGREE) // (len(spline) - DEGREE)
    path, middle = of_path(points, DEGREE), of_path(bspline.refined(spline, pieces, DEGREE), DEGREE)
    if unit == "deg":
        return corridor.joint_deviation_deg(path, middle)
    return corridor.tool_deviation_mm(path, middle, Tool(arm, list(range(points.shape[1])), plan.via_deg[0]))


def unit_of(job: Job) -> str:
    """``"mm"`` or ``"deg"``."""
    return "deg" if job.corridor_mm is None else "mm"
