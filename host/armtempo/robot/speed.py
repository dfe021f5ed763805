"""The speed of motions, as a fraction of the planned speed."""

from __future__ import annotations

from armtempo_shared.messages import PERMILLE, RESUME, SLOWEST_PERMILLE

from armtempo.basics.arguments import checked
from armtempo.basics.errors import InputError
from armtempo.link import Client


@checked
def permille(fraction: float) -> int:
    """A fraction of the planned speed, 0.01 to 1, in thousandths; raises InputError for another."""
    rate = round(fraction * PERMILLE)
    if not SLOWEST_PERMILLE <= rate <= PERMILLE:
        raise InputError(
            f"a speed of {fraction:g} times the planned one, {100 * fraction:g} %, is not allowed",
            f"give a fraction of {SLOWEST_PERMILLE / PERMILLE:g} to 1 (1 to 100 % on the command line); a faster "
            "motion needs a plan with higher limits",
        )
    return rate


def change_speed(client: Client, rate: int) -> None:
    """Set the speed of the running and of later motions to ``rate`` thousandths (0: pause, RESUME: end of the pause).

    Raises BoardError if nothing moves, or the board refuses.
    """
    client.speed(rate)
    if rate not in (0, RESUME):
        client.rate = rate
