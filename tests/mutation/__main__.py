"""Which small mistakes do the tests not notice? A tool for development, not part of the tests.

    python -m tests.mutation host --count 30 --seed 1

Makes seeded mistakes in host, board, shared or simulator, one at a time in a copy of the checkout, runs the tests that
run the line until the first that fails, and lists what no test noticed. The copy has no emulated interpreter.
"""

from __future__ import annotations

import argparse
import ast
import itertools
import os
import queue
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

from tests.interpreters import ROOT
from tests.mutation import contexts, mutations

SIMULATOR = "host/armtempo/simulator"
AREAS = {
    "host": ("host/armtempo", SIMULATOR),
    "board": ("board/armtempo_board", ""),
    "shared": ("shared/armtempo_shared", ""),
    "simulator": (SIMULATOR, ""),
}
"""Folder, and what of it is left out."""
LEFT_OUT = ("paper", "data")
LATE_S = 60.0
"""And four times what the tests take: then a mistake makes one hang. More on a busy machine."""
NOT_COPIED = shutil.ignore_patterns(
    "__pycache__", ".git", ".venv", ".cache", ".*_cache", "build", "dist", "runs"
)

Mistake = tuple[Path, mutations.Mutation]


def files(area: str) -> list[Path]:
    """The sources of an area, relative to the checkout."""
    folder, without = AREAS[area]
    found = sorted(path.relative_to(ROOT) for path in (ROOT / folder).rglob("*.py"))
    return [
        path
        for path in found
        if not (without and str(path).startswith(without)) and not set(path.parts) & set(LEFT_OUT)
    ]


def mistakes(area: str, count: int, seed: int) -> list[Mistake]:
    """``count`` random mistakes, every line as likely as any other."""
    by_line: dict[tuple[Path, int], list[mutations.Mutation]] = {}
    for path in files(area):
        for each in mutations.all_of((ROOT / path).read_bytes()):
            by_line.setdefault((path, each.line), []).append(each)
    rng = random.Random(f"{area} {seed}")
    lines = sorted(by_line)
    rng.shuffle(lines)
    found: list[Mistake] = []
    for path, line in lines:
        mutation = rng.choice(by_line[path, line])
        source = (ROOT / path).read_bytes()
        if mutation.of(source) != source and mutations.parses(mutation.of(source)):
            found.append((path, mutation))
        if len(found) == count:
            break
    return found


def tests_for(mistake: Mistake, known: contexts.Known, seconds: float) -> list[str]:
    """Tests that run the line, then those that run its function, then the others of their files; up to ``seconds``.

    A line outside of functions runs at the import: for it, those that run any function of the file.
    """
    path, mutation = mistake
    statement, function = _around(ast.parse((ROOT / path).read_text(encoding="utf-8")), mutation.line)
    ordered = [*known.running(path, statement), *known.running(path, function)]
    names = {test.split("::")[0] for test in ordered}
    ordered += known.quickest({test for test in known.seconds if test.split("::")[0] in names})
    if not ordered and path.parts[0] in ("board", "shared"):  # MicroPython alone may run it
        ordered = known.quickest({test for test in known.seconds if test.startswith("tests/board/")})
    chosen, total_s = [], 0.0
    for test in dict.fromkeys(ordered):
        total_s += known.seconds[test]
        if total_s <= seconds or not chosen:
            chosen.append(test)
    return chosen


def _around(tree: ast.Module, line: int) -> tuple[set[int], set[int]]:
    """Lines of the statement, and of the function around it: of all functions if there is none."""
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    inside = [set(range(one.body[0].lineno, (one.end_lineno or 0) + 1)) for one in functions]
    around = [lines for lines in inside if line in lines]
    if not around:
        return set(), set().union(*inside)
    statements = [node for node in ast.walk(tree) if isinstance(node, ast.stmt)]
    own = [node for node in statements if node.lineno <= line <= (node.end_lineno or 0)][-1]
    body = getattr(own, "body", None)
    last = max(own.lineno, body[0].lineno - 1) if body else own.end_lineno or own.lineno
    return set(range(own.lineno, last + 1)), min(around, key=len)


