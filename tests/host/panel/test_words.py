"""The panel's texts, and texts from files and boards."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from armtempo.basics.errors import InputError
from armtempo.diagnosis.finding import Level
from armtempo.diagnosis.selftest.result import Measurement, SelfTest
from armtempo.link.board_messages import StoredMotion
from armtempo.model.job import Job
from armtempo.panel import layout, words
from armtempo.panel.panel_board import PanelBoard
from nicegui import ui

from tests.host.panel import fakes
from tests.host.panel.pages import pages

TABS = (words.TAB_MOVE, words.TAB_JOB, words.TAB_RUN, words.TAB_SEQUENCE, words.TAB_BOARD)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("remove its cause, then 'armtempo clear'", "remove its cause, then ‘Clear the fault’"),
        ("move it there with 'armtempo goto'", "move it there with ‘Go to the start’"),
        ("'armtempo list' shows the names", "‘Stored motions’ shows the names"),
        ("see 'armtempo help recovery'", "see 'armtempo help recovery' in a terminal"),
        ("see 'armtempo help recovery' in a terminal", "see 'armtempo help recovery' in a terminal"),
        ("nothing to do", "nothing to do"),
    ],
)
def test_commands_are_the_panels_buttons(text: str, wanted: str) -> None:
    assert words.of_text(text) == wanted


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("job.toml: refine = 'banana' is not allowed", "job.toml: ‘Segments’ = 'banana' is not allowed"),
        (
            "job.toml: via P1.blend_mm = 0 is not allowed",
            "job.toml: via P1.‘Corner cut by, mm’ = 0 is not allowed",
        ),
        ("no motion along this path is shorter", "no motion along this path is shorter"),
        ("the stop at P1 is 5 s", "the stop at P1 is 5 s"),
        ("not valid TOML (at line 1, column 10)", "not valid TOML (at line 1, column 10)"),
    ],
)
def test_keys_are_the_panels_fields(text: str, wanted: str) -> None:
    assert words.of_job(text) == wanted


def test_keys_of_steps_are_the_panels_fields() -> None:
    said = "day.toml: step[12].to = 'x' is not allowed; go to 'home'; give wait_s or on_timeout"
    shown = "day.toml: step[12].‘to’ = 'x' is not allowed; go to 'home'; give ‘wait, s’ or ‘then’"
    assert words.of_sequence(said) == shown
    assert words.of_sequence("step[2].output = 'x'") == "step[2].‘set output’ = 'x'"


def test_what_turns_the_direction_of_a_line_is_seen() -> None:
    assert words.plain("a\u202eb\x1b\u200bc 'ü' <b>") == "a□b□□c 'ü' <b>"


def test_texts_are_no_properties() -> None:
    """A string of properties is code: a name in it could leave its quotes. ``look`` and icons are the panel's own."""
    allowed = {"look", "len(self.holds)", "icon"}
    for path in Path(layout.__file__).parent.glob("*.py"):
        for call in ast.walk(ast.parse(path.read_text())):
            if not (isinstance(call, ast.Call) and getattr(call.func, "attr", "") == "props"):
                continue
            for part in ast.walk(call):
                if isinstance(part, ast.FormattedValue) and not isinstance(part.value, ast.IfExp):
                    assert ast.unparse(part.value) in allowed, f"{path.name}: {ast.unparse(part)}"


