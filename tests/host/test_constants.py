"""Constants are put in where they are used: the program does the same, and its lines keep their numbers."""

from __future__ import annotations

import ast
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from armtempo.deploy import program_files
from armtempo.deploy.constants import fold, is_empty
from armtempo_shared import table

SOURCES = {
    "made": "",
    "made.main": """
        from micropython import const
        from made import kinds, shapes, tools
        from made.shapes import SIDES, Square
        from made.tools import area as measure

        _OFFSET = const(SIDES + 1)
        TYPE_CHECKING = False
        if TYPE_CHECKING:
            from somewhere import Nothing
        state = None

        def total(count: int = SIDES) -> "Nothing":
            global state
            area = measure(Square(count)) + tools.area(Square(2))
            state = shapes.Square
            from made import later
            return area + _OFFSET + later.extra(area, more=shapes.SIDES)

        def hidden(SIDES, tools):
            return SIDES + tools

        def listed():
            return sorted(name for name in dir(kinds) if getattr(kinds, name) == 2)

        def table():
            return [getattr(shapes.Square(1), "_" + name)() for name in ("first", "second")]
    """,
    "made.kinds": """
        FIRST_KIND = 1
        SECOND_KIND = 2
    """,
    "made.shapes": """
        SIDES = 4
        _LEAST, _MOST = 2, 9

        class Square:
            corners = SIDES
            names = {"length": 1}

            def __init__(self, length):
                self.length = max(_LEAST, min(length, _MOST))
                self.text = ", ".join([str(SIDES) for SIDES in range(2)])

            def area(self):
                return self.length * self.length + self.corners

            def _first(self):
                return 1

            def _second(self):
                return self.names["length"]
    """,
    "made.tools": """
        import math

        def area(square):
            def root(value):
                return math.sqrt(value)
            return int(root(square.area() ** 2))
    """,
    "made.later": """
        from made import shapes
        from made.tools import area

        _MORE = 100

        def extra(base, more):
            return base + _MORE + more + area(shapes.Square(3)) + shapes.SIDES
    """,
}


@pytest.fixture
def made() -> dict[str, str]:
    return fold({module: textwrap.dedent(text) for module, text in SOURCES.items()})


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[object]:
    """Gives what runs a call in ``made.main``; whatever it imported is forgotten again."""

    def forget() -> None:
        for name in [name for name in sys.modules if name.split(".")[0] in ("made", "micropython")]:
            del sys.modules[name]

    def call(sources: dict[str, str], words: str) -> object:
        forget()
        folder = tmp_path / str(len(list(tmp_path.iterdir())))
        for module, text in sources.items():
            path = folder / f"{module.replace('.', '/')}.py"
            path = folder / "made" / "__init__.py" if module == "made" else path
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(textwrap.dedent(text))
        (folder / "micropython.py").write_text("def const(value):\n    return value\n")
        with monkeypatch.context() as patch:
            patch.syspath_prepend(str(folder))
            space: dict[str, object] = {}
            exec(f"from made import main\nresult = main.{words}", space)
        return space["result"]

    yield call
    forget()


@pytest.mark.parametrize("words", ["total()", "total(7)", "hidden(1, 2)", "table()", "listed()"])
def test_it_does_the_same(made: dict[str, str], run, words: str) -> None:  # type: ignore[no-untyped-def]
    assert run(made, words) == run(SOURCES, words)


def test_constants_are_gone_and_lines_stay(made: dict[str, str]) -> None:
    text = "\n".join(made.values())
    for gone in (
        "SIDES =",
        "_LEAST",
        "_OFFSET",
        "const",
        "_MORE",
        "TYPE_CHECKING",
        "import SIDES",
        "SIDES, Square",
    ):
        assert gone not in text, gone
    for kept in ("FIRST_KIND = 1", "import kinds, shapes, tools", "if False:", "def total(count: int=4)"):
        assert kept in text.replace(" = 4)", "=4)"), kept
    for module, source in SOURCES.items():
        before, after = (each.splitlines() for each in (textwrap.dedent(source), made[module]))
        assert len(before) == len(after)
        for one, other in zip(before, after, strict=True):
            assert ("def " in one) == ("def " in other)


