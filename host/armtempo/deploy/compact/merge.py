"""The modules that a program needs at once become one; what is imported later stays apart."""

from __future__ import annotations

import ast
from collections.abc import Collection, Mapping

from armtempo.deploy.compact.scopes import (
    Scoped,
    Target,
    imported,
    imported_inside,
    stored,
    top_names,
    visit_all,
)

CORE = "core"


def merge(
    trees: Mapping[str, ast.Module], main: str, entries: Collection[str], keep: Collection[str]
) -> dict[str, ast.Module]:
    """The modules of the smaller program, without what nothing in it mentions; ``trees`` is used up.

    What ``main`` imports at the head of a module, directly or through others, becomes the module ``core`` of
    its package, each name after that of its module. Packages, ``entries``, modules that a function imports and
    modules of which more than names is used stay as they are. ``keep``: names that are used from outside or found at
    run time. Raises ValueError if a name has no meaning.
    """
    apart = {*entries, *packages(trees), *_imported_later(trees), *used_whole(trees)}
    inside = {module: top_names(trees[module]) for module in _in_order(trees, main) if module not in apart}
    core = f"{main.rsplit('.', 1)[0]}.{CORE}"
    done = {module: _Merger(module, tree, inside, core).run() for module, tree in trees.items()}
    merged = {module: ast.Module(body, []) for module, body in done.items() if module not in inside}
    merged[core] = ast.Module(_once([node for module in inside for node in done[module]]), [])
    whole = {*entries, *packages(trees), *used_whole(trees)}
    mentioned = {module: _mentioned(tree) for module, tree in merged.items()}
    for module in [core, *(module for module in merged if module not in whole)]:
        outside = set(keep).union(*(names for other, names in mentioned.items() if other != module))
        merged[module].body = _used_ones(merged[module], outside)
        mentioned[module] = _mentioned(merged[module])
    for module in set(merged) - packages(trees):
        merged[module] = _without_unused(merged[module])
    return merged


def _used_ones(tree: ast.Module, outside: set[str]) -> list[ast.stmt]:
    """The statements of a module without those that define what is not mentioned ``outside`` nor in one that stays."""
    kept = [(node, _makes_only(node), _mentioned(node)) for node in tree.body]
    while True:
        used = outside.union(*(mentioned for _, _, mentioned in kept))
        fewer = [each for each in kept if not each[1] or each[1] & used]
        if len(fewer) == len(kept):
            return [node for node, _, _ in kept]
        kept = fewer


def _mentioned(tree: ast.AST) -> set[str]:
    """Names that are read or imported from the program, and those of attributes but of ``struct``."""
    nodes = list(ast.walk(tree))
    used = {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)}
    used |= {alias.name for node in nodes if isinstance(node, ast.ImportFrom) for alias in node.names}
    return used | {
        node.attr for node in nodes if isinstance(node, ast.Attribute) and ast.unparse(node.value) != "struct"
    }


def _makes_only(node: ast.stmt) -> set[str]:
    """What a statement defines that does nothing else; none if it may do more."""
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        return {node.name}
    calls = any(isinstance(inner, ast.Call) for inner in ast.walk(node))
    return stored(node) if isinstance(node, ast.Assign) and not calls else set()


def packages(trees: Collection[str]) -> set[str]:
    """Modules that hold others."""
    return {module for module in trees if any(other.startswith(f"{module}.") for other in trees)}


def used_whole(trees: Mapping[str, ast.Module]) -> set[str]:
    """Modules that are used as an object, not only for a name in them."""
    found: set[str] = set()
    for tree in trees.values():
        _Users(imported(tree.body, trees), found).visit(tree)
    return found


class _Users(Scoped):
    def __init__(self, targets: Mapping[str, Target], found: set[str]) -> None:
        super().__init__()
        self._targets = targets
        self._found = found

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        """A name in a module is no use of the module."""
        return node if isinstance(node.value, ast.Name) else self.generic_visit(node)

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """A use."""
        target = self._targets.get(node.id)
        if target and target.name is None and not self.hides(node.id):
            self._found.add(target.module)
        return node


def _imported_later(trees: Mapping[str, ast.Module]) -> set[str]:
    """Modules that are imported inside of functions."""
    return {target.module for tree in trees.values() for target in imported_inside(tree, trees).values()}


