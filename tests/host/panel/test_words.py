"""The panel's texts, and texts from files and boards."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
from armtempo.panel import layout, words
from armtempo.panel.panel_board import PanelBoard
from nicegui import ui

from tests.host.panel import fakes
from tests.host.panel.pages import pages


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("remove its cause, then 'armtempo clear'", "remove its cause, then ‘Clear the fault’"),
        ("move it there with 'armtempo goto'", "move it there with ‘Go to the start’"),
        ("'armtempo list' shows the names", "‘Stored motions’ shows the names"),
        ("see 'armtempo help recovery'", "see 'armtempo help recovery' in a terminal"),
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
    ],
)
def test_keys_are_the_panels_fields(text: str, wanted: str) -> None:
    assert words.of_job(text) == wanted


def test_what_turns_the_direction_of_a_line_is_seen() -> None:
    assert words.plain("a\u202eb\x1b\u200bc 'ü' <b>") == "a□b□□c 'ü' <b>"


def test_texts_are_no_properties() -> None:
    """A string of properties is code: a name in it could leave its quotes. ``look`` and icons are the panel's own."""
    allowed = {"look", "len(self.holds)", "number + 1", "icon"}
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
    (operator.runs / name).mkdir(parents=True)
    (operator.runs / name / "run.json").write_text("{}")
    with pages(operator) as page:
        for tab in (words.TAB_MOVE, words.TAB_JOB, words.TAB_RUN, words.TAB_SEQUENCE, words.TAB_BOARD):
            page.show(tab)
            page.look()
        page.press(words.CLEAR)
        page.done()
        shown = [*map(str, layout.message(operator, page.of.shape)["texts"].values())]
        for element in page.elements():
            found = [str(getattr(element, "text", "")), *_texts(element.props)]
            assert not any("\u202e" in one or "\x1b" in one for one in found), (element, found)
            shown += found
        assert any('j"□<b>□' in text for text in shown)


def test_hints_are_found_by_the_elements_own_number(operator: PanelBoard) -> None:
    """Quasar looks for the element of a hint by the id that NiceGUI gives it."""
    with pages(operator) as page:
        for tab in (words.TAB_MOVE, words.TAB_JOB, words.TAB_RUN, words.TAB_SEQUENCE, words.TAB_BOARD):
            page.show(tab)
        targets = {str(hint.props["target"]) for hint in page.elements(ui.tooltip) if "target" in hint.props}
        assert targets
        assert not [one for one in page.elements() if "id" in one.props and f"#{one.html_id}" in targets]
