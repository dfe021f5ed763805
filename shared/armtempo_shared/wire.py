"""The wire protocol: frame layout, message table, error codes. The only home of these facts.

A frame::

    0xA5 | length N (H) | sequence (B) | message id (B) | payload, N bytes | crc32 over length..payload (I)

little endian. A frame whose check fails is dropped and the search for 0xA5 goes on at the next byte;
nothing in it is acted on. The host sends commands; the board answers each with ``ok`` or ``error``
carrying the command's sequence number. A repeated sequence number is answered again from memory but
not acted on again. Events come from the board unasked, under their own sequence numbers.
"""

import struct
from binascii import crc32

PROTOCOL_VERSION = 1
SYNC = 0xA5
MAX_PAYLOAD = 512
OVERHEAD = 9
_HEAD = struct.calcsize("<HBB")

# Message table: name, id, fixed fields, tail ("" none, "text" UTF-8, "bytes"; the rest of the payload).
# Answers are listed behind their command: the payload of its ``ok``.
COMMANDS = (
    ("hello", 0x01, (("protocol", "B"), ("session", "I")), ""),
    ("status", 0x02, (), ""),
    ("put_begin", 0x10, (("size", "I"), ("crc", "I")), "text"),  # tail: name
    ("put_data", 0x11, (("offset", "I"),), "bytes"),
    ("put_commit", 0x12, (("crc", "I"),), ""),
    ("list", 0x13, (("index", "H"),), ""),  # the index-th stored trajectory
    ("remove", 0x14, (), "text"),
    ("rename", 0x15, (("old_length", "B"),), "text"),  # tail: old name, then new name
    ("get", 0x16, (("offset", "I"), ("length", "H")), "text"),  # read a stored record back
    ("set_default", 0x17, (), "text"),  # empty name: none
    ("home", 0x20, (("joints", "B"),), "bytes"),  # tail: i32 steps a joint: "here is this position"
    ("start", 0x21, (("flags", "B"), ("crc", "I")), "text"),  # crc of the record meant; START_ flags
    ("stop", 0x22, (("now", "B"),), ""),  # 0: brake along the path; 1: freeze
    ("clear", 0x23, (), ""),  # clear a fault
    ("samples", 0x30, (("acknowledged", "I"), ("wanted", "H")), ""),  # all before are received; resend
)
ANSWERS = (
    (
        "hello",
        0x01,
        (
            ("protocol", "B"),
            ("joints", "B"),  # of the arm record; 0: none configured
            ("encoders", "B"),
            ("state", "B"),
            ("tick_hz", "I"),
            ("max_rate", "I"),
            ("max_rate_sum", "I"),
            ("free_flash", "I"),
            ("free_heap", "I"),
            ("arm_crc", "I"),
            ("program_crc", "I"),
            ("boot", "I"),  # differs after every start of the board program
        ),
        "text",  # board id: unique id in hex, then firmware
    ),
    (
        "status",
        0x02,
        (
            ("state", "B"),
            ("fault", "B"),
            ("fault_joint", "B"),
            ("known", "B"),  # bit a joint: its position is known
            ("run", "I"),  # number of the current or last run since boot
            ("ticks", "Q"),  # motion clock
            ("samples_kept", "H"),
            ("samples_lost", "I"),
            ("frames_bad", "I"),
        ),
        "bytes",  # per joint: i32 commanded steps, i32 encoder counts
    ),
    ("put_begin", 0x10, (), ""),
    ("put_data", 0x11, (("next", "I"),), ""),
    ("put_commit", 0x12, (), ""),
    (
        "list",
        0x13,
        (("count", "H"), ("size", "I"), ("crc", "I"), ("duration", "Q"), ("joints", "B"), ("default", "B")),
        "text",
    ),
    ("remove", 0x14, (), ""),
    ("rename", 0x15, (), ""),
    ("get", 0x16, (("size", "I"),), "bytes"),
    ("set_default", 0x17, (), ""),
    ("home", 0x20, (), ""),
    ("start", 0x21, (("run", "I"), ("duration", "Q")), ""),
    ("stop", 0x22, (), ""),
    ("clear", 0x23, (), ""),
    ("samples", 0x30, (("first", "I"), ("count", "H")), ""),
)
EVENTS = (
    (
        "sample",
        0x40,
        # index counts from 0 in each run; ticks: the motion clock
        (("run", "I"), ("index", "I"), ("ticks", "Q"), ("flags", "B")),
        "bytes",  # per joint: i32 commanded steps, i32 encoder counts
    ),
    ("done", 0x41, (("run", "I"), ("ticks", "Q"), ("samples", "I"), ("lost", "I")), "bytes"),  # as in sample
    ("fault", 0x42, (("run", "I"), ("code", "B"), ("joint", "B"), ("ticks", "Q")), "bytes"),
    ("notice", 0x43, (), "text"),
)
REPLIES = (
    ("ok", 0x7E, (("command", "B"),), "bytes"),  # then the answer's payload
    ("error", 0x7F, (("command", "B"), ("code", "B"), ("joint", "B"), ("value", "q")), ""),
)
ARM_RECORD_NAME = "/arm"
"""put_begin with this name carries the arm record, not a trajectory."""

START_HOMING = 1  # a limit switch ends the motion without a fault
STATES = ("unconfigured", "unhomed", "idle", "moving", "braking", "fault")

