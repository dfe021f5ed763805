"""A target posture as users give it, and its angles."""

from __future__ import annotations

from pathlib import Path

from numpy.typing import ArrayLike

from armtempo.basics.arrays import Array
from armtempo.model.arm import Arm
from armtempo.model.plan import Plan
from armtempo.model.sequence_plan import SequencePlan
from armtempo.planning import point_to_point, via_points
from armtempo.records.encoded_motion import EncodedMotion

Where = Plan | EncodedMotion | SequencePlan | Path | str | ArrayLike
"""A posture: its name in the arm file, the driven joints' angles in degrees (J,), or the start of a motion
(or of its file) or sequence."""


def posture_deg(where: Where, arm: Arm) -> Array:
    """The driven joints' angles of a posture, degrees (J,); for a sequence without motions: the home posture.

    Raises InputError for an unknown name, or a posture that does not fit the arm.
    """
    if isinstance(where, Path) or (isinstance(where, str) and where.endswith(".json")):
        where = Plan.load(where)
    if isinstance(where, Plan):
        return where.trajectory(0.0)
    if isinstance(where, EncodedMotion):
        return where.start_deg
    if isinstance(where, SequencePlan):
        start_deg = where.arm.home_deg if where.start_deg is None else where.start_deg
        return point_to_point.posture(start_deg, where.arm)
    if isinstance(where, str):
        return via_points.posture_deg(arm, arm.posture(where))
    return point_to_point.posture(where, arm)
