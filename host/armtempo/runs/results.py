"""The outcome for each joint in the last repetition of a run."""

from __future__ import annotations

from dataclasses import dataclass

from armtempo.runs.reader import RunData
from armtempo.splines.trajectory import Trajectory


@dataclass(frozen=True)
class JointResult:
    """How one joint ended."""

    name: str
    steps_sent: int
    """Step pulses from start to end, signed."""
    angle_deg: float
    """Where it ended: by its encoder, without one by the steps."""
    error_deg: float
    """That less where the trajectory ends."""


def results(run: RunData, trajectory: Trajectory) -> tuple[JointResult, ...]:
    """The joints of the last repetition; empty where run.json does not say how that ended."""
    last = run.entries[-1] if run.entries else None
    steps, counts = (last.commanded_steps, last.counts) if last else ((), ())
    start_deg, end_deg = trajectory(0.0), trajectory(trajectory.duration_s)
    found = []
    for joint, scale in enumerate(run.joints[: len(steps)]):
        angle_deg = steps[joint] / scale.steps_per_deg
        if scale.counts_per_deg:
            angle_deg = counts[joint] / scale.counts_per_deg
        sent = steps[joint] - round(start_deg[joint] * scale.steps_per_deg)
        found.append(JointResult(scale.name, sent, angle_deg, float(angle_deg - end_deg[joint])))
    return tuple(found)
