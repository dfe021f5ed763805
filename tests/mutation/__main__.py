"""Which small mistakes do the tests not notice? A tool for development, not part of the tests.

    python -m tests.mutation host --count 30 --seed 1

Makes seeded mistakes in host, board, shared or simulator, one at a time in a copy of the checkout, runs the tests that
concern the file until the first that fails, and lists what went unnoticed. The copy has no emulated interpreter.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tests.interpreters import AVAILABLE, ROOT
from tests.mutation import concerned, mutations

SIMULATOR = "host/armtempo/simulator"
AREAS = {
    "host": ("host/armtempo", SIMULATOR),
    "board": ("board/armtempo_board", ""),
    "shared": ("shared/armtempo_shared", ""),
    "simulator": (SIMULATOR, ""),
}
LEFT_OUT = ("research", "data")
COPIED = (
    "host",
    "board",
    "shared",
    "tests",
    ".ci",
    ".github",
    "pyproject.toml",
    "README.md",
    "LICENSE",
    "Makefile",
    ".gitignore",
)


def files(area: str) -> list[Path]:
    """The sources of an area, relative to the checkout."""
    folder, without = AREAS[area]
    found = sorted(path.relative_to(ROOT) for path in (ROOT / folder).rglob("*.py"))
    return [
        path
        for path in found
        if not (without and str(path).startswith(without)) and not set(path.parts) & set(LEFT_OUT)
    ]


def chosen(area: str, count: int, seed: int) -> list[tuple[Path, mutations.Mutation]]:
    """So many mistakes by chance, every line as likely as any other."""
    every = [(path, each) for path in files(area) for each in mutations.all_of((ROOT / path).read_bytes())]
    by_line: dict[tuple[Path, int], list[mutations.Mutation]] = {}
    for path, each in every:
        by_line.setdefault((path, each.line), []).append(each)
    rng = random.Random(f"{area} {seed}")
    lines = sorted(by_line)
    rng.shuffle(lines)
    found: list[tuple[Path, mutations.Mutation]] = []
    for path, line in lines:
        mutation = rng.choice(by_line[path, line])
        if mutations.parses(mutation.of((ROOT / path).read_bytes())):
            found.append((path, mutation))
        if len(found) == count:
            break
    return found


def copy_to(folder: Path) -> None:
    """The checkout without its history, and what of the cache the tests need."""
    for name in COPIED:
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
        elif source.exists():
            shutil.copy(source, folder / name)
    cache = ROOT / ".cache" / "micropython"
    (folder / ".cache" / "micropython").mkdir(parents=True)
    for path in cache.glob("*"):
        if path.name not in ("micropython-arm", "root-arm", "qemu"):
            (folder / ".cache" / "micropython" / path.name).symlink_to(path)


def noticed(folder: Path, tests: list[str], without: str, seconds: float) -> str:
    """The first test that fails in the copy, "time-out", or "" where none does."""
    path = os.pathsep.join(str(folder / name) for name in ("host", "shared", "board"))
    command = [sys.executable, "-m", "pytest", "-q", "-x", "--no-header", "-p", "no:cacheprovider", *tests]
    command += ["-k", without]
    environment = {**os.environ, "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}
    try:
        done = subprocess.run(
            command, cwd=folder, env=environment, capture_output=True, text=True, timeout=seconds, check=False
        )
    except subprocess.TimeoutExpired:
        return "time-out"
    if done.returncode in (0, 5):
        return ""
    failed = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return (failed or [done.stdout[-300:] + done.stderr[-300:]])[0][:200]


def _test_in(result: str) -> str:
    """The test that a line of pytest's summary is about."""
    return result.removeprefix("FAILED ").split(" - ")[0]


def main() -> None:
    """Print a line for each mistake, and the count of those that were noticed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("area", choices=AREAS)
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first mistake to try")
    parser.add_argument("--seconds", type=float, default=600.0, help="for the tests of one mistake")
    options = parser.parse_args()
    found = late = 0
    on_board = options.area in ("board", "simulator") and "micropython" in AVAILABLE
    without = concerned.WITHOUT_CPYTHON if on_board else concerned.WITHOUT
    wanted = chosen(options.area, options.count, options.seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        copy_to(folder)
        for number, (path, mutation) in list(enumerate(wanted))[options.first :]:
            source = (folder / path).read_bytes()
            (folder / path).write_bytes(mutation.of(source))
            begin_s = time.monotonic()
            tests = concerned.tests(path)
            result = noticed(folder, tests, without, options.seconds) if tests else ""
            (folder / path).write_bytes(source)
            word = "noticed " if result else "SURVIVED"
            if result.startswith("FAILED ") and noticed(folder, [_test_in(result)], without, options.seconds):
                word = "BROKEN  "  # the test fails without the mistake too: it says nothing
            found += word == "noticed "
            late += result == "time-out"
            took_s = time.monotonic() - begin_s
            print(f"{number:3} {word} {path}:{mutation.shown(source)} [{took_s:.0f} s] {result}", flush=True)
    tried = len(wanted) - options.first
    print(f"{found} of {tried} noticed in {options.area}, seed {options.seed}; {late} by a time-out")


if __name__ == "__main__":
    main()
