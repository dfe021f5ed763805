"""Recording runs: the run folder, its repetitions, and the samples of a run without a host."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from armtempo_shared.limits import TICK_HZ

from armtempo.basics.errors import LinkError
from armtempo.basics.progress import Progress
from armtempo.encoding import encoded_motion
from armtempo.encoding.encoded_motion import EncodedMotion
from armtempo.link import Client
from armtempo.link.board_messages import Sample
from armtempo.link.follow import Follower, RunEnd
from armtempo.model import arm_json
from armtempo.model.arm import Arm
from armtempo.report import run_folder
from armtempo.report.run_folder import COMPLETE, FAULT, INTERRUPTED, Repetition, RunFolder
from armtempo.robot.goto import move_once
from armtempo.robot.stop_request import StopRequest
from armtempo.robot.stored_motion import fault_name, raise_fault, readable, replay

_END_S = 1e-3
"""A run that ended earlier than its motion by more than this was stopped."""


class Watcher:
    """Callbacks during a run; override those that you need."""

    def begin(self, motion: EncodedMotion, folder: RunFolder) -> None:
        """The run folder was made, and the arm is at the start of the motion."""

    def on_sample(self, sample: Sample, duration_s: float) -> None:
        """A sample of a motion of ``duration_s`` has arrived."""

    def end(self, repetition: Repetition) -> None:
        """A repetition has ended, also by a stop or a fault."""


class ProgressWatcher(Watcher):
    """Reports the progress of a run of several repetitions, in seconds of motion, and calls another watcher."""

    def __init__(self, progress: Progress | None, repetitions: int, inner: Watcher) -> None:
        self._progress = progress
        self._repetitions = repetitions
        self._inner = inner
        self._ended = 0

    def begin(self, motion: EncodedMotion, folder: RunFolder) -> None:
        self._inner.begin(motion, folder)

    def on_sample(self, sample: Sample, duration_s: float) -> None:
        if self._progress is not None:
            before_s = self._ended * duration_s
            self._progress(before_s + sample.path_ticks / TICK_HZ, self._repetitions * duration_s)
        self._inner.on_sample(sample, duration_s)

    def end(self, repetition: Repetition) -> None:
        self._ended += 1
        self._inner.end(repetition)


def origin(client: Client, arm: Arm, port: str) -> dict[str, Any]:
    """The entries of any run.json on arm and board."""
    return {"arm": arm.name, "port": port, "virtual": client.info.virtual, "board": vars(client.info)}


def new_run(parent: Path, motion: EncodedMotion, port: str, client: Client) -> RunFolder:
    """A new run folder with everything that is needed to repeat the run."""
    where = origin(client, motion.arm, port)
    with run_folder.new_folder(parent, motion.name) as path:
        folder = RunFolder(path, motion.name, run_folder.scales(motion.arm), where)
        folder.write_legs([motion.data])
        if motion.plan is not None:
            motion.plan.save(path / run_folder.TRAJECTORY)
        else:
            arm_json.save(motion.arm, path / run_folder.ARM)
        folder.write()
    return folder


def repeat(
    client: Client,
    motion: EncodedMotion,
    folder: RunFolder,
    times: int,
    stop: StopRequest,
    watcher: Watcher,
) -> Iterator[Repetition]:
    """Replay a stored motion ``times`` times into the run folder, and backwards in between.

    Yields each repetition when it has ended. A stop request ends the series; a fault raises BoardError.
    """
    back = encoded_motion.way_back(motion) if times > 1 else b""
    for number in range(times):
        if number:
            move_once(client, back, stop)
        if stop.wanted:
            return
        end = _recorded(client, motion, folder, stop, watcher)
        watcher.end(folder.repetitions[-1])
        yield folder.repetitions[-1]
        raise_fault(end)


def _recorded(
    client: Client, motion: EncodedMotion, folder: RunFolder, stop: StopRequest, watcher: Watcher
) -> RunEnd:
    """Record one repetition in the run folder, also if it ends early."""
    with folder.begin_repetition() as file:

        def take(sample: Sample, duration_s: float) -> None:
            file.append(sample)
            watcher.on_sample(sample, duration_s)

        end = replay(client, motion.key, stop, take)
        state = FAULT if end.fault else INTERRUPTED if stop.wanted else COMPLETE
        file.repetition.end(state, fault_name(end.fault), end.ticks, end.positions, end.lost)
        file.repetition.notices = readable(end.notices)
    return end


def fetch(client: Client, motion: EncodedMotion, folder_in: Path, port: str) -> RunFolder:
    """Write the samples that the board kept of its last run (of ``motion``) into a new run folder.

    Waits for the end of a run in progress. Raises LinkError if the board has no samples.
    """
    status = client.status()
    if not status.run or not (status.moving or status.samples_kept):
        raise LinkError(
            "the board has no samples: nothing ran since it started, or they were fetched",
            "fetch samples before the next run and before a reset; 'armtempo run' starts a new run",
        )
    follower = Follower(client, status.run)
    folder = new_run(folder_in, motion, port, client)
    with folder.begin_repetition() as file:
        for sample in follower.samples():
            file.append(sample)
        end = follower.end
        cut = end.path_ticks < motion.trajectory.duration_s * TICK_HZ - TICK_HZ * _END_S
        state = FAULT if end.fault else INTERRUPTED if cut else COMPLETE
        file.repetition.end(state, fault_name(end.fault), end.ticks, end.positions, end.lost)
    return folder
