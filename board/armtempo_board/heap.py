"""The heap: when it is collected, and which modules are given up."""

import gc
import sys

_NOT_ALWAYS = (
    "pins",
    "registers",
    "motion_check",
    "rate_check",
    "override",
    "time_law",
    "interval_steps",
    "cubics",
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
    "set_up",  # of the compact form: constructors
)


def collect_often(often: bool = True) -> None:
    """Whether the heap is collected long before it is full, which keeps large blocks free.

    Not while a motion runs: what MicroPython allocates for a call is freed at its end, but counts.
    Collections would come every few turns of the loop, and take longer than the rings last.
    """
    if hasattr(gc, "threshold"):
        gc.threshold((gc.mem_free() + gc.mem_alloc()) // 64 if often else -1)


def forget() -> None:
    """Give up the modules that only set-up, the start of a motion or a motion needs; the next collection frees them.

    They are imported inside of functions, never at the head of a module that stays, and never while a motion runs.
    What a motion needs is held by its engine until it ends.
    """
    for module in list(sys.modules):
        if module.startswith("armtempo_"):
            package, _, name = module.rpartition(".")
            if name in _NOT_ALWAYS or module in _NOT_ALWAYS:
                del sys.modules[module]
                delattr(sys.modules[package], name)
