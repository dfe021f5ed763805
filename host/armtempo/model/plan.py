"""A plan: legs from rest to rest, and the rows in which the board makes them; that of a job has one of each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from armtempo_shared import sequence as record
from armtempo_shared.sequence import COUNT, END, MOVE, REPEAT, WAIT

from armtempo.basics.arguments import checked
from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.model import arm_json, exchange, plan_file
from armtempo.model.arm import Arm
from armtempo.model.job import AUTO, Job
from armtempo.model.leg import JobSolution, PlanLeg, Search, SequenceRow, check_spline, only_row
from armtempo.model.plan_file import AGAIN, Content, JobContent, SequenceContent
from armtempo.splines.extremes import Extremes
from armtempo.splines.trajectory import Trajectory

PAUSE_S = 0.015
"""Approximate time from the end of a motion to the start of the next, if the board prepares motions
(host/docs/sequences.md)."""


@dataclass(frozen=True)
class Share:
    """The parts of a duration."""

    motion_s: float = 0.0
    wait_s: float = 0.0
    motions: int = 0
    """Number of motions; before each is a pause."""

    @property
    def total_s(self) -> float:
        """The sum."""
        return self.motion_s + self.wait_s + PAUSE_S * self.motions

    def __add__(self, other: Share) -> Share:
        return Share(self.motion_s + other.motion_s, self.wait_s + other.wait_s, self.motions + other.motions)

    def __mul__(self, times: int) -> Share:
        return Share(self.motion_s * times, self.wait_s * times, self.motions * times)


@dataclass(frozen=True)
class Cycle:
    """One pass of a repeat."""

    step: int
    times: int
    """0: for ever."""
    share: Share


@checked
@dataclass(frozen=True, eq=False, repr=False)
class Plan:
    """What ``arm`` does within all limits: the motion of a job, or a sequence.

    ``trajectory`` and what is said of one motion is that of the only leg; InputError for a plan that does more.
    """

    arm: Arm
    name: str
    legs: tuple[PlanLeg, ...]
    """Its different motions; of a sequence NAME-1, NAME-2, … on the board."""
    rows: tuple[SequenceRow, ...]
    versions: Mapping[str, str]
    """Versions on which the numbers depend: armtempo, numpy, scipy, Python, processor."""
    notes: tuple[str, ...] = ()
    """For the user: on the solution of poses; of a sequence on the motions that were planned, with their names."""
    frames: tuple[str, ...] = ()
    """The frames of the arm in which something of it was given."""
    pallets: tuple[str, ...] = ()
    """The pallets of the arm that it uses."""
    counters: tuple[str, ...] = ()
    """Names of the counters, by their number in the rows."""

    @classmethod
    def of_job(
        cls,
        arm: Arm,
        solution: JobSolution,
        trajectory: Trajectory,
        notes: tuple[str, ...],
        versions: Mapping[str, str],
    ) -> Plan:
        """The plan of a job's motion."""
        job = solution.job
        leg = PlanLeg(trajectory, job.holds, solution=solution)
        return cls(arm, job.name, (leg,), (only_row(job.name),), versions, notes, job.frames)

    def __repr__(self) -> str:
        if self.is_sequence:
            what = f"{len(self.rows)} rows, {len(self.legs)} motions"
        else:
            what = f"{len(self.via_deg)} via points, {self.total_s:.3f} s"
        return f"<Plan {self.name!r} for {self.arm.name!r}: {what}>"

    @property
    def is_sequence(self) -> bool:
        """Whether it is that of a sequence, not of a job: another file, and another record on the board."""
        return len(self.legs) != 1 or self.legs[0].solution is None

    @property
    def loaded_legs(self) -> list[tuple[Arm, Trajectory]]:
        """Each leg's motion with the arm as it is there, with its tool and load."""
        return [(self.arm.with_tool(leg.tool).holding(leg.load), leg.trajectory) for leg in self.legs]

    @property
    def start_deg(self) -> Array | None:
        """Start posture, degrees (J,); None if nothing moves."""
        first = next((row.number for row in self.rows if row.op == MOVE), None)
        return None if first is None else self.legs[first].trajectory(0.0)

    @property
    def cycles(self) -> tuple[Cycle, ...]:
        """One pass of each outermost repeat."""
        return self._times()[1]

    @property
    def total(self) -> Share | None:
        """All rows without waits for inputs; None if they have no end."""
        return self._times()[0]

    def _times(self) -> tuple[Share | None, tuple[Cycle, ...]]:
        open_: list[tuple[SequenceRow, Share]] = []
        share, endless = Share(), False
        cycles = []
        for row in self.rows:
            if row.op == MOVE:
                share += Share(motion_s=self.legs[row.number].trajectory.duration_s, motions=1)
            elif row.op == WAIT:
                share += Share(wait_s=row.amount / 1000)
            elif row.op == REPEAT:
                open_.append((row, share))
                share = Share()
            elif row.op == END:
                begun, before = open_.pop()
                if row.value:
                    times = begun.amount + begun.value if begun.amount else 0
                    cycles.append(Cycle(begun.step, times, share))
                endless = endless or not begun.amount
                share = before + share * begun.amount
        return (None if endless else share), tuple(cycles)

    # of a plan of one motion

    @property
    def trajectory(self) -> Trajectory:
        """``trajectory(time_s, order)``: angles of the driven joints or their derivatives, (..., J)."""
        if [row.op for row in self.rows] != [MOVE]:
            raise InputError(
                f"{self.name!r} is a sequence of {len(self.legs)} motions, not one motion",
                "plan the job of one of them; in Python, take them from 'legs'",
            )
        return self.legs[0].trajectory

    @property
    def total_s(self) -> float:
        """The motion time, until the last joint arrives, seconds."""
        return self.trajectory.duration_s

    @property
    def solution(self) -> JobSolution:
        """How the motion of a job was found."""
        found = self.legs[0].solution if len(self.legs) == 1 else None
        if found is None:
            raise InputError(f"{self.name!r} is a sequence, not the motion of a job", "plan the job itself")
        return found

    @property
    def job(self) -> Job:
        """The job, as it was planned."""
        return self.solution.job

    @property
    def via_deg(self) -> Array:
        """Angles of the driven joints at the job's via points, (n + 1, J)."""
        return self.solution.via_deg

    @property
    def searches(self) -> tuple[Search, ...]:
        """Those of a job: one for each joint that moves, or one for the shared time axis."""
        return self.solution.searches

    @property
    def extremes(self) -> tuple[Extremes, ...]:
        """Largest speed, acceleration and jerk of each driven joint, as proven bounds."""
        return self.solution.extremes

    def to_csv(self, rate_hz: float = 100.0) -> str:
        """Angle, speed, acceleration and jerk of each driven joint as CSV, ``rate_hz`` lines a second."""
        return exchange.to_csv(self.trajectory, [joint.unit for joint in self.arm.driven], rate_hz)

    def to_ros(self, rate_hz: float = 100.0, frame_id: str = "") -> str:
        """A trajectory_msgs/JointTrajectory message in YAML, radians and metres, with ``rate_hz`` points a second."""
        driven = self.arm.driven
        names, units = [joint.name for joint in driven], [joint.unit for joint in driven]
        return exchange.to_ros(self.trajectory, names, units, rate_hz, frame_id)

    # files

    def save(self, path: Path | str, force: bool = False) -> None:
        """Write the file, of a job or of a sequence, atomically.

        Replaces only an unaltered file of the same job for the same arm, or of the same sequence (by name);
        ``force``: any file. Raises InputError if it may not be replaced, or cannot be written.
        """
        plan_file.save(path, self._content(), force)

    def check_replaceable(self, path: Path | str, force: bool = False) -> None:
        """Raise InputError if ``save`` would not replace a file that exists; nothing is written."""
        plan_file.check(path, self._content(), force)

    @classmethod
    def load(cls, path: Path | str, altered: bool = False) -> Plan:
        """The plan of a file, of a job or of a sequence.

        ``altered``: accept a file that was altered after it had been written. Raises InputError for a file
        that is missing, incomplete, altered, of another format or version, or has an unknown key, value or
        shape.
        """
        content = plan_file.read(path, altered)
        arm_json.check(content.arm, f"{path}: arm", AGAIN)
        if isinstance(content, JobContent):
            _check_motion(content, path)
            solution = JobSolution(content.job, content.via_deg, content.searches, content.extremes)
            return cls.of_job(content.arm, solution, content.trajectory, content.notes, content.versions)
        _check_rows(content, path)
        none = ("",) * len(content.legs)
        each = zip(content.legs, content.loads or none, content.tools or none, strict=True)
        return cls(
            content.arm,
            content.name,
            tuple(PlanLeg(*leg) for leg in each),
            content.rows,
            content.versions,
            content.notes,
            content.frames,
            content.pallets,
            content.counters,
        )

    @classmethod
    def load_motion(cls, path: Path | str, altered: bool = False) -> Plan:
        """As ``load``; also InputError for a plan of a sequence."""
        found = cls.load(path, altered)
        if found.is_sequence:
            raise InputError(
                f"{path}: is the plan of a sequence, not of a motion",
                "give that of a job: 'armtempo plan JOB.toml'",
            )
        return found

    def _content(self) -> Content:
        """What its file has."""
        if not self.is_sequence:
            return JobContent(
                self.arm,
                self.job,
                self.via_deg,
                self.notes,
                self.trajectory,
                self.searches,
                self.extremes,
                self.versions,
            )
        return SequenceContent(
            self.arm,
            self.name,
            tuple(leg.trajectory for leg in self.legs),
            self.rows,
            self.counters,
            self.versions,
            tuple(leg.load for leg in self.legs),
            self.notes,
            self.frames,
            tuple(leg.tool for leg in self.legs) if any(leg.tool for leg in self.legs) else (),
            self.pallets,
        )


