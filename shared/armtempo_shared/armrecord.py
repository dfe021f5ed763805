"""The arm record: the arm's figures for the board, in steps, counts and ticks only.

The host makes it from the arm file; the board keeps it in its flash. A motion record names its arm by this
record's crc32.
Little endian: the header, then one entry a joint, then the crc32 over all before it.
"""

import struct
from binascii import crc32

from armtempo_shared.limits import MAX_JOINTS

MAGIC = b"ATA1"
NONE = 255
"""Channel number that means: this joint has no such thing."""

HEAD = (
    ("flags", "H"),  # see the FLAG_ constants
    ("pulse_ticks", "H"),  # STEP high time
    ("low_ticks", "H"),  # least STEP low time
    ("dir_setup_ticks", "H"),  # DIR stable before the rising STEP edge
    ("dir_hold_ticks", "H"),  # DIR stable after the falling STEP edge
    ("link_timeout_ms", "H"),  # after this silence of the host while moving: see FLAG_STOP_ON_LINK_LOSS
    ("identity", "I"),  # hash of the arm's geometry, motors, encoders and switches: of all but its limits
)
FLAG_ENABLE_HIGH = 1  # ENABLE pin is active high
FLAG_ESTOP_RELEASES = 2  # an E-stop also releases ENABLE
FLAG_STOP_ON_LINK_LOSS = 4  # brake when the host disappears; otherwise finish the motion
FLAG_ESTOP_ACTIVE_HIGH = 8  # E-stop input trips when high (else when low)
FLAG_ESTOP_FITTED = 16

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
    ("limit_low", "B"),  # limit switch input at the low end, 0 to 2, or NONE
    ("limit_high", "B"),
    ("limit_active_high", "B"),
    ("spare", "B"),
)
_HEAD_FORMAT = "<4sBB" + "".join(kind for _, kind in HEAD)
_JOINT_FORMAT = "<" + "".join(kind for _, kind in JOINT)
_HEAD_SIZE = struct.calcsize(_HEAD_FORMAT)
_JOINT_SIZE = struct.calcsize(_JOINT_FORMAT)
VERSION = 2
_LIMITS = ("min_steps", "max_steps", "max_rate", "following_counts", "link_timeout_ms")
"""Fields that may change without any doubt about where the joints are; beside them FLAG_STOP_ON_LINK_LOSS."""


class ArmRecordError(ValueError):
    """The record is damaged or of another version."""


def pack(head: "dict[str, int]", joints: "list[dict[str, int]]") -> bytes:
    """An arm record from a dict of the HEAD fields and a list of dicts of the JOINT fields."""
    data = struct.pack(_HEAD_FORMAT, MAGIC, VERSION, len(joints), *[head[name] for name, _ in HEAD])
    for joint in joints:
        data += struct.pack(_JOINT_FORMAT, *[joint[name] for name, _ in JOINT])
    return data + struct.pack("<I", crc32(data))


def without_limits(head: "dict[str, int]", joints: "list[dict[str, int]]") -> int:
    """crc32 of all but the limits: two records with the same one are of one arm, with other limits at most."""
    rows = [dict(head)] + [dict(joint) for joint in joints]
    rows[0]["flags"] &= ~FLAG_STOP_ON_LINK_LOSS
    for row in rows:
        for name in _LIMITS:
            row.pop(name, 0)
    crc = 0
    for row in rows:
        for name in sorted(row):
            crc = crc32(struct.pack("<I", row[name] & 0xFFFFFFFF), crc)
    return crc


def unpack(data: bytes) -> "tuple[dict[str, int], list[dict[str, int]], int]":
    """(head dict, list of joint dicts, crc32) of an arm record; ArmRecordError where it is not one."""
    if len(data) < _HEAD_SIZE + 4:
        raise ArmRecordError("too short")
    values = struct.unpack_from(_HEAD_FORMAT, data, 0)
    count = values[2]
    if values[0] != MAGIC or values[1] != VERSION or not 1 <= count <= MAX_JOINTS:
        raise ArmRecordError("not an arm record of this version")
    if len(data) != _HEAD_SIZE + count * _JOINT_SIZE + 4:
        raise ArmRecordError("length does not fit the header")
    crc = struct.unpack_from("<I", data, len(data) - 4)[0]
    if crc32(memoryview(data)[:-4]) != crc:
        raise ArmRecordError("checksum")
    head = dict(zip([name for name, _ in HEAD], values[3:]))
    joints = []
    for index in range(count):
        values = struct.unpack_from(_JOINT_FORMAT, data, _HEAD_SIZE + index * _JOINT_SIZE)
        joints.append(dict(zip([name for name, _ in JOINT], values)))
    return head, joints, crc
