"""The result of a self-test: lines with measured and expected value, verdict, and advice."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from typing import Any

from armtempo.diagnosis.finding import Level


@dataclass(frozen=True)
class Measurement:
    """A measurement. ``verdict`` NOTE: without an expected value, or left out."""

    part: str
    what: str
    measured: str
    expected: str = ""
    verdict: Level = Level.NOTE
    cure: str = ""


def judged(part: str, what: str, measured: str, expected: str, is_good: bool, cure: str) -> Measurement:
    """A line with a verdict; ``cure``: advice if it is wrong."""
    verdict = Level.GOOD if is_good else Level.ERROR
    return Measurement(part, what, measured, expected, verdict, "" if is_good else cure)


def left_out(part: str, reason: str, cure: str) -> Measurement:
    """A line about a part that was not run."""
    return Measurement(part, "left out", reason, "", Level.NOTE, cure)


@dataclass
class SelfTest:
    """The lines of a self-test, and its data by part."""

    board_id: str
    simulated: bool
    program_crc: int
    lines: list[Measurement] = field(default_factory=list)
    data: dict[str, Any] = field(default_factory=dict)

    def add(self, lines: Iterable[Measurement]) -> None:
        """Append lines."""
        self.lines.extend(lines)

    @property
    def failed(self) -> list[Measurement]:
        """The lines that are wrong."""
        return [line for line in self.lines if line.verdict is Level.ERROR]

    def failed_in(self, *parts: str) -> bool:
        """Whether a line of one of these parts is wrong."""
        return any(line.part in parts for line in self.failed)

    def to_json(self) -> dict[str, Any]:
        """The content of ``selftest.json`` and ``--json``."""
        lines = [{**asdict(line), "verdict": line.verdict.word} for line in self.lines]
        return {
            "selftest": 1,
            "board_id": self.board_id,
            "simulated": self.simulated,
            "program_crc": self.program_crc,
            "passed": not self.failed,
            "lines": lines,
            "data": self.data,
        }