def _check_motion(found: JobContent, path: Path | str) -> None:
    """Check what types cannot express: shapes, increasing times, one spline for each driven joint."""
    joints, driven = found.trajectory.joints, found.arm.driven
    if not joints or len(joints) != len(driven):
        raise InputError(
            f"{path}: {len(joints)} joints in the trajectory, the arm drives {len(driven)}", AGAIN
        )
    if found.via_deg.shape[1:] != (len(driven),) or len(found.extremes) != len(driven):
        raise InputError(
            f"{path}: via_deg and extremes must have an entry for each of {len(driven)} joints", AGAIN
        )
    for number, spline in enumerate(joints, 1):
        check_spline(spline, len(found.via_deg), f"{path}: trajectory joint {number}")
    if found.trajectory.shared and any(
        not np.array_equal(spline.time_points_s, joints[0].time_points_s) for spline in joints
    ):
        raise InputError(f"{path}: shared timing, but the joints' time control points differ", AGAIN)
    if isinstance(found.job.refine, str) and found.job.refine != AUTO:
        raise InputError(
            f"{path}: plan.job.refine {found.job.refine!r} should be a number or {AUTO!r}", AGAIN
        )
    if any(not 0 <= index < len(joints) for search in found.searches for index in search.joints):
        raise InputError(f"{path}: searches name a joint that does not exist", AGAIN)


def _check_rows(found: SequenceContent, path: Path | str) -> None:
    there = {MOVE: len(found.legs), COUNT: len(found.counters)}
    if any(not 0 <= row.number < there.get(row.op, row.number + 1) for row in found.rows):
        raise InputError(f"{path}: a row names a motion or counter that does not exist", AGAIN)
    if any(len(names) not in (0, len(found.legs)) for names in (found.loads, found.tools)):
        raise InputError(
            f"{path}: loads and tools must have an entry for each of {len(found.legs)} motions", AGAIN
        )


def check_size(rows: int, legs: int, counters: int, where: str) -> None:
    """Raise InputError if the sequence is too large for the board."""
    if counters > record.MAX_COUNTERS:
        raise InputError(
            f"{where}: {counters} counters; the board keeps {record.MAX_COUNTERS} for a sequence",
            "use fewer counters",
        )
    if rows > record.MAX_ROWS or legs > record.MAX_MOTIONS:
        raise InputError(
            f"{where}: {rows} rows and {legs} motions; the board takes {record.MAX_ROWS} and {record.MAX_MOTIONS}",
            "use repeat, or split it into two sequences; of a pallet, plan some of its layers or rows",
        )