class Copy:
    """A copy of the checkout, and the tests in it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._times = itertools.count(2_000_000_000)  # of byte code, which is recognised by time and size
        self._passes: dict[str, bool] = {}
        shutil.copytree(ROOT, folder, ignore=NOT_COPIED)
        (folder / ".cache" / "micropython").mkdir(parents=True)
        for path in (ROOT / ".cache" / "micropython").glob("*"):
            if path.name not in ("micropython-arm", "armhf"):
                (folder / ".cache" / "micropython" / path.name).symlink_to(path)
        path = os.pathsep.join(str(folder / name) for name in ("host", "shared", "board"))
        self._environment = {**os.environ, "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"}

    def attempt(self, mistake: Mistake, tests: list[str], limit_s: float) -> tuple[str, str]:
        """Make a mistake, run the tests, take it back: noticed, SURVIVED or LATE, and the test that says so.

        A test that fails without the mistake too does not count.
        """
        path, mutation = mistake
        source = (self.folder / path).read_bytes()
        while True:
            self._write(path, mutation.of(source))
            word, test = self._outcome(tests, limit_s)
            self._write(path, source)
            if word != "noticed" or test not in tests or self._passes_without(test):
                return word, test
            tests = tests[tests.index(test) + 1 :]

    def _passes_without(self, test: str) -> bool:
        if test not in self._passes:
            self._passes[test] = self._outcome([test], LATE_S)[0] == "SURVIVED"
        return self._passes[test]

    def _write(self, path: Path, source: bytes) -> None:
        (self.folder / path).write_bytes(source)
        time_s = next(self._times)
        os.utime(self.folder / path, (time_s, time_s))

    def _outcome(self, tests: list[str], limit_s: float) -> tuple[str, str]:
        if not tests:
            return "SURVIVED", "no test runs it"
        options = ["-q", "-x", "-p", "no:cacheprovider", "--tb=no"]
        command = [sys.executable, "-m", "pytest", *options, *tests]
        busy = max(1.0, os.getloadavg()[0] / (2 * (os.cpu_count() or 1)))
        with subprocess.Popen(
            command,
            cwd=self.folder,
            env=self._environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        ) as process:
            try:
                said = process.communicate(timeout=limit_s * busy)[0]
            except subprocess.TimeoutExpired:
                self._kill(process.pid)
                return "LATE", ""
        failed = re.search(r"^(?:FAILED|ERROR) (tests/.*?)(?: - .*)?$", said, re.MULTILINE)
        if process.returncode == 0:
            return "SURVIVED", ""
        return "noticed", failed[1] if failed else f"pytest ended with {process.returncode}"

    def _kill(self, group: int) -> None:
        """The tests, and what they started: virtual boards for instance have a session of their own."""
        with suppress(ProcessLookupError):
            os.killpg(group, signal.SIGKILL)
        folder = os.fsencode(self.folder) + b"/"
        for path in Path("/proc").glob("[0-9]*"):
            with suppress(OSError):
                if folder in (path / "environ").read_bytes() + (path / "cmdline").read_bytes():
                    os.kill(int(path.name), signal.SIGKILL)


def main() -> None:
    """Print a line for each mistake, and how many were noticed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("area", choices=AREAS)
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int, nargs="+", help="numbers of the mistakes to try")
    parser.add_argument("--seconds", type=float, default=60.0, help="of tests for one mistake")
    parser.add_argument("--jobs", type=int, default=2, help="mistakes that are tried at the same time")
    options = parser.parse_args()
    known = contexts.load()
    wanted = list(enumerate(mistakes(options.area, options.count, options.seed)))
    wanted = [each for each in wanted if not options.only or each[0] in options.only]
    found: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as name, ThreadPoolExecutor(options.jobs) as pool:
        copies: queue.SimpleQueue[Copy] = queue.SimpleQueue()
        for number in range(options.jobs):
            copies.put(Copy(Path(name) / str(number)))

        def one(mistake: Mistake) -> tuple[str, str, float, int]:
            tests = tests_for(mistake, known, options.seconds)
            limit_s = LATE_S + 4 * sum(known.seconds[test] for test in tests)
            copy, begin_s = copies.get(), time.monotonic()
            try:
                return *copy.attempt(mistake, tests, limit_s), time.monotonic() - begin_s, len(tests)
            finally:
                copies.put(copy)

        tried = [(number, mistake, pool.submit(one, mistake)) for number, mistake in wanted]
        for number, (path, mutation), future in tried:
            word, test, took_s, count = future.result()
            shown = mutation.shown((ROOT / path).read_bytes())
            print(f"{number:3} {word:8} {path}:{shown} [{took_s:.0f} s, {count} tests] {test}", flush=True)
            found[word] += 1
    print(
        f"{found['noticed']} of {len(wanted)} noticed in {options.area}, seed {options.seed}; {found['LATE']} late"
    )


if __name__ == "__main__":
    main()
