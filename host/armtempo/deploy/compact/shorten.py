"""Short names for a program's own functions, classes, attributes, globals and parameters."""

from __future__ import annotations

import array
import ast
import builtins
import io
import keyword
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from itertools import islice, product
from string import ascii_lowercase

from armtempo.deploy.compact.attributes import attributes, class_variables, share
from armtempo.deploy.compact.scopes import Scoped, imported, imported_inside, top_names

_TYPES = (
    object,
    type,
    str,
    bytes,
    bytearray,
    memoryview,
    int,
    list,
    tuple,
    dict,
    set,
    array.array,
    io.FileIO,
    io.StringIO,
    BaseException,
)
_SHORTEST = 3
"""Shorter names are kept."""
_BUILT_IN = """
    ArithmeticError AssertionError EOFError Ellipsis GeneratorExit IndentationError KeyboardInterrupt LookupError
    NameError NoneType NotImplementedError OverflowError RuntimeError StopIteration SyntaxError ZeroDivisionError
    abs all any append bool builtins bytearray bytecode bytes callable chr classmethod clear copy count dict dir
    divmod end endswith eval exec extend find format from_bytes get getattr globals hasattr hash id index insert int
    isalpha isdigit isinstance islower isspace issubclass isupper items iter join key len list little locals lower
    lstrip main map max min next object open ord pop popitem pow print range readline remove replace repr reverse
    rfind rindex round rsplit rstrip sep set setattr setdefault sort sorted split start startswith staticmethod step
    stop str strip sum super to_bytes tuple type update upper zip
"""
"""Names that every MicroPython has built in, so that they cost nothing: the format of .mpy files counts on them.

Without those that MicroPython itself looks for in objects, and without ``const``, whose calls the compiler takes for
declarations.
"""
_OF_MODULES = """
    e pi acos arg asin atan bin ceil clz cmp cos deinit done dump dumps erf exp fabs feed floor fmod freq frexp hard
    hex imag inf isinf isnan load loads log match math micros millis mode modf nan peek phase polar poll pull push pwm
    radians real rect rng scan search seed sin sqrt tan tau tell trunc uniform wfi
"""
"""Names that the port's own modules have (``math``, ``pyb``, ...): they are in the firmware and need no memory."""


@dataclass(frozen=True)
class Names:
    """Short names: of what each module defines, and of attributes.

    The same may stand for one of each, and for several attributes that no object has together.
    """

    own: dict[str, dict[str, str]]
    attributes: dict[str, str]


def short_names(trees: Mapping[str, ast.Module], keep: Collection[str], whole: Collection[str] = ()) -> Names:
    """Short names for all that is the program's own.

    Not shortened: what built-in types or imported modules may mean by a name, what is in a string or is a
    keyword in a call, names of modules, what modules of ``whole`` define, and ``keep``.
    """
    nodes = [node for tree in trees.values() for node in ast.walk(tree)]
    modules = {part for module in trees for part in module.split(".")}
    meant = {*keep, *modules, *_imported(nodes, trees), *_keywords(nodes), *_strings(nodes)}
    fixed = meant | set(_built_in())
    mentioned = {name for node in nodes for name in _mentioned(node)}
    there = [name for name in (_BUILT_IN + _OF_MODULES).split() if name not in meant | mentioned]

    def ours(names: Collection[str]) -> list[str]:
        return sorted(name for name in names if _is_long(name) and name not in fixed)

    own = {module: ours(top_names(tree)) for module, tree in trees.items() if module not in whole}
    of_objects = ours(attributes(trees))
    most = max(map(len, (*own.values(), of_objects)))
    shorts = [*there, *islice(_short(fixed | mentioned), most)]
    return Names(
        {module: dict(zip(own.get(module, ()), shorts, strict=False)) for module in trees},
        share(trees, of_objects, shorts),
    )


def shorten(trees: Mapping[str, ast.Module], names: Names) -> None:
    """Rename what is in ``names``, and the parameters of functions to what MicroPython has built in."""
    keywords = {name for tree in trees.values() for name in _keywords(list(ast.walk(tree)))}
    for module, tree in trees.items():
        _Renamer(module, tree, names).visit(tree)
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef):
                _shorten_parameters(node, keywords)


