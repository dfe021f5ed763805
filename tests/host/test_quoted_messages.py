"""What the pages quote as said by the program is said by it, word for word."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path

import pytest

from tests import sources

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted(ROOT.glob("*/docs/*.md"))]
SOURCES = ("host/armtempo", "board/armtempo_board", "shared/armtempo_shared")
LEAST_WORDS = 3
"""Shorter quotes are words that are spoken of."""
ANYTHING = "\0"
"""What stands in a text of the program for a value that is put in."""
NOT_SAID = {"upload to ready": "protocol.md: the name of a row of a table in another page"}


def quotes(page: Path) -> list[str]:
    """In double quotes, outside of code."""
    text = re.sub(
        r"^```.*?^```|`[^`\n]*`|^    .*?$",
        "",
        page.read_text(encoding="utf-8"),
        flags=re.DOTALL | re.MULTILINE,
    )
    found = re.findall(r'"([^"\n]+)"', re.sub(r"\n(?!\n)", " ", text))
    return [
        quote
        for quote in found
        if len(re.findall(r"[A-Za-z]{2,}", quote)) >= LEAST_WORDS and quote not in NOT_SAID
    ]


@cache
def texts() -> str:
    """All texts in the program's sources, one a line."""
    found = []
    for folder in SOURCES:
        for file in (ROOT / folder).rglob("*.py"):
            for node in ast.walk(sources.tree(file)):
                if isinstance(node, ast.JoinedStr):
                    found.append(
                        "".join(
                            str(part.value) if isinstance(part, ast.Constant) else ANYTHING
                            for part in node.values
                        )
                    )
                elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                    found.append(node.value)
    return "\n".join(re.sub(r"\s+", " ", text) for text in found)


def is_said(quote: str) -> bool:
    """Whether the program says it; numbers may be values, … stands for anything."""
    parts = [part.strip() for part in quote.split("…") if part.strip()]
    return all(
        re.search(re.sub(r"\d+%?", rf"(?:\\d+|{ANYTHING})", re.escape(part)), texts()) for part in parts
    )


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_what_is_quoted_is_said(page: Path) -> None:
    assert [quote for quote in quotes(page) if not is_said(quote)] == []


@sources.TOGETHER
def test_there_are_quotes_and_a_wrong_one_is_noticed() -> None:
    assert sum(len(quotes(page)) for page in PAGES) >= 10
    assert not is_said("the flash has lots of room")
