"""When the heap is collected."""

import gc

OFTEN = 64
SELDOM = 8  # if memory is not short and time is: a collection takes 5 ms


def collect_often(parts: int = OFTEN) -> None:
    """Collect the heap whenever 1/``parts`` of it was allocated, which keeps large blocks free; 0: when full.

    That is for a motion that runs: what MicroPython allocates for a call is freed at its end, but counts.
    Collections would come every few passes of the loop, and take longer than the rings last.
    """
    if hasattr(gc, "threshold"):
        gc.threshold((gc.mem_free() + gc.mem_alloc()) // parts if parts else -1)
