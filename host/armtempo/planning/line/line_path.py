"""The joints' spline of a job with lines of the tool, with enough segments to prove that the tool stays near its path.

Each leg from rest to rest is a separate spline: at a rest between two, five control points are equal.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import PlanError
from armtempo.basics.progress import Progress
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.planning import board_limits, checks
from armtempo.planning.free import around
from armtempo.planning.free.angle_bounds import of_path
from armtempo.planning.line import legs as cut
from armtempo.planning.line.deviation import LineDeviation, SplinePieces, proven
from armtempo.planning.line.follow import Followed, follow
from armtempo.planning.line.legs import Leg
from armtempo.planning.lower_bounds import LowerBound
from armtempo.planning.motion_program import mean_slopes
from armtempo.splines import bspline
from armtempo.splines.bspline import REST_PIECES


@dataclass(frozen=True, eq=False)
class Between:
    """The path of such a leg."""

    angle_points_deg: Array
    """(S + 5, J)."""
    arrivals: tuple[int, ...]
    """Segments before each of its via points."""
    bound: LowerBound | None = None
    """Lower bound for any motion through them; None for a fixed path."""

    @property
    def segments(self) -> int:
        """All of them."""
        return len(self.angle_points_deg) - DEGREE

    @property
    def at_knots(self) -> Array:
        """Angles at the ends of the segments: (S + 1, J)."""
        pieces = bspline.polynomials(self.angle_points_deg, DEGREE)
        return np.concatenate([pieces[:, 0], pieces[-1:].sum(axis=1)])


def between(arm: Arm, job: Job, leg: Leg, via_deg: Array, progress: Progress) -> Between:
    """The path of a leg of a job with via angles (n + 1, J); PlanError if no free one stays in the ranges."""
    own = via_deg[leg.first : leg.last + 1]
    if checks.is_free(job) and np.any(np.ptp(own, axis=0) > checks.TOLERANCE):
        return _free(arm, job, leg, own, progress)
    points = bspline.refined(bspline.fit(own, DEGREE), REST_PIECES, DEGREE)
    return Between(points, tuple(REST_PIECES * via for via in range(len(own))))


def _free(arm: Arm, job: Job, leg: Leg, via_deg: Array, progress: Progress) -> Between:
    """The free path of a separate job from rest to rest, on few segments, as all legs share the board's
    memory."""
    ends = [tuple(angles.tolist()) for angles in via_deg[[0, -1]]]
    alone = replace(
        job,
        via=(ends[0], *job.via[leg.first + 1 : leg.last], ends[1]),
        refine=job.refine if isinstance(job.refine, int) else REST_PIECES,
        stops=(),
        tool_segments=(),
        speed_mm_s=None,
        acceleration_mm_s2=None,
    )
    planned = around.motion(arm, alone, via_deg, progress, nearest=False)
    joints = planned.trajectory.joints
    points = np.stack([joint.angle_points_deg for joint in joints], axis=1)
    search = planned.searches[0]
    arrivals = joints[0].via_segments
    assert arrivals is not None
    return Between(points, arrivals, LowerBound(search.lower_bound_s, search.lower_bound_kind))


DEGREE = 5
_LINE_PIECES = 8
"""Initial number of segments of a line."""
_SAME_DEG = 1e-4
"""Tolerance for equal postures."""
_FLOOR, _CORNER = 0.2, 2.5
"""Slowness along the path relative to its mean: the least, and at a cut corner."""
_SMOOTH = 0.05
"""The slowness is smoothed over this fraction of the path."""
_TABLE = 512


@dataclass(frozen=True, eq=False)
class Led:
    """A leg with a line or arc of the tool, and the postures along its path."""

    leg: Leg
    followed: Followed
    places: Array
    """Fractions of the way at equal steps of u, (_TABLE + 1,), for its knots."""

    def distances(self, count: int) -> Array:
        """Ways at the knots of ``count`` segments: (count + 1,)."""
        steps = np.linspace(0.0, 1.0, count + 1)
        parts = np.interp(steps, np.linspace(0.0, 1.0, _TABLE + 1), self.places)
        return np.asarray(parts * self.followed.course.path.length)

    def keeps(self, away: LineDeviation) -> bool:
        """Whether a deviation is within the job's tolerance."""
        enough = self.leg.enough
        return away.position_mm <= enough.position_mm and away.rotation_deg <= enough.rotation_deg


