"""The shape of ``host/armtempo`` and ``shared/armtempo_shared``: imports point one way, signatures stay short."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Container, Iterator
from graphlib import TopologicalSorter
from pathlib import Path

from tests import sources
from tests.sources import nodes, tree

pytestmark = sources.TOGETHER

ROOT = Path(__file__).parents[2]
HOST = ROOT / "host" / "armtempo"
SHARED = ROOT / "shared" / "armtempo_shared"
ORDER = (
    "basics",  # errors, the array type, progress, files of every kind, settings
    "ports",  # names of serial ports, which is meant; the program that has one answers others
    "splines",  # B-splines, the time axis, trajectories, bounds of their extremes
    "optimise",  # population searches
    "model",  # arm, job, pose, plan, and their files
    "kinematics",  # forward, inverse, choice
    "planning",  # from a job to a plan
    "encoding",  # arm and motion in the binary encoding for the board
    "new_arm",  # a folder for a new arm, also from a robot description
    "simulator",  # the virtual board
    "link",  # port, session, commands, samples of a run
    "deploy",  # the board program onto a board
    "diagnosis",  # what looks wrong about an arm, a job, this machine; a board measures itself
    "report",  # run folders, what the samples say; pages, plots, tables
    "robot",  # a board in use: home, go, run, stop
    "testing",  # a user's program without a board
    "pipeline",  # plan, load, run, report
    "paper",  # its tables and figures, repeated
    "panel",  # the arm in a browser
    "cli",
)
"""Each package or module imports from those before it in this list, never from those after."""
LOWEST = ("__init__",)  # the version; its public names are imported when they are used
HIGHEST = ("__main__",)
MOST_PARAMETERS = 6
OWN_PARAMETERS = ("search", "testing.run")
"""``optimise.*.search`` takes an algorithm's own parameters, each by its name in the algorithm's table;
``armtempo.testing.run`` what a test of a user's program says, each by its name."""
THREE_BY_DESIGN = ("values", "resolve_command")
"""Speed, acceleration and jerk; what click makes of a command's name."""
SAME_BY_DESIGN = {"Timer", "Pin", "Switch", "Flash", "ExtInt", "WDT", "RTC", "USB_VCP", "Encoder", "Joint"}
SAME_BY_DESIGN |= {"Store"}
"""Names that MicroPython gives, or that the board program has for its own part of the same thing."""


def modules() -> list[Path]:
    """The host's modules, but for what runs under MicroPython."""
    return [
        path
        for path in sorted(HOST.rglob("*.py"))
        if "hardware" not in path.parts and path != HOST / "simulator" / "main.py"
    ]


def part(path: Path) -> str:
    """The package, or module at the top, that a file belongs to."""
    first = path.relative_to(HOST).parts[0]
    return first.removesuffix(".py")


def imported(path: Path) -> Iterator[str]:
    """Packages of armtempo that are imported anywhere in a module, also inside of functions."""
    for node in nodes(path):
        if isinstance(node, ast.ImportFrom) and node.module == "armtempo":
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("armtempo."):
            yield str(node.module).split(".")[1]
        elif isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name.startswith("armtempo."):
                    yield alias.name.split(".")[1]


def functions(path: Path) -> Iterator[ast.FunctionDef]:
    """All functions and methods of a module."""
    for node in nodes(path):
        if isinstance(node, ast.FunctionDef):
            yield node


def test_every_part_has_a_place_in_the_order() -> None:
    assert {part(path) for path in modules()} == {*ORDER, *LOWEST, *HIGHEST}


def test_imports_point_one_way() -> None:
    for path in modules():
        here = part(path)
        if here not in LOWEST + HIGHEST:
            for name in imported(path):
                assert name not in ORDER or ORDER.index(name) <= ORDER.index(here), f"{path} imports {name}"


