"""A recorded run, of a motion or a sequence: its samples, results and report."""

from __future__ import annotations

from dataclasses import asdict
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from armtempo.basics.arguments import checked
from armtempo.basics.errors import RunFolderError
from armtempo.model.plan import Plan
from armtempo.report import replayed, run_folder, run_reader
from armtempo.report.replayed import JointResult, results
from armtempo.report.run_folder import Repetition
from armtempo.report.run_reader import RowPassed
from armtempo.splines.trajectory import Trajectory


@checked
class Run:
    """A run folder: what was run, a motion or a sequence, and the recorded samples."""

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
        """Its name on the board."""
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
    def state(self) -> str:
        """How the last repetition ended, a sequence by the board; ``interrupted`` or ``broken`` if the host did not
        receive that, ``running`` before the end."""
        return self.entries[-1].state if self.entries else run_folder.RUNNING

    @property
    def complete(self) -> bool:
        """Whether every repetition reached its end without a stop, a fault or a broken connection."""
        return bool(self.entries) and all(entry.complete for entry in self.entries)

    @property
    def rows(self) -> tuple[RowPassed, ...]:
        """The rows of a sequence as they began; empty for a motion."""
        return tuple(row for repetition in self.repetitions for row in repetition.rows)

    @property
    def last(self) -> RowPassed | None:
        """The last reported row, which shows how far a sequence was at a power failure; None if there is none."""
        return self.rows[-1] if self.rows else None

    @property
    def rows_lost(self) -> int:
        """Number of rows before the last reported one that were not reported."""
        return sum(one.rows[-1].passed - len(one.rows) for one in self.repetitions if one.rows)

    @cached_property
    def plan(self) -> Plan | None:
        """The plan, of a motion or a sequence; None if it is not known, as for one that only the board had."""
        return replayed.plan_of(self._content)

    @cached_property
    def legs(self) -> tuple[Trajectory, ...]:
        """The motions, one of a motion and all of a sequence: as planned, or from the board's records.

        Raises RunFolderError if one cannot be read.
        """
        return replayed.legs_of(self._content, self.plan)

    @property
    def trajectory(self) -> Trajectory:
        """The only leg. Raises RunFolderError if there is not just one, or it cannot be read."""
        if len(self._content.legs) != 1:
            raise RunFolderError(
                f"{self.path}: ran {len(self._content.legs)} motions", "take them from 'legs'"
            )
        return self.legs[0]

    def leg_of(self, row: int) -> int:
        """Number of the leg that a row runs, from 1; 0 for none."""
        return self._content.rows[row].leg

    @property
    def samples(self) -> np.recarray[Any, np.dtype[np.void]]:
        """All samples of all repetitions, (N,), as a structured array: ``samples["time_s"]`` or ``samples.time_s``.

        Fields: ``repetition`` (from 1), ``run`` (the board's number of the motion's run), ``row`` (from 0; -1 if it
        was not reported), ``index`` of the sample in its motion's run (from 0), ``time_s`` by the board's motion
        clock and ``path_s`` in the motion's own time; and for each driven joint, (J,): ``commanded_steps``,
        ``commanded_deg``, and ``angle_deg`` from the encoder (NaN without an encoder), of a sliding joint both in mm.
        """
        joints = len(self._content.joints)
        whole = ("repetition", "run", "row", "index")
        of_joints = (("commanded_steps", np.int64), ("commanded_deg", np.float64), ("angle_deg", np.float64))
        kind = np.dtype(
            [
                *((name, np.int64) for name in whole),
                ("time_s", np.float64),
                ("path_s", np.float64),
                *((name, of, (joints,)) for name, of in of_joints),
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
        return table.view(np.recarray)

    @property
    def results(self) -> tuple[JointResult, ...]:
        """The final position of each joint in the last repetition of a motion; empty if it is not known."""
        return results(self._content, self.legs[0]) if len(self._content.legs) == 1 else ()

    def report(self) -> Path:
        """Write report.html, and for one motion its figures, into the run folder; returns the page.

        Raises RunFolderError if a motion is not known or nothing was recorded, MissingPackageError without matplotlib.
        """
        from armtempo.report import run_report  # here, as each command that moves the arm would wait for it

        return run_report.write(self.path)
