"""What the report of a recorded sequence says of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from armtempo.report import sequence_report
from armtempo.report.sequence_reader import RowPassed, SequenceRun
from armtempo.report.sequence_report import LegResult
from armtempo.report.verdict import BAD, GOOD, OPEN, Verdict

JOINT = "waist"


def recorded(state: str = "finished", passed: int = 2, **ended: object) -> SequenceRun:
    """Two rows that were heard of, the last as the ``passed``-th."""
    rows = tuple(
        RowPassed(number, 0.5 * number, 1, row, 1, 0, 0, "move there")
        for row, number in enumerate((1, passed))
    )
    joint: Any = type("Scale", (), {"name": JOINT})
    none: Any = None
    meta = {"name": "pick", "state": state, "ended": {"step": 1, "cycle": 3, **ended}}
    return SequenceRun(Path(), meta, (joint,), rows, none, none, none)


def leg(runs: int = 3, whole: int = 3, end_steps: float = 0.4, measured_deg: float = 0.02) -> LegResult:
    values = [np.array([value]) for value in (0.5, end_steps, measured_deg, measured_deg / 2)]
    return LegResult(1, "move there", 1.0, runs, whole, *values)


def findings(told: Verdict) -> list[tuple[str, str]]:
    return [(item.state, item.text) for item in told.findings]


def test_a_whole_run() -> None:
    assert findings(sequence_report.verdict(recorded(), (leg(),))) == [
        (GOOD, "finished after 3 whole cycles"),
        (GOOD, "each of 3 whole motions ended on its planned step"),
        (GOOD, f"{JOINT} was measured at most 0.020° from the plan"),
    ]


@pytest.mark.parametrize(
    ("found", "legs", "state", "text"),
    [
        (recorded(passed=5), leg(), OPEN, "3 rows were not reported to the host"),
        (recorded(), leg(runs=5), OPEN, "2 runs of motions lack samples, or did not reach their end"),
        (recorded(), leg(end_steps=7.0), BAD, "a motion ended 7.0 steps from its planned end"),
        (recorded(), leg(measured_deg=np.nan), OPEN, f"{JOINT} has no encoder"),
        (recorded("stopped"), leg(), OPEN, "stopped in step 1 after 3 whole cycles"),
        (recorded("refused", code="busy"), leg(), BAD, "refused (busy) in step 1 after 3 whole cycles"),
    ],
)
def test_what_is_not_as_it_should_be_comes_first(
    found: SequenceRun, legs: LegResult, state: str, text: str
) -> None:
    first_state, first_text = findings(sequence_report.verdict(found, (legs,)))[0]
    assert first_state == state
    assert first_text.startswith(text)