# code: (name, what it means, what to do)
ERRORS = {
    1: ("unknown_command", "the board does not know this command", "run 'armtempo deploy'"),
    2: ("malformed", "the command's fields do not fit its message", "run 'armtempo deploy'"),
    3: ("protocol", "host and board speak different protocol versions", "run 'armtempo deploy'"),
    4: ("busy", "the board is moving", "wait for the end of the motion, or 'armtempo stop'"),
    5: ("not_moving", "nothing is moving", "no action needed"),
    6: ("fault_pending", "a fault is pending", "remove its cause, then 'armtempo clear'"),
    7: ("unconfigured", "the board has no arm record", "the host sends it when it connects; reconnect"),
    8: ("arm_mismatch", "the motion was planned for another arm file", "plan it again with this arm"),
    9: ("unhomed", "the position is unknown", "bring the arm to its posture and run 'armtempo home'"),
    10: ("not_found", "no trajectory of this name is stored", "see 'armtempo list'"),
    11: ("bad_name", "the name is empty, too long or has other characters than a-z A-Z 0-9 - _", "rename it"),
    12: ("flash_full", "the flash has no room; what was stored is kept", "'armtempo remove' something"),
    13: ("flash_error", "the flash could not be written or read", "see the recovery steps in the docs"),
    14: ("bad_record", "the record is damaged or of an unknown kind", "upload it again"),
    15: ("bad_offset", "a piece of the upload is out of order", "upload it again"),
    16: ("bad_checksum", "the upload does not match its checksum", "upload it again"),
    17: ("exists", "this name is taken", "remove it first"),
    18: ("wrong_joints", "the motion has another number of joints than the arm", "plan it for this arm"),
    19: ("time_order", "the time control points do not increase", "plan it again"),
    20: ("out_of_range", "the motion leaves the joint's range", "check the via points or the range"),
    21: ("too_fast", "the motion needs more steps per second than the board can make", "lower the limits"),
    22: ("wrong_start", "the arm does not stand where the motion begins", "'armtempo goto' its start"),
    23: ("too_long", "the motion is longer or larger than the board can hold", "split it"),
    24: ("too_abrupt", "the motion reverses too fast for the step generator", "lower the limits"),
    40: ("estop", "the E-stop input tripped", "release it, then 'armtempo clear' and home"),
    41: ("limit_switch", "a limit switch tripped", "clear, then move away from it"),
    42: ("following", "the encoder is too far from the command (stall or slip)", "find the cause, then home"),
    43: ("underrun", "the step ring ran dry", "report it; the position is known"),
    44: ("internal", "the board program failed", "report it with the log"),
    45: ("watchdog", "the watchdog restarted the board", "home again; report it"),
    46: ("link_lost", "the host disappeared during the motion", "reconnect"),
    47: ("start_failed", "the timers did not start as set up", "power-cycle the board"),
}
ERROR_CODES = {}
for _code, _row in ERRORS.items():
    ERROR_CODES[_row[0]] = _code


def _index(rows):
    by_name = {}
    by_id = {}
    for name, number, fields, tail in rows:
        entry = (name, number, "<" + "".join([kind for _, kind in fields]), [n for n, _ in fields], tail)
        by_name[name] = entry
        by_id[number] = entry
    return by_name, by_id


COMMAND, COMMAND_BY_ID = _index(COMMANDS)
ANSWER, ANSWER_BY_ID = _index(ANSWERS)
EVENT, EVENT_BY_ID = _index(EVENTS + REPLIES)


class WireError(ValueError):
    """A payload that does not fit its message."""


def encode(entry, values=(), tail=b""):
    """The payload of a message: ``entry`` from an index above, its field values in order, its tail."""
    if isinstance(tail, str):
        tail = tail.encode()
    return struct.pack(entry[2], *values) + tail


def decode(entry, payload):
    """(tuple of field values, tail) of a payload; WireError where it does not fit."""
    _, _, layout, _, kind = entry
    size = struct.calcsize(layout)
    if len(payload) < size or (not kind and len(payload) != size):
        raise WireError("length")
    tail = bytes(payload[size:])
    if kind == "text":
        try:
            tail = tail.decode()
        except UnicodeError:
            raise WireError("text") from None
    return struct.unpack_from(layout, payload, 0), tail


def frame(sequence, number, payload):
    """The bytes of one frame."""
    body = struct.pack("<HBB", len(payload), sequence, number) + payload
    return bytes((SYNC,)) + body + struct.pack("<I", crc32(body))


class Parser:
    """Finds frames in a byte stream; keeps what is incomplete.

    ``bad`` counts stretches of bytes that were passed over.
    """

    def __init__(self, limit=MAX_PAYLOAD):
        self._buffer = bytearray()
        self._limit = limit
        self._skipping = False
        self.bad = 0

    def feed(self, data):
        """Add received bytes."""
        self._buffer.extend(data)

    def pending(self):
        """Number of bytes that wait for the rest of their frame."""
        return len(self._buffer)

    def drop(self):
        """Give up on the oldest byte: called when the rest of a frame does not come."""
        self._skip(1)

    def _skip(self, count):
        if count:
            if not self._skipping:
                self.bad += 1
            self._skipping = True
            self._buffer = self._buffer[count:]

    def next(self):
        """(sequence, id, payload) of the next whole frame, or None."""
        while True:
            start = self._buffer.find(bytes((SYNC,)))
            self._skip(len(self._buffer) if start < 0 else start)
            if len(self._buffer) < 1 + _HEAD:
                return None
            length, sequence, number = struct.unpack_from("<HBB", self._buffer, 1)
            if length > self._limit:
                self._skip(1)
                continue
            end = 1 + _HEAD + length
            if len(self._buffer) < end + 4:
                return None
            if crc32(memoryview(self._buffer)[1:end]) != struct.unpack_from("<I", self._buffer, end)[0]:
                self._skip(1)
                continue
            payload = bytes(self._buffer[1 + _HEAD : end])
            self._buffer = self._buffer[end + 4 :]
            self._skipping = False
            return sequence, number, payload
