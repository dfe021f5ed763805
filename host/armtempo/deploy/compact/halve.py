"""A large module becomes two, the first imported by the second: what its import leaves free is filled by the second.

MicroPython keeps a block for each function of a module until the module has been carried out. So each function leaves
one free block behind it, too small for anything but the functions of a module that comes later.
"""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterator

from armtempo.deploy.compact.scopes import top_names

_LEAST_FUNCTIONS = 100
"""Of a smaller module the blocks are fewer than what another module takes."""

_FIRST_PERCENT = 25
"""Of the functions, about this many in the first: so both files of the board program fill their blocks of the flash."""


def halve(trees: dict[str, ast.Module], module: str, first: str) -> None:
    """Put the first part of ``module``, by its functions, into the new module ``first`` of its package.

    The first mentions nothing of the second. What is mentioned of it anywhere else, ``module`` imports from there.
    A small module stays whole, and one that can be cut nowhere. Raises ValueError where a function changes a name of
    the module: the other one would not know of it.
    """
    package, name = module.rsplit(".", 1)
    body = trees[module].body
    if any(isinstance(node, ast.Global) for node in ast.walk(trees[module])):
        raise ValueError(f"{module}: a function changes a name of the module")
    counts = [sum(isinstance(node, ast.FunctionDef) for node in ast.walk(top)) for top in body]
    if sum(counts) < _LEAST_FUNCTIONS:
        return
    read = [_names([top]) for top in body]
    made = [top_names(ast.Module([top], [])) for top in body]
    cuts = [at for at in range(len(body)) if not set().union(*read[:at]) & set().union(*made[at:])]
    cut = min(cuts, key=lambda at: abs(100 * sum(counts[:at]) - _FIRST_PERCENT * sum(counts)))
    imports = [node for node in body[:cut] if isinstance(node, ast.Import | ast.ImportFrom)]
    early, late = body[len(imports) : cut], body[cut:]
    if not early or not late:
        return
    wanted = _names(late).union(*(_asked_of(name, tree) for tree in trees.values()))
    shared = [ast.alias(each) for each in sorted(top_names(ast.Module(early, [])) & wanted)]
    trees[f"{package}.{first}"] = ast.Module([*_used(imports, early), *early], [])
    own_import = ast.ImportFrom(f"{package}.{first}", shared, 0)
    trees[module] = ast.Module([own_import, *_used(imports, late), *late], [])


def _names(nodes: Collection[ast.AST]) -> set[str]:
    return {inner.id for node in nodes for inner in ast.walk(node) if isinstance(inner, ast.Name)}


def _asked_of(module: str, tree: ast.Module) -> set[str]:
    """Attributes of a module that another one mentions."""
    nodes = [node for node in ast.walk(tree) if isinstance(node, ast.Attribute)]
    return {node.attr for node in nodes if isinstance(node.value, ast.Name) and node.value.id == module}


def _used(imports: Collection[ast.Import | ast.ImportFrom], nodes: Collection[ast.AST]) -> Iterator[ast.stmt]:
    """Those of one name each that the nodes mention."""
    names = _names(nodes)
    for node in imports:
        used = [alias for alias in node.names if (alias.asname or alias.name) in names]
        if used and isinstance(node, ast.ImportFrom):
            yield ast.ImportFrom(node.module, used, node.level)
        elif used:
            yield ast.Import(used)
