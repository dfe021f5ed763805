"""The program that is compiled has fewer modules and shorter names, and does the same."""

from __future__ import annotations

import ast
import re
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from armtempo.deploy import program_files
from armtempo.deploy.compact import Compact, compact
from armtempo_shared import table

pytestmark = pytest.mark.xdist_group("compact program")  # which takes seconds to make

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
def made() -> Compact:
    sources = {module: textwrap.dedent(text) for module, text in SOURCES.items()}
    return compact(
        sources,
        "made.main",
        {"made.main"},
        {"total", "hidden", "listed", "table", "state", "_first", "_second"},
    )


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
def test_it_does_the_same(made: Compact, run, words: str) -> None:  # type: ignore[no-untyped-def]
    assert run(made.sources, words) == run(SOURCES, words)


def test_modules_become_one_but_those_that_come_later(made: Compact) -> None:
    assert set(made.sources) == {"made", "made.main", "made.later", "made.kinds", "made.core"}


def test_constants_and_long_names_are_gone(made: Compact) -> None:
    text = "\n".join(made.sources.values())
    for gone in ("SIDES =", "_LEAST", "_OFFSET", "const(", "_MORE", "corners", "Square", "somewhere"):
        assert gone not in text, gone
    for kept in ("def total", "_first", '"length"'.replace('"', "'"), "join", "sqrt", "more="):
        assert kept in text, kept


def test_modules_that_belong_together_become_one(run) -> None:  # type: ignore[no-untyped-def]
    """The names that the others import are found in the one module; two of one name are refused."""
    sources = {
        "made": "",
        "made.main": """
            def total(count):
                from made import late, other
                from made.other import twice
                return late.more(count) + other.twice(count) + twice(1)
        """,
        "made.late": """
            from made import other
            from made.other import twice as again

            def more(count):
                return other.twice(count) + again(count)
        """,
        "made.other": """
            def twice(count):
                return 2 * count
        """,
    }
    texts = {module: textwrap.dedent(text) for module, text in sources.items()}
    joined = compact(texts, "made.main", {"made.main"}, {"total"}, {"made.late": ["made.other"]})
    assert set(joined.sources) == {"made", "made.main", "made.core", "made.late"}
    assert run(joined.sources, "total(5)") == run(sources, "total(5)") == 32
    texts["made.other"] += "def more(count):\n    return count\n"
    with pytest.raises(ValueError, match="more twice"):
        compact(texts, "made.main", {"made.main"}, {"total"}, {"made.late": ["made.other"]})


def test_in_a_class_a_name_is_the_module_s_until_it_is_assigned(run) -> None:  # type: ignore[no-untyped-def]
    text = """
        def doubled(length):
            return 2 * length

        class Square:
            doubled = staticmethod(doubled)
            twice = doubled

        def total():
            return Square().doubled(3) + Square.twice(4)
    """
    sources = {"made": "", "made.main": textwrap.dedent(text)}
    made = compact(sources, "made.main", {"made.main"}, {"total"})
    assert "doubled" not in made.sources["made.core"]
    assert run(made.sources, "total()") == run(sources, "total()") == 14


def test_a_class_that_would_read_its_own_instead_of_the_module_s_is_refused() -> None:
    text = """
        def doubled(length):
            return 2 * length

        def tripled(length):
            return 3 * length

        class Square:
            twice = staticmethod(tripled)
            aside = staticmethod(doubled)

        def total():
            return Square().twice(3) + Square.aside(4)
    """
    sources = {"made": "", "made.main": textwrap.dedent(text)}
    with pytest.raises(ValueError, match="doubled has the short name"):
        compact(sources, "made.main", {"made.main"}, {"total"})


