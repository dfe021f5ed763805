"""Forward kinematics, and one pose by floats: the same answers as by arrays, also on borders and singular poses."""

from __future__ import annotations

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.kinematics import Geometry, forward, inverse, inverse_of_pose, postures
from armtempo.kinematics.shape import Shape
from armtempo.kinematics.solutions import DUPLICATE, ELBOW_STRETCHED, OK

from tests.host.published_arms import (
    EQ_16,
    NAMED,
    PAPER,
    PAPER_FULL_SIZE,
    TABLE_2,
    drawn,
    turned,
    worst_error,
)

EQUAL = 1e-12


def both_ways(geometry: Geometry, poses: np.ndarray, previous: np.ndarray) -> float:
    """Largest difference of an angle, whole turns aside; outcomes and singular bits must be the same."""
    together = inverse(geometry, poses, np.tile(previous, (len(poses), 1)))
    alone = [inverse_of_pose(geometry, pose.ravel().tolist(), previous.tolist()) for pose in poses]
    np.testing.assert_array_equal(together.outcome, [each.outcome for each in alone])
    np.testing.assert_array_equal(together.singular, [each.singular for each in alone])
    angles = np.array([each.angles_rad for each in alone])
    np.testing.assert_array_equal(np.isnan(angles), np.isnan(together.angles_rad))
    assert np.nanmax(np.abs(angles)) <= np.pi
    return float(np.nanmax(turned(angles - together.angles_rad), initial=0.0))


def special_angles(geometry: Geometry, rng: np.random.Generator) -> np.ndarray:
    """Postures (N, 6) with a straight wrist, and with the elbow stretched and folded, ever more exactly."""
    shape = Shape.of(geometry)
    angles = rng.uniform(-np.pi, np.pi, (60, 6))
    nudges = np.tile([0.0, 1e-15, 1e-12, 1e-11, 1e-9, 1e-8, 1e-7, 1e-6, 1e-4, 1e-2], 2)
    angles[:20, 4] = nudges - geometry.offset[4]
    for part, fold in ((slice(20, 40), 0.0), (slice(40, 60), np.pi)):
        angles[part, 2] = shape.sign2 * (nudges + fold - shape.bend) - geometry.offset[2]
    return angles


@pytest.mark.parametrize("name", NAMED)
def test_published_arms_give_the_same_both_ways(name: str) -> None:
    rng = np.random.default_rng(20)
    geometry = NAMED[name]
    angles = np.concatenate((rng.uniform(-np.pi, np.pi, (1500, 6)), special_angles(geometry, rng)))
    poses = forward(geometry, angles)
    poses[::3, :3, 3] *= 1.4  # some of them out of reach
    assert both_ways(geometry, poses, rng.uniform(-3, 3, 6)) < EQUAL


@pytest.mark.parametrize("seed", range(20))
def test_drawn_arms_give_the_same_both_ways(seed: int) -> None:
    rng = np.random.default_rng(seed)
    geometry = drawn(rng)
    angles = np.concatenate((rng.uniform(-np.pi, np.pi, (100, 6)), special_angles(geometry, rng)))
    assert both_ways(geometry, forward(geometry, angles), rng.uniform(-3, 3, 6)) < EQUAL


def test_on_axis_1_and_on_the_border_of_the_offset_too() -> None:
    previous = np.array([0.7, -0.3, 0.2, 1.1, 0.5, -0.4])
    up = np.eye(4)
    up[:3, 3] = 0.0, 0.0, 520.0
    assert both_ways(PAPER, up[None], previous) < EQUAL
    puma = NAMED["puma_560"]
    border, within = np.eye(4), np.eye(4)
    border[:3, 3] = puma.d[2] * np.cos(0.9), puma.d[2] * np.sin(0.9), 0.9
    within[:3, 3] = 0.1, 0.0, 0.9
    assert both_ways(puma, np.stack((border, within)), previous) < EQUAL


def test_inverse_of_one_matrix_gives_arrays_of_the_usual_shape() -> None:
    solutions = inverse(PAPER, forward(PAPER, [0.3, -1.0, 0.7, 0.1, 0.5, 0.2]))
    assert solutions.angles_rad.shape == (1, 8, 6)
    assert solutions.outcome.shape == solutions.singular.shape == (1, 8)
    assert solutions.outcome.dtype == np.uint8


def test_an_arm_outside_the_class_is_refused() -> None:
    with pytest.raises(InputError, match="no closed-form inverse"):
        inverse_of_pose(Geometry((0.0,), (1.0,), (0.0,), (0.0,)), np.eye(4).ravel().tolist())


