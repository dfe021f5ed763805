"""The panel's job as a table of via points, and its file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import tomlkit

from armtempo.basics import toml_table
from armtempo.basics.atomic_file import replace_text
from armtempo.basics.errors import InputError
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.plan import Plan
from armtempo.model.tool_pose import Pose
from armtempo.planning import planner

_NEW = "panel_job"


class Desk:
    """The edited job, and its plan, if any. ``folder``: the only folder that is written to."""

    def __init__(self, arm: Arm, folder: Path, job_file: Path | None) -> None:
        self.arm, self.folder = arm, folder
        self.file = job_file
        self.job = Job.load(job_file, arm) if job_file else Job(_NEW, via_deg=[arm.home_deg, arm.home_deg])
        self.plan: Plan | None = None
        self.rows()  # errors of poses are reported at the start instead of in a page

    def rows(self) -> list[list[float]]:
        """The job's via points as angles, (n, J); PlanError if no posture reaches a pose among them."""
        angles = [via for via in self.job.via if not isinstance(via, Pose)]
        found = angles if len(angles) == len(self.job.via) else planner.via_angles(self.arm, self.job)[0]
        return [list(map(float, row)) for row in found]

    def job_with(self, rows: Sequence[Sequence[float]], options: Mapping[str, str]) -> Job:
        """The job with other via points and ``options`` (typed texts, "" for none).

        Raises InputError as for the file that ``save`` would write.
        """
        job = Job.of_table(toml_table.parse(self._text(rows, options), str(self._target)), self.arm)
        last = len(rows) - 1
        stops = tuple(stop for stop in self.job.stops if stop.via < last)
        return replace(job, stops=stops, ways=tuple(way for way in self.job.ways if way.via <= last))

    def option(self, key: str) -> str:
        """The job's value of a key, as text."""
        value = getattr(self.job, key)
        return "" if value is None else str(value)

    @property
    def _target(self) -> Path:
        """The job's file; default: a file in the folder."""
        return self.file or self.folder / f"{self.job.name}.toml"

    def _text(self, rows: Sequence[Sequence[float]], options: Mapping[str, str]) -> str:
        """The job's file with other via points and options; its other lines and comments stay."""
        file = self._target
        text = file.read_text(encoding="utf-8") if file.is_file() else f'name = "{self.job.name}"\n'
        content = tomlkit.parse(text)
        content.pop("via", None)
        via = tomlkit.array()
        for row in rows:
            via.append([round(float(angle), 6) for angle in row])
        content["via_deg"] = via.multiline(True)
        for key, value in options.items():
            if value and value != self.option(key):
                content[key] = toml_table.typed(value)
            elif not value:
                content.pop(key, None)
        return tomlkit.dumps(content)

    def save(self, rows: Sequence[Sequence[float]], options: Mapping[str, str]) -> Path:
        """Write via points and options into the job's file; raises InputError, without writing, if they are
        invalid."""
        job, file = self.job_with(rows, options), self._target
        if job.ways or job.stops:
            raise InputError(
                "the panel writes via points as angles alone: lines, speeds and stops of the job would be lost",
                "change the via points in the job's file",
            )
        if not file.resolve().is_relative_to(self.folder.resolve()):
            raise InputError(
                f"{file} is outside of the project folder", "copy it there; the panel writes nothing else"
            )
        replace_text(file, self._text(rows, options))
        self.file, self.job = file, job
        return file
