"""README, help, pages, site, pictures and workflows name what exists: every command once, in groups, and current."""

from __future__ import annotations

import ast
import inspect
import os
import re
import runpy
import shlex
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import armtempo
import click
import pytest
from armtempo.cli import main
from armtempo.cli.commands import COMMANDS, GROUPS
from armtempo.model import engine_pins
from armtempo_shared import meanings
from click.testing import CliRunner

from tests import interpreters, sources
from tests.interpreters import ROOT

FILES = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
SCRIPT = sources.script(ROOT / "host" / "docs" / "make_tables.py")
IMAGES = ROOT / "host" / "docs" / "images"
FIGURES_SCRIPT = (ROOT / "host" / "docs" / "site" / "make_figures.py").read_text(encoding="utf-8")
MADE = set(re.findall(r'^    "([\w-]+\.(?:png|gif))": ', FIGURES_SCRIPT, re.MULTILINE))
PAGES = [ROOT / "README.md", *ROOT.glob("*/docs/*.md")]
PAGE = (ROOT / "host" / "docs" / "cli.md").read_text(encoding="utf-8")
TOUR = (ROOT / "host" / "docs" / "architecture.md").read_text(encoding="utf-8")
SOURCES = {
    "host": ROOT / "host" / "armtempo",
    "shared": ROOT / "shared" / "armtempo_shared",
    "board": ROOT / "board" / "armtempo_board",
}
LINKING = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(ROOT.glob("*/docs/*.md"))]


def test_the_table_says_of_a_command_what_its_docstring_says() -> None:
    for name in COMMANDS:
        command = main.get_command(click.Context(main), name)
        assert command is not None, name
        assert command.name == name, name
        assert command.help is not None, name
        assert command.help.split("\n\n")[0].replace("\n", " ") == COMMANDS[name].summary, name
        assert COMMANDS[name].examples, name


def test_no_line_of_the_help_page_is_cut_at_80_columns() -> None:
    shown = CliRunner().invoke(main, ["--help"], terminal_width=80).output
    assert [line for line in shown.splitlines()[1:] if line.endswith("...")] == []


def test_the_help_page_and_the_tab_key_import_no_command() -> None:
    count = "len([name for name in sys.modules if name.startswith('armtempo.cli.')])"
    code = (
        "import sys, click; from armtempo.cli import main; "
        f"before = {count}; context = click.Context(main); main.get_help(context); main.shell_complete(context, ''); "
        f"print({count} - before, 'numpy' in sys.modules)"
    )
    assert subprocess.check_output([sys.executable, "-c", code], text=True).split() == ["0", "False"]


def test_a_move_loads_no_planner() -> None:
    """Of 0.8 s until a ``goto`` begins, 0.2 s were the import of what it does not need."""
    code = "import sys, armtempo.cli.posture, armtempo.cli.jog; print('armtempo.planning.planner' in sys.modules)"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).split() == ["False"]


def test_the_help_page_shows_the_groups_and_their_commands() -> None:
    page = CliRunner().invoke(main, ["--help"]).output
    for title, names in GROUPS.items():
        section = page[page.index(f"{title}:\n") :]
        for name in names:
            assert re.search(rf"^  {name} ", section, re.MULTILINE), name
    for line in re.findall(r"^    armtempo (\S+)", page, re.MULTILINE):
        assert line == "COMMAND" or line in COMMANDS