def test_no_modules_import_each_other() -> None:
    names = {name_of(path): path for path in modules()}
    needs = {name: set(imported_modules(path, names)) - {name} for name, path in names.items()}
    needs["armtempo"] = set()  # it hands names on, each when it is first used
    TopologicalSorter(needs).prepare()  # CycleError, with the modules of the circle


def test_benchmarks_import_modules_that_there_are() -> None:
    """They run seldom, and some need packages that are not installed here."""
    names = {name_of(path) for path in modules()}
    for path in (HOST.parents[1] / "tests" / "benchmark").glob("*.py"):
        for node in nodes(path):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("armtempo."):
                assert node.module in names, f"{path.name} imports {node.module}"


def name_of(path: Path) -> str:
    """A module's name, with dots."""
    return ".".join(path.relative_to(HOST.parent).with_suffix("").parts).removesuffix(".__init__")


def imported_modules(path: Path, names: Container[str]) -> Iterator[str]:
    """Modules among ``names`` that a file imports, anywhere in it."""
    for node in nodes(path):
        if isinstance(node, ast.ImportFrom) and node.module:
            inner = [f"{node.module}.{alias.name}" for alias in node.names]
            yield from (name for name in inner if name in names)
            if node.module in names and any(name not in names for name in inner):
                yield node.module
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in names)


def test_functions_take_few_parameters() -> None:
    for path in [*modules(), *SHARED.glob("*.py")]:
        for function in functions(path):
            names = [one.arg for one in (*function.args.posonlyargs, *function.args.args)]
            count = len(names) + len(function.args.kwonlyargs) - (names[:1] in (["self"], ["cls"]))
            is_command = any("command" in ast.unparse(one) for one in function.decorator_list)
            own = {function.name, f"{path.stem}.{function.name}"}.intersection(OWN_PARAMETERS)
            if not is_command and not own:
                assert count <= MOST_PARAMETERS, f"{path.relative_to(ROOT)}: {function.name} takes {count}"


def test_nobody_sets_attributes_of_a_session() -> None:
    """What a call wants of the link is an argument, or a context with an end: state that others set stays."""
    for path in modules():
        for node in nodes(path):
            targets = node.targets if isinstance(node, ast.Assign) else []
            for target in (part for one in targets for part in ast.walk(one)):
                if isinstance(target, ast.Attribute) and isinstance(target.ctx, ast.Store):
                    owner = ast.unparse(target.value)
                    assert owner.rpartition(".")[2] != "session", (
                        f"{path.relative_to(ROOT)}: {ast.unparse(target)}"
                    )


def test_results_of_three_have_names() -> None:
    for path in modules():
        for function in functions(path):
            if not function.name.startswith("_") and function.name not in THREE_BY_DESIGN:
                assert result_size(function) <= 2, f"{path.relative_to(ROOT)}: {function.name}"


def result_size(function: ast.FunctionDef) -> int:
    """Number of entries of a bare tuple that a function gives; 1 for anything else."""
    kind = function.returns
    if not isinstance(kind, ast.Subscript) or ast.unparse(kind.value) != "tuple":
        return 1
    entries = kind.slice.elts if isinstance(kind.slice, ast.Tuple) else [kind.slice]
    return 1 if ast.unparse(entries[-1]) == "..." else len(entries)


def test_no_class_name_stands_for_two_things() -> None:
    places = Counter(
        node.name
        for root in (HOST, SHARED)
        for path in root.rglob("*.py")
        for node in tree(path).body
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    )
    assert {name for name, count in places.items() if count > 1} <= SAME_BY_DESIGN


def test_types_of_the_whole_package_have_one_home() -> None:
    homes = [
        (target.id, str(path.relative_to(HOST)))
        for path in modules()
        for node in tree(path).body
        if isinstance(node, ast.Assign)
        for target in node.targets
        if isinstance(target, ast.Name) and target.id in ("Array", "Progress")
    ]
    assert sorted(homes) == [("Array", "basics/arrays.py"), ("Progress", "basics/progress.py")]
