"""All texts of the panel, except errors of the library."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from armtempo.basics.errors import ArmtempoError

PANEL = "the panel"
PRESS_AGAIN = "press again if it is still meant"
NO_PRESS = "Not done: the page did not say when that was pressed"
PRESS_PASSED = "Not done: it was released, or arrived twice or out of order"
PRESS_LATE = "Not done: it arrived more than 0.3 s after it was pressed"
PRESS_OTHER_STATE = "Not done: the arm's state changed just before it was pressed"
JOG = "jog"
OTHER_IN_CONTROL = "Another page has control; take it to move the arm."
NOBODY_IN_CONTROL = "Take control to move the arm."
BUSY = "Wait: {what} is under way."
NO_FAULT = "No fault is pending."
NOT_HOMED = "The arm's position is unknown: home it first."
MOVING = "The arm is moving."
AT_REST = "Nothing moves."
PAUSED, AT_SPEED = "paused", "at {percent:g} %"
NOT_PAUSED = "The motion is not paused."
NO_BOARD, NO_BOARD_HINT = "The board is not connected.", "wait until it is"
WAIT = "try again when that is over"
ROW_GONE, LOOK_AGAIN = "This row is gone", "look at the rows as they are now"
DONE = "{what}: done"
BROWSER_SILENT = "the browser was silent for 0.35 s while the button was held"
STOPPED = "{what}: stopped: {why}"
BRAKING = "Stop: the arm brakes along its path."
FROZEN = "The outputs were frozen: steps may be lost. Compare the arm with its picture, and home it if they differ."
FROZEN_BLIND = "The outputs were frozen in motion: {joints} may have moved on, unmeasured. Home the arm."
FIRST_HOME = "Where the arm is, the board does not know. Home it before anything can move."
OLD_STATE = "last heard {age:.1f} s ago"
UNKNOWN = "position unknown"
DISMISS = "Close"
FREEZE = "Freeze"
FREEZE_HINT = "The arm does not rest yet: stop the step pulses at once. Steps may be lost."

TITLE = "armtempo"
STOP = "Stop"
STOP_HINT = "Brakes along the path (space bar, Escape)."
TAKE_CONTROL = "Take control"
IN_CONTROL = "In control"
LOST = (
    "The panel's program does not answer. Nothing can be moved or stopped from here. "
    "A held move has ended; a motion that was started with Run goes on to its end: stop it with the E-stop. "
    "Once the panel is started again, open the address that it prints."
)
VIRTUAL = "virtual board"

TAB_MOVE, TAB_JOB, TAB_RUN, TAB_SEQUENCE, TAB_BOARD = "Move", "Job", "Run", "Sequence", "Board"
VIEWS = {"side": "Side", "top": "Top", "free": "Free", "follow": "Follow"}

JOINTS, OUTPUTS, INPUTS = "Joints", "Outputs", "Inputs"
OWN = "own"
FRAME, BASE_FRAME, TOOL_FRAME = "What is jogged", "Tool, base frame", "Tool, own frame"
FRAME_OF_POSE, IN_BASE = "Frame of the pose", "in the base"
TOOL, NO_TOOL = "Tool", "no tool"
STEP_OF_JOG, HOLD = "Length of a jog, mm or degrees", "While held"
SPEED_OF_JOG = "Speed of jogs and targets"
JOG_STEP = "step"
GO_TO, TYPED_TARGET, ANGLES, POSE = "Go to", "Typed target", "Angles", "Pose"
FORM_OF_TARGET = "How the target is given"
POSE_FIELDS = ("x, mm", "y, mm", "z, mm", "roll, deg", "pitch, deg", "yaw, deg")
FEW_JOINTS = "With {joints} joints the arm takes of the orientation what it can."
ONE_CLICK, IN_A_LINE, TAKE_PRESENT, SHOW = "With one click", "In a straight line", "Where the arm is", "Show"
IS_THERE, OTHER_TARGET = "The arm is there already", "choose another target"
TARGET_HINT = "Pressed, a target is shown in the picture; held, the arm moves there."
TEACH, TEACH_HINT = "Store…", "Store where the arm is, under a name in the arm file:"
STORE, NAME_OF_POSTURE, REPLACE = "Store", "Name", "Replace the posture of this name"
HAS_POSTURE, REPLACE_HINT = "There is a posture {name!r} already", "switch on ‘Replace’, or type another name"
TAUGHT, ADD_TO_JOB = "Stored: {name}", "Add to the job"
TEACH_POINTS, TAUGHT_KINDS = "Teach a frame or a tool", {"frame": "Frame", "tool": "Tool"}
WHAT_IS_TAUGHT, NAME_OF_TAUGHT, BEGIN, LEVEL = "What is taught", "Name of the frame or tool", "Begin", "Level"
TAUGHT_HINTS = {
    "frame": "Three points that the tool is brought to: the origin, one on the x axis, one on the side of y. "
    "Level: its z axis is made vertical.",
    "tool": "Four postures in which the tool's point touches the same tip, each turned differently by 30° or more.",
}
TEACHING = "{kind} {name}:"
SURE_REPLACE = "The arm file has a {kind} {name!r} already. It stays until the new one is stored."
TEACH_ANEW, TAKE_POINT, TAKEN, NEXT = "Teach it anew", "Take this point", "  ✓", "  ← bring the arm there"
ALL_TAKEN, MORE_POINTS = "All points are taken: store them.", "Take all points first."
NAMES, NO_NAMES = "Rename or remove postures, frames, tools", "The arm file names none."
NAMED_KINDS = {"posture": "Posture", "frame": "Frame", "tool": "Tool"}
SURE_RENAME, SURE_REMOVE_NAME = (
    "{kind} {name}: give it another name?",
    "{kind} {name}: remove it from the arm file?",
)
USED_IN, NOT_USED = "It is used here:", "Nothing in the project folder uses it."
USE, UNSAVED = "line {line}", "not saved"
FOLLOW = "Change these lines of jobs and sequences too"
BY_YOURSELF = "Change these lines yourself, after the new name is given:"
RENAMED = "{kind} {name} is called {new} now."
TOOL_IS_ON, CHOOSE_NO_TOOL = "The tool {name} is jogged now", "choose another one first"
OTHER_TOOL = "The other points were taken with another tool: choose that again, or begin anew."
INTO_RANGE = "move the arm into its ranges"
BY_HAND = "Guide by hand…"
SURE_BY_HAND = (
    "The motors' current is switched off: somebody must hold the arm, or it sinks. The encoders are read."
)
GUIDING, GUIDED = "Guide the arm: nothing else holds it.", "Hold it again"
VIEW, FRAMES_SHOWN = "View", "Frames"
PATH_SPEED = "0 … {fastest:.0f} mm/s"
LIMIT, IN_PLAN = "limit of {names}", "{name}, planned"
SPEED_OF_MOTION = "Speed"
HOME, GO, CLEAR, PAUSE, RESUME = "The arm is at home", "Go", "Clear the fault", "Pause", "Resume"
HOMING = "Home…"
NO_FLOOR = "The arm file names no table: nothing keeps the arm from going below it."
ASK_FLOOR, FLOOR_HEIGHT = "Table…", "Height of the table, z in mm"
FLOOR_HINT = (
    "No jog, target or plan goes below the table. Its height, in the base's frame, goes into the arm file."
)
NO_HEIGHT, GIVE_HEIGHT = "The table has no height", "type one"
WHICH_JOINTS, ALL_JOINTS = "Home", "All joints"
NO_SWITCH = "{joint} has no switch whose angle is known: say where it is instead."
HOME_BY_SWITCHES = "Home by the switches"
BY_SWITCHES = "Or let the arm find its switches, in this order: {order}. It moves; clear its workspace."
SURE = "Compare the arm with the grey one in the picture. If it stands so, its joints are at:"

DRAG_HINT = "Drag a via point in the picture, or click it to see the other postures that reach it."
POSTURES_OF = "P{number}: postures that reach it: {count}. The nearest is used; choose another:"
NEW_VIA, FROM_ARM, DELETE = "Add a via point", "Take the arm's posture", "Delete"
PASTE, PASTE_HINT = "Paste", "Rows of angles from a spreadsheet, one row a via point"
PASTED = "the pasted rows"
PLAN, CANCEL, SAVE = "Plan", "Cancel", "Save"
OPTIONS = {
    "path": "Path",
    "corridor_deg": "Corridor, deg",
    "corridor_mm": "Corridor, mm",
    "timing": "Timing",
    "degree": "Degree",
    "refine": "Segments",
    "speed_mm_s": "Tool speed, mm/s",
    "acceleration_mm_s2": "Tool acceleration, mm/s²",
    "holds": "Tool holds",
    "frame": "Frame",
    "tool": "Tool",
}
VIA_KEYS = {
    "line": "Straight line to it",
    "arc_through_mm": "Arc through [x, y, z], mm",
    "circle_through_mm": "Circle through two, mm",
    "blend_mm": "Corner cut by, mm",
    "speed_mm_s": "Tool speed, mm/s",
    "acceleration_mm_s2": "Tool acceleration, mm/s²",
    "stop": "Stop there",
    "dwell_s": "Dwell, s",
    "position_mm": "Position [x, y, z], mm",
    "rpy_deg": "Roll, pitch, yaw, deg",
    "quaternion": "Quaternion w, x, y, z",
    "approach": "Direction of the tool",
    "roll_deg": "Roll, deg",
    "pitch_deg": "Pitch, deg",
    "yaw_deg": "Yaw, deg",
    "matrix": "Pose, 4 × 4",
    "frame": "Frame",
    "posture": "Posture",
    "posture_deg": "Near the angles, deg",
    "posture_joints": "Near the joints at",
    "tolerance_mm": "Tolerance, mm",
    "tolerance_deg": "Tolerance, deg",
}
FORMS = {"angles_deg": "angles", "position_mm": "pose", "matrix": "pose", "posture": "posture"}
WAYS = {"line": "line", "arc_through_mm": "arc", "blend_mm": "blend", "stop": "stop", "speed_mm_s": "speed"}
DEFAULT = "default"
JOB_FILE, NEW, SAVE_AS, UNDO = "Job", "New…", "Save as…", "Undo"
NOTHING_OPEN = "Choose a file, or make a new one."
NOTHING_TO_UNDO = "Nothing was changed."
IS_SAVED, NOT_SAVED = "saved", "changes are not saved"
OTHER_ON_DISK, READ_AGAIN = "changed by another program", "Open it again"
WAS_READ_AGAIN = "{name} was changed by another program, and opened again."
SURE_LOSE, LOSE = "{name}: its changes are not saved. Lose them?", "Lose them"
MORE, CHANGES, INSERT, COPY = "Line, arc, stop, speed:", "Change", "Insert before", "Copy"
AS_POSE, AS_ANGLES = "Give it as a pose", "Give it as angles"

CHOICES = {
    "through": "spline through the via points",
    "free": "free between the via points",
    "shared": "shared by all joints",
    "per-joint": "one for each joint",
}
MOTION_TIME = "Motion time {total:.3f} s; no motion along this path is shorter than {bound:.3f} s."
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
PLAN_IS_OLD = "The job, or what it names of the arm, was changed after it was planned: plan again."

TO_START, RUN, UPLOAD, REPEAT = "Go to the start", "Run", "Upload", "Repetitions"
ERROR = "following error, deg"
DOTTED = "Lines: measured, or commanded for a joint without an encoder. Dotted: planned."
PLANNED = "{name}: {total:.3f} s · {file}"
LEFT = "{name}: {part:.0%}, {left:.0f} s left"
WRONG_REPEAT, RIGHT_REPEAT = "Repetitions: {times} are not possible", "give 1 to {most}"
NO_RUNS, UNREADABLE, NO_END = "Nothing was recorded here yet.", "cannot be read", "no end recorded"
CHOOSE_TWO = "Choose two runs or more."
RUN_COLUMNS = ("Run", "Date", "Duration", "End", "")
STORED, PAST_RUNS, REPORT, COMPARE = "Stored motions", "Past runs", "Report", "Compare"
NO_SEQUENCE_OPEN = "Choose a sequence first."
SEQUENCE_FILE = "Sequence"
STEP, ADD_STEP, UP, DOWN = "step", "Add a step", "Up", "Down"
STEP_KINDS = {
    "goto": "go to",
    "run": "run",
    "output": "set output",
    "holds": "tool holds",
    "tool": "tool on the arm",
    "wait_s": "wait, s",
    "wait_input": "wait for input",
    "count": "count",
    "repeat": "repeat",
    "place": "to the place of",
    "leave": "leave the place of",
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
    "speed_mm_s": "at most, mm/s",
    "first_place": "first place",
    "last_place": "last place",
    "reverse": "from the last",
}
ADD_HERE = "Add where the arm is"
TOTAL_TIME, CYCLE_TIME = "{time:.2f} s in all, without waits for inputs", "{time:.2f} s a cycle"

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
NOTHING_STORED = "Nothing is stored on the board."
A_SEQUENCE, A_PROGRAM, BY_BUTTON = "sequence", "program", " · started by the board's button"
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


COMMANDS = {
    "clear": CLEAR,
    "home": HOMING,
    "goto": TO_START,
    "deploy": DEPLOY,
    "flash": FLASH,
    "selftest": SELFTEST,
    "stop": STOP,
    "resume": RESUME,
    "plan": PLAN,
    "run": RUN,
    "remove": REMOVE,
    "upload": UPLOAD,
    "list": STORED,
    "status": TAB_BOARD,
    "jog": TAB_MOVE,
    "teach": TAB_MOVE,
}
"""What the panel has instead of a command."""
_SOLUTIONS = re.compile(r"\n  solution +why not(\n  .*)*")
_COMMAND = re.compile(r"'armtempo ([a-z-]+)([^']*)'(?! in a terminal)")


def of_error(error: ArmtempoError) -> str:
    """An error of the library in the words of the panel: buttons instead of commands, no table of solutions."""
    return of_text("; ".join(one for one in (_SOLUTIONS.sub("", error.problem), error.hint) if one))


def of_job(text: str) -> str:
    """A text on the edited job, with the names of its fields instead of those of the file's keys."""
    text = of_text(text)
    for key, label in {**VIA_KEYS, **OPTIONS}.items():
        # A key that is a usual word too is one only where a value follows, but not in "at line 1"
        text = re.sub(rf"(?<!at )\b{key}\b" + ("" if "_" in key else "(?= =| ['\"0-9])"), f"‘{label}’", text)
    return text


def of_sequence(text: str) -> str:
    """A text on the edited sequence, with the names of its fields instead of those of the file's keys."""
    text = of_text(text)
    for key, label in {**STEP_KINDS, **STEP_KEYS}.items():
        # A key that is a usual word too is one only after the number of its step
        text = re.sub((r"(\b)" if "_" in key else r"(\bstep\[\d+\]\.)") + rf"{key}\b", rf"\1‘{label}’", text)
    return text


def of_text(text: str) -> str:
    """A text of the library in the words of the panel; one that is in them already stays as it is."""
    return plain(_COMMAND.sub(_button, text))


def _button(command: re.Match[str]) -> str:
    """The button that does what a command does, or the command as one of the terminal."""
    name = COMMANDS.get(command[1])
    return f"‘{name}’" if name else f"{command[0]} in a terminal"


def plain(text: str) -> str:
    """A text from a file or a board, with what cannot be seen, or turns the direction of a line, as a box."""
    return "".join(one if one.isprintable() or one in "\n\t" else "\N{WHITE SQUARE}" for one in text)


def text(value: object) -> str:
    """A value of the board's state."""
    return {True: "yes", False: "no"}[value] if isinstance(value, bool) else str(value)
