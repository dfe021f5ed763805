"""Diagnosis of a port on which no armtempo board answers ``hello``."""

from __future__ import annotations

from armtempo_shared import wire
from armtempo_shared.messages import SYNC

from armtempo.basics.errors import DisturbedError, LinkError, NoProgramError
from armtempo.link.transport import Transport

LOOK_S = 0.4
_REPL_SIGNS = (b">>>", b"raw REPL")
"""Bytes that identify a REPL; not the firmware's name, which is also in the answer to ``hello``."""
_FRAME_SIGNS = (bytes((SYNC,)), bytes((wire.EVENT["ok"][1], wire.COMMAND["hello"][1])))
"""A frame's first byte, or the beginning of an answer to ``hello``."""
_ECHO = b"#armtempo?"
_NUDGE = b"\r\x02\r" + _ECHO + b"\r"
"""Ends a line, leaves a raw REPL, and writes a comment, which a prompt echoes even in an unfinished line; the
board program ignores these bytes."""

_ASK = b"print('armtempo','is','here')if'armtempo'in open('/flash/main.py').read()else 0\r"
_HERE = b"armtempo is here"
"""The prompt's answer if the program is in the flash; differs from the echo of the question."""


def explain(transport: Transport, heard: bytes) -> LinkError:
    """The error for what the port sends: nothing, a REPL, parts of frames, or something else; ``heard``:
    bytes received before."""
    transport.write(_NUDGE)
    heard += _listen(transport)
    where = f"the board on {transport.name}"
    if _ECHO in heard or any(sign in heard for sign in _REPL_SIGNS):
        transport.write(_ASK)
        if _HERE in _listen(transport):
            return NoProgramError(
                f"{where} runs MicroPython but not the armtempo program, which is on it: mpremote or an IDE ended it",
                f"press the board's reset button, or: mpremote connect {transport.name} reset; if it does "
                "not start then: armtempo deploy",
            )
        return NoProgramError(
            f"{where} runs MicroPython but not the armtempo program",
            "'armtempo flash' installs the firmware with it; then run 'armtempo deploy'",
        )
    if any(sign in heard for sign in _FRAME_SIGNS):
        return DisturbedError(
            f"{where} is mostly unreadable: only parts of armtempo's messages arrive",
            "check cable and plugs",
        )
    if heard:
        return LinkError(
            f"something other than armtempo answers on {transport.name} (it says {_excerpt(heard)})",
            "choose another port: 'armtempo ports' lists them",
        )
    return LinkError(
        f"{where} does not answer within 2 s",
        (
            "check the cable, that the board is powered, and that this is its port ('armtempo ports'); reset a "
            "board that hangs by its button"
        ),
    )


def _listen(transport: Transport) -> bytes:
    heard = b""
    for _ in range(4):
        heard += transport.read(LOOK_S / 4)
    return heard


def _excerpt(heard: bytes) -> str:
    return repr(heard[:40])[1:]
