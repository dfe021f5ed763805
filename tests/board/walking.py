"""Walks motion records on an interpreter and holds the steps against the oracle."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from armtempo_shared import limits
from armtempo_shared.motion import Motion
from numpy.typing import NDArray

from tests import interpreters, ramps
from tests.board import oracle

SCRIPT = Path(__file__).parent / "scripts" / "probes" / "walk.py"
PULSE_TICKS = 168
GAP_TICKS = 20_000
BRAKE_SHAPE = 31
"""Half of the time until it brakes most."""


@dataclass(frozen=True)
class Steps:
    """What a generator wrote for one joint: rising edges in ticks and directions."""

    ticks: NDArray[np.int64]
    direction: NDArray[np.int64]


def walk(
    interpreter: str, folder: Path, records: list[bytes], room: int = 2, brake: tuple[int, int] = (0, 0)
) -> tuple[list[str], list[bytes]]:
    """What the board's check says of each record (a line each), and the bytes of the steps."""
    paths = [folder / f"{number}.atm" for number in range(len(records))]
    for path, record in zip(paths, records, strict=True):
        path.write_bytes(record)
    words = [str(word) for word in (PULSE_TICKS, GAP_TICKS, room, *brake, BRAKE_SHAPE, *paths)]
    verdicts = interpreters.run(interpreter, SCRIPT, *words).splitlines()
    return verdicts, [Path(f"{path}.steps").read_bytes() for path in paths]


def steps_of(data: bytes, joint: int) -> Steps:
    """One joint's steps from a file written with room 2."""
    rows = np.frombuffer(data, dtype="<i4").reshape(-1, 5)
    rows = rows[rows[:, 0] == joint].astype(np.int64)
    near, rise, fall = rows[:, 2] << 10, rows[:, 3], rows[:, 4]
    assert np.all((fall - rise) & 0xFFFFFFFF == PULSE_TICKS)
    ticks = near + ((rise - near + (1 << 31)) & 0xFFFFFFFF) - (1 << 31)
    assert np.all((ticks - near >= -2048) & (ticks - near < 1 << 24))
    return Steps(ticks, rows[:, 1])


def verify(record: bytes, data: bytes) -> float:
    """Hold every joint's steps against the exact spline; the largest error above 50 steps/s, in ticks."""
    motion = Motion(record)
    return max([_verify_joint(motion, joint, steps_of(data, joint)) for joint in range(motion.joints)])


def _verify_joint(motion: Motion, joint: int, steps: Steps) -> float:
    exact = oracle.without_grazes(oracle.crossings(motion, joint), GAP_TICKS)
    np.testing.assert_array_equal(steps.direction, exact.direction)
    error = np.abs(steps.ticks - exact.ticks)
    fast = exact.speed > 50
    worst = float(np.max(error[fast], initial=0.0))
    assert worst <= 2.0
    turns = np.diff(steps.direction) != 0
    assert np.all(np.diff(steps.ticks)[turns] >= GAP_TICKS)
    assert np.all(np.diff(steps.ticks)[~turns] > 2 * PULSE_TICKS * 0.7)
    assert position_error(motion, joint, steps) <= 0.52
    return worst


def position_error(motion: Motion, joint: int, steps: Steps) -> float:
    """Largest distance of the commanded position from the spline: at every edge, turn and segment end."""
    start = oracle.start_steps(motion, joint)
    commanded = start + np.concatenate([[0], np.cumsum(steps.direction)])
    worst = 0.0
    for piece in oracle.pieces(motion, joint):
        place = np.concatenate([oracle.turns(piece), oracle.place_of(piece, steps.ticks)])
        angle = piece.first_steps + np.polynomial.polynomial.polyval(place, piece.angle)
        ticks = piece.first_ticks + np.polynomial.polynomial.polyval(place, piece.time)
        for side in (-1e-3, 1e-3):  # just before and just after
            at = commanded[np.searchsorted(steps.ticks, np.rint(1000 * ticks) / 1000 + side)]
            worst = max(worst, float(np.max(np.abs(angle - at), initial=0.0)))
    return worst


def peak_rate(record: bytes) -> float:
    """Highest speed at any step, steps/s."""
    motion = Motion(record)
    speeds = [oracle.crossings(motion, joint).speed for joint in range(motion.joints)]
    return max(float(np.max(speed, initial=0.0)) for speed in speeds)


def braked(ticks: NDArray[np.float64], start: int, length: int) -> NDArray[np.float64]:
    """Motion time at a real time while braking (the law in ``armtempo_board/stepgen/time_law.py``)."""
    x = np.clip((ticks - start) / length, 0.0, 1.0)
    return np.where(ticks < start, ticks, start + length * ramps.passed(x, 1.0, 0.0, BRAKE_SHAPE))


TICK_HZ = limits.TICK_HZ
