"""The store: whatever fails and whenever, the old record or the new one is there, whole."""

from __future__ import annotations

from pathlib import Path

from tests import scripted

SCRIPT = Path(__file__).parent / "scripts" / "cases" / "store_cuts.py"


@scripted.each(scripted.cases(SCRIPT))
def test_old_or_new_after_a_failure_at_every_change(case: scripted.Case) -> None:
    case.run(heap="")
