"""Kinematics of any arm of revolute joints: forward; inverse by the closed form or numerically. Radians inside."""

from __future__ import annotations

from armtempo.kinematics.choice import Candidate, Choice, choose
from armtempo.kinematics.forward import all_frames, forward, postures
from armtempo.kinematics.geometry import Geometry
from armtempo.kinematics.inverse import inverse, inverse_of_pose
from armtempo.kinematics.ranges import Ranges
from armtempo.kinematics.shape import refusals
from armtempo.kinematics.solutions import BRANCHES, Branch, PoseSolutions, Solutions, branch_of
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
