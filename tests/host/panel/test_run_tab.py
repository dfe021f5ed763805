"""Past runs."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from armtempo.basics.errors import RunFolderError
from armtempo.panel import past_runs


def test_runs_of_the_command_line_are_listed_the_newest_first(tmp_path: Path) -> None:
    for number, (name, state) in enumerate({"feed-001": "complete", "feed-002": "fault"}.items()):
        (tmp_path / name).mkdir()
        made = {"duration_s": 6.8, "fault": "" if state == "complete" else "estop", "state": state}
        meta = {"format": "armtempo run", "started": "2026-01-02T03:04:05+00:00", "repetitions": [made, made]}
        (tmp_path / name / "run.json").write_text(json.dumps(meta))
        os.utime(tmp_path / name / "run.json", (1000 + number, 1000 + number))
    for name, text in (("damaged", "{"), ("other", "[1]"), ("empty", "{}")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "run.json").write_text(text)
        os.utime(tmp_path / name / "run.json", (1, 1))
    rows = past_runs.listed(tmp_path)
    assert [(row.folder.name, row.duration, row.ending) for row in rows[:2]] == [
        ("feed-002", "13.6 s", "estop"),
        ("feed-001", "13.6 s", "complete"),
    ]
    assert {row.ending for row in rows[2:]} == {"cannot be read"}
    with pytest.raises(RunFolderError, match="cannot be read"):
        past_runs.report(tmp_path / "damaged")
