"""A page of the panel without a browser: what its controls show, and presses as a browser sends them."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
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
        with self.client:
            next(one for one in self.elements(ui.tab_panels)).set_value(tab)

    def look(self) -> None:
        """What the page does every quarter of a second."""
        with self.client:
            self.of.refresh()

    def elements(self, kind: type[Any] = ui.element) -> list[Any]:
        """The elements of a kind, in the order in which they were made."""
        return [one for one in self.client.elements.values() if isinstance(one, kind)]

    def named(self, name: str) -> Any:
        """The control of a name."""
        found = [one for one in self.elements() if _name(one) == name and not isinstance(one, ui.label)]
        assert found, (name, sorted({_name(one) for one in self.elements()}))
        return found[0]

    def texts(self) -> list[str]:
        """All texts that are in view."""
        return [
            one.text
            for one in self.elements(ui.label)
            if one.text and one.visible and all(around.visible for around in one.ancestors())
        ]

    def fire(self, element: Any, event: str, *arguments: Any) -> None:
        """An event of the browser; what it begins is waited for."""
        given = list(arguments) if len(arguments) != 1 else arguments[0]
        before = set(background_tasks.running_tasks)  # of the page itself
        with self.client:
            for listener in list(element._event_listeners.values()):
                if listener.type == event:
                    handle_event(
                        listener.handler,
                        GenericEventArguments(sender=element, client=self.client, args=given),
                    )
        self.loop.run_until_complete(
            asyncio.wait_for(asyncio.gather(*background_tasks.running_tasks - before), 60)
        )

    def press(self, name: str, value: Any = None, event: str = "click", late_s: float = 0.0) -> None:
        """Press a control that gives a command, as the page's script says it."""
        element = self.named(name)
        assert element.enabled, (
            name,
            [control.reason for control in self.of.controls if control.element is element],
        )
        said = asdict(fakes.press(self.operator))
        self.fire(element, event, {**said, "made_s": said["made_s"] - late_s}, value)


def _name(element: Any) -> str:
    return str(element.props.get("aria-label") or getattr(element, "text", "") or "")


@contextmanager
def pages(operator: PanelBoard) -> Iterator[Page]:
    """A page of an operator, in control."""
    loop = asyncio.new_event_loop()
    asyncio.set_event_loop(loop)
    before, core.loop = core.loop, loop
    client = Client(PageOf("/"))
    try:
        with client:
            of = layout.build(operator, ButtonHold(operator), ArmShape(operator.arm))
        operator.take_control(client.id)
        made = Page(operator, client, of, loop)
        made.look()
        yield made
    finally:
        client.delete()
        core.loop = before
        loop.close()
        asyncio.set_event_loop(None)
