"""The fastest motion through via points whose path is free between them: starts, layouts, and what came of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import PlanError
from armtempo.basics.progress import Progress, alive, stage
from armtempo.planning import rest_to_rest
from armtempo.planning.free import angle_bounds, corridor, free_start, layout
from armtempo.planning.free.free_motion import Demand, FreeMotion, Improver, through
from armtempo.planning.free.layout import DEGREE, LEAST_PIECES, Layout
from armtempo.splines import bspline

_COARSE_PIECES = 8
_PIECES, _LEAST, _MOST = 28, 56, 224
"""Segments that an automatic layout has for each stretch between via points, and at least and at most in all."""
_FEW = 5
"""Segments for each stretch if there are more stretches than _MOST allows."""
_EVEN_PIECES = 24
"""Segments for each stretch if all have the same number."""
_ROUNDS = 3
_SPREAD = 0.5
"""Random starts share time out by factors of this standard deviation of their logarithm."""
_INSIDE = 0.998
"""A corridor of the tool is kept by so much of it at points, so that it holds between them."""
_DRAWN = 8
"""A path is drawn towards the spline so often until its corridor is proven."""


@dataclass(frozen=True, eq=False)
class Effort:
    """How much work is put into a free path."""

    pieces: int | None
    """Segments between any two via points; None: as many as shorten the motion, more if more time passes."""
    most: int
    """Segments that the record can hold."""
    starts: int
    rng: np.random.Generator
    along_s: Array | None = None
    """Differences of a time axis of the spline through the via points, as many for each of its segments: the one start
    in a corridor that has it."""


@dataclass(frozen=True, eq=False)
class Shortest:
    """The fastest motion found, and what the starts led to."""

    motion: FreeMotion
    starts_s: Array
    """Motion time that each start led to on few segments; the best one then went on."""


def shortest(demand: Demand, effort: Effort, progress: Progress) -> Shortest:
    """The fastest motion that meets the demand, from several starts.

    If via points have tolerances it comes from the one that passes them exactly, so it is never slower. Raises
    PlanError if no start keeps ranges and corridor.
    """
    if demand.tolerances:
        exact = shortest(replace(demand, tolerances={}), effort, progress)
        looser = Improver(_tightened(demand), exact.motion.layout).improved(exact.motion, _ROUNDS)
        return replace(exact, motion=_within_corridor(demand, looser))
    even = effort.pieces is not None or _in_corridor(demand)
    ways = _starts(_tightened(demand), effort, even)
    whole = len(ways) + _ROUNDS
    best: FreeMotion | None = None
    times: list[float] = []
    problem: PlanError | None = None
    for number, start in enumerate(ways):
        stage(f"start {number + 1} of {len(ways)}")
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
    final = _finished(demand, best, effort, even)
    progress(whole, whole)
    return Shortest(final, np.array(times))


def automatic_pieces(stretches: int, most: int) -> int:
    """Segments between any two of the via points if all have the same number."""
    return max(min(_EVEN_PIECES, most // stretches), LEAST_PIECES)


def _starts(demand: Demand, effort: Effort, even: bool) -> list[Callable[[], FreeMotion]]:
    """Ways to make a motion to start from."""
    stretches = len(demand.via_deg) - 1
    if effort.along_s is not None:
        return [partial(free_start.on_time_axis, demand, effort.along_s)]
    pieces = min(_COARSE_PIECES, max(effort.most // stretches, LEAST_PIECES))
    if even:
        pieces = effort.pieces or automatic_pieces(stretches, effort.most)
    level = np.ones(stretches)
    ways: list[Callable[[], FreeMotion]] = [partial(free_start.along_spline, demand, pieces, level)]
    needed = rest_to_rest.needed_s(demand.via_deg, demand.limits)
    for number in range(1, effort.starts):
        factors = (
            np.exp(_SPREAD * effort.rng.standard_normal(stretches)) if number > 1 else np.ones(stretches)
        )
        shares = needed * factors
        if _in_corridor(demand):
            ways.append(partial(free_start.along_spline, demand, pieces, shares))
            continue
        chosen = layout.uniform(stretches + 1, pieces, demand.stops)
        if not even:
            chosen = layout.shared_out(shares, chosen.segments, demand.stops)
        ways.append(partial(free_start.smooth, demand, chosen, shares))
    return ways


def _finished(demand: Demand, motion: FreeMotion, effort: Effort, even: bool) -> FreeMotion:
    """The best motion on as many segments as it is to have."""
    tightened = _tightened(demand)
    if not even:
        stretches = len(demand.via_deg) - 1
        segments = min(effort.most, max(_PIECES * stretches, _LEAST))
        finer = layout.shared_out(motion.stretch_times_s, segments, demand.stops)
        motion = min(
            (_resampled(tightened, finer, motion), motion.stretched(demand.limits)),
            key=lambda each: each.total_s,
        )
    else:
        motion = Improver(tightened, motion.layout).improved(motion, _ROUNDS)
    return _within_corridor(demand, motion)


def _resampled(demand: Demand, finer: Layout, motion: FreeMotion) -> FreeMotion:
    start = free_start.resampled(demand, finer, motion)
    return Improver(demand, finer).improved(start, _ROUNDS)


def _in_corridor(demand: Demand) -> bool:
    return min(demand.corridor_deg, demand.corridor_mm) < np.inf


def _tightened(demand: Demand) -> Demand:
    """With the tool's corridor as it is kept at points."""
    return replace(demand, corridor_mm=demand.corridor_mm * _INSIDE)


def _within_corridor(demand: Demand, motion: FreeMotion) -> FreeMotion:
    """The motion drawn towards the spline through the via points, if its deviation is not proven to be allowed."""
    if not np.isfinite(demand.corridor_mm) or demand.tool is None:
        return motion
    middle = bspline.refined(bspline.fit(demand.via_deg, DEGREE), int(motion.layout.pieces[0]), DEGREE)
    stage("proving the corridor")
    for _ in range(_DRAWN):
        alive()
        reached = tool_deviation_mm(demand, motion)
        if reached <= demand.corridor_mm:
            return motion
        if demand.stops:  # nearer to the spline it would not rest there
            break
        part = _INSIDE * demand.corridor_mm / reached
        points = middle + part * (motion.angle_points_deg - middle)
        motion = replace(motion, angle_points_deg=points).stretched(demand.limits)
    raise PlanError(
        f"no path could be proven to stay within corridor_mm = {demand.corridor_mm:g}",
        "widen the corridor, or "
        + ("take out stops" if demand.stops else "set it to 0 for the spline itself"),
    )


def tool_deviation_mm(demand: Demand, motion: FreeMotion) -> float:
    """Bound on how far the tool leaves the spline through the via points, on an even layout."""
    assert demand.tool is not None
    path = angle_bounds.of_path(motion.angle_points_deg, DEGREE)
    return corridor.tool_deviation_mm(path, through(demand, motion.layout), demand.tool)
