"""Presses that are still meant, and buttons that are held."""

from __future__ import annotations

import math
import time
from contextlib import nullcontext
from dataclasses import replace

import pytest
from armtempo.basics.errors import InputError
from armtempo.panel import words
from armtempo.panel.hold import ButtonHold
from armtempo.panel.panel_board import PanelBoard
from armtempo.panel.press import Press, Presses

from tests.host.panel.fakes import HELD_S, ME, OTHER, Clock, press, wait


@pytest.mark.parametrize(
    ("age_s", "meant"), [(0.0, True), (0.29, True), (0.31, False), (15.0, False), (-2.0, False)]
)
def test_a_press_that_comes_late_is_not_meant(age_s: float, meant: bool) -> None:
    """Nor one of the future: the server's machine slept."""
    clock = Clock()
    presses = Presses(lambda: "at rest", clock)
    press = Press(1, presses.state, clock.now_s)
    clock.now_s += age_s
    with nullcontext() if meant else pytest.raises(InputError, match="it arrived more than"):
        presses.take(ME, press)


def test_a_press_is_carried_out_once_in_order_and_in_the_state_that_it_was_made_in() -> None:
    state = ["at rest"]
    presses = Presses(lambda: state[0], Clock())
    first, second, third, fourth = (Press(n, presses.state, 100.0) for n in (1, 2, 3, 4))
    presses.take(ME, second)
    for late in (second, first):  # a second time, and after a later one
        with pytest.raises(InputError, match="arrived twice or out of order"):
            presses.take(ME, late)
    presses.take(OTHER, first)  # each page has numbers of its own
    presses.released(ME, 3)
    with pytest.raises(InputError, match="it was released"):
        presses.take(ME, third)
    state[0] = "moving"
    with pytest.raises(InputError, match="state changed"):
        presses.take(ME, fourth)


@pytest.mark.parametrize(
    "said",
    [
        None,
        5,
        {},
        {"number": 1, "state": 1, "made_s": None},
        {"number": 1.0, "state": 1, "made_s": 1.0},
        {"number": 1, "state": 1, "made_s": math.nan},
        {"number": 1, "state": True, "made_s": math.inf},
        {"number": 1, "state": 1, "made_s": "0"},
    ],
)
def test_what_is_no_press_is_refused(said: object) -> None:
    with pytest.raises(InputError, match="did not say when"):
        Press.of(said)


def test_a_held_button_moves_nothing_before_its_target_was_seen(operator: PanelBoard) -> None:
    hold, jog = ButtonHold(operator), operator.board.jog  # type: ignore[attr-defined]
    begun = press(operator)
    hold.press(ME, begun, "home", lambda: jog, after_s=1000.0)
    time.sleep(0.05)
    hold.release(ME, begun.number)
    wait(lambda: not operator.busy)
    assert not jog.held
    assert not jog.ended.is_set()


@pytest.mark.parametrize("how", ["released", "silent", "late", "other in control", "lost"])
def test_a_jog_ends_with_its_button(operator: PanelBoard, how: str) -> None:
    hold, jog = ButtonHold(operator), operator.board.jog  # type: ignore[attr-defined]
    begun = press(operator)
    hold.press(ME, begun, "jog", lambda: jog)
    begin_s = time.monotonic()
    wait(lambda: hold.alive(ME, replace(begun, made_s=operator.presses.clock())) or jog.held > 2)
    if how == "released":
        hold.release(ME, begun.number)
    elif how == "other in control":
        operator.take_control(OTHER)
    elif how == "lost":
        hold.lost(ME)
    while not jog.ended.is_set() and how != "silent":
        late_s = 9.0 if how == "late" else 0.0  # it was held nine seconds ago
        hold.alive(ME, replace(begun, made_s=operator.presses.clock() - late_s))
        time.sleep(0.01)
    wait(jog.ended.is_set)
    assert how not in ("silent", "late") or time.monotonic() - begin_s > HELD_S / 4
    wait(lambda: not operator.busy)
    assert (words.BROWSER_SILENT in operator.log.last[-1]) == (how in ("silent", "late"))


def test_a_release_that_overtakes_its_press_ends_it(operator: PanelBoard) -> None:
    hold, jog = ButtonHold(operator), operator.board.jog  # type: ignore[attr-defined]
    late = press(operator)
    hold.release(ME, late.number)
    with pytest.raises(InputError, match="it was released"):
        hold.press(ME, late, "jog", lambda: jog)
    assert not operator.busy
    assert not jog.held


def test_a_refused_press_of_a_watcher_ends_nobodys_jog(operator: PanelBoard) -> None:
    hold, jog = ButtonHold(operator), operator.board.jog  # type: ignore[attr-defined]
    begun = press(operator)
    hold.press(ME, begun, "jog", lambda: jog)
    wait(lambda: hold.alive(ME, replace(begun, made_s=operator.presses.clock())) or jog.held > 2)
    with pytest.raises(InputError):
        hold.press(OTHER, press(operator), "jog", lambda: jog)
    assert hold.held_by(ME)
    hold.release(ME, begun.number)
    wait(jog.ended.is_set)
