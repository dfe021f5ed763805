"""Checks before the start of a sequence: everything that it names exists, and each motion begins at the end
of the one before.
"""

from armtempo_shared import codes, sequence
from armtempo_shared.messages import SEQUENCE
from armtempo_shared.motion import MotionError
from armtempo_shared.sequence import SequenceError
from armtempo_shared.sequence_check import check

from armtempo_board.app.sequence_ahead import AheadSequencer
from armtempo_board.app.sequencer import Sequencer
from armtempo_board.errors import Refused
from armtempo_board.motion import endpoints

TYPE_CHECKING = False
if TYPE_CHECKING:
    from armtempo_board.app.sequencer import Runner
    from armtempo_board.storage.sequence_file import SequenceFile

_NONE = -1


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
        ends = [_Ends(controller, record, index) for index in range(record.motions)]
    except (MotionError, SequenceError):
        raise Refused(codes.BAD_RECORD)
    _check_rows(controller, record, ends)
    kind = Sequencer if controller.board.engine_memory.is_short else AheadSequencer
    return kind(controller, record, name.encode(), rate)


class _Ends:
    """Start and end of a motion, and the arm's distance (``away``) from its start."""

    def __init__(self, controller: "Runner", record: "SequenceFile", index: int) -> None:
        name, crc = record.motion(index)
        try:
            motion = controller.load(name, crc)
        except Refused as refused:
            is_missing = refused.code in (codes.NOT_FOUND, codes.BAD_CHECKSUM, codes.IS_SEQUENCE)
            code = codes.LEG_MISSING if is_missing else refused.code
            raise Refused(code, refused.joint, index + 1)
        joints = range(motion.joints)
        self.first = [endpoints.at_start(motion, joint) for joint in joints]
        self.last = [endpoints.at_end(motion, joint) for joint in joints]
        self.away = [
            endpoints.start_offset(motion, joint, controller.board.engine.commanded(joint))
            for joint in joints
        ]

    def check_follows(self, before: "_Ends", step: int) -> None:
        """Raise Refused if its start differs from the end of ``before`` by more than 1/64 step (rounding)."""
        for joint, start in enumerate(self.first):
            if abs(start - before.last[joint]) > 1:
                raise Refused(codes.LEG_ELSEWHERE, joint, step)


def _check_rows(controller: "Runner", record: "SequenceFile", ends: "list[_Ends]") -> None:
    last = _NONE  # the last motion
    firsts: "list[int]" = []  # the first motion in each repeat that has begun
    board = controller.board
    outputs = len(board.outputs.values) if board.outputs else 0
    inputs = board.inputs.count if board.inputs else 0
    for index in range(record.rows):
        op, number, _, _, step = record.row(index)
        if op == sequence.MOVE:
            if last == _NONE:
                for joint, away in enumerate(ends[number].away):
                    if away:  # the arm is not at the start
                        raise Refused(codes.WRONG_START, joint, away)
            else:
                ends[number].check_follows(ends[last], step)
            last = number
            firsts = [number if first == _NONE else first for first in firsts]
        elif op == sequence.REPEAT:
            firsts.append(_NONE)
        elif op == sequence.END:
            first = firsts.pop()
            if first != _NONE:
                ends[first].check_follows(ends[last], step)
        elif (op == sequence.OUTPUT and number >= outputs) or (
            op == sequence.WAIT_INPUT and number >= inputs
        ):
            raise Refused(codes.NO_SUCH_PIN, value=step)
