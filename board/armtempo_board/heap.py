"""The heap: when it is collected, and which modules are given up."""

import gc
import sys

_NOT_ALWAYS = (
    "pins",
    "registers",
    "motion_check",
    "rate_check",
    "override",
    "joint_law",
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
    "output_setup",
)
_SEQUENCE = "sequence"  # how the names of the modules begin that only sequences need


def collect_often(often: bool = True) -> None:
    """Whether the heap is collected long before it is full, which keeps large blocks free.

    Not while a motion runs: what MicroPython allocates for a call is freed at its end, but counts.
    Collections would come every few turns of the loop, and take longer than the rings last.
    """
    if hasattr(gc, "threshold"):
        gc.threshold((gc.mem_free() + gc.mem_alloc()) // 64 if often else -1)


def forget(names: "tuple[str, ...]" = _NOT_ALWAYS) -> None:
    """Give up modules, those that only set-up, the start of a motion, a motion or a sequence needs.

    The next collection frees them.

    They are imported inside of functions, never at the head of a module that stays, and never while a motion runs.
    What a motion needs is held by its engine until it ends.
    """
    for module in list(sys.modules):
        if module.startswith("armtempo_"):
            package, _, name = module.rpartition(".")
            if name in names or module in names or name.startswith(_SEQUENCE):
                del sys.modules[module]
                delattr(sys.modules[package], name)
