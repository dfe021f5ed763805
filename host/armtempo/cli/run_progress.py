"""Display of a run: a progress bar with angles and errors."""

from __future__ import annotations

import time
from types import TracebackType
from typing import Self

import numpy as np
from armtempo_shared.limits import TICK_HZ

from armtempo.basics.arrays import Array
from armtempo.cli import results
from armtempo.cli.results import ProgressBar
from armtempo.encoding.encoded_plan import Encoded
from armtempo.link.board_messages import Sample
from armtempo.report.run_folder import Repetition, RunFolder
from armtempo.robot.recording import Watcher


class RunProgress(Watcher):
    """Shows a run on the terminal; a context."""

    def __init__(self, where: str = "", aside: bool = False) -> None:
        """``where``: text about a virtual board; ``aside``: print to stderr."""
        self._say = results.remark if aside else results.echo
        self._where = f", on {where}" if where else ""
        self._progress = ProgressBar("moving")
        self._before = (0, 0)
        """Ticks of the last sample, and of the motion's own time."""

    def begin(self, motion: Encoded, folder: RunFolder) -> None:
        """Print the motion and its run folder."""
        self._motion = motion  # sequences are shown by their states
        self._started_s = time.monotonic()
        self._say(
            f"{motion.name}: {self._motion.trajectory.duration_s:.3f} s, into {folder.path}{self._where}"
        )

    def on_sample(self, sample: Sample, duration_s: float) -> None:
        """Show one sample."""
        time_s = sample.path_ticks / TICK_HZ  # the motion's own time
        angles = self._angles_deg(sample)
        errors = angles - self._motion.trajectory(time_s)
        signs = (joint.unit.sign for joint in self._motion.arm.driven)
        pairs = (
            f"{angle:.1f}{sign} ({error:+.2f})"
            for angle, error, sign in zip(angles, errors, signs, strict=True)
        )
        elapsed = time.monotonic() - self._started_s
        self._progress(time_s, duration_s, f"{elapsed:.0f} s{self._speed(sample)}  {'  '.join(pairs)}")

    def _speed(self, sample: Sample) -> str:
        """The speed since the previous sample, if it is not the planned one."""
        (before, path_before), self._before = self._before, (sample.ticks, sample.path_ticks)
        if sample.ticks <= before:
            return ""
        percent = round(100 * (sample.path_ticks - path_before) / (sample.ticks - before))
        return "" if percent in (99, 100, 101) else f", at {percent} %" if percent > 0 else ", paused"

    def end(self, repetition: Repetition) -> None:
        """Print how the repetition ended."""
        self._say(repetition_line(repetition))

    def _angles_deg(self, sample: Sample) -> Array:
        """Measured angles, degrees (J,); commanded angles of joints without an encoder."""
        gears, positions = self._motion.arm.transmission, sample.positions
        measured = gears.angles_of_counts(positions.counts)
        return np.where(gears.measured, measured, gears.angles_of_steps(positions.commanded_steps))

    def __enter__(self) -> Self:
        self._progress.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._progress.__exit__(kind, value, trace)


def repetition_line(done: Repetition) -> str:
    """One line about a repetition: how it ended, its duration, missing samples."""
    lost = sum(gap.number for gap in done.lost)
    missing = f", {lost} lost" if lost else ""
    state = f"{done.state} ({done.fault})" if done.fault else done.state
    return f"{done.file}: {state}, {done.duration_s:.3f} s, {done.samples} samples{missing}"
