"""Is an arm record fit to be taken? Judged before the one that is in force is let go."""

from armtempo_shared import armrecord, codes, engine_memory
from armtempo_shared.limits import MAX_ENCODERS
from armtempo_shared.messages import NO_JOINT

from armtempo_board.errors import Refused
from armtempo_board.hardware import pins

TYPE_CHECKING = False
if TYPE_CHECKING:
    Record = tuple[dict[str, int], list[dict[str, int]], int]


def checked(data: bytes, room_words: int, most_joints: int) -> "Record":
    """(head, joints, crc32) of an arm record, as ``armrecord.unpack`` gives them.

    ``room_words``, ``most_joints``: what an engine can have. Refused: BAD_RECORD where it is damaged, of another
    version, or names what the board has not; NO_ROOM with the bytes needed.
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
    rates = [row["max_rate"] for row in joints]
    if len(rates) > most_joints or not engine_memory.fits(rates, room_words):
        raise Refused(codes.NO_ROOM, NO_JOINT, 4 * engine_memory.words(rates))
    return head, joints, crc


def _is_fit(row: "dict[str, int]") -> bool:
    if row["channel"] >= len(pins.STEP) or row["min_steps"] > row["max_steps"] or row["counts_den"] < 1:
        return False
    for name, count in (
        ("encoder", MAX_ENCODERS),
        ("limit_low", len(pins.LIMIT)),
        ("limit_high", len(pins.LIMIT)),
    ):
        if row[name] >= count and row[name] != armrecord.NONE:
            return False
    return True
