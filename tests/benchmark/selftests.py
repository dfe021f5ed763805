"""Whether a board is as before after many self-tests, as the figures in host/docs/measurements.md.

    python -m tests.benchmark.selftests [TIMES]

On a virtual board under MicroPython. Its heap holds the simulated chip too and loses some KB each time (9; 4 by a reset
alone), which says nothing of a chip: a reset empties its heap. What the engine can have of it must stay the same.
"""

import sys
import tempfile
from pathlib import Path

from armtempo import connect

from tests.system.test_selftest import board, is_enabled


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
        heaps, rooms = [one.free_heap for one in part], {one.engine_room for one in part}
        print(f"{title} half: heap free {min(heaps)} to {max(heaps)}, engine {rooms}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100)