@dataclass(frozen=True, eq=False)
class LinePath:
    """The joints' spline of all legs."""

    angle_points_deg: Array
    """(S + 5, J)."""
    distance_points: Array
    """Control points of the distances of all legs, with the same knots: (S + 5,)."""
    knots: tuple[int, ...]
    """Segments before each leg, and in total."""
    arrivals: tuple[int, ...]
    """Segments before each via point; approximate for a cut corner."""

    def deviation(self, number: int, led: Led) -> LineDeviation:
        """Bound of the tool's deviation in a leg."""
        first, last = self.knots[number], self.knots[number + 1]
        angles = of_path(self.angle_points_deg, DEGREE)[first:last]
        distances = of_path(self.distance_points[:, None], DEGREE)[first:last, :, 0]
        course, tool = led.followed.course, led.followed.tool
        pieces = SplinePieces(angles, distances - distances[0, 0])
        return proven(pieces, tool, course.path, course.fixed, led.leg.enough)


def led_legs(arm: Arm, job: Job, via_deg: Array) -> dict[int, Led]:
    """The legs of a job with lines or arcs of the tool, by number; raises PlanError if the arm cannot follow."""
    speeds = np.array([limit.speed_deg_s for limit in checks.limits_of(arm)])
    found = {}
    for number, leg in enumerate(cut.of_job(job)):
        if leg.tool_segments:
            followed = _followed(arm, job, leg, via_deg)
            found[number] = Led(leg, followed, _places(followed, speeds))
    return found


def _followed(arm: Arm, job: Job, leg: Leg, via_deg: Array) -> Followed:
    first_deg, last_deg = via_deg[leg.first], via_deg[leg.last]
    found = follow(cut.course(arm, job, leg, first_deg), first_deg, last_deg)
    off = np.abs(found.end_deg - via_deg[leg.last])
    worst = int(np.argmax(off))
    if off[worst] > _SAME_DEG:
        raise PlanError(
            f"{leg.name}: along the line the arm comes to P{leg.last} with {arm.driven[worst].name} at "
            f"{found.end_deg[worst]:.4g} {arm.driven[worst].unit.word}, not {via_deg[leg.last, worst]:.4g}",
            f"give P{leg.last} as a pose, or the {arm.texts.position}s of the branch of "
            f"P{leg.first}; or leave line out",
        )
    return found


def _places(found: Followed, speeds: Array) -> Array:
    """Places on the path at equal steps of u: dense at both ends, and where the joints turn far."""
    u = np.linspace(0.0, 1.0, _TABLE + 1)
    places = found.distances / found.distances[-1]
    taken = np.abs(np.diff(found.angles_deg, axis=0) / speeds).max(axis=1) / np.diff(places)
    slow = np.interp(u, 0.5 * (places[1:] + places[:-1]), taken)
    slow = np.maximum(slow, _FLOOR * slow.mean())
    path = found.course.path
    for place, cut_mm in zip(path.starts[1:-1], path.cuts, strict=True):
        if cut_mm > 0.0:  # a cut corner gets as many segments as a longer line
            near = np.abs(u * path.length - place) < cut_mm
            slow[near] = np.maximum(slow[near], _CORNER * slow.mean())
    reach = int(3 * _SMOOTH * _TABLE)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / (_SMOOTH * _TABLE)) ** 2)
    slow = np.convolve(np.pad(slow, reach, mode="reflect"), kernel / kernel.sum(), mode="valid")
    done = np.concatenate([[0.0], np.cumsum(0.5 * (slow[1:] + slow[:-1]))])
    eased = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    return np.asarray(np.interp(eased, done / done[-1], u))


class Proven(NamedTuple):
    """A spline within the tolerance, and the proven deviation of each leg with lines."""

    path: LinePath
    away: dict[int, LineDeviation]


def proven_paths(
    arm: Arm, job: Job, via_deg: Array, parts: Mapping[int, Led | Between], finest: int
) -> list[Proven]:
    """Splines that are proven to keep the tolerance, each with twice as many segments on the lines as the one before.

    From the fewest to ``finest`` a line, if the board holds them: so a wider tolerance only adds splines. At least
    one. Raises PlanError if the board cannot hold it.
    """
    legs = cut.of_job(job)
    led = {number: one for number, one in parts.items() if isinstance(one, Led)}
    most = board_limits.most_segments(arm) - DWELL_SEGMENTS * sum(stop.dwell_s > 0.0 for stop in job.stops)
    pieces = [
        one.segments if isinstance(one, Between) else _LINE_PIECES * len(leg.tool_segments)
        for leg, (_, one) in zip(legs, sorted(parts.items()), strict=True)
    ]
    if sum(pieces) > most:
        raise PlanError(
            f"job {job.name!r}: its lines and the motions between them need {sum(pieces)} segments at least, the board "
            f"holds {most}",
            "use fewer via points, or plan the legs between rests one by one with --split",
        )
    found: list[Proven] = []
    while True:
        path = _path(legs, pieces, via_deg, parts)
        away = {number: path.deviation(number, one) for number, one in led.items()}
        wide = [number for number, one in led.items() if not one.keeps(away[number])]
        if not wide:
            found.append(Proven(path, away))
        short = [number for number in led if 2 * pieces[number] <= finest * len(legs[number].tool_segments)]
        before, pieces = (
            pieces,
            [2 * count if number in (wide or short) else count for number, count in enumerate(pieces)],
        )
        if found and (pieces == before or sum(pieces) > most):
            return found
        if sum(pieces) > most:
            raise PlanError(
                f"{led[wide[0]].leg.name}: with {before[wide[0]]} segments the tool is only proven to stay "
                f"within {away[wide[0]].position_mm:.3g} mm and {away[wide[0]].rotation_deg:.3g} deg of its path, and "
                f"the board holds {most} in all",
                "widen tolerance_mm and tolerance_deg, keep away from singular postures, or plan with --split",
            )


