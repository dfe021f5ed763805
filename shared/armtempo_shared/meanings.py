"""What the numbers of ``codes.py`` mean and what to do, in words; kept off the board's small heap."""

from armtempo_shared import codes

_ROWS = (
    # name, what it means, what to do
    ("unknown_command", "the board does not know this command", "run 'armtempo deploy'"),
    ("malformed", "the command's fields do not fit its message", "run 'armtempo deploy'"),
    ("protocol", "host and board speak different protocol versions", "run 'armtempo deploy'"),
    ("busy", "the board is moving", "wait for the end of the motion, or 'armtempo stop'"),
    ("not_moving", "nothing is moving", "no action needed"),
    ("fault_pending", "a fault is pending", "remove its cause, then 'armtempo clear'"),
    ("unconfigured", "the board has no arm record", "the host sends it when it connects; reconnect"),
    ("arm_mismatch", "the motion was planned for another arm file", "plan it again with this arm"),
    ("unhomed", "the position is unknown", "bring the arm to its posture and run 'armtempo home'"),
    ("not_found", "no trajectory of this name is stored", "see 'armtempo list'"),
    ("bad_name", "the name is empty, too long or has other characters than a-z A-Z 0-9 - _", "rename it"),
    ("flash_full", "the flash has no room; what was stored is kept", "'armtempo remove' something"),
    ("flash_error", "the flash could not be written or read", "see the recovery steps in the docs"),
    ("bad_record", "the record is damaged or of an unknown kind", "upload it again"),
    ("bad_offset", "a piece of the upload is out of order", "upload it again"),
    ("bad_checksum", "the upload does not match its checksum", "upload it again"),
    ("exists", "this name is taken", "remove it first"),
    ("wrong_joints", "the motion has another number of joints than the arm", "plan it for this arm"),
    ("time_order", "the time control points do not increase", "plan it again"),
    ("out_of_range", "the motion leaves the joint's range", "check the via points or the range"),
    ("too_fast", "the motion needs more steps per second than the board can make", "lower the limits"),
    ("wrong_start", "the arm does not stand where the motion begins", "'armtempo goto' its start"),
    ("too_long", "the motion is longer or larger than the board can hold", "split it"),
    ("too_abrupt", "the motion reverses too fast for the step generator", "lower the limits"),
    ("no_session", "the board has started anew, or was never greeted in this session", "reconnect"),
    ("estop", "the E-stop input tripped", "release it, then 'armtempo clear' and home"),
    ("limit_switch", "a limit switch tripped", "clear, then move away from it"),
    ("following", "the encoder is too far from the command (stall or slip)", "find the cause, then home"),
    ("underrun", "the step ring ran dry", "report it; the position is known"),
    ("internal", "the board program failed", "report it with the log"),
    ("watchdog", "the watchdog restarted the board", "home again; report it"),
    ("link_lost", "the host disappeared during the motion", "reconnect"),
    ("start_failed", "the timers did not start as set up", "power-cycle the board"),
)
ERRORS: "dict[int, tuple[str, str, str]]" = {}
"""Code number: (name, what it means, what to do)."""
ERROR_CODES: "dict[str, int]" = {}
"""Name: code number."""
for _row in _ROWS:
    ERROR_CODES[_row[0]] = getattr(codes, _row[0].upper())
    ERRORS[ERROR_CODES[_row[0]]] = _row
