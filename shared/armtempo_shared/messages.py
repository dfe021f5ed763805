"""The message table: every command, answer and event with its number and fields; frame constants.

The only home of these facts; ``wire.py`` makes and finds frames by them, ``shared/docs/protocol.md``
is generated from them. The board loads this module only.
"""

PROTOCOL_VERSION = 1
SYNC = 0xA5
MAX_PAYLOAD = 512
OVERHEAD = 9
"""Bytes of a frame besides its payload: SYNC, length H, sequence B, message id B, crc32 I."""

COMMANDS = (
    ("hello", 0x01, (("protocol", "B"), ("session", "I")), ""),
    ("status", 0x02, (), ""),
    ("put_begin", 0x10, (("size", "I"), ("crc", "I")), "text"),  # tail: name; crc: the record's last 4 bytes
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
    ("leave", 0x24, (), ""),  # end the program; the port becomes MicroPython's REPL
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
    ("leave", 0x24, (), ""),
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

SAMPLE_BRAKING = 1  # flag of a sample: taken while braking
START_HOMING = 1  # a limit switch ends the motion without a fault
STATES = ("unconfigured", "unhomed", "idle", "moving", "braking", "fault")


def layout(fields: "tuple[tuple[str, str], ...]") -> str:
    """The struct format of a row's fixed fields."""
    return "<" + "".join([kind for _, kind in fields])
