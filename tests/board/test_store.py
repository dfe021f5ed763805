"""The store: whatever fails and whenever, the old record or the new one is there, whole."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests import interpreters

SCRIPT = Path(__file__).parent / "scripts" / "cases" / "store_cuts.py"


@pytest.mark.parametrize("name", interpreters.AVAILABLE)
def test_old_or_new_after_a_failure_at_every_change(name: str) -> None:
    """The script asserts what matters; here: each operation was cut at each change, and cuts do both."""
    lines = interpreters.run(name, SCRIPT).splitlines()
    assert len(lines) == 8 * 3
    cuts = [line.rsplit(" ", 1)[1] for line in lines if " cut " in line]
    assert all(letters == "o" * letters.count("o") + "n" * letters.count("n") for letters in cuts)
    assert all("o" in letters for letters in cuts)
    assert sum(len(letters) for letters in cuts) >= 50
