"""Constants of the wire protocol; its messages are in ``table.py``, its frames in ``wire.py``."""

PROTOCOL_VERSION = 8
"""Never 3: each ``hello`` contains it, and MicroPython takes this byte for Ctrl-C."""
SYNC = 0xA5
MAX_PAYLOAD = 256
"""Of an answer or event."""
MAX_COMMAND = 1000
"""Payload bytes of a command: most motions that are run once fit into one."""
OVERHEAD = 9
"""Bytes of a frame in addition to its payload: SYNC, length H, sequence B, message id B, crc32 I."""
LENGTH_AT, SEQUENCE_AT, NUMBER_AT, PAYLOAD_AT = 1, 3, 4, 5
"""Offsets in a frame."""

NO_JOINT = 255
"""Instead of a joint's number: the fault or refusal concerns none."""

ARM_RECORD_NAME = "/arm"
"""Name of the arm record in ``put_begin``."""
ONCE_NAME = "/once"
"""Name in ``start`` of the motion in the board's memory, which ``put_once`` has put there."""
MOTION, SEQUENCE, PROGRAM = 0, 1, 2
"""Kinds of stored records, in the answer to ``list``; what is neither of the last two counts as a motion."""

SAMPLE_BRAKING = 1  # flag of a sample: taken while braking
PERMILLE = 1000
SLOWEST_PERMILLE = 10
"""Rates of the motion's own time are in thousandths, from 10 (1 %) to 1000, the planned speed."""
RESUME = 0xFFFF
"""Instead of a rate: that before the pause."""
START_HOMING = 1  # flag of start: a limit switch ends the motion without a fault
START_HELD = 2  # flag of start: the motion brakes unless the host keeps sending hold
START_SWITCHES_BIT = 2
"""First bit of start's flags for a homing motion: a bit per joint whose switches end it; none: all that move."""
START_SEEKS = 256  # flag of start: of a homing motion, the switches that its joints do not move to end it too
OTHER_SWITCH = 64
"""In the number of the joint whose switch ended a homing motion: it was one that the joints did not move to."""

FEATURES = ("sequences", "outputs", "jog", "speed")
"""Optional features of a program; bits of ``features`` in the answer to ``hello``."""
RATES_MEASURED = 1 << 7
"""Another bit: the step rates in the answer were measured by this board's self-test, otherwise they are estimates."""
UNCONFIGURED, UNHOMED, IDLE, MOVING, BRAKING, FAULT = 0, 1, 2, 3, 4, 5
STATES = ("unconfigured", "unhomed", "idle", "moving", "braking", "fault")
"""Names of the states by their number."""
