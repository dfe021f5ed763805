"""What comes over the network: requests of others, presses that come late, pages that are lost."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from tests.system import commandline, panels
from tests.system.network import Network
from tests.system.panels import Panel, Panels, hold, home

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("panel")]


_SOCKET = b"/_nicegui_ws/socket.io/?EIO=4&transport=websocket HTTP/1.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
_KEY = b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"


_OTHER = b"Host: HOST\r\nOrigin: http://evil.example\r\n\r\n"
_CHUNKED = b"POST / HTTP/1.1\r\nHost: HOST\r\nTransfer-Encoding: chunked\r\n\r\n"
_LONG = b"X: " + 400_000 * b"x"
_TOO_LARGE = b"POST / HTTP/1.1\r\nHost: HOST\r\nContent-Length: 1000001\r\n\r\n"
_REFUSED = {
    "host": (
        b"GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n",
        b"403",
        "does not serve the name 'evil.example'",
    ),
    "origin": (b"GET / HTTP/1.1\r\n" + _OTHER, b"403", "a page of another origin"),
    "socket": (b"GET " + _SOCKET + _KEY + _OTHER, b"403", "a page of another origin"),
    "size": (_TOO_LARGE, b"403", "more than 1000000"),
    "chunks": (_CHUNKED + 17 * (b"10000\r\n" + 0x10000 * b"x" + b"\r\n"), b"413", "more than 1000000"),
    "chunk": (_CHUNKED + b"many\r\n", b"400", "Invalid HTTP request"),
    "header": (b"GET / HTTP/1.1\r\nHost: HOST\r\n" + _LONG + b"\r\n\r\n", b"400", "Invalid HTTP request"),
    "bytes": (b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n", b"400", "Invalid HTTP request"),
    "path": (b"GET /runs/..%2f..%2fjob.toml HTTP/1.1\r\nHost: HOST\r\n\r\n", b"404", "job.toml not found"),
    "escape": (b"GET /%1b[2J HTTP/1.1\r\nHost: HOST\r\n\r\n", b"403", "'/\\x1b[2J' from"),
}
"""Requests that are none of the panel's own pages, the status of the answer, and what is logged."""


@pytest.mark.parametrize(("request_", "status", "logged"), _REFUSED.values(), ids=_REFUSED)
def test_what_is_no_request_of_its_pages_is_refused_and_logged(
    panel: Panel, request_: bytes, status: bytes, logged: str
) -> None:
    before = len(panel.errors)
    assert panels.asked(panel.address, request_).split(b" ")[1:2] == [status]
    commandline.wait_for(lambda: any(logged in line for line in panel.errors[before:]), logged)


_NO_RUNS = {
    b"/runs/other/report.html": b"422",
    b"/runs/./report.html": b"422",
    b"/runs/../report.html": b"404",
    b"/runs/comparison.html": b"422",
    b"/runs/comparison.html?run=..&run=%00": b"422",
}


@pytest.mark.parametrize(("path", "status"), _NO_RUNS.items(), ids=map(bytes.decode, _NO_RUNS))
def test_a_page_of_what_is_no_run_is_refused(panel: Panel, path: bytes, status: bytes) -> None:
    request_ = b"GET " + path + b" HTTP/1.1\r\nHost: HOST\r\n\r\n"
    assert panels.asked(panel.address, request_).split(b" ")[1:2] == [status]
    panel.check()


_PRESSED = """() => {
  window.clicks = 0;
  addEventListener('click', event => window.clicks += event.target.matches('button'), true);
  const seen = [...document.querySelectorAll('button')].filter(one => one.checkVisibility() && !one.disabled);
  seen.find(one => one.textContent.includes('Stop')).focus();
  return seen.filter(one => {
    const {x, y, width, height} = one.getBoundingClientRect();
    const on = document.elementFromPoint(x + width / 2, y + height / 2);
    return on && one.contains(on);
  }).length;
}"""
"""How many buttons a pointer finds; from then on clicks are counted, and the button that stops has the focus."""


@pytest.fixture
def network(panel: Panel) -> Iterator[Network]:
    """One between the browser and the panel."""
    with Network(panel.address) as made:
        yield made


@pytest.mark.parametrize("command", ["jog", pytest.param("posture", marks=pytest.mark.long)])
@pytest.mark.parametrize(
    "how", ["stalls", *(pytest.param(how, marks=pytest.mark.long) for how in ("delays", "cuts", "reorders"))]
)
def test_nothing_moves_that_nobody_means_any_more(
    window: Any, panel: Panel, network: Network, how: str, command: str
) -> None:
    if how == "reorders" and command == "posture":
        pytest.skip("a click has no release that could overtake it")
    page = panels.opened(window, network.address, drawn=False)
    home(page)
    place = panels.place(panel.state)
    button = (
        page.get_by_label("joint 1 +") if command == "jog" else page.get_by_role("button", name="Go to away")
    )
    if command == "posture":
        page.get_by_role("switch", name="With one click").click()
    button.hover()
    if how == "stalls":
        network.stall(True)
    elif how == "delays":
        network.delay_s = 0.5
    elif how == "cuts":
        network.cut()
    else:
        network.last_first = lambda text: b'"jog"' in text
    page.mouse.down()
    if how != "reorders":
        page.wait_for_timeout(200)
    page.mouse.up()
    page.wait_for_timeout(1000)
    network.stall(False)
    network.refuses, network.delay_s = False, 0.0
    page.wait_for_selector("body:not(.lost)")
    page.wait_for_timeout(2000)  # in which a press that was kept would move it
    assert panels.place(panel.state) == place
    network.last_first = None
    hold(page)  # it works again
    network.stall(True)
    panels.rest(panel.state)  # and a hold that is not heard of ends
    network.stall(False)
    page.mouse.up()
    page.close()


@pytest.mark.parametrize(
    "how",
    [
        "button",
        *(pytest.param(how, marks=pytest.mark.long) for how in ("key", "cable", "tab", "server", "browser")),
    ],
)
def test_a_held_jog_ends_with_what_holds_it(chromium: Any, page: Any, running: Panels, how: str) -> None:
    """The arm rests before the end of its range, where it would else have gone."""
    panel = running()
    if how == "button":
        home(page)
    hold(page, by_key=how == "key")
    if how == "button":
        page.mouse.up()
    elif how == "key":
        page.keyboard.up("Enter")
    elif how == "cable":
        panel.cut(True)
        page.wait_for_selector("text=did not answer")
        panel.cut(False)
    elif how == "tab":
        page.close()
    elif how == "server":
        panel.process.kill()
        page.wait_for_selector("body.lost")
        assert "Nothing can be moved" in page.evaluate("getComputedStyle(document.body, '::after').content")
        assert page.evaluate(_PRESSED) == 0
        page.keyboard.press("Enter")  # on the button that has the focus
        assert page.evaluate("clicks") == 0
    else:  # the last that needs one
        panels.killer(chromium)()
    angle_deg = panels.rest(panel.state).joints[0].angle_deg
    assert angle_deg is not None
    assert 0.0 < angle_deg < panels.ARM.driven[0].range_deg[1] - 1.0
    assert panel.running == (how != "server")
