"""Arms of one to six driven joints for the tests, most of them outside the closed form's class."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from armtempo.kinematics.solver import PoseSolver
from armtempo.model.arm import Arm
from armtempo.model.parts import Joint
from armtempo.model.pose import to_rpy_deg
from armtempo.model.tool_pose import APPROACH, WHOLE, Pose

PAPER_ARM = Arm.paper()
"""Six rows, three motors."""

_DRIVE = PAPER_ARM.joints[0]


def joint(
    d_mm: float, a_mm: float, alpha_deg: float, low: float = -170.0, high: float = 170.0, driven: bool = True
) -> Joint:
    """A row of the table."""
    ends, drive = (low, high), (_DRIVE.limits, _DRIVE.motor) if driven else (None, None)
    home_deg = min(max(0.0, low), high)
    return Joint("joint", d_mm, a_mm, alpha_deg, 0.0, ends, home_deg, *drive)


def arm(name: str, *joints: Joint) -> Arm:
    """An arm of these rows, its joints numbered, each motor with a channel of its own."""
    motors = (
        replace(each.motor, channel=number) if each.motor else None for number, each in enumerate(joints, 1)
    )
    named = (
        replace(each, name=f"joint {number}", motor=motor)
        for number, (each, motor) in enumerate(zip(joints, motors, strict=True), 1)
    )
    return Arm(name, tuple(named))


ONE = arm("turntable", joint(20, 150, 0))
PLANAR_2 = arm("planar 2", joint(0, 200, 0), joint(0, 150, 0))
PLANAR_3 = arm("planar 3", joint(0, 200, 0), joint(0, 150, 0), joint(0, 50, 0))
SCARA = arm("scara", joint(300, 200, 0), joint(0, 150, 180), joint(50, 0, 0))
"""Its three revolute joints."""
THREE = arm("three", joint(100, 0, 90), joint(0, 200, 0, 0, 180), joint(0, 180, 0, -150, 0))
FOUR = arm("four", *THREE.joints, joint(0, 60, 0, -100, 100))
FIVE = arm(
    "five",
    *THREE.joints[:2],
    joint(0, 180, 0, -150, 150),
    joint(0, 0, 90, -100, 100),
    joint(60, 0, 0),
)
SIX = replace(
    PAPER_ARM,
    name="six",
    joints=tuple(
        replace(each, motor=replace(_DRIVE.motor, channel=number), limits=_DRIVE.limits)
        for number, each in enumerate(PAPER_ARM.joints, 1)
        if _DRIVE.motor
    ),
)
"""The paper's arm with a motor in each joint."""
OFFSET_WRIST = replace(
    SIX,
    name="offset wrist",
    joints=tuple(replace(each, a_mm=15.0) if row == 3 else each for row, each in enumerate(SIX.joints)),
)

FITTING: list[tuple[Arm, tuple[str, ...]]] = [
    (ONE, ()),
    (PLANAR_2, ()),
    (PLANAR_3, ("yaw",)),
    (SCARA, ("yaw",)),
    (THREE, ()),
    (PAPER_ARM, ()),
    (FOUR, ("pitch",)),
    (FIVE, ("roll", "pitch")),
    (OFFSET_WRIST, WHOLE),
]
"""Arms, each with what it can be asked of the orientation to the last freedom."""


def drawn_posture(solver: PoseSolver, rng: np.random.Generator) -> np.ndarray:
    """Angles within the ranges, (joints,); joints without a motor at home."""
    driven = np.isin(np.arange(len(solver.home_rad)), solver.moving.moving)
    inside = rng.uniform(0.95 * solver.ranges.low, 0.95 * solver.ranges.high)
    return np.where(driven, inside, solver.home_rad)


def asked(pose: np.ndarray, fixed: tuple[str, ...], tolerance_mm: float = 0.1) -> Pose:
    """A target that asks of a pose (4, 4) only what ``fixed`` says."""
    if fixed == (APPROACH,):
        found = Pose.of_approach(pose[:3, 3], pose[:3, 2])
    elif fixed == WHOLE:
        found = Pose.of_matrix(pose)
    else:
        angles = dict(zip(WHOLE, to_rpy_deg(pose), strict=True))
        found = Pose.of_angles(pose[:3, 3], {name: angles[name] for name in fixed})
    return replace(found, tolerance_mm=tolerance_mm)


def toml(arm: Arm) -> str:
    """The arm as the text of an arm file: what its kinematics needs."""
    text = f'name = "{arm.name}"\n'
    for each in arm.joints:
        text += (
            f"[[joint]]\nd_mm = {each.d_mm}\na_mm = {each.a_mm}\nalpha_deg = {each.alpha_deg}\n"
            f"range_deg = {list(each.range_deg)}\nhome_deg = {each.home_deg}\n"
        )
        if each.motor:
            channel = each.motor.channel
            text += (
                f"motor = {{ channel = {channel}, steps_per_rev = 200, microsteps = 16, gear_ratio = 10.0 }}\n"
                "limits = { speed_deg_s = 50.0, acceleration_deg_s2 = 50.0, jerk_deg_s3 = 150.0 }\n"
            )
    return text
