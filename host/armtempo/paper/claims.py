"""A printed value next to ours, with a verdict."""

from __future__ import annotations

from dataclasses import dataclass

SAME, BETTER, DIFFERS = "same", "better", "differs"


@dataclass(frozen=True)
class Claim:
    """One value of the paper next to the one found here."""

    where: str
    """Table, figure or section."""
    what: str
    printed: str
    found: str
    verdict: str
    """SAME, BETTER or DIFFERS."""
    because: str = ""
    """Why it differs, with the misprint where there is one; else a remark."""


def compared(where: str, what: str, printed: float, found: float, digits: int, because: str = "") -> Claim:
    """A number printed with ``digits`` decimals: SAME where ours is within one unit of the last."""
    verdict = SAME if abs(found - printed) <= 1.01 * 10.0**-digits else DIFFERS
    text = f"{found:.{digits + 1}f}"
    return Claim(where, what, f"{printed:.{digits}f}", text, verdict, "" if verdict == SAME else because)
