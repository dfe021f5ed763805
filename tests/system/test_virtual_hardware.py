"""The simulated hardware behaves like the chip's, on every interpreter."""

from __future__ import annotations

from pathlib import Path

from tests import scripted

CASES = Path(__file__).parent / "scripts" / "cases"
SCRIPTS = tuple(CASES / f"virtual_{name}.py" for name in ("hardware", "time", "flash"))


@scripted.each([case for script in SCRIPTS for case in scripted.cases(script)])
def test_case(case: scripted.Case, tmp_path: Path) -> None:
    (tmp_path / "flash").mkdir()
    case.run(str(tmp_path), heap="")
