"""The jog screen: keys move the arm, one line shows the position. Works in any terminal, also over ssh."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from threading import Thread
from typing import Self

import click

from armtempo.basics.errors import ArmtempoError, BoardError, InputError, LinkError, PlanError
from armtempo.basics.text import did_you_mean
from armtempo.cli.keys import END, INTERRUPT, Keys
from armtempo.kinematics.of_arm import forward
from armtempo.model.frame import TOOL
from armtempo.model.joint_unit import DEG, JointUnit
from armtempo.model.pose import to_rpy_deg
from armtempo.model.tool_pose import BASE
from armtempo.planning.jog.jog_line import axis_of
from armtempo.planning.jog.jog_motion import by_of_joint
from armtempo.robot.board import Board
from armtempo.robot.stop_request import Stopped, StopRequest

STEPS = (0.1, 1.0, 10.0)
"""deg or mm."""
SPEEDS = (1, 5, 10, 25, 50, 75, 100)
"""Percent of the speed limits."""
FIRST_REPEAT_S = 0.8
"""Longest delay until the first repeat of a held key in usual terminals."""
RELEASE_S = 0.3
"""A key without a repeat for this long counts as released."""
_POLL_S = 0.03
_IDLE_S = 0.5
_FORWARD, _BACKWARD = ("+", "=", "right", "up"), ("-", "_", "left", "down")
_ENDS = ("q", "Q", END, INTERRUPT)
_CLEAR_LINE = "\r\x1b[K"

KEYS = f"""\
  1 2 3 ...    a joint                        x y z   the tool along an axis, X Y Z about it
  + -, arrows  move                           f       axes of the base, the tool, or a frame
  s            steps of 0.1, 1, 10 (deg, mm)  h       steps, or moving while + or - is held down
  < >          slower, faster                 space   stop
  c            clear a fault                  q       end, with the arm at rest; ? help
Terminals do not report a release: {RELEASE_S:g} s after a held key's last repeat the arm brakes."""


@dataclass
class JogChoice:
    """What the keys move: joint or tool axis, step, speed."""

    joint: int | None = 1
    """Number, from 1; None: the tool."""
    axis: str = "x"
    about: bool = False
    frames: tuple[str, ...] = (BASE, TOOL)
    """Frames to choose from."""
    frame: str = BASE
    """The one whose axes are meant."""
    step: int = 1
    """Index into STEPS."""
    held: bool = False
    speed: int = SPEEDS.index(25)

    @property
    def tool_axis(self) -> str | None:
        """The axis as ``Board.jog`` takes it; None if a joint moves."""
        return None if self.joint is not None else axis_of(self.frame, self.axis)

    def choose(self, frame: str) -> None:
        """Mean the axes of a frame; InputError if it is none to choose from."""
        if frame not in self.frames:
            near = did_you_mean(frame, self.frames)
            raise InputError(f"there is no frame {frame!r}{near}", f"there are {', '.join(self.frames)}")
        self.frame = frame

    def press(self, key: str, joints: int) -> bool:
        """Handle a key that selects something; False if it is another key."""
        if key.isdecimal() and 1 <= int(key) <= joints:
            self.joint = int(key)
        elif key in "xyzXYZ":
            self.joint, self.axis, self.about = None, key.lower(), key.isupper()
        elif key == "f":
            self.frame = self.frames[(self.frames.index(self.frame) + 1) % len(self.frames)]
        elif key == "s":
            self.step, self.held = (self.step + 1) % len(STEPS), False
        elif key == "h":
            self.held = not self.held
        elif key in "<>":
            self.speed = min(max(self.speed + (1 if key == ">" else -1), 0), len(SPEEDS) - 1)
        else:
            return False
        return True

    def describe(self, names: Sequence[str], units: Sequence[JointUnit] = ()) -> str:
        """Describe the choice in a few words; ``units``: of the joints, (): all in degrees."""
        if self.joint is not None:
            what, unit = names[self.joint - 1], (units[self.joint - 1] if units else DEG).sign
        else:
            frame = "" if self.frame == BASE else f"{self.frame}'s "
            what = f"tool {'about' if self.about else 'along'} {frame}{self.axis}"
            unit = "°" if self.about else " mm"
        how = "held" if self.held else f"step {STEPS[self.step]:g}{unit}"
        return f"{what}, {how}, {SPEEDS[self.speed]} %"


