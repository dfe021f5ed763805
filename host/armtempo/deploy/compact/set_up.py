"""Constructors and methods that are called only while nothing moves become a module that is imported for a call."""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterator

from armtempo.deploy.compact.scopes import Scoped, top_names

SET_UP = "set_up"
_LEAST_NODES = 50
"""Of a constructor's syntax tree: the call that takes the place of a smaller one needs as much."""

Method = tuple[ast.ClassDef, ast.FunctionDef]


def set_up_methods(tree: ast.Module, keep: Collection[str]) -> list[Method]:
    """The methods of a module that can be apart: constructors of classes without a base, and those of ``keep``.

    ``keep``: class and method, with a dot between.
    """
    return [
        (node, method)
        for node in tree.body
        if isinstance(node, ast.ClassDef) and not node.bases
        for method in node.body
        if isinstance(method, ast.FunctionDef) and not method.decorator_list
        if f"{node.name}.{method.name}" in keep or (method.name == "__init__" and _is_large(method))
    ]


def _is_large(method: ast.FunctionDef) -> bool:
    return sum(1 for _ in ast.walk(method)) > _LEAST_NODES


def move(trees: dict[str, ast.Module], home: str, methods: Collection[Method]) -> dict[str, ast.FunctionDef]:
    """Move methods of the module ``home`` to the module ``set_up`` of its package; returns them by their names there.

    Each leaves a call of itself behind. Names in ``set_up`` are some that the module has already, which cost nothing.
    """
    package, core = home.rsplit(".", 1)
    own = sorted(top_names(trees[home]))
    qualifier = _Qualifier(own, core)
    moved: dict[str, ast.FunctionDef] = {}
    for name, (_, method) in zip(own, methods, strict=False):
        arguments = [ast.arg(argument.arg) for argument in method.args.args]
        nothing = ast.arguments([], arguments, None, [], [], None, [])
        body = qualifier.visit(ast.FunctionDef("", method.args, method.body, [])).body
        moved[name] = ast.FunctionDef(name, nothing, body, [])
        given: list[ast.expr] = [ast.Name(argument.arg, ast.Load()) for argument in arguments]
        call = ast.Call(ast.Attribute(ast.Name(SET_UP, ast.Load()), name, ast.Load()), given, [])
        result = ast.Expr(call) if method.name == "__init__" else ast.Return(call)
        method.body = [ast.ImportFrom(package, [ast.alias(SET_UP)], 0), result]
    imports = _needed([*trees[home].body], moved.values())
    own_import = ast.ImportFrom(package, [ast.alias(core)], 0)
    trees[f"{package}.{SET_UP}"] = ast.Module([own_import, *imports, *moved.values()], [])
    return moved


def _needed(nodes: Collection[ast.stmt], functions: Collection[ast.FunctionDef]) -> Iterator[ast.stmt]:
    """The imports that functions need."""
    used = {inner.id for node in functions for inner in ast.walk(node) if isinstance(inner, ast.Name)}
    for node in nodes:
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = [alias for alias in node.names if (alias.asname or alias.name) in used]
            if names and isinstance(node, ast.Import):
                yield ast.Import(names)
            elif names and isinstance(node, ast.ImportFrom):
                yield ast.ImportFrom(node.module, names, node.level)


class _Qualifier(Scoped):
    """Names of a module as another module has to write them."""

    def __init__(self, names: Collection[str], module: str) -> None:
        super().__init__()
        self._names = set(names)
        self._module = module

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """One of the module's, or what hides it."""
        if self.hides(node.id) or node.id not in self._names:
            return node
        return ast.Attribute(ast.Name(self._module, ast.Load()), node.id, node.ctx)
