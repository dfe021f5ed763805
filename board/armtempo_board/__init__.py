"""The board program: MicroPython for the STM32F407.

``main.py`` starts it; from the REPL ``armtempo_board.replay("feed")`` runs one stored trajectory.
"""


def replay(name: str = "") -> None:
    """Run a stored trajectory without a host; see ``standalone.py``."""
    from armtempo_board import standalone

    standalone.replay(name)


def collect_often(often: bool = True) -> None:
    """Whether the heap is collected long before it is full, so that it does not fall to pieces.

    While a motion runs it is not: what MicroPython allocates for calls is given back at once, but it counts, and a
    collection would come every few turns of the loop and take longer than the rings last.
    """
    import gc

    if hasattr(gc, "threshold"):
        gc.threshold((gc.mem_free() + gc.mem_alloc()) // 64 if often else -1)


def forget() -> None:
    """Let the next collection have the modules that only set-up or the start of a motion needs.

    They are imported inside of functions, never at the head of a module, and never while a motion runs.
    """
    import sys

    import armtempo_shared

    for name in ("pins", "registers", "check", "rates", "ends", "weights", "store", "storing"):
        sys.modules.pop("armtempo_board." + name, None)
        globals().pop(name, None)
    for name in ("armrecord", "table", "program", "basis"):
        sys.modules.pop("armtempo_shared." + name, None)
        if hasattr(armtempo_shared, name):
            delattr(armtempo_shared, name)
