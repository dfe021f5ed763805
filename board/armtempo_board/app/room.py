"""How the heap is shared out when the program starts: to the engine, to samples, to the rest.

The rest are link and commands, the modules that come and go (storage, commands about the store, the check of a motion),
and what these need while they are at work: docs/memory.md.
"""

import gc

from armtempo_shared import engine_memory
from armtempo_shared.limits import MAX_JOINTS

from armtempo_board import heap
from armtempo_board.hardware import backup_sram
from armtempo_board.motion.workspace import Workspace

_RESERVE = 27_000  # bytes of heap for the rest
_USUAL_JOINTS = 3  # there is heap for their objects before there is memory for larger rings
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
    if not free:
        return Workspace(engine_memory.LARGEST_WORDS, MAX_JOINTS, address)
    room = max(free - _RESERVE - (0 if address else 4 * engine_memory.PROCESSOR_WORDS), 0)
    words = max(room - engine_memory.object_bytes(_USUAL_JOINTS), 0) // 4
    words = min(words, engine_memory.LARGEST_WORDS)
    joints = 0
    while joints < MAX_JOINTS and 4 * words + engine_memory.object_bytes(joints + 1) <= room:
        joints += 1
    while True:
        try:
            return Workspace(words, joints, address)
        except MemoryError:  # the heap has no such blocks
            if not words:
                raise
            words = max(words - _STEP_WORDS, 0)
            gc.collect()


def share(workspace: "Workspace", outputs: int, inputs: int) -> None:
    """Where memory is short, leave heap for that many outputs and inputs, out of the engine's, which nobody uses now.

    What the heap no longer has in one piece, the engine goes without, until the program starts again.
    """
    words = workspace.words
    if workspace.is_short:
        words = max(words - engine_memory.output_bytes(outputs, inputs) // 4, 0)
    while workspace.memory.size != words:
        try:
            workspace.make_memory(words)
        except MemoryError:
            words = max(words - _STEP_WORDS, 0)


def sample_bytes() -> int:
    """For the memory of samples."""
    gc.collect()
    free = _free()
    return min(max(free // _SAMPLES_SHARE, _LEAST_SAMPLES), _MOST_SAMPLES) if free else _MOST_SAMPLES


def _free() -> int:
    """0 where it is not known."""
    free = getattr(gc, "mem_free", None)
    return int(free()) if free else 0
