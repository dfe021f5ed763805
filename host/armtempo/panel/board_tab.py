"""The board: its state, stored motions, program, messages and log."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from nicegui import background_tasks, run, ui

from armtempo.basics.errors import LinkError
from armtempo.deploy.firmware import image, write
from armtempo.link.board_messages import StoredMotion
from armtempo.panel import words
from armtempo.panel.live import Lines
from armtempo.panel.panel_board import Needs
from armtempo.panel.panel_page import named

if TYPE_CHECKING:
    from armtempo.diagnosis.selftest.result import SelfTest
    from armtempo.panel.panel_page import PanelPage
    from armtempo.panel.press import Press

_SHOWN = (
    "port",
    "board_id",
    "state",
    "fault",
    "arm",
    "arm_problem",
    "speed_percent",
    "max_rate",
    "max_rate_sum",
    "rates_measured",
    "free_flash",
    "free_heap",
    "frames_bad",
    "samples_lost",
)


class BoardTab:
    """The tab of one page."""

    def __init__(self, page: PanelPage) -> None:
        self._page = page
        self._operator = operator = page.operator
        self._stored_of: tuple[object, ...] = ()
        self._tested: SelfTest | None = None
        ui.label(words.STATUS).classes("text-subtitle2")
        columns = [{"name": name, "label": "", "field": name, "align": "left"} for name in ("key", "value")]
        self._state = ui.table(columns=columns, rows=[]).props(
            "dense flat hide-header hide-bottom wrap-cells"
        )
        self._no_board = ui.label(words.NO_BOARD).classes("armtempo-note")
        ui.label(words.STORED).classes("text-subtitle2")
        self._stored = ui.column()
        ui.label(words.PROGRAM).classes("text-subtitle2")
        with ui.row():
            for text, sure, call, needs in (
                (words.DEPLOY, words.SURE_DEPLOY, self._deploy, Needs.IDLE),
                (words.FLASH, words.SURE_FLASH, self._flash, Needs.IDLE),
                (words.SELFTEST, words.SURE_SELFTEST, self._selftest, Needs.COMMAND),
            ):
                page.button(text, partial(self._if_sure, text, sure, call), needs)
        ui.label(words.LOG).classes("text-subtitle2")
        self._log = _Shown(operator.log)
        with ui.row():
            ui.label(words.TRAFFIC).classes("text-subtitle2")
            named(ui.switch(on_change=lambda event: self._monitor(event.value)), words.TRAFFIC)
        self._traffic = _Shown(operator.traffic)
        self._traffic.log.set_visibility(False)
        columns = [{"name": key, "label": key, "field": key, "align": "left"} for key in words.VERDICT_KEYS]
        self._verdicts = ui.table(columns=columns, rows=[]).props("dense flat wrap-cells hide-bottom")
        self._verdicts.set_visibility(False)  # at the end, where it moves nothing
        page.on_look(self._look)

    def _look(self) -> None:
        state = self._operator.live.state
        self._no_board.set_visibility(state is None)
        if state is not None:
            values = asdict(state)
            rows = [
                {
                    "key": words.STATE_KEYS.get(key, key.replace("_", " ")),
                    "value": words.of_text(words.text(values[key])),
                }
                for key in _SHOWN
                if values[key] != ""
            ]
            if rows != self._state.rows:
                self._state.rows = rows
            # A command here, or another program, may have stored something
            now = state.board_id, state.free_flash, state.erasures, self._operator.ended
            if self._stored_of != now and not self._operator.busy:
                self._stored_of = now
                background_tasks.create(self._read())
        tested = self._operator.tested
        if tested is not None and tested is not self._tested:
            self._tested = tested
            lines = tested.to_json()["lines"]
            self._verdicts.rows = [
                {key: words.of_text(line[key]) for key in words.VERDICT_KEYS} for line in lines
            ]
            self._verdicts.set_visibility(True)
        self._log.look()
        if self._page.client in self._operator.monitors:
            self._traffic.look()

    def _monitor(self, wanted: bool) -> None:
        self._traffic.log.set_visibility(wanted)
        (self._operator.monitors.add if wanted else self._operator.monitors.discard)(self._page.client)

    # stored motions

    async def _read(self) -> None:
        with suppress(LinkError):  # the state shows that too
            motions = await run.io_bound(lambda: self._operator.board.list())
            if motions is None or self._stored.is_deleted:  # the panel ends, or its page is closed
                return
            self._stored.clear()
            with self._stored:
                if not motions:
                    ui.label(words.NOTHING_STORED).classes("armtempo-note")
                for motion in motions:
                    self._row(motion)

    def _row(self, motion: StoredMotion) -> None:
        operator, page, name = self._operator, self._page, motion.name

        def run_it() -> None:
            if motion.program:
                operator.board.run_program(name, operator.say)
            elif motion.sequence:
                operator.run_sequence(name)
            else:
                operator.board.run(name, 1, operator.runs, operator.part)

        with ui.row():
            kind = f"{motion.duration_s:.3f} s"
            if motion.sequence or motion.program:
                kind = words.A_SEQUENCE if motion.sequence else words.A_PROGRAM
            ui.label(words.plain(f"{name} · {kind}{words.BY_BUTTON if motion.default else ''}"))
            page.button(words.RUN, lambda press: page.do(press, name, run_it), look="outline dense")
            for text, call in (
                (words.RENAME, lambda _: self._rename(name)),
                (words.REMOVE, lambda _: self._remove(name)),
            ):
                page.button(text, call, Needs.COMMAND, look="flat dense")

    def _remove(self, name: str) -> None:
        def remove(press: Press) -> None:
            self._change(press, words.REMOVE, lambda: self._operator.board.remove(name))

        self._page.ask(words.plain(words.SURE_REMOVE.format(name=name)), words.REMOVE, remove)

    def _rename(self, name: str) -> None:
        def rename(press: Press) -> None:
            if wanted := new.value:
                self._change(press, words.RENAME, lambda: self._operator.board.rename(name, wanted))

        with self._page.ask("", words.RENAME, rename).place:
            new = ui.input(words.NEW_NAME, value=words.plain(name))

    def _change(self, press: Press, text: str, call: Callable[[], object]) -> None:
        self._page.do(press, text, call, Needs.COMMAND)

    # the board's program

    def _if_sure(self, text: str, sure: str, call: Callable[[Press], object], _: Press) -> None:
        self._page.ask(sure, text, call)

    def _deploy(self, press: Press) -> None:
        self._page.do(press, words.DEPLOY, self._operator.deploy, Needs.IDLE)

    def _selftest(self, press: Press) -> None:
        self._page.do(press, words.SELFTEST, self._operator.selftest, Needs.COMMAND)

    def _flash(self, press: Press) -> None:
        operator, port = self._operator, self._operator.port

        def work() -> None:
            found = image.find(Path())
            operator.without_board(lambda: write.flash(found, port, None, operator.say, operator.part))

        self._page.do(press, words.FLASH, work, Needs.IDLE)


class _Shown:
    """Lines that grow; only the new ones are sent."""

    def __init__(self, lines: Lines) -> None:
        self.log = ui.log(max_lines=200).classes("armtempo-chart")
        self._lines, self._count = lines, 0

    def look(self) -> None:
        """Show new lines."""
        count = self._lines.count
        new = min(count - self._count, self.log.max_lines or 0)
        for line in list(self._lines.last)[-new:] if new else ():
            self.log.push(words.plain(line))
        self._count = count


def build(page: PanelPage) -> None:
    """The tab."""
    BoardTab(page)
