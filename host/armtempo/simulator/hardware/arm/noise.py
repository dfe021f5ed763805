"""Random numbers that are the same on every interpreter."""

_MULTIPLIER = 48271  # Park and Miller, Communications of the ACM 36 (1993) 7, page 105
_MODULUS = 0x7FFFFFFF


class Noise:
    """A stream of numbers from a seed."""

    def __init__(self, seed):
        self._state = seed % (_MODULUS - 1) + 1
        for _ in range(8):
            self.uniform()

    def uniform(self):
        """In (0, 1)."""
        self._state = self._state * _MULTIPLIER % _MODULUS
        return self._state / _MODULUS

    def normal(self):
        """Standard normal, as near as the sum of twelve uniform numbers is."""
        return sum([self.uniform() for _ in range(12)]) - 6.0
