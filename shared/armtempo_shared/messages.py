"""Constants of the wire protocol; its messages are in ``table.py``, its frames in ``wire.py``."""

PROTOCOL_VERSION = 5
"""Never 3: MicroPython takes that byte, which each ``hello`` has, for Ctrl-C."""
SYNC = 0xA5
MAX_PAYLOAD = 256
OVERHEAD = 9
"""Bytes of a frame besides its payload: SYNC, length H, sequence B, message id B, crc32 I."""
LENGTH_AT, SEQUENCE_AT, NUMBER_AT, PAYLOAD_AT = 1, 3, 4, 5
"""Offsets in a frame."""

NO_JOINT = 255
"""In the place of a joint's number: the fault or refusal is about none."""

ARM_RECORD_NAME = "/arm"
"""put_begin with this name carries the arm record, not a trajectory."""

SAMPLE_BRAKING = 1  # flag of a sample: taken while braking
PERMILLE = 1000
SLOWEST_PERMILLE = 10
"""A rate of the motion's own time is in thousandths: from 10 (1 %) to 1000, as planned."""
RESUME = 0xFFFF
"""In the place of a rate: as before the pause."""
START_HOMING = 1  # flag of start: a limit switch ends the motion without a fault
START_HELD = 2  # flag of start: the motion brakes unless the host says hold again and again

FEATURES = ("sequences", "outputs", "jog", "speed")
"""What a program may be able to do beyond one motion at a time; bits of ``features`` in the answer to hello."""
RATES_MEASURED = 1 << 7
"""The same: the step rates that hello states were measured by a self-test on this board, else they are estimated."""
UNCONFIGURED, UNHOMED, IDLE, MOVING, BRAKING, FAULT = 0, 1, 2, 3, 4, 5
STATES = ("unconfigured", "unhomed", "idle", "moving", "braking", "fault")
"""Names of the states by their number."""
