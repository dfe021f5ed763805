"""The job: its file, a table of via points with what is required on the way to each, its options, its plan."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from nicegui import background_tasks, run, ui

from armtempo.basics.arrays import Array
from armtempo.kinematics.chain import chains_mm
from armtempo.kinematics.solver import moved_tool_deg
from armtempo.model import via_table
from armtempo.model.job import DEGREES, PATHS, TIMINGS
from armtempo.panel import words
from armtempo.panel.fields import Fields
from armtempo.panel.file_row import FileRow
from armtempo.panel.job_editor import OPTIONS
from armtempo.panel.job_plan import JobPlan
from armtempo.panel.panel_page import build_rows, named
from armtempo.panel.via_rows import ANGLES, POSE, WAY_KEYS, Via

if TYPE_CHECKING:
    from armtempo.panel.panel_page import PanelPage
    from armtempo.panel.press import Press

_CHOICES = {"path": PATHS, "timing": TIMINGS, "degree": DEGREES}
_SWITCHES = ("line", "stop")


class JobTab:
    """The tab of one page; the job and its plan are the panel's, so that every page has the same."""

    def __init__(self, page: PanelPage) -> None:
        self._page = page
        self._operator = page.operator
        self._jobs = page.operator.jobs
        self._open: set[int] = set()
        """Via points whose keys are shown."""
        self._shown = self._jobs.version, self._jobs.is_solved
        self._solving = False
        self._cells, self._choices = Fields(), Fields()
        self._built: object = None
        """What the table and the options were built for."""
        page.scene.picked, page.scene.dragged = self._pick, self._drag
        self._file = FileRow(page, self._jobs, words.JOB_FILE, words.of_job)
        with ui.column().classes("full-width") as self._place:
            self._table()
        ui.label(words.DRAG_HINT).classes("armtempo-note")
        self._offered = ui.column()
        self._options()
        self._plan = JobPlan(page)
        self._draw_vias()
        page.on_look(self._look)
        page.on_arm(self._options.refresh)  # the frames and tools to choose
        ui.context.client.on_connect(self._cells.send_again)
        ui.context.client.on_connect(self._choices.send_again)

    # the table

    @ui.refreshable_method
    def _table(self) -> None:
        self._cells.clear()
        self._built = self._form()
        joints = self._operator.arm.driven
        columns = f"2.2rem 4.6rem repeat({len(joints)}, minmax(4rem, 6rem)) auto"
        grid = ui.element("div").classes("armtempo-grid").style(f"grid-template-columns: {columns}")
        with grid:
            for text in ("", "", *(joint.labelled for joint in joints), ""):
                ui.label(words.plain(text)).classes("text-caption ellipsis").props["title"] = words.plain(
                    text
                )
        build_rows(grid, len(self._jobs.vias), self._row)
        with ui.row():
            ui.button(
                words.NEW_VIA, on_click=lambda: self._edit(self._jobs.insert, len(self._jobs.vias))
            ).props("outline no-caps")
            ui.button(words.FROM_ARM, on_click=self._take_posture).props("outline no-caps")
            ui.button(words.PASTE, on_click=self._paste).props("outline no-caps")

    def _form(self) -> object:
        """What the fields are built for: their values may change without building them anew."""
        jobs = self._jobs
        given = {key: jobs.option(key) for key in _CHOICES}
        others = [text for key, text in given.items() if text and text not in map(str, _CHOICES[key])]
        forms = [(via.form, _shown_keys(via)) for via in jobs.vias]
        return jobs.file, forms, sorted(self._open), others

    def _of(self, number: int, text: Callable[[Via], str]) -> Callable[[], str]:
        """A text of a via point, as it is when it is asked for."""
        return lambda: text(self._jobs.vias[number])

    def _row(self, number: int) -> None:
        via = self._jobs.vias[number]
        ui.label(f"P{number}")
        with ui.label(_kind(via)).classes("armtempo-note") as kind:
            hint = ui.tooltip(_hint(via))
        self._cells.add(kind, self._of(number, _kind), kind.set_text)
        self._cells.add(hint, self._of(number, _hint), hint.set_text)
        for index, joint in enumerate(self._operator.arm.driven):
            box = ui.input(value=_cell(index, via)).props("dense outlined inputmode=decimal")
            named(box, f"P{number} {joint.name}")
            self._cells.add(box, self._of(number, partial(_cell, index)))
            if via.form == ANGLES:
                self._on_typed(box, self._jobs.set_angle, number, index)
            else:
                box.props("readonly")
        with ui.row().classes("no-wrap armtempo-actions"):
            more = ui.button(icon="tune", on_click=lambda: self._toggle(number)).props("flat dense")
            named(more, f"{words.MORE} P{number}")
            with ui.button(icon="more_vert").props("flat dense") as change:
                named(change, f"{words.CHANGES} P{number}")
                menu = ui.menu()
            change.on_click(lambda: self._fill(menu, number))
        if number in self._open:
            self._keys(number, via)

    def _fill(self, menu: ui.menu, number: int) -> None:
        """The changes of a via point, which forty rows need not have before they are asked for."""
        if menu.default_slot.children:
            return
        jobs = self._jobs
        with menu:
            for text, call in (
                (words.INSERT, partial(jobs.insert, number)),
                (words.COPY, partial(jobs.copy, number)),
                (words.UP, partial(jobs.move, number, -1)),
                (words.DOWN, partial(jobs.move, number, 1)),
                (words.AS_POSE, partial(jobs.set_pose, number)),
                (words.AS_ANGLES, partial(jobs.set_own_angles, number)),
                (words.DELETE, partial(jobs.delete, number)),
            ):
                ui.menu_item(text, on_click=partial(self._edit, call))

    def _keys(self, number: int, via: Via) -> None:
        """The keys of a via point: of its pose, and of the way to it."""
        with ui.row().classes("armtempo-keys"):
            for key in (*_shown_keys(via), *WAY_KEYS):
                text, value = via.text(key), self._of(number, partial(_text, key))
                label = words.VIA_KEYS.get(key, key)
                if key in _SWITCHES:
                    switch = ui.switch(label, value=text == "true")
                    named(switch, f"P{number}: {label}")
                    self._cells.add(switch, value, partial(_switch, switch))
                    switch.on_value_change(lambda event, key=key: self._turn(number, key, event.value))
                    continue
                box = ui.input(label, value=text).props("dense outlined").classes("armtempo-value")
                named(box, f"P{number}: {label}")
                self._cells.add(box, value)
                self._on_typed(box, self._jobs.set_key, number, key)

    def _turn(self, number: int, key: str, on: bool) -> None:
        """Set or remove a key by its switch; one that was turned to show the file changes nothing."""
        if on != (self._jobs.vias[number].text(key) == "true"):
            self._edit(self._jobs.set_key, number, key, "true" if on else "")

    def _toggle(self, number: int) -> None:
        self._open ^= {number}
        self._table.refresh()

    def _on_typed(self, box: ui.input, call: Callable[..., object], *given: Any) -> None:
        """Take what is typed into a field."""
        box.on("change", lambda event: self._typed(event, call, *given))

    def _typed(self, event: Any, call: Callable[..., object], *given: Any) -> None:
        """Take what was typed."""
        self._edit(call, *given, str(event.args or "").strip())

    def _edit(self, call: Callable[..., object], *arguments: Any) -> None:
        """Change the job, and show it at once."""
        self._file.type_in(call, *arguments)
        self._look()

    def _take_posture(self) -> None:
        angles = [float(angle) for angle in self._operator.live.angles_deg]
        self._edit(self._jobs.insert, len(self._jobs.vias), angles)

    async def _paste(self) -> None:
        def take(press: Press) -> None:
            found = via_table.of_text(str(text.value or ""), words.PASTED, self._jobs.arm)
            poses = [dict(pose) for pose in found.poses]
            self._file.change(
                lambda: self._jobs.set_vias(poses or [{ANGLES: row} for row in found.via_deg.tolist()]), press
            )

        asked = self._page.ask("", words.PASTE, take)
        with asked.place:
            text = ui.textarea(words.PASTE_HINT).style("min-width: min(24rem, 80vw)")

    # in 3-D

    def _draw_vias(self) -> None:
        angles = [via.angles_deg for via in self._jobs.vias]
        rows = np.array(
            [row for row in angles if row is not None and len(row) == len(self._operator.arm.driven)]
        )
        if len(rows) == len(angles) and len(rows) and np.isfinite(rows).all():
            self._page.scene.dots(chains_mm(self._jobs.tooled_arm, rows)[:, -1])

    async def _pick(self, number: int) -> None:
        """Show a via point and the other postures that reach it."""
        vias = self._jobs.vias
        if number < len(vias) and (angles := vias[number].angles_deg) is not None:
            await self._offer(number, chains_mm(self._jobs.tooled_arm, np.array(angles))[-1])

    async def _drag(self, number: int, position_mm: Array) -> None:
        """Move a via point to where it was dragged; back if no posture reaches that."""
        vias = self._jobs.vias
        if number < len(vias):
            if vias[number].form == POSE:
                self._edit(self._jobs.set_position, number, position_mm.tolist())
            elif vias[number].form == ANGLES:
                await self._offer(number, position_mm)
            self._draw_vias()

    async def _offer(self, number: int, position_mm: Array) -> None:
        """Take the posture that is nearest to the via point's, and offer the others, which takes some time."""
        jobs, version = self._jobs, self._jobs.version
        arm, angles = jobs.tooled_arm, np.array(jobs.vias[number].angles_deg)
        postures = await self._page.threaded(lambda: moved_tool_deg(arm, angles, position_mm.tolist()))
        if postures is None or jobs.version != version:  # nothing reaches it, or it is another one by now
            return
        texts = [arm.texts.listed(f"{angle:.1f}" for angle in posture) for posture in postures]
        self._offered.clear()
        with self._offered:
            ui.label(words.POSTURES_OF.format(number=number, count=len(postures)))
            ui.radio(
                dict(enumerate(texts)),
                value=0,
                on_change=lambda event: self._take(number, postures[int(event.value)]),
            ).props("dense")
        self._take(number, postures[0])

    def _take(self, number: int, posture_deg: Array) -> None:
        self._page.show_ghost(posture_deg)
        if self._jobs.vias[number].form == ANGLES:
            self._edit(self._jobs.set_angles, number, posture_deg.tolist())

    # options

    @ui.refreshable_method
    def _options(self) -> None:
        self._choices.clear()
        with ui.row().classes("armtempo-fields"):
            for key in OPTIONS:
                self._option(key)

    def _option(self, key: str) -> None:
        """The field of a key of the job; an empty one is the default."""
        value, label = self._jobs.option(key), words.OPTIONS[key]
        choices: Any = _CHOICES.get(key)
        arm = self._operator.arm
        of_arm = {
            "holds": [load.name for load in arm.loads],
            "frame": [frame.name for frame in arm.frames],
            "tool": [tool.name for tool in arm.tools],
        }
        if key in of_arm:
            choices = of_arm[key]
            if not choices:
                return
        if choices is None:
            box = ui.input(label, value=value).props("dense outlined").classes("armtempo-wide")
            self._choices.add(box, partial(self._jobs.option, key))
            self._on_typed(box, self._jobs.set_option, key)
            return
        texts = {"": words.DEFAULT, **{str(one): words.CHOICES.get(str(one), str(one)) for one in choices}}
        if value not in texts:
            texts[value] = words.plain(value)
        chosen = ui.select(texts, value=value, label=label).props("dense outlined").classes("armtempo-option")
        chosen.on_value_change(lambda event: self._edit(self._jobs.set_option, key, str(event.value or "")))
        self._choices.add(chosen, partial(self._jobs.option, key))

    def _look(self) -> None:
        """Show what has changed, also on another page; the angles of poses come a little later."""
        jobs = self._jobs
        if self._shown != (jobs.version, jobs.is_solved):
            self._shown = jobs.version, jobs.is_solved
            if self._form() != self._built:
                self._table.refresh()  # later
                self._options.refresh()
            else:
                self._cells.look()
                self._choices.look()
            self._draw_vias()
        if not jobs.is_solved and not self._solving:
            self._solving = True
            background_tasks.create(self._solve())
        self._file.look()
        self._plan.look()

    async def _solve(self) -> None:
        try:
            await run.io_bound(self._jobs.solve)
        finally:
            self._solving = False
        if not self._place.is_deleted:
            with self._place:
                self._look()


