"""Checks an arm record and makes the engine for it, or refuses it.

Store, check and engine never need memory at the same time.
"""

import gc
from array import array

from armtempo_shared import armrecord, codes
from armtempo_shared.messages import ARM_RECORD_NAME
from pyb import Pin, Timer

from armtempo_board import features
from armtempo_board.app import memory_shares
from armtempo_board.app.board import NEVER_MS
from armtempo_board.buffers import COMMANDED
from armtempo_board.errors import Refused
from armtempo_board.motion import arm_check
from armtempo_board.storage import store

TYPE_CHECKING = False
if TYPE_CHECKING:
    from armtempo_board.app.board import Board
    from armtempo_board.motion.arm_check import Record


def take_stored(board: "Board") -> None:
    """Use the stored arm record; without one, or if it is invalid, the board stays unconfigured.

    An invalid record does not keep the program from starting: ``arm_problem`` says what is wrong.
    """
    board.arm_record_pending = False
    board.arm_problem = board.arm_value = 0
    try:
        _take(board, _checked(board, _stored(board)))
    except Refused as refused:
        if refused.code != codes.NOT_FOUND:
            board.arm_problem, board.arm_value = refused.code, refused.value
    except Exception as error:
        _drop_engine(board)
        board.arm_problem = codes.NO_MEMORY if isinstance(error, MemoryError) else codes.FAILED


def take_new(board: "Board") -> None:
    """Use the uploaded arm record; if it is invalid, raises Refused and keeps the present one."""
    board.arm_record_pending = False
    try:
        record = _checked(board, _new(board))
    except Refused:
        _decide(board, False)
        raise
    _decide(board, True)
    board.arm_problem = board.arm_value = 0
    try:
        _take(board, record)
    except Exception:
        _drop_engine(board)
        raise


def _stored(board: "Board") -> bytes:
    try:
        return bytes(board.store().read(ARM_RECORD_NAME))
    finally:
        board.forget_store()


def _new(board: "Board") -> bytes:
    try:
        return bytes(board.store().new_arm())
    finally:
        board.drop_store()


def _decide(board: "Board", is_fit: bool) -> None:
    store.Store(board.root, recover=False).take_arm(is_fit)


def _checked(board: "Board", data: bytes) -> "Record":
    """The unpacked arm record; raises Refused if it is invalid."""
    return arm_check.checked(data, board.engine_memory.size)


def _take(board: "Board", record: "Record") -> None:
    head, joints, crc, outputs, inputs, backlash = record
    if crc == board.arm_crc:
        return
    all_but_limits, stops = _facts(record)
    if features.BACKLASH:
        sides = []
    known, steps = 0, []
    if board.engine and all_but_limits == board.all_but_limits:  # the same arm: positions stay known
        known = board.engine.known
        steps = [board.engine.commanded(joint) for joint in range(board.joints)]
        if features.BACKLASH:  # noqa: SIM102  the core is without what is behind a constant alone
            if backlash:
                from armtempo_board.motion import backlash_drive  # here, as few arms need its memory

                sides = backlash_drive.sides(board.engine.drives)
    _drop_engine(board)
    memory_shares.resize(board.engine_memory, len(joints), armrecord.backlash_count(backlash))
    board.make_engine(head, joints, backlash)
    board.all_but_limits = all_but_limits
    if known:
        board.engine.home(known, steps)
        if features.BACKLASH:  # noqa: SIM102
            if sides:
                backlash_drive.take_sides(board.engine.drives, sides)
    if features.SEQUENCES:
        board.taken.clear()
        board.starts_alone = head["flags"] & armrecord.FLAG_POWER_UP
    board.silence_ms = head["link_timeout_ms"] if stops else NEVER_MS
    board.joints = len(joints)
    board.arm_crc = crc
    board.raw = array("i", [0] * (COMMANDED + 2 * board.joints))
    board.samples.configure(board.joints)
    if outputs or inputs:
        from armtempo_board.app import output_setup  # here, as few arms need its memory

        output_setup.attach(board, outputs, inputs)


def _facts(record: "Record") -> "tuple[int, int]":
    """The record's identity of the arm, and whether it stops if the host is silent."""
    head, joints, _, _, _, _ = record
    return armrecord.without_limits(head, joints), head["flags"] & armrecord.FLAG_STOP_ON_LINK_LOSS


def _drop_engine(board: "Board") -> None:
    """Drop the engine before another is made, so that the heap is as before the first."""
    if board.engine:
        board.engine.close()
    if board.outputs:
        drop_outputs(board)
    board.engine = None
    board.joints = board.arm_crc = 0
    board.samples.configure(0)
    board.raw = array("i", [0] * COMMANDED)
    gc.collect()


def drop_outputs(board: "Board") -> None:
    """Set outputs to their safe values, then release pins and timers."""
    outputs = board.outputs
    outputs.safe()
    for held in outputs.held:
        if isinstance(held, Timer):
            held.deinit()
        else:
            held.init(Pin.IN)
    board.outputs = board.inputs = None
    board.extra_commands.clear()
