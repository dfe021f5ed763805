"""The arm record: the arm's data for the board, in steps, counts and ticks.

The host makes it from the arm file; the board stores it in its flash. A motion record identifies its arm by this
record's crc32. Little endian: the header, an entry for each joint, the crc32 of everything before it. The record of an
arm with outputs or inputs has another version; after its joints are the numbers of outputs and inputs (a byte each) and
their entries. The record of an arm with backlash has a third version: after those numbers and entries, an entry of the
backlash for each joint.
"""

import struct
from binascii import crc32

from armtempo_shared.limits import MAX_INPUTS, MAX_JOINTS, MAX_OUTPUTS

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    Rows = Sequence[dict[str, int]]
    Fields = Sequence[tuple[str, str]]

MAGIC = b"ATA1"
NONE = 255
"""Channel number: none."""
POLLED = 128
"""Instead of a limit switch input: this plus a pin as in OUTPUT; its switch only ends homing motions."""

HEAD = (
    ("flags", "H"),  # see the FLAG_ constants
    ("pulse_ticks", "H"),  # STEP high time
    ("low_ticks", "H"),  # least STEP low time
    ("dir_setup_ticks", "H"),  # DIR stable before the rising STEP edge
    ("dir_hold_ticks", "H"),  # DIR stable after the falling STEP edge
    (
        "link_timeout_ms",
        "H",
    ),  # time without a message from the host during a motion: see FLAG_STOP_ON_LINK_LOSS
    ("identity", "I"),  # hash of geometry, motors, encoders and switches, without limits
)
FLAG_ENABLE_HIGH = 1  # ENABLE pin is active high
FLAG_ESTOP_RELEASES = 2  # an E-stop also releases ENABLE
FLAG_STOP_ON_LINK_LOSS = 4  # brake when the host no longer answers; otherwise finish the motion
FLAG_ESTOP_ACTIVE_HIGH = 8  # E-stop input trips when high (else when low)
FLAG_ESTOP_FITTED = 16
FLAG_POWER_UP = 32  # the default starts by itself at power-up, if it is a program that homes the arm

JOINT = (
    ("channel", "B"),  # STEP/DIR channel, 0 to 5
    ("dir_inverted", "B"),
    ("encoder", "B"),  # encoder channel, 0 to 3, or NONE
    ("encoder_inverted", "B"),
    ("counts_num", "i"),  # encoder counts = steps * counts_num / counts_den
    ("counts_den", "i"),
    ("min_steps", "i"),  # the joint's range
    ("max_steps", "i"),
    ("max_rate", "I"),  # steps/s
    ("following_counts", "I"),  # largest |encoder - command|; 0: not watched
    ("limit_low", "B"),  # limit switch at the low end: input 0 to 2, POLLED and a pin, or NONE
    ("limit_high", "B"),
    ("limit_active_high", "B"),
    ("spare", "B"),
)
OUTPUT = (
    ("pin", "B"),  # 16 * port + number in it; port A is 0
    ("timer", "B"),  # 0: on and off, without a timer
    ("channel", "B"),  # of the timer, 1 to 4
    ("spare", "B"),
    ("prescaler", "H"),
    ("period", "H"),  # value of the period register
    ("low", "H"),  # pulse width in counts of the timer, or level of the pin, at value 0,
    ("high", "H"),  # and at value 65535
    ("safe", "H"),  # value at the start, at a fault, and when the program ends
)
INPUT = (
    ("pin", "B"),
    ("active_high", "B"),
    ("debounce_ms", "H"),
)
BACKLASH = (
    ("steps", "H"),  # of the motor, that turn only the motor after a reversal; 0: none
    ("on_motor", "B"),  # the encoder is on the motor, so that it counts these steps
    ("spare", "B"),
    # the n-th of them comes 64 * pace * sqrt(n) ticks after the reversal, until half of them are made
    ("pace", "I"),
)


def _layout(fields: "Fields") -> str:
    return "<" + "".join([kind for _, kind in fields])


_HEAD_FORMAT = "<4sBB" + "".join(kind for _, kind in HEAD)
_HEAD_SIZE = struct.calcsize(_HEAD_FORMAT)
_JOINT_SIZE = struct.calcsize(_layout(JOINT))
_OUTPUT_SIZE = struct.calcsize(_layout(OUTPUT))
_INPUT_SIZE = struct.calcsize(_layout(INPUT))
_BACKLASH_SIZE = struct.calcsize(_layout(BACKLASH))
VERSION = 2
VERSION_WITH_OUTPUTS = 3
"""Version of a record with outputs or inputs."""
VERSION_WITH_BACKLASH = 4
"""Version of a record with a joint with backlash, and perhaps outputs or inputs."""
_VERSION_AT, _JOINTS_AT = 4, 5
_LIMITS = ("min_steps", "max_steps", "max_rate", "following_counts", "link_timeout_ms")
"""Fields that do not affect the joints' positions, as FLAG_STOP_ON_LINK_LOSS and FLAG_POWER_UP."""


