"""Kinematics: forward, all eight inverse solutions, regions, rejection, choice. Radians inside."""

from __future__ import annotations

from armtempo.kinematics.branches import BRANCHES, Branch, branch_of
from armtempo.kinematics.choice import Candidate, Choice, choose
from armtempo.kinematics.forward import forward, postures
from armtempo.kinematics.geometry import Geometry
from armtempo.kinematics.inverse import inverse, inverse_of_pose
from armtempo.kinematics.ranges import Ranges
from armtempo.kinematics.shape import refusals
from armtempo.kinematics.solutions import PoseSolutions, Solutions

__all__ = [
    "BRANCHES",
    "Branch",
    "Candidate",
    "Choice",
    "Geometry",
    "PoseSolutions",
    "Ranges",
    "Solutions",
    "branch_of",
    "choose",
    "forward",
    "inverse",
    "inverse_of_pose",
    "postures",
    "refusals",
]
