"""Division of the heap at the program's start: engine, samples, the rest.

The rest is for link and commands, for the store, the check of a motion and what runs during it: docs/memory.md.
"""

import gc

from armtempo_shared import engine_memory

from armtempo_board.hardware import backup_sram
from armtempo_board.motion.engine_memory import EngineMemory

_RESERVE = 16_300  # bytes of heap for the rest, the motion run once among them; to spare: docs/memory.md
_USUAL_JOINTS = 3
_MOST_SAMPLES = 4096  # bytes of the sample buffer at most,
_LEAST_SAMPLES = 768  # and at least;
_SAMPLES_SHARE = 48  # between them, this part of the free heap
_STEP_WORDS = 64


def for_engine() -> "EngineMemory":
    """Memory for the largest arm that fits."""
    address = backup_sram.find()
    gc.collect()
    free = _free()
    size = engine_memory.LARGEST_BYTES
    if free:
        beside = _RESERVE + (0 if address else 4 * engine_memory.PROCESSOR_WORDS)
        size = min(max(free - beside, 0), size)
    made = EngineMemory(size, address)
    resize(made, _USUAL_JOINTS)
    return made


def resize(made: "EngineMemory", joints: int, with_backlash: int = 0) -> None:
    """Make the memory for an engine of ``joints`` joints, whose objects need part of it; it must be unused.

    ``with_backlash``: how many of them have backlash.
    If the heap no longer has blocks large enough, the engine gets less memory until the next start.
    """
    words = engine_memory.memory_words(joints, made.size, with_backlash)
    while made.memory.size != words:
        try:
            made.make_memory(words)
        except MemoryError:
            if not words:
                raise
            words = max(words - _STEP_WORDS, 0)
            gc.collect()


def sample_bytes() -> int:
    """Bytes for the memory of samples."""
    gc.collect()
    free = _free()
    return min(max(free // _SAMPLES_SHARE, _LEAST_SAMPLES), _MOST_SAMPLES) if free else _MOST_SAMPLES


def _free() -> int:
    """Free heap, bytes; 0 if not known."""
    free = getattr(gc, "mem_free", None)
    return int(free()) if free else 0
