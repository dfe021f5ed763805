"""Small mistakes as people make them: a comparison, a sign, one too many, a dropped statement, swapped arguments."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass

_COMPARISONS = {
    ast.Lt: "<=",
    ast.LtE: "<",
    ast.Gt: ">=",
    ast.GtE: ">",
    ast.Eq: "!=",
    ast.NotEq: "==",
    ast.Is: "is not",
    ast.IsNot: "is",
    ast.In: "not in",
    ast.NotIn: "in",
}
_OPERATORS = {ast.Add: "-", ast.Sub: "+", ast.LShift: ">>", ast.RShift: "<<", ast.Mult: "+", ast.BitAnd: "|"}


@dataclass(frozen=True)
class Mutation:
    """Bytes ``start`` to ``end`` of a file replaced by ``text``."""

    start: int
    end: int
    text: bytes
    line: int
    kind: str

    def of(self, source: bytes) -> bytes:
        """The source with the mistake."""
        return source[: self.start] + self.text + source[self.end :]

    def shown(self, source: bytes) -> str:
        """Line, kind, before and after."""
        before = b" ".join(source[self.start : self.end].split()).decode()
        return f"{self.line}: {self.kind}: {before[:70]!r} -> {self.text.decode()[:70]!r}"


def all_of(source: bytes) -> list[Mutation]:
    """Every mutation of a Python file; none of docstrings, annotations and messages. Not all of them parse."""
    return list(_Finder(source).found())


def parses(source: bytes) -> bool:
    """Whether the file is still Python."""
    try:
        ast.parse(source)
    except SyntaxError:
        return False
    return True


class _Finder:
    def __init__(self, source: bytes) -> None:
        self._source = source
        self._lines = [0]
        for line in source.splitlines(keepends=True):
            self._lines.append(self._lines[-1] + len(line))

    def found(self) -> Iterator[Mutation]:
        for node in _running(ast.parse(self._source)):
            yield from self._of(node)

    def _of(self, node: ast.AST) -> Iterator[Mutation]:
        match node:
            case ast.Compare(left=left, ops=[op], comparators=[right]):
                yield self._between(left, right, _COMPARISONS[type(op)], "comparison")
            case ast.BoolOp(op=op, values=[left, right]):
                yield self._between(left, right, "or" if isinstance(op, ast.And) else "and", "and, or")
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS and not _is_text(node):
                yield self._between(left, right, _OPERATORS[type(op)], "operator")
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                yield self._replaced(node, self._text(operand), "not dropped")
            case ast.Constant(value=int() as value) if not isinstance(value, bool):
                yield self._replaced(node, str(value + 1), "constant")
            case ast.Constant(value=float() as value):
                yield self._replaced(node, repr(value * 1.1 if value else 0.1), "constant")
            case ast.Constant(value=bool() as value):
                yield self._replaced(node, str(not value), "constant")
            case ast.Call(args=[first, second, *_]) if not isinstance(first, ast.Starred | ast.Constant):
                swapped = self._text(second) + self._span(first.end_lineno, first.end_col_offset, second)
                yield self._at(first, second, swapped + self._text(first), "arguments swapped")
            case ast.Expr(value=ast.Call()) | ast.AugAssign() | ast.Raise() | ast.Continue() | ast.Break():
                yield self._replaced(node, "pass", "statement dropped")
            case ast.Assign(targets=[ast.Attribute() | ast.Subscript()]):
                yield self._replaced(node, "pass", "statement dropped")

    def _place(self, line: int | None, column: int | None) -> int:
        assert line is not None
        assert column is not None
        return self._lines[line - 1] + column

    def _text(self, node: ast.expr) -> str:
        start = self._place(node.lineno, node.col_offset)
        return self._source[start : self._place(node.end_lineno, node.end_col_offset)].decode()

    def _span(self, line: int | None, column: int | None, until: ast.expr) -> str:
        return self._source[self._place(line, column) : self._place(until.lineno, until.col_offset)].decode()

    def _between(self, left: ast.expr, right: ast.expr, word: str, kind: str) -> Mutation:
        """The operator between two operands; brackets around them stay."""
        start, end = (
            self._place(left.end_lineno, left.end_col_offset),
            self._place(right.lineno, right.col_offset),
        )
        text = self._source[start:end].decode()
        opening, closing = text[: len(text) - len(text.lstrip(") \n"))], text[len(text.rstrip("( \n")) :]
        return Mutation(start, end, f"{opening or ' '}{word}{closing or ' '}".encode(), left.lineno, kind)

    def _replaced(self, node: ast.expr | ast.stmt, text: str, kind: str) -> Mutation:
        start, end = (
            self._place(node.lineno, node.col_offset),
            self._place(node.end_lineno, node.end_col_offset),
        )
        return Mutation(start, end, text.encode(), node.lineno, kind)

    def _at(self, first: ast.expr, last: ast.expr, text: str, kind: str) -> Mutation:
        start, end = (
            self._place(first.lineno, first.col_offset),
            self._place(last.end_lineno, last.end_col_offset),
        )
        return Mutation(start, end, text.encode(), first.lineno, kind)


def _is_text(node: ast.AST) -> bool:
    return any(
        isinstance(part, ast.Constant | ast.JoinedStr) and _holds_text(part) for part in ast.walk(node)
    )


def _holds_text(part: ast.AST) -> bool:
    return isinstance(part, ast.JoinedStr) or (
        isinstance(part, ast.Constant) and isinstance(part.value, str | bytes)
    )


def _never_runs(node: ast.stmt) -> bool:
    """What is there for the type checker or the command line alone, and methods that only subclasses have."""
    match node:
        case ast.If(test=ast.Name(id="TYPE_CHECKING")) | ast.Assign(targets=[ast.Name(id="TYPE_CHECKING")]):
            return True
        case ast.If(test=ast.Compare(left=ast.Name(id="__name__"))):
            return True
        case ast.Assign(targets=[ast.Name(id="__all__")]):
            return True
        case ast.Raise(
            exc=ast.Name(id="NotImplementedError") | ast.Call(func=ast.Name(id="NotImplementedError"))
        ):
            return True
    return False


def _running(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes that do something: no imports, annotations, decorators, messages, blocks for the type checker."""
    yield node
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "msg", "exc", "type_params"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.stmt) and _never_runs(child):
                continue
            if isinstance(child, ast.AST) and not isinstance(
                child, ast.Import | ast.ImportFrom | ast.JoinedStr
            ):
                yield from _running(child)
