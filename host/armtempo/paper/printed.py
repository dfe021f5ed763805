"""The paper's tables and figures as data, with their misprints; a printed value compared with ours."""

from __future__ import annotations

from dataclasses import dataclass

SAME, BETTER, DIFFERS = "same", "better", "differs"
POSE = (
    (0.0, 0.0, -1.0, -268.202),
    (0.0, 1.0, 0.0, 0.0),
    (1.0, 0.0, 0.0, 217.349),
    (0.0, 0.0, 0.0, 1.0),
)
"""Eq. (16), lengths in cm of the full-size arm."""
SCALE_MM = 2.0
"""Millimetres of the 1:5 arm per centimetre of the full-size arm."""
SOLUTIONS = (
    (180.0, -38.0, -52.0, 0.0, 0.0, 0.0),
    (180.0, -38.0, -52.0, 180.0, 0.0, 180.0),
    (180.0, -16.1, -91.1, 0.0, 17.3, 0.0),
    (180.0, -16.1, -91.1, 180.0, -17.3, 0.0),
    (0.0, -93.2, -157.5, 0.0, -19.2, 180.0),
    (0.0, -93.2, -157.5, 180.0, 19.2, 0.0),
    (0.0, 168.3, 14.4, 0.0, 267.3, 180.0),
    (0.0, 168.3, 14.4, 180.0, 92.8, 0.0),
)
"""Table 2, degrees."""
SOLUTION_MISPRINT = (3, 5)
"""Row and column of SOLUTIONS that must be 180 instead of 0."""
UNOPTIMISED_PEAKS = (29.12, 15.76)
"""Joint 1, quintic, six intervals of 2 s: speed (deg/s) and acceleration (deg/s2); section 2.3."""
INTERVALS_S = (
    (1.514, 0.498, 1.638, 0.713, 0.257, 1.413),
    (1.132, 1.613, 2.045, 0.221, 0.461, 0.988),
    (0.776, 1.174, 1.608, 0.732, 0.782, 1.746),
)
"""Table 6, by joint."""
TOTALS_S = (6.033, 6.460, 6.818)
"""Table 6, sums."""
REDUCTION = 0.464
"""Fraction of the unoptimised 3 x 12 s saved; section 3.3."""
CUBIC_GAIN = 0.069
"""Fraction by which the cubic motion of joint 1 is shorter than the quintic; section 4.2."""
SEARCHES_S = {
    "ga": {10: 10.491, 50: 8.498, 100: 6.766, 500: 6.161},
    "iaga": {10: 10.550, 50: 7.411, 100: 6.416, 500: 6.304},
    "pso": {10: 6.722, 50: 6.338, 100: 6.250, 500: 6.146},
    "hpso": {10: 6.469, 50: 6.162, 100: 6.126, 500: 6.129},
    "cs": {10: 6.047, 50: 6.069, 100: 6.064, 500: 6.058},
    "acs": {10: 6.034, 50: 6.045, 100: 6.047, 500: 6.054},
}
"""Table 4: fitness of joint 1 by algorithm and population."""


@dataclass(frozen=True)
class Claim:
    """A value of the paper compared with ours."""

    where: str
    """Table, figure or section."""
    what: str
    printed: str
    found: str
    verdict: str
    """SAME, BETTER or DIFFERS."""
    because: str = ""
    """Reason of a difference, such as a misprint; otherwise a remark."""


def compared(where: str, what: str, printed: float, found: float, digits: int, because: str = "") -> Claim:
    """Compare a number printed with ``digits`` decimals: SAME if ours is within one unit of the last."""
    verdict = SAME if abs(found - printed) <= 1.01 * 10.0**-digits else DIFFERS
    text = f"{found:.{digits + 1}f}"
    return Claim(where, what, f"{printed:.{digits}f}", text, verdict, "" if verdict == SAME else because)
