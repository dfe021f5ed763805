"""Make the board program small before it is compiled: what a module costs in a board's memory is largely names.

MicroPython keeps every name that a file mentions, and 10 to 20 bytes for each place where a module holds one. So
packages within packages go (``_flatten``), constants are put in where they are used (``constants``), the modules that
are always needed become one (``merge``), as do others that come and go together (``join``), the program's own names
become short (``shorten``), and what is called only while nothing moves is imported for the call (``set_up``). The
behaviour of the program does not change.
"""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from armtempo.deploy.compact.constants import fold
from armtempo.deploy.compact.frames import Function, Functions, functions, label
from armtempo.deploy.compact.join import join
from armtempo.deploy.compact.merge import CORE, merge, used_whole
from armtempo.deploy.compact.set_up import SET_UP, move, set_up_methods
from armtempo.deploy.compact.shorten import short_names, shorten


@dataclass(frozen=True)
class Compact:
    """``sources``: text by dotted module name. ``functions``: what the names of functions in them stand for."""

    sources: dict[str, str]
    functions: Functions


def compact(
    sources: Mapping[str, str],
    main: str,
    entries: Collection[str],
    keep: Collection[str],
    together: Mapping[str, Collection[str]] = MappingProxyType({}),
    at_rest: Collection[str] = (),
) -> Compact:
    """A program of fewer modules and shorter names that does the same.

    ``sources``: text by dotted module name, packages by their own. ``main``: what it needs at once becomes the
    module ``core`` of its package. ``entries``: modules that are imported from outside, ``main`` among
    them. ``keep``: names that must stay, as they are used from outside or made at run time. ``together``: modules that
    become part of another one (``join``). ``at_rest``: methods, by module, class and name, that are called only
    while nothing moves (``set_up``). Raises ValueError if a
    module asks another for a name that is not there, or a package cannot be made flat.
    """
    trees, flat = _flatten({module: _at_run_time(ast.parse(text)) for module, text in sources.items()})
    whole = used_whole(trees)
    fold(trees, whole)
    join(trees, {flat[home]: [flat[module] for module in modules] for home, modules in together.items()})
    merged = merge(trees, flat[main], {flat[entry] for entry in entries}, keep)
    core = f"{main.split('.', 1)[0]}.{CORE}"
    apart = set_up_methods(merged[core], {_in_core(name) for name in at_rest})
    names = short_names(merged, keep, whole)
    known = functions(merged, names)
    labels = [label(CORE, method.name, node.name) for node, method in apart]
    shorten(merged, names)
    for name, of in zip(move(merged, core, apart), labels, strict=True):
        known[SET_UP, name] = [Function(of, name, frozenset(), named=True)]
    texts = {module: ast.unparse(ast.fix_missing_locations(tree)) for module, tree in merged.items()}
    return Compact(texts, known)


def without_constants(text: str) -> str:
    """A module by itself, without names of constants and what only type checkers read."""
    trees = {"": _at_run_time(ast.parse(text))}
    fold(trees, ())
    return ast.unparse(ast.fix_missing_locations(trees[""]))


def _in_core(method: str) -> str:
    """Class and method as they are called in ``core``."""
    module, name = method.rsplit(".", 2)[0], method.split(".", method.count(".") - 1)[-1]
    return f"{module.rsplit('.', 1)[-1]}__{name}"


def _at_run_time(tree: ast.Module) -> ast.Module:
    """The module without code that only type checkers read."""
    tree.body = [node for node in tree.body if not _is_for_checkers(node)]
    return tree


def _is_for_checkers(node: ast.stmt) -> bool:
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


def _flatten(trees: Mapping[str, ast.Module]) -> tuple[dict[str, ast.Module], dict[str, str]]:
    """The modules by names of two parts at most, and that name by the one before; ``trees`` is used up.

    Packages within packages go; they may hold nothing but a docstring. Raises ValueError if one holds more, or
    if two modules would have one name.
    """
    inner = {
        module for module in trees if "." in module and any(each.startswith(f"{module}.") for each in trees)
    }
    flat: dict[str, str] = {}
    for module in trees.keys() - inner:
        top, *rest = module.split(".")
        flat[module] = ".".join([top, *rest[-1:]])
    _check_flat(trees, inner, flat)
    for tree in trees.values():
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.module:
                node.module = flat.get(
                    node.module, node.module.split(".")[0] if node.module in inner else node.module
                )
    return {flat[module]: trees[module] for module in trees if module not in inner}, flat


def _check_flat(trees: Mapping[str, ast.Module], inner: set[str], flat: Mapping[str, str]) -> None:
    for module in inner:
        if any(not isinstance(node, ast.Expr) for node in trees[module].body):
            raise ValueError(f"{module}: a package within a package holds nothing but its docstring")
    twice = [name for name, count in Counter(flat.values()).items() if count > 1]
    if twice:
        raise ValueError(f"two modules are called {twice[0]}")
