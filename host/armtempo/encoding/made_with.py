"""What a motion was planned with and the board knows nothing of: frames, tools, loads, pallets, workspace, rows.

Checksums of them, by kind and name, are at the end of each stored record, so that it is seen later whether they are as
they were.
"""

from __future__ import annotations

import json
import struct
from binascii import crc32
from pathlib import Path
from typing import Any

import numpy as np
from armtempo_shared import motion
from armtempo_shared.limits import MAX_MOTION_BYTES
from armtempo_shared.motion import Motion
from armtempo_shared.sequence import KIND_BYTES, MAGIC, SequenceData

from armtempo.basics import json_codec
from armtempo.basics.errors import InputError
from armtempo.encoding.encode import arm_record
from armtempo.model import frame
from armtempo.model.arm import Arm
from armtempo.model.parts import NOTHING, Joint
from armtempo.model.plan import Plan
from armtempo.planning import workspace_check
from armtempo.planning.workspace_check import Bodies

MadeWith = dict[str, int]
"""Checksums by "workspace", "rows", "frame NAME", "tool NAME", "load NAME" and "pallet NAME"."""
WORKSPACE, ROWS = "workspace", "rows"
_WORDS = {
    WORKSPACE: "the workspace, or the radius of a link, has changed since",
    ROWS: "the table of joints has changed since",
}
_CRC_BYTES = 4
_DECIMALS = 6
"""Of lengths in mm: a frame within others is a product of matrices."""


def of_plan(plan: Plan) -> MadeWith:
    """What a plan was made with."""
    keys = [f"frame {name}" for name in plan.frames]
    keys += [f"tool {on.tool.name}" for on, _ in plan.loaded_legs if on.tool]
    keys += [f"load {leg.load}" for leg in plan.legs if leg.load not in ("", NOTHING)]
    keys += [f"pallet {name}" for name in plan.pallets]
    keys += [ROWS, WORKSPACE]  # last, as its boxes may be in the frames
    return {key: _checksum(plan.arm, key) or 0 for key in dict.fromkeys(keys)}


def changed(then: MadeWith, arm: Arm, before: Arm | None = None) -> str:
    """Describe the first of these that is not in ``arm`` as it was; "" if all are.

    ``before``: the arm as it was, if it is known; then it says by how much a frame has moved.
    """
    for key, was in then.items():
        if _checksum(arm, key) != was:
            kind, _, name = key.partition(" ")
            moved = frame.changed(before.frames, arm.frames, [name]) if before and kind == "frame" else ""
            return moved or _WORDS.get(key, f"{kind} {name!r} has changed since, or is gone")
    return ""


def _checksum(arm: Arm, key: str) -> int | None:
    """Of what a key names in an arm; None if it has none."""
    kind, _, name = key.partition(" ")
    found: Any = None
    if kind == ROWS:
        found = [_row(each) for each in arm.joints]
    elif kind == WORKSPACE:
        found = _workspace(arm)
    elif kind == "frame":
        try:
            found = np.round(frame.in_base(arm.frames, name), _DECIMALS).tolist()
        except InputError:
            return None
    else:
        parts = {"tool": (*arm.tools, arm.tool), "load": arm.loads, "pallet": arm.pallets}.get(kind, ())
        found = next((json_codec.encode(each) for each in parts if each and each.name == name), None)
    return None if found is None else crc32(json.dumps(found).encode())


def _row(joint: Joint) -> Any:
    """What of a row of the table says where the tool is."""
    numbers = [joint.d_mm, joint.a_mm, joint.alpha_deg, joint.theta_offset_deg]
    return [*numbers, joint.slides, joint.parallel_linkage, None if joint.motor else joint.home_deg]


def _workspace(arm: Arm) -> Any:
    """What an arm without tool and load may touch: walls, boxes, its own links."""
    bare = arm.with_tool(NOTHING).holding(NOTHING)
    if not workspace_check.can_touch(bare):
        return []
    boxes = [
        [list(each.low_mm), list(each.high_mm), np.round(np.array(each.axes), _DECIMALS).tolist()]
        for each in Bodies(bare).obstacles
    ]
    return [boxes, [each.radius_mm for each in arm.joints]]


# in records


def added(data: bytes, then: MadeWith) -> bytes:
    """A record of a motion or a sequence with this at its end; without, if the board cannot take it."""
    body = data[:-_CRC_BYTES] + json.dumps(then, separators=(",", ":")).encode()
    if len(body) + _CRC_BYTES > MAX_MOTION_BYTES:
        return data
    return body + struct.pack("<I", crc32(body))


def of_record(data: bytes) -> MadeWith:
    """What is at the end of a record; empty if nothing is, as in those of older versions, or it is damaged."""
    try:
        if data[:KIND_BYTES] == MAGIC[:KIND_BYTES]:
            end = SequenceData(data).end
        else:
            head = Motion(data)
            end = motion.size(head.degree, head.joints, head.shared, head.segments, head.refine) - _CRC_BYTES
        text = data[end:-_CRC_BYTES]
        found: MadeWith = json.loads(text) if text else {}
    except ValueError:  # the board says what is wrong with it
        return {}
    return found


def check_stored(name: str, data: bytes, arm: Arm) -> None:
    """Raise InputError if what the board has as ``name`` was made with something that has changed since."""
    if change := changed(of_record(data), arm):
        raise InputError(f"{name!r} on the board is old: {change}", "plan it again, and upload it")


# of a plan
def check_plan(what: Path | str, plan: Plan, arm: Arm) -> None:
    """Raise InputError if a plan, named ``what``, is for another arm, or old as in ``check_surroundings``."""
    if arm_record(plan.arm) != arm_record(arm):
        raise InputError(
            f"{what} was planned for a different arm than {_named(arm)}", "plan it again with this arm"
        )
    check_surroundings(what, plan, arm)


def check_surroundings(what: Path | str, plan: Plan, arm: Arm) -> None:
    """Raise InputError if something that a plan was made with has changed since."""
    if change := changed(of_plan(plan), arm, plan.arm):
        raise InputError(f"{what} is old: {change}, in {_named(arm)}", "plan it again with this arm")


def _named(arm: Arm) -> str:
    return f"arm {arm.name!r}" + (f" ({arm.source})" if arm.source else "")