def _texts(value: object) -> Iterator[str]:
    """All texts in a value of any depth."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        yield from (text for one in value.values() for text in _texts(one))
    elif isinstance(value, list | tuple):
        yield from (text for one in value for text in _texts(one))


def test_names_from_files_and_boards_turn_no_line_on_any_tab(operator: PanelBoard) -> None:
    name = 'j"\u202e<b>\x1b'  # an arm file with such a name is refused
    operator.live.state = fakes.board_state(arm=name, fault=name, port=name)
    operator.log.add([name])
    operator.tested = SelfTest(name, True, 0, [Measurement(name, name, name, name, Level.ERROR, name)])
    operator.board.stored[:] = [StoredMotion(name, 100, 1, 0, 3, False)]  # type: ignore[attr-defined]
    folder = operator.jobs.folder
    for job in ("job", name):
        (folder / f"{job}.toml").write_text('name = "feed"\nvia_deg = [[0, -60, 40], [20, -75, 50]]\n')
    for sequence in ("all", f"all{name}"):
        (folder / f"{sequence}.toml").write_text('name = "all"\n[[step]]\nrun = "job.toml"\n')
    operator.sequences.open("all.toml")
    operator.jobs.open("job.toml")
    operator.jobs.set_option("path", name)
    operator.jobs.set_key(0, "frame", name)
    (operator.runs / name).mkdir(parents=True)
    (operator.runs / name / "run.json").write_text("{}")
    with pages(operator) as page:
        for tab in TABS:
            page.show(tab)
            page.look()
        page.press(words.RENAME)
        page.press(words.CLEAR)
        page.done()
        shown = [*map(str, layout.message(operator, page.of.shape)["texts"].values())]
        for element in page.elements():
            found = [str(getattr(element, "text", "")), *_texts(element.props)]
            assert not any("\u202e" in one or "\x1b" in one for one in found), (element, found)
            shown += found
        assert {'j"□<b>□.toml', 'allj"□<b>□.toml', 'j"□<b>□'} <= set(shown)


def test_a_file_whose_name_cannot_be_shown_is_refused_for_that(operator: PanelBoard) -> None:
    text = 'name = "feed"\nvia_deg = [[0, -60, 40], [20, -75, 50]]\n'
    (operator.jobs.folder / "j\u202e.toml").write_text(text)
    with pytest.raises(InputError, match=r"file's name has the character U\+202E.*rename the file"):
        operator.jobs.open("j\u202e.toml")
    with pytest.raises(InputError, match=r"path has the character U\+202E.*rename the file"):
        Job.load(str(operator.jobs.folder / "j\u202e.toml"), fakes.ARM)


def test_each_command_that_the_panel_has_a_button_for_is_that_button(operator: PanelBoard) -> None:
    cures = " or ".join(f"'armtempo {command} --more'" for command in words.COMMANDS)
    operator.live.state = fakes.board_state(fault="estop", arm_problem=cures)
    operator.tested = SelfTest("id", True, 0, [Measurement("pulses", "w", "1", "2", Level.ERROR, cures)])
    with pages(operator) as page:
        for trouble in ("", cures):
            if trouble:
                operator._tell(trouble)
            for tab in TABS:
                page.show(tab)
                page.look()
            shown = [*layout.message(operator, page.of.shape)["texts"].values()]
            for element in page.elements():
                shown += [str(getattr(element, "text", "")), *_texts(element.props)]
            left = [text for text in shown if re.search(rf"armtempo ({'|'.join(words.COMMANDS)})", text)]
            assert left == []
            assert any(f"‘{words.CLEAR}’" in text for text in shown)


def test_commands_in_errors_are_quoted() -> None:
    """The panel finds no others. Those of the command line's own package are not the panel's."""
    bare = re.compile(rf"(?<!')(?<!an )\barmtempo ({'|'.join(words.COMMANDS)})\b")
    package = Path(layout.__file__).parent.parent
    found = []
    for path in package.rglob("*.py"):
        if "cli" in path.relative_to(package).parts or not bare.search(text := path.read_text()):
            continue
        for call in ast.walk(ast.parse(text)):
            if isinstance(call, ast.Call) and ast.unparse(call.func).endswith("Error"):
                texts = [part.value for part in ast.walk(call) if isinstance(part, ast.Constant)]
                found += [(path.name, one) for one in texts if bare.search(str(one))]
    assert found == []


def test_hints_are_found_by_the_elements_own_number(operator: PanelBoard) -> None:
    """Quasar looks for the element of a hint by the id that NiceGUI gives it."""
    with pages(operator) as page:
        for tab in TABS:
            page.show(tab)
        targets = {str(hint.props["target"]) for hint in page.elements(ui.tooltip) if "target" in hint.props}
        assert targets
        assert not [one for one in page.elements() if "id" in one.props and f"#{one.html_id}" in targets]
