"""A job's via points divided into legs from rest to rest: on a spline, or along lines and arcs of the tool."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import PlanError
from armtempo.model import tool_segment
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.tool_pose import APPROACH, WHOLE, Pose
from armtempo.model.tool_segment import ToolSegment
from armtempo.planning.line import tool_path
from armtempo.planning.line.deviation import LineDeviation
from armtempo.planning.line.follow import Course, follow
from armtempo.planning.line.tool_path import ToolPath, ToolPiece
from armtempo.planning.tool import Tool

_CUT = 0.5
"""Largest cut of a corner, as a fraction of the shorter line."""


@dataclass(frozen=True)
class Leg:
    """Via points ``first`` to ``last``, with rests at both; ``tool_segments``: its lines and arcs of the tool."""

    first: int
    last: int
    tool_segments: tuple[ToolSegment, ...] = ()

    @property
    def name(self) -> str:
        """Name in messages."""
        return f"P{self.first} to P{self.last}"

    @property
    def enough(self) -> LineDeviation:
        """Allowed deviation of the tool."""
        return LineDeviation(
            min(segment.tolerance_mm for segment in self.tool_segments),
            min(segment.tolerance_deg for segment in self.tool_segments),
        )


def of_job(job: Job) -> list[Leg]:
    """The legs of a job in order."""
    led = {segment.via: segment for segment in job.tool_segments if segment.line}
    stops = {stop.via for stop in job.stops}
    legs: list[Leg] = []
    first, segments = 0, []
    for via in range(1, len(job.via)):
        if via in led:
            segments.append(led[via])
            goes_on = led[via].blend_mm > 0.0
        else:
            goes_on = via + 1 not in led and via not in stops
        if via == len(job.via) - 1 or not goes_on:
            legs.append(Leg(first, via, tuple(segments)))
            first, segments = via, []
    return legs


def kept(arm: Arm, end: tuple[float, ...] | Pose) -> tuple[str, ...]:
    """The part of the orientation kept on a line to this via point: WHOLE, (APPROACH,) or ().

    For a pose, its constrained part; for angles, as much as the driven joints can keep.
    """
    if isinstance(end, Pose):
        return end.fixed if end.fixed in (WHOLE, (APPROACH,)) else ()
    count = len(arm.driven)
    return WHOLE if count >= 6 else (APPROACH,) if count == 5 else ()


def course(arm: Arm, job: Job, leg: Leg, first_deg: Array) -> Course:
    """The path of the tool in a leg that begins at angles ``first_deg``, (J,).

    Raises PlanError for an invalid path.
    """
    tool = Tool(arm, list(range(len(arm.driven))), first_deg)
    fixed = kept(arm, job.via[leg.last])
    for via in range(leg.first + 1, leg.last):
        if kept(arm, job.via[via]) != fixed:
            raise PlanError(
                f"P{leg.first} to P{leg.last}: the corner at P{via} cannot be cut, as the lines at it keep "
                "different parts of the tool's orientation",
                "leave blend_mm out, or give both via points the same kind of pose",
            )
    here = pose_at(tool, first_deg)
    pieces: list[ToolPiece] = []
    for segment in leg.tool_segments:
        target = job.via[segment.via]
        end = np.array(target.matrix) if isinstance(target, Pose) else pose_at(tool, np.array(target))
        pieces.append(_piece(segment, here, end, fixed))
        last = pieces[-1]
        length = np.array([last.length])
        here = end.copy()
        here[:3, :3] = last.turned(length)[0] @ last.start[:3, :3]
    cuts = tuple(segment.blend_mm for segment in leg.tool_segments[:-1])
    path = ToolPath(tuple(pieces), cuts)
    _check_cuts(leg, path)
    return Course(arm, path, fixed, leg.name)


def pose_at(tool: Tool, angles_deg: Array) -> Array:
    """The tool's pose at a posture (J,): (4, 4)."""
    state = tool.at(angles_deg[None])
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = state.rotation[0], state.position_mm[0]
    return pose


def _piece(segment: ToolSegment, start: Array, end: Array, fixed: tuple[str, ...]) -> ToolPiece:
    where = f"P{segment.via - 1} to P{segment.via}"
    turn = np.zeros(3)
    if fixed == WHOLE:
        turn = tool_path.turn_between(start[:3, :3], end[:3, :3], where)
    elif fixed == (APPROACH,):
        turn = tool_path.turn_of_axis(start[:3, 2], end[:3, 2], where)
    if segment.arc_through_mm is not None:
        return tool_path.arc(start, segment.arc_through_mm, end, turn, where, segment.tolerance_mm)
    if segment.circle_through_mm is not None:
        return tool_path.full_circle(start, segment.circle_through_mm, end, turn, where, segment.tolerance_mm)
    return tool_path.line(start, end, turn, where)


def _check_cuts(leg: Leg, path: ToolPath) -> None:
    """Raise PlanError if corners are cut over more than half of a line."""
    cuts = [0.0, *path.cuts, 0.0]
    for number, piece in enumerate(path.pieces):
        name = f"P{leg.first + number} to P{leg.first + number + 1}"
        if path.cuts and not np.any(piece.direction):
            raise PlanError(
                f"{name}: the tool only turns, so no corner is cut there",
                "leave blend_mm out at both",
            )
        for cut in cuts[number : number + 2]:
            if cut > _CUT * piece.length:
                raise PlanError(
                    f"{name}: blend_mm = {cut:g} is more than half of its {piece.length:.4g} mm",
                    f"give at most {_CUT * piece.length:.4g}, or 0 to rest there",
                )


def end_deg(arm: Arm, job: Job, via: int, before_deg: Array) -> Array:
    """Angles (J,) at the end of the line to a via point, starting at the posture ``before_deg`` (J,)."""
    segment = tool_segment.at(job.tool_segments, via)
    assert segment is not None
    return follow(course(arm, job, Leg(via - 1, via, (segment,)), before_deg), before_deg).end_deg
