"""A job's via points cut into runs from rest to rest: on the spline through them, or led along a way of the tool."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import PlanError
from armtempo.model import tool_way
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.tool_pose import APPROACH, WHOLE, Pose
from armtempo.model.tool_way import ToolWay
from armtempo.planning.line import tool_path
from armtempo.planning.line.deviation import Deviation
from armtempo.planning.line.follow import Course, follow
from armtempo.planning.line.tool_path import Piece, ToolPath
from armtempo.planning.tool import Tool

_CUT = 0.5
"""A corner is cut over no more than this part of the shorter line."""


@dataclass(frozen=True)
class Run:
    """Via points ``first`` to ``last``, at both of which the motion rests; ``ways`` where the tool is led."""

    first: int
    last: int
    ways: tuple[ToolWay, ...] = ()

    @property
    def name(self) -> str:
        """What messages call it."""
        return f"P{self.first} to P{self.last}"

    @property
    def enough(self) -> Deviation:
        """How far the tool may leave its way."""
        return Deviation(
            min(way.tolerance_mm for way in self.ways), min(way.tolerance_deg for way in self.ways)
        )


def of_job(job: Job) -> list[Run]:
    """The runs of a job in order."""
    led = {way.via: way for way in job.ways if way.line}
    stops = {stop.via for stop in job.stops}
    runs: list[Run] = []
    first, ways = 0, []
    for via in range(1, len(job.via)):
        if via in led:
            ways.append(led[via])
            goes_on = led[via].blend_mm > 0.0
        else:
            goes_on = via + 1 not in led and via not in stops
        if via == len(job.via) - 1 or not goes_on:
            runs.append(Run(first, via, tuple(ways)))
            first, ways = via, []
    return runs


def kept(arm: Arm, end: tuple[float, ...] | Pose) -> tuple[str, ...]:
    """What of the orientation a line to this via point keeps: WHOLE, (APPROACH,) or ().

    A pose says it itself; to via angles, as much as the joints with a motor can keep.
    """
    if isinstance(end, Pose):
        return end.fixed if end.fixed in (WHOLE, (APPROACH,)) else ()
    count = len(arm.driven)
    return WHOLE if count >= 6 else (APPROACH,) if count == 5 else ()


def course(arm: Arm, job: Job, run: Run, first_deg: Array) -> Course:
    """The way of the tool in a run that begins at angles ``first_deg``, (J,).

    Raises PlanError for a way that is none.
    """
    tool = Tool(arm, list(range(len(arm.driven))), first_deg)
    fixed = kept(arm, job.via[run.last])
    for via in range(run.first + 1, run.last):
        if kept(arm, job.via[via]) != fixed:
            raise PlanError(
                f"P{run.first} to P{run.last}: the corner at P{via} cannot be cut, as the lines beside it keep "
                "different parts of the tool's orientation",
                "leave blend_mm out, or give both via points the same kind of pose",
            )
    here = pose_at(tool, first_deg)
    pieces: list[Piece] = []
    for way in run.ways:
        target = job.via[way.via]
        end = np.array(target.matrix) if isinstance(target, Pose) else pose_at(tool, np.array(target))
        pieces.append(_piece(way, here, end, fixed))
        last = pieces[-1]
        length = np.array([last.length])
        here = end.copy()
        here[:3, :3] = last.turned(length)[0] @ last.start[:3, :3]
    cuts = tuple(way.blend_mm for way in run.ways[:-1])
    path = ToolPath(tuple(pieces), cuts)
    _check_cuts(run, path)
    return Course(arm, path, fixed, run.name)


def pose_at(tool: Tool, angles_deg: Array) -> Array:
    """The tool's pose at a posture (J,): (4, 4)."""
    state = tool.at(angles_deg[None])
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = state.rotation[0], state.position_mm[0]
    return pose


def _piece(way: ToolWay, start: Array, end: Array, fixed: tuple[str, ...]) -> Piece:
    where = f"P{way.via - 1} to P{way.via}"
    turn = np.zeros(3)
    if fixed == WHOLE:
        turn = tool_path.turn_between(start[:3, :3], end[:3, :3], where)
    elif fixed == (APPROACH,):
        turn = tool_path.turn_of_axis(start[:3, 2], end[:3, 2], where)
    if way.arc_through_mm is not None:
        return tool_path.arc(start, way.arc_through_mm, end, turn, where)
    return tool_path.line(start, end, turn, where)


def _check_cuts(run: Run, path: ToolPath) -> None:
    """PlanError where corners are cut over more of a line than there is."""
    ways = [0.0, *path.cuts, 0.0]
    for number, piece in enumerate(path.pieces):
        if path.cuts and not np.any(piece.direction):
            raise PlanError(
                f"P{run.first + number} to P{run.first + number + 1}: the tool only turns, so no corner is cut there",
                "leave blend_mm out at both",
            )
        for cut in ways[number : number + 2]:
            if cut > _CUT * piece.length:
                raise PlanError(
                    f"P{run.first + number} to P{run.first + number + 1}: blend_mm = {cut:g} is more than half of its "
                    f"{piece.length:.4g} mm",
                    f"give at most {_CUT * piece.length:.4g}, or 0 to rest there",
                )


def end_deg(arm: Arm, job: Job, via: int, before_deg: Array) -> Array:
    """Where the line to a via point leads to from the posture before, (J,): angles (J,)."""
    way = tool_way.at(job.ways, via)
    assert way is not None
    return follow(course(arm, job, Run(via - 1, via, (way,)), before_deg), before_deg).end_deg
