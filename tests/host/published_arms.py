"""Arms of the paper's class for the tests: the paper's, published ones, and ones drawn at random."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
from armtempo.kinematics import Geometry, Ranges
from armtempo.model.arm import Arm

FOLDER = Path(__file__).parents[1] / "data" / "arms"
FILES = sorted(FOLDER.glob("*.toml"))
PAPER = Geometry.of(Arm.paper())
PAPER_FULL_SIZE = Geometry(
    tuple(5 * length / 10 for length in PAPER.d),
    tuple(5 * length / 10 for length in PAPER.a),
    PAPER.alpha,
    PAPER.offset,
)
"""Table 1: five times the experimental arm, in cm."""


def read(path: Path) -> tuple[Geometry, Ranges]:
    """A published arm."""
    arm = tomllib.loads(path.read_text())
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


NAMED = {"paper": PAPER, **{path.stem: read(path)[0] for path in FILES}}
