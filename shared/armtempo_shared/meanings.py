"""Meaning and cure of each code of ``codes.py``, and of each message; the board never loads this."""

from armtempo_shared import codes

_ROWS = (
    # name, what it means, what to do
    ("unknown_command", "the board does not know this command", "run 'armtempo deploy'"),
    ("malformed", "the command's fields do not fit its message", "run 'armtempo deploy'"),
    ("protocol", "host and board speak different protocol versions", "run 'armtempo deploy'"),
    ("busy", "the board is moving", "wait for the end of the motion, or 'armtempo stop'"),
    ("not_moving", "nothing is moving", "no action needed"),
    ("fault_pending", "a fault is pending", "remove its cause, then 'armtempo clear'"),
    (
        "unconfigured",
        "the board has no arm record",
        "run 'armtempo home' with your arm file (--arm), which sends it",
    ),
    ("arm_mismatch", "the motion was planned for a different arm file", "plan it again with this arm"),
    ("unhomed", "the position is unknown", "move the arm to its home posture and run 'armtempo home'"),
    ("not_found", "no trajectory of this name is stored", "see 'armtempo list'"),
    (
        "bad_name",
        "the name is empty, too long or has characters other than a-z A-Z 0-9 - _",
        "choose another name",
    ),
    (
        "flash_full",
        "the flash is full; stored motions are kept",
        "remove motions that are no longer needed: 'armtempo remove'",
    ),
    ("flash_error", "the flash could not be written or read", "see 'armtempo help recovery'"),
    ("bad_record", "the record is damaged or of an unknown kind", "upload it again"),
    ("bad_offset", "a piece of the upload is out of order", "upload it again"),
    ("bad_checksum", "the upload does not match its checksum", "upload it again"),
    ("exists", "this name is taken, possibly in different letter case", "remove or rename the other"),
    ("wrong_joints", "the motion and the arm differ in the number of joints", "plan it for this arm"),
    ("time_order", "the time control points do not increase", "plan it again"),
    ("out_of_range", "the motion leaves the joint's range", "check the via points or the range"),
    (
        "too_fast",
        "a joint is faster than its speed limit, or all together faster than the board can step",
        "plan it again with this arm file; if that does not help, lower its speed limits",
    ),
    (
        "wrong_start",
        "the arm is not at the start of the motion",
        "move it there: 'armtempo goto' with the motion's name or file",
    ),
    (
        "too_long",
        "the motion is longer or larger than the board can hold",
        "lower refine, use shared timing or fewer via points, or split it",
    ),
    ("too_abrupt", "the motion reverses too fast for the step generator", "lower the limits"),
    (
        "no_session",
        "the board has restarted, or had no hello in this session",
        "run the command again",
    ),
    (
        "no_engine_memory",
        "the engine for this arm does not fit into the board's memory; nothing was changed",
        "lower its top speeds, drive fewer joints, or put the program into the firmware ('armtempo flash')",
    ),
    (
        "no_memory",
        "the board ran out of memory in this command",
        "try again; if that fails, run 'armtempo status' and report it with the log",
    ),
    (
        "failed",
        "the board program failed in this command; its traceback is sent as a notice",
        "report it with the log",
    ),
    (
        "fixed_speed",
        "the motion was stored by an older armtempo, without the times for changes of speed",
        "upload it again, or set the speed before it starts",
    ),
    (
        "no_output",
        "the arm on the board has no output of this number",
        "give the arm's file with --arm, or set the board up for it: 'armtempo configure'",
    ),
    (
        "pin_taken",
        "an output or input of the arm uses a pin or timer that is already in use",
        "give another pin ('armtempo check' names the arm file's key; 'armtempo help hardware' lists what is free)",
    ),
    ("is_sequence", "this is a sequence, not a motion", "run it with 'armtempo run' and its name"),
    (
        "leg_missing",
        "a motion of the sequence is missing on the board, or differs from the planned one",
        "upload the sequence again, which uploads its motions too",
    ),
    (
        "leg_elsewhere",
        "a motion of the sequence does not begin where the previous one ends",
        "plan the sequence again and upload it",
    ),
    (
        "no_such_pin",
        "the sequence uses an output or an input that the arm on the board does not have",
        "plan the sequence again with the arm file that the board is set up for",
    ),
    (
        "no_sequence_memory",
        "the board has no memory to run a sequence or program for this arm; nothing has moved",
        "put the program into the firmware ('armtempo flash'), or let the host run the steps (board.run)",
    ),
    (
        "other_version",
        "the sequence on the board is of another version of armtempo",
        "plan it again and store it with 'armtempo upload --force'",
    ),
    (
        "needs_firmware",
        "the program's core on stock MicroPython can only run single motions; nothing has moved",
        "put the program into the firmware: 'armtempo flash'",
    ),
    ("estop", "the E-stop input tripped", "release it, then 'armtempo clear' and home"),
    ("limit_switch", "a limit switch tripped", "'armtempo clear', then move the arm away from it"),
    (
        "following",
        "the encoder is too far from the command (stall or slip)",
        "find the cause, 'armtempo clear', then home",
    ),
    (
        "underrun",
        "the board could not make the steps in time",
        "lower the limits and plan again; the position is known",
    ),
    (
        "internal",
        "the board program failed",
        "report it with the log; home again if the position is unknown",
    ),
    ("watchdog", "the watchdog restarted the board", "home again; report it"),
    ("link_lost", "the host did not answer during the motion", "check the cable, then 'armtempo clear'"),
    (
        "input_timeout",
        "an input of a sequence did not change in time",
        "find out why, then 'armtempo clear'",
    ),
    (
        "wrong_steps",
        "a joint's steps differ from the motion's record: an error in the board program",
        "'armtempo clear', then home; report it with the log",
    ),
    (
        "program_failed",
        "an exception ended the user's program",
        "mend the line that its traceback names, then 'armtempo clear'",
    ),
    ("start_failed", "the timers did not start as set up", "power-cycle the board"),
)
ERRORS: "dict[int, tuple[str, str, str]]" = {}
"""Code number: (name, what it means, what to do)."""
ERROR_CODES: "dict[str, int]" = {}
"""Name: code number."""
for _row in _ROWS:
    ERROR_CODES[_row[0]] = getattr(codes, _row[0].upper())
    ERRORS[ERROR_CODES[_row[0]]] = _row

