"""The arm's outputs and inputs on a board, by the names in its file."""

from __future__ import annotations

import time
from typing import Protocol

from armtempo.basics.arguments import checked_as
from armtempo.basics.errors import LinkError
from armtempo.link.board_messages import Levels
from armtempo.model.arm import Arm
from armtempo.model.outputs import Input, Output
from armtempo.robot.connection import Connection

_LOOK_S = 0.02


class BoardAccess(Protocol):
    """Access to the board: a client, or a program that has its port."""

    def set_output(self, number: int, value: int) -> None:
        """Set an output of the arm record, from 0, to a value of 0 to 65535."""

    def levels(self) -> Levels:
        """The levels of inputs and outputs."""


class BoardOutput:
    """One output; ``Board.output`` gives it. Every method raises BoardError if the board refuses."""

    def __init__(self, access: BoardAccess, arm: Arm, name: str) -> None:
        self._access = access
        self._number = arm.output(name)
        self.output: Output = arm.outputs[self._number]
        """Its description in the arm file."""

    def set(self, value: float | str) -> None:
        """Set a value in the output's unit (0 or 1, duty 0 to 1, degrees), or a state by its name; also
        during a motion.

        Raises InputError for a value outside its range, BoardError while a fault is pending.
        """
        self._access.set_output(self._number, self.output.raw(value))

    @property
    def raw(self) -> int:
        """The value that the board last set, 0 to 65535 for its whole range."""
        return self._access.levels().outputs[self._number]

    @property
    def value(self) -> float:
        """The value that the board last set, in the output's unit."""
        return self.output.value(self.raw)

    @property
    def state(self) -> str:
        """The name of its state; "" if no state has its value."""
        return self.output.state(self.raw)


class BoardInput:
    """One input; ``Board.input`` gives it."""

    def __init__(self, access: BoardAccess, arm: Arm, name: str) -> None:
        self._access = access
        self._number = arm.input(name)
        self.input: Input = arm.inputs[self._number]
        """Its description in the arm file."""

    def read(self) -> bool:
        """Whether it is active, debounced."""
        return self._access.levels().active(self._number)

    def wait(self, active: bool = True, timeout_s: float | None = None) -> None:
        """Wait until the input is ``active``; raises LinkError after ``timeout_s``."""
        limit_s = None if timeout_s is None else time.monotonic() + timeout_s
        while self.read() != active:
            if limit_s is not None and time.monotonic() > limit_s:
                raise LinkError(
                    f"input {self.input.name!r} has not become {'active' if active else 'inactive'} within "
                    f"{timeout_s:g} s",
                    f"look at its wiring (pin {self.input.pin}, active {self.input.active}), or wait longer",
                )
            time.sleep(_LOOK_S)


@checked_as("Board")
class BoardIO:
    """``Board.io``: the arm's outputs and inputs."""

    def __init__(self, board: Connection) -> None:
        self._board = board

    def output(self, name: str) -> BoardOutput:
        """An output of the arm by name; raises InputError if the arm has no such output or is not known."""
        return BoardOutput(self._board.client, self._board.configured_arm(), name)

    def input(self, name: str) -> BoardInput:
        """An input of the arm by name; raises as ``output``."""
        return BoardInput(self._board.client, self._board.configured_arm(), name)
