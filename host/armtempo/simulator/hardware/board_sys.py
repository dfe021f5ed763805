"""The board program's ``sys``: the interpreter's own, with the STM32 port's name, and the serial port as stdio."""

import sys as _own

import machine_state as _the
from firmware import repl as _repl

platform = "pyboard"


class _Implementation(tuple):
    """As in the firmware for the STM32F4DISC; version and ``.mpy`` format are the interpreter's."""

    name = "micropython"
    version = tuple(_own.implementation.version[:3]) + ("",)
    _build = "STM32F4DISC"
    _mpy = getattr(_own.implementation, "_mpy", 0)

    @property
    def _machine(self):
        return _the.options["machine"]


implementation = _Implementation()


class _Stdout:
    """``sys.stdout``."""

    def write(self, data):
        """Show text or bytes."""
        _repl.show(data if isinstance(data, str) else bytes(data).decode())
        return len(data)

    def flush(self):
        """Does nothing: there is no buffer."""


class _Stdin:
    """``sys.stdin``."""

    def read(self, count):
        """Read ``count`` bytes; waits for them."""
        return _the.port.recv(count, timeout=1 << 30)


stdout = _Stdout()
stdout.buffer = stdout
stdin = _Stdin()
stdin.buffer = stdin


def __getattr__(name):
    return getattr(_own, name)
