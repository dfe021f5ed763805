"""Kinematics of any arm of revolute joints: forward; inverse by the closed form or numerically. Radians inside."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from armtempo.kinematics.forward import all_frames, forward, postures
from armtempo.kinematics.geometry import Geometry
from armtempo.kinematics.inverse import inverse, inverse_of_pose
from armtempo.kinematics.shape import refusals
from armtempo.kinematics.solutions import BRANCHES, Branch, PoseSolutions, Solutions, branch_of

if TYPE_CHECKING:
    from armtempo.kinematics.choice import Candidate, Choice, choose
    from armtempo.kinematics.ranges import Ranges
    from armtempo.kinematics.solver import Answer, Nearest, PoseSolver

__all__ = [
    "BRANCHES",
    "Answer",
    "Branch",
    "Candidate",
    "Choice",
    "Geometry",
    "Nearest",
    "PoseSolutions",
    "PoseSolver",
    "Ranges",
    "Solutions",
    "all_frames",
    "branch_of",
    "choose",
    "forward",
    "inverse",
    "inverse_of_pose",
    "postures",
    "refusals",
]
_HOMES = {
    "choice": ("Candidate", "Choice", "choose"),
    "ranges": ("Ranges",),
    "solver": ("Answer", "Nearest", "PoseSolver"),
}
"""Modules that most commands do without."""
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    """A name of _HOMES, imported at its first use (PEP 562)."""
    from importlib import import_module

    if name not in _HOME_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(f"{__name__}.{_HOME_OF[name]}"), name)
    return value
