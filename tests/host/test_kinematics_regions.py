"""Regions of Fig. 3: names and numbers of arm postures, inside and exactly on the borders."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from armtempo.kinematics.regions import classify
from armtempo.kinematics.shape import Shape

from tests.host.published_arms import NAMED, PAPER, drawn

SHAPE = Shape.of(PAPER)
A1, D1 = abs(SHAPE.shoulder), SHAPE.height
FAR, NEAR = SHAPE.farthest, SHAPE.nearest
# An arm whose folded elbow leaves a hole around axis 1 too, so that region I exists.
HOLLOW = Shape.of(replace(PAPER, a=(-20.0, 300.0, 0.0, 0.0, 0.0, 0.0), d=(130.0, 0.0, 0.0, 100.0, 0.0, 40.0)))


def at(shape: Shape, planar: float, up: float, turn: float = 0.7) -> tuple[str, int]:
    """Region and number of postures, ``planar`` from axis 1 and ``up`` above the shoulder."""
    point = [planar * np.cos(turn), planar * np.sin(turn), shape.height + up]
    found = classify(shape, point)
    return found.names[0], int(found.postures[0])


# The shoulder is 100 behind the base axis (a1 = -100): from the front at -100, from the rear at 100.
@pytest.mark.parametrize(
    ("planar", "up", "expected"),
    [
        (300.0, 0.0, ("II", 4)),
        (300.0, 200.0, ("II", 4)),
        (FAR, 0.0, ("III", 2)),  # beyond the front border, within the rear one
        (A1, 0.0, ("III", 2)),  # in the hole around the rear shoulder
        (FAR + A1 + 1.0, 0.0, ("IV", 0)),
        (0.0, FAR + 1.0, ("IV", 0)),
        (FAR - A1, 0.0, ("II-III", 3)),
        (A1 + NEAR, 0.0, ("II-III", 3)),
        (A1 - NEAR, 0.0, ("II-III", 3)),
        (A1, NEAR, ("II-III", 3)),
        (FAR + A1, 0.0, ("III-IV", 1)),
        (A1, FAR, ("III-IV", 1)),
        (A1, -FAR, ("III-IV", 1)),
        (0.0, np.sqrt(FAR**2 - A1**2), ("II-IV", 2)),  # where both outer borders meet, on axis 1
    ],
)
def test_the_paper_s_arm(planar: float, up: float, expected: tuple[str, int]) -> None:
    assert at(SHAPE, planar, up) == expected


@pytest.mark.parametrize(
    ("planar", "up", "expected"),
    [
        (100.0, 0.0, ("I", 0)),
        (HOLLOW.nearest - 20.0, 0.0, ("I-III", 1)),
        (HOLLOW.nearest, 0.0, ("III", 2)),
        (HOLLOW.nearest + 20.0, 0.0, ("II-III", 3)),
        (HOLLOW.nearest + 40.0, 0.0, ("II", 4)),
        (HOLLOW.farthest - 20.0, 0.0, ("II-III", 3)),
        (HOLLOW.farthest + 20.0, 0.0, ("III-IV", 1)),
        (HOLLOW.farthest + 40.0, 0.0, ("IV", 0)),
    ],
)
def test_an_arm_with_a_hole_around_the_base_axis(planar: float, up: float, expected: tuple[str, int]) -> None:
    assert at(HOLLOW, planar, up) == expected


def test_front_and_rear_borders_fall_together_without_a1() -> None:
    shape = replace(SHAPE, shoulder=0.0)
    assert at(shape, FAR - 1.0, 0.0) == ("II", 4)
    assert at(shape, FAR, 0.0) == ("II-IV", 2)
    assert at(shape, FAR + 1.0, 0.0) == ("IV", 0)
    assert at(shape, NEAR, 0.0) == ("I-II", 2)
    assert at(shape, NEAR - 1.0, 0.0) == ("I", 0)


def test_shoulder_offset_leaves_a_cylinder_free() -> None:
    shape = replace(SHAPE, offset=50.0)
    assert at(shape, 49.0, 200.0) == ("I", 0)
    assert at(shape, 50.0, 200.0)[1] == 2  # front and rear are one there
    assert at(shape, 51.0, 200.0) == ("II", 4)


def test_on_axis_1_any_angle_will_do() -> None:
    found = classify(SHAPE, [[0.0, 0.0, D1 + 400.0], [1.0, 0.0, D1 + 400.0]])
    assert found.axis.tolist() == [True, False]
    assert found.postures.tolist() == [4, 4]


def test_region_two_is_where_the_inequalities_of_eq_3_hold() -> None:
    rng = np.random.default_rng(8)
    x, y, z = rng.uniform(-900, 900, (3, 20_000))
    planar = np.hypot(x, y)
    with np.errstate(invalid="ignore"):
        line_1 = x**2 + y**2 < (np.sqrt(FAR**2 - (z - D1) ** 2) - A1) ** 2
        line_2 = D1 - np.sqrt(FAR**2 - A1**2) < z
        line_3 = D1 + np.sqrt(FAR**2 - A1**2) > z
        line_4 = planar**2 + z**2 - 2 * z * D1 - 2 * A1 * planar + A1**2 + D1**2 > NEAR**2
    all_four = line_1 & line_2 & line_3 & line_4
    assert 0.1 < all_four.mean() < 0.9
    np.testing.assert_array_equal(classify(SHAPE, np.stack((x, y, z), axis=1)).postures == 4, all_four)


def counted(shape: Shape, planar: float, up: float) -> int:
    """Postures counted by walking the elbow once around the shoulder and looking for L34, front and rear."""
    turn = np.linspace(0, 2 * np.pi, 4001)
    elbow_out, elbow_up = shape.upper * np.cos(turn), shape.upper * np.sin(turn)
    forward = np.sqrt(planar**2 - shape.offset**2) if planar > abs(shape.offset) else np.nan
    postures = 0
    for out in (forward - shape.shoulder, -forward - shape.shoulder):
        miss = np.hypot(out - elbow_out, up - elbow_up) - shape.fore
        postures += int(np.count_nonzero(np.diff(np.signbit(miss)))) if np.isfinite(out) else 0
    return postures


@pytest.mark.parametrize("name", [*NAMED, "drawn"])
def test_numbers_of_postures_against_counting(name: str) -> None:
    rng = np.random.default_rng(9)
    shape = Shape.of(NAMED.get(name) or drawn(rng))
    reach = shape.farthest + abs(shape.shoulder)
    for planar, up in zip(rng.uniform(0, reach, 300), rng.uniform(-reach, reach, 300), strict=True):
        radii = np.hypot(np.array([planar, -planar]) - shape.shoulder, up)
        if np.abs(radii[:, None] - [shape.farthest, shape.nearest]).min() > 0.02 * reach:
            assert at(shape, planar, up)[1] == counted(shape, planar, up), (planar, up)
