"""A board's REPL, through mpremote: runs code there, and reads its results as JSON."""

from __future__ import annotations

import json
import time
from binascii import unhexlify
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout, suppress
from dataclasses import dataclass
from io import StringIO
from typing import Any

import serial

from armtempo.basics.errors import LinkError

_SILENCE_S = 20.0
"""Longest time without a byte from running code; longer than the board's watchdog."""
_READ_S = 5.0
_ENTER_S = 30.0
_BULK = b"#"
_BLOCKS, _BLOCK = 32, 512
"""Data to measure the rates: 16 KB in each direction. To the board it is a comment, which needs no heap."""
CONTINUE = "import armtempo_board\narmtempo_board.start()"
"""Continue the board program in its state before it was left; not after a soft reset."""
RESET = "import machine\nmachine.reset()"
"""As the reset button: the program starts again, and nothing of the REPL remains."""
WATCHDOG_RESET = f"""import machine, time
from armtempo_board.app.watchdog import _kept
if _kept: _kept.deinit()
machine.WDT(timeout=100)
time.sleep(2)
{RESET}"""
"""The same by the watchdog, which is not fed; by ``RESET`` if that fails."""
_PARTS = "armtempo_board.selftest"
"""Package of the board program with the parts."""
PARTS = ("drivers", "identity", "cycles", "encoders", "pulses", "estop", "rates", "keep")
"""The board stores the number of the running one, from 1, over a reset."""


class PartError(LinkError):
    """The code of a part raised an exception on the board."""


class SilentError(LinkError):
    """The board does not answer in ``part``."""

    def __init__(self, part: str, problem: str) -> None:
        super().__init__(problem, _cure(part))
        self.part = part


@dataclass(frozen=True)
class Measured:
    """Result of a part."""

    values: dict[str, Any]
    bulk: bytes
    noted: int
    """Number of an earlier part that hung; 0 for none."""


class Prompt:
    """The raw REPL at a port; raises LinkError, with the part, if it does not answer."""

    def __init__(self, port: Any) -> None:
        self._port = port
        self.at_end = CONTINUE
        """Code that is run whenever the REPL is left."""

    def enter(self, soft_reset: bool) -> None:
        """Enter the raw REPL; ``soft_reset``: with an empty heap, and without the board program."""
        with _as_link_error("start"):
            self._port.enter_raw_repl(soft_reset, timeout_overall=_ENTER_S)

    def measure(self, part: str, **arguments: Any) -> Measured:
        """Run a part of the board program with these arguments."""
        call = f"run({PARTS.index(part) + 1}, {part!r}, {arguments!r})"
        return self._run(part, f"from {_PARTS}.run import run\ntry: {call}\nfinally: del run\n")

    def rates(self) -> dict[str, float]:
        """Kilobytes per second, from the board and to it."""
        with _as_link_error("link"):
            self._port.exec_raw_no_follow(f"for _ in range({_BLOCKS}): print(end='x' * {_BLOCK})")
            begin_s = time.perf_counter()
            left = _BLOCKS * _BLOCK
            while left and (got := self._port.serial.read(min(left, self._port.serial.in_waiting or 1))):
                left -= len(got)
            down_s = time.perf_counter() - begin_s
            self._port.follow(_SILENCE_S)
            begin_s = time.perf_counter()
            self._port.exec_raw(f"#{'x' * (_BLOCKS * _BLOCK)}", timeout=_SILENCE_S)
            up_s = time.perf_counter() - begin_s
        size_kb = _BLOCKS * _BLOCK / 1000
        return {"down_kb_s": round(size_kb / down_s, 1), "up_kb_s": round(size_kb / up_s, 1)}

    def _run(self, part: str, code: str) -> Measured:
        with _as_link_error(part):
            output, errors = self._port.exec_raw(code, timeout=_SILENCE_S)
        if errors:
            last = errors.decode(errors="replace").strip().splitlines()[-1]
            raise PartError(f"self-test, {part}: {last}", _cure(part))
        lines = output.splitlines()
        bulk = b"".join(unhexlify(line[1:].strip()) for line in lines if line.startswith(_BULK))
        values = json.loads(next((line for line in reversed(lines) if line.startswith(b"{")), b"{}"))
        return Measured(values, bulk, values.pop("noted", 0))


@contextmanager
def at_prompt(device: str) -> Iterator[Prompt]:
    """The REPL of the board on ``device``, whose program was left; at the end the program runs again."""
    from mpremote.transport import TransportError  # here, as few commands need it
    from mpremote.transport_serial import SerialTransport

    try:
        port = SerialTransport(device, timeout=_READ_S)
    except (TransportError, OSError) as error:
        raise LinkError(
            f"port {device} cannot be opened again: {error}", "run the self-test again"
        ) from error
    prompt = Prompt(port)
    try:
        yield prompt
    finally:
        with suppress(Exception):
            port.serial.write(b"\r\x03\x03\x01" + prompt.at_end.encode() + b"\x04")
            port.serial.flush()
        port.close()


@contextmanager
def _as_link_error(part: str) -> Iterator[None]:
    from mpremote.transport import TransportError

    try:
        with redirect_stdout(StringIO()):  # mpremote prints unexpected answers
            yield
    except (TransportError, serial.SerialException, OSError) as error:
        raise SilentError(
            part, f"the board fell silent in {part!r} ({error}); its watchdog resets it within 10 s"
        ) from error


def _cure(part: str) -> str:
    return f"run the self-test again; if {part!r} fails each time, please report it with the output"
