"""The job that the panel edits: its via points, their keys, its plan."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit
from tomlkit.items import Array

from armtempo.basics import toml_table
from armtempo.basics.errors import ArmtempoError, InputError
from armtempo.encoding import made_with
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.joint_unit import NEUTRAL
from armtempo.model.plan import Plan
from armtempo.model.tool_pose import BASE
from armtempo.panel.file_editor import FileEditor, put
from armtempo.panel.toml_blocks import TomlBlocks
from armtempo.panel.via_rows import ANGLES, POSE, WHERE, Via, key_in, pose_values, rounded, set_where, via_of
from armtempo.planning import planner

_NEW = "panel_job"
_LIST = "via_deg"
OPTIONS = (
    "path",
    "corridor_deg",
    "corridor_mm",
    "timing",
    "degree",
    "refine",
    "speed_mm_s",
    "acceleration_mm_s2",
    "holds",
    "frame",
    "tool",
)
"""Keys of the job that are edited as fields."""


class JobEditor(FileEditor):
    """The edited job and its plan."""

    kind = "job"

    def __init__(self, arm: Arm, folder: Path, job_file: Path | None) -> None:
        super().__init__(arm, folder)
        self.plan: Plan | None = None
        """The last plan."""
        self._planned = -1
        self._solved: tuple[int, list[Via], bool] = (-1, [], False)
        """A version, its via points with the angles that are known, and whether they were searched for."""
        if job_file is None:
            self._set(self.new_text(_NEW))
        else:
            self.load(job_file)

    def new_text(self, name: str) -> str:
        """A job that rests at home."""
        row = ", ".join(f"{float(angle):g}" for angle in self.arm.home_deg)
        return f'name = "{name}"\n{self.arm.texts.list_key("via_deg")} = [\n    [{row}],\n    [{row}],\n]\n'

    def is_one(self, path: Path) -> bool:
        """Whether a file describes a job, or is no TOML."""
        try:
            table = toml_table.read(path)
        except InputError:
            return True
        listed = any(table.has(key) for key in ("via", _LIST, NEUTRAL[_LIST]))
        return table.has("name") and listed and not table.has("joint")

    def check(self, text: str, file: Path) -> None:
        """Raise InputError if the text is no job."""
        Job.of_table(toml_table.parse(text, str(file)), self.arm)

    def check_to_open(self, text: str, file: Path) -> None:
        """Raise InputError if the text is no job, PlanError if no posture reaches a pose in it, which takes some time:
        told now instead of in the table."""
        planner.via_angles(self.arm, Job.of_table(toml_table.parse(text, str(file)), self.arm))

    def take(self, file: Path, text: str) -> None:
        """Edit the text of a file that was checked."""
        super().take(file, text)
        self.plan = None

    def new(self, name: str) -> None:
        """Edit a new job."""
        super().new(name)
        self.plan = None

    # what is edited

    def job(self) -> Job:
        """The job; raises InputError as for its file, with via point and key."""
        return Job.of_table(toml_table.parse(self.text, str(self.target)), self.arm)

    @property
    def vias(self) -> list[Via]:
        """The via points; poses have angles once ``solve`` has found them."""
        return self._present[1]

    @property
    def is_solved(self) -> bool:
        """Whether the angles of all poses were searched for."""
        return self._present[2]

    @property
    def _present(self) -> tuple[int, list[Via], bool]:
        if (found := self._solved)[0] != self.version:
            given = [via_of(values) for values in self._rows()]
            found = self.version, given, all(via.angles_deg is not None for via in given)
            self._solved = found
        return found

    def solve(self) -> None:
        """Find the angles of all poses, in any thread: where none reaches one, that takes half a second.

        A job that is not valid, or has a pose that nothing reaches, stays without them.
        """
        version, found, solved = self._present
        if solved:
            return
        with suppress(ArmtempoError, ValueError):  # ValueError: it was changed meanwhile
            angles = planner.via_angles(self.arm, self.job())[0]
            pairs = zip(found, angles, strict=True)
            found = [Via(via.form, via.values, tuple(map(float, row))) for via, row in pairs]
        if version == self.version:
            self._solved = version, found, True

    def _rows(self) -> list[dict[str, Any]]:
        """The via points' keys; a list of positions is called ANGLES, however the file calls it."""
        if self._is_list:
            return [{ANGLES: row} for row in self._values[self._list_key]]
        found = self._values.get("via", [])
        return [
            {ANGLES if key == NEUTRAL[ANGLES] else key: value for key, value in row.items()} for row in found
        ]

    @property
    def _list_key(self) -> str:
        """The key of all via points as one list."""
        return NEUTRAL[_LIST] if self.arm.slides or NEUTRAL[_LIST] in self._values else _LIST

    def _written(self, values: dict[str, Any]) -> dict[str, Any]:
        """The keys of a via point as a file of this arm has them."""
        return {
            self.arm.texts.list_key(key) if key == ANGLES else key: value for key, value in values.items()
        }

    def take_arm(self, arm: Arm) -> None:
        """Take another version of the arm; a plan that it makes old is old."""
        before = self._understood()
        super().take_arm(arm)
        if before != self._understood() or self._moved_since(arm):
            self.version += 1

    def _understood(self) -> object:
        """What the text means with the arm as it is; None if it is not valid."""
        with suppress(ArmtempoError):
            return self.job(), self.tooled_arm.tool
        return None

    def _moved_since(self, arm: Arm) -> bool:
        """Whether a frame or the tool of the plan has changed."""
        try:
            if self.plan is not None:
                made_with.check_surroundings(self.plan.name, self.plan, arm)
        except InputError:
            return True
        return False

    # the plan

    def planned(self, plan: Plan, version: int) -> None:
        """Keep a plan of the job as it was at ``version``."""
        self.plan, self._planned = plan, version

    @property
    def plan_is_old(self) -> bool:
        """Whether the job was changed after it was planned, or a posture, frame or tool that it names."""
        return self.plan is not None and self._planned != self.version

    # changes

    def set_angle(self, number: int, joint: int, text: str) -> None:
        """Set an angle of a via point that is given by angles."""
        value = toml_table.typed(text) if text else ""
        if self._is_list:
            self._change_list(lambda rows: rows[number].__setitem__(joint, value))
        else:
            self._change_table(number, lambda table: table[key_in(table)].__setitem__(joint, value))

    def set_angles(self, number: int, angles_deg: Sequence[float]) -> None:
        """Give a via point by these angles, degrees (J,), instead of what it was given by."""
        values = rounded(angles_deg)
        if self._is_list:
            self._change_list(lambda rows: rows.__setitem__(number, values))
        else:
            self._change_table(number, lambda table: set_where(table, self._written({ANGLES: values})))

    def set_key(self, number: int, key: str, text: str) -> None:
        """Set a key of a via point; "" removes it."""
        if text != self.vias[number].text(key):
            self._change_table(number, lambda table: put(table, key, text))

    @property
    def tooled_arm(self) -> Arm:
        """The arm with the job's tool on it; without one while the job names a tool that there is not."""
        try:
            return self.arm.with_tool(self.option("tool"))
        except InputError:
            return self.arm

    def _frame(self, number: int) -> str:
        """The frame in which a via point is given."""
        return str(self._rows()[number].get("frame", self._values.get("frame", BASE)))

    def set_position(self, number: int, position_mm: Sequence[float]) -> None:
        """Move a via point that is given as a pose with ``position_mm``, here in the base; its orientation stays."""
        frame = self.arm.frame(self._frame(number))
        own = frame[:3, :3].T @ (np.asarray(position_mm) - frame[:3, 3])
        values = [round(float(value), 3) for value in own]
        self._change_table(number, lambda table: table.update({POSE: values}))

    def _angles(self, number: int) -> tuple[float, ...]:
        """The angles of a via point; raises InputError if it has none, or they were not searched for."""
        angles = self.vias[number].angles_deg
        if angles is None and not self.is_solved:
            raise InputError(f"P{number}: the angles of its pose are being searched for", "try again soon")
        if angles is None:
            raise InputError(
                f"P{number} has no angles: no posture reaches it", "correct it, or the job, first"
            )
        return angles

    def set_pose(self, number: int) -> None:
        """Give a via point by the pose of the tool there; raises InputError for an arm that has no form of a pose."""
        pose = pose_values(self.tooled_arm, self._angles(number), self._frame(number))
        self._change_table(number, lambda table: set_where(table, pose))

    def set_own_angles(self, number: int) -> None:
        """Give a via point by its angles; raises InputError if it has none."""
        self.set_angles(number, self._angles(number))

    def insert(self, number: int, values: dict[str, Any] | Sequence[float] | None = None) -> None:
        """Insert a via point before ``number``: angles (J,), or keys; default: where the one before it is."""
        if values is None:
            given = self.vias
            before = given[max(0, number - 1)].values if given else {ANGLES: list(self.arm.home_deg)}
            pose = {"frame"} if POSE in before or "matrix" in before else set()
            values = {key: value for key, value in before.items() if key in {*WHERE, *pose}}
        found = values if isinstance(values, dict) else {ANGLES: rounded(values)}
        if self._is_list and set(found) == {ANGLES}:
            self._change_list(lambda rows: rows.insert(number, found[ANGLES]))
        else:
            self._change_blocks(lambda blocks: blocks.insert(number, self._written(found)))

    def delete(self, number: int) -> None:
        """Remove a via point, with its keys and comments."""
        if self._is_list:
            self._change_list(lambda rows: rows.__delitem__(number))
        else:
            self._change_blocks(lambda blocks: blocks.tables.pop(number))

    def copy(self, number: int) -> None:
        """Repeat a via point, with its keys, after it."""
        self.insert(number + 1, dict(self.vias[number].values))

    def move(self, number: int, by: int) -> None:
        """Move a via point ``by`` places, with its keys and comments; not beyond the first or last."""
        if not 0 <= number + by < len(self._rows()):
            return
        if self._is_list:
            rows = [via.values[ANGLES] for via in self.vias]
            rows.insert(number + by, rows.pop(number))
            self._change_list(lambda array: [array.__setitem__(at, row) for at, row in enumerate(rows)])
        else:
            self._change_blocks(lambda blocks: blocks.move(number, by))

    def set_vias(self, vias: Sequence[dict[str, Any]]) -> None:
        """Replace all via points by these, given by keys; raises InputError if keys of the others would be lost."""
        if any(set(via.values) - {*WHERE, "frame"} for via in self.vias):
            raise InputError(
                "the via points have keys, such as lines, that the pasted rows do not have",
                "make a new job for the rows",
            )
        blocks = TomlBlocks(self.text, "via")
        blocks.tables.clear()
        document = tomlkit.parse(blocks.text)
        listed = self._list_key
        document.pop(listed, None)
        if all(set(via) == {ANGLES} for via in vias):
            rows = tomlkit.array()
            for via in vias:
                rows.append(rounded(via[ANGLES]))
            document[listed] = rows.multiline(True)
        blocks = TomlBlocks(tomlkit.dumps(document), "via")
        for via in vias if listed not in document else ():
            blocks.insert(len(blocks.tables), self._written(via))
        self._change(blocks.text)

    @property
    def _is_list(self) -> bool:
        """Whether the via points are written as one list of angles."""
        return self._list_key in self._values

    def _change_list(self, change: Callable[[Any], object]) -> None:
        document = tomlkit.parse(self.text)
        change(document[self._list_key])
        self._change(tomlkit.dumps(document))

    def _change_table(self, number: int, change: Callable[[Any], object]) -> None:
        self._change_blocks(lambda blocks: blocks.change(number, change))

    def _change_blocks(self, change: Callable[[TomlBlocks], object]) -> None:
        blocks = TomlBlocks(self._with_tables(), "via")
        if len(blocks.tables) != len(self._rows()):
            raise InputError(
                "the via points are written in a way that cannot be changed here", "write [[via]] tables"
            )
        change(blocks)
        self._change(blocks.text)

    def _with_tables(self) -> str:
        """The text with tables [[via]], made of a list if it has that; InputError if comments would be lost."""
        if not self._is_list:
            return self.text
        document = tomlkit.parse(self.text)
        listed = self._list_key
        rows = document.pop(listed)
        if isinstance(rows, Array) and "#" in rows.as_string():
            raise InputError(
                f"the comments in {listed} would be lost",
                "write the via points as [[via]] tables in the job's file",
            )
        blocks = TomlBlocks(tomlkit.dumps(document), "via")
        for row in self._rows():
            blocks.insert(len(blocks.tables), self._written(row))
        return blocks.text
