"""Whether a plan is for an arm as it is now."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from armtempo.basics.errors import InputError
from armtempo.encoding.encode import arm_record
from armtempo.model import frame
from armtempo.model.arm import Arm


def check(what: Path | str, planned: Arm, frames: Sequence[str], arm: Arm) -> None:
    """Raise InputError if ``what`` was planned for another arm than ``arm``, or one of its frames is elsewhere now.

    ``planned``: the arm of the plan; ``frames``: those in which the plan's job was given.
    """
    where = f"arm {arm.name!r}" + (f" ({arm.source})" if arm.source else "")
    if arm_record(planned) != arm_record(arm):
        raise InputError(
            f"{what} was planned for a different arm than {where}", "plan it again with this arm"
        )
    check_frames(what, planned, frames, arm)


def check_frames(what: Path | str, planned: Arm, frames: Sequence[str], arm: Arm) -> None:
    """The same for the frames alone."""
    change = frame.changed(planned.frames, arm.frames, frames)
    if planned.tool and planned.tool not in (arm.tool, *arm.tools):
        change = f"tool {planned.tool.name!r} has changed since, or is gone"
    if change:
        where = f"arm {arm.name!r}" + (f" ({arm.source})" if arm.source else "")
        raise InputError(f"{what} is old: {change}, in {where}", "plan it again")
