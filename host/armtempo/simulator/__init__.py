"""The virtual board: the board program on simulated hardware, in a process with a serial port of its own."""

from __future__ import annotations

from armtempo.simulator.launcher import VirtualBoard, launch
from armtempo.simulator.options import Fault

__all__ = ["Fault", "VirtualBoard", "launch"]
