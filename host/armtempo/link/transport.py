"""Byte streams to and from a board: a serial port, or whatever pyserial can open."""

from __future__ import annotations

import errno
import os
import sys
from contextlib import suppress
from typing import Protocol

import serial

from armtempo.basics.errors import InputError, LinkError, PortError, PortInUseError

BAUD_RATE = 115_200
"""Only used by a UART between host and board; no effect over USB."""
_ADVICE = "'armtempo ports' lists the ports"
# TypeError: pyserial's, if another thread has closed it
_BROKEN = (
    serial.SerialException,
    OSError,
    TypeError,
)


class Transport(Protocol):
    """A pair of byte streams."""

    name: str

    def read(self, timeout_s: float) -> bytes:
        """The received bytes; waits up to ``timeout_s`` for the first, then returns ``b""``."""

    def write(self, data: bytes) -> None:
        """Send all of it."""

    def wake(self) -> None:
        """Make the waiting or the next read return; for other threads and signal handlers. May do nothing."""

    def close(self) -> None:
        """Free the port; may be called twice."""


class SerialTransport:
    """A transport over pyserial: a device name, or a URL such as ``socket://host:port``.

    Raises InputError if there is no such port, PortInUseError if another program has it, PortError if it
    cannot be opened for another reason, LinkError if it breaks.
    """

    def __init__(self, port: str, exclusive: bool = True) -> None:
        """``exclusive``: fail if another program has the port open, if the operating system can detect it."""
        self.name = port
        self._serial = _open(port, exclusive)

    def read(self, timeout_s: float) -> bytes:
        try:
            self._serial.timeout = timeout_s
            return bytes(self._serial.read(max(1, self._serial.in_waiting)))
        except _BROKEN as error:
            raise _broken(self.name, error) from error

    def write(self, data: bytes) -> None:
        try:
            self._serial.write(data)
        except _BROKEN as error:
            raise _broken(self.name, error) from error

    def wake(self) -> None:
        with suppress(serial.SerialException, OSError, AttributeError, TypeError):  # not all URLs have it
            self._serial.cancel_read()

    def close(self) -> None:
        self._serial.close()


def _open(port: str, exclusive: bool) -> serial.Serial:
    try:
        device = serial.serial_for_url(port, do_not_open=True)
        device.baudrate = BAUD_RATE
        device.write_timeout = 2.0
        if exclusive and "://" not in port:
            device.exclusive = True
        device.open()
    except ValueError as error:
        raise InputError(f"{port}: not a port or URL: {error}", f"{_ADVICE}") from error
    except (serial.SerialException, OSError) as error:
        raise _open_error(port, error) from error
    return device


def _broken(port: str, error: Exception) -> LinkError:
    """The error for a port that has disappeared; pyserial's text ("reports readiness to read") does not help."""
    unplugged = not os.path.exists(port) or "returned no data" in str(error)
    reason = "its cable was unplugged, or the board was reset" if unplugged else str(error)
    return LinkError(
        f"the connection to {port} broke: {reason}",
        "plug it in again and close other programs on this port; then 'armtempo status' shows the arm's position",
    )


def _open_error(port: str, error: Exception) -> PortError | InputError:
    number = getattr(error, "errno", None)
    text = str(error)
    if number == errno.ENOENT or "FileNotFoundError" in text:
        return InputError(f"there is no port {port or chr(39) * 2}", f"{_ADVICE}")
    if number in (errno.EISDIR, errno.ENOTTY) or os.strerror(errno.ENOTTY) in text:
        return InputError(f"{port} is not a serial port", f"{_ADVICE}")
    if number in (errno.EBUSY, errno.EAGAIN) or "exclusively lock" in text:
        return PortInUseError(f"port {port} is in use by another program", "close it and try again")
    if number == errno.EACCES or "PermissionError" in text:
        kind = PortInUseError if sys.platform == "win32" else PortError  # Windows: of a port in use
        return kind(
            f"no permission to open {port}: another program holds it, or your user may not use serial ports",
            "close the other program, or on Debian: 'sudo adduser $USER dialout', then log in again",
        )
    return PortError(f"port {port} cannot be opened: {text}", f"{_ADVICE}")
