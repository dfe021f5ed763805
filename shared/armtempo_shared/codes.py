"""Numbers of refusals and faults; the only home of these numbers.

What each means and what to do is in ``meanings.py``, which the board never loads.
"""

# refusals of a command
UNKNOWN_COMMAND = 1
MALFORMED = 2
PROTOCOL = 3
BUSY = 4
NOT_MOVING = 5
FAULT_PENDING = 6
UNCONFIGURED = 7
ARM_MISMATCH = 8
UNHOMED = 9
NOT_FOUND = 10
BAD_NAME = 11
FLASH_FULL = 12
FLASH_ERROR = 13
BAD_RECORD = 14
BAD_OFFSET = 15
BAD_CHECKSUM = 16
EXISTS = 17
WRONG_JOINTS = 18
TIME_ORDER = 19
OUT_OF_RANGE = 20
TOO_FAST = 21
WRONG_START = 22
TOO_LONG = 23
TOO_ABRUPT = 24
NO_SESSION = 25
# faults: they stop the motion and stay until cleared
ESTOP = 40
LIMIT_SWITCH = 41
FOLLOWING = 42
UNDERRUN = 43
INTERNAL = 44
WATCHDOG = 45
LINK_LOST = 46
START_FAILED = 47
