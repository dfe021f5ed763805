"""The point of a tool from four postures in which it touches the same tip, each time turned another way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError

POINTS = ("the first posture", "the second posture", "the third posture", "the fourth posture")
LEAST_SPREAD = 0.4
"""Smallest singular value of the turns: a tip that is missed by 1 mm in each posture is then found within 5 mm."""
MOST_APART_MM = 5.0
"""Postures whose tips are farther from their middle do not touch the same one."""
_PLACES_MM = 3


@dataclass(frozen=True, eq=False)
class Tip:
    """The point of a tool, and what the postures say of it."""

    position_mm: Array
    """In the frame after the last row, (3,)."""
    apart_mm: float
    """Largest distance of the point in a posture from the middle of all: the residual."""
    error_mm: float
    """By how much half a step of each joint may move it."""


def _spread(flanges: Array) -> float:
    """The spread of the turns of the frame after the last row, (N, 4, 4); InputError for one that is too small."""
    turns = flanges[:, :3, :3] - flanges[:, :3, :3].mean(axis=0)
    spread = float(np.linalg.svd(turns.reshape(-1, 3), compute_uv=False)[-1])
    if spread < LEAST_SPREAD:
        raise InputError(
            f"the postures turn the tool too little to find its point (spread {spread:.2g}, {LEAST_SPREAD:g} needed)",
            "tilt it by 30 degrees or more to different sides, and turn it about its own axis",
        )
    return spread


def of_postures(flanges: Array, step_error_mm: float) -> Tip:
    """The tool's point by least squares from four poses of the frame after the last row, (4, 4, 4).

    ``step_error_mm``: by how much half a step of each joint moves the tool. Raises InputError for turns that are too
    small, and for postures that do not meet in one point.
    """
    spread = _spread(flanges)
    turns, places = flanges[:, :3, :3], flanges[:, :3, 3]
    middle = places.mean(axis=0)
    rows = (turns - turns.mean(axis=0)).reshape(-1, 3)
    found = np.linalg.lstsq(rows, (middle - places).ravel(), rcond=None)[0]
    tips = turns @ found + places
    apart_mm = float(np.linalg.norm(tips - tips.mean(axis=0), axis=1).max())
    if apart_mm > max(MOST_APART_MM, 10.0 * step_error_mm):
        raise InputError(
            f"the postures do not meet in one point: it is up to {apart_mm:.3g} mm from their middle",
            "touch the same tip in all of them; check the arm's home posture and its table",
        )
    return Tip(found, apart_mm, step_error_mm * np.sqrt(len(flanges)) / spread)


def values(before: Mapping[str, Any], rpy_deg: tuple[float, ...], position_mm: Array) -> Mapping[str, Any]:
    """The keys of [tool.NAME] with this position; the others as in ``before``, a matrix as its ``rpy_deg``."""
    kept = {key: value for key, value in before.items() if key not in ("matrix", "position_mm")}
    if "matrix" in before:
        kept["rpy_deg"] = [round(angle, 4) + 0.0 for angle in rpy_deg]
    return {"position_mm": [round(float(value), _PLACES_MM) + 0.0 for value in position_mm], **kept}
