"""Every error of armtempo's tree that the host's source can make, found in its syntax trees."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from armtempo.basics import errors

from tests.sources import parsed

HOST = Path(errors.__file__).parents[1]
MADE_FROM_PARTS = {"MissingPackageError"}
"""Classes that write their own problem and hint."""


@dataclass(frozen=True)
class ErrorMessage:
    """One place where an error is made; ``problem`` and ``hint`` are source text, as in an f-string.

    ``hint`` is None if none is given.
    """

    file: str
    line: int
    kind: str
    problem: str
    hint: str | None


def tree_of(kind: type[Exception] = errors.ArmtempoError) -> Iterator[str]:
    """Names of the classes of armtempo's errors."""
    yield kind.__name__
    for below in kind.__subclasses__():
        yield from tree_of(below)


def in_source(text: str, file: str) -> Iterator[ErrorMessage]:
    """All errors that a module makes, raised there or not."""
    kinds = set(tree_of()) - MADE_FROM_PARTS
    if not any(kind in text for kind in kinds):
        return
    for node in ast.walk(parsed(text)):
        if isinstance(node, ast.Call) and (name := _last_name(node.func)) in kinds:
            given = {word.arg: word.value for word in node.keywords}
            arguments = dict(zip(("problem", "hint"), node.args, strict=False)) | given
            hint = _words(arguments["hint"]) if "hint" in arguments else None
            yield ErrorMessage(file, node.lineno, name, _words(arguments.get("problem")), hint)


def in_host() -> list[ErrorMessage]:
    """All errors that the host makes."""
    return [
        message
        for path in sorted(HOST.rglob("*.py"))
        if "hardware" not in path.parts
        for message in in_source(path.read_text(encoding="utf-8"), str(path.relative_to(HOST)))
    ]


def _last_name(node: ast.expr) -> str:
    """``C`` of ``a.b.C``; nothing of what has no name."""
    return node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")


def _words(node: ast.expr | None) -> str:
    """The text of a literal, ``{expression}`` for what is put in; another expression as it stands, in braces."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(
            str(part.value) if isinstance(part, ast.Constant) else f"{{{ast.unparse(part.value)}}}"
            for part in node.values
            if isinstance(part, ast.Constant | ast.FormattedValue)
        )
    return f"{{{ast.unparse(node)}}}" if node is not None else ""
