"""Whether a board is as before after many self-tests, as the figures in host/docs/measurements.md.

    python -m tests.benchmark.selftests [TIMES]

On a virtual board under MicroPython, whose heap holds the simulated chip too. After a collection 9 KB more of it are in
use each time, 1.1 KB after a reset alone. That is no memory of the program: MicroPython's Unix port keeps 32 bytes for
each function that it ever compiled to machine code (a plain function leaves nothing), and a reset loads 36 of them, a
self-test about 270. A chip's heap is empty after a reset. What the engine can have of it must stay the same.
"""

import sys
import tempfile
from pathlib import Path

from armtempo import connect

from tests.system.logged_boards import board, is_enabled


def main(times: int) -> None:
    """Print how many passed, whether the drivers ever were on, and what hello stated before and after."""
    wrong, stated = 0, []
    with tempfile.TemporaryDirectory() as name:
        with board(Path(name)) as port, connect(port) as used:
            for number in range(times + 1):
                wrong += bool(number and used.selftest().failed)
                stated.append(used.client.hello())
        print(f"{times - wrong} of {times} passed, drivers {'on' if is_enabled(Path(name)) else 'never on'}")
    for title, part in (("first", stated[: times // 2]), ("second", stated[times // 2 :])):
        heaps, engines = [one.free_heap for one in part], {one.engine_bytes for one in part}
        print(f"{title} half: heap free {min(heaps)} to {max(heaps)}, engine {engines}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100)
