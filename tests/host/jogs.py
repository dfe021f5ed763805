"""What tests of jogs have in common: postures of whole steps, and the limits of a jog."""

from __future__ import annotations

import numpy as np
from armtempo.model.arm import Arm
from armtempo.planning import move_law
from armtempo.planning.jog.jog_motion import JogMotion
from armtempo.splines import extremes

PAPER, AR4 = Arm.paper(), Arm.load("ar4")
ELBOW_DEG = [20.0, 10.0, -20.0, 15.0, 40.0, 30.0]
"""A posture of AR4 far from any singular one."""


def on_steps(arm: Arm, angles_deg: list[float]) -> list[float]:
    """The posture of whole steps next to the angles."""
    return [
        round(angle * joint.steps_per_deg) / joint.steps_per_deg
        for angle, joint in zip(angles_deg, arm.driven, strict=True)
    ]


def check_limits(motion: JogMotion, arm: Arm, speed: float) -> None:
    """Speed and ramps keep their parts of the limits, and every joint its range."""
    for reached, joint in zip(extremes.of_joints(motion.trajectory.joints), arm.driven, strict=True):
        most = joint.limits
        assert reached.speed_deg_s <= speed * most.speed_deg_s * (1 + 1e-9)
        assert reached.acceleration_deg_s2 <= move_law.ACCELERATION * most.acceleration_deg_s2 * (1 + 1e-9)
        assert reached.jerk_deg_s3 <= move_law.JERK * most.jerk_deg_s3 * (1 + 1e-9)
    angles = motion.trajectory(np.linspace(0.0, motion.trajectory.duration_s, 2000))
    low, high = np.array([joint.range_deg for joint in arm.driven]).T
    assert np.all(angles >= low)
    assert np.all(angles <= high)
