"""Short names for a program's own functions, classes, attributes, globals and parameters."""

from __future__ import annotations

import array
import ast
import builtins
import io
import keyword
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from itertools import product
from string import ascii_lowercase

from armtempo.deploy.compact.merge import CORE
from armtempo.deploy.compact.scopes import top_names

_TYPES = (
    object,
    type,
    str,
    bytes,
    bytearray,
    memoryview,
    int,
    list,
    tuple,
    dict,
    set,
    array.array,
    io.FileIO,
    io.StringIO,
    BaseException,
)
_SHORTEST = 3
"""Names of fewer letters stay."""


def short_names(trees: Mapping[str, ast.Module], keep: Collection[str]) -> dict[str, str]:
    """A short name for each name that is the program's own; the most frequent come first.

    Not shortened: what built-in types or imported modules may mean by it, what stands in a string or is a
    keyword in a call, names of modules, and ``keep``. A name is the same everywhere, whatever it names.
    """
    nodes = [node for tree in trees.values() for node in ast.walk(tree)]
    modules = {part for module in trees for part in module.split(".")}
    fixed = {*keep, *modules, *_built_in(), *_imported(nodes), *_keywords(nodes), *_strings(nodes)}
    used = Counter(name for node in nodes for name in _mentioned(node))
    defined = {name for tree in trees.values() for name in _defined(tree)}
    free = (name for name in _short() if name not in fixed and name not in used)
    return {
        name: next(free)
        for name, _ in used.most_common()
        if name in defined and name not in fixed and len(name) >= _SHORTEST and not name.startswith("__")
    }


def shorten(trees: Mapping[str, ast.Module], names: Mapping[str, str]) -> None:
    """Rename what stands in ``names``, and the parameters of functions to single letters."""
    nodes = [node for tree in trees.values() for node in ast.walk(tree)]
    keywords = set(_keywords(nodes))
    for node in nodes:
        if isinstance(node, ast.FunctionDef):
            _shorten_parameters(node, keywords)
    for node in nodes:
        _rename(node, names)


def _short() -> Iterator[str]:
    """Two letters, then three."""
    for length in (2, 3):
        for letters in product(ascii_lowercase, repeat=length):
            name = "".join(letters)
            if not keyword.iskeyword(name):
                yield name


def _defined(tree: ast.Module) -> Iterator[str]:
    """Functions, classes, attributes that are set, and what the module assigns."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            yield node.attr
    yield from top_names(tree)


def _mentioned(node: ast.AST) -> Iterator[str]:
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        yield node.name
    elif isinstance(node, ast.Attribute):
        yield node.attr
    elif isinstance(node, ast.Name):
        yield node.id
    elif isinstance(node, ast.arg):
        yield node.arg


def _built_in() -> Iterator[str]:
    yield from dir(builtins)
    for each in _TYPES:
        yield from dir(each)


def _imported(nodes: Collection[ast.AST]) -> Iterator[str]:
    """Imported names, and what is asked of them: ``sys.implementation._mpy``."""
    roots = set()
    for node in nodes:
        if isinstance(node, ast.Import | ast.ImportFrom):
            roots |= {alias.asname or alias.name.split(".")[0] for alias in node.names}
    yield from roots - {CORE}
    for node in nodes:
        if isinstance(node, ast.Attribute) and _root(node) in roots - {CORE}:
            yield node.attr


def _root(node: ast.expr) -> str:
    while isinstance(node, ast.Attribute | ast.Call):
        node = node.value if isinstance(node, ast.Attribute) else node.func
    return node.id if isinstance(node, ast.Name) else ""


def _keywords(nodes: Collection[ast.AST]) -> Iterator[str]:
    for node in nodes:
        if isinstance(node, ast.keyword) and node.arg:
            yield node.arg


def _strings(nodes: Collection[ast.AST]) -> Iterator[str]:
    for node in nodes:
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


def _shorten_parameters(function: ast.FunctionDef, keywords: Collection[str]) -> None:
    """Positions are all that calls know of a parameter, unless one names it."""
    inner = list(ast.walk(function))
    used = {name for node in inner for name in _mentioned(node)}
    letters = (letter for letter in ascii_lowercase if letter not in used)
    arguments = [*function.args.args, *([function.args.vararg] if function.args.vararg else [])]
    names = {each.arg: next(letters) for each in arguments if each.arg not in keywords and len(each.arg) > 1}
    for node in inner:
        if isinstance(node, ast.Name | ast.arg):
            _rename(node, names)


def _rename(node: ast.AST, names: Mapping[str, str]) -> None:
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        node.name = names.get(node.name, node.name)
    elif isinstance(node, ast.Attribute):
        node.attr = names.get(node.attr, node.attr)
    elif isinstance(node, ast.Name):
        node.id = names.get(node.id, node.id)
    elif isinstance(node, ast.arg):
        node.arg = names.get(node.arg, node.arg)
    elif isinstance(node, ast.Global | ast.Nonlocal):
        node.names = [names.get(name, name) for name in node.names]
    elif isinstance(node, ast.ImportFrom):
        for alias in node.names:
            alias.name = names.get(alias.name, alias.name)
