"""How the heap is shared out when the program starts: to the engine, to samples, to the rest.

The rest are the modules that come and go (storage, the check of a motion, commands about the store), what they need
while they are at work, and the objects of an engine: figures in docs/memory.md.
"""

import gc

from armtempo_shared import engine_memory

from armtempo_board.motion.workspace import Workspace

RESERVE = 16_384
"""Bytes that must stay free beside the memory of the engine: for six joints' objects, and the rest."""

_MOST_SAMPLES = 4096  # bytes of the sample buffer at most,
_LEAST_SAMPLES = 1024  # and at least;
_SAMPLES_SHARE = 16  # between them, this part of the free heap
_STEP_WORDS = 64


def workspace() -> "Workspace":
    """For the largest arm that fits."""
    words = engine_memory.LARGEST_WORDS
    gc.collect()
    free = _free()
    if free:
        words = min(words, max(free - RESERVE, 0) // 4)
    while True:
        try:
            return Workspace(words)
        except MemoryError:  # there is no such piece
            words -= _STEP_WORDS
            gc.collect()


def sample_bytes() -> int:
    """For the memory of samples."""
    gc.collect()
    free = _free()
    return min(max(free // _SAMPLES_SHARE, _LEAST_SAMPLES), _MOST_SAMPLES) if free else _MOST_SAMPLES


def _free() -> int:
    """0 where it is not known."""
    free = getattr(gc, "mem_free", None)
    return int(free()) if free else 0