def _in_order(trees: Mapping[str, ast.Module], main: str) -> list[str]:
    """``main`` and what it needs, each after what it needs itself."""
    found: list[str] = []

    def add(module: str) -> None:
        if module not in found:
            for target in imported(trees[module].body, trees).values():
                add(target.module)
            found.append(module)

    add(main)
    return found


def _once(body: list[ast.stmt]) -> list[ast.stmt]:
    """Each import from outside once, before everything else."""
    imports: dict[str, ast.stmt] = {}
    rest = []
    for node in body:
        if isinstance(node, ast.Import | ast.ImportFrom):
            imports.setdefault(ast.unparse(node), node)
        else:
            rest.append(node)
    return [*imports.values(), *rest]


def _without_unused(tree: ast.Module) -> ast.Module:
    """Without imports that nothing uses; a function that only had such does nothing."""
    used = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    return ast.Module(visit_all(_Pruner(used), tree.body), [])


class _Pruner(Scoped):
    def __init__(self, used: set[str]) -> None:
        super().__init__()
        self._used = used

    def visit_ImportFrom(self, node: ast.ImportFrom) -> ast.AST | None:
        """``from ... import`` imports names only."""
        node.names = [alias for alias in node.names if (alias.asname or alias.name) in self._used]
        return node if node.names else None


class _Merger(Scoped):
    """Rewrites one module; ``inside``: names in the modules that become ``core``."""

    def __init__(self, module: str, tree: ast.Module, inside: Mapping[str, set[str]], core: str) -> None:
        super().__init__()
        self._module = module
        self._inside = inside
        self._core = core
        self._body = tree.body
        self._top_nodes = set(tree.body)
        self._imported = imported(tree.body, inside)
        self._own = inside.get(module, set())
        self._needs_core = False

    def run(self) -> list[ast.stmt]:
        """The rewritten statements of the module."""
        body = visit_all(self, self._body)
        if self._needs_core:
            package, name = self._core.rsplit(".", 1)
            body.insert(0, ast.ImportFrom(package, [ast.alias(name)], 0))
        return body

    def _in_core(self, target: Target, name: str, context: ast.expr_context) -> ast.AST:
        """The name of another module, from here."""
        if name not in self._inside[target.module]:
            raise ValueError(f"{self._module}: {target.module} defines no {name}")
        whole = _qualified(target.module, name)
        if self._module in self._inside:
            return ast.Name(whole, context)
        self._needs_core = True
        return ast.Attribute(ast.Name(CORE, ast.Load()), whole, context)

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """One of the module's own names, or of another's."""
        if self.hides(node.id):
            return node
        target = self._imported.get(node.id)
        if target and target.name:
            return self._in_core(target, target.name, node.ctx)
        if node.id in self._own:
            node.id = _qualified(self._module, node.id)
        return node

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        """A name in another module."""
        if isinstance(node.value, ast.Name) and not self.hides(node.value.id):
            target = self._imported.get(node.value.id)
            if target and target.name is None:
                return self._in_core(target, node.attr, node.ctx)
        return self.generic_visit(node)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        """The names of functions at the top are the module's own; those of methods are not."""
        if self._is_own(node):
            node.name = _qualified(self._module, node.name)
        return super().visit_FunctionDef(node)

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.AST:
        """The same for classes."""
        if self._is_own(node):
            node.name = _qualified(self._module, node.name)
        return self.generic_visit(node)

    def _is_own(self, node: ast.FunctionDef | ast.ClassDef) -> bool:
        return node in self._top_nodes and node.name in self._own

    def visit_Global(self, node: ast.Global) -> ast.AST:
        """Names of the module again."""
        node.names = [_qualified(self._module, name) if name in self._own else name for name in node.names]
        return node

    def visit_ImportFrom(self, node: ast.ImportFrom) -> ast.AST | None:
        """What becomes core is not imported any more."""
        node.names = [alias for alias in node.names if not self._is_inside(node, alias)]
        return node if node.names else None

    def _is_inside(self, node: ast.ImportFrom, alias: ast.alias) -> bool:
        return node.module in self._inside or f"{node.module}.{alias.name}" in self._inside


def _qualified(module: str, name: str) -> str:
    return f"{module.rsplit('.', 1)[1]}__{name}"
