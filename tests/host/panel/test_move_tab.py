"""Targets and homing."""

from __future__ import annotations

import numpy as np
import pytest
from armtempo.basics.errors import PlanError
from armtempo.kinematics.of_arm import forward
from armtempo.model.arm import Arm
from armtempo.panel import homing, teaching

from tests.host.panel.fakes import ARM


def test_a_typed_pose_is_reached_by_the_nearest_posture() -> None:
    here = np.array([10.0, -60.0, 40.0])
    place = forward(ARM, (20.0, -70.0, 50.0))[:3, 3].tolist()
    found = teaching.nearest(ARM, place, (0.0, 0.0, 0.0), here)
    assert forward(ARM, found)[:3, 3] == pytest.approx(place, abs=0.1)
    with pytest.raises(PlanError):
        teaching.nearest(ARM, [9999.0, 0.0, 0.0], (0.0, 0.0, 0.0), here)


def test_what_the_switches_home_is_named_in_its_order() -> None:
    assert homing.switches(ARM) == []
    ar4 = Arm.of("ar4")
    groups = homing.switches(ar4)
    assert sorted(name for group in groups for name in group.split(", ")) == sorted(
        joint.name for joint in ar4.driven
    )
    assert groups[: len(ar4.homing)] == [", ".join(group) for group in ar4.homing]
