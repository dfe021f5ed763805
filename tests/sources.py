"""Python sources as syntax trees, for the tests that read the project's own code."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

import pytest

TOGETHER = pytest.mark.xdist_group("sources")
"""Tests of one worker: parsing takes most of their time, and is done once there."""


@cache
def parsed(text: str) -> ast.Module:
    """Of a file's text; not to be changed, as others get the same."""
    return ast.parse(text)


def tree(path: Path) -> ast.Module:
    """Of a file."""
    return parsed(path.read_text(encoding="utf-8"))
