"""The arm's record on the board, its differences from another, and the positions of the joints."""

from __future__ import annotations

import numpy as np
from armtempo_shared import armrecord, wire
from numpy.typing import ArrayLike, NDArray

from armtempo.basics.arrays import Array
from armtempo.basics.errors import LinkError
from armtempo.encoding import encode, engine_heap
from armtempo.encoding.engine_heap import EngineHeap
from armtempo.link import Client
from armtempo.link.board_messages import Status
from armtempo.model.arm import Arm
from armtempo.planning import point_to_point

_WORDS = {
    "channel": "motor channel",
    "dir_inverted": "motor direction",
    "encoder": "encoder",
    "encoder_inverted": "encoder direction",
    "counts_num": "encoder counts a step",
    "counts_den": "encoder counts a step",
    "min_steps": "range",
    "max_steps": "range",
    "max_rate": "speed limit",
    "following_counts": "following error",
    "limit_low": "limit switches",
    "limit_high": "limit switches",
    "limit_active_high": "limit switches",
    "flags": "E-stop, enable output or what a lost link does",
    "pulse_ticks": "driver timing",
    "low_ticks": "driver timing",
    "dir_setup_ticks": "driver timing",
    "dir_hold_ticks": "driver timing",
    "link_timeout_ms": "link time-out",
    "identity": "geometry, motors, coupling, encoders or switches",
}
_HALF_STEP = 0.5 + 1e-9
_KEEPS = "which keeps the position, as only limits, outputs or inputs differ"
_LOSES = "after which the position is unknown"


def configure(client: Client, arm: Arm, replace: bool) -> None:
    """Send the arm's record to the board, unless the board already has it; positions are unknown afterwards.

    ``replace``: replace another record; if only limits differ, the board keeps the positions. Raises
    LinkError if the board has another record and ``replace`` is false, InputError if the arm does not fit the
    board (which then keeps its record), BoardError during a motion.
    """
    data = encode.arm_record(arm)
    if client.info.arm_crc == wire.record_crc(data):
        return
    if client.info.arm_crc and not replace:
        raise _other_arm(arm, client.fetch(wire.ARM_RECORD_NAME), data)
    if arm.outputs or arm.inputs:
        client.need("outputs", f"the outputs and inputs of arm {arm.name!r}")
    engine_heap.check(arm, EngineHeap(client.info.engine_bytes))
    client.upload(wire.ARM_RECORD_NAME, data)
    client.hello()


def _other_arm(arm: Arm, old: bytes, new: bytes) -> LinkError:
    return LinkError(
        f"the board is set up for a different arm than {arm.name!r} ({arm.source}): {difference(old, new)}",
        f"give that arm's file with --arm; or, if this is the arm on the board "
        f"now, 'armtempo configure' or --replace-arm sets the board up for it, {consequence(old, new)}",
    )


def home(client: Client, arm: Arm, angles_deg: ArrayLike | None = None) -> None:
    """Declare the arm's position: ``angles_deg`` (J,), or the arm file's home posture.

    Raises InputError for a posture that does not fit the arm, BoardError during a motion.
    """
    posture = point_to_point.posture(arm.home_deg if angles_deg is None else angles_deg, arm)
    client.home(arm.transmission.whole_steps(posture))


def home_unknown(client: Client, arm: Arm) -> None:
    """Declare that every joint whose position is unknown is at home."""
    status = client.status()
    known = known_joints(status, arm)
    if all(known):
        return
    _declare_home(client, arm, ~np.array(known))


def home_joint(client: Client, arm: Arm, joint: int) -> None:
    """Declare that a joint, from 0, and those that are coupled with it are at home; the others stay as they are."""
    _declare_home(client, arm, np.isin(np.arange(len(arm.driven)), arm.transmission.group(joint)))


def _declare_home(client: Client, arm: Arm, chosen: NDArray[np.bool_]) -> None:
    """Declare that joints, (J,), are at home, by all motors that turn them."""
    here = arm.transmission.angles_of_steps(client.status().positions.commanded_steps)
    wanted = arm.transmission.whole_steps(np.where(chosen, arm.home_deg, here))
    turned = (arm.transmission.matrix != 0.0) @ chosen
    client.home([steps if moved else None for steps, moved in zip(wanted, turned, strict=True)])


