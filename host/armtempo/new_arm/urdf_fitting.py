"""The simplest rows equivalent to the URDF: derived, rounded, checked against its forward kinematics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import PlanError
from armtempo.kinematics import forward
from armtempo.new_arm import urdf_rows as dh
from armtempo.new_arm.urdf_chain import Chain

POSTURES = 1000
SEED = 1
POSITION_MM, ROTATION_DEG = 0.01, 0.005
"""Largest errors of an accepted table."""

_NEAR = (
    dh.Near(1e-3, 1e-1),
    dh.Near(1e-4, 1e-2),
    dh.Near(1e-5, 1e-3),
    dh.Near(1e-7, 1e-5),
    dh.Near(1e-10, 1e-8),
)
_DECIMALS = (2, 3, 4, 6, 9, 12)


@dataclass(frozen=True)
class Fit:
    """Rows, and their worst errors."""

    rows: tuple[dh.DhRow, ...]
    position_mm: float
    rotation_deg: float
    postures: int


def fit(chain: Chain) -> Fit:
    """The table with the roundest numbers within 0.01 mm and 0.005 degrees at 1000 random postures.

    URDF files have angles in rad with few digits (1.5708), so axes that should be parallel intersect
    kilometres away. Nearly parallel axes are first taken as parallel, and the comparison tests that. Raises
    PlanError if no table is accurate enough.
    """
    angles = _postures(chain)
    wanted = chain.poses(angles)
    axes = [dh.AxisLine(joint.point_mm, joint.direction) for joint in chain.joints]
    best: Fit | None = None
    for near in _NEAR:
        table = dh.derive(axes, chain.zero_pose, near)
        for decimals in _DECIMALS:
            found = _held_against(wanted, angles, dh.rounded(table, decimals), chain)
            if found.position_mm <= POSITION_MM and found.rotation_deg <= ROTATION_DEG:
                return found
            if best is None or found.position_mm < best.position_mm:
                best = found
    assert best is not None  # there is at least one way to round
    raise PlanError(
        f"no Denavit-Hartenberg table of {chain.robot!r} keeps to its URDF: the best one is off by "
        f"{best.position_mm:.3g} mm and {best.rotation_deg:.3g} deg at worst, which is an error; nothing was "
        "written",
        "choose another chain, or write the rows by hand",
    )


def _postures(chain: Chain) -> Array:
    """Random postures within the ranges, (1000, joints) in rad."""
    low, high = np.radians([joint.range_deg for joint in chain.joints]).T
    return np.random.default_rng(SEED).uniform(low, high, (POSTURES, len(low)))


def _held_against(wanted: Array, angles: Array, table: list[dh.DhRow], chain: Chain) -> Fit:
    """Worst errors of a table; ``wanted`` (K, 4, 4) belong to ``angles`` (K, joints)."""
    moved = np.zeros((len(angles), len(table)))
    moved[:, [column for column, row in enumerate(table) if row.joint is not None]] = angles
    found = forward(dh.geometry(table, chain.linked, chain.sliding), moved)
    away = np.linalg.norm(found[:, :3, 3] - wanted[:, :3, 3], axis=1)
    chord = np.linalg.norm(found[:, :3, :3] - wanted[:, :3, :3], axis=(1, 2))  # 2 sqrt(2) sin(angle / 2)
    turned = np.degrees(2.0 * np.arcsin(np.minimum(chord / np.sqrt(8.0), 1.0)))
    return Fit(tuple(table), float(np.max(away)), float(np.max(turned)), len(angles))
