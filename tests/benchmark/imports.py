"""What ``import armtempo`` costs beside ``import numpy``: ``python -m tests.benchmark.imports``.

Each in a Python of its own, in turn; the least of all rounds, as whatever else the machine does only adds.
"""

from __future__ import annotations

import subprocess
import sys

ROUNDS = 15
CASES = {
    "import numpy": "",
    "import armtempo": "import numpy",
    "armtempo.Arm": "import numpy, armtempo",
    "armtempo.plan": "import numpy, armtempo",
}
"""Statement: what has been imported before it."""


def seconds(before: str, statement: str) -> float:
    """How long a statement takes in a new Python after another."""
    code = (
        f"import time\n{before}\nbegin = time.perf_counter()\n{statement}\nprint(time.perf_counter() - begin)"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return float(found.stdout)


def main() -> None:
    """Print the least time of each statement."""
    least = dict.fromkeys(CASES, float("inf"))
    for _ in range(ROUNDS):
        for statement, before in CASES.items():
            least[statement] = min(least[statement], seconds(before, statement))
    for statement, value in least.items():
        print(f"{statement:<18} {1000 * value:7.1f} ms")


if __name__ == "__main__":
    main()
