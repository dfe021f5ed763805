"""The sequence that is edited."""

from __future__ import annotations

import asyncio
import time
from pathlib import Path

import numpy as np
import pytest
from armtempo import pipeline
from armtempo.basics.errors import InputError
from armtempo.basics.progress import Progress
from armtempo.link.board_messages import SequenceState
from armtempo.panel import panel_page, words
from armtempo.panel.panel_board import PanelBoard
from armtempo.panel.sequence_editor import SequenceEditor
from nicegui import ui
from nicegui.events import ClickEventArguments, handle_event

from tests.host.panel.fakes import ARM, board_state
from tests.host.panel.pages import pages

SEQUENCE = """# all day
name = "day"  # its name

[[step]]
repeat = 2  # twice

# the tray
[[step]]
goto = [10, -60, 40]

[[step]]
wait_s = 0.5  # it settles

[[step]]
end = "repeat"
"""


@pytest.fixture
def steps(tmp_path: Path) -> SequenceEditor:
    (tmp_path / "day.toml").write_text(SEQUENCE)
    (tmp_path / "job.toml").write_text('name = "feed"\nvia_deg = [[0, -60, 40], [20, -75, 50]]\n')
    (tmp_path / "damaged.toml").write_text("[[step")
    desk = SequenceEditor(ARM, tmp_path)
    assert desk.files() == ["damaged.toml", "day.toml"]
    with pytest.raises(InputError, match="damaged"):
        desk.open("damaged.toml")
    desk.open("day.toml")
    return desk


def test_steps_are_edited_and_comments_stay(steps: SequenceEditor) -> None:
    steps.set(0, "repeat", "for ever")
    steps.set(1, "goto", "[12.5, -60, 40]")
    steps.move(2, -1)
    steps.move(0, -1)  # it is the first
    steps.add(1)
    steps.set_kind(1, "wait_s")
    steps.set(1, "wait_s", "0.25")
    file = steps.save()
    text = file.read_text()
    assert text.index("# it settles") < text.index("# the tray")  # each goes with its step
    assert steps.depths == [0, 1, 1, 1, 0]
    for comment in ("# all day", "# its name", "# twice", "# the tray", "# it settles"):
        assert comment in text
    steps.open("day.toml")
    assert steps.steps == [
        {"repeat": "for ever"},
        {"wait_s": "0.25"},
        {"wait_s": "0.5"},
        {"goto": "[12.5, -60, 40]"},
        {"end": "repeat"},
    ]
    steps.delete(0)
    steps.delete(3)
    assert len(steps.sequence().steps) == 3


def test_steps_that_are_no_sequence_are_not_saved(steps: SequenceEditor) -> None:
    steps.delete(3)
    with pytest.raises(InputError, match="repeat without an end"):
        steps.save()
    assert steps.file is not None
    assert steps.file.read_text() == SEQUENCE
    steps.undo()
    assert steps.text == SEQUENCE
    steps.copy(1)
    assert steps.steps[1] == steps.steps[2] == {"goto": "[10, -60, 40]"}
    steps.new("fresh")
    assert steps.save().name == "fresh.toml"
    assert steps.files() == ["damaged.toml", "day.toml", "fresh.toml"]
    with pytest.raises(InputError, match="no such sequence"):
        steps.open("../day.toml")


@pytest.mark.parametrize(
    ("ending", "cycle", "said"),
    [("running", 0, "running: step 2 of cycle 1"), ("finished", 2, "finished: 2 whole cycles")],
)
def test_cycles_are_counted_from_one(operator: PanelBoard, ending: str, cycle: int, said: str) -> None:
    operator.live.sequence = SequenceState(ending, 0, 2, 1, cycle, "day")
    with pages(operator) as page:
        page.show(words.TAB_SEQUENCE)
        assert said in page.texts()


def test_another_kind_of_a_step_builds_its_row_alone_anew(operator: PanelBoard, tmp_path: Path) -> None:
    """In the others a list may be open, which would close."""
    (tmp_path / "day.toml").write_text(SEQUENCE)
    operator.sequences.open("day.toml")
    with pages(operator) as page:
        page.show(words.TAB_SEQUENCE)
        kinds = [page.named(f"{words.STEP} {number}") for number in (1, 2, 3, 4)]
        kinds[2].set_value("output")
        page.look()
        again = [page.named(f"{words.STEP} {number}") for number in (1, 2, 3, 4)]
        assert [one is other for one, other in zip(kinds, again, strict=True)] == [True, True, False, True]
        assert page.named(f"step 3: {words.STEP_KEYS['to']}").value == ""
        page.act(lambda: [connected() for connected in page.client.connect_handlers])
        assert page.named(f"{words.STEP} 1") is kinds[0]


def test_what_is_typed_on_into_a_step_that_was_just_taken_stays(operator: PanelBoard, tmp_path: Path) -> None:
    (tmp_path / "day.toml").write_text(SEQUENCE)
    operator.sequences.open("day.toml")
    with pages(operator) as page:
        page.show(words.TAB_SEQUENCE)
        typed = page.named("step 3: wait, s")
        for event, text in (("update:value", "7"), ("change", "7"), ("update:value", "7.5")):
            page.fire(typed, event, text)
        page.look()
        assert typed.value == "7.5"
        page.fire(typed, "change", "7.5")
    assert operator.sequences.steps[2]["wait_s"] == "7.5"


