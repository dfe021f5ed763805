"""A board's file system and REPL through mpremote, in a separate process."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import zlib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from armtempo.basics.errors import LinkError
from armtempo.deploy import sectors
from armtempo.link.program_version import IN_LIBRARY

SILENCE_S = 30.0
"""Longest time without output of a step other than copying a file; mpremote itself would wait for ever."""
SLOWEST_BYTES_S = 2000.0
"""Lowest speed at which a file is copied."""
_NOT_ENTERED = "could not enter raw repl"
"""mpremote's message before it has done anything with the board."""
RECOVERY = "see 'armtempo help recovery'"
_SURVEY = Path(__file__).with_name("survey.txt")


@dataclass(frozen=True)
class SectorsFound:
    """What is in the chip's last two sectors of flash."""

    head: str
    """Its first bytes, in hex."""
    crc: int
    """crc32 of the bytes after these, as many as these say."""
    is_blank: bool

    def holds(self, image: bytes) -> bool:
        """Whether it holds this, or is blank if that is empty."""
        head = image[: sectors.HEAD_BYTES]
        is_same = self.head == head.hex() and self.crc == zlib.crc32(image[sectors.HEAD_BYTES :])
        return is_same if image else self.is_blank

    def is_ours(self) -> bool:
        """Whether it holds a program of ours, of any version."""
        return self.head.startswith(sectors.MAGIC.hex())


@dataclass(frozen=True)
class Survey:
    """The firmware that runs, and the files in its flash."""

    machine: str
    """Machine name of the firmware."""
    version: tuple[int, ...]
    """Of MicroPython."""
    mpy: int
    """``sys.implementation._mpy``: format of compiled files and processor; 0: none."""
    free_heap: int
    free_blocks: int
    block_size: int
    sd_card: bool
    """Whether there is an SD card, from which the board would start."""
    firmware_crc: int | None
    """Hash of a program that is built into the firmware; None without one."""
    files: dict[str, tuple[int, str]]
    """Size and sha256, in hex, of each of our files, and of boot.py and main.py whichever program they belong to."""
    others: dict[str, int] = field(default_factory=dict)
    """Size of each other file in the flash's root and in the folder of the motions."""

    sectors: SectorsFound | None = None
    """None: the chip has none."""

    @property
    def release(self) -> str:
        """The version in words."""
        return ".".join(map(str, self.version[:3]))


class Remote:
    """One board by its port; raises LinkError, with the end of mpremote's output, if a step fails."""

    def __init__(self, port: str) -> None:
        self.port = port

    def run(self, *commands: Sequence[str]) -> str:
        """Run mpremote's commands in one session; returns their output.

        A board that is being reset does not accept the prompt's keys: if mpremote could not enter, it tries once more.
        """
        try:
            return "".join(self.lines(*commands))
        except LinkError as error:
            if _NOT_ENTERED not in str(error):
                raise
        return "".join(self.lines(*commands))

    def lines(self, *commands: Sequence[str]) -> Iterator[str]:
        """As ``run``, line by line."""
        arguments = ["connect", self.port]
        for command in commands:
            arguments += ["+", *command]
        with _process(arguments) as process:
            assert process.stdout is not None
            said = []
            watchdog = _Watchdog(process, SILENCE_S + _largest_file(commands) / SLOWEST_BYTES_S)
            for line in process.stdout:
                watchdog.feed()
                said.append(line)
                yield line
            watchdog.stop()
            if process.wait():
                last = next(
                    (text.strip() for text in reversed(said) if text.strip()), "the board fell silent"
                )
                raise LinkError(
                    f"mpremote failed on {self.port}: {last}",
                    f"what was begun is repaired by doing it again; if that fails too: {RECOVERY}",
                )

    def survey(self) -> Survey:
        """Examine firmware and files."""
        answer = self.run(["exec", sectors.script(_SURVEY, OURS=IN_LIBRARY)])
        try:
            found: dict[str, Any] = json.loads(answer.strip().splitlines()[-1])
            files = {path: (size, digest) for path, (size, digest) in found.pop("files").items()}
            last = SectorsFound(**found["sectors"]) if found["sectors"] else None
            return Survey(**found | {"files": files, "version": tuple(found["version"]), "sectors": last})
        except (ValueError, IndexError, KeyError, TypeError) as error:
            raise LinkError(
                f"{self.port}: the board answers mpremote, but not as MicroPython should",
                f"press the board's reset button and try again; if that fails too: {RECOVERY}",
            ) from error


def each(function: str, paths: Iterable[str]) -> list[str]:
    """The command that applies a function of ``os`` to paths of the board; errors are ignored."""
    return [
        "exec",
        f"import os\nfor path in {list(paths)!r}:\n try:\n  {function}(path)\n except OSError:\n  pass",
    ]


def rename(old: str, new: str) -> list[str]:
    """The command that renames a file of the board."""
    return ["exec", f"import os\nos.rename({old!r}, {new!r})"]


def _largest_file(commands: Iterable[Sequence[str]]) -> int:
    """Bytes of the largest file that is copied to the board."""
    return max((Path(command[-2]).stat().st_size for command in commands if command[0] == "cp"), default=0)


class _Watchdog:
    """Ends a process that has printed nothing for a given time."""

    def __init__(self, process: subprocess.Popen[str], silence_s: float) -> None:
        self._process = process
        self._silence_s = silence_s
        self._timer: threading.Timer | None = None
        self.feed()

    def feed(self) -> None:
        """Restart the time."""
        self.stop()
        self._timer = threading.Timer(self._silence_s, self._process.kill)
        self._timer.daemon = True
        self._timer.start()

    def stop(self) -> None:
        """Stop watching."""
        if self._timer is not None:
            self._timer.cancel()


@contextmanager
def _process(arguments: list[str]) -> Iterator[subprocess.Popen[str]]:
    process = subprocess.Popen(
        [sys.executable, "-m", "mpremote", *arguments],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            process.terminate()
        process.communicate()