def _shown_keys(via: Via) -> list[str]:
    """The keys of its pose, which have fields besides those of the way to it."""
    return [key for key in via.values if key not in (ANGLES, *WAY_KEYS)]


def _text(key: str, via: Via) -> str:
    return via.text(key)


def _switch(switch: ui.switch, text: str) -> None:
    switch.set_value(text == "true")


def _kind(via: Via) -> str:
    """How a via point is given, and what is required on the way to it."""
    ways = [words.WAYS[key] for key in WAY_KEYS if key in via.values and key in words.WAYS]
    return ", ".join([words.FORMS[via.form], *ways])


def _hint(via: Via) -> str:
    """Its keys."""
    given = ", ".join(f"{key} = {via.text(key)}" for key in via.values if key != ANGLES)
    return words.plain(given) or words.FORMS[via.form]


def _cell(index: int, via: Via) -> str:
    """What is written in the place of an angle."""
    if via.angles_deg is not None:
        return f"{via.angles_deg[index]:g}" if index < len(via.angles_deg) else ""
    values = via.values.get(ANGLES)
    found = values[index] if isinstance(values, list) and index < len(values) else ""
    # As above, as one of the others is what is no angle
    return f"{found:g}" if isinstance(found, int | float) and not isinstance(found, bool) else str(found)


def build(page: PanelPage) -> None:
    """The tab."""
    JobTab(page)
