"""Which small mistakes do the tests not notice? A tool for development, not part of the tests.

    python -m tests.mutation host --count 30 --seed 1

Makes seeded mistakes in host, board, shared or simulator, one at a time in a copy of the checkout, runs the tests that
concern the file until the first that fails, and lists what went unnoticed. The copy has no emulated interpreter.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import queue
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from tests.interpreters import ROOT
from tests.mutation import concerned, executed, mutations, server

SIMULATOR = "host/armtempo/simulator"
AREAS = {
    "host": ("host/armtempo", SIMULATOR),
    "board": ("board/armtempo_board", ""),
    "shared": ("shared/armtempo_shared", ""),
    "simulator": (SIMULATOR, ""),
}
LEFT_OUT = ("paper", "data")
FIRST = 12
"""Tests that run before the others: most mistakes are noticed by them."""
LATE_S = 30.0
"""And four times what a test took when it was traced: then a mistake makes it hang. More on a busy machine."""
TIME_OUT = "time-out in"
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
        source = (ROOT / path).read_bytes()
        if mutation.of(source) != source and mutations.parses(mutation.of(source)):
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


class Copy:
    """A copy of the checkout, and a program that runs tests in it."""

    def __init__(self, folder: Path, seconds: dict[str, float]) -> None:
        self.folder = folder
        self._seconds = seconds
        self._times = itertools.count(
            2_000_000_000
        )  # byte code is told by time and size: no two states share a time
        self._passed: dict[str, bool] = {}
        copy_to(folder)
        path = os.pathsep.join(str(folder / name) for name in ("host", "shared", "board"))
        self._environment = {**os.environ, "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"}
        self._start()

    def _start(self) -> None:
        self._server = subprocess.Popen(
            [sys.executable, str(Path(server.__file__))],
            cwd=self.folder,
            env=self._environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        threading.Thread(target=self._read, args=(self._server, self._lines), daemon=True).start()

    @staticmethod
    def _read(program: subprocess.Popen[str], lines: queue.SimpleQueue[str]) -> None:
        assert program.stdout is not None
        for line in program.stdout:
            lines.put(line)

    def write(self, path: Path, source: bytes) -> None:
        """A file of the copy."""
        (self.folder / path).write_bytes(source)
        time_s = next(self._times)
        os.utime(self.folder / path, (time_s, time_s))

    def failing(self, tests: list[str]) -> str:
        """The first of the tests that fails, "time-out" and it where one does not end, or "" where none does."""
        if not tests:
            return ""
        assert self._server.stdin is not None
        print(json.dumps(tests), file=self._server.stdin, flush=True)
        end_s = time.monotonic() + self._limit_s("")
        found, running, process = "", "", 0
        while True:
            try:
                line = self._lines.get(timeout=max(0.0, end_s - time.monotonic()))
            except queue.Empty:
                self._kill(process)
                return f"{TIME_OUT} {running}"
            word, _, rest = line.rstrip("\n").partition(" ")
            if word == "end":
                return found
            if word == "process":
                process = int(rest)
            if word == "test":
                running, end_s = rest, time.monotonic() + self._limit_s(rest)
            found = found or (rest if word == "failed" else "")

    def _limit_s(self, test: str) -> float:
        """What a test may take; "": until the first begins. More where other programs want the processors too."""
        busy = os.getloadavg()[0] / (2 * (os.cpu_count() or 1))
        return (LATE_S + 4.0 * self._seconds.get(test, concerned.UNKNOWN_S)) * max(1.0, busy)

    def _kill(self, process: int) -> None:
        """The tests under way, the programs that they started, and the server; start it anew."""
        self._server.kill()
        self._server.wait()
        with suppress(ProcessLookupError):
            os.killpg(process or self._server.pid, signal.SIGKILL)
        for number in self._started():
            with suppress(ProcessLookupError):
                os.kill(number, signal.SIGKILL)
        self._start()

    def _started(self) -> list[int]:
        """Processes that know the copy's folder, virtual boards for instance: they have a session of their own."""
        folder, found = os.fsencode(self.folder) + b"/", []
        for path in Path("/proc").glob("[0-9]*"):
            with suppress(OSError):
                if folder in (path / "environ").read_bytes() + (path / "cmdline").read_bytes():
                    found.append(int(path.name))
        return found

    def passes_without(self, test: str) -> bool:
        """Whether a test passes in the copy without a mistake."""
        if test not in self._passed:
            self._passed[test] = "::" not in test or not self.failing([test])
        return self._passed[test]

    def close(self) -> None:
        """End the program."""
        assert self._server.stdin is not None
        self._server.stdin.close()
        self._server.wait()


@dataclass(frozen=True)
class Tried:
    """What became of one mistake: noticed, SURVIVED, LATE where the tests did not end, BROKEN where one fails anyway.

    LATE says that the mistake makes a test hang, or that the machine is busy: to be tried again.
    """

    word: str
    test: str
    took_s: float
    tests: int


def attempt(copy: Copy, path: Path, mutation: mutations.Mutation, tests: list[str]) -> Tried:
    """Make a mistake in the copy, run the tests, and take it back; the quickest tests by themselves first."""
    source = (copy.folder / path).read_bytes()
    begin_s = time.monotonic()
    word, left = "BROKEN", tests
    while word == "BROKEN":
        copy.write(path, mutation.of(source))
        test = copy.failing(left[:FIRST]) or copy.failing(left[FIRST:])
        copy.write(path, source)
        word = "LATE" if test.startswith(TIME_OUT) else "noticed" if test else "SURVIVED"
        if word == "noticed" and not copy.passes_without(test):
            word = "BROKEN"
            if test not in left:
                break
            left = left[left.index(test) + 1 :]
    return Tried(word, test, time.monotonic() - begin_s, len(tests))


def main() -> None:
    """Print a line for each mistake, and the count of those that were noticed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("area", choices=AREAS)
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first mistake to try")
    parser.add_argument("--only", type=int, nargs="+", help="numbers of the mistakes to try")
    parser.add_argument("--seconds", type=float, default=60.0, help="of tests for one mistake")
    parser.add_argument("--jobs", type=int, default=2, help="mistakes that are tried at the same time")
    options = parser.parse_args()
    known = executed.load()
    wanted = list(enumerate(chosen(options.area, options.count, options.seed)))[options.first :]
    if options.only:
        wanted = [each for each in wanted if each[0] in options.only]
    found: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as name, ThreadPoolExecutor(options.jobs) as pool:
        copies: queue.SimpleQueue[Copy] = queue.SimpleQueue()
        for number in range(options.jobs):
            copies.put(Copy(Path(name) / str(number), known.seconds))

        def one(path: Path, mutation: mutations.Mutation) -> Tried:
            tests = concerned.tests(path, mutation.line, known, options.seconds)
            copy = copies.get()
            try:
                return attempt(copy, path, mutation, tests)
            finally:
                copies.put(copy)

        running = [
            (number, path, mutation, pool.submit(one, path, mutation)) for number, (path, mutation) in wanted
        ]
        for number, path, mutation, future in running:
            tried = future.result()
            shown = mutation.shown((ROOT / path).read_bytes())
            took = f"[{tried.took_s:.0f} s, {tried.tests} tests]"
            print(f"{number:3} {tried.word:8} {path}:{shown} {took} {tried.test}", flush=True)
            found[tried.word] += 1
        for _ in range(options.jobs):
            copies.get().close()
    where = f"{options.area}, seed {options.seed}"
    print(f"{found['noticed']} of {len(wanted)} noticed in {where}; {found['LATE']} late")


if __name__ == "__main__":
    main()
