"""Checks before the start of a sequence: everything that it names exists, and each motion begins at the end
of the one before.
"""

from array import array

from armtempo_shared import codes, sequence
from armtempo_shared.messages import SEQUENCE
from armtempo_shared.motion import MotionError
from armtempo_shared.sequence import SequenceError
from armtempo_shared.sequence_check import check
from micropython import const

from armtempo_board.app.sequence_ahead import AheadSequencer
from armtempo_board.app.sequencer import Sequencer
from armtempo_board.errors import Refused
from armtempo_board.motion import endpoints

TYPE_CHECKING = False
if TYPE_CHECKING:
    from armtempo_shared.motion import MotionHead

    from armtempo_board.app.sequencer import Runner
    from armtempo_board.storage.sequence_file import SequenceFile

_NONE = const(-1)  # no motion so far
_ONCE = const(-2)  # of a repeat of one pass, which need not lead back to its start
_64TH = const(0x3FFFFFFF)  # positions in 1/64 step are compared modulo 2**30, which are small integers


def sequencer(controller: "Runner", name: str, crc: "int | None", rate: int) -> Sequencer:
    """The sequence ``name``, ready for its first row; raises Refused.

    ``crc`` as for ``Controller.begin``.
    """
    record = controller.board.store().opened(name, SEQUENCE)
    if crc is not None and record.crc != crc:
        raise Refused(codes.BAD_CHECKSUM)
    if record.arm_crc != controller.board.arm_crc:
        raise Refused(codes.ARM_MISMATCH)
    try:
        check(record)
        ends = [_ends(_loaded(controller, record, index)) for index in range(record.motions)]
    except (MotionError, SequenceError):
        raise Refused(codes.BAD_RECORD)
    _check_rows(controller, record, ends)
    kind = Sequencer if controller.board.engine_memory.is_short else AheadSequencer
    return kind(controller, record, name.encode(), rate)


def _loaded(controller: "Runner", record: "SequenceFile", index: int) -> "MotionHead":
    name, crc = record.motion(index)
    try:
        return controller.load(name, crc)
    except Refused as refused:
        is_missing = refused.code in (codes.NOT_FOUND, codes.BAD_CHECKSUM, codes.IS_SEQUENCE)
        code = codes.LEG_MISSING if is_missing else refused.code
        raise Refused(code, refused.joint, index + 1)


def _ends(motion: "MotionHead") -> "array[int]":
    """Start of each joint, then end of each."""
    joints = range(motion.joints)
    found = [endpoints.at_start(motion, joint) & _64TH for joint in joints]
    return array("i", found + [endpoints.at_end(motion, joint) & _64TH for joint in joints])


def _check_follows(ends: "array[int]", before: "array[int]", step: int) -> None:
    """Raise Refused if the start differs from the end of ``before`` by more than 1/64 step (rounding)."""
    joints = len(ends) // 2
    for joint in range(joints):
        if (ends[joint] - before[joints + joint] + 1) & _64TH > 2:
            raise Refused(codes.LEG_ELSEWHERE, joint, step)


def _check_start(controller: "Runner", motion: "MotionHead") -> None:
    """Raise Refused if the arm is not at the start of a motion."""
    for joint in range(motion.joints):
        away = endpoints.start_offset(motion, joint, controller.board.engine.commanded(joint))
        if away:
            raise Refused(codes.WRONG_START, joint, away)


def _check_rows(controller: "Runner", record: "SequenceFile", ends: "list[array[int]]") -> None:
    last = _NONE  # the last motion
    firsts: "list[int]" = []  # the first motion in each repeat that has begun
    board = controller.board
    outputs = len(board.outputs.values) if board.outputs else 0
    inputs = board.inputs.count if board.inputs else 0
    for index in range(record.rows):
        op, number, _, amount, step = record.row(index)
        if op == sequence.MOVE:
            if last == _NONE:
                _check_start(controller, _loaded(controller, record, number))
            else:
                _check_follows(ends[number], ends[last], step)
            last = number
            firsts = [number if first == _NONE else first for first in firsts]
        elif op == sequence.REPEAT:
            firsts.append(_ONCE if amount == 1 else _NONE)
        elif op == sequence.END:
            first = firsts.pop()
            if first >= 0:
                _check_follows(ends[first], ends[last], step)
        elif (op == sequence.OUTPUT and number >= outputs) or (
            op == sequence.WAIT_INPUT and number >= inputs
        ):
            raise Refused(codes.NO_SUCH_PIN, value=step)
