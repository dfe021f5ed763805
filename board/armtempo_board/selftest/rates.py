"""Whether the joints keep up with a step rate: a motion that reaches it, in the program's own loop, with a host."""

import time
from array import array
from binascii import unhexlify

from armtempo_shared import codes

from armtempo_board.app.app import App
from armtempo_board.buffers import COMMANDED
from armtempo_board.selftest import capture
from armtempo_board.selftest.bare_engine import load, make_engine
from armtempo_board.selftest.common import count_cycles, cycles, enable, feed

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

_COMMAND_MS = 20


class Host:
    """In the place of the serial port: a command every 20 ms, and nobody who reads what the board says."""

    def __init__(self, frames: "list[bytes]") -> None:
        self._hello, *self._commands = frames
        self._left = b""
        self._then_ms = time.ticks_ms()
        self.sent = 0

    def readinto(self, buffer: bytearray, size: int) -> "int | None":
        """What has been received, as of a port."""
        if not self._left and time.ticks_diff(time.ticks_ms(), self._then_ms) >= _COMMAND_MS:
            self._then_ms = time.ticks_ms()
            other = self.sent % 2
            self._left = self._commands[1 - other] if self.sent else self._hello
            self.sent += 1
        piece = self._left[:size]
        self._left = self._left[size:]
        buffer[: len(piece)] = piece
        return len(piece) or None

    def write(self, data: bytes, start: int, size: int) -> int:
        """All is taken."""
        return size


def measure(
    record: str,
    motion: str,
    rates: "list[int]",
    frames: "list[str]",
    idle_us: int,
    watch: "tuple[str, int] | None" = None,
) -> "dict[str, Any]":
    """The first joints of the arm, one for each of ``rates``, from step 0 on: fault, passes of the loop, the longest.

    ``frames``: hello, then two commands that take turns. ``watch``: a port, and the microsecond at which its capture
    ends: the steps on its pins in the 4 ms before are measured.
    """
    feed()
    count_cycles()
    port, until_us = watch or ("", 0)
    captures = capture.captured(record, len(rates), 0, port)[0] if watch else []
    host = Host([unhexlify(frame) for frame in frames])
    app = App(host, "/none")  # no arm is stored there: no pin is touched
    engine, _ = make_engine(record, rates=rates, engine_memory=app.controller.board.engine_memory)
    hand_over(app.controller, engine, len(rates))
    engine.skip_check = True  # a rate is tried that is not allowed
    longest = 0
    try:
        loaded = load(engine, unhexlify(motion), [0] * len(rates))
        if captures:
            capture.begin(captures)
        app.controller.start_loaded(loaded, 0)
        begun_us = time.ticks_us()
        then = cycles()
        while app.controller.running:
            app.run_once()
            if captures and time.ticks_diff(time.ticks_us(), begun_us) > until_us:
                capture.end(captures)
            if idle_us:
                time.sleep_us(idle_us)
            now = cycles()
            if app.controller.running:  # else it is the end, which nothing waits for
                longest = max(longest, (now - then) & 0xFFFFFFFF)
            then = now
    finally:
        engine.freeze()
        if captures:
            capture.end(captures)
        off = enable()
        engine.close()
    fault = app.controller.board.fault()
    if fault == codes.ESTOP:
        raise ValueError("the E-stop was pressed")
    return {
        "fault": fault,
        "passes": app.passes,
        "longest_pass_cycles": longest,
        "commands": host.sent,
        "steps": captures[0].window() if captures else {},
        "enable": off,
    }


def hand_over(controller: "Any", engine: "Any", joints: int) -> None:
    """The controller has this engine, as when it takes an arm."""
    controller.board.engine = engine
    controller.board.joints = joints
    controller.board.raw = array("i", [0] * (COMMANDED + 2 * joints))
    controller.board.samples.configure(joints)
