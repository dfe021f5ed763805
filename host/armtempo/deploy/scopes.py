"""Which names mean what in a module: its own, those it imports from the program, those of a function."""

from __future__ import annotations

import ast
from collections.abc import Collection
from dataclasses import dataclass

Function = ast.FunctionDef | ast.Lambda


@dataclass(frozen=True)
class Target:
    """The meaning of an imported name: a module of the program, or a name in one."""

    module: str
    name: str | None = None


def imported(nodes: Collection[ast.AST], program: Collection[str]) -> dict[str, Target]:
    """Names that ``from ... import`` statements among the nodes bring in from modules of ``program``."""
    found = {}
    for node in nodes:
        if isinstance(node, ast.ImportFrom):
            for alias in node.names:
                whole = f"{node.module}.{alias.name}"
                if whole in program:
                    found[alias.asname or alias.name] = Target(whole)
                elif node.module in program:
                    found[alias.asname or alias.name] = Target(str(node.module), alias.name)
    return found


def imported_inside(tree: ast.Module, program: Collection[str]) -> dict[str, Target]:
    """The same for imports inside of functions."""
    top = set(tree.body)
    return imported([node for node in ast.walk(tree) if node not in top], program)


def local_names(function: Function) -> set[str]:
    """Names that belong to a function: parameters and all that it binds and does not declare global."""
    arguments = function.args
    every = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs]
    found = {argument.arg for argument in (*every, arguments.vararg, arguments.kwarg) if argument}
    if isinstance(function, ast.FunctionDef):
        outside = set[str]()
        for node in function.body:
            found |= stored(node, outside)
        found -= outside
    return found


def stored(node: ast.AST, outside: set[str] | None = None) -> set[str]:
    """Names that a statement binds, but not what functions in it bind; ``outside`` gets those it declares global."""
    found: set[str] = set()
    waiting = [node]
    while waiting:
        inner = waiting.pop()
        if isinstance(inner, ast.Name):
            if isinstance(inner.ctx, ast.Store):
                found.add(inner.id)
            continue
        if isinstance(inner, ast.FunctionDef | ast.ExceptHandler) and inner.name:
            found.add(inner.name)
        elif isinstance(inner, ast.Import | ast.ImportFrom):
            found |= {alias.asname or alias.name.split(".")[0] for alias in inner.names}
        elif isinstance(inner, ast.Global) and outside is not None:
            outside.update(inner.names)
        if not isinstance(inner, Function):
            waiting += ast.iter_child_nodes(inner)
    return found


class Scoped(ast.NodeTransformer):
    """Visits a module and knows at each name whether an enclosing function hides the module's meaning of it."""

    def __init__(self) -> None:
        self._hidden: list[set[str]] = []

    def hides(self, name: str) -> bool:
        """Whether an enclosing function binds the name."""
        return any(name in names for names in self._hidden)

    def at_top(self) -> bool:
        """Whether no function encloses this place."""
        return not self._hidden

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        """Decorators and defaults belong to what is around the function."""
        node.decorator_list = [self.visit(decorator) for decorator in node.decorator_list]
        node.args.defaults = [self.visit(default) for default in node.args.defaults]
        self._hidden.append(local_names(node))
        node.body = visit_all(self, node.body) or [ast.Pass()]
        self._hidden.pop()
        return node

    def visit_Lambda(self, node: ast.Lambda) -> ast.AST:
        """As a function."""
        self._hidden.append(local_names(node))
        node.body = self.visit(node.body)
        self._hidden.pop()
        return node


def visit_all(visitor: ast.NodeTransformer, nodes: list[ast.stmt]) -> list[ast.stmt]:
    """The statements as the visitor returns them, without those that it removes."""
    return [node for node in map(visitor.visit, nodes) if node is not None]
