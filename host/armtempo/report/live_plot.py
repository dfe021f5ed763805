"""A window that plots the measured angles during a run, over the planned ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import ArmtempoError, MissingPackageError
from armtempo.report.plots import COLOURS
from armtempo.splines.trajectory import Trajectory

_WITHOUT_WINDOW = ("agg", "cairo", "pdf", "pgf", "ps", "svg", "template")


class LivePlot:
    """A window with one plot for each joint.

    Raises MissingPackageError without matplotlib, ArmtempoError without a display.
    """

    def __init__(self, trajectory: Trajectory, names: Sequence[str]) -> None:
        try:
            import matplotlib.pyplot as plt
        except ImportError:
            raise MissingPackageError("a live plot", "matplotlib", "plot") from None
        if plt.get_backend().lower() in _WITHOUT_WINDOW:
            raise ArmtempoError(
                "there is no display to open a window on",
                "leave --live out, or connect a display",
            )
        self._plt: Any = plt
        self._figure, axes = plt.subplots(len(names), 1, squeeze=False, sharex=True, layout="constrained")
        times = np.linspace(0.0, trajectory.duration_s, 300)
        planned = trajectory(times)
        self._lines = []
        self._times: list[float] = []
        self._angles: list[Array] = []
        for joint, (axis, name) in enumerate(zip(axes[:, 0], names, strict=True)):
            axis.plot(times, planned[:, joint], ":", color="gray")
            self._lines += axis.plot([], [], color=COLOURS[joint % len(COLOURS)])
            axis.set_ylabel(f"{name} (°)", parse_math=False)
        axes[-1][0].set_xlabel("time (s)")
        self._figure.show()

    def add(self, time_s: float, angles_deg: Array) -> None:
        """Draw a sample, angles (J,); if its time is before the last one, it begins a new repetition."""
        if self._times and time_s < self._times[-1]:
            self._times, self._angles = [], []
        self._times.append(time_s)
        self._angles.append(angles_deg)
        for joint, line in enumerate(self._lines):
            line.set_data(self._times, [angles[joint] for angles in self._angles])
        self._figure.canvas.draw_idle()
        self._figure.canvas.flush_events()

    def close(self) -> None:
        self._plt.close(self._figure)
