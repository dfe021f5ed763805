"""Following error: the deviation of an encoder from the commanded steps."""

from armtempo_shared import armrecord


class FollowingError:
    """``row``: the joint's part of the arm record."""

    def __init__(self, row: "dict[str, int]") -> None:
        numerator, denominator = row["counts_num"], row["counts_den"]
        common = _common_divisor(abs(numerator), denominator) or 1
        self._numerator = numerator // common
        self._denominator = (denominator // common) or 1
        self.limit = 0 if row["encoder"] == armrecord.NONE else row["following_counts"]

    def expected(self, steps: int) -> int:
        """Encoder counts for a commanded position; uses small integers, so that nothing is allocated."""
        whole = steps // self._denominator
        part = steps - whole * self._denominator
        return whole * self._numerator + part * self._numerator // self._denominator

    def is_exceeded(self, steps: int, counts: int) -> bool:
        """Whether the following error exceeds the arm file's limit; never without a limit."""
        return self.limit > 0 and abs(counts - self.expected(steps)) > self.limit


def _common_divisor(a: int, b: int) -> int:
    while b:
        a, b = b, a % b
    return a
