"""Error messages for the board's refusals and faults."""

from __future__ import annotations

from armtempo_shared import wire
from armtempo_shared.limits import MAX_JOINTS, MAX_MOTION_BYTES
from armtempo_shared.meanings import VALUES

from armtempo.basics.errors import BoardError

_FASTER_JOINT = "the motion is faster than the joint's speed limit in the arm file that the board has"
_FASTER_TOGETHER = "the joints together need more steps per second than the board can make"


def refusal(what: str, code: int, joint: int = 255, value: int = 0) -> BoardError:
    """A BoardError with the text of an error or fault code; ``joint``: from 0, or 255 for none."""
    name, meaning, cure = wire.ERRORS.get(
        code, ("", f"error {code}, unknown to this version", "update armtempo")
    )
    where = f" (joint {joint + 1})" if joint < MAX_JOINTS else ""
    if name == "too_fast":
        meaning = _FASTER_JOINT if where else _FASTER_TOGETHER
    detail = f" [{_describe_detail(name, where, value)}]" if value or name == "pin_taken" else ""
    return BoardError(f"{what}: {meaning}{where}{detail}", cure, code)


def describe_fault(name: str) -> str:
    """Meaning and cure of a fault, by its name; the name itself if this version does not know it."""
    found = (f"{meaning}: {cure}" for known, meaning, cure in wire.ERRORS.values() if known == name)
    return next(found, name)


def describe_notice(text: str) -> str:
    """A text that the board sent; the code of a start that it refused ("button: error 19") in words."""
    by, found, code = text.partition(": error ")
    if not found or not code.isdigit() or int(code) not in wire.ERRORS:
        return text
    _, meaning, cure = wire.ERRORS[int(code)]
    return f"{by}: {meaning}; {cure}"


def _describe_detail(name: str, where: str, value: int) -> str:
    if name == "too_long" and where:
        return f"its numbers reach {value}"
    if name == "too_long":
        return f"it takes {MAX_MOTION_BYTES} bytes at most"
    if name == "pin_taken":
        return _pin(value)
    return f"{VALUES[name]}: {value}" if name in VALUES else str(value)


def _pin(value: int) -> str:
    """The name of a pin of the arm record, and its use on the board."""
    from armtempo.model import engine_pins  # imported here, because it reads the board program's table

    pin = f"P{chr(ord('A') + value // 16)}{value % 16}"
    uses = engine_pins.uses(pin)
    return (
        f"{pin}: {', '.join(uses)}"
        if uses
        else f"{pin}: it, or its timer, has another output or input already"
    )