def known_joints(status: Status, arm: Arm) -> list[bool]:
    """Whether the position of each driven joint is known: that of every motor that turns it."""
    return arm.transmission.known(status.joint_known(motor) for motor in range(len(arm.driven)))


def posture_deg(client: Client, arm: Arm) -> Array:
    """Joint angles from the commanded steps, degrees (J,), within the ranges as far as steps can tell.

    Raises LinkError if a position is unknown.
    """
    return angles_deg(known_status(client, arm), arm)


def known_status(client: Client, arm: Arm) -> Status:
    """The status; LinkError if a position is unknown."""
    status = client.status()
    known = known_joints(status, arm)
    unknown = [joint.name for joint, is_known in zip(arm.driven, known, strict=True) if not is_known]
    if unknown:
        raise LinkError(
            f"the position of {', '.join(unknown)} is unknown",
            "move the arm to its home posture and run 'armtempo home'",
        )
    return status


def angles_deg(status: Status, arm: Arm) -> Array:
    """Joint angles by the motors' steps, (J,), as ``posture_deg``; also of joints whose position is unknown."""
    steps = status.positions.commanded_steps
    # the end of a range may lie between two steps
    if arm.coupling:
        return _coupled_angles_deg(steps, arm)
    angles = arm.transmission.angles_of_steps(steps)
    return np.array(
        [joint.placed(angle, _HALF_STEP) for joint, angle in zip(arm.driven, angles, strict=True)]
    )


def is_at(client: Client, arm: Arm, target_deg: Array) -> bool:
    """Whether every motor is within half a step of ``target_deg`` (J,); raises LinkError if a position is unknown."""
    return stands_at(known_status(client, arm), arm, target_deg)


def stands_at(status: Status, arm: Arm, target_deg: Array) -> bool:
    """As ``is_at``, by a ``known_status``."""
    gears = arm.transmission
    if arm.coupling:  # several postures within the ranges may have the same whole steps
        off_steps = gears.steps(target_deg) - status.positions.commanded_steps
        return bool(np.all(np.abs(off_steps) <= _HALF_STEP))
    return bool(np.all(np.abs(gears.steps(angles_deg(status, arm) - target_deg)) <= 0.5))


def _coupled_angles_deg(steps: tuple[int, ...], arm: Arm) -> Array:
    """The joints' angles within their ranges, unless the motors say that they are beyond them by more than rounding."""
    low, high = np.array([joint.range_deg for joint in arm.driven]).T
    found = arm.transmission.within(steps, low, high)
    if np.all(np.abs(arm.transmission.steps(found) - steps) <= _HALF_STEP):
        return found
    return arm.transmission.angles_of_steps(steps)


def difference(old: bytes, new: bytes) -> str:
    """Describe the differences between the new and the old record."""
    try:
        (old_head, old_joints, _), (new_head, new_joints, _) = armrecord.unpack(old), armrecord.unpack(new)
        wiring = [*zip(armrecord.unpack_outputs(old), armrecord.unpack_outputs(new), strict=True)]
        wiring.append((armrecord.unpack_backlash(old), armrecord.unpack_backlash(new)))
    except armrecord.ArmRecordError:
        return "the board's record is of another version"
    if len(old_joints) != len(new_joints):
        return f"it has {len(new_joints)} driven joints, the board's arm {len(old_joints)}"
    found = [_describe_change(old_head, new_head)]
    for number, rows in enumerate(zip(old_joints, new_joints, strict=True), 1):
        words = _describe_change(*rows)
        found.append(f"joint {number}: {words}" if words else "")
    found += [
        what
        for what, (before, after) in zip(("outputs", "inputs", "backlash"), wiring, strict=True)
        if before != after
    ]
    return "other " + "; ".join(filter(None, found))


def consequence(old: bytes, new: bytes) -> str:
    """Describe the consequences for the position and stored motions if the new record replaces the old one."""
    try:
        (old_head, old_joints, _), (new_head, new_joints, _) = armrecord.unpack(old), armrecord.unpack(new)
    except armrecord.ArmRecordError:
        return _LOSES
    same = armrecord.without_limits(old_head, old_joints) == armrecord.without_limits(new_head, new_joints)
    return _KEEPS if same else _LOSES


def _describe_change(old: dict[str, int], new: dict[str, int]) -> str:
    return ", ".join(dict.fromkeys(_WORDS.get(key, key) for key in old if old[key] != new[key]))
