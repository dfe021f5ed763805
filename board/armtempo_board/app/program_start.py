"""Checks before the start of a user's program: it is for this arm, and there is heap for it."""

import gc

from armtempo_shared import codes, program
from armtempo_shared.messages import PROGRAM

from armtempo_board.app.user_program import UserProgram
from armtempo_board.errors import Refused

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any


def user_program(controller: "Any", name: str, crc: "int | None", rate: int) -> UserProgram:
    """The program ``name``, which the main loop executes; raises Refused.

    ``crc`` as for ``Controller.begin``.
    """
    record = controller.board.store().opened(name, PROGRAM)
    if crc is not None and record.crc != crc:
        raise Refused(codes.BAD_CHECKSUM)
    if record.arm_crc != controller.board.arm_crc:
        raise Refused(codes.ARM_MISMATCH)
    controller.board.once.take_memory()  # a sequence may have released it
    if hasattr(gc, "mem_free"):
        gc.collect()
        missing = program.needed_bytes(record.source_bytes) - gc.mem_free()
        if missing > 0:
            raise Refused(codes.NO_SEQUENCE_MEMORY, value=missing)
    try:
        found = UserProgram(controller, record, name.encode(), rate)
    except ValueError:
        raise Refused(codes.BAD_RECORD)
    if not found.table.get("homing"):  # absent in a record of an older host
        controller.check_homed()
    return found
