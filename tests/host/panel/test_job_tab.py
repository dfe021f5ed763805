"""The job's table: what is typed is taken, and stays, whatever changes in other fields."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from typing import Any

import pytest
from armtempo.panel import job_editor, job_tab, words
from armtempo.panel.panel_board import PanelBoard
from nicegui import ui

from tests.host.panel.fakes import board_state
from tests.host.panel.pages import Page, pages

POSES = """name = "poses"
[[via]]
position_mm = [300, 0, 200]

[[via]]
position_mm = [310, 0, 210]

[[via]]
angles_deg = [10, -60, 40]
"""


def opened(page: Page, text: str = POSES) -> None:
    """The tab with a job of the folder."""
    page.operator.live.state = board_state()
    (page.operator.jobs.folder / "poses.toml").write_text(text)
    page.operator.jobs.open("poses.toml")
    page.show(words.TAB_JOB)
    page.look()


def test_a_file_that_another_program_writes_is_shown_but_takes_the_place_of_no_changes(
    operator: PanelBoard,
) -> None:
    jobs = operator.jobs
    with pages(operator) as page:
        opened(page)
        file = jobs.folder / "poses.toml"
        for number, other in enumerate((POSES.replace("310", "320"), "name = 'a file that is half", POSES)):
            file.write_text(other)
            os.utime(file, ns=(number, number))
            page.act(page.of.refresh)
            page.look()
            is_read = other.startswith('name = "poses"')
            assert (jobs.text == other) == is_read
            assert page.named(words.READ_AGAIN).visible == (not is_read)
        jobs.set_key(1, "dwell_s", "0.7")
        file.write_text(POSES.replace("310", "330"))
        os.utime(file, ns=(9, 9))
        page.act(page.of.refresh)
        assert "dwell_s = 0.7" in jobs.text
        page.press(words.READ_AGAIN)
        page.answer(words.LOSE)
        page.look()
        assert jobs.text == POSES.replace("310", "330")
        assert not page.named(words.READ_AGAIN).visible


def test_changes_that_are_not_saved_are_not_lost_without_a_question(operator: PanelBoard) -> None:
    jobs = operator.jobs
    with pages(operator) as page:
        opened(page)
        (jobs.folder / "other.toml").write_text(POSES.replace("310", "320"))
        page.look()
        jobs.set_key(1, "dwell_s", "0.7")
        files = page.named(words.JOB_FILE)
        page.act(lambda: files.set_value("other.toml"))
        assert (files.value, "dwell_s = 0.7" in jobs.text) == ("poses.toml", True)
        page.answer(words.LOSE)
        page.look()
        assert (files.value, jobs.file) == ("other.toml", jobs.folder / "other.toml")


def type_into(page: Page, name: str, text: str, left: bool = True) -> Any:
    """Type into a field, and leave it or not; the field."""
    box = page.named(name)
    page.fire(box, "update:value", text)
    if left:
        page.fire(box, "change", text)
    return box


def test_what_is_being_typed_stays_when_another_field_changes(operator: PanelBoard) -> None:
    """The next field is typed into before the last one is taken; so it is whatever else changes the job meanwhile."""
    with pages(operator) as page:
        opened(page)
        page.fire(page.named(f"{words.MORE} P1"), "click", {})
        typed = type_into(page, "P2 joint 1", "1", left=False)
        for change in (
            lambda: type_into(page, "P2 joint 2", "-61"),
            lambda: page.named(words.OPTIONS["path"]).set_value("through"),
            lambda: type_into(page, f"P1: {words.VIA_KEYS['dwell_s']}", "0.5"),
            lambda: operator.jobs.set_key(1, "dwell_s", "0.7"),  # of another page
        ):
            change()
            page.look()
            assert page.named("P2 joint 1") is typed
            assert typed.value == "1"
        page.fire(typed, "change", "12")
        assert operator.jobs.vias[2].angles_deg == pytest.approx((12.0, -61.0, 40.0))


def test_a_page_without_control_changes_nothing_in_the_job(operator: PanelBoard) -> None:
    with pages(operator) as page:
        opened(page, POSES)
        before = operator.jobs.text
        operator.take_control("another page")
        page.fire(page.named(words.NEW_VIA), "click", {})
        type_into(page, "P2 joint 1", "7")
        assert operator.jobs.text == before
        operator.take_control(page.client.id)
        page.fire(page.named(words.NEW_VIA), "click", {})
        assert operator.jobs.text != before


def test_no_page_waits_while_poses_are_searched_for(
    operator: PanelBoard, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file that is opened, a pose that is typed, another posture in the picture."""
    asked: list[str] = []

    def watched(call: Callable[..., Any], name: str) -> Callable[..., Any]:
        def seen(*given: Any) -> Any:
            assert threading.current_thread() is not threading.main_thread()
            asked.append(name)
            return call(*given)

        return seen

    for module, name in ((job_editor.planner, "via_angles"), (job_tab, "moved_tool_deg")):
        monkeypatch.setattr(module, name, watched(getattr(module, name), name))
    with pages(operator) as page:
        (operator.jobs.folder / "poses.toml").write_text(POSES)
        page.show(words.TAB_JOB)
        page.act(lambda: page.named(words.JOB_FILE).set_value("poses.toml"))
        assert asked
        page.look()
        cell = page.named("P1 joint 1")
        assert cell.value
        page.fire(page.named(f"{words.MORE} P1"), "click", {})
        before = cell.value
        type_into(page, f"P1: {words.VIA_KEYS['position_mm']}", "[310, 10, 210]")
        assert page.named("P1 joint 1").value not in ("", before)
        page.act(lambda: page.of.scene.picked(1))
        assert any("postures that reach it" in text for text in page.texts())
        assert {*asked} == {"via_angles", "moved_tool_deg"}


