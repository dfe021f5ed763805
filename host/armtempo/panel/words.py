"""Every English text of the panel, but for what the library says: errors and their cures."""

from __future__ import annotations

PANEL = "the panel"
OTHER_IN_CONTROL = "Another page has control; take it to move the arm."
NOBODY_IN_CONTROL = "Take control to move the arm."
BUSY = "Wait: {what} is under way."
FAULT = "A fault is pending ({fault}): remove its cause, then clear it."
NOT_HOMED = "The arm's position is unknown: home it first."
MOVING = "The arm is moving."
WAIT = "try again when that is over"
DONE = "{what}: done"
STOPPED = "{what}: stopped {why}"
BRAKING = "Stop: the arm brakes along its path."
FREEZING = "Stop pressed twice: the outputs are frozen."

TITLE = "armtempo"
STOP = "Stop"
STOP_HINT = "Brakes along the path (space bar, Escape). A second press within 5 s freezes the outputs."
TAKE_CONTROL = "Take control"
IN_CONTROL = "In control"
LOST = "The panel's program does not answer. Nothing can be moved from here."
VIRTUAL = "virtual board"

TAB_MOVE, TAB_PLAN, TAB_RUN, TAB_BOARD = "Move", "Plan", "Run", "Board"
VIEWS = {"side": "Side", "top": "Top", "free": "Free"}

JOINTS, TOOL, POSTURES, OUTPUTS, INPUTS = "Joints", "Tool", "Postures", "Outputs", "Inputs"
SPEED_OF_JOG = "Speed of jogs, % of the limits"
SPEED_OF_MOTION = "Speed of the motion, %"
HOLD_HINT = "Moves while the button is held."
AXES_OF_TOOL = "Axes of the tool"
HOME, GO, CLEAR, PAUSE, RESUME = "The arm is at home", "Go", "Clear the fault", "Pause", "Resume"
HOME_HINT = "Says that the arm is in its home posture; nothing moves."
SURE = "Is the arm in its home posture? Its position is taken as this."

JOB, NEW_VIA, FROM_ARM, DELETE = "Job", "Add a via point", "Take the arm's posture", "Delete"
PASTE, PASTE_HINT = "Paste", "Rows of angles from a spreadsheet, one row a via point"
PLAN, CANCEL, SAVE = "Plan", "Cancel", "Save the job"
PATH, PATHS = "Path", {"through": "spline through the via points", "free": "free between the via points"}
MOTION_TIME = "Motion time {total:.3f} s; no motion along this path is shorter than {floor:.3f} s."
PLAY = "Play on the model"
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

TO_START, RUN, REPEAT = "Go to the start", "Run", "Repetitions"
MEASURED, COMMANDED, ERROR = "measured", "commanded", "following error, deg"
STORED, PAST_RUNS, REPORT, COMPARE = "Stored motions", "Past runs", "Report", "Compare two"
STEP_NOW = "Step {step}, cycle {cycle}"

STATUS, LOG, REMOVE = "Status", "Log", "Remove"
