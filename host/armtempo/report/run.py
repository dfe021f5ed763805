"""A recorded run: its samples, results and report."""

from __future__ import annotations

from dataclasses import asdict
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from armtempo.basics.arguments import checked
from armtempo.model.plan import Plan
from armtempo.report import replayed, run_reader, run_report
from armtempo.report.replayed import JointResult, results
from armtempo.report.run_folder import COMPLETE, Repetition
from armtempo.splines.trajectory import Trajectory


@checked
class Run:
    """A run folder: the motion, and its recorded samples."""

    def __init__(self, content: run_reader.RunData) -> None:
        self._content = content

    @classmethod
    def load(cls, path: Path | str) -> Run:
        """The run in a folder, also if it ended early; raises RunFolderError if the folder is none or inconsistent."""
        return cls(run_reader.load(Path(path)))

    def __repr__(self) -> str:
        states = ", ".join(repetition.state for repetition in self.repetitions) or "nothing recorded"
        return f"<Run {self.path}: {states}>"

    @property
    def path(self) -> Path:
        return self._content.path

    @property
    def name(self) -> str:
        """The motion's name on the board."""
        return str(self.meta["name"])

    @property
    def meta(self) -> dict[str, Any]:
        """The content of run.json: when, on which board, how each repetition ended."""
        return self._content.meta

    @property
    def repetitions(self) -> tuple[run_reader.RepetitionData, ...]:
        """The samples of each repetition as arrays."""
        return self._content.repetitions

    @property
    def entries(self) -> tuple[Repetition, ...]:
        """The repetitions in run.json: how each ended, fault, lost samples, last position."""
        return self._content.entries

    def to_json(self) -> dict[str, Any]:
        """Plain values: the run folder, how each repetition ended, and where each joint came to rest in the
        last one."""
        return {
            "name": self.name,
            "folder": str(self.path),
            "complete": self.complete,
            "repetitions": [entry.state for entry in self.entries],
            "joints": [asdict(joint) for joint in self.results],
        }

    @property
    def complete(self) -> bool:
        """Whether every repetition reached its end without a stop, a fault or a broken connection."""
        return bool(self.repetitions) and all(one.state == COMPLETE for one in self.repetitions)

    @cached_property
    def plan(self) -> Plan | None:
        """The plan of the motion; None if it is not known, as for a motion that only the board had."""
        return replayed.plan_of(self._content)

    @cached_property
    def trajectory(self) -> Trajectory:
        """The motion: as planned, or from the board's record.

        Raises RunFolderError if neither can be read.
        """
        return self.plan.trajectory if self.plan is not None else replayed.trajectory_of(self._content)

    @property
    def samples(self) -> np.ndarray[Any, np.dtype[np.void]]:
        """All samples of all repetitions, (N,), as a structured array.

        Fields: ``repetition`` (from 1), ``index`` of the sample in its repetition (from 0), ``time_s`` by the
        board's motion clock and ``path_s`` in the motion's own time; and for each driven joint, (J,):
        ``commanded_steps``, ``commanded_deg``, and ``angle_deg`` from the encoder (NaN without an encoder).
        """
        joints = len(self._content.joints)
        kind = np.dtype(
            [
                ("repetition", np.int64),
                ("index", np.int64),
                ("time_s", np.float64),
                ("path_s", np.float64),
                ("commanded_steps", np.int64, (joints,)),
                ("commanded_deg", np.float64, (joints,)),
                ("angle_deg", np.float64, (joints,)),
            ]
        )
        table = np.empty(sum(len(one.index) for one in self.repetitions), kind)
        begin = 0
        for number, one in enumerate(self.repetitions, 1):
            rows = table[begin : begin + len(one.index)]
            rows["repetition"] = number
            for name in kind.names[1:] if kind.names else ():
                rows[name] = getattr(one, name)
            begin += len(one.index)
        return table

    @property
    def results(self) -> tuple[JointResult, ...]:
        """The final position of each joint in the last repetition; empty if it is not known."""
        return results(self._content, self.trajectory)

    def report(self) -> Path:
        """Write report.html and its figures into the run folder; returns the page.

        Raises RunFolderError if the motion is not known or there is no sample, MissingPackageError without matplotlib.
        """
        return run_report.write(self.path)
