"""The panel as its users have it: the program, on a virtual board in real time behind a cable, and a real browser."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Thread
from typing import Any, TypeVar
from urllib.parse import urlsplit

import armtempo
from armtempo.basics import toml_table
from armtempo.basics.errors import LinkError
from armtempo.deploy import program_files
from armtempo.deploy.firmware import frozen
from armtempo.model import shipped
from armtempo.panel.access import COOKIE
from armtempo.robot import shared_board
from armtempo.robot.board_state import BoardState
from armtempo.robot.outputs import BoardOutput
from armtempo.simulator import LaunchOptions, launch

from tests import browser, interpreters
from tests.host import arms
from tests.system import commandline
from tests.system.commandline import SOURCES_BLOCKS
from tests.system.relay import Cable, Relay

_AWAY = "\n[posture.away]\nangles_deg = [30, -50, 30]\n"
_ARM_TEXT = shipped.arm_path().read_text(encoding="utf-8") + arms.GRIPPER + arms.PART + _AWAY
ARM = armtempo.Arm.of_table(toml_table.parse(_ARM_TEXT, "arm.toml"))
"""The paper's arm with an output and an input."""
Answer = TypeVar("Answer")
_DRAWN = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
OPTIONS = ["--no-sandbox", "--disable-gpu-rasterization", "--disable-gpu-compositing", *_DRAWN]
"""A processor draws the pages, too: as a graphics card's it would take five times as long."""
WAIT_S = 120.0
"""Nothing here takes longer, on however loaded a machine."""
DESKTOP = {"width": 1280, "height": 800}
SMALL = {"width": 640, "height": 900}
"""Size of a window that is drawn quickly by a processor."""
HOLD_BUTTON = '[aria-label$=" +"]:not([disabled])'
"""Of a jog that is possible now."""
_SELDOM = "{const soon = requestAnimationFrame; requestAnimationFrame = (call) => setTimeout(() => soon(call), 500);}"
"""The scene is drawn by the processor too, which has more to do than to draw it 20 times a second."""


@contextmanager
def playwright() -> Iterator[Any]:
    """Playwright, which a process can have once."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as play:
        yield play


def chromium(play: Any) -> Any:
    """A browser, that ends with Playwright."""
    return play.chromium.launch(executable_path=browser.BROWSER, args=OPTIONS)


def killer(chromium: Any) -> Callable[[], None]:
    """Ends a browser at once."""
    processes = chromium.new_browser_cdp_session().send("SystemInfo.getProcessInfo")["processInfo"]
    number = next(int(one["id"]) for one in processes if one["type"] == "browser")
    return lambda: os.kill(number, signal.SIGKILL)


@dataclass
class Panel:
    """A panel that runs."""

    folder: Path
    port: str
    cables: tuple[Cable, Cable]
    process: subprocess.Popen[str]
    address: str
    errors: list[str]
    """Lines of its error output so far."""

    @property
    def running(self) -> bool:
        """Whether its program runs."""
        return self.process.poll() is None

    def state(self) -> BoardState:
        """What the board says: through the panel's program, or directly if that has ended."""
        if self.running and (found := shared_board.find(self.port)):
            with found:
                return found.state()
        with armtempo.connect(self.port, ARM, tell=lambda text: None) as board:
            return board.state(ARM)

    def outputs(self) -> dict[str, str]:
        """The states of the arm's outputs, as the board says."""
        with shared_board.attach(self.port) as found:
            return {one.name: BoardOutput(found, ARM, one.name).state for one in ARM.outputs}

    def end(self) -> None:
        """End its program."""
        if self.running:
            self.process.send_signal(signal.SIGINT)
        try:
            self.process.wait(timeout=WAIT_S)
        finally:
            self.process.kill()
        assert self.process.stdout
        self.process.stdout.close()

    def check(self) -> None:
        """That nothing failed in its program, what waits for it would wait long; and that NiceGUI warned of nothing."""
        said = "".join(self.errors)
        assert "Traceback" not in said, said
        assert "deprecated" not in said, said

    def cut(self, cut: bool) -> None:
        """Cut the cable, or mend it."""
        for cable in self.cables:
            cable.cut = cut


def _read(process: subprocess.Popen[str], errors: list[str]) -> None:
    """Gather what a program says in its error output, to its end."""
    assert process.stderr
    with process.stderr:
        errors.extend(process.stderr)


