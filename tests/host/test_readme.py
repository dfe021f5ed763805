"""The tour of the code: the calls and places that it names exist; and the pages link to what exists."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path

import pytest

from tests import sources

ROOT = Path(__file__).parents[2]
TOUR = (ROOT / "host" / "docs" / "architecture.md").read_text(encoding="utf-8")
SOURCES = {
    "host": ROOT / "host" / "armtempo",
    "shared": ROOT / "shared" / "armtempo_shared",
    "board": ROOT / "board" / "armtempo_board",
}
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(ROOT.glob("*/docs/*.md"))]


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


@sources.TOGETHER
@pytest.mark.parametrize(("side", "name"), sorted(set(mentioned())))
def test_what_the_tour_names_exists(side: str, name: str) -> None:
    assert name in names(side)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
        assert "://" in target or (page.parent / target).exists(), target


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
