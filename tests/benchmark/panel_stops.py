"""How soon the panel shows and stops the arm, and what watchers cost: ``python -m tests.benchmark.panel_stops``.

A held jog is ended twenty times each by its button, by closing its tab, by killing the browser, by killing the panel's
program and by cutting the cable: from then until the arm rests, by the board's clock. Then ten more pages watch an arm
of six joints: processor time of the panel's program while the arm moves, samples that were lost, and a hundred times
the time from the key press in a browser until the board has answered the stop. First view: from the begin of the
navigation, with an empty cache, until the page says where the arm is, and until it has drawn it. First step: from the
press of a jog button until the joint's first step, which comes later than the begin of the motion by its law, and of
Run with a motion that is planned, until the motion's clock begins. The board is a virtual one in real time.

Each line has the 95th percentile (p95). The aims, of 100 each on an idle machine: first step 100 ms, run 1000 ms, first
view 1500 ms (``--only first --only view --times 100``), the board's answer to a stop 30 ms (``--only watched``).
"""

from __future__ import annotations

import argparse
import ast
import asyncio
import math
import multiprocessing
import os
import re
import tempfile
import time
import urllib.request
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import numpy as np
from armtempo.link import board_messages
from armtempo.link.board_messages import Done, Fault, Sample
from armtempo.planning.jog import jog_motion
from armtempo.planning.jog.jog_motion import JogMove
from armtempo_shared import wire
from armtempo_shared.limits import TICK_HZ

from tests.benchmark.jogs import first_step_s
from tests.system import panels
from tests.system.panels import Panel, Panels
from tests.system.relay import Cable

HOWS = ("button", "tab", "browser", "server", "cable")
PARTS = [*HOWS, "first", "view", "watched"]
WATCHING = 10
_STOP = bytes((wire.COMMAND["stop"][1],))
_EVENTS = {wire.EVENT[name][1] for name in ("sample", "done", "fault")}
_PATIENCE_S = 60.0
_BEGINS_S = 10.0
"""A press that moves nothing for so long was refused."""
_SETTLED_MS = 500
"""A press is refused while the page does not know yet what has just changed."""


class Ear(Cable):
    """A cable from the board that notes what the board says."""

    def __init__(self) -> None:
        super().__init__()
        self._parser = wire.Parser()
        self.sample: tuple[float, Sample] | None = None
        """The last one, and when it came."""
        self.end: Done | Fault | None = None
        """Of the last motion; None while it moves."""
        self.stopped_s = 0.0
        """When the board answered a stop last."""
        self.began_s = 0.0
        """When the clock of the last motion began, by the first sample that was heard of it."""

    def __call__(self, data: bytes) -> tuple[bytes, float]:
        now_s = time.monotonic()
        self._parser.feed(data)
        while (frame := self._parser.next()) is not None:
            if frame.number == wire.EVENT["ok"][1] and frame.payload[:1] == _STOP:
                self.stopped_s = now_s
            elif frame.number in _EVENTS:
                event = board_messages.event(frame.number, frame.payload)
                if isinstance(event, Sample):
                    if self.end is not None or self.sample is None or self.sample[1].run != event.run:
                        self.began_s = now_s - event.ticks / TICK_HZ
                    self.sample, self.end = (now_s, event), None
                elif isinstance(event, Done | Fault):
                    self.end = event
        return super().__call__(data)

    def rest_s(self, begin_s: float, before: tuple[float, Sample]) -> float:
        """Seconds of the board's clock from ``begin_s`` until it rested; ``before``: the last sample before."""
        limit_s = time.monotonic() + _PATIENCE_S
        while self.end is None:
            assert time.monotonic() < limit_s, "the arm moves on"
            time.sleep(0.002)
        return (self.end.ticks - before[1].ticks) / TICK_HZ - (begin_s - before[0])


def moving(page: Any, ear: Ear) -> tuple[float, Sample]:
    """The last sample of a held jog; held again if it ended, as a busy browser was silent for too long."""
    for _ in range(20):
        panels.hold(page)
        limit_s = time.monotonic() + 5.0
        while time.monotonic() < limit_s:
            if ear.end is None and ear.sample is not None and ear.sample[1].index >= 3:
                return ear.sample
            time.sleep(0.01)
        page.mouse.up()
        panels.wait_for(page, "idle")
    raise AssertionError("no motion")


