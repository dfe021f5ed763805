"""A printed value beside ours, with a verdict."""

from __future__ import annotations

from dataclasses import dataclass

SAME, BETTER, DIFFERS = "same", "better", "differs"


@dataclass(frozen=True)
class Claim:
    """One value of the paper and what became of it here."""

    where: str
    """Table, figure or section."""
    what: str
    printed: str
    found: str
    verdict: str
    """SAME, BETTER or DIFFERS."""
    because: str = ""
    """Why it differs, the misprint named; or what to know."""


def compared(
    where: str,
    what: str,
    printed: float,
    found: float,
    digits: int,
    because: str = "",
    smaller_wins: bool = False,
) -> Claim:
    """A number printed with ``digits`` decimals: same where ours rounds to it within one unit of the last.

    With ``smaller_wins`` a smaller number is BETTER.
    """
    unit = 10.0**-digits
    if abs(found - printed) <= 1.01 * unit:
        verdict = SAME
    else:
        verdict = BETTER if smaller_wins and found < printed else DIFFERS
    text = f"{found:.{digits + 1}f}"
    return Claim(where, what, f"{printed:.{digits}f}", text, verdict, "" if verdict == SAME else because)
