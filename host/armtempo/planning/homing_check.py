"""The moves between the home posture and the switches, against the workspace.

Homing begins wherever the arm stands, which nobody knows: what it does until the first switch cannot be checked.
"""

from __future__ import annotations

import numpy as np

from armtempo.basics.errors import PlanError
from armtempo.model import home_switches
from armtempo.model.arm import Arm
from armtempo.planning import point_to_point, workspace_check


def touching(arm: Arm) -> list[str]:
    """The moves that would leave the workspace, one group of joints after the other, while the others are at home."""
    if not workspace_check.can_touch(arm):
        return []
    problems = []
    home_deg = np.array(arm.home_deg)
    for group in home_switches.groups(arm):
        end_deg = home_deg.copy()
        for index, switch in group.items():
            end_deg[index] = switch.edge_deg
        names = ", ".join(arm.driven[index].name for index in group)
        try:
            workspace_check.check(arm, point_to_point.straight("home", home_deg, end_deg, arm))
        except PlanError as error:
            problems.append(f"between home and the switch of {names}: {error.problem}")
    return problems
