"""The heap: when it is collected, and which modules are given up."""

import gc
import sys

OFTEN = 64
SELDOM = 16  # if memory is not short and time is: a collection takes 5 ms
_SEQUENCE = "sequence"  # how the names of the modules begin that only sequences need
_keeps = False
_NOT_ALWAYS = """
    pins registers arm_setup run_start start_check motion_check rate_check override time_law interval_steps
    cubics endpoints next_motion arm_check motion_file engine_memory room backup_sram armtempo_shared.motion
    bezier_weights store store_commands measured_rates command_rows armrecord table program_hash basis output_setup
    set_up
"""
"""Modules; the last one is that of the compact form that holds what is called at rest only."""


def keep_code(keeps: bool) -> None:
    """Whether code stays that has been loaded, as a motion begins sooner then; if memory is not short.

    ``forget`` and ``tidy`` do nothing then, and the heap is collected seldom. Not while a motion runs.
    """
    global _keeps
    _keeps = keeps
    collect_often()


def collect_often(parts: int = OFTEN) -> None:
    """Collect the heap whenever 1/``parts`` of it was allocated, which keeps large blocks free; 0: when full.

    That is for a motion that runs: what MicroPython allocates for a call is freed at its end, but counts.
    Collections would come every few turns of the loop, and take longer than the rings last.
    """
    if hasattr(gc, "threshold"):
        parts = min(parts, SELDOM) if _keeps else parts
        gc.threshold((gc.mem_free() + gc.mem_alloc()) // parts if parts else -1)


def tidy() -> None:
    """Free the modules that only set-up, the start of a motion or a motion needs, and what nothing refers to."""
    if not _keeps:
        forget()
        gc.collect()


def forget(*names: str) -> None:
    """Give up the modules of these names, or all that only set-up, the start of a motion or a motion needs.

    With them those of sequences.

    The next collection frees them.
    They are imported inside of functions, never at the head of a module that stays, and never while a motion runs.
    What a motion needs is held by its engine until it ends.
    """
    if _keeps:
        return
    given_up = names or _NOT_ALWAYS.split()
    for module in list(sys.modules):
        if module.startswith("armtempo_"):
            package, _, name = module.rpartition(".")
            if name in given_up or module in given_up or name.startswith(_SEQUENCE):
                del sys.modules[module]
                delattr(sys.modules[package], name)