class JogScreen:
    """The jog screen; ``loop`` runs it until the user ends it.

    ``more``: keys of the caller, each with a function that gives the text to show; ``more_help``: their help for
    ``?``.
    """

    def __init__(
        self, board: Board, keys: Keys, more: dict[str, Callable[[], str]] | None = None, more_help: str = ""
    ) -> None:
        if board.arm is None:
            raise InputError("no arm is set", "set it with home(arm) or configure(arm)")
        self._arm = board.arm
        self.choice = JogChoice(frames=(BASE, TOOL, *(frame.name for frame in self._arm.frames)))
        self._board = board
        self._keys = keys
        self._more = more or {}
        self._more_help = more_help
        self._said = ""
        self._ended_by = ""

    def loop(self) -> None:
        """Read keys until q, Ctrl-C or the end of the input. LinkError if the board cannot be reached."""
        self._show()
        while True:
            key = self._ended_by or self._keys.read(_IDLE_S)
            if key in _ENDS:
                click.echo()
                if key == INTERRUPT:
                    raise KeyboardInterrupt
                return
            if key:
                self._said = ""
                self._act(key)
                self._show()

    def _act(self, key: str) -> None:
        try:
            if key == "?":
                click.echo(f"{_CLEAR_LINE}{KEYS}\n{self._more_help}".rstrip())
            elif key in self._more:
                self._said = self._more[key]()
            elif key in (*_FORWARD, *_BACKWARD):
                self._move(key, 1 if key in _FORWARD else -1)
            elif key == "c":
                self._board.clear()
                self._said = "cleared"
            elif not self.choice.press(key, len(self._arm.driven)) and key != " ":
                self._said = f"the key {key!r} does nothing here"
        except (BoardError, InputError, PlanError) as error:
            self._said = _short_error(error)
        except LinkError as error:
            if not isinstance(error, BoardError) and "unknown" not in error.problem:
                click.echo()
                raise
            self._said = _short_error(error)

    def _move(self, key: str, sign: int) -> None:
        if self.choice.held:
            self._move_held(key, sign)
            return
        choice = self.choice
        by = sign * STEPS[choice.step]
        by_deg, by_mm = (by, None) if choice.about else (None, by)
        if choice.joint is not None:
            by_deg, by_mm = by_of_joint(self._arm, choice.joint, by)
        self._said = "moving; space stops"
        self._show()
        stop = _StopKeys(self._keys)
        try:
            with stop:
                self._board.jog(
                    choice.joint,
                    by_deg,
                    choice.tool_axis,
                    by_mm,
                    SPEEDS[choice.speed] / 100,
                    stop.request,
                )
            self._said = self._board.last_jog_ends
        except Stopped:
            self._said = "stopped"
        self._end_if(stop.pressed)
        self._keys.flush()

    def _end_if(self, key: str) -> None:
        self._ended_by = key if key in _ENDS else ""

    def _move_held(self, key: str, sign: int) -> None:
        if not self._repeats(key, FIRST_REPEAT_S):
            self._said = "hold the key down"
            return
        choice = self.choice
        held = self._board.held_jog(
            choice.joint, choice.tool_axis, sign, choice.about, SPEEDS[choice.speed] / 100
        )
        self._keys.flush()
        if not self._repeats(key, RELEASE_S):
            return
        with held:
            self._said = f"moving; after release at rest within {held.rest_s + RELEASE_S:.1f} s"
            self._keys.flush()
            last_s = shown_s = time.monotonic()
            while held.hold(_POLL_S):
                now_s = time.monotonic()
                pressed = self._keys.read(0.0)
                if pressed == key:
                    last_s = now_s
                elif pressed or now_s - last_s > RELEASE_S:
                    self._end_if(pressed)
                    break
                if now_s - shown_s > _IDLE_S:
                    shown_s = now_s
                    self._show(held.angles_deg.tolist())
        self._said = held.ends
        self._keys.flush()

    def _repeats(self, key: str, within_s: float) -> bool:
        return self._keys.read(within_s) == key

    def _show(self, angles_deg: list[float] | None = None) -> None:
        names, units = zip(*((joint.name, joint.unit) for joint in self._arm.driven), strict=True)
        try:
            where = self._where(angles_deg or self._board.posture_deg().tolist())
        except LinkError as error:
            where = [error.problem]
        what, width = self.choice.describe(names, units), shutil.get_terminal_size().columns - 1
        if len(f"{what} | {self._said}") > width:  # on lines of its own, as its end may matter most
            click.echo(f"{_CLEAR_LINE}{self._said}")
            self._said = ""
        parts = [what, self._said, *where] if self._said else [what, *where]
        click.echo(f"{_CLEAR_LINE}{fitted(parts, width)}", nl=False)

    def _where(self, angles_deg: list[float]) -> list[str]:
        """Angles and tool pose, the selected ones first."""
        pose = forward(self._arm, angles_deg)
        angles = self._arm.texts.listed((f"{angle + 0.0:.2f}" for angle in angles_deg), " ")
        position = " ".join(f"{value + 0.0:.1f}" for value in pose[:3, 3]) + " mm"
        turned = "rpy " + " ".join(f"{value + 0.0:.1f}" for value in to_rpy_deg(pose)) + "°"
        return [angles, position, turned] if self.choice.joint is not None else [position, turned, angles]


def fitted(parts: list[str], width: int) -> str:
    """The first of ``parts`` (in order of importance) that fit into one line of ``width`` characters."""
    line = parts[0]
    for number, part in enumerate(parts[1:]):
        if len(line) + 3 + len(part) <= width or not number:
            line += f" | {part}"
    return line if len(line) <= width else f"{line[: width - 1]}…"


class _StopKeys:
    """Watches the keys during a step: space, and the keys that end the screen, stop it."""

    def __init__(self, keys: Keys) -> None:
        self.request = StopRequest()
        self.pressed = ""
        """The key that ended the step."""
        self._keys = keys
        self._done = False
        self._thread = Thread(target=self._look, name="armtempo keys", daemon=True)

    def _look(self) -> None:
        while not self._done and not self.pressed:
            key = self._keys.read(_POLL_S)
            if key in (" ", *_ENDS):
                self.pressed = key
                self.request.wanted = True

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *failure: object) -> None:
        self._done = True
        self._thread.join()


def _short_error(error: ArmtempoError) -> str:
    return f"{error.problem}: {error.hint}" if error.hint else error.problem
