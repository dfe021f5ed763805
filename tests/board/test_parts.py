"""Parts of a motion: whichever halves are kept and used again, each is that of the segment."""

from __future__ import annotations

from pathlib import Path

from tests import interpreters
from tests.board import motions

SCRIPT = Path(__file__).parent / "scripts" / "probes" / "halves.py"


def test_parts_are_the_segments_halves_whatever_way_leads_to_them(interpreter: str, tmp_path: Path) -> None:
    records = [motions.feeding(), motions.feeding(degree=3, refine=3)]
    paths = [tmp_path / f"{number}.atm" for number in range(len(records))]
    for path, record in zip(paths, records, strict=True):
        path.write_bytes(record)
    count, deepest = map(int, interpreters.run(interpreter, SCRIPT, *map(str, paths)).split())
    assert count > 1000
    assert deepest > 8
