"""Python sources as syntax trees, and scripts that write files of the project, for the tests that read its code."""

from __future__ import annotations

import ast
import runpy
from functools import cache
from pathlib import Path
from types import SimpleNamespace

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


@cache
def nodes(path: Path) -> tuple[ast.AST, ...]:
    """Of a file, all of them."""
    return tuple(ast.walk(tree(path)))


def script(path: Path) -> SimpleNamespace:
    """The names of a script that is no module of a package; it is not run as the main program."""
    return SimpleNamespace(**runpy.run_path(str(path)))
