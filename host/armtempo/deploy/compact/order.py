"""The names that a module uses most come first in its file: a number below 128 takes one byte of byte code, not two."""

from __future__ import annotations

import ast
from collections import Counter

from armtempo.deploy.compact.scopes import Scoped

_FIRST = 120
"""A few numbers go to the names of the file and of the module."""
_WORTH_IT = 200
"""Names of a module; where there are fewer, the list takes more of the flash than the numbers save."""


def often_used_first(tree: ast.Module) -> None:
    """Begin the module with a list of its most used names, which gives them their numbers and is dropped."""
    counter = _Counter()
    counter.visit(tree)
    if len(counter.uses) > _WORTH_IT:
        names: list[ast.expr] = [ast.Constant(name) for name, _ in counter.uses.most_common(_FIRST)]
        tree.body.insert(0, ast.Assign([ast.Name("_", ast.Store())], ast.List(names, ast.Load())))
        tree.body.insert(1, ast.Delete([ast.Name("_", ast.Del())]))


class _Counter(Scoped):
    """``uses``: how often functions use a name; what a module does once is dropped with its byte code."""

    def __init__(self) -> None:
        super().__init__()
        self.uses: Counter[str] = Counter()

    def _count(self, name: str) -> None:
        if not self.at_top():
            self.uses[name] += 1

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """Names of functions' own have no number."""
        if not self.hides(node.id):
            self._count(node.id)
        return node

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        """Each is looked up by its name."""
        self._count(node.attr)
        return self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        """Short strings are names."""
        if isinstance(node.value, str):
            self._count(node.value)
        return node

    def visit_Expr(self, node: ast.Expr) -> ast.AST:
        """What documents a function is not compiled."""
        return node if isinstance(node.value, ast.Constant) else self.generic_visit(node)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        """Machine code has numbers of its own."""
        return node if node.decorator_list else super().visit_FunctionDef(node)
