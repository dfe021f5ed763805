"""Work with the panel in a real browser, on a virtual board in real time: runs, sequences, targets."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import pytest

from tests.system import commandline, panels
from tests.system.panel.files import DAY, MARKUP, open_sequence, show, undo_all
from tests.system.panels import Panel, home, press, wait_for

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("panel")]


_LONG = "tray" + 30 * "-long"
"""The name of a posture, for which no part of a page may be too narrow."""
_SHIFTS = """begin => new Promise(resolve => {
  let [most, sum, first, last] = [0, 0, -1e9, -1e9];
  new PerformanceObserver(list => list.getEntries().forEach(one => {
    if (one.hadRecentInput || one.startTime < begin) return;
    if (one.startTime - last > 1000 || one.startTime - first > 5000) [sum, first] = [0, one.startTime];
    last = one.startTime;
    most = Math.max(most, sum += one.value);
  })).observe({type: 'layout-shift', buffered: true});
  setTimeout(() => resolve(most), 200);
})"""
"""How much jumped on the page at once, as browsers count it: within 5 s without a second of rest; 0.1 is too much."""


def test_the_whole_way(page: Any, panel: Panel) -> None:
    """Home, plan, run, pause, resume, stop, begin again, report."""
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    runs = panel.folder / "runs"
    before = {path.name for path in runs.glob("feed-*")}
    home(page)
    show(page, "Board")
    jogs = page.inner_text(".nicegui-log").count("jog")
    # No buttons
    page.evaluate("[1e9, -1, true, 'x', null, [1], {}].forEach(one => emitEvent('armtempo-press', one))")
    page.evaluate("window.socket.emit('event', {id: 'x', client_id: 'x', listener_id: 5, args: []})")
    show(page, "Job")
    undone = undo_all(page)  # what a test before has changed: the table jumps with it
    begin_ms = page.evaluate("performance.now()") if undone else 0.0
    press(page, page.get_by_role("button", name="Plan", exact=True))
    page.wait_for_selector("text=Motion time 6.79")
    show(page, "Run")
    page.wait_for_selector("text=/feed: 6.79. s · job.toml/")
    # Of 128, 3 %: minutes, so that the stop is in time
    press(
        page,
        slider := page.get_by_role("slider", name="Speed", exact=True),
        lambda: slider.click(position={"x": 4, "y": 10}),
    )
    press(page, page.get_by_role("button", name="Run", exact=True))
    wait_for(page, "moving", "at ", "Run")
    press(page, page.get_by_role("button", name="Pause"))
    wait_for(page, "paused", "Run")
    press(page, page.get_by_role("button", name="Resume"))  # on along the path
    page.wait_for_function("!document.getElementById('armtempo-state').textContent.includes('paused')")
    # joint 1
    page.wait_for_function(
        "parseFloat(document.getElementById('armtempo-where').textContent.split('·').at(-1)) > 0"
    )
    page.keyboard.press(" ")  # the button just pressed has the focus, and does not take it
    wait_for(page, "idle")
    joints = panels.rest(panel.state).joints
    panels.wait_for(page, *(f"{joint.angle_deg:.2f}°" for joint in joints), place="armtempo-where")
    assert 0.0 < (joints[0].angle_deg or 0.0) < 180.0
    commandline.run("speed", "100", "--port", panel.port, folder=panel.folder)  # by another program
    page.wait_for_function(
        "document.querySelector('.armtempo-dock .armtempo-percent').textContent == '100 %'"
    )
    page.wait_for_selector('[role=slider][aria-label="Speed"][aria-valuenow="100"]')
    press(page, page.get_by_role("button", name="Go to the start"))  # after a stop a motion only begins anew
    commandline.wait_for(lambda: abs(panels.rest(panel.state).joints[0].angle_deg or 0.0) < 0.05, "the start")
    press(page, page.get_by_role("button", name="Run", exact=True))
    wait_for(page, "moving")
    wait_for(page, "idle")  # a report is of a whole run
    stopped, whole = sorted({path.name for path in runs.glob("feed-*")} - before)
    for run, text in ((whole, "joint 1"), (MARKUP, "of another arm")):
        with page.expect_popup() as popup:
            page.get_by_role("link", name=f"Report: {run}").click()
        popup.value.wait_for_selector(f"text={text}")
        assert popup.value.title() != "hurt"
        popup.value.close()  # a page that is hidden is not drawn
    for run in (stopped, whole):
        page.get_by_role("checkbox", name=f"Compare: {run}").click()
    with page.expect_popup() as popup:
        page.get_by_role("link", name="Compare", exact=True).click()
    popup.value.wait_for_selector(f"text={stopped}")
    popup.value.close()
    show(page, "Board")
    page.wait_for_selector(".nicegui-log >> text=Stop: the arm brakes along its path.")
    assert page.inner_text(".nicegui-log").count("jog") == jogs
    assert page.evaluate(_SHIFTS, begin_ms) < 0.1
    assert not errors


def test_a_sequence_is_edited_saved_and_run(page: Any, panel: Panel) -> None:
    home(page)
    show(page, "Sequence")
    open_sequence(page, "day.toml", "step 2: wait, s")
    page.evaluate("emit = socket.emit; socket.emit = () => {}")  # as if the connection broke just now
    page.get_by_label("step 2: wait, s").fill("8")
    page.get_by_label("step 2: wait, s").press("Tab")
    page.evaluate("socket.emit = emit; socket.io.engine.close()")
    page.wait_for_function("document.querySelector('[aria-label=\"step 2: wait, s\"]').value == '9'")
    page.get_by_label("step 2: wait, s").fill("600")
    page.get_by_label("step 2: wait, s").press("Tab")
    assert page.get_by_label("step 2: wait, s").input_value() == "600"
    press(page, page.get_by_role("button", name="Save", exact=True))
    page.wait_for_selector("text=Saved")
    assert (panel.folder / "day.toml").read_text() == DAY.replace("9", "600")
    press(page, page.get_by_role("button", name="Run", exact=True))
    page.wait_for_selector(".armtempo-lit:has-text('2')")
    page.get_by_role("button", name="Stop", exact=True).click()
    page.wait_for_selector("text=stopped: step 2 of cycle 1")
    assert page.locator(".armtempo-lit").count() == 0


def test_a_target_is_shown_then_approached_while_held_and_postures_are_stored(
    page: Any, panel: Panel
) -> None:
    home(page)
    place = panels.place(panel.state)
    away = page.get_by_role("button", name="Go to away")
    press(page, away, lambda: away.click())  # it is only shown
    page.wait_for_function("armtempo.ghost")
    page.wait_for_timeout(1000)
    assert panels.place(panel.state) == place
    page.get_by_role("switch", name="With one click").click()
    press(page, away, lambda: away.click())
    wait_for(page, "away: done", place="armtempo-said")
    wait_for(page, "30.0", place="armtempo-where")
    page.get_by_role("switch", name="With one click").click()
    page.get_by_role("button", name="1", exact=True).click()
    plus = page.get_by_label("joint 1 +")
    press(page, plus, lambda: plus.click())
    wait_for(page, "step: done", place="armtempo-said")
    wait_for(page, "31.0", place="armtempo-where")
    page.get_by_role("button", name="While held").click()
    page.get_by_role("button", name="Store…").click()
    page.get_by_role("dialog").get_by_label("Name").fill(_LONG)
    panels.answer(page, "Store")
    page.get_by_role("button", name=f"Go to {_LONG}").wait_for()
    assert f"[posture.{_LONG}]\nangles_deg = [31" in (panel.folder / "arm.toml").read_text()
    page.get_by_role("button", name="Guide by hand…").click()
    panels.answer(page, "Guide by hand…")
    wait_for(page, "unhomed", "Guide by hand")
    wait_for(page, "31.", place="armtempo-where")  # the encoders tell
    panels.answer(page, "Hold it again")
    wait_for(page, "Guide by hand: done", place="armtempo-said")
    wait_for(page, "idle")
    page.reload()
    page.wait_for_selector("text=In control")  # as before


_FREEZES = """() => {
  const button = document.querySelector('.armtempo-freeze');
  const offered = button.checkVisibility();
  if (offered) button.click();
  return offered;
}"""


@pytest.mark.long  # a busy browser does not hold a jog for long enough; tests/host/panel has the button's state
def test_an_arm_that_still_brakes_is_frozen_by_the_button_that_appears_then(page: Any, panel: Panel) -> None:
    """From full speed it brakes for 1.3 s; tried again if a busy browser was late."""
    freeze = page.locator(".armtempo-freeze")
    home(page)
    speed = page.get_by_role("slider", name="Speed of jogs and targets", exact=True)
    speed.click(position={"x": speed.bounding_box()["width"] - 1, "y": 10})
    for _ in range(20):
        home(page)  # far from the end of its range
        panels.hold(page)
        page.wait_for_timeout(1500)  # nearly at full speed
        assert not freeze.is_visible()
        page.keyboard.press("Escape")
        page.mouse.up()
        with suppress(Exception):  # a time-out: it rested before
            page.wait_for_function(_FREEZES, polling=20, timeout=3000)
            wait_for(page, "The outputs were frozen: steps may be lost", place="armtempo-said", within_s=3)
            break
        wait_for(page, "idle")
    else:
        raise AssertionError("it could not be frozen")
    freeze.wait_for(state="hidden")
