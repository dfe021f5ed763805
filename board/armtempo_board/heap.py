"""The heap: when it is collected, and which modules are given up."""

import gc
import sys

_ONLY_FOR_SET_UP = (
    "pins",
    "registers",
    "motion_check",
    "rate_check",
    "endpoints",
    "arm_check",
    "motion_file",
    "engine_memory",
    "room",
    "armtempo_shared.motion",
    "bezier_weights",
    "store",
    "store_commands",
    "armrecord",
    "table",
    "program_hash",
    "basis",
)


def collect_often(often: bool = True) -> None:
    """Whether the heap is collected long before it is full, which keeps large blocks free.

    Not while a motion runs: what MicroPython allocates for a call is freed at its end, but counts.
    Collections would come every few turns of the loop, and take longer than the rings last.
    """
    if hasattr(gc, "threshold"):
        gc.threshold((gc.mem_free() + gc.mem_alloc()) // 64 if often else -1)


def forget() -> None:
    """Give up the modules that only set-up or the start of a motion needs; the next collection frees them.

    They are imported inside of functions, never at the head of a module, and never while a motion runs.
    """
    for module in list(sys.modules):
        if module.startswith("armtempo_"):
            package, _, name = module.rpartition(".")
            if name in _ONLY_FOR_SET_UP or module in _ONLY_FOR_SET_UP:
                del sys.modules[module]
                delattr(sys.modules[package], name)
