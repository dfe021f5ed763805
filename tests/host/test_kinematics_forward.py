"""Forward kinematics against the paper's pose and against plain products of matrices."""

from __future__ import annotations

import numpy as np
import pytest
from armtempo.kinematics import Geometry, forward, postures

from tests.host.published_arms import EQ_16, NAMED, PAPER, PAPER_FULL_SIZE, TABLE_2, drawn


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
