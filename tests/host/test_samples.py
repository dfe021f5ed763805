"""Analysis of samples: errors, gaps and lags; their derivatives, and peaks next to limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from armtempo.model.parts import Limits
from armtempo.report import analysis, peaks
from armtempo.report.run_reader import RepetitionData
from armtempo.splines import bspline
from armtempo.splines.extremes import of_joints
from armtempo.splines.trajectory import JointSpline, Trajectory

# analysis of samples: what is put in comes out, gaps and lags included; peaks next to limits


VIA = ((0.0, 20, 40, 90, 130, 160, 180), (-60.0, -75, -110, -85, -60, -45, -38))
STEP = 0.1
RESOLUTION_DEG = 0.09


def joint(via: tuple[float, ...], interval_s: float) -> JointSpline:
    """Equal intervals: the paper's motion before optimisation."""
    return JointSpline(5, 1, bspline.fit(np.array(via), 5), interval_s * np.arange(-2.0, len(via) + 2))


PLAN = Trajectory("t", (joint(VIA[0], 2.0), joint(VIA[1], 2.2)), False)


def samples(delay_s: float = 0.0, seed: int | None = None, resolution: float = 0.0) -> RepetitionData:
    """The plan as an encoder would see it: late, with noise, rounded."""
    times = np.append(np.arange(0.0, PLAN.duration_s, 0.1), PLAN.duration_s)
    angles = PLAN(times - delay_s)
    if seed is not None:
        angles = angles + np.random.default_rng(seed).normal(scale=0.05, size=angles.shape)
    if resolution:
        angles = np.rint(angles / resolution) * resolution
    nothing, index = np.zeros(angles.shape, int), np.arange(len(times))
    return RepetitionData(
        "x", "complete", index, times, times, nothing, PLAN(times), angles, 0 * index, 0 * index
    )


def test_exact_samples_show_the_theory() -> None:
    found = analysis.curves([samples()], PLAN)
    assert found.mean.shape == (3, 133, 2)
    for rows, worst in zip(analysis.deviations(found), (1e-9, 0.05, 2.0), strict=True):
        for deviation in rows:
            assert deviation.rms <= deviation.largest <= worst


@pytest.mark.slow
def test_the_standard_error_is_that_of_the_scatter() -> None:
    found = analysis.curves([samples(seed=seed) for seed in range(40)], PLAN)
    assert np.nanmean(found.sem[0]) == pytest.approx(0.05 / np.sqrt(40), rel=0.1)
    assert np.isnan(analysis.curves([samples()], PLAN).sem).all()


@pytest.mark.parametrize("delay", [0.0, 0.02, -0.02])
def test_a_lag_is_found_at_both_ends(delay: float) -> None:
    lags = analysis.lags_s(analysis.curves([samples(delay)], PLAN), PLAN)
    np.testing.assert_allclose(lags, delay, atol=0.003)


def test_a_gap_leaves_a_hole_and_nothing_else() -> None:
    whole = samples()
    keep = np.r_[0:20, 25 : len(whole.time_s)]
    cut = replace(
        whole,
        index=whole.index[keep],
        time_s=whole.time_s[keep],
        path_s=whole.time_s[keep],
        angle_deg=whole.angle_deg[keep],
        commanded_deg=whole.commanded_deg[keep],
    )
    found = analysis.curves([cut], PLAN)
    assert np.isnan(found.mean[0, 20:25]).all()
    assert not np.isnan(np.delete(found.mean, np.s_[20:25], axis=1)).any()
    both = analysis.curves([cut, whole], PLAN)
    assert not np.isnan(both.mean).any()


def test_final_errors_are_taken_at_the_last_sample() -> None:
    late = samples()
    late.angle_deg[-1] += (0.25, -0.5)
    np.testing.assert_allclose(analysis.final_errors(late, PLAN), (0.25, -0.5), atol=1e-9)


def test_no_samples_is_an_error() -> None:
    with pytest.raises(ValueError, match="no samples"):
        analysis.curves([], PLAN)


# differentiation of samples: exact on polynomials, no lag, and noise as stated


@pytest.mark.parametrize("count", [4, 5, 6, 7, 8, 20])
@pytest.mark.parametrize("order", [1, 2])
def test_cubics_come_out_exactly_to_the_very_ends(count: int, order: int) -> None:
    cubic = np.polynomial.Polynomial([3.0, -2.0, 5.0, 1.5])
    t = np.arange(count) * STEP
    found = analysis.derivative(cubic(t), STEP, order)
    np.testing.assert_allclose(found, cubic.deriv(order)(t), atol=1e-9)


def test_several_joints_at_once_equal_one_by_one() -> None:
    values = np.random.default_rng(1).normal(size=(30, 3))
    both = analysis.derivative(values, STEP, 1)
    for joint in range(3):
        np.testing.assert_allclose(both[:, joint], analysis.derivative(values[:, joint], STEP, 1))


@pytest.mark.parametrize("order", [1, 2])
def test_a_wave_is_not_delayed(order: int) -> None:
    t = np.arange(200) * STEP
    found = analysis.derivative(np.sin(t), STEP, order)[10:-10]
    exact = np.cos(t)[10:-10] if order == 1 else -np.sin(t)[10:-10]
    gain = found @ exact / (exact @ exact)
    assert gain == pytest.approx(1.0, abs=0.01)
    np.testing.assert_allclose(found, gain * exact, atol=1e-3)


@pytest.mark.parametrize("order", [1, 2])
def test_the_stated_noise_is_what_comes_out(order: int) -> None:
    sigma = analysis.quantisation_sigma(0.09)
    values = np.random.default_rng(2).normal(scale=sigma, size=100_000)
    found = analysis.derivative(values, STEP, order)[10:-10].std()
    assert found == pytest.approx(analysis.noise(order, STEP, sigma), rel=0.02)


def test_too_few_samples_say_so_with_nan() -> None:
    assert np.isnan(analysis.derivative(np.arange(3.0), STEP, 1)).all()


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


@pytest.mark.long
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
