"""Recording runs of motions and sequences: the run folder, its repetitions, and the samples of a run without a host."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import chain
from pathlib import Path

from armtempo_shared.limits import TICK_HZ

from armtempo.basics.errors import LinkError
from armtempo.basics.progress import Progress
from armtempo.encoding.encoded_plan import Encoded
from armtempo.link import Client
from armtempo.link.board_messages import RowBegun, Sample, SequenceState
from armtempo.link.follow import Followed, Gap, MotionFollower, RunEnd, SequenceWatcher, number_in_run
from armtempo.model import arm_json
from armtempo.report import run_folder
from armtempo.report.run_folder import (
    COMPLETE,
    FAULT,
    INTERRUPTED,
    Recording,
    Repetition,
    RunFolder,
)
from armtempo.robot.running import fault_name, readable

_END_S = 1e-3
"""A run that ended earlier than its motion by more than this was stopped."""


class Watcher:
    """Callbacks during a run; override those that you need."""

    def begin(self, motion: Encoded, folder: RunFolder) -> None:
        """The run folder was made, and the arm is at the start of the motion or sequence."""

    def on_sample(self, sample: Sample, duration_s: float) -> None:
        """A sample of a motion of ``duration_s`` has arrived; NaN for a motion of a sequence that was not reported."""

    def on_state(self, state: SequenceState) -> None:
        """The state of a sequence has changed."""

    def end(self, repetition: Repetition) -> None:
        """A repetition has ended, also by a stop or a fault."""


class StateWatcher(Watcher):
    """Calls a function with each state of a sequence."""

    def __init__(self, call: SequenceWatcher) -> None:
        self._call = call

    def on_state(self, state: SequenceState) -> None:
        self._call(state)


class ProgressWatcher(Watcher):
    """Reports the progress of a run of several repetitions, in seconds of motion, and calls another watcher."""

    def __init__(self, progress: Progress | None, repetitions: int, inner: Watcher) -> None:
        self._progress = progress
        self._repetitions = repetitions
        self._inner = inner
        self._ended = 0

    def begin(self, motion: Encoded, folder: RunFolder) -> None:
        self._inner.begin(motion, folder)

    def on_sample(self, sample: Sample, duration_s: float) -> None:
        if self._progress is not None:
            done_s = min(sample.path_ticks / TICK_HZ, duration_s)  # the board ends at a whole tick
            self._progress(self._ended * duration_s + done_s, self._repetitions * duration_s)
        self._inner.on_sample(sample, duration_s)

    def on_state(self, state: SequenceState) -> None:
        self._inner.on_state(state)

    def end(self, repetition: Repetition) -> None:
        self._ended += 1
        self._inner.end(repetition)


def new_run(parent: Path, encoded: Encoded, port: str, client: Client) -> RunFolder:
    """A new run folder with everything that is needed to repeat the run."""
    name, arm, plan = encoded.name, encoded.arm, encoded.plan
    where = {"arm": arm.name, "port": port, "virtual": client.info.virtual, "board": vars(client.info)}
    rows = tuple(map(run_folder.run_row, encoded.rows))
    with run_folder.new_folder(parent, name) as path:
        names = tuple(leg.name for leg in encoded.legs)
        folder = RunFolder(path, name, run_folder.scales(arm), where, legs=names, rows=rows)
        folder.write_legs(leg.data for leg in encoded.legs)
        if plan is None:
            arm_json.save(arm, path / run_folder.ARM)
        else:
            plan.save(path / (run_folder.SEQUENCE if plan.is_sequence else run_folder.TRAJECTORY))
        folder.write()
    return folder


class Recorder:
    """Writes what a follower passes on into a repetition of a run folder."""

    def __init__(
        self, client: Client, encoded: Encoded, folder: RunFolder, file: Recording, watcher: Watcher
    ) -> None:
        self._client = client
        self._folder = folder
        self._file = file
        self._watcher = watcher
        self._sequence = encoded.is_sequence
        self._legs_s = [math.nan, *(leg.trajectory.duration_s for leg in encoded.legs)]
        self._begun_s = client.session.clock()
        self._row_of_run: dict[int, int] = {}  # of each run that was reported and may have more samples

    def take(self, event: Followed) -> None:
        """Write a sample or the begin of a row; others are written at the end."""
        if isinstance(event, RowBegun):
            self._file.begin_row(event, self._client.session.clock() - self._begun_s)
            if event.row < len(self._folder.rows) and self._folder.rows[event.row].leg:
                self._row_of_run[event.run] = event.row
        elif isinstance(event, Sample):
            row = self._row_of_run.get(event.run) if self._sequence else 0
            self._file.append(event, row)
            self._watcher.on_sample(event, self._legs_s[0 if row is None else self._folder.rows[row].leg])
            for run in [run for run in self._row_of_run if run < event.run]:
                del self._row_of_run[run]

    def end(self, end: RunEnd | SequenceState, lost: tuple[Gap, ...], stopped: bool) -> None:
        """It has ended; ``stopped``: a stop was wanted."""
        repetition = self._file.repetition
        if isinstance(end, SequenceState):
            taken_s = self._client.session.clock() - self._begun_s
            repetition.end_rows(end, fault_name(end.code), self._client.counters(), taken_s, lost)
            return
        state = FAULT if end.fault else INTERRUPTED if stopped else COMPLETE
        repetition.end(state, fault_name(end.fault), end.ticks, end.positions, lost)
        repetition.notices = readable(end.notices)


@contextmanager
def repetition(client: Client, encoded: Encoded, folder: RunFolder, watcher: Watcher) -> Iterator[Recorder]:
    """One start of a motion or sequence, recorded in the run folder, also if it ends early; then the watcher is told.

    If ``end`` is not called, it was interrupted, or its connection is broken.
    """
    with folder.begin_repetition(with_rows=encoded.is_sequence) as file:
        yield Recorder(client, encoded, folder, file, watcher)
    watcher.end(file.repetition)


def fetch(client: Client, motion: Encoded, folder_in: Path, port: str) -> RunFolder:
    """Write the samples that the board kept of its last run (of ``motion``) into a new run folder.

    Waits for the end of a run in progress. Raises LinkError if the board has no samples, or they are of a sequence.
    """
    status = client.status()
    if not status.run or not (status.moving or status.samples_kept):
        raise LinkError(
            "the board has no samples: nothing ran since it started, or they were fetched",
            "fetch samples before the next run and before a reset; 'armtempo run' starts a new run",
        )
    follower = MotionFollower(client, status.run)
    samples = follower.samples()
    first = next(samples, None)
    if first is not None and first.index != number_in_run(first):
        raise LinkError(
            "the last run was that of a sequence, whose samples are not kept", "record it with 'armtempo run'"
        )
    folder = new_run(folder_in, motion, port, client)
    with repetition(client, motion, folder, Watcher()) as recorder:
        for sample in chain([first] if first else [], samples):
            recorder.take(sample)
        end = follower.end
        recorder.end(
            end, end.lost, end.path_ticks < motion.trajectory.duration_s * TICK_HZ - TICK_HZ * _END_S
        )
    return folder
