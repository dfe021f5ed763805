"""The outputs and inputs of the arm on a board, by the names of its file."""

from __future__ import annotations

import time
from typing import Protocol

from armtempo.basics.errors import LinkError
from armtempo.link.board_messages import Levels
from armtempo.model.arm import Arm
from armtempo.model.outputs import Input, Output

_LOOK_S = 0.02


class Way(Protocol):
    """How to reach the board: a client, or a program that has its port."""

    def set_output(self, number: int, value: int) -> None:
        """Set an output of the arm record, from 0, to a value of 0 to 65535."""

    def levels(self) -> Levels:
        """What inputs and outputs are now."""


class BoardOutput:
    """One output; ``Board.output`` gives it. Every method raises BoardError if the board refuses."""

    def __init__(self, way: Way, arm: Arm, name: str) -> None:
        self._way = way
        self._number = arm.output(name)
        self.output: Output = arm.outputs[self._number]
        """What the arm file says of it."""

    def set(self, value: float | str) -> None:
        """Give it a value in its own unit (0 or 1, duty 0 to 1, degrees), or a state by its name; also while moving.

        Raises InputError for what it cannot take, BoardError while a fault is pending.
        """
        self._way.set_output(self._number, self.output.raw(value))

    @property
    def raw(self) -> int:
        """What the board has last set it to, 0 to 65535 for its whole range."""
        return self._way.levels().outputs[self._number]

    @property
    def value(self) -> float:
        """The same in its own unit."""
        return self.output.value(self.raw)

    @property
    def state(self) -> str:
        """The state that it is in, by its name; "" if its value is none of them."""
        return self.output.state(self.raw)


class BoardInput:
    """One input; ``Board.input`` gives it."""

    def __init__(self, way: Way, arm: Arm, name: str) -> None:
        self._way = way
        self._number = arm.input(name)
        self.input: Input = arm.inputs[self._number]
        """What the arm file says of it."""

    def read(self) -> bool:
        """Whether it is active, debounced."""
        return self._way.levels().active(self._number)

    def wait(self, active: bool = True, timeout_s: float | None = None) -> None:
        """Return when it is active, or not; LinkError if that does not come within ``timeout_s``."""
        limit_s = None if timeout_s is None else time.monotonic() + timeout_s
        while self.read() != active:
            if limit_s is not None and time.monotonic() > limit_s:
                raise LinkError(
                    f"input {self.input.name!r} has not become {'active' if active else 'inactive'} within "
                    f"{timeout_s:g} s",
                    f"look at its wiring (pin {self.input.pin}, active {self.input.active}), or wait longer",
                )
            time.sleep(_LOOK_S)
