"""Modules that are imported later and needed together become one: each costs memory for its names and its table."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Collection, Mapping

from armtempo.deploy.compact.scopes import Scoped, Target, imported, top_names, visit_all


def join(trees: dict[str, ast.Module], together: Mapping[str, Collection[str]]) -> None:
    """Make the modules that are under another one in ``together`` part of that; names stay as they are.

    Raises ValueError if two of them define the same name, or a function hides one that it means.
    """
    homes = {module: home for home, modules in together.items() for module in modules}
    for home, modules in together.items():
        group = [*modules, home]
        counted = Counter(name for module in group for name in top_names(trees[module]))
        if twice := [name for name, times in counted.items() if times > 1]:
            raise ValueError(f"{home} and what becomes part of it define {twice[0]} twice")
        body = [node for module in group for node in _Joiner(module, trees[module], group).run()]
        trees[home].body = sorted(body, key=_order)
    for module in homes:
        del trees[module]
    for tree in trees.values():
        tree.body = _Importer(homes).run(tree.body)


def _order(node: ast.stmt) -> int:
    """Imports, then functions in machine code, the largest first: each needs memory in one piece; then the rest."""
    if isinstance(node, ast.Import | ast.ImportFrom):
        return -1 << 30
    is_code = isinstance(node, ast.FunctionDef) and node.decorator_list and not node.args.defaults
    return -sum(1 for _ in ast.walk(node)) if is_code else 0


class _Importer(Scoped):
    """Imports from the modules of which others have become part."""

    def __init__(self, homes: Mapping[str, str]) -> None:
        super().__init__()
        self._homes = homes
        self._renamed: dict[str, str] = {}  # at the head, where a name costs memory

    def run(self, body: list[ast.stmt]) -> list[ast.stmt]:
        """The rewritten statements of a module."""
        return visit_all(self, _one_name_each(body))

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        """Its imports too."""
        node.body = _one_name_each(node.body)
        return super().visit_FunctionDef(node)

    def visit_ImportFrom(self, node: ast.ImportFrom) -> ast.AST:
        """Of one name."""
        (alias,) = node.names
        if home := self._homes.get(f"{node.module}.{alias.name}"):
            package, name = home.rsplit(".", 1)
            own = alias.asname or alias.name
            if self.at_top():
                self._renamed[own] = name
            return ast.ImportFrom(package, [ast.alias(name, None if self.at_top() else own)], node.level)
        node.module = self._homes.get(str(node.module), node.module)
        return node

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """A module that was imported at the head."""
        if node.id in self._renamed and not self.hides(node.id):
            node.id = self._renamed[node.id]
        return node


def _one_name_each(body: list[ast.stmt]) -> list[ast.stmt]:
    """Imports with one name in each, as these may come from several modules now."""
    found: list[ast.stmt] = []
    for node in body:
        if isinstance(node, ast.ImportFrom):
            found += [ast.ImportFrom(node.module, [alias], node.level) for alias in node.names]
        else:
            found.append(node)
    return found


class _Joiner(Scoped):
    """Rewrites a module whose imports from others of its group go."""

    def __init__(self, module: str, tree: ast.Module, group: Collection[str]) -> None:
        super().__init__()
        self._module = module
        self._body = tree.body
        self._group = group
        self._imported = imported(tree.body, group)

    def run(self) -> list[ast.stmt]:
        """The rewritten statements."""
        return visit_all(self, self._body)

    def _own(self, target: Target, name: str, context: ast.expr_context) -> ast.AST:
        if self.hides(name):
            raise ValueError(f"{self._module}: a function hides {name} of {target.module}")
        return ast.Name(name, context)

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """A name that another module of the group defines."""
        target = None if self.hides(node.id) else self._imported.get(node.id)
        return self._own(target, target.name, node.ctx) if target and target.name else node

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        """A name in another module of the group."""
        if isinstance(node.value, ast.Name) and not self.hides(node.value.id):
            target = self._imported.get(node.value.id)
            if target and target.name is None:
                return self._own(target, node.attr, node.ctx)
        return self.generic_visit(node)

    def visit_ImportFrom(self, node: ast.ImportFrom) -> ast.AST | None:
        """At the head: what is in the group is not imported any more."""
        if self.at_top():
            inside = imported([node], self._group)
            node.names = [alias for alias in node.names if (alias.asname or alias.name) not in inside]
        return node if node.names else None
