"""The port to use if none is given."""

from __future__ import annotations

from armtempo.basics.errors import InputError
from armtempo.basics.settings import PORT, ProjectSettings, Setting, nothing_set
from armtempo.ports import claim
from armtempo.ports.caller import Ownership, ownership
from armtempo.ports.listing import find_ports
from armtempo.ports.names import SIM

ONLY_BOARD = "the only board plugged in"
ONLY_OPEN = "the only port that an armtempo program has open"
UNASKED = (ONLY_BOARD, ONLY_OPEN)
"""Sources of a default port; such a choice is printed."""


def choose(given: str | None = None, others: bool = False) -> Setting:
    """The port to use, and its source: ``given``, the variable, the project folder, else the only likely board.

    ``others``: also accept the only port that another armtempo program has open, for commands that work
    through that program. Raises InputError if there is no port, or more than one.
    """
    found = ProjectSettings().get(PORT, given)
    if found:
        return found
    candidates = _open_ports() if others else []
    why = ONLY_OPEN
    if not candidates:
        candidates = [port.device for port in find_ports() if port.board]
        why = ONLY_BOARD
    if len(candidates) == 1:
        return Setting(PORT, candidates[0], why)
    raise _unclear(candidates)


def _open_ports() -> list[str]:
    lives = [one for one in claim.claims() if ownership(one) is not Ownership.DEAD]
    return sorted({one.port for one in lives})


def _unclear(candidates: list[str]) -> InputError:
    seen = (
        f"{len(candidates)} could be meant: {', '.join(candidates)}"
        if candidates
        else "none is plugged in ('armtempo ports' lists the ports)"
    )
    return nothing_set(PORT, f"which board? {seen}. '--port {SIM}' is a virtual one; for a real one")