def _path(
    legs: Sequence[Leg], pieces: Sequence[int], via_deg: Array, parts: Mapping[int, Led | Between]
) -> LinePath:
    """The spline through the postures of all legs, with rests between them."""
    knots, arrivals = [0], [0]
    rows = []
    before = 0.0
    for number, (leg, count) in enumerate(zip(legs, pieces, strict=True)):
        one = parts[number]
        if isinstance(one, Led):
            distances = one.distances(count)
            angles = one.followed.at(distances)
            passed = _passed(one, distances)
        else:
            distances = np.linspace(0.0, 1.0, count + 1)
            angles = one.at_knots
            passed = list(one.arrivals[1:])
        angles[[0, -1]] = via_deg[[leg.first, leg.last]]
        rows.append(np.column_stack([angles, before + distances])[0 if number == 0 else 1 :])
        before += float(distances[-1])
        arrivals += [knots[-1] + knot for knot in passed]
        knots.append(knots[-1] + count)
    whole = bspline.fit(np.concatenate(rows), DEGREE, knots[1:-1])
    return LinePath(np.asarray(whole[:, :-1]), np.asarray(whole[:, -1]), tuple(knots), tuple(arrivals))


def _passed(one: Led, distances: Array) -> list[int]:
    """The knots of a leg nearest to each of its via points except the first, increasing."""
    found: list[int] = []
    for place in one.followed.course.path.starts[1:]:
        nearest = int(np.argmin(np.abs(distances - place)))
        found.append(max(nearest, found[-1] + 1) if found else max(nearest, 1))
    return found


# dwells
DWELL_SEGMENTS = DEGREE
"""Segments that a dwell adds to the path."""
_LEAST_STEP = 1e-3
"""Addition to the time axis for a dwell that is too short, as a fraction of the step before it."""


@dataclass(frozen=True, eq=False)
class TimedPath:
    """A path of S segments on a time axis with ``refine`` segments per path segment."""

    angle_points_deg: Array
    """(S + 5, J)."""
    differences_s: Array
    """Of the time control points, (S * refine + 4,)."""
    arrivals: tuple[int, ...]
    """Segments before each via point."""
    refine: int

    def with_dwells(self, dwells_s: Mapping[int, float]) -> TimedPath:
        """The path with dwells, in seconds by via point; each is at a rest, where five control points are equal.

        The time axis before and after is unchanged. The four differences common to both sides of the rest are
        duplicated, so a dwell lasts at least their sum: hundredths to tenths of a second.
        """
        timed = self
        for via in sorted(dwells_s, reverse=True):
            timed = timed._with_dwell(via, dwells_s[via])
        return timed

    def _with_dwell(self, via: int, dwell_s: float) -> TimedPath:
        knot, shared = self.arrivals[via], DEGREE - 1
        segments = -(-DEGREE // self.refine)
        first, count = knot * self.refine, segments * self.refine
        before, after = self.differences_s[: first + shared], self.differences_s[first:]
        twice = np.concatenate([before[-shared:], np.zeros(count - shared), after[:shared]])
        lasts_s = float(np.convolve(np.ones(count), mean_slopes(DEGREE)) @ twice)
        step = max((dwell_s - lasts_s) / (count - shared), _LEAST_STEP * before[-1])
        return TimedPath(
            np.insert(self.angle_points_deg, [knot] * segments, self.angle_points_deg[knot], axis=0),
            np.concatenate([before, np.full(count - shared, step), after]),
            tuple(at + segments * (number > via) for number, at in enumerate(self.arrivals)),
            self.refine,
        )
