"""Checks an arm record before the present one is released."""

from armtempo_shared import armrecord, codes, engine_memory
from armtempo_shared.limits import MAX_BACKLASH_STEPS, MAX_ENCODERS
from armtempo_shared.messages import NO_JOINT
from micropython import const

from armtempo_board import features
from armtempo_board.errors import Refused
from armtempo_board.hardware import pins

_LAST_TIMER = const(14)
_LONGEST_SQUARE = 1 << 44  # (2**28.5 ticks, 4.5 s, / 64)**2 / 2: the time to cross it is a small integer

TYPE_CHECKING = False
if TYPE_CHECKING:
    Rows = list[dict[str, int]]
    Record = tuple[dict[str, int], Rows, int, Rows, Rows, Rows]


def checked(data: bytes, free_bytes: int) -> "Record":
    """(head, joints, crc32, outputs, inputs, backlash) of an arm record, as ``armrecord`` unpacks them.

    ``free_bytes``: available for an engine. Raises Refused: BAD_RECORD if it is damaged, of another version,
    or names something that the board does not have; PIN_TAKEN if the pin or timer of an output, input or
    polled switch is in use; NO_ENGINE_MEMORY with the bytes needed.
    """
    try:
        head, joints, crc = armrecord.unpack(data)
    except armrecord.ArmRecordError:
        raise Refused(codes.BAD_RECORD)
    if not head["pulse_ticks"]:
        raise Refused(codes.BAD_RECORD)
    for number, row in enumerate(joints):
        if not _is_fit(row) or row["channel"] in [other["channel"] for other in joints[:number]]:
            raise Refused(codes.BAD_RECORD, number)
    outputs, inputs = armrecord.unpack_outputs(data)
    if (outputs or inputs) and not features.OUTPUTS:
        raise Refused(codes.NEEDS_FIRMWARE)
    _check_pins(head, joints, outputs, inputs)
    backlash = armrecord.unpack_backlash(data)
    if backlash and not features.BACKLASH:
        raise Refused(codes.NEEDS_FIRMWARE)
    for number, row in enumerate(backlash):
        if row["steps"] > MAX_BACKLASH_STEPS or row["steps"] * row["pace"] ** 2 > _LONGEST_SQUARE:
            raise Refused(codes.BAD_RECORD, number)
    rates = [row["max_rate"] for row in joints]
    with_backlash = armrecord.backlash_count(backlash)
    if not engine_memory.fits(rates, free_bytes, with_backlash):
        needed = engine_memory.needed_bytes(rates, with_backlash)
        raise Refused(codes.NO_ENGINE_MEMORY, NO_JOINT, needed)
    return head, joints, crc, outputs, inputs, backlash


def _is_fit(row: "dict[str, int]") -> bool:
    if row["channel"] >= len(pins.STEP) or row["min_steps"] > row["max_steps"] or row["counts_den"] < 1:
        return False
    if row["encoder"] >= MAX_ENCODERS and row["encoder"] != armrecord.NONE:
        return False
    return _is_switch(row["limit_low"]) and _is_switch(row["limit_high"])


def _is_switch(switch: int) -> bool:
    if switch < armrecord.POLLED:
        return switch < len(pins.LIMIT)
    return switch == armrecord.NONE or pins.name(switch - armrecord.POLLED) != ""


def _is_polled(switch: int) -> bool:
    return armrecord.POLLED <= switch < armrecord.NONE


def _check_pins(head: "dict[str, int]", joints: "Rows", outputs: "Rows", inputs: "Rows") -> None:
    """Check that pins and timers of outputs, inputs and polled switches are different, and not used by the engine."""
    switches = [row[side] for row in joints for side in ("limit_low", "limit_high")]
    polled = [{"pin": switch - armrecord.POLLED} for switch in switches if _is_polled(switch)]
    if not outputs and not inputs and not polled:
        return
    timers = [2, 5, 6]  # the counters of STEP, and the timer that fills their rings
    taken = ["", pins.ENABLE, pins.BUTTON] + list(pins.LEDS)
    if head["flags"] & armrecord.FLAG_ESTOP_FITTED:
        taken.append(pins.ESTOP)
    for row in joints:
        step, _, _, _, _, _ = pins.STEP[row["channel"]]
        taken += [step, pins.DIR[row["channel"]]]
        if row["encoder"] != armrecord.NONE:
            timer, first, second, _ = pins.ENCODER[row["encoder"]]
            taken += [first, second]
            timers.append(timer)
    taken += [pins.LIMIT[switch] for switch in switches if switch < armrecord.POLLED]
    for row in outputs + inputs + polled:
        name = pins.name(row["pin"])
        timer = row.get("timer", 0)
        if name in taken or timer in timers or timer > _LAST_TIMER:
            raise Refused(codes.PIN_TAKEN, NO_JOINT, row["pin"])
        taken.append(name)
