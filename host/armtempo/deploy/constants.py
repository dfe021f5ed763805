"""Constants of all modules, put in where they are used, so that their names and places take no memory on a board.

The text changes only where a constant stood: lines keep their numbers.
"""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from types import SimpleNamespace

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


Value = int | str | bytes
_CONST = "const"
_SHORT = 10
"""Longer strings stay where they are: MicroPython keeps one copy of short ones only."""


def fold(sources: Mapping[str, str]) -> dict[str, str]:
    """The modules' texts with each use of a module's number, short string or ``const()`` replaced by its value.

    ``sources``: text by dotted module name. A constant is a name that its module assigns once, at its top, a value that
    needs no call but ``const``. Its assignment goes, and the imports of it; not in modules that are used as objects.
    """
    trees = {module: ast.parse(text) for module, text in sources.items()}
    values = constants(trees)
    whole = used_whole(trees)
    folded = {}
    for module, text in sources.items():
        folder = _Folder(trees[module], values, {} if module in whole else values[module])
        folded[module] = folder.edited(text)
    return folded


def is_empty(text: str) -> bool:
    """Whether a module's text does nothing."""
    return all(
        isinstance(node, ast.Pass)
        or (isinstance(node, ast.Expr | ast.If) and isinstance(_first(node), ast.Constant))
        for node in ast.parse(text).body
    )


def _first(node: ast.Expr | ast.If) -> ast.expr:
    """What an expression is, or a condition; ``if False`` is for type checkers."""
    return node.value if isinstance(node, ast.Expr) else node.test


def constants(trees: Mapping[str, ast.Module]) -> dict[str, dict[str, Value]]:
    """Value by name, by module."""
    values: dict[str, dict[str, Value]] = {module: {} for module in trees}
    changed = {target for tree in trees.values() for target in _changed(tree, trees)}
    assigned = {
        module: [pair for pair in _assigned(tree) if Target(module, pair[0]) not in changed]
        for module, tree in trees.items()
    }
    found = -1
    while found < (found := sum(map(len, values.values()))):  # constants may be made of others
        for module, tree in trees.items():
            known = _known(tree, trees, values) | values[module]
            for name, expression in assigned[module]:
                if (value := _evaluate(expression, known)) is not None:
                    values[module][name] = known[name] = value
    return values


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


def _known(
    tree: ast.Module, trees: Mapping[str, ast.Module], values: Mapping[str, Mapping[str, Value]]
) -> dict[str, object]:
    """Values of the imported names that are constants."""
    found: dict[str, object] = {}
    for name, target in imported(tree.body, trees).items():
        if target.name is None:
            found[name] = SimpleNamespace(**values[target.module])
        elif target.name in values[target.module]:
            found[name] = values[target.module][target.name]
    return found


def _changed(tree: ast.Module, program: Collection[str]) -> Iterator[Target]:
    """Names of other modules to which a module assigns."""
    known = imported(tree.body, program) | imported_inside(tree, program)
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            target = known.get(node.value.id) if isinstance(node.value, ast.Name) else None
            if target and target.name is None:
                yield Target(target.module, node.attr)


def _assigned(tree: ast.Module) -> Iterator[tuple[str, ast.expr]]:
    """Names that are assigned once, at the module's top, with what they are assigned."""
    times = Counter(name for node in tree.body for name in stored(node))
    times.update(name for node in ast.walk(tree) if isinstance(node, ast.Global) for name in node.names)
    for node in tree.body:
        for name, value in _pairs(node):
            if times[name] == 1:
                yield name, value


def _pairs(node: ast.stmt) -> list[tuple[str, ast.expr]]:
    if not isinstance(node, ast.Assign) or len(node.targets) != 1:
        return []
    target, value = node.targets[0], node.value
    if isinstance(target, ast.Name):
        return [(target.id, value)]
    if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
        names = [each.id for each in target.elts if isinstance(each, ast.Name)]
        if len(names) == len(target.elts) == len(value.elts):
            return list(zip(names, value.elts, strict=True))
    return []


def _evaluate(expression: ast.expr, known: Mapping[str, object]) -> Value | None:
    if isinstance(expression, ast.Call) and _is_const(expression):
        expression = expression.args[0]
    if any(isinstance(node, ast.Call) for node in ast.walk(expression)):
        return None
    try:
        code = compile(ast.Expression(expression), "<constant>", "eval")
        value = eval(code, {"__builtins__": {}}, dict(known))
    except (NameError, AttributeError, TypeError):
        return None
    is_long = isinstance(value, str | bytes) and len(value) > _SHORT
    return value if isinstance(value, int | str | bytes) and not is_long else None