class Panels:
    """Panels on one board, one after the other: a new one only if the last was killed."""

    def __init__(
        self, folder: Path, port: str, cables: tuple[Cable, Cable], options: tuple[str, ...]
    ) -> None:
        self._folder, self._port, self._cables, self._options = folder, port, cables, options
        self._last: Panel | None = None

    def __call__(self) -> Panel:
        """One that runs, and in which nothing has failed."""
        if self._last is not None:
            self._last.check()
        if self._last is None or not self._last.running:
            self.close()
            options = ("--web-port", "0", "--no-show", "--port", self._port, *self._options)
            process = commandline.start("panel", *options, folder=self._folder)
            assert process.stdout
            errors: list[str] = []
            Thread(target=_read, args=(process, errors), daemon=True).start()
            address = process.stdout.readline().strip()
            assert address.startswith("http://127.0.0.1:"), (address, errors)
            self._last = Panel(self._folder, self._port, self._cables, process, address, errors)
        return self._last

    def close(self) -> None:
        """End the last one, in which nothing may have failed."""
        if self._last is not None:
            self._last.end()
            self._last.check()


def asked(address: str, request: bytes) -> bytes:
    """The first line of the panel's answer to the bytes of a request, which has its token; b"" if it hangs up."""
    place = urlsplit(address)
    host, port, token = str(place.hostname), place.port or 0, place.query.removeprefix("token=")
    known = f"{host}:{port}\r\nCookie: {COOKIE.format(port=port)}={token}"
    with socket.create_connection((host, port), timeout=WAIT_S) as line, suppress(ConnectionError):
        line.sendall(request.replace(b"HOST", known.encode()))
        return line.recv(4096).partition(b"\r\n")[0]
    return b""


def _library() -> dict[str, bytes]:
    files = program_files.library(0)
    return {name.removeprefix(f"{program_files.ROOT}/"): data for name, data in files.items()}


@contextmanager
def panels(folder: Path, cables: tuple[Cable, Cable] | None = None, arm: str = "") -> Iterator[Panels]:
    """For an arm that ships, or for ``ARM`` with the paper's job; all but the start files is deployed to the board."""
    (folder / "job.toml").write_text(shipped.job_path().read_text(encoding="utf-8"), encoding="utf-8")
    (folder / "arm.toml").write_text(_ARM_TEXT, encoding="utf-8")
    ways = cables or (Cable(), Cable())
    job = () if arm else ("--job", "job.toml")
    with ExitStack() as stack:
        moved = armtempo.Arm.of(arm) if arm else ARM
        frozen.fill(folder / "flash", _library())
        options = LaunchOptions(
            folder / "flash",
            virtual_time=False,
            instant_flash=True,
            interpreter=interpreters.starter("cpython"),  # takes the sources
            arm=moved,
            flash_blocks=SOURCES_BLOCKS,
        )
        virtual = stack.enter_context(launch(options))
        relay = stack.enter_context(Relay(virtual.port, folder / "port", *ways))
        made = Panels(folder, relay.port, ways, ("--arm", arm or "arm.toml", *job))
        stack.callback(made.close)
        yield made


_NOT_DRAWN = """{const get = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
  return kind.startsWith("webgl") ? null : get.call(this, kind, ...more);
};}"""
"""As in a browser without WebGL; the picture takes a processor most of its time."""


def opened(window: Any, address: str, drawn: bool = True) -> Any:
    """The panel's page in a window (a Playwright context), in control; without the picture if not ``drawn``."""
    page = window.new_page()
    page.set_default_timeout(WAIT_S * 1000)
    page.on("console", lambda message: print(message.text))  # why it was loaded again, say
    page.add_init_script(_SELDOM if drawn else _NOT_DRAWN)
    page.goto(address)
    return in_control(page)


def in_control(page: Any) -> Any:
    """A page that has control, and knows the board."""
    page.wait_for_selector("button:has-text('control')")
    take = page.get_by_role("button", name="Take control")
    if take.is_visible():
        press(page, take)
    page.wait_for_selector("text=In control")
    wait_for(page, "virtual board")
    return page


