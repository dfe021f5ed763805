"""The path of a leg without a line or arc of the tool: the spline through its via points, or a free path."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.progress import Progress
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.planning import checks
from armtempo.planning.free import around
from armtempo.planning.line.legs import Leg
from armtempo.planning.lower_bounds import LowerBound
from armtempo.splines import bspline
from armtempo.splines.bspline import REST_PIECES

DEGREE = 5


@dataclass(frozen=True, eq=False)
class Between:
    """The path of such a leg."""

    angle_points_deg: Array
    """(S + 5, J)."""
    arrivals: tuple[int, ...]
    """Segments before each of its via points."""
    bound: LowerBound | None = None
    """Lower bound for any motion through them; None for a fixed path."""

    @property
    def segments(self) -> int:
        """All of them."""
        return len(self.angle_points_deg) - DEGREE

    @property
    def at_knots(self) -> Array:
        """Angles at the ends of the segments: (S + 1, J)."""
        pieces = bspline.polynomials(self.angle_points_deg, DEGREE)
        return np.concatenate([pieces[:, 0], pieces[-1:].sum(axis=1)])


def between(arm: Arm, job: Job, leg: Leg, via_deg: Array, progress: Progress) -> Between:
    """The path of a leg of a job with via angles (n + 1, J); PlanError if no free one stays in the ranges."""
    own = via_deg[leg.first : leg.last + 1]
    if checks.is_free(job) and np.any(np.ptp(own, axis=0) > checks.TOLERANCE):
        return _free(arm, job, leg, own, progress)
    points = bspline.refined(bspline.fit(own, DEGREE), REST_PIECES, DEGREE)
    return Between(points, tuple(REST_PIECES * via for via in range(len(own))))


def _free(arm: Arm, job: Job, leg: Leg, via_deg: Array, progress: Progress) -> Between:
    """The free path of a separate job from rest to rest, on few segments, as all legs share the board's
    memory."""
    ends = [tuple(angles.tolist()) for angles in via_deg[[0, -1]]]
    alone = replace(
        job,
        via=(ends[0], *job.via[leg.first + 1 : leg.last], ends[1]),
        refine=job.refine if isinstance(job.refine, int) else REST_PIECES,
        stops=(),
        tool_segments=(),
        speed_mm_s=None,
        acceleration_mm_s2=None,
    )
    planned = around.motion(arm, alone, via_deg, progress, nearest=False)
    joints = planned.trajectory.joints
    points = np.stack([joint.angle_points_deg for joint in joints], axis=1)
    search = planned.searches[0]
    arrivals = joints[0].via_segments
    assert arrivals is not None
    return Between(points, arrivals, LowerBound(search.lower_bound_s, search.lower_bound_kind))
