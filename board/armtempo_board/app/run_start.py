"""Opens and checks a motion before a run; positions for homing motions. Unloaded before anything moves."""

import gc

from armtempo_shared import codes

from armtempo_board.buffers import COMMANDED
from armtempo_board.errors import Refused
from armtempo_board.motion import endpoints

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from armtempo_board.app.board import Board
    from armtempo_board.storage.motion_file import MotionFile


def opened(board: "Board", name: str, crc: "int | None") -> "MotionFile":
    """The stored motion, with head and checksum checked; raises Refused. ``crc``: see ``Controller.begin``."""
    store = board.store()
    gc.collect()  # objects that stay during the run should lie at low addresses
    return checked(board, store.motion(name), crc)


def checked(board: "Board", motion: "MotionFile", crc: "int | None") -> "MotionFile":
    """The motion; raises Refused if it is another than expected, or not for the board's arm."""
    if crc is not None and motion.crc != crc:
        raise Refused(codes.BAD_CHECKSUM)
    if motion.arm_crc != board.arm_crc:
        raise Refused(codes.ARM_MISMATCH)
    if motion.joints != board.joints:
        raise Refused(codes.WRONG_JOINTS, value=motion.joints)
    return motion


def assume(board: "Board", motion: "MotionFile", unknown: int) -> int:
    """Declare that the joints are at the start of a homing motion; returns those not known to be (one bit per joint).

    ``unknown``: joints of unknown position.
    """
    board.engine.snapshot(board.raw)
    for joint in range(board.joints):
        if endpoints.start_offset(motion, joint, board.raw[COMMANDED + joint]):
            unknown |= 1 << joint
    starts = [endpoints.start_offset(motion, joint, 0) for joint in range(board.joints)]
    home(board, unknown, starts)
    return unknown


def moving(motion: "MotionFile") -> int:
    """One bit per joint whose end position differs from its start."""
    found = 0
    for joint in range(motion.joints):
        if endpoints.at_start(motion, joint) != endpoints.at_end(motion, joint):
            found |= 1 << joint
    return found


def home(board: "Board", mask: int, steps: "Sequence[int]") -> None:
    """Declare where the joints of ``mask`` stand; ``steps`` has a number for every joint."""
    for joint in range(board.joints):
        row = board.engine.limits[joint]
        if mask >> joint & 1 and not row["min_steps"] <= steps[joint] <= row["max_steps"]:
            raise Refused(codes.OUT_OF_RANGE, joint, steps[joint])
    board.engine.home(mask, steps)
