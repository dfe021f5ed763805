"""How the heap is shared out when the program starts: to the engine, to samples, to the rest.

The rest are link and commands, the modules that come and go (storage, commands about the store, the check of a motion),
and what these need while they are at work: docs/memory.md.
"""

import gc

from armtempo_shared import engine_memory

from armtempo_board import heap
from armtempo_board.hardware import backup_sram
from armtempo_board.motion.workspace import Workspace

_RESERVE = 25_900  # bytes of heap for the rest; what is to spare: docs/memory.md
_USUAL_JOINTS = 3
_MOST_SAMPLES = 4096  # bytes of the sample buffer at most,
_LEAST_SAMPLES = 768  # and at least;
_SAMPLES_SHARE = 48  # between them, this part of the free heap
_STEP_WORDS = 64


def workspace() -> "Workspace":
    """For the largest arm that fits."""
    address = backup_sram.find()
    heap.forget("registers")
    gc.collect()
    free = _free()
    room = engine_memory.LARGEST_BYTES
    if free:
        beside = _RESERVE + (0 if address else 4 * engine_memory.PROCESSOR_WORDS)
        room = min(max(free - beside, 0), room)
    made = Workspace(room, address)
    share(made, _USUAL_JOINTS)
    return made


def share(workspace: "Workspace", joints: int) -> None:
    """Make the memory for an engine of that many joints, whose objects take of the room too; nobody uses it now.

    What the heap no longer has in one piece, the engine goes without, until the program starts again.
    """
    words = engine_memory.room_words(joints, workspace.room)
    while workspace.memory.size != words:
        try:
            workspace.make_memory(words)
        except MemoryError:
            if not words:
                raise
            words = max(words - _STEP_WORDS, 0)
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
