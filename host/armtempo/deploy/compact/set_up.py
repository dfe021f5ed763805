"""Constructors and other methods that are called only while nothing moves: in modules that are imported for a call."""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterator

from armtempo.deploy.compact.scopes import Scoped, top_names

SET_UP = "set_up"
Method = tuple[ast.ClassDef, ast.FunctionDef]


def set_up_methods(tree: ast.Module, wanted: Collection[str]) -> list[Method]:
    """The methods of a module's classes that are ``wanted``: class and method, with a dot between.

    Raises ValueError if one is not there.
    """
    found = {
        f"{node.name}.{method.name}": (node, method)
        for node in tree.body
        if isinstance(node, ast.ClassDef)
        for method in node.body
        if isinstance(method, ast.FunctionDef)
    }
    if missing := set(wanted) - set(found):
        raise ValueError(f"there is no {min(missing)}")
    return [found[name] for name in found if name in wanted]


def move(trees: dict[str, ast.Module], home: str, methods: Collection[Method]) -> list[str]:
    """Move methods of the module ``home`` to the new module SET_UP of its package; returns their names there.

    Each leaves a call of itself. The names are some that the module has already, which cost nothing.
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
    if moved:
        trees[f"{package}.{SET_UP}"] = ast.Module([own_import, *imports, *moved.values()], [])
    return list(moved)


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
