"""A package without packages in it: its modules are side by side, which needs fewer names and files."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Mapping


def flatten(trees: Mapping[str, ast.Module]) -> tuple[dict[str, ast.Module], dict[str, str]]:
    """The modules by names of two parts at most, and that name by the one before; ``trees`` is used up.

    Packages within packages go; they may hold nothing but a docstring. Raises ValueError where one holds more, or
    where two modules would have one name.
    """
    inner = {
        module for module in trees if "." in module and any(each.startswith(f"{module}.") for each in trees)
    }
    flat: dict[str, str] = {}
    for module in trees.keys() - inner:
        top, *rest = module.split(".")
        flat[module] = ".".join([top, *rest[-1:]])
    _check(trees, inner, flat)
    for tree in trees.values():
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.module:
                node.module = flat.get(
                    node.module, node.module.split(".")[0] if node.module in inner else node.module
                )
    return {flat[module]: trees[module] for module in trees if module not in inner}, flat


def _check(trees: Mapping[str, ast.Module], inner: set[str], flat: Mapping[str, str]) -> None:
    for module in inner:
        if any(not isinstance(node, ast.Expr) for node in trees[module].body):
            raise ValueError(f"{module}: a package within a package holds nothing but its docstring")
    twice = [name for name, count in Counter(flat.values()).items() if count > 1]
    if twice:
        raise ValueError(f"two modules are called {twice[0]}")
