"""README, pages and pictures name what exists, and are current; one word for each thing."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import armtempo
import click
import pytest
from armtempo.cli import main
from armtempo.cli.commands import COMMANDS
from armtempo.model import engine_pins

from tests import sources
from tests.interpreters import ROOT

SCRIPT = sources.script(ROOT / "host" / "docs" / "make_tables.py")
IMAGES = ROOT / "host" / "docs" / "images"
FIGURES_SCRIPT = (ROOT / "host" / "docs" / "site" / "make_figures.py").read_text(encoding="utf-8")
MADE = set(re.findall(r'^    "([\w-]+\.(?:png|gif))": ', FIGURES_SCRIPT, re.MULTILINE))
PAGES = [ROOT / "README.md", *ROOT.glob("*/docs/*.md")]
PAGE = (ROOT / "host" / "docs" / "cli.md").read_text(encoding="utf-8")
TOUR = (ROOT / "host" / "docs" / "architecture.md").read_text(encoding="utf-8")
SOURCES = {
    "host": ROOT / "host" / "armtempo",
    "shared": ROOT / "shared" / "armtempo_shared",
    "board": ROOT / "board" / "armtempo_board",
}
LINKING = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(ROOT.glob("*/docs/*.md"))]


def test_no_page_installs_armtempo_from_an_index() -> None:
    """None has it yet: an installation names a folder, such as ./armtempo."""
    wanted = re.compile(r"\binstall (?:--?[\w-]+ )*['\"]?armtempo\b(?!-)")
    assert [path.name for path in PAGES if wanted.search(path.read_text(encoding="utf-8"))] == []


def test_prose_is_wrapped_at_120_columns() -> None:
    """Tables, code, pictures and links cannot be."""
    code = re.compile(r"^```.*?^```$|^    .*$|`[^`]+`|\]\([^)]+\)", re.MULTILINE | re.DOTALL)
    for page in (*LINKING, ROOT / "tests" / "README.md"):
        lines = code.sub("", page.read_text(encoding="utf-8")).splitlines()
        assert [line for line in lines if len(line) > 120 and not line.startswith(("|", "!"))] == [], page


@pytest.mark.parametrize("name", SCRIPT.TABLES)
def test_page_is_current(name: str) -> None:
    text = (ROOT / "host" / "docs" / name).read_text(encoding="utf-8")
    assert SCRIPT.page(name) == text, "run: python host/docs/make_tables.py"


# every figure of the pages is made by the script that makes them all


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


def row(name: str) -> str:
    """The line of the tables of commands that describes this one."""
    page = re.sub(r"^## JSON\n.*?^## ", "## ", PAGE, flags=re.MULTILINE | re.DOTALL)
    found = [line for line in page.splitlines() if re.search(rf"^\|[^|]*`{name}[ `]", line)]
    assert len(found) == 1, f"{name}: {found}"
    return found[0]


def test_no_command_is_left_out() -> None:
    for name in main.list_commands(click.Context(main)):
        assert row(name), name


def test_examples_are_commands() -> None:
    for line in PAGE.splitlines():
        words = line.split()
        if words[:1] == ["armtempo"]:
            assert main.get_command(click.Context(main), words[1]) is not None, line


@cache
def names(side: str) -> frozenset[str]:
    """Modules and classes of a side, and what they define: ``module``, ``module.function``, ``Class.method``."""
    found = set()
    for path in SOURCES[side].rglob("*.py"):
        if "hardware" in path.parts and side == "host":
            continue
        module = path.parent.name if path.name == "__init__.py" else path.stem
        found.add(module)
        for node in sources.tree(path).body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                found.add(f"{module}.{node.name}")
            if isinstance(node, ast.ClassDef):
                found.add(node.name)
                found |= {
                    f"{node.name}.{part.name}" for part in node.body if isinstance(part, ast.FunctionDef)
                }
    return frozenset(found)


def mentioned() -> list[tuple[str, str]]:
    """(side, name) of each call or place in the second column of the tables of the way and of places."""
    rows = [line.split("|") for line in TOUR.splitlines()]
    cells = [row[2] for row in rows if len(row) > 3 and not set(row[1]) <= set("- ")]
    found = []
    for text in re.findall(r"`([^`]+)`", " ".join(cells)):
        side, _, name = text.rpartition(": ")
        if not name.startswith("["):
            found.append((side or "host", name))
    return found


def test_the_tables_were_found() -> None:
    assert {side for side, _ in mentioned()} == set(SOURCES)
    assert len(set(mentioned())) >= 25


@pytest.mark.slow
@sources.TOGETHER
def test_what_the_tour_names_exists() -> None:
    for side, name in sorted(set(mentioned())):
        assert name in names(side), name


def test_links_lead_somewhere() -> None:
    for page in LINKING:
        for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
            assert "://" in target or (page.parent / target).exists(), f"{page}: {target}"


def test_the_pages_on_arms_and_kinematics_name_modules_that_exist() -> None:
    for name in ("arms.md", "kinematics.md"):
        text = (ROOT / "host" / "docs" / name).read_text(encoding="utf-8")
        rows = "".join(line for line in text.splitlines() if line.startswith("|"))
        modules = set(re.findall(r"`(?:\.\./)?([\w/]+\.py)", rows))
        assert len(modules) >= 8
        places = (SOURCES["host"], SOURCES["host"] / "kinematics", ROOT / "shared")
        for module in modules:
            assert any((place / module).is_file() for place in places), f"{name}: {module}"


def test_the_tour_names_every_package() -> None:
    tour = TOUR[TOUR.index("host/armtempo/  basics") : TOUR.index("shared/armtempo_shared/   ")]
    packages = {path.parent.name for path in SOURCES["host"].glob("*/__init__.py")} | {"pipeline"}
    assert packages <= set(re.findall(r"\w+", tour))


# one word for each thing, in all names that users write


def public_names() -> Iterator[str]:
    """Names of the library, commands and options."""
    for name in armtempo.__all__:
        value = getattr(armtempo, name)
        inner = value.__all__ if inspect.ismodule(value) else vars(value) if inspect.isclass(value) else ()
        yield from (name, *(f"{name}.{one}" for one in inner if not one.startswith("_")))
    for name in COMMANDS:
        command = main.get_command(click.Context(main), name)
        assert command is not None
        yield from (name, *(f"{name} {option}" for one in command.params for option in one.opts))


def test_no_public_name_uses_another_word_for_the_same_thing() -> None:
    page = (ROOT / "host" / "docs" / "glossary.md").read_text(encoding="utf-8")
    rows = [line.strip("|").split("|") for line in page.splitlines() if line.startswith("| ")]
    assert len(rows) > 20
    others = {word.strip() for row in rows[1:] for word in row[2].split(",")} - {""}
    for name in public_names():
        words = re.split(r"[._ -]+", re.sub(r"([a-z])([A-Z])", r"\1_\2", name).lower())
        assert not others.intersection(words), name
