"""How well the arm followed each motion of a sequence, over all of its runs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.report.sequence_reader import SequenceRun

END_S = 1e-3
"""A sample as near as this to the end of the motion is its last."""


@dataclass(frozen=True, eq=False)
class LegResult:
    """A motion of the sequence: its runs that were heard of, checked against its plan."""

    number: int
    """From 1."""
    words: str
    """Of the first row that runs it."""
    duration_s: float
    runs: int
    whole: int
    """Runs of which every sample came, to the end of the motion."""
    command_off_steps: Array
    """(J,): largest difference of commanded from planned, in steps; half a step is rounding."""
    end_off_steps: Array
    """(J,): the same at the ends of the whole runs; NaN without one."""
    measured_off_deg: Array
    """(J,): largest difference of measured from planned; NaN for a joint without an encoder."""
    measured_rms_deg: Array
    """(J,): the root mean square of these differences."""


def results(found: SequenceRun) -> tuple[LegResult, ...]:
    """Each motion that ran, in the order of their numbers."""
    return tuple(_results(found))


def _results(found: SequenceRun) -> Iterator[LegResult]:
    motions = np.array([found.motion_of(row) if row >= 0 else 0 for row in found.row], dtype=np.int64)
    for number in range(1, len(found.legs) + 1):
        chosen = np.flatnonzero(motions == number)
        if chosen.size:
            yield _leg(found, number, chosen)


def _leg(found: SequenceRun, number: int, chosen: NDArray[np.int64]) -> LegResult:
    samples, leg = found.samples, found.legs[number - 1]
    planned = leg(np.minimum(samples.path_s[chosen], leg.duration_s))
    steps_per_deg = np.array([joint.steps_per_deg for joint in found.joints])
    command = np.abs(samples.commanded_deg[chosen] - planned) * steps_per_deg
    measured = np.abs(samples.angle_deg[chosen] - planned)
    runs = found.run[chosen]
    at_end = samples.path_s[chosen] >= leg.duration_s - END_S
    whole = [
        run for run in np.unique(runs) if _is_whole(samples.index[chosen][runs == run], at_end[runs == run])
    ]
    ends = at_end & np.isin(runs, whole)
    nothing = np.full(len(found.joints), np.nan)
    return LegResult(
        number,
        str(found.meta["rows"][int(found.row[chosen[0]])]["words"]),
        leg.duration_s,
        len(np.unique(runs)),
        len(whole),
        command.max(axis=0),
        command[ends].max(axis=0) if ends.any() else nothing,
        measured.max(axis=0),
        np.sqrt(np.mean(measured**2, axis=0)),
    )


def _is_whole(index: NDArray[np.int64], at_end: NDArray[np.bool_]) -> bool:
    return bool(np.array_equal(index, np.arange(len(index))) and at_end.any())