def test_a_switch_that_shows_the_file_again_does_not_change_it(operator: PanelBoard) -> None:
    text = POSES.replace("[310, 0, 210]", "[310, 0, 210]\nstop = false")
    with pages(operator) as page:
        opened(page, text)
        page.fire(page.named(f"{words.MORE} P1"), "click", {})
        page.named(f"P1: {words.VIA_KEYS['stop']}").set_value(True)
        assert operator.jobs.vias[1].text("stop") == "true"
        operator.jobs.undo()
        page.look()
        assert operator.jobs.text == text


def test_what_is_being_typed_stays_when_a_wrong_text_beside_it_is_put_right(operator: PanelBoard) -> None:
    with pages(operator) as page:
        opened(page, 'name = "poses"\nvia_deg = [[0.0, -60.0, 40.0], [20.0, -75.0, 50.0]]\n')
        type_into(page, "P0 joint 1", "no angle")
        page.look()
        typed = type_into(page, "P0 joint 2", "-6", left=False)
        type_into(page, "P0 joint 1", "5")
        page.look()
        assert typed.value == "-6"


def test_fields_show_what_has_changed(operator: PanelBoard) -> None:
    with pages(operator) as page:
        opened(page)
        page.fire(page.named(f"{words.MORE} P1"), "click", {})
        before = page.named("P1 joint 2").value
        operator.jobs.set_key(1, "position_mm", "[310, 0, 260]")
        operator.jobs.set_key(1, "dwell_s", "0.5")
        operator.jobs.set_option("path", "through")
        page.look()
        assert page.named("P1 joint 2").value != before  # the pose has other angles
        assert page.named(f"P1: {words.VIA_KEYS['dwell_s']}").value == "0.5"
        assert page.named(words.OPTIONS["path"]).value == "through"
        operator.jobs.delete(2)
        page.look()
        assert not [one for one in page.elements() if one.props.get("aria-label") == "P2 joint 1"]


@pytest.mark.parametrize(
    ("tab", "button", "said"),
    [
        (words.TAB_JOB, words.SAVE, "‘Segments’ = 'banana' is not allowed"),
        (words.TAB_JOB, words.PLAN, "‘Segments’ = 'banana' is not allowed"),
        (words.TAB_SEQUENCE, words.SAVE, "step[1].‘wait, s’ = 'banana' is not allowed"),
    ],
)
def test_a_wrong_value_is_told_in_the_name_of_its_field(
    operator: PanelBoard, monkeypatch: pytest.MonkeyPatch, tab: str, button: str, said: str
) -> None:
    """Whatever button finds it."""
    shown: list[str] = []
    monkeypatch.setattr(ui, "notify", lambda text, **_: shown.append(text))
    (operator.jobs.folder / "day.toml").write_text('name = "day"\n[[step]]\nwait_s = 1\n')
    operator.sequences.open("day.toml")
    with pages(operator) as page:
        if tab == words.TAB_JOB:
            opened(page)
            operator.jobs.set_option("refine", "banana")
        else:
            page.show(tab)
            operator.sequences.set(0, "wait_s", "banana")
        page.look()
        page.press(button)
        assert said in shown[-1]
