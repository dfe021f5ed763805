"""Every figure of the pages is made by the script that makes them all."""

from __future__ import annotations

import re
from pathlib import Path

from tests.interpreters import ROOT

IMAGES = ROOT / "host" / "docs" / "images"
SCRIPT = (ROOT / "host" / "docs" / "site" / "make_figures.py").read_text(encoding="utf-8")
MADE = set(re.findall(r'^    "([\w-]+\.(?:png|gif))": ', SCRIPT, re.MULTILINE))
PAGES = [ROOT / "README.md", *ROOT.glob("*/docs/*.md")]


def shown() -> set[Path]:
    """All pictures that a page shows."""
    return {
        (page.parent / target).resolve()
        for page in PAGES
        for target in re.findall(r"!\[[^\]]+\]\(([^)]+)\)", page.read_text(encoding="utf-8"))
    }


def test_figures_are_made_shown_and_there() -> None:
    assert {path.name for path in IMAGES.iterdir()} == MADE
    assert {path.name for path in shown()} == MADE
    for path in shown():
        assert path.parent == IMAGES
        assert path.stat().st_size > 10_000
