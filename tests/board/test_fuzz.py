"""Random and mutated frames through parser and handlers, a share of them on MicroPython."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests import interpreters

SCRIPT = Path(__file__).parent / "scripts" / "cases" / "fuzz.py"
FRAMES = {"cpython": 100_000, "micropython": 50_000, "micropython-arm": 10_000}
SEED = 20261121


@pytest.mark.slow
@pytest.mark.parametrize("name", interpreters.EACH)
def test_no_exception_no_wrong_check_no_motion(name: str) -> None:
    """The script asserts all three (and names the seed in its arguments); every handler is reached."""
    given, acted, bad, reached = interpreters.run(name, SCRIPT, str(FRAMES[name]), str(SEED)).split()
    assert int(given) == FRAMES[name]
    assert int(acted) > 0.3 * FRAMES[name]
    assert int(bad) > 0.1 * FRAMES[name]
    assert reached == "True"
