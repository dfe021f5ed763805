"""A serial chain of a URDF's joints, as it was read, and what is doubtful in it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.model.joint_unit import DEG, SLIDE_MM, JointUnit, is_range_doubtful, is_speed_doubtful
from armtempo.model.joint_unit import MM as MM_UNIT
from armtempo.new_arm.urdf_bodies import Body
from armtempo.new_arm.urdf_transmissions import Coupling

MM = 1000.0
"""Millimetres in the URDF's unit, the metre."""


@dataclass(frozen=True)
class ChainJoint:
    """One revolute or prismatic joint at joint angles 0, in the base link's frame."""

    name: str
    point_mm: Array
    """(3,): a point of its axis, of a sliding joint any."""
    direction: Array
    """(3,): along its axis, of length 1."""
    range_deg: tuple[float, float]
    """Of a sliding joint in mm, as its speed."""
    speed_deg_s: float | None
    continuous: bool
    body: Body | None
    """The body up to the next joint; None without a mass."""
    is_linked: bool = False
    """Whether a linkage turns it by minus the angle of the joint before, so that its link keeps its direction."""
    slides: bool = False
    narrowed_by: str = ""
    """What makes its range narrower than its own limits."""

    @property
    def unit(self) -> JointUnit:
        """Of its range and speed."""
        return MM_UNIT if self.slides else DEG


@dataclass(frozen=True)
class Chain:
    """The joints from a base link to a tip link."""

    robot: str
    base: str
    tip: str
    joints: tuple[ChainJoint, ...]
    zero_pose: Array
    """(4, 4): the tip link's frame in the base link's, all joints at 0; lengths in mm."""
    model: Any
    """The reader's own robot, for its forward kinematics."""
    couplings: tuple[Coupling, ...] = ()
    """Transmissions that turn two of its joints together."""
    unclear: tuple[str, ...] = ()
    """What is said of other such transmissions, and of lengths and angles that may have another unit."""

    @property
    def doubts(self) -> tuple[str, ...]:
        """Joints whose limits are probably in degrees."""
        turning = [joint for joint in self.joints if not joint.slides]
        ranges = (
            "joint {!r}: its limits, {:.4g} to {:.4g} rad, are {:.5g} to {:.5g} degrees: are they in degrees?".format(
                joint.name, *map(math.radians, joint.range_deg), *joint.range_deg
            )
            for joint in turning
            if is_range_doubtful(joint.range_deg)
        )
        speeds = (
            f"joint {joint.name!r}: its speed, {math.radians(joint.speed_deg_s):.4g} rad/s, is {joint.speed_deg_s:.5g} "
            "degrees/s: is it in degrees/s?"
            for joint in turning
            if joint.speed_deg_s is not None and is_speed_doubtful(joint.speed_deg_s)
        )
        return (*ranges, *speeds)

    @property
    def narrowed(self) -> tuple[str, ...]:
        """What is said of ranges that are narrower than in the file."""
        return tuple(
            f"joint {joint.name!r}: its range is {joint.range_deg[0]:.5g} to {joint.range_deg[1]:.5g} "
            f"{joint.unit.word}, by {joint.narrowed_by}"
            for joint in self.joints
            if joint.narrowed_by
        )

    @property
    def linked(self) -> tuple[int, ...]:
        """Indices of the joints that a linkage turns."""
        return tuple(index for index, joint in enumerate(self.joints) if joint.is_linked)

    @property
    def sliding(self) -> tuple[int, ...]:
        """Indices of the joints that slide."""
        return tuple(index for index, joint in enumerate(self.joints) if joint.slides)

    def poses(self, angles_rad: Array) -> Array:
        """The tip's poses by the reader's forward kinematics: (K, 4, 4) in mm for angles (K, joints) in rad, of sliding
        joints as the kinematics have them.

        Those of joints that a linkage turns are 0.
        """
        moving = [(index, joint.name) for index, joint in enumerate(self.joints) if not joint.is_linked]
        poses = np.empty((len(angles_rad), 4, 4))
        values = angles_rad.copy()
        values[:, list(self.sliding)] *= SLIDE_MM / MM
        for number, angles in enumerate(values):
            self.model.update_cfg({name: angles[index] for index, name in moving})  # the others follow
            poses[number] = transform(self.model, self.tip, self.base)
        return poses


def transform(model: Any, link: str, base: str) -> Array:
    """The frame of ``link`` in that of ``base``, in mm."""
    pose: Array = np.array(model.get_transform(link, base), dtype=np.float64)
    pose[:3, 3] *= MM
    return pose
