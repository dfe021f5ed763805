"""Splines: fit, polynomials, refinement."""

from __future__ import annotations

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.splines import bspline

from tests.host.feeding import FEEDING


@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("count", [2, 3, 4, 7, 60])
def test_passes_its_points_and_starts_and_ends_at_rest(degree: int, count: int) -> None:
    points = np.random.default_rng(count).normal(0, 100, (count, 2))
    pieces = bspline.polynomials(bspline.fit(points, degree), degree)
    assert pieces.shape == (count - 1, degree + 1, 2)
    assert pieces[:, 0] == pytest.approx(points[:-1], abs=1e-11)
    assert pieces[-1].sum(axis=0) == pytest.approx(points[-1], abs=1e-11)
    for order in range(1, (degree + 1) // 2):
        derived = bspline.derivative(pieces, order)
        assert derived[0, 0] == pytest.approx(0, abs=1e-10)
        assert derived[-1].sum(axis=0) == pytest.approx(0, abs=1e-10)


@pytest.mark.parametrize("degree", [3, 5])
def test_is_smooth_at_the_points(degree: int) -> None:
    pieces = bspline.polynomials(bspline.fit(FEEDING, degree), degree)
    for order in range(degree):
        derived = bspline.derivative(pieces, order)
        assert derived[1:, 0] == pytest.approx(derived[:-1].sum(axis=1), abs=1e-9)


def test_one_joint_alone_is_the_same_as_among_others() -> None:
    together = bspline.fit(FEEDING, 5)
    assert bspline.fit(FEEDING[:, 1], 5) == pytest.approx(together[:, 1], abs=1e-12)


@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("parts", [1, 2, 3, 8])
def test_subdivided_is_the_same_curve(degree: int, parts: int) -> None:
    pieces = bspline.polynomials(bspline.fit(FEEDING, degree), degree)
    finer = bspline.subdivide(pieces, parts)
    v = np.linspace(0, 1, 7)
    for segment in range(len(finer)):
        u = (segment % parts + v) / parts
        expected = np.polynomial.polynomial.polyval(u, pieces[segment // parts])
        assert np.polynomial.polynomial.polyval(v, finer[segment]) == pytest.approx(expected, abs=1e-10)


@pytest.mark.parametrize("points", [[1.0], [], [1.0, np.nan], [1.0, np.inf]])
def test_refuses_what_is_no_path(points: list[float]) -> None:
    with pytest.raises(InputError, match="two points"):
        bspline.fit(points, 5)


def test_refuses_other_degrees() -> None:
    with pytest.raises(InputError, match="degree 4"):
        bspline.fit([0.0, 1.0], 4)
