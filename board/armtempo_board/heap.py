"""The heap: when it is collected, and which modules are given up."""

import gc
import sys

_SEQUENCE = "sequence"  # how the names of the modules begin that only sequences need
_LEAST_HELD = 1_000
_held: "list[bytearray]" = []
_NOT_ALWAYS = """
    pins registers arm_setup run_start start_check motion_check rate_check override time_law interval_steps
    cubics endpoints arm_check motion_file engine_memory room backup_sram armtempo_shared.motion bezier_weights store
    store_commands command_rows armrecord table program_hash basis output_setup start_up set_up
"""
"""Modules; the last two are those of the compact form that hold what is called at rest only."""


def collect_often(often: bool = True) -> None:
    """Whether the heap is collected long before it is full, which keeps large blocks free.

    Not while a motion runs: what MicroPython allocates for a call is freed at its end, but counts.
    Collections would come every few turns of the loop, and take longer than the rings last.
    """
    if hasattr(gc, "threshold"):
        gc.threshold((gc.mem_free() + gc.mem_alloc()) // 64 if often else -1)


def overwrite_stack(calls: int, first: int = 0, second: int = 0, third: int = 0) -> None:
    """Overwrite what ended calls have left on the stack: the collector takes it for references.

    Frames of two sizes, as each has words that it does not write.
    """
    if calls:
        overwrite_stack(calls - 1, first, second, third)
        _overwrite(calls)


def _overwrite(calls: int) -> None:
    if calls:
        _overwrite(calls - 1)


def hold(*sizes: int) -> None:
    """Keep pieces of the heap free of what stays, for the code that a motion needs; as large as there are, at most."""
    release()
    for size in sizes:
        while size >= _LEAST_HELD:
            try:
                _held.append(bytearray(size))
                break
            except MemoryError:
                size -= _LEAST_HELD // 4


def release() -> None:
    """Give them up."""
    _held.clear()


def forget(*names: str) -> None:
    """Give up the modules of these names, or all that only set-up, the start of a motion or a motion needs.

    With them those of sequences.

    The next collection frees them.
    They are imported inside of functions, never at the head of a module that stays, and never while a motion runs.
    What a motion needs is held by its engine until it ends.
    """
    given_up = names or _NOT_ALWAYS.split()
    for module in list(sys.modules):
        if module.startswith("armtempo_"):
            package, _, name = module.rpartition(".")
            if name in given_up or module in given_up or name.startswith(_SEQUENCE):
                del sys.modules[module]
                delattr(sys.modules[package], name)
