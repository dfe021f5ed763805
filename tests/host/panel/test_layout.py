"""What is in view on every tab: the board's, whatever the page has done."""

from __future__ import annotations

import asyncio
import itertools
import time
from dataclasses import asdict
from types import SimpleNamespace
from typing import Any

import pytest
from armtempo.panel import layout, words
from armtempo.panel.arm_scene import ArmShape
from armtempo.panel.panel_board import FREEZE_AFTER_S, PanelBoard
from nicegui import Client, ui
from nicegui.page import page as page_of

from tests.host.panel.fakes import ARM, Clock, board_state, press, unhomed
from tests.host.panel.pages import built, pages

TABS = (words.TAB_MOVE, words.TAB_JOB, words.TAB_RUN, words.TAB_SEQUENCE, words.TAB_BOARD)


@pytest.mark.parametrize("tab", TABS)
def test_the_speed_follows_the_board_on_every_tab(operator: PanelBoard, tab: str) -> None:
    operator.live.state = board_state()
    with pages(operator) as page:
        page.show(tab)
        slider: Any = page.named(words.SPEED_OF_MOTION)
        for percent in (30.0, 100.0):
            operator.live.state = board_state(speed_percent=percent)
            page.look()
            assert slider.value == percent
            assert f"{percent:g} %" in page.texts()


def test_a_speed_that_was_not_taken_goes_back_to_the_boards(
    operator: PanelBoard, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("armtempo.panel.layout.LEFT_S", -1.0)
    operator.live.state = board_state()
    with pages(operator) as page:
        page.press(words.SPEED_OF_MOTION, 40, "change", late_s=5.0)
        slider: Any = page.named(words.SPEED_OF_MOTION)
        page.fire(slider, "update:modelValue", 40)  # a browser says a little later where it was dragged
        assert slider.value == 40
        page.look()
        assert slider.value == 100.0
        assert "100 %" in page.texts()


def test_a_slider_that_is_dragged_stays_with_the_finger(operator: PanelBoard) -> None:
    operator.live.state = board_state()
    with pages(operator) as page:
        page.look()
        slider: Any = page.named(words.SPEED_OF_MOTION)
        page.fire(slider, "update:modelValue", 40)
        page.look()
        assert slider.value == 40


def test_a_page_that_is_loaded_again_shows_what_the_board_says(operator: PanelBoard) -> None:
    operator.live.state = board_state(speed_percent=21.0, moving=True)
    for _ in range(2):
        with pages(operator) as page:
            page.look()
            assert page.named(words.SPEED_OF_MOTION).value == 21.0
            assert page.named(words.PAUSE).enabled


@pytest.mark.parametrize("tab", TABS)
def test_pause_and_homing_follow_the_board_on_every_tab(operator: PanelBoard, tab: str) -> None:
    operator.live.state = unhomed()
    with pages(operator) as page:
        page.show(tab)
        assert words.FIRST_HOME in page.texts()
        assert not page.named(words.PAUSE).enabled
        operator.live.state = board_state(moving=True)
        page.look()
        assert words.FIRST_HOME not in page.texts()
        assert page.named(words.PAUSE).enabled


def test_freeze_is_offered_where_the_arm_does_not_rest_after_a_stop(
    operator: PanelBoard, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its button shows what each message to the pages says."""
    clock = Clock()
    times = SimpleNamespace(monotonic=clock, strftime=time.strftime)
    monkeypatch.setattr("armtempo.panel.panel_board.time", times)

    def offered() -> object:
        return layout.message(operator, ArmShape(ARM))["freeze"]

    clock.now_s += 10 * FREEZE_AFTER_S  # nothing was stopped
    assert offered() is False
    operator.stop()
    clock.now_s += 0.9 * FREEZE_AFTER_S
    assert offered() is False
    clock.now_s += 0.2 * FREEZE_AFTER_S
    assert offered() is True
    operator.board.moves = False  # type: ignore[attr-defined]
    operator.stop()
    assert offered() is False


def test_a_motion_that_is_played_ends_in_time_or_when_it_is_stopped(operator: PanelBoard) -> None:
    with pages(operator) as page:
        shown: list[float] = []

        async def stopped() -> bool:
            task = asyncio.ensure_future(page.of.play(1e9, shown.append))
            await asyncio.sleep(0)
            assert page.of.is_playing
            page.of.stop_playing()
            return await task

        assert not page.loop.run_until_complete(stopped())
        assert not page.of.is_playing
        assert page.loop.run_until_complete(page.of.play(1e-3, shown.append))
        assert shown[0] < shown[-1] == 1e-3


def test_only_a_paused_motion_is_resumed(operator: PanelBoard) -> None:
    with pages(operator) as page:
        for percent in (50.0, 0.0):
            operator.live.state = board_state(moving=True, speed_percent=percent)
            page.look()
            assert page.named(words.PAUSE).enabled  # also a second time
            assert page.named(words.RESUME).enabled == (percent == 0.0)


def test_stops_of_other_pages_are_heard_while_a_page_is_built(operator: PanelBoard) -> None:
    """The loop is held for less than half of the elements at a time."""
    with pages(operator) as page:
        client, counts = Client(page_of("/")), [0]

        async def both() -> None:
            making = asyncio.ensure_future(built(client, operator))
            while not making.done():
                counts.append(len(client.elements))
                await asyncio.sleep(0)
            counts.append(len(client.elements))

        page.loop.run_until_complete(both())
        client.delete()
    assert max(after - before for before, after in itertools.pairwise(counts)) < counts[-1] / 2


def test_a_press_on_what_has_just_turned_grey_is_refused_with_the_reason(
    operator: PanelBoard, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The browser does not know yet that it is grey; without a word the person would wait for a dialog."""
    shown: list[str] = []
    monkeypatch.setattr(ui, "notify", lambda text, **_: shown.append(text))
    operator.live.state = board_state()
    with pages(operator) as page:
        page.look()
        operator.busy = words.JOG
        page.look()
        home: Any = page.named(words.HOMING)
        assert (home.enabled, home.is_ignoring_events) == (False, False)
        page.fire(home, "click", asdict(press(operator)), None, is_command=True)
        assert shown == [f"{words.BUSY.format(what=words.JOG)}; {words.WAIT}"]
        assert not page.elements(ui.dialog)
