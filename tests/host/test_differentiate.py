"""Differentiation of samples: exact on polynomials, no lag, and noise as stated."""

from __future__ import annotations

import numpy as np
import pytest
from armtempo.runs import differentiation

STEP = 0.1


@pytest.mark.parametrize("count", [4, 5, 6, 7, 8, 20])
@pytest.mark.parametrize("order", [1, 2])
def test_cubics_come_out_exactly_to_the_very_ends(count: int, order: int) -> None:
    cubic = np.polynomial.Polynomial([3.0, -2.0, 5.0, 1.5])
    t = np.arange(count) * STEP
    found = differentiation.derivative(cubic(t), STEP, order)
    np.testing.assert_allclose(found, cubic.deriv(order)(t), atol=1e-9)


def test_several_joints_at_once_equal_one_by_one() -> None:
    values = np.random.default_rng(1).normal(size=(30, 3))
    both = differentiation.derivative(values, STEP, 1)
    for joint in range(3):
        np.testing.assert_allclose(both[:, joint], differentiation.derivative(values[:, joint], STEP, 1))


@pytest.mark.parametrize("order", [1, 2])
def test_a_wave_is_not_delayed(order: int) -> None:
    t = np.arange(200) * STEP
    found = differentiation.derivative(np.sin(t), STEP, order)[10:-10]
    exact = np.cos(t)[10:-10] if order == 1 else -np.sin(t)[10:-10]
    gain = found @ exact / (exact @ exact)
    assert gain == pytest.approx(1.0, abs=0.01)
    np.testing.assert_allclose(found, gain * exact, atol=1e-3)


@pytest.mark.parametrize("order", [1, 2])
def test_the_stated_noise_is_what_comes_out(order: int) -> None:
    sigma = differentiation.quantisation_sigma(0.09)
    values = np.random.default_rng(2).normal(scale=sigma, size=100_000)
    found = differentiation.derivative(values, STEP, order)[10:-10].std()
    assert found == pytest.approx(differentiation.noise(order, STEP, sigma), rel=0.02)


def test_too_few_samples_say_so_with_nan() -> None:
    assert np.isnan(differentiation.derivative(np.arange(3.0), STEP, 1)).all()