def held_jog(play: Any, browser: Any, running: Panels, ear: Ear, how: str) -> float:
    """Hold a jog, end it, and give the seconds until the arm rested."""
    panel = running()
    made = panels.chromium(play) if how == "browser" else browser
    window = made.new_context(viewport=panels.SMALL)
    try:
        return _ended(window, panel, ear, panels.killer(made) if how == "browser" else how)
    finally:
        window.close()
        panel.cut(False)


def _ended(window: Any, panel: Panel, ear: Ear, how: Any) -> float:
    page = panels.opened(window, panel.address)
    panels.home(page)
    end = {
        "button": page.mouse.up,
        "tab": page.close,
        "server": panel.process.kill,
        "cable": lambda: panel.cut(True),
    }.get(how, how)
    before = moving(page, ear)
    begin_s = time.monotonic()
    end()
    found = ear.rest_s(begin_s, before)
    if how == "button":
        panels.wait_for(page, "idle")
    return found


_VIEW = """setInterval(() => {
  const place = document.getElementById('armtempo-where'), panel = window.armtempo;
  if (!window.seen && place?.textContent) window.seen = performance.now();
  const placed = panel?.parts && getElement(panel.parts.scene)?.objects.get(panel.parts.ghost[0])?.placed;
  const frame = panel?.renderer?.info.render.frame;
  if ((panel?.to || placed) && panel.turned && window.before === undefined) window.before = frame;
  if (!window.drawn && frame > window.before) window.drawn = performance.now();
}, 10)"""
"""An arm that is not homed is drawn as a ghost, where it may be; the next frame shows what was put in its place."""


def first_view(browser: Any, address: str) -> tuple[float, float]:
    """Seconds until a page says where the arm is, and until the arm is drawn."""
    with browser.new_context(viewport=panels.DESKTOP) as window:
        page = window.new_page()
        page.add_init_script(_VIEW)
        page.goto(address)
        page.wait_for_function("window.drawn")
        seen, drawn = page.evaluate("[seen / 1000, drawn / 1000]")
        return seen, drawn


# first steps


def begun(ear: Ear, act: Callable[[], object]) -> float | None:
    """Seconds from a press until the motion begins; None if it was refused, as what came late on a busy machine is."""
    begin_s = time.monotonic()
    act()
    while ear.began_s < begin_s:
        if time.monotonic() > begin_s + _BEGINS_S:
            return None
        time.sleep(0.001)
    return ear.began_s - begin_s


def presses(page: Any, ear: Ear, times: int) -> list[float]:
    """From the press of a jog button until the first step."""
    found = []
    gears = panels.ARM.transmission
    here_deg = gears.angles_of_steps(gears.whole_steps(panels.ARM.home_deg))  # where the motors are
    jog = jog_motion.plan("jog", panels.ARM, here_deg.tolist(), JogMove(math.inf, joint=0))
    later_s = first_step_s(panels.ARM, jog.trajectory)
    button = page.locator('[aria-label$=" +"]').first
    while len(found) < times:
        panels.home(page)
        button.hover()
        page.wait_for_timeout(_SETTLED_MS)
        if (begin_s := begun(ear, page.mouse.down)) is not None:
            found.append(begin_s + later_s)
        page.mouse.up()
        panels.wait_for(page, "idle")
    return found


def runs(page: Any, ear: Ear, times: int) -> list[float]:
    """From the press of Run."""
    from playwright.sync_api import expect

    page.get_by_role("tab", name="Job").click()
    panels.press(page, page.get_by_role("button", name="Plan", exact=True))
    page.wait_for_selector("text=Motion time")
    found = []
    while len(found) < times:
        panels.home(page)
        page.get_by_role("tab", name="Run").click()
        button = page.get_by_role("button", name="Run", exact=True)
        expect(button).to_be_enabled()
        page.wait_for_timeout(_SETTLED_MS)
        if (begin_s := begun(ear, lambda button=button: panels.press(page, button))) is not None:
            found.append(begin_s)
        page.keyboard.press("Escape")
        panels.wait_for(page, "idle")
        page.wait_for_selector("button:has-text('Upload'):not([disabled])")
    return found