@pytest.mark.parametrize("bend", [1e-2, 1e-4, 1e-5, 1e-6, -1e-6])
@pytest.mark.parametrize("folded", [False, True])
def test_elbow_up_and_down_are_two_solutions_from_1e_6_rad_on(bend: float, folded: bool) -> None:
    """Both lead to the pose within 1e-9; the elbow's angle itself is only as sharp as the pose's rounding."""
    rng = np.random.default_rng(21)
    for name, geometry in NAMED.items():
        shape = Shape.of(geometry)
        if folded and shape.nearest < 0.01 * shape.farthest:
            continue  # folds onto its shoulder: r is then 0, and not flat about it
        angles = rng.uniform(-np.pi, np.pi, (50, 6))
        angles[:, 2] = shape.sign2 * (bend + folded * np.pi - shape.bend) - geometry.offset[2]
        poses = forward(geometry, angles)
        solutions = inverse(geometry, poses)
        assert worst_error(geometry, solutions.angles_rad, poses) < 1e-9, name
        for i, found in enumerate(solutions.angles_rad):
            near = turned(found[:, 2] - angles[i, 2]) < 2.5 * abs(bend)
            # With the shoulder on axis 1 the rear arm is as stretched as the front one.
            assert near.sum() == (4 if shape.shoulder else 8), name
            assert (solutions.outcome[i, near] == OK).all(), name
            assert not (solutions.singular[i, near] & ELBOW_STRETCHED).any()
            elbows = shape.sign2 * (found[near, 2] + geometry.offset[2]) + shape.bend - folded * np.pi
            apart = np.sort(np.remainder(elbows + np.pi, 2 * np.pi) - np.pi)
            np.testing.assert_allclose(np.abs(apart), abs(bend), atol=1e-8 + 3e-15 / abs(bend))
            assert (np.sign(apart) == np.repeat([-1, 1], near.sum() // 2)).all()


def test_a_stretched_elbow_is_one_solution_whatever_rounding_does() -> None:
    rng = np.random.default_rng(22)
    for geometry in NAMED.values():
        shape = Shape.of(geometry)
        angles = rng.uniform(-np.pi, np.pi, (200, 6))
        angles[:, 2] = -shape.sign2 * shape.bend - geometry.offset[2]
        outcome = inverse(geometry, forward(geometry, angles)).outcome
        assert ((outcome == DUPLICATE).sum(axis=1) == (2 if shape.shoulder else 4)).all()


def product(geometry: Geometry, angles: np.ndarray) -> np.ndarray:
    """The transform of each row written out, multiplied."""
    pose = np.eye(4)
    for d, a, alpha, offset, angle in zip(
        geometry.d, geometry.a, geometry.alpha, geometry.offset, angles, strict=True
    ):
        c, s, ca, sa = np.cos(angle + offset), np.sin(angle + offset), np.cos(alpha), np.sin(alpha)
        pose = pose @ [
            [c, -s * ca, s * sa, a * c],
            [s, c * ca, -c * sa, a * s],
            [0, sa, ca, d],
            [0, 0, 0, 1],
        ]
    return pose


def test_first_row_of_table_2_gives_every_printed_digit_of_eq_16() -> None:
    pose = forward(PAPER_FULL_SIZE, np.radians(TABLE_2[0]))
    np.testing.assert_allclose(pose, EQ_16, atol=5e-4)


@pytest.mark.parametrize("row", TABLE_2)
def test_each_row_of_table_2_gives_eq_16_within_the_rounding_of_its_angles(row: tuple[float, ...]) -> None:
    pose = forward(PAPER_FULL_SIZE, np.radians(row))
    # Printed to 0.05 degrees each; the reach is 460 cm.
    np.testing.assert_allclose(pose[:3, :3], EQ_16[:3, :3], atol=3 * np.radians(0.1))
    np.testing.assert_allclose(pose[:3, 3], EQ_16[:3, 3], atol=460 * 2 * np.radians(0.05))


@pytest.mark.parametrize("name", NAMED)
def test_forward_is_the_product_of_the_rows(name: str) -> None:
    rng = np.random.default_rng(1)
    for angles in rng.uniform(-np.pi, np.pi, (20, 6)):
        pose = product(NAMED[name], angles)
        np.testing.assert_allclose(forward(NAMED[name], angles), pose, atol=1e-14 * NAMED[name].reach + 1e-14)


def test_any_geometry_and_any_batch_shape() -> None:
    rng = np.random.default_rng(2)
    geometry = drawn(rng)
    angles = rng.uniform(-np.pi, np.pi, (2, 3, 6))
    poses = forward(geometry, angles)
    assert poses.shape == (2, 3, 4, 4)
    np.testing.assert_allclose(poses[1, 2], product(geometry, angles[1, 2]), atol=1e-14)
    assert forward(geometry, angles[:0]).shape == (0, 3, 4, 4)


def test_arms_with_another_number_of_joints() -> None:
    planar = Geometry((0.0, 0.0), (3.0, 4.0), (0.0, 0.0), (0.0, 0.0))
    np.testing.assert_allclose(forward(planar, [0.0, np.pi / 2])[:3, 3], [3, 4, 0], atol=1e-15)


def test_postures_are_the_origins_from_base_to_tool() -> None:
    angles = np.radians([0.0, -60.0, 40.0, 0.0, 0.0, 0.0])
    points = postures(PAPER, np.stack([angles, angles]))
    assert points.shape == (2, 7, 3)
    np.testing.assert_array_equal(points[0, 0], 0.0)
    np.testing.assert_allclose(points[0, 1], [-100.0, 0.0, 130.0], atol=1e-12)
    np.testing.assert_allclose(points[0, 6], forward(PAPER, angles)[:3, 3], atol=1e-12)
    lengths = np.linalg.norm(np.diff(points[0], axis=0), axis=1)
    np.testing.assert_allclose(lengths, [np.hypot(130, 100), 300, 120, 360, 0, 40], atol=1e-12)