def test_lines_of_what_is_longer_than_one_stay_too() -> None:
    """Also negative numbers, and text beyond ASCII in front of a constant."""
    texts = {
        "made": "",
        "made.main": "from made.kinds import (\n    LOW,\n    high,\n)\n\nFOUR = (\n    4\n)\n\n\ndef total():\n"
        "    return 'é', LOW, 2**LOW + FOUR, high()\n",
        "made.kinds": "LOW = -2\n\n\ndef high():\n    return LOW\n",
    }
    main = fold(texts)["made.main"].splitlines()
    assert main[0] == "from made.kinds import high"
    assert main[1:10] == [""] * 9
    assert main[11] == "    return 'é', (-2), 2**(-2) + 4, high()"


def test_an_import_that_only_named_constants_does_nothing() -> None:
    texts = {
        "made": "",
        "made.main": "from made import limits\n\n\ndef most():\n    from made.limits import MOST\n\n"
        "    return MOST, limits.LEAST\n",
        "made.limits": '"""Numbers."""\n\nMOST = 3\nLEAST = 1\n',
    }
    folded = fold(texts)
    assert folded["made.main"].splitlines() == [
        "pass",
        "",
        "",
        "def most():",
        "    pass",
        "",
        "    return 3, 1",
    ]
    assert is_empty(folded["made.limits"])
    assert not is_empty(folded["made.main"])


def test_what_another_module_changes_is_no_constant() -> None:
    texts = {
        "made": "",
        "made.main": "from made import state\n\n\ndef run():\n    state.one = 2\n    return state.one + state.two\n",
        "made.state": "one = 1\ntwo = 2\n",
    }
    folded = fold(texts)
    assert folded["made.state"].split() == ["one", "=", "1"]
    assert folded["made.main"] == texts["made.main"].replace("state.two", "2")


@pytest.mark.slow
@pytest.mark.long
def test_every_module_of_the_core_is_whole() -> None:
    """No module is imported that is not there, and no name that is not in it."""
    core = program_files.core()
    trees = {module: ast.parse(text) for module, text in core.items()}
    sources = program_files.sources()
    assert not any("selftest" in module for module in core)
    for module, tree in trees.items():
        assert (
            len(core[module].splitlines()) == len(sources[module].splitlines())
            or "table" in module
            or "features" in module
            or "hash" in module
        )
        for node in tree.body:
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith("armtempo_"):
                for alias in node.names:
                    whole = f"{node.module}.{alias.name}"
                    assert whole in core or alias.name in _defined(trees[str(node.module)]), (module, whole)


def _defined(tree: ast.Module) -> set[str]:
    names = {node.name for node in tree.body if isinstance(node, ast.FunctionDef | ast.ClassDef)}
    return names | {
        node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    }


def test_the_short_message_table_says_the_same() -> None:
    """But the names of fields, which only the host asks for, and of messages that the core does not have."""
    path = Path(table.__file__)
    short: dict[str, Any] = {"__name__": "short"}
    exec(program_files._short_table(path.read_text(encoding="utf-8")), short)
    assert len(short["_TABLE"]) < 0.8 * len(table._TABLE)
    for kind in "CAER":
        for mine, whole in zip(short["rows"](kind), table.rows(kind), strict=True):
            assert (*mine[:3], mine[4]) == (*whole[:3], whole[4])
    for place in (("E", "sample", "ticks"), ("E", "sample", "flags"), ("A", "status", "ticks")):
        assert short["offset"](*place) == table.offset(*place)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("folder", ["", "/flash/lib/", "names"])
def test_tracebacks_say_classes(folder: str) -> None:
    """From a firmware, from sources in the flash, and from compiled files, whose names are all that they say."""
    chain = {
        "App.run_once": "armtempo_board/app/app.py",
        "App._run_once": "armtempo_board/app/app.py",
        "Engine.service": "armtempo_board/motion/engine.py",
        "Engine._service": "armtempo_board/motion/engine.py",
        "Engine._stopped": "armtempo_board/motion/engine.py",
    }
    raw = wanted = ""
    for label, name in chain.items():
        function = label.split(".")[1]
        lines = program_files.modules()[name].read_text().splitlines()
        line = next(at for at, text in enumerate(lines, 2) if f" def {function}(" in text)
        said = Path(name).stem if folder == "names" else f"{folder}{name}"
        raw += f'  File "{said}", line {line}, in {function}\n'
        wanted += f'  File "{name}", line {line}, in {label}\n'
    assert program_files.in_full(raw) == wanted


@pytest.mark.slow
def test_tracebacks_of_others_stay() -> None:
    for other in (
        '  File "main.py", line 3, in turn\n',
        '  File "nobody", line 1, in nothing\n',
        "no traceback",
    ):
        assert program_files.in_full(other) == other
