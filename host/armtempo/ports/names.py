"""Names of ports: a serial device, a URL, or a virtual board; and ids of virtual boards."""

from __future__ import annotations

import os

from armtempo.basics.errors import InputError

TYPE_CHECKING = False  # as in "typing", whose import takes longer than the rest of a stop
if TYPE_CHECKING:
    from pathlib import Path

SIM = "sim"
"""The port name of a virtual board; ``sim:FOLDER``: its flash is that folder."""


VIRTUAL_ID = b"virt".hex()
"""First digits of a virtual board's unique id. On an STM32 these 32 bits are wafer coordinates (RM0090 39.1), which
are never as large as these letters."""


def is_virtual(board_id: str) -> bool:
    """Whether a board with this id in its answer to ``hello`` is a virtual one."""
    return board_id.startswith(VIRTUAL_ID)


def is_sim(port: str) -> bool:
    """Whether the port is a virtual board."""
    return port == SIM or port.startswith(SIM + ":")


def sim_flash(port: str) -> Path | None:
    """The virtual board's flash folder; None: a temporary one.

    Raises InputError if the folder is empty.
    """
    if port == SIM:
        return None
    if port == SIM + ":":
        raise InputError(
            f"port '{port}' has no folder",
            "write sim:FOLDER to keep the flash there, or sim for a temporary one",
        )
    from pathlib import Path  # imported here, because a stop does not need it

    return Path(port[len(SIM) + 1 :])


def same_for_all(port: str) -> str:
    """Canonical name of the port, the same for every program: links followed, paths absolute.

    "" for a virtual board that other programs cannot reach.
    """
    if port == SIM:
        return ""
    if is_sim(port):
        return f"{SIM}:{os.path.realpath(port[len(SIM) + 1 :])}"
    if "://" in port:
        return port
    return port.upper() if os.name == "nt" else os.path.realpath(port)
