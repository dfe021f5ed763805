"""The trade-off of corridor against motion time: wider is never slower, and both ends are the plans without one."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import comb

import numpy as np
import pytest
from armtempo.model.arm import Arm
from armtempo.model.job import Job, Stop
from armtempo.planning import planner
from armtempo.planning.free import corridor, corridor_curve
from armtempo.planning.free.corridor_curve import CorridorTime
from armtempo.planning.tool import Tool
from armtempo.report import plots

from tests.host import problems

ARM = problems.make_arm([[50.0, 50.0, 150.0]] * 2)
JOB = Job("bend", ((0.0, 0.0), (60.0, 10.0), (20.0, 50.0), (80.0, 0.0)), path="free", refine=4, starts=1)


@pytest.mark.slow
def test_it_goes_from_the_spline_to_the_free_path() -> None:
    steps: list[float] = []
    found = corridor_curve.curve(ARM, JOB, lambda done, whole: steps.append(done / whole))
    widths = [each.corridor for each in found]
    assert widths[0] == 0.0
    assert widths[-1] is None
    inner = [float(width or 0.0) for width in widths[1:-1]]
    assert inner == sorted(inner)
    times_s = [each.total_s for each in found]
    assert all(later <= 1.01 * earlier for earlier, later in pairwise(times_s))
    assert times_s[-1] == pytest.approx(planner.plan(ARM, JOB).total_s, rel=0.01)
    assert times_s[-1] < 0.995 * times_s[0]
    assert steps == sorted(steps)
    assert steps[-1] == 1.0


@pytest.mark.slow
def test_with_a_stop_narrow_corridors_hold_no_motion() -> None:
    """The spline does not rest there."""
    job = replace(JOB, via=JOB.via[:3], stops=(Stop(1),))
    found = corridor_curve.curve(ARM, job, lambda done, whole: None)
    widths = [each.corridor for each in found]
    assert widths[-1] is None
    assert 0.0 not in widths
    assert 2 <= len(widths) < 9


@pytest.mark.slow
def test_the_curve_names_both_its_ends() -> None:
    points = [CorridorTime(0.0, 4.0), CorridorTime(1.0, 3.0), CorridorTime(2.0, 2.8), CorridorTime(None, 2.5)]
    axes = plots.corridors(points, "deg", "bend").axes[0]
    found = {line.get_label(): list(line.get_ydata()) for line in axes.get_lines()}
    assert found == {"in a corridor": [3.0, 2.8], "on the spline": [4.0, 4.0], "free": [2.5, 2.5]}
    assert plots.corridor_csv(points, "deg").splitlines()[1:] == ["0.0,4.0", "1.0,3.0", "2.0,2.8", ",2.5"]


@pytest.mark.parametrize("away_deg", [0.003, 0.3, 10.0])
def test_the_tools_deviation_is_bounded_sharply(away_deg: float) -> None:
    """Against the distance at many places of random pieces that are farthest apart off their middles and ends."""
    rng = np.random.default_rng(20261123)
    posture = np.array([0.0, -60.0, 40.0])
    through = posture + rng.uniform(-15.0, 15.0, (4, 6, 3))
    path = through.copy()
    path[:, 1] += rng.uniform(0.5, 1.0, (4, 3)) * away_deg
    tool = Tool(Arm.paper(), [0, 1, 2], posture)
    u = np.linspace(0.0, 1.0, 2001)
    at = np.array([comb(5, k) * u**k * (1.0 - u) ** (5 - k) for k in range(6)])
    places = [
        tool.at(np.einsum("ku,skj->suj", at, pieces).reshape(-1, 3)).position_mm for pieces in (path, through)
    ]
    reached = np.linalg.norm(places[0] - places[1], axis=1).max()
    bound = corridor.tool_deviation_mm(path, through, tool)
    assert reached <= bound <= reached * (1.0 + 2.0 * corridor.SHARP) + 1e-6
