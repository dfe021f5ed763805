"""Pages and their pictures: what follows from the code is current, and no command is left out."""

from __future__ import annotations

import re
from pathlib import Path

import click
import pytest
from armtempo.cli import main
from armtempo.model import engine_pins

from tests import sources
from tests.interpreters import ROOT

SCRIPT = sources.script(ROOT / "host" / "docs" / "make_tables.py")


@pytest.mark.parametrize("name", SCRIPT.TABLES)
def test_page_is_current(name: str) -> None:
    text = (ROOT / "host" / "docs" / name).read_text(encoding="utf-8")
    assert SCRIPT.page(name) == text, "run: python host/docs/make_tables.py"


# every figure of the pages is made by the script that makes them all


IMAGES = ROOT / "host" / "docs" / "images"
FIGURES_SCRIPT = (ROOT / "host" / "docs" / "site" / "make_figures.py").read_text(encoding="utf-8")
MADE = set(re.findall(r'^    "([\w-]+\.(?:png|gif))": ', FIGURES_SCRIPT, re.MULTILINE))
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
    made = sources.script(ROOT / "host" / "docs" / "site" / "make_wiring.py")
    drawn = made.svg()
    assert made.TARGET.read_text(encoding="utf-8") == drawn
    pins = engine_pins.table()
    shown_pins = re.findall(r">(P[A-E]\d+)<", drawn)
    wired = [row[0] for row in pins["STEP"]] + [*pins["DIR"], *pins["LIMIT"], pins["ENABLE"], pins["ESTOP"]]
    wired += [pin for row in pins["ENCODER"] for pin in row[1:3]]
    assert sorted(shown_pins) == sorted(f"P{pin}" for pin in wired)


# the page on the command line has one row for every command; their options are on a page that is generated


PAGE = (Path(__file__).parents[2] / "host" / "docs" / "cli.md").read_text(encoding="utf-8")


def row(name: str) -> str:
    """The line of the tables of commands that describes this one."""
    page = re.sub(r"^## JSON\n.*?^## ", "## ", PAGE, flags=re.MULTILINE | re.DOTALL)
    found = [line for line in page.splitlines() if re.search(rf"^\|[^|]*`{name}[ `]", line)]
    assert len(found) == 1, f"{name}: {found}"
    return found[0]


@pytest.mark.parametrize("name", main.list_commands(click.Context(main)))
def test_no_command_is_left_out(name: str) -> None:
    assert row(name)


def test_examples_are_commands() -> None:
    for line in PAGE.splitlines():
        words = line.split()
        if words[:1] == ["armtempo"]:
            assert main.get_command(click.Context(main), words[1]) is not None, line
