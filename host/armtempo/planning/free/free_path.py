"""The fastest motion with a free path through via points: starts, layouts, results."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import PlanError
from armtempo.basics.progress import Progress, alive, stage
from armtempo.model.parts import Limits
from armtempo.planning import rest_to_rest
from armtempo.planning.free import angle_bounds, corridor, free_start, layout
from armtempo.planning.free.free_motion import Demand, FreeMotion, Improver, through
from armtempo.planning.free.layout import DEGREE, LEAST_PIECES, Layout
from armtempo.splines import bspline

_COARSE_PIECES = 8
_PIECES, _LEAST = 32, 96
"""Segments of an automatic layout: per leg between via points, and least total."""
_EVEN_PIECES = 24
"""Segments per leg if all have the same number."""
ROUNDS = 8
"""Solves on the final segments, each with the peaks of the one before; fewer if the limits hold between points."""
_SPREAD = 0.5
"""Standard deviation of the logarithm of the random factors on the legs' times."""
_INSIDE = 0.998
"""Fraction of the tool's corridor used at points, so that it holds between them."""
_DRAWN = 8
"""Largest number of moves towards the spline until the corridor is proven."""


@dataclass(frozen=True, eq=False)
class Effort:
    """Settings of the effort for a free path."""

    pieces: int | None
    """Segments between two via points; None: automatic, in proportion to time."""
    most: int
    """Largest number of segments in the record."""
    starts: int
    rng: np.random.Generator
    along_s: Array | None = None
    """Differences of a time axis of the spline through the via points: if given, the only start in a corridor."""
    known: Shortest | None = None
    """A motion without some of the tolerances, from which one with them starts."""
    led: bool = False
    """Whether via points lead along a path that was found before: then one start will do."""
    rounds: int = ROUNDS
    """Solves with tolerances."""


@dataclass(frozen=True, eq=False)
class Shortest:
    """The fastest motion found, and the results of the starts."""

    motion: FreeMotion
    starts_s: Array
    """Motion time of each start on few segments; only the best was refined."""


def shortest(demand: Demand, effort: Effort, progress: Progress) -> Shortest:
    """The fastest motion that meets the demand, from several starts.

    With tolerances, it starts from a known motion, or that which passes the via points exactly, so it is never slower.
    Raises PlanError if no start keeps ranges and corridor.
    """
    if demand.tolerances:
        exact = effort.known or shortest(replace(demand, tolerances={}), effort, progress)
        looser = Improver(_tightened(demand), exact.motion.layout).improved(exact.motion, effort.rounds)
        return replace(exact, motion=_within_corridor(demand, looser))
    even = effort.pieces is not None or _in_corridor(demand)
    starts = _starts(_tightened(demand), effort, even)
    whole = len(starts) + ROUNDS
    best: FreeMotion | None = None
    times: list[float] = []
    problem: PlanError | None = None
    for number, start in enumerate(starts):
        if effort.led and best is not None:
            break
        stage(f"start {number + 1} of {len(starts)}")
        try:
            motion = start()
            found = Improver(_tightened(demand), motion.layout).improved(motion, 1)
        except PlanError as error:
            problem = problem or error
        else:
            times.append(found.total_s)
            best = found if best is None or found.total_s < best.total_s else best
        progress(number + 1, whole)
    if best is None:
        raise problem or PlanError("a free path needs at least one start", "set starts to 1 or more")
    stage("improving the best")
    final = _faster_than_stopping(demand, _finished(demand, best, effort, even), effort, progress)
    progress(whole, whole)
    return Shortest(final, np.array(times))


def _faster_than_stopping(
    demand: Demand, motion: FreeMotion, effort: Effort, progress: Progress
) -> FreeMotion:
    """The motion, or if stopping at every via point is faster, one that is improved from there."""
    every = {via: demand.stops.get(via, 0.0) for via in range(1, len(demand.via_deg) - 1)}
    limits = [Limits(*values) for values in demand.limits]
    stopping_s = rest_to_rest.stopping_s(demand.via_deg, limits, True) + sum(demand.stops.values())
    if motion.total_s <= stopping_s or every.keys() == demand.stops.keys() or _in_corridor(demand):
        return motion
    stage("starting from stops")
    stopping = shortest(replace(demand, stops=every), effort, progress).motion
    start = replace(stopping, layout=Layout(stopping.layout.pieces, demand.stops))
    found = Improver(demand, start.layout).improved(start, ROUNDS)
    return min(motion, found, key=lambda each: each.total_s)


