"""Poses of the paper's arm by its wrist centre, and how well postures reach poses."""

from __future__ import annotations

import numpy as np
from armtempo.kinematics import Geometry, forward
from armtempo.kinematics.shape import Shape

from tests.host.published_arms import PAPER

SHAPE = Shape.of(PAPER)


def worst_error(geometry: Geometry, angles: np.ndarray, poses: np.ndarray) -> float:
    """Largest element of forward(angles) - pose, lengths relative to the reach; NaN postures left out."""
    difference = np.abs(forward(geometry, angles) - poses[:, None])
    difference[..., :3, 3] /= geometry.reach
    return float(np.nanmax(difference))


def turned(difference: np.ndarray) -> np.ndarray:
    """Size of an angle, whole turns taken off."""
    return np.abs(np.remainder(difference + np.pi, 2 * np.pi) - np.pi)


def with_wrist_at(planar: float, up: float, turn: float = 0.0) -> np.ndarray:
    """A pose of the paper's arm with its wrist centre there and the tool pointing up."""
    pose = np.eye(4)
    pose[:3, 3] = planar * np.cos(turn), planar * np.sin(turn), SHAPE.height + up + 40.0
    return pose
