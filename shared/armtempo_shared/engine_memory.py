"""How much memory the engine for an arm takes on the board: one formula for both sides.

The board takes the memory of its engines once, when its program starts, and states in hello how much that is
(``engine_room``), and for how many joints' objects there is heap besides (``engine_joints``). It consists of blocks,
because a heap has few large ones. For each joint the engine takes from it a ring of edge times, and what the step
generator works in.
"""

_LASTS_MS = 3
_LEAST_ENTRIES = 64
_MOST_ENTRIES = 1024
_SPARE_ENTRIES = 8  # of a ring, that are not overwritten: as in isr.py
GENERATOR_PARTS = (136, 64, 78, 78, 20, 20, 12, 12)
"""Words (4 bytes) of a joint's step generator, in the order in which they are taken.

The queue of steps, the solver; pieces of angle and of time, their control points, their measures.
"""
GENERATOR_WORDS = sum(GENERATOR_PARTS)
_BLOCK_WORDS = 1026  # for a ring of 1024 entries, or two of 512
LARGEST_WORDS = 6 * GENERATOR_WORDS + 5 * 513 + 257
"""For any arm whose joints' highest step rates sum up to 240 000 steps/s."""


def ring_words(rate: int) -> int:
    """Words of the ring of a joint of at most ``rate`` steps/s: one more than its entries, which are a power of two.

    A full ring lasts 3 ms, or has 1024 entries. The interrupt that fills it comes every 0.5 ms; nothing is added in the
    last 390 us.
    """
    wanted = 2 * rate * _LASTS_MS // 1000 + _SPARE_ENTRIES
    entries = _LEAST_ENTRIES
    while entries < min(wanted, _MOST_ENTRIES):
        entries *= 2
    return entries + 1


def words(rates: "list[int]") -> int:
    """Words that the engine takes for joints of these highest step rates, in steps/s."""
    return sum([GENERATOR_WORDS + ring_words(rate) for rate in rates])


def object_bytes(joints: int) -> int:
    """Bytes of heap that the engine's objects take besides: measured, see board/docs/memory.md."""
    return 1760 + 1184 * joints


def blocks(room_words: int) -> "list[int]":
    """The blocks, in words, of a memory of so many words."""
    return [min(_BLOCK_WORDS, room_words - begin) for begin in range(0, room_words, _BLOCK_WORDS)]


def fits(rates: "list[int]", room_words: int) -> bool:
    """Whether all parts of the engine find their place: the largest rings first, each in the first block with room."""
    free = blocks(room_words)
    parts = sorted([ring_words(rate) for rate in rates], reverse=True)
    for _ in rates:
        parts.extend(GENERATOR_PARTS)
    for part in parts:
        for number, left in enumerate(free):
            if left >= part:
                free[number] -= part
                break
        else:
            return False
    return True