def _is_const(call: ast.Call) -> bool:
    return isinstance(call.func, ast.Name) and call.func.id == _CONST


class _Folder(Scoped):
    """Notes what is to change in a module's text; ``own``: its constants, whose assignments go."""

    def __init__(
        self, tree: ast.Module, values: Mapping[str, Mapping[str, Value]], own: Mapping[str, Value]
    ) -> None:
        super().__init__()
        self._tree = tree
        self._values = values
        self._own = own
        self._imported = imported(tree.body, values)
        self._inside = imported_inside(tree, values)
        self._edits: list[tuple[ast.expr | ast.stmt, str]] = []
        self._replaced: set[Target] = set()  # of which uses are gone,
        self._left: set[Target] = set()  # and of which uses are left
        self._declares = False  # whether there is a call of const left

    def edited(self, text: str) -> str:
        """The module's text after the changes."""
        visit_all(self, self._tree.body)
        gone = self._replaced - self._left
        for node in ast.walk(self._tree):
            if isinstance(node, ast.ImportFrom):
                targets = imported([node], self._values)
                kept = [
                    alias
                    for alias in node.names
                    if targets.get(alias.asname or alias.name) not in gone
                    and (alias.name != _CONST or self._declares)
                ]
                if len(kept) < len(node.names):
                    self._edits.append((node, _import(node, kept)))
        lines = [line.encode() for line in text.splitlines(keepends=True)]
        for node, new in sorted(
            self._edits, key=lambda edit: (edit[0].lineno, edit[0].col_offset), reverse=True
        ):
            _edit(lines, node, new)
        return b"".join(lines).decode()

    def _replace(self, node: ast.expr, value: Value) -> ast.AST:
        self._edits.append((node, f"({value})" if isinstance(value, int) and value < 0 else repr(value)))
        return node

    def _target(self, name: str) -> Target | None:
        """What a name was imported as: a function's own import counts, its other names hide the module's."""
        return self._inside.get(name) if self.hides(name) else self._imported.get(name)

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """A name that is used."""
        if not isinstance(node.ctx, ast.Load):
            return node
        target = self._target(node.id)
        if target and target.name and target.name in self._values[target.module]:
            self._replaced.add(target)
            return self._replace(node, self._values[target.module][target.name])
        if not target and node.id in self._own and not self.hides(node.id):
            return self._replace(node, self._own[node.id])
        if target:
            self._left.add(target)
        self._declares = self._declares or node.id == _CONST
        return node

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        """A name in another module."""
        if isinstance(node.value, ast.Name):
            target = self._target(node.value.id)
            if target and target.name is None and node.attr in self._values[target.module]:
                self._replaced.add(target)
                return self._replace(node, self._values[target.module][node.attr])
        return self.generic_visit(node)

    def visit_Assign(self, node: ast.Assign) -> ast.AST:
        """At the module's top a constant's assignment goes."""
        names = [name for name, _ in _pairs(node)]
        if self.at_top() and names and all(name in self._own for name in names):
            self._edits.append((node, ""))
            names = [each.id for each in ast.walk(node.value) if isinstance(each, ast.Name)]
            self._replaced |= {self._imported[name] for name in names if name in self._imported}
            return node
        return self.generic_visit(node)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST:
        """Nothing reads the annotation on the board."""
        self.visit(node.target)
        if node.value is not None:
            self.visit(node.value)
        return node


def _import(node: ast.ImportFrom, kept: list[ast.alias]) -> str:
    return ast.unparse(ast.ImportFrom(node.module, kept, node.level)) if kept else "pass"


def _edit(lines: list[bytes], node: ast.expr | ast.stmt, new: str) -> None:
    """Put text in the place of a node; the lines below keep their numbers."""
    first, last = node.lineno - 1, (node.end_lineno or node.lineno) - 1
    behind = lines[last][node.end_col_offset :]
    lines[first] = lines[first][: node.col_offset] + new.encode() + b"\n" * (last - first) + behind
    lines[first + 1 : last + 1] = [b""] * (last - first)
