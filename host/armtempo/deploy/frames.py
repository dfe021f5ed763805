"""Which functions of the sources a traceback of the plain program names: from a firmware, or from source files."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

_FRAME = re.compile(r'File "(?:[^"]*/)?(armtempo_[^"]+\.py|\w+)", line (\d+), in (\w+)')
"""From the chip's last two sectors a module's name is all that is known of its file."""


def in_full(traceback: str, sources: Mapping[str, str]) -> str:
    """The traceback with paths from the packages on, and the class before the name of a method.

    ``sources``: text by the path from the packages on.
    """

    paths = {Path(path).stem: path for path in sources}

    def place(frame: re.Match[str]) -> str:
        path, line, name = paths.get(frame[1], frame[1]), int(frame[2]), frame[3]
        if path not in sources:
            return frame[0]
        around = _around(sources[path], line, name)
        return f'File "{path}", line {line}, in {around}{name}'

    return _FRAME.sub(place, traceback)


def _around(text: str, line: int, name: str) -> str:
    """The class around the function of that name at a line, with a dot; "" if there is none."""
    places = [
        around
        for node, around in _functions(ast.parse(text))
        if node.name == name and node.lineno <= line <= (node.end_lineno or line)
    ]
    return places[0] if places else ""


def _functions(tree: ast.Module) -> Iterator[tuple[ast.FunctionDef, str]]:
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            yield node, ""
        elif isinstance(node, ast.ClassDef):
            yield from ((each, f"{node.name}.") for each in node.body if isinstance(each, ast.FunctionDef))
