"""How fast motions run: in parts of their planned speed, from the start or while they move."""

from __future__ import annotations

from armtempo_shared.messages import PERMILLE, RESUME, SLOWEST_PERMILLE

from armtempo.basics.arguments import checked
from armtempo.basics.errors import InputError
from armtempo.link import Client


@checked
def permille(fraction: float) -> int:
    """The board's number for a part of the planned speed, 0.01 to 1; InputError for another."""
    rate = round(fraction * PERMILLE)
    if not SLOWEST_PERMILLE <= rate <= PERMILLE:
        raise InputError(
            f"a speed of {fraction:g} times the planned one, {100 * fraction:g} %, is not allowed",
            f"give a fraction of {SLOWEST_PERMILLE / PERMILLE:g} to 1 (1 to 100 % on the command line); a quicker "
            "motion needs a plan with higher limits",
        )
    return rate


def change_speed(client: Client, rate: int) -> None:
    """Let what moves continue at ``rate`` (0: pause, RESUME: as before it), and what this program starts later too.

    Raises BoardError if nothing moves, and where the board refuses.
    """
    client.speed(rate)
    if rate not in (0, RESUME):
        client.rate = rate
