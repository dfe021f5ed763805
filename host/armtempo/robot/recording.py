"""Recording runs of motions and sequences: the run folder, its repetitions, and the samples of a run without a host."""

from __future__ import annotations

import math
from itertools import chain
from pathlib import Path

from armtempo_shared.limits import TICK_HZ
from armtempo_shared.sequence import MOVE

from armtempo.basics.errors import LinkError
from armtempo.basics.progress import Progress
from armtempo.encoding import encoded_motion
from armtempo.encoding.encoded_motion import EncodedMotion
from armtempo.encoding.encoded_sequence import Encoded
from armtempo.link import Client
from armtempo.link.board_messages import RowBegun, Sample, SequenceState
from armtempo.link.follow import Followed, MotionFollower, RunEnd, SequenceWatcher, number_in_run
from armtempo.model import arm_json
from armtempo.model.plan import Plan
from armtempo.model.sequence_plan import SequenceRow
from armtempo.report import run_folder
from armtempo.report.run_folder import COMPLETE, FAULT, INTERRUPTED, Repetition, RunFolder, RunRow
from armtempo.robot import running
from armtempo.robot.goto import move_once
from armtempo.robot.running import fault_name, raise_fault, readable, replay
from armtempo.robot.stop_request import StopRequest

_END_S = 1e-3
"""A run that ended earlier than its motion by more than this was stopped."""


class Watcher:
    """Callbacks during a run; override those that you need."""

    def begin(self, motion: Encoded, folder: RunFolder) -> None:
        """The run folder was made, and the arm is at the start of the motion or sequence."""

    def on_sample(self, sample: Sample, duration_s: float) -> None:
        """A sample of a motion of ``duration_s`` has arrived; NaN for a motion of a sequence that was not reported."""

    def end(self, repetition: Repetition) -> None:
        """A repetition has ended, also by a stop or a fault."""


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
            before_s = self._ended * duration_s
            self._progress(before_s + sample.path_ticks / TICK_HZ, self._repetitions * duration_s)
        self._inner.on_sample(sample, duration_s)

    def end(self, repetition: Repetition) -> None:
        self._ended += 1
        self._inner.end(repetition)


def new_run(parent: Path, encoded: Encoded, port: str, client: Client) -> RunFolder:
    """A new run folder with everything that is needed to repeat the run."""
    name, arm, plan = encoded.name, encoded.arm, encoded.plan
    where = {"arm": arm.name, "port": port, "virtual": client.info.virtual, "board": vars(client.info)}
    legs = tuple((motion.name, motion.data) for motion in encoded.motions)
    rows = tuple(map(_row, encoded.rows))
    with run_folder.new_folder(parent, name) as path:
        names = tuple(leg for leg, _ in legs)
        folder = RunFolder(path, name, run_folder.scales(arm), where, legs=names, rows=rows)
        folder.write_legs(data for _, data in legs)
        if plan is None:
            arm_json.save(arm, path / run_folder.ARM)
        else:
            plan.save(path / (run_folder.TRAJECTORY if isinstance(plan, Plan) else run_folder.SEQUENCE))
        folder.write()
    return folder


def _row(row: SequenceRow) -> RunRow:
    return RunRow(row.step, row.number + 1 if row.op == MOVE else 0, row.words)


def sequence(
    client: Client,
    encoded: Encoded,
    folder: RunFolder,
    stop: StopRequest,
    watcher: Watcher,
    on_state: SequenceWatcher,
) -> SequenceState:
    """Run a stored sequence, and record its rows and samples in the run folder; returns its last state.

    Raises BoardError if a fault ends it, or the board refuses one of its motions.
    """
    legs_s = [math.nan, *(motion.trajectory.duration_s for motion in encoded.motions)]
    clock = client.session.clock
    begun_s = clock()
    row_of_run: dict[int, int] = {}  # of each run that was reported and may have more samples
    with folder.begin_repetition(with_rows=True) as file:

        def take(event: Followed) -> None:
            if isinstance(event, RowBegun):
                file.begin_row(event, clock() - begun_s)
                if event.row < len(folder.rows) and folder.rows[event.row].leg:
                    row_of_run[event.run] = event.row
            elif isinstance(event, Sample):
                row = row_of_run.get(event.run)
                file.append(event, row)
                watcher.on_sample(event, legs_s[0 if row is None else folder.rows[row].leg])
                for run in [run for run in row_of_run if run < event.run]:
                    del row_of_run[run]

        followed = running.run_sequence(client, encoded.key, stop, on_state, take)
        end = followed.end
        file.repetition.end_rows(
            end, fault_name(end.code), client.counters(), clock() - begun_s, followed.lost
        )
        watcher.end(file.repetition)
        running.raise_sequence_failure(client, end)
    return end


def repeat(
    client: Client,
    motion: EncodedMotion,
    folder: RunFolder,
    times: int,
    stop: StopRequest,
    watcher: Watcher,
) -> None:
    """Replay a stored motion ``times`` times into the run folder, and backwards in between.

    A stop request ends the series; a fault raises BoardError.
    """
    back = encoded_motion.way_back(motion) if times > 1 else b""
    for number in range(times):
        if number:
            move_once(client, back, stop)
        if stop.wanted:
            return
        end = _recorded(client, motion, folder, stop, watcher)
        watcher.end(folder.repetitions[-1])
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
    with folder.begin_repetition() as file:
        for sample in chain([first] if first else [], samples):
            file.append(sample)
        end = follower.end
        cut = end.path_ticks < motion.trajectory.duration_s * TICK_HZ - TICK_HZ * _END_S
        state = FAULT if end.fault else INTERRUPTED if cut else COMPLETE
        file.repetition.end(state, fault_name(end.fault), end.ticks, end.positions, end.lost)
    return folder