def wait_for(page: Any, *words: str, place: str = "armtempo-state", within_s: float = WAIT_S) -> None:
    """Until the line of the state, or another place, has all the words."""
    try:
        page.wait_for_function(
            "([place, words]) => words.every(word => document.getElementById(place).textContent.includes(word))",
            arg=[place, words],
            polling=50,
            timeout=within_s * 1000,
        )
    except Exception as error:
        raise AssertionError(f"{words} were waited for; {page.inner_text('body')}") from error


def press(page: Any, button: Any, act: Callable[[], object] | None = None) -> None:
    """Press a button (or ``act``); nothing may be wrong with it."""
    refusal = refusal_of(page, button, act)
    assert not refusal, refusal


def refusal_of(page: Any, button: Any, act: Callable[[], object] | None = None) -> str:
    """Press a button (or ``act``) until a press is in time and nothing else is under way; why it was refused."""
    refusal = "it was grey"
    for _ in range(30):
        before = page.evaluate("armtempo.number")
        act() if act else button.click()
        if not act and page.evaluate("armtempo.number") == before:  # grey since Playwright had looked
            continue
        page.wait_for_function("before => armtempo.answered && armtempo.answered[0] > before", arg=before)
        refusal = str(page.evaluate("armtempo.answered[1]"))
        if not refusal.startswith(("Not done", "Wait:")):
            return refusal
        page.wait_for_timeout(100)  # it turns grey soon after another command has begun
    raise AssertionError(refusal)


def answer(page: Any, button: str) -> None:
    """Press a button of the dialog, which may not be refused, and wait until that is gone."""
    refusal = refusal_of_answer(page, button)
    assert not refusal, refusal


def refusal_of_answer(page: Any, button: str) -> str:
    """Press a button of the dialog, and wait until that is gone; why it was refused, which leaves it open."""
    wanted = page.get_by_role("button", name=button, exact=True)
    dialog = page.get_by_role("dialog").filter(has=wanted)  # another one may open in its place
    refusal = refusal_of(page, dialog.get_by_role("button", name=button, exact=True))
    if refusal:
        dialog.get_by_role("button", name="Cancel").click()
    dialog.wait_for(state="detached")
    return refusal


def home(page: Any) -> None:
    """Say that the arm is at home, on the tab where it is moved, and wait until it is known there."""
    page.get_by_role("tab", name="Move").click()
    before = page.inner_text("#armtempo-said")
    press(page, page.locator(".armtempo-panels").get_by_role("button", name="Home…"))
    answer(page, "The arm is at home")
    page.wait_for_function(
        "before => ![before, ''].includes(document.getElementById('armtempo-said').textContent)", arg=before
    )
    wait_for(page, "The arm is at home: done", place="armtempo-said")
    page.wait_for_selector(HOLD_BUTTON)


def hold(page: Any, by_key: bool = False) -> None:
    """Hold a jog button until the arm moves; again if a busy browser was silent for too long, as then it lets go."""
    button = page.locator('[aria-label$=" +"]').first
    for _ in range(20):
        page.wait_for_selector(HOLD_BUTTON)  # once it is enabled: Enter would press what has the focus else
        (button.focus if by_key else button.hover)()
        before = page.inner_text("#armtempo-where")
        page.keyboard.down("Enter") if by_key else page.mouse.down()
        with suppress(Exception):  # a time-out
            page.wait_for_function(
                """before => document.getElementById('armtempo-state').textContent.includes('moving')
                   && document.getElementById('armtempo-where').textContent != before""",
                arg=before,
                timeout=10_000,
                polling=50,
            )
            return
        page.keyboard.up("Enter") if by_key else page.mouse.up()
        wait_for(page, "idle")
    raise AssertionError("the arm does not move")


def again(ask: Callable[[], Answer]) -> Answer:
    """What it gives; asked again where a busy machine has no answer in time."""
    limit_s = time.monotonic() + WAIT_S
    while True:
        try:
            return ask()
        except LinkError:
            if time.monotonic() > limit_s:
                raise
            time.sleep(0.1)


def rest(state: Callable[[], BoardState]) -> BoardState:
    """The state in which the board comes to rest."""
    limit_s = time.monotonic() + WAIT_S
    while (found := again(state)).moving:
        assert time.monotonic() < limit_s, found
        time.sleep(0.02)
    return found


def place(state: Callable[[], BoardState]) -> list[float | None]:
    """The joint angles where the arm rests, as the board says: a page is behind it by a message."""
    return [joint.angle_deg for joint in rest(state).joints]
