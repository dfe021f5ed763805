"""What is seen and pressed: the picture, each tab in view and for the keyboard, each button."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from tests.system import page_checks, panels
from tests.system.panel.files import TABS, show, undo_all
from tests.system.panels import Panel, home, wait_for

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("panel")]


@pytest.fixture
def picture(window: Any, panel: Panel) -> Iterator[Any]:
    """A page with the picture of the arm, which the others are without."""
    page = panels.opened(window, panel.address)
    yield page
    page.close()


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
    page.wait_for_function(_IS_DRAWN, arg="via 1")
    cell = page.get_by_label("P1 joint 1")
    before = cell.input_value()
    page.mouse.click(*page.evaluate(_PLACE, "via 1"))
    page.wait_for_selector("text=P1: postures that reach it")
    assert cell.input_value() == before
    x, y = page.evaluate(_PLACE, "via 1")
    page.mouse.down()
    page.mouse.move(x + 15, y + 15, steps=5)
    page.mouse.up()
    moved = "before => document.querySelector('[aria-label=\"P1 joint 1\"]').value != before"
    page.wait_for_function(moved, arg=before)


def test_a_page_that_hears_nothing_covers_itself_within_a_second(page: Any) -> None:
    assert page.evaluate("armtempo.SILENT_MS + armtempo.LOOK_MS") < 1000
    silent = """ms => {
      armtempo.heard = performance.now() - ms;
      armtempo.look();
      return document.body.matches('.lost');
    }"""
    assert page.evaluate(silent, 1000 - page.evaluate("armtempo.LOOK_MS"))
    page.wait_for_selector("body:not(.lost)")  # it hears again
    first = "ms => { armtempo.is_first = true; return (" + silent + ")(ms); }"  # a page that never connects
    assert not page.evaluate(first, page.evaluate("armtempo.FIRST_MS") - 5000)
    assert page.evaluate(first, page.evaluate("armtempo.FIRST_MS") + 1)
    page.wait_for_selector("body:not(.lost)")
    keys = """() => {
      const sent = [], emit = window.emitEvent;
      window.emitEvent = (name) => sent.push(name);
      document.body.classList.add('lost');
      const typed = document.createElement('input');
      document.body.append(typed);
      for (const key of ['Enter', ' ', 'Escape'])
        typed.dispatchEvent(new KeyboardEvent('keydown', {key, bubbles: true, cancelable: true}));
      typed.remove();
      document.body.classList.remove('lost');
      window.emitEvent = emit;
      return sent;
    }"""
    assert page.evaluate(keys) == 2 * ["armtempo-stop"]  # which the server may hear all the same


@pytest.mark.parametrize(
    ("places", "texts"),
    [
        ([[0, 0], [100, 0], [0, 50]], ["P0", "P1", "P2"]),
        ([[0, 0], [4, 3], [8, 3], [300, 0]], ["P0–2", "P3"]),
        ([[0, 0], [200, 0], [3, 0]], ["P0, 2", "P1"]),
        ([[0, 0], [20, 0], [33, 0]], ["P0–2"]),  # the second and third as one, longer, would cover the first
        ([], []),
    ],
)
def test_names_of_via_points_that_would_cover_each_other_are_one(
    page: Any, places: list[list[float]], texts: list[str]
) -> None:
    assert page.evaluate("places => armtempo.merged(places).map(one => one.text)", places) == texts


def test_escape_answers_a_question_with_no(page: Any) -> None:
    show(page, "Job")
    panels.press(page, page.get_by_role("button", name="New…", exact=True))
    name = page.get_by_label("New name")
    name.fill("other")
    page.keyboard.press("Escape")
    name.wait_for(state="detached")
    assert page.get_by_role("button", name="New…", exact=True).count() == 1


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
    """On desktops, a tablet and a phone, below a banner; in the dark the colours alone are others, at any size."""
    home(page)
    show(page, "Board")
    panels.press(page, page.get_by_role("button", name="Flash", exact=True))
    panels.answer(page, "Flash")
    page.wait_for_selector(".armtempo-fault:has-text('no firmware given')")
    sizes = {"light": [*page_checks.VIEWS.values()], "dark": [page_checks.VIEWS["wide"]]}
    for scheme, views in sizes.items():
        page.emulate_media(color_scheme=scheme)
        for tab in TABS:
            show(page, tab)
            page.wait_for_selector(f".q-tab--active:has-text('{tab}')")
            if (tab, scheme) == ("Job", "light"):  # a row with its fields, one of them with a value
                page.get_by_label("Line, arc, stop, speed: P1").click()
                page.get_by_label("P1: Tool speed, mm/s").fill("40")
            page.keyboard.press("Tab")  # the focus shows if the last key was one of the keyboard
            assert scheme == "dark" or page.evaluate(_FOCUS) == []
            for width, height in views:
                page.set_viewport_size({"width": width, "height": height})
                for _ in range(10):  # charts and the picture follow a change of the size later
                    if not (found := page_checks.problems(page)):
                        break
                    page.wait_for_timeout(500)
                assert found == [], (scheme, tab, width)
    page.emulate_media(color_scheme="light")
    page.set_viewport_size(panels.SMALL)
    show(page, "Job")
    undo_all(page)
    page.get_by_role("button", name="Close", exact=True).click()
    page.locator(".armtempo-banner").wait_for(state="hidden")


_UNFOLD = "document.querySelectorAll('.q-expansion-item--collapsed .q-item').forEach(one => one.click())"
_BUILT = """() => [...document.querySelectorAll('.armtempo-expansion')].filter(one => one.checkVisibility())
  .every(one => one.querySelector('.q-expansion-item__content').textContent)"""
_BUTTONS = """() => [...document.querySelectorAll('.armtempo-page button')]
  .filter(one => one.checkVisibility() && !one.disabled)
  .map(one => one.ariaLabel || [...one.querySelectorAll('.block')].map(text => text.textContent).join(' '))"""


def _buttons(page: Any) -> list[str]:
    """Names of the buttons that can be pressed, also in what is folded."""
    page.evaluate(_UNFOLD)
    page.wait_for_function(_BUILT)
    found: list[str] = page.evaluate(_BUTTONS)
    return found


def test_each_button_is_pressed_once(page: Any, panel: Panel) -> None:
    """Nothing fails in the page or the panel's program, and what opens is there."""
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    opened: list[Any] = []
    page.context.on("page", lambda other: opened.append(other))
    page.reload()  # what other tests left on it is gone
    page.wait_for_selector("text=In control")
    home(page)
    pressed: set[str] = set()
    for tab in TABS:
        show(page, tab)
        page.wait_for_selector(f".q-tab--active:has-text('{tab}')")
        page.wait_for_timeout(500)
        while left := [name for name in _buttons(page) if name not in pressed]:
            name = left[0]  # others may come and go with it
            button = page.get_by_role("button", name=name, exact=True).first
            pressed.add(name)
            button.dispatch_event("click")  # notifications may cover it
            page.wait_for_timeout(100)
            while page.get_by_role("dialog").count():  # on a busy machine one may come late
                dialog = page.get_by_role("dialog").last.element_handle()
                dialog.query_selector("button:has-text('Cancel')").dispatch_event("click")
                page.wait_for_function("dialog => !dialog.isConnected", arg=dialog)
            if page.locator(".q-menu").count():
                page.keyboard.press("Escape")
            if "moving" in page.inner_text("#armtempo-state"):
                page.keyboard.press("Escape")
                wait_for(page, "idle")
    for other in opened:
        assert "no such" not in other.inner_text("body")
        other.close()
    assert {
        "Stop",
        "Home…",
        "Store…",
        "Plan",
        "Paste",
        "Self-test",
        "Go to home",
        "own x +",
        "Show",
        "Begin",
        "Side",
    } <= pressed
    assert not errors
    panel.check()
    page.close()  # what is chosen on it is not what the next test expects