def test_methods_that_are_called_at_rest_are_imported_for_the_call(run) -> None:  # type: ignore[no-untyped-def]
    sources = {module: textwrap.dedent(text) for module, text in SOURCES.items()}
    at_rest = ["made.shapes.Square.__init__"]
    names = {"total", "hidden", "listed", "table", "state", "_first", "_second"}
    made = compact(sources, "made.main", {"made.main"}, names, at_rest=at_rest)
    assert "join" in made.sources["made.set_up"]
    assert "join" not in made.sources["made.core"]
    for words in ("total()", "table()"):
        assert run(made.sources, words) == run(SOURCES, words)
    (moved,) = [found for (module, _), found in made.functions.items() if module == "set_up"]
    assert [one.label for one in moved] == ["shapes.Square.__init__"]
    with pytest.raises(ValueError, match=r"Square\.gone"):
        compact(sources, "made.main", {"made.main"}, names, at_rest=["made.shapes.Square.gone"])


def test_attributes_that_no_object_has_together_share_a_name() -> None:
    """A subclass's objects have those of both."""
    sources = {
        "made": "",
        "made.main": """
            class Square:
                def __init__(self):
                    self.length = 1
                    self.corners = 4

            class Named(Square):
                def __init__(self):
                    super().__init__()
                    self.caption = "square"

            class Circle:
                def __init__(self):
                    self.radius = 3
                    self.colour = 5
        """,
    }
    made = compact(
        {name: textwrap.dedent(text) for name, text in sources.items()}, "made.main", {"made.main"}, ()
    )
    text = made.sources["made.main"]
    by_value = {value: name for name, value in re.findall(r"\.(\w+) = (\S+)", text)}
    assert len({by_value[value] for value in ("1", "4", "'square'")}) == 3, text
    assert {by_value["3"], by_value["5"]} < {by_value[value] for value in ("1", "4", "'square'")}, text
    assert not {"length", "corners", "caption", "radius", "colour"} & set(by_value.values())


def test_what_nothing_uses_is_left_out() -> None:
    sources = {
        "made": "",
        "made.main": "from made import tools\n\ndef run():\n    return tools.used()\n",
        "made.tools": "def used():\n    return 1\n\ndef helper():\n    return 77\n\n"
        "def unused():\n    return helper()\n",
    }
    core = compact(sources, "made.main", {"made.main"}, ()).sources["made.core"]
    assert "return 1" in core
    assert "77" not in core
    assert core.count("def ") == 1


def test_what_nothing_uses_is_left_out_of_modules_that_come_later() -> None:
    """But not what is found by its name at run time, nor in a module that is used as an object."""
    late = "def {}():\n    return 77\n\ndef {}():\n    return 78\n"
    sources = {
        "made": "",
        "made.main": "import struct\nfrom made import whole\n\ndef run(name):\n    from made import late\n    from "
        "made.late import other\n    return late.used(), other(), getattr(whole, name), struct.pack('B', 1)\n",
        "made.late": "def used():\n    return 1\n\ndef other():\n    return 2\n\n"
        "def found():\n    return 3\n\ndef pack():\n    return 77\n\ndef unused():\n    return pack()\n",
        "made.whole": late.format("first", "second"),
    }
    made = compact(sources, "made.main", {"made.main"}, {"found"}).sources
    assert [number in made["made.late"] for number in ("return 1", "return 2", "return 3", "77")] == [
        True,
        True,
        True,
        False,
    ]
    assert made["made.whole"].count("def ") == 2


def test_a_name_that_is_not_there_is_told() -> None:
    sources = {
        "made": "",
        "made.main": "from made import other\nprint(other.gone)\n",
        "made.other": "here = [1]\n",
    }
    with pytest.raises(ValueError, match=r"made\.other defines no gone"):
        compact(sources, "made.main", {"made.main"}, ())


PACKAGES = {
    "made": "",
    "made.inner": '"""Holds modules."""\n',
    "made.inner.main": "from made.inner import tools\nfrom made.other.more import two\n\n"
    "def run():\n    from made.other import late\n    return tools.one() + two() + late.four()\n",
    "made.inner.tools": "def one():\n    return 1\n",
    "made.other": "",
    "made.other.more": "def two():\n    return 2\n",
    "made.other.late": "def four():\n    return 4\n",
}


