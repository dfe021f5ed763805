"""Arms of the paper's class for the tests: the paper's, published ones, and ones drawn at random."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
from armtempo.kinematics import Geometry, Ranges, forward
from armtempo.kinematics.shape import Shape
from armtempo.model.arm import Arm

FILE = Path(__file__).parents[1] / "data" / "arms.toml"
PAPER = Geometry.of(Arm.paper())
PAPER_FULL_SIZE = Geometry(
    tuple(5 * length / 10 for length in PAPER.d),
    tuple(5 * length / 10 for length in PAPER.a),
    PAPER.alpha,
    PAPER.offset,
)
"""Table 1: five times the experimental arm, in cm."""


def _read(arm: dict[str, Any]) -> tuple[Geometry, Ranges]:
    assert arm["source"]
    low, high = np.radians(arm["range_deg"]).T
    geometry = Geometry(
        tuple(arm["d"]),
        tuple(arm["a"]),
        tuple(np.radians(arm["alpha_deg"])),
        tuple(np.radians(arm["offset_deg"])),
    )
    return geometry, Ranges(low, high)


def drawn(rng: np.random.Generator) -> Geometry:
    """Any arm of the class: signs, lengths, shoulder offsets, offsets of the joints, a tool on row 6."""
    signs = rng.choice([-1.0, 1.0], 4)
    alpha = [signs[0] * 90, rng.choice([0.0, 180.0, -180.0]), *(signs[1:] * 90), rng.uniform(-180, 180)]
    d = [*rng.uniform(-1, 1, 4), 0.0, rng.uniform(-1, 1)]
    a = [*rng.uniform(-1, 1, 3), 0.0, 0.0, rng.uniform(-1, 1)]
    return Geometry(tuple(d), tuple(a), tuple(np.radians(alpha)), tuple(rng.uniform(-np.pi, np.pi, 6)))


PUBLISHED = {name: _read(arm) for name, arm in tomllib.loads(FILE.read_text()).items()}
NAMED = {"paper": PAPER, **{name: geometry for name, (geometry, _) in PUBLISHED.items()}}
EQ_16 = np.array([[0, 0, -1, -268.202], [0, 1, 0, 0], [1, 0, 0, 217.349], [0, 0, 0, 1]])
TABLE_2 = (
    (180.0, -38.0, -52.0, 0.0, 0.0, 0.0),
    (180.0, -38.0, -52.0, 180.0, 0.0, 180.0),
    (180.0, -16.1, -91.1, 0.0, 17.3, 0.0),
    (180.0, -16.1, -91.1, 180.0, -17.3, 180.0),  # printed with theta6 = 0, a misprint
    (0.0, -93.2, -157.5, 0.0, -19.2, 180.0),
    (0.0, -93.2, -157.5, 180.0, 19.2, 0.0),
    (0.0, 168.3, 14.4, 0.0, 267.3, 180.0),
    (0.0, 168.3, 14.4, 180.0, 92.8, 0.0),
)


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
