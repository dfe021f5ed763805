"""Erasures of the flash's sectors by what is stored and by what moves: host/docs/measurements.md.

    python -m tests.benchmark.flash_wear

A virtual board, whose file system is that of MicroPython to the block (tests/system/test_flash_wear.py).
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from armtempo.encoding import encoded_plan
from armtempo.model.arm import Arm
from armtempo.planning import point_to_point
from armtempo.robot.connect import connect
from armtempo.robot.store import store
from armtempo.simulator import LaunchOptions, launch
from armtempo_shared import motion

SECTORS = ("1", "2", "3", "4")
SECTOR_S = (0.316, 0.316, 0.316, 0.812)
"""To erase and to program one, typical times of DS8626."""


class Wear:
    """Erasures of a virtual board whose flash is ``folder``, since the last look."""

    def __init__(self, folder: Path) -> None:
        self._file = folder.with_name(folder.name + ".erasures")
        self._before = dict.fromkeys(SECTORS, 0)

    def since(self) -> tuple[int, ...]:
        """Of sectors 1 to 4."""
        now = self._before | (json.loads(self._file.read_text()) if self._file.exists() else {})
        made = tuple(now[sector] - self._before[sector] for sector in SECTORS)
        self._before = now
        return made


def motion_of(arm: Arm, segments: int, scale: float) -> bytes:
    """A record of so many segments for an arm; it could not be run."""
    angles = [[int(scale * 1000) * point for point in range(segments + 5)] for _ in arm.driven]
    times = [[1000 * point for point in range(segments + 5)]]
    record = point_to_point.straight("arm", arm.home_deg, arm.home_deg, arm)
    crc = motion.Motion(encoded_plan.of_trajectory(record, arm).data).arm_crc
    return motion.pack(5, angles, times, 1, motion.no_ramps(), crc)


def show(what: str, wear: Wear, action: Callable[[], object]) -> None:
    """Do it and print a row."""
    action()
    made = wear.since()
    stands_s = sum(count * time_s for count, time_s in zip(made, SECTOR_S, strict=True))
    print(f"| {what} | {' | '.join(map(str, made))} | {stands_s:.1f} |", flush=True)


def main() -> None:
    """Print the table."""
    print("| what | sector 1 | 2 | 3 | 4 | the chip stands still, s |\n|---|---|---|---|---|---|")
    arm = Arm.paper()
    slower = replace(arm, safety=replace(arm.safety, link_timeout_ms=arm.safety.link_timeout_ms + 1))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "flash"
        wear = Wear(folder)
        with launch(LaunchOptions(folder)) as process, connect(process.port) as board:
            client = board.client
            wear.since()
            show("arm, new", wear, lambda: board.configure(arm))
            show("arm, changed", wear, lambda: board.configure(slower, replace=True))
            show("arm, the same", wear, lambda: board.configure(slower, replace=True))
            for segments in (7, 60, 500):
                data = motion_of(arm, segments, 1.0), motion_of(arm, segments, 2.0)
                size = f"motion of {len(data[0])} bytes"
                show(f"{size}, new", wear, lambda data=data: store(client, [("feed", data[0])]))
                show(f"{size}, other content", wear, lambda data=data: client.upload("feed", data[1]))
                show(f"{size}, the same", wear, lambda data=data: store(client, [("feed", data[1])]))
                show("default, new", wear, lambda: client.set_default("feed"))
                show("default, the same", wear, lambda: client.set_default("feed"))
                show("renamed default", wear, lambda: client.rename("feed", "food"))
                show("removed", wear, lambda: client.remove("food"))
            board.home(slower)
            wear.since()
            show("jog", wear, lambda: board.jog(arm.driven[0].name, by_deg=1.0))
            show("goto", wear, lambda: board.goto(np.array(arm.home_deg)))


if __name__ == "__main__":
    main()
