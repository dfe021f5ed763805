"""Kinematics: forward, all eight inverse solutions, regions, rejection, choice. Radians inside."""

from __future__ import annotations

from armtempo.kinematics.forward import forward, postures
from armtempo.kinematics.geometry import Geometry

__all__ = ["Geometry", "forward", "postures"]
