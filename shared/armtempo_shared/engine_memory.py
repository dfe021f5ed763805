"""The memory of the engine for an arm on the board: one formula for host and board.

The board's answer to ``hello`` has the bytes of heap for an engine, its objects and its memory (``engine_bytes``). The
memory consists of blocks, as a heap has few large ones. Each joint has a ring of edge times in them. The step
generators' buffers are in ``PROCESSOR_WORDS``, as far as they fit, otherwise in the blocks too.
"""

LASTING_MS = (12, 6, 3, 2)
"""Durations of a full ring: the first for which there is memory is used. Long rings are filled less often, which is
most of the interrupt's cost (board/docs/evaluator.md)."""
SHORT_MS = LASTING_MS[-1]
_LEAST_ENTRIES = 64
_MOST_ENTRIES = 1024
_SPARE_ENTRIES = 8  # entries of a ring that are not overwritten, as in isr.py
PROCESSOR_WORDS = 1024
"""Words (4 bytes) of the chip's backup SRAM, which is not in MicroPython's heap (hardware/backup_sram.py of the board
program). DMA cannot read them, so they are not used for rings."""
GENERATOR_PARTS = (224, 78, 78, 20, 20, 12, 12, 49, 27)
"""Words of a joint's step generator, in the order of allocation.

The queue of steps; pieces of angle and of time, their control points, their measures; the solver, the time law.
"""
GENERATOR_WORDS = sum(GENERATOR_PARTS)
_BLOCK_WORDS = 1026  # for a ring of 1024 entries, or two of 512
LARGEST_WORDS = 6 * GENERATOR_WORDS - PROCESSOR_WORDS + 1025 + 513 + 257 + 129 + 2 * 65 + 30
"""Words for arms whose highest step rates sum up to 240 000 steps/s; some have short rings then.

The last words are unused at the ends of blocks.
"""


ONCE_BYTES = 3072
"""Bytes of heap for a motion that is run once, beside the engine: a line of six joints in 32 segments fits."""
SHORT_ONCE_BYTES = 1536
"""The same where the heap does not have enough for every arm: a line of three joints in 16 segments fits."""


def ring_words(rate: int, lasts_ms: int) -> int:
    """Words of the ring of a joint of at most ``rate`` steps/s: one more than its entries, a power of two.

    A full ring lasts ``lasts_ms``, or has 1024 entries. The interrupt fills it every 0.5 ms, without the last 390 us.
    """
    wanted = 2 * rate * lasts_ms // 1000 + _SPARE_ENTRIES
    entries = _LEAST_ENTRIES
    while entries < min(wanted, _MOST_ENTRIES):
        entries *= 2
    return entries + 1


def words(rates: "list[int]") -> int:
    """Least words of the engine for joints of these highest step rates, in steps/s."""
    return sum(_parts(rates, SHORT_MS))


def object_bytes(joints: int, with_backlash: int = 0) -> int:
    """Bytes of heap of the engine's objects: measured, see board/docs/memory.md.

    ``with_backlash``: how many of the joints have backlash.
    """
    return 1760 + 1184 * joints + 1600 * with_backlash


LARGEST_BYTES = 4 * LARGEST_WORDS + object_bytes(6)
"""Bytes in which every arm fits."""


def needed_bytes(rates: "list[int]", with_backlash: int = 0) -> int:
    """Least bytes of heap of the engine with its objects, for joints of these highest step rates."""
    return 4 * words(rates) + object_bytes(len(rates), with_backlash)


def memory_words(joints: int, free_bytes: int, with_backlash: int = 0) -> int:
    """Words for an engine's memory in ``free_bytes``, without the objects for ``joints``."""
    return min(max((free_bytes - object_bytes(joints, with_backlash)) // 4, 0), LARGEST_WORDS)


def ahead_bytes(joints: int) -> int:
    """Bytes of heap to prepare a sequence's next motion: a second step generator for each joint.

    With its objects, and the files that it reads: measured, see board/docs/memory.md.
    """
    return (4 * GENERATOR_WORDS + 880) * joints


def blocks(memory_words: int) -> "list[int]":
    """The blocks, in words, of a memory of ``memory_words``."""
    return [min(_BLOCK_WORDS, memory_words - begin) for begin in range(0, memory_words, _BLOCK_WORDS)]


def lasting_ms(rates: "list[int]", memory_words: int) -> int:
    """Duration of the rings in ``memory_words``, one of LASTING_MS; 0 if the engine does not fit."""
    for lasts_ms in LASTING_MS:
        if _find_place(rates, memory_words, lasts_ms):
            return lasts_ms
    return 0


def fits(rates: "list[int]", free_bytes: int, with_backlash: int = 0) -> bool:
    """Whether the engine fits into ``free_bytes``."""
    return lasting_ms(rates, memory_words(len(rates), free_bytes, with_backlash)) > 0


def _find_place(rates: "list[int]", memory_words: int, lasts_ms: int) -> bool:
    """Whether all parts of the engine fit, each in the first block with space."""
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
    """Words of the parts in the blocks: rings, largest first, then the rest of the step generators."""
    parts = sorted([ring_words(rate, lasts_ms) for rate in rates], reverse=True)
    left = PROCESSOR_WORDS
    for part in GENERATOR_PARTS * len(rates):
        if part <= left:
            left -= part
        else:
            parts.append(part)
    return parts
