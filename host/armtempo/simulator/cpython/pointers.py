"""Makes viper functions that move pointers along an array quicker under CPython: a pointer and an index of its own.

``point = ptr32(int(point) + 4)`` makes a new view of memory, which takes as long as ten loads; where a function does
that in a loop, this becomes ``point_at += 1``, and ``point[K]`` becomes ``point[point_at + K]``. Constants are put in,
as MicroPython's compiler does. A function with a pointer that is not derived from an argument stays as it is.
"""

from __future__ import annotations

import ast
import io
from types import FunctionType
from typing import Any

SHIFTS = {"ptr8": 0, "ptr16": 1, "ptr32": 2}
"""Of each kind of pointer: the logarithm of its width in bytes."""


class _Unsuitable(Exception):
    """The function must stay as it is."""


def by_index(function: FunctionType) -> FunctionType:
    """The function with indices, or itself."""
    if function.__closure__:
        return function
    try:
        tree = _source(function)
        rewriter = _Rewriter(tree, function.__globals__)
        if not rewriter.moves_in_loop:
            return function
        rewriter.rewrite()
    except (_Unsuitable, OSError, SyntaxError):
        return function
    made: dict[str, Any] = {}
    code = compile(ast.Module([tree], []), function.__code__.co_filename, "exec")
    exec(code, function.__globals__, made)
    found: FunctionType = made[function.__name__]
    found.__annotations__ = function.__annotations__
    return found


def _source(function: FunctionType) -> ast.FunctionDef:
    """The function's definition, with its own line numbers."""
    code = function.__code__
    with io.open_code(code.co_filename) as file:  # ``open`` is the board's
        lines = file.read().decode().splitlines()[code.co_firstlineno - 1 :]
    begin = next((i for i, line in enumerate(lines) if line.startswith("def ")), None)
    if begin is None:  # it is within another one
        raise _Unsuitable
    end = next((i for i, line in enumerate(lines) if i > begin and line and line[0] not in " )"), len(lines))
    body = ast.parse("\n".join(lines[:end])).body
    if not body or not isinstance(body[0], ast.FunctionDef) or body[0].name != function.__name__:
        raise _Unsuitable
    ast.increment_lineno(body[0], code.co_firstlineno - 1)
    return body[0]


def _moved(node: ast.expr) -> tuple[str, ast.expr, str] | None:
    """Pointer, bytes and kind, if an expression is ``KIND(int(POINTER) + BYTES)``."""
    if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in SHIFTS):
        return None
    where, offset = node.args[0], None
    terms: list[tuple[ast.operator, ast.expr]] = []
    while isinstance(where, ast.BinOp) and isinstance(where.op, (ast.Add, ast.Sub)):
        terms.append((where.op, where.right))
        where = where.left
    for operator, term in reversed(terms):
        offset = ast.BinOp(offset or ast.Constant(0), operator, term)
    match where:
        case ast.Call(func=ast.Name(id="int"), args=[ast.Name(id=pointer)]) if offset:
            return pointer, offset, node.func.id
    raise _Unsuitable


class _Rewriter(ast.NodeTransformer):
    """Rewrites a function; ``moves_in_loop``: whether it moves a pointer there."""

    def __init__(self, tree: ast.FunctionDef, known: dict[str, Any]) -> None:
        self._tree = tree
        self._known = known
        self._kinds = {  # of all pointers
            entry.arg: entry.annotation.id
            for entry in tree.args.args
            if isinstance(entry.annotation, ast.Name) and entry.annotation.id in SHIFTS
        }
        self._moving: set[str] = set()  # pointers with an index
        loops = [node for node in ast.walk(tree) if isinstance(node, ast.While)]
        self.moves_in_loop = any(
            isinstance(node, ast.Assign) and _moved(node.value) for loop in loops for node in ast.walk(loop)
        )

    def rewrite(self) -> None:
        """Raises _Unsuitable if it cannot be done."""
        tree = self._tree
        assigned = [node for node in ast.walk(tree) if isinstance(node, ast.Assign)]
        while self._spread(assigned):
            pass
        tree.decorator_list, tree.returns = [], None
        arguments = [entry.arg for entry in tree.args.args]
        for entry in tree.args.args:
            entry.annotation = None
        begin: list[ast.stmt] = [
            ast.Assign([_index(name, ast.Store())], ast.Constant(0))
            for name in arguments
            if name in self._moving
        ]
        tree.body = begin + [new for old in tree.body for new in _listed(self.visit(old))]
        ast.fix_missing_locations(tree)

    def _spread(self, assigned: list[ast.Assign]) -> bool:
        """Find further pointers; whether there were any."""
        before = len(self._moving)
        for node in assigned:
            target, moved = node.targets[0], _moved(node.value)
            name = moved[0] if moved else node.value.id if isinstance(node.value, ast.Name) else ""
            if name not in self._kinds:
                continue
            kind = self._kinds[name]
            if len(node.targets) > 1 or not isinstance(target, ast.Name) or (moved and moved[2] != kind):
                raise _Unsuitable
            if self._kinds.setdefault(target.id, kind) != kind:
                raise _Unsuitable
            self._moving.add(target.id)
        return len(self._moving) > before

    def visit_Assign(self, node: ast.Assign) -> Any:
        """Of a pointer: assign its index too."""
        target = node.targets[0]
        if not isinstance(target, ast.Name) or target.id not in self._moving:
            return self.generic_visit(node)
        moved = _moved(node.value)
        if not moved and not (isinstance(node.value, ast.Name) and node.value.id in self._kinds):
            raise _Unsuitable
        index: ast.expr
        if moved:
            name = moved[0]
            index = ast.BinOp(self.visit(moved[1]), ast.RShift(), ast.Constant(SHIFTS[moved[2]]))
            if name in self._moving:
                index = ast.BinOp(_index(name, ast.Load()), ast.Add(), index)
        else:
            name = node.value.id  # type: ignore[attr-defined]
            index = _index(name, ast.Load()) if name in self._moving else ast.Constant(0)
        found = [ast.Assign([_index(target.id, ast.Store())], index)]
        if name != target.id:
            found.append(ast.Assign([target], ast.Name(name, ast.Load())))
        return [ast.copy_location(new, node) for new in found]

    def visit_Subscript(self, node: ast.Subscript) -> Any:
        """A load or store through a pointer."""
        if not isinstance(node.value, ast.Name) or node.value.id not in self._kinds:
            return self.generic_visit(node)
        node.slice = self.visit(node.slice)
        if node.value.id in self._moving:
            node.slice = ast.BinOp(_index(node.value.id, ast.Load()), ast.Add(), node.slice)
        return node

    def visit_Name(self, node: ast.Name) -> Any:
        """A constant, or a pointer that is used otherwise."""
        if node.id in self._kinds:
            raise _Unsuitable
        value = self._known.get(node.id)
        return (
            ast.copy_location(ast.Constant(value), node) if node.id.isupper() and type(value) is int else node
        )


def _index(name: str, context: ast.expr_context) -> ast.Name:
    return ast.Name(f"{name}_at", context)


def _listed(statement: Any) -> list[ast.stmt]:
    return statement if isinstance(statement, list) else [statement]