# pages that watch


def watch(address: str) -> None:
    """Ten pages without a browser: they take what the panel sends them."""
    asyncio.run(_watch(address))


async def _watch(address: str) -> None:
    import socketio

    clients = []
    for _ in range(WATCHING):
        with urllib.request.urlopen(address) as answer:
            found = re.search(r"query: (\{.*client_id.*\}),\n", answer.read().decode())
        assert found
        query = {**ast.literal_eval(found.group(1)), "document_id": "d", "tab_id": "t"}
        client = socketio.AsyncClient()
        await client.connect(
            f"{address}&{urlencode(query)}",
            headers={"Origin": address.partition("/?")[0]},
            transports=["websocket"],
            socketio_path="_nicegui_ws/socket.io",
        )
        clients.append(client)
    await asyncio.sleep(3600)


def processor_s(pid: int) -> float:
    """Processor time that a process has had."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def stops(page: Any, ear: Ear, times: int) -> list[float]:
    """Seconds from the key press to the board's answer."""
    found = []
    for _ in range(times):
        moving(page, ear)
        begin_s = time.monotonic()
        page.keyboard.press("Escape")
        limit_s = begin_s + _PATIENCE_S
        while ear.stopped_s < begin_s:
            assert time.monotonic() < limit_s, "no answer"
            time.sleep(0.0005)
        found.append(ear.stopped_s - begin_s)
        page.mouse.up()
        panels.wait_for(page, "idle")
        panels.home(page)
    return found


def watched(browser: Any, times: int) -> None:
    """Print what ten watching pages cost, and how long a stop takes then."""
    ear = Ear()
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder,
        panels.panels(Path(folder), (Cable(), ear), "ar4") as running,
    ):
        panel = running()
        page = panels.opened(browser.new_context(viewport=panels.SMALL), panel.address)
        panels.home(page)
        watching = multiprocessing.get_context("spawn").Process(target=watch, args=(panel.address,))
        watching.start()
        time.sleep(5)
        show("Escape to the board's answer", stops(page, ear, times))
        begin_s, before_s = time.monotonic(), processor_s(panel.process.pid)
        while time.monotonic() < begin_s + 20.0:
            panels.hold(page)
            page.wait_for_timeout(1500)
            page.mouse.up()
            panels.wait_for(page, "idle")
            panels.home(page)
        share = (processor_s(panel.process.pid) - before_s) / (time.monotonic() - begin_s)
        print(f"processor time of the panel: {100 * share:.0f} %; samples lost: {panel.state().samples_lost}")
        watching.kill()
        watching.join()


def show(name: str, seconds: Sequence[float]) -> None:
    """A line: median, 95th percentile and worst in ms, of how many, and how busy the machine was."""
    found = np.sort(seconds) * 1000
    print(
        f"{name:<30} median {np.median(found):6.0f} ms   p95 {np.percentile(found, 95):6.0f} ms   "
        f"worst {found[-1]:6.0f} ms   of {len(found)}   load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors",
        flush=True,
    )


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--times", type=int, default=20)
    parser.add_argument("--stops", type=int, default=100)
    parser.add_argument("--only", choices=PARTS, action="append")
    options = parser.parse_args()
    wanted = options.only or PARTS
    with panels.playwright() as play:
        browser = panels.chromium(play)
        ear = Ear()
        with (
            tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder,
            panels.panels(Path(folder), (Cable(), ear)) as running,
        ):
            for how in [how for how in HOWS if how in wanted]:
                found = [held_jog(play, browser, running, ear, how) for _ in range(options.times)]
                show(f"jog, {how}", found)
            if "first" in wanted:
                page = panels.opened(browser.new_context(viewport=panels.SMALL), running().address)
                show("jog pressed to first step", presses(page, ear, options.times))
                show("run pressed to moving", runs(page, ear, options.times))
                page.close()
            if "view" in wanted:
                address = running().address
                seen, drawn = zip(*(first_view(browser, address) for _ in range(options.times)), strict=True)
                show("the page says where the arm is", seen)
                show("the arm is drawn", drawn)
        if "watched" in wanted:
            watched(browser, options.stops)
        browser.close()


if __name__ == "__main__":
    main()
