"""The job: what to plan and how, as read from its TOML file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Pose:
    """A tool pose to pass: 4 x 4 homogeneous matrix rows, lengths in mm."""

    matrix: tuple[tuple[float, ...], ...]
    posture_deg: tuple[float, ...] | None = None
    """Which solution to prefer; None: nearest to the one before."""


@dataclass(frozen=True)
class Job:
    """A motion to plan: through ``via`` in order, from rest to rest."""

    name: str
    via: tuple[tuple[float, ...] | Pose, ...]
    """Each entry: the driven joints' angles in degrees, or a pose."""
    degree: int = 5
    timing: str = "per-joint"
    """``"per-joint"`` (the paper) or ``"shared"``."""
    refine: int = 1
    """Segments of the time axis per segment of the path."""
    optimiser: str = "acs"
    population: int = 10
    iterations: int = 500
    parameters: Mapping[str, float | str | bool] = field(default_factory=dict)
    """Further parameters of the optimiser, by its own names."""
    seed: int = 1
    bounds_s: tuple[float, float] = (0.1, 3.0)
    """Range of a time interval in the search (the paper: 0.1 to 3)."""
    polish: bool = False
    source: str = ""
