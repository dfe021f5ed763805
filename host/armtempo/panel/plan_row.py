"""The row of a tab that plans: its button, how far it is, and a button that cancels it."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING

from nicegui import run, ui

from armtempo.basics.errors import ArmtempoError, InputError
from armtempo.basics.progress import Progress
from armtempo.panel import words
from armtempo.panel.panel_board import Needs

if TYPE_CHECKING:
    from armtempo.panel.panel_page import PanelPage
    from armtempo.panel.press import Press


class PlanRow:
    """Its parts on one page.

    ``begin`` gives what plans, in a thread, and raises InputError if nothing can be planned; ``of`` puts an error into
    the words of the tab.
    """

    def __init__(
        self,
        page: PanelPage,
        begin: Callable[[], Callable[[Progress], object]],
        needs: Needs,
        why_not: Callable[[], str],
        of: Callable[[ArmtempoError], str],
    ) -> None:
        self._page, self._begin, self._needs, self._of = page, begin, needs, of
        self._planning = self._cancelled = False
        page.button(
            words.PLAN, self._plan, needs, lambda: self.why_not() or why_not(), look="outline icon=insights"
        )
        self._cancel_button = ui.button(words.CANCEL, on_click=self._cancel).props("flat no-caps")
        self._bar = ui.linear_progress(0.0, show_value=False).classes("armtempo-planning")
        self._show(False)

    def why_not(self) -> str:
        """Why nothing else can be done with what is planned; "" if it can."""
        return words.BUSY.format(what=words.PLAN) if self._planning else ""

    def _plan(self, press: Press) -> Awaitable[None]:
        self._page.operator.check(self._page.client, press, self._needs)
        return self._wait_for(self._begin())

    async def _wait_for(self, work: Callable[[Progress], object]) -> None:
        self._show(True)
        self._page.refresh()
        try:
            await run.io_bound(work, self._progress)
        except ArmtempoError as error:
            ui.notify(self._of(error), type="negative", multi_line=True, timeout=8000)
        except asyncio.CancelledError:  # the panel ends
            pass
        finally:
            self._show(False)
            self._page.refresh()

    def _show(self, planning: bool) -> None:
        self._planning, self._cancelled = planning, False
        self._bar.value = 0.0
        self._bar.set_visibility(planning)
        self._cancel_button.set_visibility(planning)

    def _progress(self, done: float, whole: float) -> None:
        if self._cancelled:
            raise InputError(words.CANCELLED, words.PLAN_AGAIN)
        self._bar.value = done / whole if whole else 0.0

    def _cancel(self) -> None:
        self._cancelled = True
