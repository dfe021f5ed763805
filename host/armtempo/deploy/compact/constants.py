"""Constants of all modules, put in where they are used; their names disappear."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from types import SimpleNamespace

from armtempo.deploy.compact.scopes import Scoped, Target, imported, imported_inside, stored, visit_all

Value = int | str | bytes


def fold(trees: Mapping[str, ast.Module], whole: Collection[str]) -> None:
    """Replace each use of a module's number, string or ``const()`` by its value, in all modules.

    A constant is a name that its module assigns once, at its top, a value that needs no call but ``const``.
    Its assignment goes, but in the modules of ``whole``, which are looked at as a whole. So do annotations.
    """
    values = constants(trees)
    for module, tree in trees.items():
        taken_out: Collection[str] = () if module in whole else values[module]
        folder = _Folder(tree, trees, values, values[module], taken_out)
        tree.body = visit_all(folder, tree.body)
        _Decided().visit(tree)


def constants(trees: Mapping[str, ast.Module]) -> dict[str, dict[str, Value]]:
    """Value by name, by module."""
    values: dict[str, dict[str, Value]] = {module: {} for module in trees}
    assigned = {module: list(_assigned(tree)) for module, tree in trees.items()}
    found = -1
    while found < (found := sum(map(len, values.values()))):  # constants may be made of others
        for module, tree in trees.items():
            known = _known(tree, trees, values) | values[module]
            for name, expression in assigned[module]:
                if (value := _evaluate(expression, known)) is not None:
                    values[module][name] = known[name] = value
    return values


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
    return value if isinstance(value, int | str | bytes) else None


def _is_const(call: ast.Call) -> bool:
    return isinstance(call.func, ast.Name) and call.func.id == "const"


class _Folder(Scoped):
    """Replaces names by values. ``own``: values of the module's own constants; ``taken_out``: constants whose
    assignments are removed."""

    def __init__(
        self,
        tree: ast.Module,
        program: Collection[str],
        values: Mapping[str, Mapping[str, Value]],
        own: Mapping[str, Value],
        taken_out: Collection[str],
    ) -> None:
        super().__init__()
        self._values = values
        self._own = own
        self._taken_out = taken_out
        self._imported = imported(tree.body, program)
        self._inside = imported_inside(tree, program)

    def _target(self, name: str) -> Target | None:
        """What a name was imported as: a function's own import counts, its other names hide the module's."""
        return self._inside.get(name) if self.hides(name) else self._imported.get(name)

    def _value(self, module: str, name: str | None) -> ast.Constant | None:
        found = self._values[module].get(name) if name else None
        return None if found is None else ast.Constant(found)

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """A name that is used."""
        if not isinstance(node.ctx, ast.Load):
            return node
        if target := self._target(node.id):
            return self._value(target.module, target.name) or node
        if node.id in self._own and not self.hides(node.id):
            return ast.Constant(self._own[node.id])
        return node

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        """A name in another module."""
        if isinstance(node.value, ast.Name):
            target = self._target(node.value.id)
            if target and target.name is None:
                return self._value(target.module, node.attr) or node
        return self.generic_visit(node)

    def visit_Assign(self, node: ast.Assign) -> ast.AST | None:
        """At the module's top a constant's assignment goes."""
        names = [name for name, _ in _pairs(node)]
        if self.at_top() and names and all(name in self._taken_out for name in names):
            return None
        return self.generic_visit(node)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST | None:
        """Nothing reads the annotation on the board."""
        if node.value is None:
            return None
        return self.visit_Assign(ast.Assign([node.target], node.value))

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        """Only viper code needs its annotations."""
        if not any("viper" in ast.unparse(decorator) for decorator in node.decorator_list):
            node.returns = None
            for argument in ast.walk(node.args):
                if isinstance(argument, ast.arg):
                    argument.annotation = None
        return super().visit_FunctionDef(node)


class _Decided(ast.NodeTransformer):
    """Takes out what constants decide; what nothing mentions any more is left out later."""

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.AST:
        """What is decided by its first constant."""
        self.generic_visit(node)
        decides = isinstance(node.op, ast.Or)
        while len(node.values) > 1 and isinstance(first := node.values[0], ast.Constant):
            if bool(first.value) == decides:
                return first
            del node.values[0]
        return node.values[0] if len(node.values) == 1 else node

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.AST:
        """``not`` a constant."""
        self.generic_visit(node)
        if isinstance(node.op, ast.Not) and isinstance(node.operand, ast.Constant):
            return ast.Constant(not node.operand.value)
        return node

    def visit_If(self, node: ast.If) -> ast.AST | list[ast.stmt]:
        """The branch that is taken."""
        self.generic_visit(node)
        return (
            (node.body if node.test.value else node.orelse) if isinstance(node.test, ast.Constant) else node
        )

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
        """The same within an expression."""
        self.generic_visit(node)
        return (
            (node.body if node.test.value else node.orelse) if isinstance(node.test, ast.Constant) else node
        )
