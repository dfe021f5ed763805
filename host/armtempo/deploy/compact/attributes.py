"""Short names for attributes: those that no object has together may share one."""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterator, Mapping, Sequence


def attributes(trees: Mapping[str, ast.Module]) -> set[str]:
    """Methods, class variables, and attributes that are set."""
    nodes = [node for tree in trees.values() for node in ast.walk(tree)]
    return {name for node in nodes for name in (*_defined(node), *_set(node))}


def share(trees: Mapping[str, ast.Module], names: Collection[str], shorts: Sequence[str]) -> dict[str, str]:
    """A short name for each of ``names``; ``shorts``: as many at least, the best first."""
    together = _together(trees)
    beside = {name: {*()}.union(*(group for group in together if name in group)) for name in names}
    found: dict[str, str] = {}
    for name in sorted(names, key=lambda name: (-len(beside[name]), name)):
        taken = {found[other] for other in beside[name] & found.keys()}
        found[name] = next(short for short in shorts if short not in taken)
    return found


def _together(trees: Mapping[str, ast.Module]) -> list[set[str]]:
    """What the objects of a class and of all its relations may have; what no class defines, all may have."""
    nodes = [node for tree in trees.values() for node in ast.walk(tree)]
    families: list[tuple[set[str], set[str]]] = []
    for node in nodes:
        if isinstance(node, ast.ClassDef):
            names = {node.name, *(ast.unparse(base).rsplit(".", 1)[-1] for base in node.bases)}
            has = {*_defined(node), *(name for each in ast.walk(node) for name in _set(each, "self"))}
            for family in [family for family in families if family[0] & names]:
                families.remove(family)
                names |= family[0]
                has |= family[1]
            families.append((names, has))
    groups = [has for _, has in families]
    anywhere = {name for node in nodes for name in _set(node)}.difference(*groups)
    return [group | anywhere for group in groups] or [anywhere]


def _defined(node: ast.AST) -> Iterator[str]:
    """What a class itself defines."""
    if isinstance(node, ast.ClassDef):
        yield from (each.name for each in node.body if isinstance(each, ast.FunctionDef))
        yield from class_variables(node)


def class_variables(node: ast.ClassDef) -> set[str]:
    """What a class assigns."""
    targets = [target for each in node.body if isinstance(each, ast.Assign) for target in each.targets]
    return {target.id for target in targets if isinstance(target, ast.Name)}


def _set(node: ast.AST, on: str = "") -> Iterator[str]:
    """The attribute that is set here; ``on``: only if it is one of what has this name."""
    if (
        isinstance(node, ast.Attribute)
        and isinstance(node.ctx, ast.Store)
        and on in ("", ast.unparse(node.value))
    ):
        yield node.attr
