"""How much memory the engine for an arm takes on the board: one formula for both sides.

The board states in hello how many bytes of its heap an engine can have (``engine_room``), its objects and its memory.
The memory consists of blocks, because a heap has few large ones. For each joint the engine takes from it a ring of edge
times. What the step generators work in lies in ``PROCESSOR_WORDS`` besides, as far as it has room there, and the rest
in these blocks too.
"""

LASTING_MS = (12, 6, 3, 2)
"""So long a full ring lasts: the first for which there is memory. Long ones are filled less often, which is what the
interrupt spends most on (board/docs/evaluator.md)."""
SHORT_MS = LASTING_MS[-1]
_LEAST_ENTRIES = 64
_MOST_ENTRIES = 1024
_SPARE_ENTRIES = 8  # of a ring, that are not overwritten: as in isr.py
PROCESSOR_WORDS = 1024
"""Words (4 bytes) that the processor alone reaches: the chip's backup SRAM, which is no part of MicroPython's heap
(hardware/backup_sram.py of the board program). So none of them are for rings, which DMA reads."""
GENERATOR_PARTS = (78, 78, 20, 20, 12, 12, 49, 26, 128)
"""Words of a joint's step generator, in the order in which they are taken.

Pieces of angle and of time, their control points, their measures; the solver, the law of time, the queue of steps.
"""
GENERATOR_WORDS = sum(GENERATOR_PARTS)
_BLOCK_WORDS = 1026  # for a ring of 1024 entries, or two of 512
LARGEST_WORDS = 6 * GENERATOR_WORDS - PROCESSOR_WORDS + 1025 + 513 + 257 + 129 + 2 * 65 + 9
"""For arms whose joints' highest step rates sum up to 240 000 steps/s; some have rings of SHORT_MS then.

The last words are left over at the ends of blocks.
"""


def ring_words(rate: int, lasts_ms: int) -> int:
    """Words of the ring of a joint of at most ``rate`` steps/s: one more than its entries, which are a power of two.

    A full ring lasts ``lasts_ms``, or has 1024 entries. The interrupt that fills it comes every 0.5 ms; nothing is
    added in the last 390 us.
    """
    wanted = 2 * rate * lasts_ms // 1000 + _SPARE_ENTRIES
    entries = _LEAST_ENTRIES
    while entries < min(wanted, _MOST_ENTRIES):
        entries *= 2
    return entries + 1


def words(rates: "list[int]") -> int:
    """Words that the engine takes at least for joints of these highest step rates, in steps/s."""
    return sum(_parts(rates, SHORT_MS))


def object_bytes(joints: int) -> int:
    """Bytes of heap that the engine's objects take: measured, see board/docs/memory.md."""
    return 1760 + 1184 * joints


LARGEST_BYTES = 4 * LARGEST_WORDS + object_bytes(6)
"""The room in which every arm fits."""


def needed_bytes(rates: "list[int]") -> int:
    """Bytes of heap that the engine takes at least for joints of these highest step rates, with its objects."""
    return 4 * words(rates) + object_bytes(len(rates))


def room_words(joints: int, room_bytes: int) -> int:
    """Words that a room leaves for an engine's memory besides the objects of that many joints."""
    return min(max((room_bytes - object_bytes(joints)) // 4, 0), LARGEST_WORDS)


def ahead_bytes(joints: int) -> int:
    """Bytes of heap that preparing a sequence's next motion takes: a second step generator for each joint.

    With its objects, and the files that it reads: measured, see board/docs/memory.md.
    """
    return (4 * GENERATOR_WORDS + 880) * joints


def blocks(memory_words: int) -> "list[int]":
    """The blocks, in words, of a memory of that many words."""
    return [min(_BLOCK_WORDS, memory_words - begin) for begin in range(0, memory_words, _BLOCK_WORDS)]


def lasting_ms(rates: "list[int]", memory_words: int) -> int:
    """How long the rings can last in that many words, one of LASTING_MS; 0 if the engine does not fit."""
    for lasts_ms in LASTING_MS:
        if _find_place(rates, memory_words, lasts_ms):
            return lasts_ms
    return 0


def fits(rates: "list[int]", room_bytes: int) -> bool:
    """Whether the engine fits into a room of that many bytes."""
    return lasting_ms(rates, room_words(len(rates), room_bytes)) > 0


def _find_place(rates: "list[int]", memory_words: int, lasts_ms: int) -> bool:
    """Whether all parts of the engine find theirs, each in the first block with room."""
    free = blocks(memory_words)
    for part in _parts(rates, lasts_ms):
        for number, left in enumerate(free):
            if left >= part:
                free[number] -= part
                break
        else:
            return False
    return True


def _parts(rates: "list[int]", lasts_ms: int) -> "list[int]":
    """Words of the parts in the blocks: rings, the largest first, then what of step generators lies nowhere else."""
    parts = sorted([ring_words(rate, lasts_ms) for rate in rates], reverse=True)
    left = PROCESSOR_WORDS
    for part in GENERATOR_PARTS * len(rates):
        if part <= left:
            left -= part
        else:
            parts.append(part)
    return parts
