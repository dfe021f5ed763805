"""The panel in a real browser, on a virtual board in real time: the whole way, and what stops a held jog."""

from __future__ import annotations

import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from armtempo.model import shipped

from tests import browser
from tests.system import commandline

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("panel")]
_OPTIONS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
_WAIT_S = 120.0
"""Nothing here takes longer, on however loaded a machine."""
_REST_S = 2.0
"""A jog rests within this time after its page has gone: 0.35 s until that is noticed, then it brakes."""


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    """A browser."""
    browser.needed()
    from playwright.sync_api import sync_playwright

    with sync_playwright() as play:
        made = play.chromium.launch(executable_path=browser.BROWSER, args=_OPTIONS)
        yield made
        made.close()


@pytest.fixture
def panel(tmp_path: Path) -> Iterator[tuple[str, subprocess.Popen[str], Path]]:
    """(address, process, project folder) of a panel for the paper's arm and job."""
    (tmp_path / "job.toml").write_text(shipped.job_path().read_text(encoding="utf-8"), encoding="utf-8")
    process = commandline.start(
        *("panel", "--arm", "paper", "--job", "job.toml", "--web-port", "0", "--no-show"), folder=tmp_path
    )
    assert process.stdout
    address = process.stdout.readline().strip()
    assert address.startswith("http://127.0.0.1:"), address
    yield address, process, tmp_path
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=_WAIT_S)


def state(page: Any) -> str:
    return str(page.inner_text("#armtempo-state"))


def wait_for(page: Any, *words: str) -> None:
    """Until the line of the state has all the words."""
    limit_s = time.monotonic() + _WAIT_S
    while not all(word in state(page) for word in words):
        assert time.monotonic() < limit_s, state(page)
        page.wait_for_timeout(50)


@pytest.fixture
def browsing(chromium: Any) -> Iterator[Any]:
    """A window of its own, closed at the end: a page that stays open goes on drawing."""
    made = chromium.new_context()
    yield made
    made.close()


def opened(context: Any, address: str) -> Any:
    page = context.new_page()
    page.set_default_timeout(_WAIT_S * 1000)
    page.goto(address)
    page.wait_for_selector("text=In control")
    wait_for(page, "virtual board")
    return page


def home(page: Any) -> None:
    page.get_by_role("button", name="The arm is at home").click()
    page.get_by_role("dialog").get_by_role("button", name="The arm is at home").click()
    wait_for(page, "idle")


def hold(page: Any) -> None:
    """Hold a jog button until the arm moves; again if a busy browser was silent for too long, as then it lets go."""
    box = page.get_by_label("joint 1 +").bounding_box()
    page.mouse.move(box["x"] + 9, box["y"] + 9)
    for _ in range(20):
        page.mouse.down()
        for _ in range(60):
            if "moving" in state(page):
                return
            page.wait_for_timeout(50)
        page.mouse.up()
        wait_for(page, "idle")
    raise AssertionError(state(page))


def test_the_whole_way(browsing: Any, panel: tuple[str, Any, Path]) -> None:
    address, _, folder = panel
    page = opened(browsing, address)
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    assert page.get_by_label("joint 1 +").is_disabled()  # not homed yet
    home(page)
    page.get_by_role("tab", name="Plan").click()
    page.get_by_role("button", name="Plan", exact=True).click()
    page.wait_for_selector("text=Motion time 6.79")
    page.get_by_role("tab", name="Run").click()
    page.get_by_role("button", name="Run", exact=True).click()
    wait_for(page, "moving", "Run")
    page.wait_for_timeout(1500)
    page.keyboard.press("Escape")
    wait_for(page, "idle")
    page.get_by_role("tab", name="Board").click()
    page.wait_for_selector("text=Stop: the arm brakes along its path.")
    page.get_by_role("tab", name="Run").click()
    page.get_by_role("button", name="Go to the start").click()
    wait_for(page, "moving")
    wait_for(page, "idle")
    page.get_by_role("button", name="Run", exact=True).click()
    wait_for(page, "moving")
    wait_for(page, "idle")
    with page.expect_popup() as popup:
        page.get_by_role("link", name="Report").first.click()
    popup.value.wait_for_selector("text=joint 1")
    assert len(list((folder / "runs").glob("*/run.json"))) == 2
    assert not errors


@pytest.mark.parametrize("how", ["button", "tab", "browser"])
def test_a_held_jog_ends_with_its_page(
    chromium: Any, browsing: Any, panel: tuple[str, Any, Path], how: str
) -> None:
    address, process, _ = panel
    context = chromium.new_context()
    page = opened(context, address)
    home(page)
    hold(page)
    if how == "button":
        page.mouse.up()
    elif how == "tab":
        page.close()
    else:
        context.close()
    time.sleep(_REST_S)
    context.close()
    after = opened(browsing, address)
    assert "idle" in state(after)
    assert process.poll() is None


def test_a_page_says_so_when_the_server_has_gone(browsing: Any, panel: tuple[str, Any, Path]) -> None:
    address, process, _ = panel
    page = opened(browsing, address)
    process.kill()
    page.wait_for_selector("body.lost", timeout=_WAIT_S * 1000)
    cover = page.evaluate("getComputedStyle(document.body, '::after').content")
    assert "Nothing can be moved" in cover


def test_it_fits_desktop_tablet_and_phone(browsing: Any, panel: tuple[str, Any, Path]) -> None:
    page = opened(browsing, panel[0])
    for width, height in ((1280, 800), (820, 1180), (390, 844)):
        page.set_viewport_size({"width": width, "height": height})
        for tab in ("Move", "Plan", "Run", "Board"):
            page.get_by_role("tab", name=tab).click()
            page.wait_for_timeout(200)
            over = page.evaluate(
                "document.documentElement.scrollWidth - document.documentElement.clientWidth"
            )
            assert over <= 0, (width, tab, over)
            assert page.get_by_role("button", name="Stop").is_visible()