def test_what_is_being_typed_into_a_step_stays_when_another_changes(
    operator: PanelBoard, tmp_path: Path
) -> None:
    operator.live.state = board_state()
    (tmp_path / "day.toml").write_text(SEQUENCE)
    operator.sequences.open("day.toml")
    with pages(operator) as page:
        page.show(words.TAB_SEQUENCE)
        typed = page.named("step 3: wait, s")
        page.fire(typed, "update:value", "7")
        operator.sequences.set(0, "repeat", "5")  # on another page
        page.look()
        assert page.named("step 1: repeat").value == "5"
        assert page.named("step 3: wait, s") is typed
        assert typed.value == "7"


def test_a_press_on_a_step_that_is_just_gone_says_so(
    operator: PanelBoard, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its page is built anew a moment later."""
    said: list[str] = []
    monkeypatch.setattr(panel_page, "_say", lambda error: said.append(error.problem))
    (tmp_path / "day.toml").write_text(SEQUENCE)
    operator.sequences.open("day.toml")
    with pages(operator) as page:
        page.show(words.TAB_SEQUENCE)
        late = [page.named(f"{text} {words.STEP} 4") for text in (words.UP, words.COPY, words.DELETE)]
        typed = page.named("step 4: end of")
        operator.sequences.delete(3)
        before = operator.sequences.text
        for button in late:
            page.press_one(button)
        page.fire(typed, "change", "loop")
        assert said == [words.ROW_GONE] * 4
        assert operator.sequences.text == before


def test_a_page_without_control_changes_nothing_in_a_sequence(operator: PanelBoard, tmp_path: Path) -> None:
    (tmp_path / "day.toml").write_text(SEQUENCE)
    operator.sequences.open("day.toml")
    with pages(operator) as page:
        page.show(words.TAB_SEQUENCE)
        operator.take_control("another page")
        page.fire(page.named("step 3: wait, s"), "change", "7")
        page.named(f"{words.STEP} 3").set_value("goto")
        assert operator.sequences.text == SEQUENCE


def test_planning_is_seen_and_not_begun_twice(
    operator: PanelBoard, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "day.toml").write_text(SEQUENCE)
    operator.sequences.open("day.toml")
    during: list[str] = []
    with pages(operator) as page:
        page.show(words.TAB_SEQUENCE)
        buttons = [words.PLAN, words.RUN]

        def plan(*_: object) -> None:
            during.extend([*page.texts(), *(str(page.named(one).enabled) for one in buttons)])
            raise InputError("no plan", "change it")

        monkeypatch.setattr("armtempo.pipeline.plan_sequence", plan)
        page.press(words.PLAN)
        assert during[-2:] == ["False", "False"]
        assert page.named(words.PLAN).enabled


def test_stop_does_not_wait_for_a_long_table(operator: PanelBoard) -> None:
    (operator.sequences.folder / "long.toml").write_text('name = "long"\n' + 40 * '[[step]]\ngoto = "home"\n')
    passes = []

    async def others() -> None:
        while True:
            passes.append(len(page.elements(ui.input)))
            await asyncio.sleep(0)

    with pages(operator) as page:
        page.show(words.TAB_SEQUENCE)
        operator.sequences.open("long.toml")
        task = page.loop.create_task(others())
        page.look()
        task.cancel()
        assert max(np.diff(passes)) < 10  # rows are built at once
        assert passes[-1] - passes[0] == 40
        assert page.named("step 40: go to").value == "home"


@pytest.mark.parametrize(("tab", "planner"), [(words.TAB_JOB, "plan"), (words.TAB_SEQUENCE, "plan_sequence")])
def test_a_planning_shows_how_far_it_is_and_is_cancelled(
    operator: PanelBoard, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, tab: str, planner: str
) -> None:
    (tmp_path / "day.toml").write_text(SEQUENCE)
    operator.sequences.open("day.toml")
    seen: list[object] = []
    with pages(operator) as page:
        page.show(tab)

        def plan(arm: object, what: object, progress: Progress) -> None:
            progress(1, 2)
            bar = page.elements(ui.linear_progress)[-1]
            (cancel,) = [one for one in page.elements(ui.button) if one.text == words.CANCEL and one.visible]
            seen.extend((bar.visible, bar.value))
            page.loop.call_soon_threadsafe(click, cancel)
            for _ in range(6000):
                time.sleep(0.01)
                progress(1, 2)

        def click(button: ui.button) -> None:
            for listener in button._event_listeners.values():
                with page.client:
                    handle_event(listener.handler, ClickEventArguments(sender=button, client=page.client))

        monkeypatch.setattr(pipeline, planner, plan)
        page.press(words.PLAN)
        assert seen == [True, 0.5]
        assert not page.elements(ui.linear_progress)[-1].visible
    assert operator.jobs.plan is operator.sequences.plan is None
