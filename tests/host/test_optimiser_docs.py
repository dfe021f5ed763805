"""The page on the searches lists every parameter with its default and its range."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from armtempo import optimise
from armtempo.optimise.parameters import Number

PAGE = (Path(__file__).parents[2] / "host" / "docs" / "optimisers.md").read_text(encoding="utf-8")


def rows() -> list[list[str]]:
    """Cells of the table of parameters."""
    table = PAGE[PAGE.index("| of | parameter |") :].split("\n\n")[0]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()[2:]]


@pytest.mark.parametrize("algorithm", sorted(optimise.ALGORITHMS))
def test_the_table_is_what_the_searches_take(algorithm: str) -> None:
    listed = {}
    for of, names, _, defaults, allowed in rows():
        if f"`{algorithm}`" in of:
            found, ranges = re.findall(r"`(\w+)`", names), allowed.split(", ")
            ranges = ranges * len(found) if len(ranges) == 1 else ranges
            for name, default, limit in zip(found, defaults.split(", "), ranges, strict=False):
                listed[name] = (default, limit if " to " in limit else allowed)
    known = {}
    for name, parameter in optimise.parameters(algorithm).items():
        if isinstance(parameter, Number):
            known[name] = (f"{parameter.default:g}", f"{parameter.least:g} to {parameter.most:g}")
        else:
            words = ", ".join(f'`"{word}"`' for word in parameter.words)
            known[name] = (f'`"{parameter.default}"`', words)
    assert listed == known
