"""Tables of the pages that follow from the code are those that the script writes."""

from __future__ import annotations

import pytest

from tests import sources
from tests.interpreters import ROOT

SCRIPT = sources.script(ROOT / "host" / "docs" / "make_tables.py")


@pytest.mark.parametrize("name", SCRIPT.TABLES)
def test_page_is_current(name: str) -> None:
    text = (ROOT / "host" / "docs" / name).read_text(encoding="utf-8")
    assert SCRIPT.page(name) == text, "run: python host/docs/make_tables.py"
