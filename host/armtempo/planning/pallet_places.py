"""Where an arm's joints are at the places of a pallet."""

from __future__ import annotations

from dataclasses import dataclass, replace

from armtempo.basics.errors import ArmtempoError
from armtempo.model.arm import Arm
from armtempo.model.pallet import ArmPallet
from armtempo.model.posture import ArmPosture
from armtempo.model.tool_pose import Pose
from armtempo.planning import via_points


@dataclass(frozen=True)
class Place:
    """A place of a pallet."""

    name: str
    """Its row, column, layer and pallet."""
    pose: Pose
    """Of the tool there, in the base."""
    above_deg: tuple[float, ...]
    """The driven joints' angles with the tool above it, degrees (J,)."""


def resolve(arm: Arm, pallet: ArmPallet) -> list[Place]:
    """All places, in order; the angles above each are the solution nearest to the place before, at first to home.

    Raises PlanError, with row, column and layer, for a place above which the tool cannot be; InputError as
    ``ArmPallet.pose``.
    """
    found: list[Place] = []
    for number in range(1, pallet.places + 1):
        name = pallet.describe(number)
        above = pallet.pose(number, arm.frames, above=True)
        try:
            if found:
                angles = via_points.nearest(arm, above, found[-1].above_deg)
            else:
                home = replace(above, posture_deg=arm.all_home_deg)
                angles = via_points.posture_deg(arm, ArmPosture(name, home))
        except ArmtempoError as error:
            problem = error.problem.split(": ", 1)[-1]
            raise type(error)(f"{pallet.above_mm:g} mm above {name}: {problem}", error.hint) from error
        found.append(Place(name, pallet.pose(number, arm.frames), tuple(map(float, angles))))
    return found
