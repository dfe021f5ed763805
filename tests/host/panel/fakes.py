"""The board, the operator and the arm of the panel's tests."""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from armtempo.basics.errors import LinkError
from armtempo.link.board_messages import Levels, StoredMotion
from armtempo.model.arm import Arm
from armtempo.panel.job_editor import JobEditor
from armtempo.panel.panel_board import Needs, PanelBoard
from armtempo.panel.press import Press
from armtempo.robot.board_state import BoardState, JointState
from armtempo.robot.stop_request import StopRequest

ARM = Arm.paper()
ME, OTHER = "me", "other"
HELD_S = 2.0
"""In place of ALIVE_S: a busy machine is silent for longer than that."""
_NUMBERS = itertools.count(1)


def operator(board: Board, folder: Path, arm: Arm = ARM) -> PanelBoard:
    """Of this board, with the jobs and runs of a folder."""
    return PanelBoard(lambda sink, tell: board, "sim", JobEditor(arm, folder, None), folder / "runs")  # type: ignore[arg-type, return-value]


def press(operator: PanelBoard) -> Press:
    """One that is made now."""
    return Press(next(_NUMBERS), operator.presses.state, operator.presses.clock())


def do(
    operator: PanelBoard, what: str, client: str, call: Callable[[], object], needs: Needs = Needs.MOVE
) -> None:
    """Start a command with a press that is made now."""
    operator.do(what, client, press(operator), call, needs)


def wait(condition: Callable[[], bool]) -> None:
    """Until it holds."""
    limit_s = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < limit_s
        time.sleep(0.005)


class Clock:
    """One that stands still."""

    now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


class Session:
    """A session of nobody's."""

    def listen(self, listener: object) -> None:
        """Nothing is to be heard."""

    def by_turns(self, timeout_s: float) -> Any:
        raise LinkError("nothing answers")


class Jog:
    """A held jog that lasts until it is no longer held."""

    def __init__(self) -> None:
        self.held = 0
        self.ends = ""
        self.angles_deg = ARM.home_deg
        self.ended = threading.Event()

    def __enter__(self) -> Jog:
        return self

    def hold(self, seconds: float) -> bool:
        self.held += 1
        time.sleep(seconds / 10)
        return True

    def __exit__(self, *_: object) -> None:
        self.ended.set()


class Board:
    """A board that jogs, and notes what else is asked of it."""

    def __init__(self) -> None:
        self.calls: list[tuple[object, ...]] = []
        """What was called, with its arguments."""
        self.stored = [StoredMotion("feed", 100, 1, 0, 3, False)]
        self.info = type("Info", (), {"virtual": True})()
        self.client = type(
            "Client", (), {"session": Session(), "drivers": staticmethod(self._noted("drivers"))}
        )()
        self.jog = Jog()
        self.asked: list[tuple[bool, str]] = []
        """The stops."""
        self.stops: list[StopRequest] = []
        self.moves = True
        self.homes: list[object] = []
        """What was declared to be at home: None for all joints."""

    def _noted(self, *name: object) -> Any:
        return lambda *given, **more: self.calls.append((*name, *given))

    def __getattr__(self, name: str) -> Any:
        return self._noted(name)

    def list(self) -> list[StoredMotion]:
        return self.stored

    def output(self, name: str) -> Any:
        return type("Output", (), {"set": staticmethod(self._noted("output", name))})

    def selftest(self, progress: object) -> Any:
        self.calls.append(("selftest",))
        line = {"verdict": "ok", "part": "pulses", "what": "w", "measured": "1", "expected": "1", "cure": ""}
        return type("SelfTest", (), {"to_json": lambda _: {"lines": [line]}})()

    def configure(self, arm: Arm) -> None:
        """It has this arm."""

    def close(self) -> None:
        """Nothing is open."""

    def home(self, arm: Arm, joint: object = None) -> None:
        self.homes.append(joint)

    def home_to_switches(self, arm: Arm, joint: object, progress: Callable[[str, int, int], object]) -> None:
        progress(f"{joint}: switch seen", 1, 2)

    def request_stop(self, now: bool, by: str) -> bool:
        self.asked.append((now, by))
        for one in self.stops:
            one.ask(by)
        return self.moves


def board_state(**changed: Any) -> BoardState:
    """What a board at rest says, whose arm is at home."""
    joints = tuple(
        JointState(joint.name, True, 0, angle, 0, None)
        for joint, angle in zip(ARM.driven, ARM.home_deg, strict=True)
    )
    found = {field.name: "" for field in fields(BoardState)} | {
        "virtual": False, "moving": False, "speed_percent": 100.0, "state": "idle", "joints": joints, "sequence": None,
        "port": "port",
    }  # fmt: skip
    return BoardState(**{**found, **changed})


def unhomed() -> BoardState:
    """What a board says that does not know where its arm is."""
    joints = board_state().joints
    return board_state(joints=tuple(replace(joint, known=False, angle_deg=0.0) for joint in joints))


class Telling:
    """A board that says where its arm is, with the gripper of ``arms`` closed."""

    def __init__(self, state: BoardState) -> None:
        self._state = state
        self.client = type("Client", (), {"levels": lambda _: Levels(0b1, (34588,))})()

    def state(self, arm: Arm) -> BoardState:
        return self._state
