"""The panel in a real browser, on a virtual board in real time: the whole way, and what stops a held jog."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import tomlkit
from armtempo.basics import toml_table
from armtempo.model import shipped
from armtempo.panel import words

from tests import browser
from tests.system import commandline, page_checks, panels
from tests.system.network import Network
from tests.system.panels import Panel, Panels, hold, home, press, wait_for

TABS = ("Move", "Job", "Run", "Sequence", "Board")
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
    folder = tmp_path_factory.mktemp("panel")
    for name, text in {
        "all": _SEQUENCE,
        "day": _DAY,
        "other": 'name = "other"\n[[step]]\nwait_s = 1\n',
    }.items():
        (folder / f"{name}.toml").write_text(text)
    (folder / "runs" / _MARKUP).mkdir(parents=True)
    for name in ("run.json", "report.html"):
        (folder / "runs" / _MARKUP / name).write_text(
            "<script>document.title = 'hurt'</script><p>of another arm"
        )
    with panels.panels(folder) as made:
        yield made


@pytest.fixture(scope="module")
def failed_before(request: pytest.FixtureRequest) -> int:
    """How many tests have failed before these."""
    return request.session.testsfailed


@pytest.fixture(autouse=True)
def not_in_vain(request: pytest.FixtureRequest, failed_before: int) -> None:
    """A panel that is dead is waited for twice, not in every test."""
    if request.session.testsfailed - failed_before > 1:
        pytest.fail("left out, as two tests before it have failed")


@pytest.fixture
def panel(running: Panels) -> Panel:
    """A panel that runs."""
    return running()


@pytest.fixture(scope="module")
def window(chromium: Any) -> Any:
    """A window of the browser."""
    return chromium.new_context(viewport=panels.SMALL)


@pytest.fixture
def page(window: Any, panel: Panel) -> Any:
    """One page as long as it and the panel live, in control: each takes seconds to open."""
    for one in window.pages:
        if one.url == panel.address:
            return panels.in_control(one)
        one.close()
    return panels.opened(window, panel.address, drawn=False)


@pytest.fixture
def picture(window: Any, panel: Panel) -> Iterator[Any]:
    """A page with the picture of the arm, which the others are without."""
    page = panels.opened(window, panel.address)
    yield page
    page.close()


def show(page: Any, tab: str) -> None:
    """Go to a tab, also if notifications cover it."""
    page.get_by_role("tab", name=tab).dispatch_event("click")


_SHIFTS = """() => new Promise(resolve => {
  let [most, sum, first, last] = [0, 0, -1e9, -1e9];
  new PerformanceObserver(list => list.getEntries().filter(one => !one.hadRecentInput).forEach(one => {
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
    assert page.get_by_label("joint 1 +").is_disabled()
    home(page)
    # No buttons
    page.evaluate("[1e9, -1, true, 'x', null, [1], {}].forEach(one => emitEvent('armtempo-press', one))")
    page.evaluate("window.socket.emit('event', {id: 'x', client_id: 'x', listener_id: 5, args: []})")
    show(page, "Job")
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
    for run, text in (("feed-002", "joint 1"), (_MARKUP, "of another arm")):
        with page.expect_popup() as popup:
            page.get_by_role("link", name=f"Report: {run}").click()
        popup.value.wait_for_selector(f"text={text}")
        assert popup.value.title() != "hurt"
        popup.value.close()  # a page that is hidden is not drawn
    assert len(list((panel.folder / "runs").glob("feed-*/run.json"))) == 2
    for run in ("feed-001", "feed-002"):
        page.get_by_role("checkbox", name=f"Compare: {run}").click()
    with page.expect_popup() as popup:
        page.get_by_role("link", name="Compare", exact=True).click()
    popup.value.wait_for_selector("text=feed-001")
    popup.value.close()
    show(page, "Board")
    page.wait_for_selector(".nicegui-log >> text=Stop: the arm brakes along its path.")
    assert "jog" not in page.inner_text(".nicegui-log")
    assert page.evaluate(_SHIFTS) < 0.1
    assert not errors


_BALL = """(name => {
  const objects = [...getElement(armtempo.parts.scene).objects.values()];
  return objects.find(one => one.mesh && one.mesh.name === name);
})"""
_IS_DRAWN = f"""name => {{
  const mesh = {_BALL}(name)?.mesh;
  return mesh && mesh.position.x && mesh.matrixWorld.elements[12] == mesh.position.x;
}}"""
"""Where it is, which is then where a click finds it."""
_PLACE = f"""name => {{
  const scene = getElement(armtempo.parts.scene), frame = scene.renderer.domElement.getBoundingClientRect();
  const at = {_BALL}(name).mesh.position.clone().project(scene.camera);
  return [frame.x + (at.x + 1) / 2 * frame.width, frame.y + (1 - at.y) / 2 * frame.height];
}}"""


def test_a_via_point_is_clicked_and_dragged_in_the_picture(picture: Any) -> None:
    page = picture
    show(page, "Job")
    page.wait_for_function(_IS_DRAWN, arg="via 3")
    cell = page.get_by_label("P3 joint 1")
    before = cell.input_value()
    page.mouse.click(*page.evaluate(_PLACE, "via 3"))
    page.wait_for_selector("text=P3: postures that reach it")
    assert cell.input_value() == before
    x, y = page.evaluate(_PLACE, "via 3")
    page.mouse.down()
    page.mouse.move(x + 15, y + 15, steps=5)
    page.mouse.up()
    moved = "before => document.querySelector('[aria-label=\"P3 joint 1\"]').value != before"
    page.wait_for_function(moved, arg=before)


_SEQUENCE = """name = "all"
[[step]]
repeat = 2
[[step]]
goto = "home"
[[step]]
run = "job.toml"
[[step]]
output = "gripper"
to = "open"
holds = "nothing"
wait_s = 0.5
[[step]]
holds = "nothing"
[[step]]
wait_s = 1
[[step]]
wait_input = "part"
active = true
timeout_s = 3
on_timeout = "next"
[[step]]
count = "parts"
[[step]]
call = "other.toml"
[[step]]
end = "repeat"
"""
"""Each kind of step, with each of its keys."""
_DAY = 'name = "day"  # my name\n\n[[step]]\ngoto = "home"\n\n[[step]]\nwait_s = 9  # it settles\n'
_MARKUP = "<img src=x onerror=window.hurt=1>"
_FIELDS = """() => [...document.querySelectorAll('.q-tab-panel input:not([role=combobox])')]
  .filter(one => one.checkVisibility() && one.ariaLabel).map(one => [one.ariaLabel, one.type])"""


def put(content: Any, label: str, text: str) -> None:
    """Write into the content of a file what is typed in the field of this label."""
    value = toml_table.typed(text)
    if via := re.fullmatch(r"P(\d+) joint (\d+)", label):
        content["via_deg"][int(via[1])][int(via[2]) - 1] = value
    elif step := re.fullmatch(r"step (\d+): (.*)", label):
        content["step"][int(step[1]) - 1][step[2]] = value
    else:
        content[{name: key for key, name in words.OPTIONS.items()}[label]] = value


def refusal(folder: Path, name: str, text: str, command: str = "plan --arm arm.toml") -> str:
    """What the command line says of a file."""
    (folder / name).write_text(text)
    ended = commandline.run(*command.split(), name, folder=folder)
    assert ended.exit_code == 2
    return ended.errors.splitlines()[0].removeprefix("armtempo: ")


@pytest.mark.parametrize(
    ("tab", "file", "button", "count"),
    [("Job", "job.toml", "Plan", 11), ("Sequence", "all.toml", "Save", 16)],
)
def test_each_field_refuses_wrong_input_in_the_words_of_the_command_line(
    page: Any, panel: Panel, tmp_path: Path, tab: str, file: str, button: str, count: int
) -> None:
    folder = panel.folder  # of a wrong job there the panel would take the rest
    if tab == "Job":
        folder = tmp_path
        show(page, tab)
        shutil.copy(panel.folder / "arm.toml", folder)
        shown = paste(page, wrong := "1;2\n3;4")
        assert refusal(folder, "the pasted rows", wrong, "import --arm arm.toml") in shown
        paste(page, "0;-60;40\n20;-75;50")
        page.wait_for_selector('[aria-label="P2 joint 1"]', state="detached")  # the table is built anew
        good = 'name = "feed"\ntiming = "shared"\nvia_deg = [[0.0, -60.0, 40.0], [20.0, -75.0, 50.0]]\n'
    else:
        good = _SEQUENCE
        show(page, tab)
        open_sequence(page, file, "step 10: end")
    fields = page.evaluate(_FIELDS)
    assert len(fields) == count
    for number, (label, kind) in enumerate(fields):
        field = page.get_by_label(label, exact=True)
        before, wrong = field.input_value(), _MARKUP if kind == "text" else ("999999", "")[number % 2]
        content = tomlkit.parse(good)
        put(content, label, wrong)
        field.fill(wrong)
        page.wait_for_timeout(300)
        assert field.input_value() == wrong  # not lost as what was typed in the field before it is taken
        control = page.get_by_role("button", name=button, exact=True)
        shown = press(page, control, partial(control.press, "Enter"))
        said = refusal(folder, file, tomlkit.dumps(content))
        said = words.of_job(said) if tab == "Job" else said
        assert said.replace(".0", "") in shown.replace(".0", "")
        field.fill(before)
        if tab == "Sequence":
            (folder / file).write_text(_SEQUENCE)  # as it was when it was opened
    assert page.evaluate("window.hurt") is None


def paste(page: Any, text: str) -> str:
    """Paste rows of via points; why they were refused."""
    page.get_by_role("button", name="Paste").click()
    page.get_by_label("Rows of angles").fill(text)
    return panels.answer(page, "Paste")


def open_sequence(page: Any, file: str, last: str) -> None:
    """Open the file of a sequence, until its last field is there; a list that is just being filled is opened again."""
    option = page.get_by_role("option", name=file)
    for _ in range(20):
        page.get_by_role("combobox", name="Sequence").press("ArrowDown")
        with suppress(Exception):  # a time-out
            option.wait_for(timeout=3000)
            break
    option.dispatch_event("click")
    page.get_by_label(last).wait_for()


def test_a_sequence_is_edited_saved_and_run(page: Any, panel: Panel) -> None:
    home(page)
    show(page, "Sequence")
    open_sequence(page, "day.toml", "step 2: wait_s")
    page.evaluate("emit = socket.emit; socket.emit = () => {}")  # as if the connection broke just now
    page.get_by_label("step 2: wait_s").fill("8")
    page.get_by_label("step 2: wait_s").press("Tab")
    page.evaluate("socket.emit = emit; socket.io.engine.close()")
    page.wait_for_function("document.querySelector('[aria-label=\"step 2: wait_s\"]').value == '9'")
    page.get_by_label("step 2: wait_s").fill("600")
    page.get_by_label("step 2: wait_s").press("Tab")
    assert page.get_by_label("step 2: wait_s").input_value() == "600"
    press(page, page.get_by_role("button", name="Save", exact=True))
    page.wait_for_selector("text=Saved")
    assert (panel.folder / "day.toml").read_text() == _DAY.replace("9", "600")
    press(page, page.get_by_role("button", name="Run", exact=True))
    page.wait_for_selector(".armtempo-lit:has-text('2')")
    page.keyboard.press("Escape")
    page.wait_for_selector("text=stopped: step 2 of cycle 1")
    assert page.locator(".armtempo-lit").count() == 0


def test_a_target_is_shown_then_approached_while_held_and_postures_are_stored(
    page: Any, panel: Panel
) -> None:
    home(page)
    where = page.inner_text("#armtempo-where")
    away = page.get_by_role("button", name="Go to away")
    press(page, away, lambda: away.click())  # it is only shown
    page.wait_for_function("armtempo.ghost")
    page.wait_for_timeout(1000)
    assert page.inner_text("#armtempo-where") == where
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
    page.get_by_role("dialog").get_by_label("Name").fill("tray")
    assert panels.answer(page, "Store") == ""
    page.get_by_role("button", name="Go to tray").wait_for()
    assert "[posture.tray]\nangles_deg = [31" in (panel.folder / "arm.toml").read_text()
    page.get_by_role("button", name="Guide by hand…").click()
    assert panels.answer(page, "Guide by hand…") == ""
    wait_for(page, "unhomed", "Guide by hand…")
    wait_for(page, "31.", place="armtempo-where")  # the encoders tell
    assert panels.answer(page, "The current on") == ""
    wait_for(page, "Guide by hand…: done", place="armtempo-said")
    wait_for(page, "idle")


def test_names_from_files_are_text(chromium: Any, tmp_path: Path) -> None:
    names = [
        'j"><img src=x onerror=window.hurt=1>',
        'k\' :innerHTML="hurt=2" onclick="window.hurt=3"',
        "`${hurt=4}`",
    ]
    text = tmp_path / "own.toml"
    content = tomlkit.parse(shipped.arm_path().read_text())
    for joint, name in zip([one for one in content["joint"] if "motor" in one], names, strict=True):  # type: ignore[union-attr]
        joint["name"] = name
    text.write_text(tomlkit.dumps(content))
    with panels.panels(tmp_path, arm=str(text)) as running:
        window = chromium.new_context(viewport=panels.SMALL)
        page = panels.opened(window, running().address, drawn=False)
        home(page)
        for name in names:
            assert page.get_by_label(f"{name} +", exact=True).inner_text().strip() == "+"
            assert page.get_by_text(name, exact=True).first.is_visible()
        for tab in TABS:
            show(page, tab)
            page.wait_for_selector(f".q-tab--active:has-text('{tab}')")
        page.wait_for_timeout(500)
        assert page.evaluate("window.hurt") is None
        blocked = "document.body.insertAdjacentHTML('beforeend', '<img src=x onerror=window.hurt=5>')"
        page.evaluate(blocked)  # and what would get in all the same is not run
        page.wait_for_timeout(500)
        assert page.evaluate("window.hurt") is None
        window.close()


def test_a_page_that_hears_nothing_covers_itself_within_a_second(page: Any) -> None:
    assert page.evaluate("armtempo.SILENT_MS + armtempo.LOOK_MS") < 1000
    silent = """ms => {
      armtempo.heard = performance.now() - ms;
      armtempo.look();
      return document.body.matches('.lost');
    }"""
    assert page.evaluate(silent, 1000 - page.evaluate("armtempo.LOOK_MS"))
    page.wait_for_selector("body:not(.lost)")  # it hears again


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


_FOCUS = """async () => {
  const found = [], tick = (ms) => new Promise(resolve => setTimeout(resolve, ms));
  for (const one of document.querySelectorAll('button, input, [tabindex="0"]:not(.q-tab)')) {
    if (!one.checkVisibility({visibilityProperty: true}) || one.disabled || one.closest('.disabled')) continue;
    const field = one.closest('.q-field');
    const shown = () => getComputedStyle(one).boxShadow.includes('5px') || field?.matches('.q-field--focused');
    for (let tries = 0; tries < 5 && !(document.activeElement === one && shown()); tries++) {
      one.focus();
      await tick(20 * tries); // a page that has just been built may take it away once
    }
    if (one.tabIndex < 0 || document.activeElement !== one || !shown()) found.push(one.outerHTML);
  }
  return found;
}"""
"""Controls that the tabulator does not reach, or that do not show it."""


def test_each_tab_is_in_view_readable_and_for_the_keyboard(page: Any) -> None:
    """On a desktop, a tablet and a phone, light and dark."""
    home(page)
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        for tab in TABS:
            show(page, tab)
            page.wait_for_selector(f".q-tab--active:has-text('{tab}')")
            page.keyboard.press("Tab")  # the focus shows if the last key was one of the keyboard
            assert page.evaluate(_FOCUS) == []
            for width, height in page_checks.VIEWS.values():
                page.set_viewport_size({"width": width, "height": height})
                for _ in range(10):  # charts and the picture follow a change of the size later
                    if not (found := page_checks.problems(page)):
                        break
                    page.wait_for_timeout(500)
                assert found == [], (scheme, tab, width)
    page.emulate_media(color_scheme="light")
    page.set_viewport_size(panels.SMALL)


_BUTTONS = """() => [...document.querySelectorAll('.armtempo-picture button, .armtempo-tabs button, footer button')]
  .filter(one => one.checkVisibility() && !one.disabled)
  .map(one => one.ariaLabel || [...one.querySelectorAll('.block')].map(text => text.textContent).join(' '))"""
"""Names of the buttons that can be pressed."""


def test_each_button_is_pressed_once(page: Any, panel: Panel) -> None:
    """Nothing fails in the page or the panel's program, and what opens is there."""
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    opened: list[Any] = []
    page.context.on("page", lambda other: opened.append(other))
    home(page)
    pressed: set[str] = set()
    for tab in TABS:
        show(page, tab)
        page.wait_for_selector(f".q-tab--active:has-text('{tab}')")
        while left := [name for name in page.evaluate(_BUTTONS) if name not in pressed]:
            name = left[0]  # others may come and go with it
            button = page.get_by_role("button", name=name, exact=True).first
            pressed.add(name)
            button.dispatch_event("click")  # notifications may cover it
            page.wait_for_timeout(100)
            for dialog in page.get_by_role("dialog").all():
                dialog.get_by_role("button", name="Cancel").click()
                dialog.wait_for(state="detached")
            if page.locator(".q-menu").count():
                page.keyboard.press("Escape")
            if "moving" in page.inner_text("#armtempo-state"):
                page.keyboard.press(" ")
                wait_for(page, "idle")
    for other in opened:
        assert "no such" not in other.inner_text("body")
        other.close()
    assert {"Home…", "Store…", "Plan", "Paste", "Self-test", "Go to home", "own x +", "Side"} <= pressed
    assert not errors
    panel.check()
    page.close()  # what is chosen on it is not what the next test expects


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


def _moved(page: Any, panel: Panel) -> str:
    """Where the arm is, after the time in which a press that was kept would move it."""
    page.wait_for_timeout(2000)
    assert not panels.rest(panel.state).moving
    return str(page.inner_text("#armtempo-where"))


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
    where = page.inner_text("#armtempo-where")
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
    assert _moved(page, panel) == where
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
