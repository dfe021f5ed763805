"""A page of the panel without a browser: what its controls show, and presses as a browser sends them."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import Any

from armtempo.panel import layout
from armtempo.panel.arm_scene import ArmShape
from armtempo.panel.hold import ButtonHold
from armtempo.panel.panel_board import PanelBoard
from armtempo.panel.panel_page import PanelPage
from nicegui import Client, background_tasks, core, ui
from nicegui.events import GenericEventArguments, handle_event
from nicegui.page import page as PageOf

from tests.host.panel import fakes


@dataclass
class Page:
    """One page."""

    operator: PanelBoard
    client: Client
    of: PanelPage
    loop: asyncio.AbstractEventLoop

    def show(self, tab: str) -> None:
        """Go to a tab."""
        panels = next(one for one in self.elements(ui.tab_panels))
        self.act(lambda: panels.set_value(tab))

    def look(self) -> None:
        """What the page does every quarter of a second."""
        self.act(self.of.refresh)

    def act(self, call: Callable[[], object]) -> None:
        """Call something, and wait for what it begins."""

        async def ended() -> None:
            before = set(background_tasks.running_tasks)
            with self.client:
                if asyncio.iscoroutine(begun := call()):
                    await begun
            for _ in range(3):  # a table that is built anew begins a little later
                await asyncio.sleep(0)
            await asyncio.wait_for(asyncio.gather(*(background_tasks.running_tasks - before)), 60)

        self.loop.run_until_complete(ended())

    def elements(self, kind: type[Any] = ui.element) -> list[Any]:
        """The elements of a kind, in the order in which they were made."""
        return [one for one in self.client.elements.values() if isinstance(one, kind)]

    def named(self, name: str) -> Any:
        """The control of a name."""
        found = [
            one for one in self.elements() if _name(one) == name and not isinstance(one, ui.label | ui.tab)
        ]
        assert found, (name, self.names())
        return found[0]

    def names(self) -> list[str]:
        """The names of all controls."""
        return sorted({_name(one) for one in self.elements()})

    def unfold(self, text: str) -> None:
        """Open a folded part."""
        self.act(lambda: next(one for one in self.elements(ui.expansion) if one.text == text).open())

    def texts(self) -> list[str]:
        """All texts that are in view."""
        return [
            one.text
            for one in self.elements(ui.label)
            if one.text and one.visible and all(around.visible for around in one.ancestors())
        ]

    def fire(self, element: Any, event: str, *arguments: Any, is_command: bool = False) -> None:
        """An event of the browser, for what takes commands alone if it is one; what it begins is waited for."""
        given: Any = list(arguments) if len(arguments) != 1 else arguments[0]

        def send() -> None:
            for listener in list(element._event_listeners.values()):
                if listener.type == event and (listener.js_handler or not is_command):
                    sent = GenericEventArguments(sender=element, client=self.client, args=given)
                    handle_event(listener.handler, sent)

        self.act(send)

    def answer(self, name: str) -> None:
        """Press the button of that name in the dialog that is open."""
        buttons = [one for one in self.elements(ui.dialog)[-1].descendants() if _name(one) == name]
        self.press_one(buttons[-1])

    def press(self, name: str, value: Any = None, event: str = "click", late_s: float = 0.0) -> None:
        """Press a control that gives a command, as the page's script says it."""
        self.press_one(self.named(name), value, event, late_s)

    def press_one(self, element: Any, value: Any = None, event: str = "click", late_s: float = 0.0) -> None:
        """Press a control."""
        reasons = [control.reason for control in self.of.controls if control.element is element]
        assert element.enabled, (_name(element), reasons)
        said = asdict(fakes.press(self.operator))
        self.fire(element, event, {**said, "made_s": said["made_s"] - late_s}, value, is_command=True)

    def done(self) -> None:
        """Wait for the running command."""
        fakes.wait(lambda: not self.operator.busy)
        self.look()


def _name(element: Any) -> str:
    names = (element.props.get("aria-label"), getattr(element, "text", ""), element.props.get("label"))
    return str(next((name for name in names if name), ""))


async def built(client: Client, operator: PanelBoard) -> PanelPage:
    """The page of a client, as the server builds it."""
    with client:
        return await layout.build(operator, ButtonHold(operator), ArmShape(operator.arm))


@contextmanager
def pages(operator: PanelBoard) -> Iterator[Page]:
    """A page of an operator, in control."""
    errors: list[BaseException] = []
    loop = asyncio.new_event_loop()
    asyncio.set_event_loop(loop)
    before, core.loop = core.loop, loop
    handle, core.app.handle_exception = core.app.handle_exception, errors.append  # type: ignore[method-assign]
    client = Client(PageOf("/"))
    try:
        of = loop.run_until_complete(built(client, operator))
        operator.take_control(client.id)
        made = Page(operator, client, of, loop)
        made.look()
        yield made
    finally:
        client.delete()
        for task in asyncio.all_tasks(loop):
            task.cancel()
        loop.run_until_complete(asyncio.sleep(0))
        core.loop = before
        core.app.handle_exception = handle  # type: ignore[method-assign]
        loop.close()
        asyncio.set_event_loop(None)
    assert errors == []
