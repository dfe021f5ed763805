"""All texts of the panel, except errors of the library."""

from __future__ import annotations

PANEL = "the panel"
OTHER_IN_CONTROL = "Another page has control; take it to move the arm."
NOBODY_IN_CONTROL = "Take control to move the arm."
BUSY = "Wait: {what} is under way."
NO_FAULT = "No fault is pending."
NOT_HOMED = "The arm's position is unknown: home it first."
MOVING = "The arm is moving."
AT_REST = "Nothing moves."
IN_A_PAUSE, AT_SPEED = "in a pause", "at {percent:g} %"
NO_BOARD, NO_BOARD_HINT = "The board is not connected.", "wait until it is"
WAIT = "try again when that is over"
DONE = "{what}: done"
STOPPED = "{what}: stopped: {why}"
BRAKING = "Stop: the arm brakes along its path."
FREEZING = "Stop pressed twice: the outputs are frozen."

TITLE = "armtempo"
STOP = "Stop"
STOP_HINT = "Brakes along the path (space bar, Escape). A second press within 5 s freezes the outputs."
TAKE_CONTROL = "Take control"
IN_CONTROL = "In control"
LOST = "The panel's program does not answer. Nothing can be moved from here."
VIRTUAL = "virtual board"

TAB_MOVE, TAB_PLAN, TAB_RUN, TAB_SEQUENCE, TAB_BOARD = "Move", "Plan", "Run", "Sequence", "Board"
VIEWS = {"side": "Side", "top": "Top", "free": "Free", "follow": "Follow"}

JOINTS, TOOL, POSTURES, OUTPUTS, INPUTS = "Joints", "Tool", "Postures", "Outputs", "Inputs"
SPEED_OF_JOG = "Speed of jogs, % of the limits"
SPEED_OF_MOTION = "Speed, %"
HOLD_HINT = "Moves while the button, or Enter on it, is held."
HOME, GO, CLEAR, PAUSE, RESUME = "The arm is at home", "Go", "Clear the fault", "Pause", "Resume"
SURE = "Is the arm in its home posture? Its position is taken as this."

DRAG_HINT = "Drag a via point in the picture, or click it to see the other postures that reach it."
POSTURES_OF = "P{number}: postures of the arm with the tool there, {count}; the nearest is taken"
NEW_VIA, FROM_ARM, DELETE = "Add a via point", "Take the arm's posture", "Delete"
PASTE, PASTE_HINT = "Paste", "Rows of angles from a spreadsheet, one row a via point"
PASTED = "the pasted rows"
PLAN, CANCEL, SAVE = "Plan", "Cancel", "Save the job"
OPTIONS = {
    "path": "Path",
    "corridor_deg": "Corridor, deg",
    "corridor_mm": "Corridor, mm",
    "timing": "Timing",
    "degree": "Degree",
    "refine": "Segments",
}
CHOICES = {
    "through": "spline through the via points",
    "free": "free between the via points",
    "shared": "shared by all joints",
    "per-joint": "one for each joint",
}
MOTION_TIME = "Motion time {total:.3f} s; no motion along this path is shorter than {floor:.3f} s."
PLAY, PLAY_TIME = "Play on the model", "Time on the model"
TIME_S, ANGLE, SPEED, ACCELERATION, JERK = (
    "s",
    "angle, deg",
    "speed, deg/s",
    "acceleration, deg/s²",
    "jerk, deg/s³",
)
SAVED = "Saved: {path}"
CANCELLED, PLAN_AGAIN = "The planning was cancelled.", "plan again when you like"
NO_PLAN = "Plan a motion first."

TO_START, RUN, UPLOAD, REPEAT = "Go to the start", "Run", "Upload", "Repetitions"
ERROR = "following error, deg"
DOTTED = "Lines: measured, or commanded for a joint without an encoder. Dotted: planned."
STORED, PAST_RUNS, REPORT, COMPARE = "Stored motions", "Past runs", "Report", "Compare two"
NO_SEQUENCE_OPEN = "Choose a sequence first."
NO_SEQUENCE = "The project folder has no sequence: a TOML file with [[step]]."
SEQUENCE_FILE, SAVE_SEQUENCE = "Sequence", "Save the sequence"
STEP, ADD_STEP, UP, DOWN = "step", "Add a step", "Up", "Down"
STEP_KINDS = {
    "goto": "go to",
    "run": "run",
    "output": "set output",
    "holds": "tool holds",
    "wait_s": "wait, s",
    "wait_input": "wait for input",
    "count": "count",
    "repeat": "repeat",
    "end": "end of",
    "call": "call",
}
STEP_KEYS = {
    "to": "to",
    "holds": "tool holds",
    "wait_s": "wait, s",
    "active": "active",
    "timeout_s": "time-out, s",
    "on_timeout": "then",
}
STEP_NOW = "Step {step}, cycle {cycle}"

STATE_KEYS = {
    "max_rate": "one joint, steps/s",
    "max_rate_sum": "all together, steps/s",
    "speed_percent": "speed, %",
    "free_flash": "free flash, bytes",
    "free_heap": "free heap, bytes",
    "frames_bad": "damaged messages",
}
STATUS, LOG, TRAFFIC = "Status", "Log", "Traffic"
RENAME, REMOVE, NEW_NAME = "Rename", "Remove", "New name"
A_SEQUENCE, BY_BUTTON = "sequence", " · started by the board's button"
SURE_REMOVE = "Remove {name} from the board?"
SELFTEST, SURE_SELFTEST = (
    "Self-test",
    "The board measures itself with its drivers off, and is reset: the arm's position is unknown afterwards.",
)
VERDICT_KEYS = ("verdict", "part", "what", "measured", "expected", "cure")
PROGRAM, DEPLOY, FLASH = "Board program", "Deploy", "Flash"
SURE_DEPLOY = "Put this version's program on the board? The arm's position is unknown afterwards."
SURE_FLASH = (
    "Write the firmware in the project folder to the board? The arm's position is unknown afterwards."
)


def text(value: object) -> str:
    """A value of the board's state."""
    return {True: "yes", False: "no"}[value] if isinstance(value, bool) else str(value)
