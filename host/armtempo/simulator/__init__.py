"""The virtual board: the board program on simulated hardware, in its own process with its own serial port."""

from __future__ import annotations

from armtempo.simulator.launch_options import InjectedFault, LaunchOptions
from armtempo.simulator.launcher import VirtualBoard, launch

__all__ = ["InjectedFault", "LaunchOptions", "VirtualBoard", "launch"]