def test_packages_within_the_package_go(run) -> None:  # type: ignore[no-untyped-def]
    made = compact(PACKAGES, "made.inner.main", {"made.inner.main"}, {"run"})
    assert made.sources.keys() == {"made", "made.main", "made.core", "made.late"}
    assert run(made.sources, "run()") == 7


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"made.inner": "MORE = 1\n"}, r"made\.inner: a package within"),
        ({"made.other.tools": ""}, r"two modules are called made\.tools"),
    ],
)
def test_packages_that_cannot_go_are_told(more: dict[str, str], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        compact(PACKAGES | more, "made.inner.main", {"made.inner.main"}, {"run"})


@pytest.mark.slow
def test_the_board_program_is_mostly_one_module() -> None:
    made = program_files.compact_program()
    for text in made.sources.values():
        ast.parse(text)
        assert "def const(" not in text, "the compiler takes calls of const for declarations"
    core = made.sources["armtempo_board.core"]
    assert "armtempo_board.program" in made.sources
    assert "armtempo_board.store" in made.sources
    assert len(core) > sum(map(len, made.sources.values())) / 2.5  # the rest comes and goes


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


def _frame(label: str) -> str:
    """A line of a traceback, as the compiled program gives it."""
    known = program_files.compact_program().functions
    module, short = next(
        key for key, functions in known.items() if label in [function.label for function in functions]
    )
    return f'  File "{module}", line 1, in {short}\n'


@pytest.mark.slow
def test_traceback_of_the_compiled_program_is_readable() -> None:
    """A short name stands for several functions; who calls whom tells which it is."""
    chain = (
        "app.App.turn",
        "app.App._turn",
        "engine.Engine.service",
        "engine.Engine._service",
        "engine.Engine._stopped",
    )
    given = "".join(map(_frame, chain)) + "ValueError: deliberate\n"
    lines = program_files.in_full(given).splitlines()
    homes = {"app": "armtempo_board/app/app.py", "engine": "armtempo_board/motion/engine.py"}
    pairs = [label.split(".", 1) for label in chain]
    assert lines[:-1] == [f'  File "{homes[module]}", in {name}' for module, name in pairs]
    assert lines[-1] == "ValueError: deliberate"
    (module, short), several = next(
        item for item in program_files.compact_program().functions.items() if len(item[1]) > 1
    )
    alone = f'  File "{module}", line 1, in {short}\n'
    labels = " or ".join(function.label for function in several)
    assert program_files.in_full(alone) == f"{alone[:-1]} ({labels})\n", "nothing tells which"


@pytest.mark.slow
@pytest.mark.parametrize("folder", ["", "/flash/lib/"])
def test_traceback_of_the_plain_program_reads_the_same(folder: str) -> None:
    """From a firmware, or from sources in the flash: as of the compiled program, and with lines."""
    chain = {
        "App.turn": "armtempo_board/app/app.py",
        "App._turn": "armtempo_board/app/app.py",
        "Engine.service": "armtempo_board/motion/engine.py",
        "Engine._service": "armtempo_board/motion/engine.py",
        "Engine._stopped": "armtempo_board/motion/engine.py",
    }
    raw = wanted = ""
    for label, name in chain.items():
        function = label.split(".")[1]
        lines = program_files.modules()[name].read_text().splitlines()
        line = next(at for at, text in enumerate(lines, 2) if f" def {function}(" in text)
        raw += f'  File "{folder}{name}", line {line}, in {function}\n'
        wanted += f'  File "{name}", line {line}, in {label}\n'
    assert program_files.in_full(raw) == wanted
    compiled = "".join(_frame(f"{Path(name).stem}.{label}") for label, name in chain.items())
    assert program_files.in_full(compiled) == re.sub(r", line \d+", "", wanted)


@pytest.mark.slow
def test_tracebacks_of_others_stay() -> None:
    for other in (
        '  File "main.py", line 3, in turn\n',
        '  File "core", line 1, in nothing\n',
        "no traceback",
    ):
        assert program_files.in_full(other) == other