class ArmRecordError(ValueError):
    """The record is damaged or of another version."""


def pack(
    head: "dict[str, int]",
    joints: "list[dict[str, int]]",
    outputs: "Rows" = (),
    inputs: "Rows" = (),
    backlash: "Rows" = (),
) -> bytes:
    """An arm record from a dict of the HEAD fields and dicts of the JOINT, OUTPUT and INPUT fields.

    ``backlash``: dicts of the BACKLASH fields, one for each joint, or none.
    """
    version = VERSION_WITH_OUTPUTS if outputs or inputs else VERSION
    if backlash:
        version = VERSION_WITH_BACKLASH
    data = struct.pack(_HEAD_FORMAT, MAGIC, version, len(joints), *[head[name] for name, _ in HEAD])
    data += _packed(joints, JOINT)
    if version != VERSION:
        data += bytes((len(outputs), len(inputs)))
        data += _packed(outputs, OUTPUT) + _packed(inputs, INPUT) + _packed(backlash, BACKLASH)
    return data + struct.pack("<I", crc32(data))


def _packed(rows: "Rows", fields: "Fields") -> bytes:
    layout = _layout(fields)
    return b"".join([struct.pack(layout, *[row[name] for name, _ in fields]) for row in rows])


def without_limits(head: "dict[str, int]", joints: "list[dict[str, int]]") -> int:
    """crc32 without the limits: equal for records of the same arm with different limits."""
    rows = [dict(head)] + [dict(joint) for joint in joints]
    rows[0]["flags"] &= ~(FLAG_STOP_ON_LINK_LOSS | FLAG_POWER_UP)
    for row in rows:
        for name in _LIMITS:
            row.pop(name, 0)
    crc = 0
    for row in rows:
        for name in sorted(row):
            crc = crc32(struct.pack("<I", row[name] & 0xFFFFFFFF), crc)
    return crc


def unpack(data: bytes) -> "tuple[dict[str, int], list[dict[str, int]], int]":
    """(head dict, list of joint dicts, crc32) of an arm record; raises ArmRecordError if it is none."""
    if len(data) < _HEAD_SIZE + 4:
        raise ArmRecordError("too short")
    values = struct.unpack_from(_HEAD_FORMAT, data, 0)
    count = values[2]
    versions = VERSION, VERSION_WITH_OUTPUTS, VERSION_WITH_BACKLASH
    if values[0] != MAGIC or values[1] not in versions or not 1 <= count <= MAX_JOINTS:
        raise ArmRecordError("not an arm record of this version")
    if len(data) != _size(data, count):
        raise ArmRecordError("length does not fit the header")
    crc = struct.unpack_from("<I", data, len(data) - 4)[0]
    if crc32(memoryview(data)[:-4]) != crc:
        raise ArmRecordError("checksum")
    head = dict(zip([name for name, _ in HEAD], values[3:]))
    return head, _rows(data, _HEAD_SIZE, count, JOINT), crc


def unpack_outputs(data: bytes) -> "tuple[list[dict[str, int]], list[dict[str, int]]]":
    """Dicts of the outputs and of the inputs of a valid arm record."""
    at = _HEAD_SIZE + data[_JOINTS_AT] * _JOINT_SIZE
    if data[_VERSION_AT] == VERSION:
        return [], []
    inputs_at = at + 2 + data[at] * _OUTPUT_SIZE
    return _rows(data, at + 2, data[at], OUTPUT), _rows(data, inputs_at, data[at + 1], INPUT)


def unpack_backlash(data: bytes) -> "list[dict[str, int]]":
    """Dicts of the backlash of each joint in a valid arm record; [] if no joint has any."""
    if data[_VERSION_AT] != VERSION_WITH_BACKLASH:
        return []
    joints = data[_JOINTS_AT]
    return _rows(data, len(data) - 4 - joints * _BACKLASH_SIZE, joints, BACKLASH)


def backlash_count(rows: "Rows") -> int:
    """How many joints have backlash, by ``unpack_backlash``."""
    return sum([row["steps"] > 0 for row in rows])


def _size(data: bytes, joints: int) -> int:
    """Size of the record that begins with ``data``, in bytes; 0 if it is none."""
    size = _HEAD_SIZE + joints * _JOINT_SIZE + 4
    if data[_VERSION_AT] == VERSION:
        return size
    if len(data) < size + 2 or data[size - 4] > MAX_OUTPUTS or data[size - 3] > MAX_INPUTS:
        return 0
    outputs, inputs = data[size - 4], data[size - 3]
    if data[_VERSION_AT] == VERSION_WITH_BACKLASH:
        size += joints * _BACKLASH_SIZE
    return size + 2 + outputs * _OUTPUT_SIZE + inputs * _INPUT_SIZE


def _rows(data: bytes, at: int, count: int, fields: "Fields") -> "list[dict[str, int]]":
    layout = _layout(fields)
    size = struct.calcsize(layout)
    names = [name for name, _ in fields]
    return [dict(zip(names, struct.unpack_from(layout, data, at + row * size))) for row in range(count)]
