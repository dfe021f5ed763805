"""How much memory the engine for an arm takes on the board: one formula for both sides.

The board takes the memory of its engine once, when its program starts, and states how much that is in hello
(``engine_room``). For each joint the engine takes from it what the step generator works in, and a ring of edge times.
"""

_LASTS_MS = 4
_LEAST_ENTRIES = 64
_MOST_ENTRIES = 1024
_SPARE_ENTRIES = 8  # of a ring, that are not overwritten: as in isr.py
GENERATOR_WORDS = 432
"""Words (4 bytes) of a joint's step generator: pieces 156, their measures 24, control points 52, queue 136, solver 64."""
LARGEST_WORDS = 6 * (GENERATOR_WORDS + 1) + 3840
"""Of any arm whose joints' highest step rates sum up to what the board can step."""


def ring_entries(rate: int) -> int:
    """Entries of the ring of a joint of at most ``rate`` steps/s: a power of two.

    A full ring lasts 4 ms, or has 1024 entries. The interrupt that fills it comes every 0.5 ms; nothing is added in the
    last 390 us.
    """
    wanted = 2 * rate * _LASTS_MS // 1000 + _SPARE_ENTRIES
    entries = _LEAST_ENTRIES
    while entries < min(wanted, _MOST_ENTRIES):
        entries *= 2
    return entries


def words(rates: "list[int]") -> int:
    """Words that the engine takes for joints of these highest step rates; a ring has one behind its entries."""
    return sum([GENERATOR_WORDS + ring_entries(rate) + 1 for rate in rates])