def automatic_pieces(legs: int, most: int) -> int:
    """Segments between two via points if all have the same number."""
    return max(min(_EVEN_PIECES, most // legs), LEAST_PIECES)


def _starts(demand: Demand, effort: Effort, even: bool) -> list[Callable[[], FreeMotion]]:
    """Functions that make start motions."""
    legs = len(demand.via_deg) - 1
    if effort.along_s is not None:
        return [partial(free_start.on_time_axis, demand, effort.along_s)]
    pieces = min(_COARSE_PIECES, max(effort.most // legs, LEAST_PIECES))
    if even:
        pieces = effort.pieces or automatic_pieces(legs, effort.most)
    level = np.ones(legs)
    starts: list[Callable[[], FreeMotion]] = [partial(free_start.along_spline, demand, pieces, level)]
    needed = rest_to_rest.needed_s(demand.via_deg, demand.limits)
    for number in range(1, effort.starts):
        factors = np.exp(_SPREAD * effort.rng.standard_normal(legs)) if number > 1 else np.ones(legs)
        shares = needed * factors
        if _in_corridor(demand):
            starts.append(partial(free_start.along_spline, demand, pieces, shares))
            continue
        chosen = layout.uniform(legs + 1, pieces, demand.stops)
        if not even:
            chosen = layout.shared_out(shares, chosen.segments, demand.stops)
        starts.append(partial(free_start.smooth, demand, chosen, shares))
    # the spline swings where via points that lead along a path are at uneven distances
    return starts[1:] + starts[:1] if effort.led else starts


def _finished(demand: Demand, motion: FreeMotion, effort: Effort, even: bool) -> FreeMotion:
    """The motion optimised on the final number of segments."""
    tightened = _tightened(demand)
    if not even:
        legs = len(demand.via_deg) - 1
        segments = min(effort.most, max(_PIECES * legs, _LEAST))
        finer = layout.shared_out(motion.leg_times_s, segments, demand.stops)
        motion = min(
            (_resampled(tightened, finer, motion), motion.scaled(demand.limits)),
            key=lambda each: each.total_s,
        )
    else:
        motion = Improver(tightened, motion.layout).improved(motion, ROUNDS)
    return _within_corridor(demand, motion)


def _resampled(demand: Demand, finer: Layout, motion: FreeMotion) -> FreeMotion:
    start = free_start.resampled(demand, finer, motion)
    return Improver(demand, finer).improved(start, ROUNDS)


def _in_corridor(demand: Demand) -> bool:
    return min(demand.corridor_deg, demand.corridor_mm) < np.inf


def _tightened(demand: Demand) -> Demand:
    """The demand with the tool's corridor reduced by _INSIDE."""
    return replace(demand, corridor_mm=demand.corridor_mm * _INSIDE)


def _within_corridor(demand: Demand, motion: FreeMotion) -> FreeMotion:
    """The motion moved towards the spline through the via points until its deviation is proven to be allowed."""
    if not np.isfinite(demand.corridor_mm) or demand.tool is None:
        return motion
    middle = bspline.refined(bspline.fit(demand.via_deg, DEGREE), int(motion.layout.pieces[0]), DEGREE)
    stage("proving the corridor")
    for _ in range(_DRAWN):
        alive()
        reached = tool_deviation_mm(demand, motion)
        if reached <= demand.corridor_mm:
            return motion
        if demand.stops:  # closer to the spline it would not stop there
            break
        part = _INSIDE * demand.corridor_mm / reached
        points = middle + part * (motion.angle_points_deg - middle)
        motion = replace(motion, angle_points_deg=points).scaled(demand.limits)
    raise PlanError(
        f"no path could be proven to stay within corridor_mm = {demand.corridor_mm:g}",
        "widen the corridor, or "
        + ("take out stops" if demand.stops else "set it to 0 for the spline itself"),
    )


def tool_deviation_mm(demand: Demand, motion: FreeMotion) -> float:
    """Bound of the tool's distance from the spline through the via points, on an even layout."""
    assert demand.tool is not None
    path = angle_bounds.of_path(motion.angle_points_deg, DEGREE)
    return corridor.tool_deviation_mm(path, through(demand, motion.layout), demand.tool)
