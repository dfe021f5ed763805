"""Which functions of the sources a traceback of the compact program names: short names stand for several."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from armtempo.deploy.compact.shorten import Names

_FRAME = re.compile(r'(File "([^"]+)", line \d+, in )(\w+)')


@dataclass(frozen=True)
class Function:
    """``label``: module, class and name; ``name``: what callers call, a dot before methods; ``mentions``: names in it.

    ``named``: it has kept its name, as it may be called without being mentioned.
    """

    label: str
    name: str
    mentions: frozenset[str]
    named: bool


Functions = dict[tuple[str, str], list[Function]]
"""By the last part of the module's name, and the function's name in the compact program."""


def functions(trees: Mapping[str, ast.Module], names: Names) -> Functions:
    """Of the modules before their names are shortened."""
    found: Functions = {}
    for module, tree in trees.items():
        last = module.rsplit(".", 1)[-1]
        for node, around in _functions(tree):
            short = (names.attributes if around else names.own[module]).get(node.name, node.name)
            name = around if node.name == "__init__" else f".{node.name}" if around else node.name
            called = Function(
                label(last, node.name, around), name, frozenset(_mentions(node)), short == node.name
            )
            found.setdefault((last, short), []).append(called)
    return found


def label(module: str, name: str, around: str = "") -> str:
    """Module, class (``around``) and name in the sources; a name of the merged module has its module before it."""
    found = ".".join([each for each in (around, name) if each])
    return found.replace("__", ".", 1) if "__" in found.split(".")[0] else f"{module}.{found}"


def _mentions(function: ast.FunctionDef) -> Iterator[str]:
    for node in ast.walk(function):
        if isinstance(node, ast.Name):
            yield node.id
        elif isinstance(node, ast.Attribute):
            yield node.attr  # of a module
            yield f".{node.attr}"


def in_full(traceback: str, known: Functions, paths: Mapping[str, str]) -> str:
    """The traceback with the sources' files and functions in the place of the compact program's.

    ``paths``: of the source files, by the last part of the module's name. Of several functions that a name may
    stand for, those are left that the one before calls and that call the next; more than one are all named.
    """
    frames = list(_FRAME.finditer(traceback))
    chain = [known.get((_stem(frame[2]), frame[3]), []) for frame in frames]
    for at in range(len(chain) - 1):
        chain[at + 1] = [one for one in chain[at + 1] if _calls(chain[at], [one])] or chain[at + 1]
    for at in reversed(range(len(chain) - 1)):
        chain[at] = [one for one in chain[at] if _calls([one], chain[at + 1])] or chain[at]
    parts = iter(chain)

    def place(frame: re.Match[str]) -> str:
        labels = [one.label for one in next(parts)]
        if len(labels) == 1:
            module, _, name = labels[0].partition(".")
            return f'File "{paths.get(module, module)}", in {name}'
        return frame[0] + (f" ({' or '.join(labels)})" if labels else "")

    return _FRAME.sub(place, traceback)


def _calls(callers: list[Function], called: list[Function]) -> bool:
    return any(two.named or two.name in one.mentions for one in callers for two in called)


def _functions(tree: ast.Module) -> Iterator[tuple[ast.FunctionDef, str]]:
    """Functions and methods, with the class that is around."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            yield node, ""
        elif isinstance(node, ast.ClassDef):
            yield from ((each, node.name) for each in node.body if isinstance(each, ast.FunctionDef))


def _stem(file: str) -> str:
    """``core`` of a compiled file."""
    return file.rsplit("/", 1)[-1].removesuffix(".py")