VALUES: "dict[str, str]" = {
    "protocol": "version of the board",
    "fault_pending": "code of the fault",
    "flash_full": "bytes free",
    "bad_offset": "bytes received so far",
    "wrong_joints": "joints of the motion",
    "time_order": "number of the control point",
    "out_of_range": "position in steps",
    "too_fast": "steps/s needed",
    "wrong_start": "steps from there to the start",
    "too_long": "bytes of the record (at `put_begin`: that it takes); of a joint: its largest number",
    "too_abrupt": "steps/s²",
    "no_engine_memory": "bytes needed",
    "pin_taken": "16 times the port (A is 0) and the number in it",
    "leg_missing": "number of the motion in the sequence, from 1",
    "leg_elsewhere": "number of the step in the sequence",
    "no_such_pin": "number of the step in the sequence",
    "no_sequence_memory": "bytes that are missing",
}
"""What ``value`` of a refusal means, by name; the others have none."""

COMMANDS: "dict[str, str]" = {
    "hello": "Begins a session; `session` is a number that differs between hosts, so that the board recognises a "
    "new one. Refused with `protocol` if the versions differ. Answer: the board's identity; `joints` and `arm_crc` "
    "are 0 without an arm record; `boot` changes at every start of the program; "
    "`engine_bytes`: bytes of heap (without the chip's backup SRAM) available to an engine and its objects; "
    "`features`: what the program can do beyond one motion at a time, 1 sequences, 2 outputs and inputs, "
    "4 held motions, 8 other speeds; 128: both rates were measured on this board; "
    "`arm_problem`: code of the error in the stored arm record, 0 if it is valid or missing; `arm_value`: its "
    "value; `once_bytes`: of the largest record for `put_once`; the "
    "tail is the unique id in hex and the firmware.",
    "status": "What the board is doing. `known`: one bit per joint, its position is known. `run`: number of the "
    "current or last run since the start. `ticks`: motion clock. `path`: the motion's own time, which lags behind "
    "the clock if the speed was below 100 %. `fault_joint`: also the joint whose switch ended the last homing motion, "
    "plus 64 if it was none that its joints moved to. "
    "`rate`: the requested speed in thousandths, 0 in a pause; while nothing moves, that of the next start. "
    "`rest_ms`: milliseconds until rest if the arm is stopped now, or after a stop; 0 if nothing moves, or if a "
    "stop freezes. Tail: per joint commanded steps and encoder counts (two i32).",
    "put_begin": "Begins an upload of `size` bytes; the tail is the trajectory's name, or `/arm` for the arm "
    "record. `crc` is the record's own checksum, its last four bytes. An unfinished upload is discarded.",
    "put_data": "The bytes from `offset` on; pieces may overlap earlier ones but must leave no gap. Answer: the "
    "next offset.",
    "put_commit": "Ends the upload: the record is read back from the flash, checked against `crc` and for "
    "completeness, and replaces the old one. An arm record whose engine would not fit is refused before that "
    "(`no_engine_memory`), and the old one remains valid; otherwise it takes effect at once.",
    "put_once": "A piece of the record, `size` bytes in all, of a motion that is run once: it stays in the board's "
    "memory until the next one or a reset, and nothing is written to the flash. A motion record, or one for the way "
    "back along a stored motion (`shared/armtempo_shared/backwards.py`). Offset 0 begins a new one. Answer: the next "
    "offset.",
    "list": "The stored trajectory number `index` (from 0, in order of names) of `count`; `not_found` after the "
    "last. A damaged one has `crc`, `duration` and `joints` 0. `sequence` 1: it is a sequence, 2: a program, whose "
    "`duration` and `joints` are 0. Tail of the answer: its name.",
    "sequence": "State of the running sequence, or of the last one. Unknown to a board on which none has been "
    "started. `ending`: 1 running, 2 finished, 3 stopped, 4 stopped by the time-out of an input, 5 a fault, 6 a "
    "motion was refused; `code`: of that fault or refusal. `step`: of the sequence file; `row`: of the "
    "record; `cycle`: finished passes of its outermost repeats. Tail: its name; that of a program ends with `.py`, and "
    "`step` is the line of its source.",
    "counter": "Counter `index` (from 0) of the `count` that the sequence has, or that the last one had: its `value`, "
    "0 after the last. Each start sets them to 0. Unknown as `sequence` is. Tail: its name.",
    "remove": "Removes the trajectory of that name.",
    "rename": "The tail is the old name (`old_length` bytes), then the new one. The default goes with it.",
    "get": "Up to `length` bytes of a stored record (`/arm`: the arm record) from `offset` on.",
    "set_default": "What the button starts; an empty name for nothing.",
    "home": "Sets the positions of the joints of the mask `joints` to these steps; the tail has an i32 for every "
    "joint.",
    "start": "Starts a stored trajectory whose checksum is `crc`; the name `/once`: the record of `put_once`. "
    "`flags` 1: a limit switch ends it without a fault; with bits from 4 on, one per joint, only a switch of these "
    "joints does, else one of any that moves; with 256, one that was not pressed at the start and that they do not "
    "move to, too; 2: it is held, and brakes without a fault when no `hold` "
    "arrives for 300 ms. Answer: number of the run and its length in ticks. Or starts a sequence, each of whose "
    "motions is a run of its own; then the answer has the number of the last run and 0. The same with a program.",
    "stop": "`now` 0: brake along the path (freeze if the motion has no brake times); 1: freeze.",
    "speed": "Sets the rate of the motion's own time in thousandths (10 to 1000), along the same path; 0: pause, "
    "65535: the rate before the pause. Refused with `fixed_speed`, or with `too_long` if the run would last longer "
    "than 1 h 49 min. While nothing moves: the rate of this session's next start.",
    "clear": "Clears the fault; refused with `fault_pending` while its cause is still there.",
    "output": "Sets output `number` of the arm record (from 0) to `value`: 0 to 65535 cover its whole range. Also "
    "while a motion runs. Refused with `fault_pending` while a fault keeps it in its safe state. This command and "
    "`inputs` are unknown to a board whose arm has neither outputs nor inputs.",
    "inputs": "Answer: `levels` has one bit per input of the arm record, set if it is active; the tail has a u16 "
    "per output, its value. Also while a motion runs.",
    "leave": "Ends the program; MicroPython's prompt is on the port then.",
    "hold": "Keeps a motion going that was started with flag 2; the host sends it several times a second.",
    "drivers": "`on` 0: switches the motors' current off; all positions become unknown, the encoders are still "
    "read. 1: on again, as at the start of the next motion. Refused with `fault_pending`, and while something moves.",
    "samples": "Acknowledges all samples before `acknowledged`, which the board may drop, and asks for `wanted` "
    "samples from there on again. Answer: the oldest stored sample and their number.",
}
"""What each command does and what its answer says."""
EVENTS: "dict[str, str]" = {
    "sample": "One sample of run `run`; `index` counts from 0 since the last `start`, through all "
    "runs of a sequence. `ticks`: motion clock, `path`: the motion's own "
    "time. `flags` 1: taken while braking. Tail: per joint commanded steps and encoder counts (two i32).",
    "done": "The run ended without a fault, at its end or after a stop; sent after its last sample. `lost`: samples "
    "that were overwritten before they were sent. Tail as in `sample`.",
    "fault": "A fault: no more steps are made. `code` from the table below, `joint` 255 if it concerns no joint. "
    "Tail as in `sample`.",
    "row": "A row of the sequence has begun, the `passed`-th since its start: `row`, `step` and `cycle` as in "
    "`sequence`, `run`: the number of the last run that it started, that of this row if it is a motion; `value` of "
    "the counter if the row counts, else 0. It is dropped if the link has no space before the next row.",
    "notice": "Text, such as the traceback after an `internal` fault; it begins with `button:` if the board's "
    "button was pressed and could start nothing, as while an arm is guided by hand.",
    "ok": "The command was carried out; its number is followed by the answer's fields.",
    "error": "The command was refused, nothing was changed (after `failed` and `no_memory` check `status`). `code` "
    "from the table below, `joint` 255 if it concerns no joint, `value` as the code says.",
}
"""What each event and reply says."""
BUTTON_NOTICE = "button:"
"""Beginning of the notice about a press of the board's button."""
