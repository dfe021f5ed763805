"""Singular poses, and the regions of Fig. 3 with their borders: answers are defined, exact, and said to be singular."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from armtempo.kinematics import forward, inverse
from armtempo.kinematics.closed_form import classify
from armtempo.kinematics.shape import Shape
from armtempo.kinematics.solutions import (
    DUPLICATE,
    ELBOW_STRETCHED,
    IN_OFFSET,
    OK,
    ON_AXIS_1,
    TOO_FAR,
    TOO_NEAR,
    WRIST_STRAIGHT,
)

from tests.host.arms import NAMED, PAPER, SHAPE, drawn, turned, with_wrist_at, worst_error

A1, D1 = abs(SHAPE.shoulder), SHAPE.height
FAR, NEAR = SHAPE.farthest, SHAPE.nearest
# An arm whose folded elbow leaves a hole around axis 1 too, so that region I exists.
HOLLOW = Shape.of(replace(PAPER, a=(-20.0, 300.0, 0.0, 0.0, 0.0, 0.0), d=(130.0, 0.0, 0.0, 100.0, 0.0, 40.0)))


def test_wrist_centre_on_axis_1_keeps_joint_1() -> None:
    previous = np.radians([37.0, -60.0, 40.0, 0.0, 0.0, 0.0])
    pose = with_wrist_at(0.0, 350.0)
    solutions = inverse(PAPER, pose, previous)
    assert (solutions.outcome == OK).all()
    assert (solutions.singular & ON_AXIS_1).all()
    np.testing.assert_allclose(solutions.angles_rad[0, :4, 0], previous[0], atol=1e-12)
    np.testing.assert_allclose(solutions.angles_rad[0, 4:, 0], previous[0] - np.pi, atol=1e-12)
    assert worst_error(PAPER, solutions.angles_rad, pose[None]) < 1e-12


def test_straight_wrist_keeps_joint_4_and_the_sum() -> None:
    angles = np.radians([20.0, -60.0, 40.0, 15.0, 0.0, 25.0])
    previous = np.radians([0.0, 0.0, 0.0, -70.0, 10.0, 100.0])
    pose = forward(PAPER, angles)
    solutions = inverse(PAPER, pose, previous)
    plain, flipped = solutions.angles_rad[0, :2]
    np.testing.assert_allclose(np.degrees(plain), [20.0, -60.0, 40.0, -70.0, 0.0, 110.0], atol=1e-9)
    np.testing.assert_allclose(np.degrees(flipped[3:]), [110.0, 0.0, -70.0], atol=1e-9)
    assert solutions.singular[0, :2].tolist() == [WRIST_STRAIGHT] * 2
    assert solutions.singular[0, 2] == 0
    assert worst_error(PAPER, solutions.angles_rad, pose[None]) < 1e-12


@pytest.mark.parametrize("bend", [0.0, 1e-15, 1e-12, 1e-10, 1e-8, 1e-5])
def test_the_pose_is_kept_ever_nearer_to_the_straight_wrist(bend: float) -> None:
    rng = np.random.default_rng(10)
    for name, geometry in NAMED.items():
        angles = rng.uniform(-np.pi, np.pi, (100, 6))
        angles[:, 4] = bend - geometry.offset[4]
        poses = forward(geometry, angles)
        found = inverse(geometry, poses, rng.uniform(-np.pi, np.pi, 6)).angles_rad
        assert worst_error(geometry, found, poses) < 1e-9, name


@pytest.mark.parametrize("stretch", [0.0, 1e-15, 1e-12, 1e-9, 1e-7, 1e-5, 1e-3])
@pytest.mark.parametrize("folded", [False, True])
def test_the_pose_is_kept_ever_nearer_to_the_stretched_elbow(stretch: float, folded: bool) -> None:
    rng = np.random.default_rng(11)
    for name, geometry in NAMED.items():
        shape = Shape.of(geometry)
        angles = rng.uniform(-np.pi, np.pi, (100, 6))
        angles[:, 2] = shape.sign2 * (stretch + folded * np.pi - shape.bend) - geometry.offset[2]
        poses = forward(geometry, angles)
        solutions = inverse(geometry, poses)
        assert worst_error(geometry, solutions.angles_rad, poses) < 1e-9, name
        assert np.isfinite(solutions.angles_rad).all(axis=2).any(axis=1).all(), name


def test_stretched_elbow_makes_down_a_duplicate_of_up() -> None:
    for planar in (SHAPE.farthest - 100.0, SHAPE.farthest + 100.0):
        solutions = inverse(PAPER, with_wrist_at(planar, 0.0, 0.3))
        border, other = (0, 1) if planar < SHAPE.farthest else (1, 0)
        outcome = solutions.outcome[0].reshape(2, 2, 2)
        singular = solutions.singular[0].reshape(2, 2, 2)
        assert (outcome[border, 0] == OK).all()
        assert (outcome[border, 1] == DUPLICATE).all()
        assert (singular[border] & ELBOW_STRETCHED).all()
        assert (outcome[other] == (OK if other else TOO_FAR)).all()
        assert not (singular[other] & ELBOW_STRETCHED).any()
        angles = solutions.angles_rad[0].reshape(2, 2, 2, 6)
        np.testing.assert_array_equal(angles[border, 0], angles[border, 1])


def test_number_of_solutions_is_twice_that_of_postures_on_every_side_of_a_border() -> None:
    near, far, a1 = SHAPE.nearest, SHAPE.farthest, 100.0
    for planar, postures in (
        (a1 + near, 3),
        (a1 + near + 1e-6, 4),
        (a1 + near - 1e-6, 2),
        (far - a1, 3),
        (far - a1 - 1e-6, 4),
        (far - a1 + 1e-6, 2),
        (far + a1, 1),
        (far + a1 + 1e-6, 0),
    ):
        outcome = inverse(PAPER, with_wrist_at(planar, 0.0, 1.1)).outcome
        assert (outcome == OK).sum() == 2 * postures, planar


def test_hole_around_the_shoulder_is_too_near() -> None:
    outcome = inverse(PAPER, with_wrist_at(100.0, 0.0)).outcome[0]
    assert outcome.tolist() == [OK] * 4 + [TOO_NEAR] * 4


def test_wrist_centre_on_the_shoulder_axis_keeps_joint_2() -> None:
    geometry = replace(PAPER, a=(-100.0, 300.0, 0.0, 0.0, 0.0, 0.0), d=(130.0, 0.0, 0.0, 300.0, 0.0, 40.0))
    previous = np.radians([0.0, -75.0, 0.0, 0.0, 0.0, 0.0])
    shape = Shape.of(geometry)
    angles = np.array([0.4, -1.0, shape.sign2 * (np.pi - shape.bend), 0.1, 0.2, 0.3])
    pose = forward(geometry, angles)
    solutions = inverse(geometry, pose, previous)
    at_shoulder = (solutions.singular[0] & ELBOW_STRETCHED) > 0
    assert at_shoulder.sum() == 4
    np.testing.assert_allclose(solutions.angles_rad[0, at_shoulder, 1], previous[1], atol=1e-12)
    assert worst_error(geometry, solutions.angles_rad, pose[None]) < 1e-11


def test_border_of_the_shoulder_offset() -> None:
    puma = NAMED["puma_560"]
    pose = np.eye(4)
    pose[:3, 3] = puma.d[2] * np.cos(0.9), puma.d[2] * np.sin(0.9), 0.9
    solutions = inverse(puma, pose)
    outcome = solutions.outcome[0].reshape(2, 4)
    assert outcome.tolist() == [[OK] * 4, [DUPLICATE] * 4]
    angles = solutions.angles_rad[0].reshape(2, 2, 2, 6)
    # Front and rear are one, and what is up for the one is down for the other.
    assert turned(angles[0] - angles[1, ::-1]).max() < 1e-12
    assert worst_error(puma, solutions.angles_rad, pose[None]) < 1e-11
    pose[:2, 3] *= 0.99
    assert (inverse(puma, pose).outcome == IN_OFFSET).all()


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
    for planar, up in zip(rng.uniform(0, reach, 60), rng.uniform(-reach, reach, 60), strict=True):
        radii = np.hypot(np.array([planar, -planar]) - shape.shoulder, up)
        if np.abs(radii[:, None] - [shape.farthest, shape.nearest]).min() > 0.02 * reach:
            assert at(shape, planar, up)[1] == counted(shape, planar, up), (planar, up)
