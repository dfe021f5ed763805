"""The virtual board: the board program on simulated hardware, in a process with a serial port of its own."""

from __future__ import annotations

from armtempo.simulator.launch_options import InjectedFault, LaunchOptions
from armtempo.simulator.launcher import VirtualBoard, launch

__all__ = ["InjectedFault", "LaunchOptions", "VirtualBoard", "launch"]
