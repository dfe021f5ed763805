"""What the panel plans: the project's job as a table of via points, and the file in which it is kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import tomlkit

from armtempo.basics.errors import InputError
from armtempo.formats import toml_table
from armtempo.formats.atomic_file import replace_text
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.plan import Plan
from armtempo.planning import planner

_NEW = "panel_job"


class Desk:
    """The job that is being made, and the plan of it, if there is one. ``folder``: no other is written to."""

    def __init__(self, arm: Arm, folder: Path, job_file: Path | None) -> None:
        self.arm, self.folder = arm, folder
        self.file = job_file
        self.job = Job.load(job_file, arm) if job_file else Job(_NEW, via_deg=[arm.home_deg, arm.home_deg])
        self.plan: Plan | None = None

    def rows(self) -> list[list[float]]:
        """The job's via points as angles, (n, J): poses through the inverse kinematics."""
        return [list(map(float, row)) for row in planner.via_angles(self.arm, self.job)[0]]

    def job_with(self, rows: Sequence[Sequence[float]], path: str) -> Job:
        """The job through other via points; InputError for fewer than two, or outside of a range."""
        if len(rows) < 2:
            raise InputError("a motion needs two via points", "add one")
        for number, row in enumerate(rows):
            if problem := self.arm.angles_problem(row):
                raise InputError(f"P{number}: {problem}", "change it")
        vias = tuple(tuple(map(float, row)) for row in rows)
        stops = tuple(stop for stop in self.job.stops if stop.via < len(vias) - 1)
        ways = tuple(way for way in self.job.ways if way.via < len(vias))
        return replace(self.job, via=vias, path=path, stops=stops, ways=ways)

    def save(self, job: Job) -> Path:
        """Write the via points and the path into the job's file; its other lines and comments stay.

        A job without a file gets one in the folder. InputError if it cannot be written.
        """
        if job.ways or job.stops:
            raise InputError(
                "the panel writes via points as angles alone: lines, speeds and stops of the job would be lost",
                "change the via points in the job's file",
            )
        file = self.file or self.folder / f"{job.name}.toml"
        if not file.resolve().is_relative_to(self.folder.resolve()):
            raise InputError(
                f"{file} is outside of the project folder", "copy it there; the panel writes nothing else"
            )
        text = file.read_text(encoding="utf-8") if file.is_file() else f'name = "{job.name}"\n'
        content = tomlkit.parse(text)
        content.pop("via", None)
        rows = tomlkit.array()
        for row in job.via:
            rows.append([round(float(angle), 6) for angle in row])  # type: ignore[union-attr]
        content["via_deg"] = rows.multiline(True)
        if job.path != Job.path or "path" in content:
            content["path"] = job.path
        new = tomlkit.dumps(content)
        Job.of_table(toml_table.parse(new, str(file)), self.arm)
        replace_text(file, new)
        self.file, self.job = file, job
        return file
