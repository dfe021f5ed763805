"""Every figure of the pages is made by the script that makes them all."""

from __future__ import annotations

import re
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

from armtempo.model import engine_pins

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
    assert {path.name for path in shown()} == MADE | {"wiring.svg"}
    for path in shown():
        assert path.parent == IMAGES or path.name == "wiring.svg"
        assert path.stat().st_size > 10_000


def test_the_wiring_diagram_shows_the_pins_of_the_board_program() -> None:
    """``python host/docs/site/make_wiring.py`` makes it anew."""
    path = ROOT / "host" / "docs" / "site" / "make_wiring.py"
    spec = spec_from_file_location("make_wiring", path)
    assert spec is not None
    assert spec.loader is not None
    made = module_from_spec(spec)
    spec.loader.exec_module(made)
    drawn = made.svg()
    assert made.TARGET.read_text(encoding="utf-8") == drawn
    pins = engine_pins.table()
    shown_pins = re.findall(r">(P[A-E]\d+)<", drawn)
    wired = [row[0] for row in pins["STEP"]] + [*pins["DIR"], *pins["LIMIT"], pins["ENABLE"], pins["ESTOP"]]
    wired += [pin for row in pins["ENCODER"] for pin in row[1:3]]
    assert sorted(shown_pins) == sorted(f"P{pin}" for pin in wired)
