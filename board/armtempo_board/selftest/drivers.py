"""Whether the drivers are off: ENABLE against its level in the arm record."""

from armtempo_board.selftest.common import enable

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any


def measure(record: str) -> "dict[str, Any]":
    """``record``: file of the arm record."""
    active = None
    joints: "list[dict[str, int]]" = []
    try:
        with open(record, "rb") as file:
            data = file.read()
        from armtempo_shared import armrecord

        head, joints, _ = armrecord.unpack(data)
        active = 1 if head["flags"] & armrecord.FLAG_ENABLE_HIGH else 0
    except (OSError, ValueError):
        pass  # no arm
    output, driven, level = enable()
    return {
        "active": active,
        "output": output,
        "driven": driven,
        "level": level,
        "joints": joints,
    }
