"""The postures that bring the tool to another place."""

from __future__ import annotations

import armtempo
import numpy as np
import pytest
from armtempo.kinematics.moved_tool import moved_tool_deg

STEP_MM = np.array([-20.0, 10.0, -20.0])


@pytest.mark.parametrize("name", ["paper", "ar4"])
def test_each_posture_has_the_tool_there(name: str) -> None:
    arm = armtempo.Arm.of(name)
    home = np.array(arm.home_deg)
    before = armtempo.forward(arm, home)
    found = moved_tool_deg(arm, home, (before[:3, 3] + STEP_MM).tolist())
    ways = [float(np.linalg.norm(posture - home)) for posture in found]
    assert ways == sorted(ways)
    assert (len(found) > 1) == (len(arm.driven) == 6)
    for posture in found:
        assert arm.angles_problem(posture) == ""
        after = armtempo.forward(arm, posture)
        np.testing.assert_allclose(after[:3, 3] - before[:3, 3], STEP_MM, atol=0.1)
        if len(arm.driven) == 6:
            np.testing.assert_allclose(after[:3, :3], before[:3, :3], atol=1e-6)


def test_a_place_out_of_reach_is_refused() -> None:
    arm = armtempo.Arm.paper()
    with pytest.raises(armtempo.PlanError, match="no posture reaches"):
        moved_tool_deg(arm, np.array(arm.home_deg), (5000.0, 0.0, 0.0))