def test_an_example_is_a_command_that_can_be_given(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for line in [line for entry in COMMANDS.values() for line in entry.examples]:
        monkeypatch.chdir(tmp_path)
        name, *arguments = shlex.split(re.sub(r" >>? .*", "", line))
        for argument in arguments:  # what must be there is made
            if argument.startswith("runs/"):
                (tmp_path / argument).mkdir(parents=True, exist_ok=True)
        command = main.get_command(click.Context(main), name)
        assert command is not None, line
        command.make_context(name, arguments)
        page = CliRunner().invoke(main, [name, "--help"]).output
        assert f"  armtempo {line}\n" in page, line


def completed(line: str) -> set[str]:
    """What click's script for the shell is answered: kind and word."""
    words = {
        "COMP_WORDS": line,
        "COMP_CWORD": str(len(line.split(" ")) - 1),
        "_ARMTEMPO_COMPLETE": "bash_complete",
    }
    command = [sys.executable, "-m", "armtempo"]
    done = subprocess.run(command, env={**os.environ, **words}, capture_output=True, text=True, check=True)
    return set(done.stdout.split())


@pytest.mark.slow
def test_what_the_tab_key_asks_is_answered() -> None:
    assert completed("armtempo st") == {"plain,stop", "plain,status"}
    assert completed("armtempo plan --timing p") == {"plain,per-joint"}
    assert completed("armtempo check --arm mo") == {"plain,moveo"}
    assert completed("armtempo check --arm my") == {"file,my"}


@pytest.mark.parametrize("name", ["run", "fetch", "goto", "home"])
def test_files_complete_where_an_argument_may_be_one(name: str) -> None:
    command = main.get_command(click.Context(main), name)
    assert command is not None
    offered = command.params[0].shell_complete(click.Context(command), "fir")
    assert [(item.type, item.value) for item in offered] == [("file", "fir")]


LINES = [
    (file.name, command.strip())
    for file in FILES
    for line in re.findall(r"run: (.*?)(?: #.*)?$", file.read_text(encoding="utf-8"), re.MULTILINE)
    for command in line.split("&&")
]


def test_there_are_workflows() -> None:
    assert len(FILES) == 3
    assert len(LINES) > 10


def test_what_a_workflow_runs_is_there() -> None:
    for file, line in LINES:
        program, *arguments = shlex.split(line)
        if program == "armtempo" and arguments != ["--version"]:
            command = main.get_command(click.Context(main), arguments[0])
            assert command is not None, line
            command.make_context(arguments[0], arguments[1:], resilient_parsing=False)
        elif program == "make":
            makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
            assert all(re.search(rf"^{target}:", makefile, re.MULTILINE) for target in arguments)
        elif "/" in program or (program == "python" and arguments[0].endswith(".py")):
            script = ROOT / (program if "/" in program else arguments[0])
            assert script.is_file(), f"{file}: {line}"
            assert "/" not in program or script.stat().st_mode & 0o100, f"{file}: {line}"


def test_a_workflow_that_another_one_calls_is_there_and_may_be_called() -> None:
    for file in FILES:
        for called in re.findall(r"uses: \./(\S+)", file.read_text(encoding="utf-8")):
            assert "workflow_call:" in (ROOT / called).read_text(encoding="utf-8")


# interpreters for the tests: the file that the lock names, or none


@pytest.mark.parametrize("content", [b"another file", None])
def test_a_file_that_is_not_the_locked_one_is_not_unpacked(content: bytes | None, tmp_path: Path) -> None:
    names = runpy.run_path(str(ROOT / ".ci" / "get_micropython.py"))
    unpack = names["unpack"]
    unpack.__globals__.update(CACHE=tmp_path / "cache", archive_address=tmp_path.as_uri)
    for line in names["LOCK"].read_text().splitlines():
        package = tmp_path / line.split()[1]
        package.parent.mkdir(parents=True, exist_ok=True)
        if content is not None:
            package.write_bytes(content)
    with pytest.raises(names["Missing"], match=r"micropython_.*_armhf\.deb.*debian\.lock"):
        unpack("armhf")
    assert not (tmp_path / "cache").exists()


# the other Pythons of CI's machine: each release once, and a line if there is none


def test_pythons_that_ci_tries(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    script = sources.script(ROOT / ".ci" / "pythons.py")
    one = {sys.version_info[:2]: Path("own")}
    two = {**one, (3, 99): Path("newer")}
    assert [(each.name, each.python) for each in script.environments(one)] == [("oldest", Path("own"))]
    assert [(each.name, each.python) for each in script.environments(two)] == [
        ("newest-3.99", Path("newer")),
        ("oldest", Path("own")),
    ]
    stood_in = script.main.__globals__
    stood_in.update(PLACE=tmp_path, test=lambda environment: (True, environment.name))
    stood_in["pythons"] = lambda: two
    assert script.main() == 0
    assert capsys.readouterr().out.splitlines() == ["newest-3.99", "oldest"]
    stood_in.update(pythons=lambda: one, test=lambda environment: (False, environment.name))
    assert script.main() == 1
    last = "only one Python from 3.11 on is on this machine; no other was tested"
    assert capsys.readouterr().out.splitlines() == ["oldest", last]


def test_no_page_installs_armtempo_from_an_index() -> None:
    """None has it yet: an installation names a folder, such as ./armtempo."""
    wanted = re.compile(r"\binstall (?:--?[\w-]+ )*['\"]?armtempo\b(?!-)")
    assert [path.name for path in PAGES if wanted.search(path.read_text(encoding="utf-8"))] == []


@pytest.mark.parametrize("name", SCRIPT.TABLES)
def test_page_is_current(name: str) -> None:
    text = (ROOT / "host" / "docs" / name).read_text(encoding="utf-8")
    assert SCRIPT.page(name) == text, "run: python host/docs/make_tables.py"


# every figure of the pages is made by the script that makes them all


def shown() -> set[Path]:
    """All pictures that a page shows."""
    return {
        (page.parent / target).resolve()
        for page in PAGES
        for target in re.findall(r"!\[[^\]]+\]\(([^)]+)\)", page.read_text(encoding="utf-8"))
    }


def test_figures_are_made_shown_and_there() -> None:
    assert {path.name for path in IMAGES.iterdir()} == MADE
    assert {path.name for path in shown()} == MADE | {"wiring.svg"}
    for path in shown():
        assert path.parent == IMAGES or path.name == "wiring.svg"
        assert path.stat().st_size > 10_000


def test_the_wiring_diagram_shows_the_pins_of_the_board_program() -> None:
    """``python host/docs/site/make_wiring.py`` makes it anew."""
    made = sources.script(ROOT / "host" / "docs" / "site" / "make_wiring.py")
    drawn = made.svg()
    assert made.TARGET.read_text(encoding="utf-8") == drawn
    pins = engine_pins.table()
    shown_pins = re.findall(r">(P[A-E]\d+)<", drawn)
    wired = [row[0] for row in pins["STEP"]] + [*pins["DIR"], *pins["LIMIT"], pins["ENABLE"], pins["ESTOP"]]
    wired += [pin for row in pins["ENCODER"] for pin in row[1:3]]
    assert sorted(shown_pins) == sorted(f"P{pin}" for pin in wired)


# the page on the command line has one row for every command; their options are on a page that is generated


def row(name: str) -> str:
    """The line of the tables of commands that describes this one."""
    page = re.sub(r"^## JSON\n.*?^## ", "## ", PAGE, flags=re.MULTILINE | re.DOTALL)
    found = [line for line in page.splitlines() if re.search(rf"^\|[^|]*`{name}[ `]", line)]
    assert len(found) == 1, f"{name}: {found}"
    return found[0]


def test_no_command_is_left_out() -> None:
    for name in main.list_commands(click.Context(main)):
        assert row(name), name


def test_examples_are_commands() -> None:
    for line in PAGE.splitlines():
        words = line.split()
        if words[:1] == ["armtempo"]:
            assert main.get_command(click.Context(main), words[1]) is not None, line


@cache
def names(side: str) -> frozenset[str]:
    """Modules and classes of a side, and what they define: ``module``, ``module.function``, ``Class.method``."""
    found = set()
    for path in SOURCES[side].rglob("*.py"):
        if "hardware" in path.parts and side == "host":
            continue
        module = path.parent.name if path.name == "__init__.py" else path.stem
        found.add(module)
        for node in sources.tree(path).body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                found.add(f"{module}.{node.name}")
            if isinstance(node, ast.ClassDef):
                found.add(node.name)
                found |= {
                    f"{node.name}.{part.name}" for part in node.body if isinstance(part, ast.FunctionDef)
                }
    return frozenset(found)


def mentioned() -> list[tuple[str, str]]:
    """(side, name) of each call or place in the second column of the tables of the way and of places."""
    rows = [line.split("|") for line in TOUR.splitlines()]
    cells = [row[2] for row in rows if len(row) > 3 and not set(row[1]) <= set("- ")]
    found = []
    for text in re.findall(r"`([^`]+)`", " ".join(cells)):
        side, _, name = text.rpartition(": ")
        if not name.startswith("["):
            found.append((side or "host", name))
    return found


def test_the_tables_were_found() -> None:
    assert {side for side, _ in mentioned()} == set(SOURCES)
    assert len(set(mentioned())) >= 25


@pytest.mark.slow
@sources.TOGETHER
def test_what_the_tour_names_exists() -> None:
    for side, name in sorted(set(mentioned())):
        assert name in names(side), name


def test_links_lead_somewhere() -> None:
    for page in LINKING:
        for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
            assert "://" in target or (page.parent / target).exists(), f"{page}: {target}"


def test_the_pages_on_arms_and_kinematics_name_modules_that_exist() -> None:
    for name in ("arms.md", "kinematics.md"):
        text = (ROOT / "host" / "docs" / name).read_text(encoding="utf-8")
        rows = "".join(line for line in text.splitlines() if line.startswith("|"))
        modules = set(re.findall(r"`(?:\.\./)?([\w/]+\.py)", rows))
        assert len(modules) >= 8
        places = (SOURCES["host"], SOURCES["host"] / "kinematics", ROOT / "shared")
        for module in modules:
            assert any((place / module).is_file() for place in places), f"{name}: {module}"


def test_the_tour_names_every_package() -> None:
    tour = TOUR[TOUR.index("host/armtempo/  basics") : TOUR.index("shared/armtempo_shared/   ")]
    packages = {path.parent.name for path in SOURCES["host"].glob("*/__init__.py")} | {"pipeline"}
    assert packages <= set(re.findall(r"\w+", tour))


# the documentation site builds without a warning and has a place for every command, code and page


SITE = pytest.mark.xdist_group("site")  # what they share is made once
CATALOGUE = sources.script(ROOT / "host" / "docs" / "site" / "catalogue.py")
SITE_PAGES = sorted(page.relative_to(ROOT) for page in ROOT.glob("*/docs/*.md"))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the built site."""
    out = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-d", str(out / "doctrees")]
    command += ["-c", "host/docs/site", ".", str(out / "html")]
    # what the pages do wrong, -W says
    environment = interpreters.environment_of_others()
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return out / "html"


@pytest.mark.slow
@SITE
@pytest.mark.long
def test_every_page_is_built_and_reached_from_the_first(site: Path) -> None:
    first = (site / "host" / "docs" / "index.html").read_text(encoding="utf-8")
    links = set(re.findall(r'class="reference internal" href="([^"#]+)"', first))
    reached = {(site / "host" / "docs" / link).resolve() for link in links}
    for page in SITE_PAGES:
        built = (site / page).with_suffix(".html")
        assert built.exists(), page
        assert page.name == "index.md" or built.resolve() in reached, page


@pytest.mark.slow
@SITE
@pytest.mark.long
def test_the_first_page_has_a_picture_and_two_buttons_and_no_list_of_pages(site: Path) -> None:
    text = (site / "host" / "docs" / "index.html").read_text(encoding="utf-8")
    article = text[text.index("<article") : text.index("</article>")]
    assert article.count('class="button') == 2
    assert "toctree-wrapper" not in re.sub(r'<div class="toctree-wrapper compound">\s*</div>', "", article)
    assert "arm.gif" in article
    assert "the armtempo authors" in text[text.index("<footer") :]


@pytest.mark.slow
@SITE
@pytest.mark.long
def test_types_are_written_as_a_person_writes_them(site: Path) -> None:
    text = (site / "host" / "docs" / "api.html").read_text(encoding="utf-8")
    plain = re.sub(r"<[^>]+>", "", text)
    for name in ("minimise", "launch", "deploy", "Joint", "Wait"):
        assert f"{name}(" in plain, name
    assert not re.findall(r"armtempo\.(?:model|basics|robot|splines|records)\.[a-z_.]+\.[A-Z]\w+", plain)


@pytest.mark.slow
@SITE
@pytest.mark.long
def test_the_papers_page_is_one_of_the_site(site: Path) -> None:
    text = (site / "host" / "docs" / "paper-repeated.html").read_text(encoding="utf-8")
    assert "sidebar" in text
    assert 'class="good">same' in text
    assert 'class="good">differs' not in text


def test_every_argument_is_described() -> None:
    context = click.Context(main)
    for name in main.list_commands(context):
        command = main.get_command(context, name)
        assert command is not None
        for argument in CATALOGUE.names_of_arguments(command):
            assert CATALOGUE.described(command, argument) or "{" in argument, f"{name} {argument}"


@pytest.mark.slow
@SITE
@pytest.mark.long
def test_ranges_are_numbers(site: Path) -> None:
    page = re.sub(r"<[^>]+>", "", (site / "host" / "docs" / "commands.html").read_text(encoding="utf-8"))
    assert "RANGE" not in page
    assert "1 to 99" in page


def test_links_say_where_they_lead() -> None:
    for page in SITE_PAGES:
        found = re.findall(r"\[`?([\w./-]+\.md)`?\]\(", (ROOT / page).read_text(encoding="utf-8"))
        assert not found, page


@pytest.mark.slow
@SITE
@pytest.mark.long
def test_every_command_has_its_section(site: Path) -> None:
    page = (site / "host" / "docs" / "commands.html").read_text(encoding="utf-8")
    for name in main.list_commands(click.Context(main)):
        assert f'<section id="{name}">' in page, name
    assert "<td><p></p></td>" not in page


@pytest.mark.slow
@SITE
@pytest.mark.long
def test_every_code_of_the_board_is_listed(site: Path) -> None:
    page = (site / "host" / "docs" / "errors.html").read_text(encoding="utf-8")
    for code, (name, _, _) in meanings.ERRORS.items():
        assert f">{code}<" in re.sub(r"</?(span|code|p)[^>]*>", "", page)
        assert name in page


@pytest.mark.slow
@SITE
@pytest.mark.long
def test_the_top_leads_to_the_first_page(site: Path) -> None:
    assert "host/docs/index.html" in (site / "index.html").read_text(encoding="utf-8")


# one word for each thing, in all names that users write


def public_names() -> Iterator[str]:
    """Names of the library, commands and options."""
    for name in armtempo.__all__:
        value = getattr(armtempo, name)
        inner = value.__all__ if inspect.ismodule(value) else vars(value) if inspect.isclass(value) else ()
        yield from (name, *(f"{name}.{one}" for one in inner if not one.startswith("_")))
    for name in COMMANDS:
        command = main.get_command(click.Context(main), name)
        assert command is not None
        yield from (name, *(f"{name} {option}" for one in command.params for option in one.opts))


def test_no_public_name_uses_another_word_for_the_same_thing() -> None:
    page = (ROOT / "host" / "docs" / "glossary.md").read_text(encoding="utf-8")
    rows = [line.strip("|").split("|") for line in page.splitlines() if line.startswith("| ")]
    assert len(rows) > 20
    others = {word.strip() for row in rows[1:] for word in row[2].split(",")} - {""}
    for name in public_names():
        words = re.split(r"[._ -]+", re.sub(r"([a-z])([A-Z])", r"\1_\2", name).lower())
        assert not others.intersection(words), name
