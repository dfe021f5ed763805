"""The panel in a real browser, on a virtual board in real time: the whole way, and what stops a held jog."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests import browser
from tests.system import panels
from tests.system.panels import Panel, Panels, hold, home, opened, wait_for

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("panel")]


@pytest.fixture(scope="module")
def play() -> Iterator[Any]:
    """Playwright."""
    browser.needed()
    with panels.playwright() as made:
        yield made


@pytest.fixture(scope="module")
def chromium(play: Any) -> Iterator[Any]:
    """A browser."""
    made = panels.chromium(play)
    yield made
    made.close()


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Panels]:
    """One board, and one panel as long as it lives: each start takes seconds."""
    with panels.panels(tmp_path_factory.mktemp("panel")) as made:
        yield made


@pytest.fixture
def panel(running: Panels) -> Panel:
    """A panel that runs."""
    return running()


@pytest.fixture
def window(chromium: Any) -> Iterator[Any]:
    """A window of its own, closed at the end: a page that stays open goes on drawing."""
    made = chromium.new_context(viewport=panels.SMALL)
    yield made
    made.close()


def test_the_whole_way(window: Any, panel: Panel) -> None:
    """Home, plan, run, stop, go on, report."""
    page = opened(window, panel.address)
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    if not all(joint.known for joint in panel.state().joints):
        assert page.get_by_label("joint 1 +").is_disabled()
    home(page)
    for number in ("1e9", "-1", "true", "'x'", "null", "[1]", "{}"):  # buttons that there are not
        page.evaluate(f"emitEvent('armtempo-press', {number})")
    page.evaluate("window.socket.emit('event', {id: 'x', client_id: 'x', listener_id: 5, args: []})")
    page.get_by_role("tab", name="Plan").click()
    page.get_by_role("button", name="Plan", exact=True).click()
    page.wait_for_selector("text=Motion time 6.79")
    page.get_by_role("tab", name="Run").click()
    page.get_by_role("button", name="Run", exact=True).click()
    wait_for(page, "moving", "Run")
    page.get_by_role("button", name="Pause").click()
    wait_for(page, "in a pause", "Run")
    page.get_by_role("button", name="Resume").click()  # on along the path
    page.wait_for_function("!document.getElementById('armtempo-state').textContent.includes('in a pause')")
    page.keyboard.press(" ")  # the button just pressed has the focus, and does not take it
    wait_for(page, "idle")
    joints = panel.state().joints
    panels.wait_for(page, *(f"{joint.angle_deg:.2f}°" for joint in joints), place="armtempo-where")
    assert 0.0 < (joints[0].angle_deg or 0.0) < 180.0
    page.get_by_role(
        "button", name="Go to the start"
    ).click()  # from a stop no motion continues: a new one begins
    wait_for(page, "moving")
    page.get_by_role("button", name="Run", exact=True).click()
    wait_for(page, "moving")
    page.get_by_role("link", name="Report").nth(0).wait_for()
    with page.expect_popup() as popup:
        page.get_by_role("link", name="Report").first.click()
    popup.value.wait_for_selector("text=joint 1")
    assert len(list((panel.folder / "runs").glob("*/run.json"))) == 2
    page.get_by_role("tab", name="Board").click()
    page.wait_for_selector("text=Stop: the arm brakes along its path.")
    assert "jog" not in page.inner_text(".nicegui-log")
    assert not errors


@pytest.mark.parametrize("how", ["button", "tab", "browser", "cable", "server"])
def test_a_held_jog_ends_with_what_holds_it(
    play: Any, window: Any, running: Panels, tmp_path: Path, how: str
) -> None:
    """The arm rests before the end of its range, where it would else have gone."""
    panel = running()
    if how == "browser":
        with panels.chromium_to_kill(play, tmp_path) as (made, process):
            page = opened(made.new_context(viewport=panels.SMALL), panel.address)
            home(page)
            hold(page)
            process.kill()
            process.wait()
    else:
        page = opened(window, panel.address)
        home(page)
        hold(page)
        if how == "button":
            page.mouse.up()
        elif how == "tab":
            page.close()
        elif how == "server":
            panel.process.kill()
            page.wait_for_selector("body.lost")
            assert "Nothing can be moved" in page.evaluate(
                "getComputedStyle(document.body, '::after').content"
            )
        else:
            panel.cut(True)
            page.wait_for_selector("text=did not answer")
            panel.cut(False)
    angle_deg = panels.rest(panel.state).joints[0].angle_deg
    assert angle_deg is not None
    assert 0.0 < angle_deg < panels.ARM.driven[0].range_deg[1] - 1.0
    assert panel.running == (how != "server")


def test_a_sequence_is_edited_saved_and_run(window: Any, panel: Panel) -> None:
    file = panel.folder / "day.toml"
    file.write_text('name = "day"  # my name\n[[step]]\ngoto = "home"\n[[step]]\nwait_s = 9  # it settles\n')
    page = opened(window, panel.address)
    home(page)
    page.get_by_role("tab", name="Sequence").click()
    page.get_by_role("combobox", name="Sequence").click()
    page.get_by_role("option", name="day.toml").click()
    page.get_by_label("step 2: wait_s").fill("600")
    page.get_by_label("step 2: wait_s").press("Tab")
    page.get_by_role("button", name="Save the sequence").click()
    page.wait_for_selector("text=Saved")
    assert "wait_s = 600  # it settles" in file.read_text()
    page.get_by_role("button", name="Run", exact=True).click()
    page.wait_for_selector(".armtempo-lit:has-text('2')")
    page.keyboard.press("Escape")
    page.wait_for_selector("text=cycle 0: stopped")
    assert page.locator(".armtempo-lit").count() == 0


_SOCKET = b"/_nicegui_ws/socket.io/?EIO=4&transport=websocket HTTP/1.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
_KEY = b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"


@pytest.mark.parametrize(
    ("request_", "status"),
    [
        (b"GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n", b"403"),
        (b"GET / HTTP/1.1\r\nHost: HOST\r\nOrigin: http://evil.example\r\n\r\n", b"403"),
        (b"GET " + _SOCKET + _KEY + b"Host: HOST\r\nOrigin: http://evil.example\r\n\r\n", b"403"),
        (b"POST / HTTP/1.1\r\nHost: HOST\r\nContent-Length: 1000001\r\n\r\n", b"403"),
        (
            b"POST / HTTP/1.1\r\nHost: HOST\r\nTransfer-Encoding: chunked\r\n\r\n"
            + 17 * (b"10000\r\n" + 0x10000 * b"x" + b"\r\n"),
            b"413",
        ),
        (b"POST / HTTP/1.1\r\nHost: HOST\r\nTransfer-Encoding: chunked\r\n\r\nmany\r\n", b"400"),
        (b"GET / HTTP/1.1\r\nHost: HOST\r\nX: " + 400_000 * b"x" + b"\r\n\r\n", b"400"),
        (b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n", b"400"),
        (b"GET /runs/..%2f..%2f/job.toml HTTP/1.1\r\nHost: HOST\r\n\r\n", b"404"),
        (b"GET / HTTP/1.1\r\nHost: HOST\r\n\r\n", b"200"),
    ],
    ids=["host", "origin", "socket", "size", "chunks", "chunk", "header", "bytes", "path", "good"],
)
def test_what_is_no_request_of_its_pages_is_refused(panel: Panel, request_: bytes, status: bytes) -> None:
    assert panels.asked(panel.address, request_).split(b" ")[1:2] == [status]


def test_it_fits_desktop_tablet_and_phone(window: Any, panel: Panel) -> None:
    page = opened(window, panel.address)
    for width, height in ((1280, 800), (820, 1180), (390, 844)):
        page.set_viewport_size({"width": width, "height": height})
        for tab in ("Move", "Plan", "Run", "Sequence", "Board"):
            page.get_by_role("tab", name=tab).click()
            page.wait_for_selector(f".q-tab--active:has-text('{tab}')")
            over = page.evaluate(
                "document.documentElement.scrollWidth - document.documentElement.clientWidth"
            )
            assert over <= 0, (width, tab, over)
            assert page.get_by_role("button", name="Stop").is_visible()
