"""Peaks next to limits: nothing is called kept or exceeded that the measurement cannot tell."""

from __future__ import annotations

import numpy as np
import pytest
from armtempo.model.parts import Limits
from armtempo.report import analysis, peaks
from armtempo.report.run_reader import RepetitionData
from armtempo.splines.extremes import of_joints
from armtempo.splines.trajectory import Trajectory

from tests.host.test_analyse import PLAN, samples

RESOLUTION_DEG = 0.09
TRUE = of_joints(PLAN.joints)


def limits_at(share: float) -> tuple[Limits, ...]:
    """Limits that the plan reaches to this share."""
    return tuple(Limits(*(value / share for value in extreme.values)) for extreme in TRUE)


def checked(
    runs: list[RepetitionData],
    share: float = 1.0,
    resolution: float = RESOLUTION_DEG,
    plan: Trajectory = PLAN,
) -> list[list[peaks.LimitCheck]]:
    """The checks of some repetitions of ``plan``."""
    found = analysis.curves(runs, plan)
    return peaks.limit_checks(found, plan, limits_at(share), (resolution, resolution))


@pytest.mark.parametrize(
    ("peak", "sigma", "verdict"),
    [
        (33.4, 1.4, peaks.UNDECIDED),  # once a green "kept"
        (33.4, 0.1, peaks.EXCEEDED),
        (30.2, 0.1, peaks.WITHIN),
        (30.0, 1.4, peaks.UNDECIDED),
        (28.0, 0.5, peaks.KEPT),
        (float("nan"), 0.5, peaks.NOT_MEASURED),
    ],
)
def test_a_verdict_needs_three_uncertainties(peak: float, sigma: float, verdict: str) -> None:
    assert peaks.LimitCheck(peak, 30.0, sigma).verdict == verdict


@pytest.mark.parametrize("phase", [0.0, 0.3, 0.7])
def test_an_arm_that_does_as_planned_keeps_its_limits(phase: float) -> None:
    """Rounding to counts makes the plain derivative's peak too high by several uncertainties; not this one."""
    one = samples()
    rounded = (np.rint(one.angle_deg / RESOLUTION_DEG + phase) - phase) * RESOLUTION_DEG
    one.angle_deg[:] = rounded
    for joint, row in enumerate(checked([one])):
        for order, check in enumerate(row):
            assert check.peak == pytest.approx(TRUE[joint].values[order], abs=4.0 * check.sigma)
            assert check.verdict in (peaks.KEPT, peaks.WITHIN)
            assert check.sigma < 0.015 * check.limit


@pytest.mark.parametrize(("gear", "verdict"), [(1.2, peaks.EXCEEDED), (1.0, peaks.WITHIN), (0.9, peaks.KEPT)])
def test_an_arm_that_turns_more_than_planned_shows(gear: float, verdict: str) -> None:
    one = samples(resolution=RESOLUTION_DEG)
    one.angle_deg[:] = one.angle_deg[0] + gear * (one.angle_deg - one.angle_deg[0])
    for row in checked([one]):
        assert [check.verdict for check in row] == [verdict, verdict]


def test_a_coarse_encoder_cannot_tell() -> None:
    """With counts of 2 degrees, no acceleration can be judged to 5 %."""
    found = checked([samples(resolution=2.0)], resolution=2.0)
    assert {row[1].verdict for row in found} == {peaks.UNDECIDED}


def test_a_ringing_arm_is_not_called_fine() -> None:
    """What swings faster than the smoothing follows becomes uncertainty: never a green "kept"."""
    one = samples(resolution=RESOLUTION_DEG)
    one.angle_deg[:] += 0.5 * np.sin(2 * np.pi * 3.1 * one.time_s)[:, None]
    assert {row[1].verdict for row in checked([one])} == {peaks.UNDECIDED}


def test_beside_a_gap_nothing_is_said() -> None:
    whole = samples(resolution=RESOLUTION_DEG)
    whole.angle_deg[40:60] = np.nan
    for joint, row in enumerate(checked([whole])):
        for order, check in enumerate(row):
            assert check.peak <= TRUE[joint].values[order] + 4.0 * check.sigma


def test_a_joint_without_an_encoder_is_not_measured() -> None:
    one = samples()
    one.angle_deg[:, 1] = np.nan
    found = checked([one])
    assert [check.verdict for check in found[1]] == [peaks.NOT_MEASURED] * 2
    assert found[0][0].verdict in (peaks.KEPT, peaks.WITHIN)


@pytest.mark.slow
def test_the_stated_uncertainty_is_that_of_repeated_measurements() -> None:
    """Seed 7: the same noise in 40 runs; their peaks at one place scatter by the stated sigma."""
    rng = np.random.default_rng(7)
    at = []
    for _ in range(40):
        one = samples()
        one.angle_deg[:] += rng.normal(scale=0.05, size=one.angle_deg.shape)
        found = checked([one], resolution=0.001)
        at.append([[check.peak for check in row] for row in found])
        stated = [[check.sigma for check in row] for row in found]
    scatter = np.std(at, axis=0)
    assert np.all(scatter < 1.3 * np.array(stated))
    assert np.all(scatter > 0.3 * np.array(stated))
