"""What a run under way shows: a progress bar with angles and errors, and a window where one is wanted."""

from __future__ import annotations

import time
from types import TracebackType
from typing import TYPE_CHECKING, Self

import click

from armtempo.cli.progress import Progress
from armtempo.errors import ArmtempoError

if TYPE_CHECKING:
    from armtempo.link.messages import Sample
    from armtempo.pipeline import Motion
    from armtempo.report.live_plot import LivePlot
    from armtempo.splines.bspline import Array


class Live:
    """A watcher of samples; used as a context. Without a display it says so and goes on without a window."""

    def __init__(self, motion: Motion, window: bool) -> None:
        from armtempo.runs import run_folder

        self._motion = motion
        self._scales = run_folder.scales(motion.arm)
        self._progress = Progress("moving")
        self._started_s = time.monotonic()
        self._plot = self._window() if window else None

    def _window(self) -> LivePlot | None:
        from armtempo.report.live_plot import LivePlot

        try:
            return LivePlot(self._motion.trajectory, [scale.name for scale in self._scales])
        except ArmtempoError as error:
            click.echo(f"no live plot: {error}", err=True)
            return None

    def __call__(self, sample: Sample, duration_s: float) -> None:
        """Show one sample."""
        from armtempo_shared.limits import TICK_HZ

        time_s = sample.ticks / TICK_HZ
        angles = self._angles_deg(sample)
        errors = angles - self._motion.trajectory(time_s)
        pairs = (f"{angle:.1f}° ({error:+.2f})" for angle, error in zip(angles, errors, strict=True))
        elapsed = time.monotonic() - self._started_s
        self._progress(time_s, duration_s, f"{elapsed:.0f} s  {'  '.join(pairs)}")
        if self._plot is not None:
            self._plot.add(time_s, angles)

    def _angles_deg(self, sample: Sample) -> Array:
        """Measured angles (J,); commanded ones where there is no encoder."""
        import numpy as np

        stand = sample.stand
        return np.array(
            [
                counts / scale.counts_per_deg if scale.counts_per_deg else steps / scale.steps_per_deg
                for scale, steps, counts in zip(
                    self._scales, stand.commanded_steps, stand.counts, strict=True
                )
            ]
        )

    def __enter__(self) -> Self:
        self._progress.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._progress.__exit__(kind, value, trace)
        if self._plot is not None:
            self._plot.close()
