"""How far the steps are off the exact spline, on named motions and on many by chance.

    python -m tests.benchmark.step_errors [--motions 1500] [--seed 1] [--interpreter micropython]

"ticks" is the largest error of a rising edge where the joint moves faster than 50 steps/s; "steps" the largest
distance of the commanded position from the spline at any time.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
from armtempo_shared.motion import Motion

from tests.board import motions, walking

_BATCH = 50


def main() -> None:
    """Print a line for each named motion and one for those by chance."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--motions", type=int, default=1500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--interpreter", default="micropython")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for case, make in motions.NAMED.items():
            _report(case, _errors(options.interpreter, folder, [make()]))
        rng = np.random.default_rng(options.seed)
        found = []
        for _ in range(options.motions // _BATCH):
            records = [motions.chance(rng) for _ in range(_BATCH)]
            fit = [record for record in records if walking.peak_rate(record) < 330_000]
            found += _errors(options.interpreter, folder, fit)
        _report(f"{len(found)} by chance", found)


def _errors(interpreter: str, folder: Path, records: list[bytes]) -> list[tuple[int, float, float]]:
    """(steps, ticks, position) of the records that the board does not refuse; AssertionError beyond the bounds."""
    verdicts, steps = walking.walk(interpreter, folder, records)
    found = []
    for record, verdict, data in zip(records, verdicts, steps, strict=True):
        if verdict == "None":
            motion = Motion(record)
            joints = [walking.steps_of(data, joint) for joint in range(motion.joints)]
            off = [walking.position_error(motion, joint, one) for joint, one in enumerate(joints)]
            found.append((sum(len(one.ticks) for one in joints), walking.verify(record, data), max(off)))
    return found


def _report(case: str, found: list[tuple[int, float, float]]) -> None:
    steps, ticks, off = zip(*found, strict=True)
    print(f"{case:<24} {sum(steps):8d} steps  {max(ticks):5.2f} ticks  {max(off):.4f} steps", flush=True)


if __name__ == "__main__":
    main()
