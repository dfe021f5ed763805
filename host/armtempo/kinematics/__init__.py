"""Kinematics: forward, all eight inverse solutions, regions, rejection, choice. Radians inside."""

from __future__ import annotations

from armtempo.kinematics.branches import BRANCHES, Branch, branch_of
from armtempo.kinematics.choice import Candidate, Choice, choose
from armtempo.kinematics.forward import forward, postures
from armtempo.kinematics.geometry import Geometry
from armtempo.kinematics.inverse import Solutions, inverse
from armtempo.kinematics.ranges import Ranges
from armtempo.kinematics.shape import refusals

__all__ = [
    "BRANCHES",
    "Branch",
    "Candidate",
    "Choice",
    "Geometry",
    "Ranges",
    "Solutions",
    "branch_of",
    "choose",
    "forward",
    "inverse",
    "postures",
    "refusals",
]
