"""The least heap in which MicroPython compiles a marked program: ``python -m tests.benchmark.program_heap``.

On 32-bit MicroPython in the emulator; the bytes for each byte of the source, beyond what an empty program takes.
"""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path

from armtempo.model.user_program import UserProgram

from tests import interpreters
from tests.host.test_user_program import ARM, HEAD, example

SCRIPT = """
import gc, sys
with open(sys.argv[1]) as file:
    source = file.read()
gc.collect()
compile(source, "program.py", "exec")
print("compiled")
"""
PART = """def part_{0}(a, b):
    cell.goto([a + {0}, b, 3.5])
    if cell.wait("part", timeout_s={0}):
        cell.set("gripper", "open", wait_s=0.2)
    return a * b + {0}

"""
EXACT = 100


def least_bytes(script: Path, source: Path) -> int:
    """By halving, within EXACT."""
    low, high = 1000, 1_000_000
    while high - low > EXACT:
        middle = (low + high) // 2
        command = [
            interpreters.starter("micropython-arm"),
            "-X",
            f"heapsize={middle}",
            str(script),
            str(source),
        ]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        low, high = (low, middle) if "compiled" in done.stdout else (middle, high)
    return high


def main() -> None:
    """Print a line for each program."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "script").write_text(SCRIPT)
        (folder / "parts.py").write_text(HEAD + "".join(PART.format(number) for number in range(40)))
        (folder / "empty").write_text("pass\n")
        empty = least_bytes(folder / "script", folder / "empty")
        print(f"empty: {empty} bytes")
        for path in (*(example(one, folder) for one in ("pick_place.py", "pallet.py")), folder / "parts.py"):
            marked = UserProgram.load(path, ARM).marked
            (folder / "marked").write_text(marked)
            needed = least_bytes(folder / "script", folder / "marked") - empty
            print(
                f"{path.stem}: {len(marked)} bytes, {needed} bytes of heap, {needed / len(marked):.1f} a byte"
            )


if __name__ == "__main__":
    main()