class _Renamer(Scoped):
    def __init__(self, module: str, tree: ast.Module, names: Names) -> None:
        super().__init__()
        self._names = names
        self._own = names.own[module]
        self._top_nodes = set(tree.body)
        self._top = imported(tree.body, names.own)
        self._inside = imported_inside(tree, names.own)
        self._of_class: set[str] = set()
        self._assigned: set[str] = set()  # of these, those that have a value where the visit has come to

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """Names of functions' own cost nothing.

        ValueError if a class reads a name of the module whose short one is that of what it has assigned: it would
        get its own.
        """
        if not self.hides(node.id):
            reads = isinstance(node.ctx, ast.Load)
            variables = self._assigned if reads else self._of_class
            own = self.at_top() and node.id in variables
            names = self._names.attributes if own else self._own
            short = names.get(node.id, node.id)
            if reads and not own and self.at_top() and short in self._short_ones():
                raise ValueError(f"{node.id} has the short name of what its class assigns: read it elsewhere")
            node.id = short
        return node

    def _short_ones(self) -> set[str]:
        return {self._names.attributes.get(name, name) for name in self._assigned}

    def visit_Assign(self, node: ast.Assign) -> ast.AST:
        """The value comes first: in a class, a name may still be the module's there."""
        node.value = self.visit(node.value)
        names = [target.id for target in node.targets if isinstance(target, ast.Name)]
        node.targets = [self.visit(target) for target in node.targets]
        if self.at_top():
            self._assigned.update(self._of_class.intersection(names))
        return node

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        """Of an object, or a name in a module."""
        names = self._names.attributes
        if isinstance(node.value, ast.Name):
            base = node.value.id
            target = self._inside.get(base) if self.hides(base) else self._top.get(base)
            if target and target.name is None:
                names = self._names.own[target.module]
        node.attr = names.get(node.attr, node.attr)
        return self.generic_visit(node)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        """Of the module, or a method."""
        if self.at_top():
            names = self._own if node in self._top_nodes else self._names.attributes
            node.name = names.get(node.name, node.name)
        return super().visit_FunctionDef(node)

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.AST:
        """Its variables are attributes."""
        node.name = self._own.get(node.name, node.name)
        self._of_class = class_variables(node)
        self.generic_visit(node)
        self._of_class, self._assigned = set(), set()
        return node

    def visit_Global(self, node: ast.Global) -> ast.AST:
        """Names of the module."""
        node.names = [self._own.get(name, name) for name in node.names]
        return node

    def visit_ImportFrom(self, node: ast.ImportFrom) -> ast.AST:
        """Where it is used it keeps its name."""
        names = self._names.own.get(str(node.module), {})
        for alias in node.names:
            if alias.name in names:
                alias.asname = alias.asname or alias.name
                alias.name = names[alias.name]
        return node


def _short(taken: Collection[str]) -> Iterator[str]:
    """Two letters, then three."""
    for length in (2, 3):
        for letters in product(ascii_lowercase, repeat=length):
            name = "".join(letters)
            if not keyword.iskeyword(name) and name not in taken:
                yield name


def _is_long(name: str) -> bool:
    return len(name) >= _SHORTEST and not name.startswith("__")


def _mentioned(node: ast.AST) -> Iterator[str]:
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        yield node.name
    elif isinstance(node, ast.Attribute):
        yield node.attr
    elif isinstance(node, ast.Name):
        yield node.id
    elif isinstance(node, ast.arg):
        yield node.arg


def _built_in() -> Iterator[str]:
    yield from dir(builtins)
    for each in _TYPES:
        yield from dir(each)


def _imported(nodes: Collection[ast.AST], program: Collection[str]) -> Iterator[str]:
    """Names imported from outside of the program, and what is asked of them: ``sys.implementation._mpy``."""
    packages = {module.split(".")[0] for module in program}
    roots = set()
    for node in nodes:
        if isinstance(node, ast.ImportFrom) and str(node.module).split(".")[0] in packages:
            continue
        if isinstance(node, ast.Import | ast.ImportFrom):
            roots |= {alias.asname or alias.name.split(".")[0] for alias in node.names}
    yield from roots
    for node in nodes:
        if isinstance(node, ast.Attribute) and _root(node) in roots:
            yield node.attr


def _root(node: ast.expr) -> str:
    while isinstance(node, ast.Attribute | ast.Call):
        node = node.value if isinstance(node, ast.Attribute) else node.func
    return node.id if isinstance(node, ast.Name) else ""


def _keywords(nodes: Collection[ast.AST]) -> Iterator[str]:
    for node in nodes:
        if isinstance(node, ast.keyword) and node.arg:
            yield node.arg


def _strings(nodes: Collection[ast.AST]) -> Iterator[str]:
    for node in nodes:
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


def _shorten_parameters(function: ast.FunctionDef, keywords: Collection[str]) -> None:
    """Positions are all that calls know of a parameter, unless one names it."""
    inner = list(ast.walk(function))
    used = {name for node in inner for name in _mentioned(node)}
    shorts = (name for name in _BUILT_IN.split() if name not in used)
    arguments = [*function.args.args, *([function.args.vararg] if function.args.vararg else [])]
    names = {each.arg: next(shorts) for each in arguments if each.arg not in keywords}
    for node in inner:
        if isinstance(node, ast.Name):
            node.id = names.get(node.id, node.id)
        elif isinstance(node, ast.arg):
            node.arg = names.get(node.arg, node.arg)
