"""Starts and stops runs, changes their speed, keeps their samples.

::

    store ─▶ Motion ─▶ engine (step generator, rings, DMA, pins) ─▶ samples

It is independent of link and messages. Commands, the button and the prompt call it; events read it. States
and timings: shared/docs/protocol.md.
"""

import gc
import time

from armtempo_shared import codes, messages
from armtempo_shared.limits import HOLD_TIMEOUT_MS
from armtempo_shared.messages import (
    MOTION,
    ONCE_NAME,
    PROGRAM,
    RESUME,
    SAMPLE_BRAKING,
    SEQUENCE,
    START_HELD,
    START_HOMING,
    START_SEEKS,
    START_SWITCHES_BIT,
)
from micropython import const

from armtempo_board import features, heap
from armtempo_board.app import arm_setup
from armtempo_board.buffers import COMMANDED
from armtempo_board.errors import Refused
from armtempo_board.motion import endpoints

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from armtempo_shared.motion import MotionHead

    from armtempo_board.app.board import Board

_PERMILLE = const(1000)


class Controller:
    """Controls the arm of a board."""

    def __init__(self, board: "Board") -> None:
        self.board = board
        self.sequence: "Any" = None  # the present run, or a program,
        if features.SEQUENCES:
            self.program: "Any" = None  # which is to be executed by the main loop
        self.free_flash = 0
        self.free_heap = 0
        self.run_number = 0
        self.duration_ticks = 0
        self.done = False  # a run has ended without a fault, not yet reported to the host
        self.running = False  # a run has begun, its end has not been detected
        self._braking = False
        self._can_brake = False  # the motion can come to rest along its path
        self._next_rate = _PERMILLE  # rate of the next run that a host starts
        self._by_host = False  # the run was started by a command
        self._held = 0  # the run continues only while the host says hold,
        self._hold_ms: "Any" = 0  # which it did then
        self._assumed = 0  # joints whose position a homing motion assumed

    # the loop

    def service(self, silent_ms: int) -> None:
        """Serve the engine and the samples; detect the end of a run, and a silent host."""
        board = self.board
        board.engine.service()
        self._collect()
        if board.outputs:
            if board.fault():
                board.outputs.safe()
            board.inputs.poll(time.ticks_ms())
        if self.running:
            if not board.engine.moving:
                self._end()
            elif silent_ms > board.silence_ms and self._by_host and not self._braking:
                board.pending = codes.LINK_LOST
                self.stop(0)
            elif self._held and time.ticks_diff(time.ticks_ms(), self._hold_ms) > HOLD_TIMEOUT_MS:
                self.stop(0)
        if self.sequence:
            if board.engine.moving:
                self.sequence.prepare()
            else:
                self.sequence.advance()

    def refill(self) -> None:
        """Serve the engine during longer work while a motion runs."""
        if self.board.engine:
            self.board.engine.refill()

    def _collect(self) -> None:
        board = self.board
        while board.engine.next_sample(board.raw):
            board.samples.add(board.raw, self.run_number, SAMPLE_BRAKING if self._braking else 0)

    def _end(self) -> None:
        self._collect()
        self._withdraw_assumed()
        if not self.sequence:  # its next motion starts at once
            heap.collect_often()
        self.running = False
        self._braking = False
        if not self.board.fault():
            self.done = True

    def fail(self) -> None:
        """After an exception: freeze, and set the fault INTERNAL."""
        board = self.board
        board.pending = codes.INTERNAL
        if board.outputs:
            board.outputs.safe()
        if board.engine:
            board.engine.freeze()
            self._withdraw_assumed()

    def halt(self) -> None:
        """Freeze a running motion, set outputs to their safe values; the position stays known."""
        if self.sequence:
            self.sequence.stopping = True
        board = self.board
        if board.outputs:
            board.outputs.safe()
        if board.engine and board.engine.moving:
            board.engine.freeze()

    def moving(self) -> bool:
        """Whether there may be more steps; True while a sequence waits."""
        engine = self.board.engine
        return engine is not None and (engine.moving or self.sequence is not None)

    # called by commands, button and prompt

    def configure(self) -> None:
        """Use the stored arm record, if there is a valid one."""
        arm_setup.take_stored(self.board)

    def take_new_arm(self) -> None:
        """Take the arm record that was uploaded; Refused if it cannot be, and the one in force stays that."""
        arm_setup.take_new(self.board)

    def check_homed(self) -> None:
        """Raise Refused while the position of a joint is unknown."""
        unknown = self._unknown()
        for joint in range(self.board.joints):
            if unknown >> joint & 1:
                raise Refused(codes.UNHOMED, joint)

    def _unknown(self) -> int:
        """One bit per joint of unknown position."""
        return self.board.all_joints_mask() & ~self.board.known()

    def home(self, mask: int, steps: "Sequence[int]") -> None:
        """Declare the positions of the joints in ``mask``; ``steps`` has an entry for every joint."""
        engine = self.board.engine
        for joint in range(self.board.joints):
            row = engine.limits[joint]
            if mask >> joint & 1 and not row["min_steps"] <= steps[joint] <= row["max_steps"]:
                raise Refused(codes.OUT_OF_RANGE, joint, steps[joint])
        engine.home(mask, steps)

    def load(self, name: str, crc: "int | None" = None) -> "MotionHead":
        """The motion, with head and checksum checked; raises Refused."""
        board = self.board
        if name == ONCE_NAME:
            return board.checked(board.once.motion(board.store), crc)
        store = board.store()
        gc.collect()  # objects that stay during the run should lie at low addresses
        return board.checked(store.motion(name), crc)

    def _assume(self, motion: "MotionHead") -> int:
        """Assume that the joints are at the start of a homing motion; those of unknown position are unknown
        after it too.

        Returns one bit per joint that moves.
        """
        board = self.board
        unknown = self._unknown()
        board.engine.snapshot(board.raw)
        moving = 0
        for joint in range(board.joints):
            if endpoints.start_offset(motion, joint, board.raw[COMMANDED + joint]):
                unknown |= 1 << joint
            if endpoints.at_start(motion, joint) != endpoints.at_end(motion, joint):
                moving |= 1 << joint
        self.home(unknown, [endpoints.start_offset(motion, joint, 0) for joint in range(board.joints)])
        self._assumed = unknown
        return moving

    def release_memory(self) -> None:
        """Free what only the last commands needed, so that new objects lie close to those that stay."""
        self.board.forget_store()
        gc.collect()

    def begin(self, name: str, flags: int, crc: "int | None" = None) -> None:
        """Start a motion or sequence, or raise Refused. ``crc``: of the record that the host expects;
        None: no host.
        """
        board = self.board
        board.check_ready()
        if flags & START_HELD and not features.JOG:
            raise Refused(codes.NEEDS_FIRMWARE)
        if not name:  # no default is set
            raise Refused(codes.NOT_FOUND)
        kind = MOTION
        if features.SEQUENCES and name != ONCE_NAME:
            kind = self._kind(name)
        if kind != PROGRAM and not flags & START_HOMING:  # a program may home the arm itself
            self.check_homed()
        self._by_host = crc is not None
        rate = _PERMILLE
        if features.SPEED and self._by_host:
            rate = self._next_rate
            self.forget_speed()
        if features.SEQUENCES:  # noqa: SIM102  the core is without what is behind a constant alone
            if kind != MOTION:
                self._new_sequence(kind, name, crc, rate, flags)
                self.sequence.begin()
                board.samples.clear()
                return
        self.begin_motion(name, crc, rate, flags)

    if features.SEQUENCES:

        def _new_sequence(self, kind: int, name: str, crc: "int | None", rate: int, flags: int) -> None:
            """Make the sequence or program ready."""
            if flags:
                raise Refused(codes.IS_SEQUENCE)
            if kind == SEQUENCE:
                self.board.once.release()  # a program makes its moves there
            self.release_memory()
            try:
                # here, as only these need the memory
                if kind == SEQUENCE:
                    from armtempo_board.app import sequence_start

                    self.sequence = sequence_start.sequencer(self, name, crc, rate)
                else:
                    from armtempo_board.app import program_start

                    self.sequence = program_start.user_program(self, name, crc, rate)
            except MemoryError:
                raise Refused(codes.NO_SEQUENCE_MEMORY)

        def _kind(self, name: str) -> int:
            self.release_memory()
            return int(self.board.store().kind(name))

    def begin_motion(self, name: str, crc: "int | None", rate: int, flags: int = 0) -> None:
        """Start a motion at ``rate`` thousandths of its speed, or refuse; ``flags``, ``crc`` as for ``begin``."""
        board = self.board
        is_short = board.engine_memory.is_short
        heap.collect_often(heap.OFTEN if is_short else heap.SELDOM)
        release = self.release_memory if is_short else board.forget_store  # a collection takes 6 ms
        release()
        try:
            motion = self.load(name, crc)
            release()
            homing = 0
            if flags & START_HOMING:
                moving = self._assume(motion)
                homing = flags % START_SEEKS >> START_SWITCHES_BIT or moving
            board.engine.load(motion, rate, None, homing, flags & START_SEEKS != 0)
        except Refused:
            self._withdraw_assumed()
            heap.collect_often()
            raise
        self.start_loaded(motion, flags)

    def start_loaded(self, motion: "MotionHead", flags: int) -> None:
        """Start the motion that the engine has loaded; ``flags`` as for ``begin``."""
        if not self.sequence:  # the last sample of its motion before may still be to be sent
            self.board.samples.clear()
        self.done = False
        self.duration_ticks = self.board.engine.rates.duration_ticks
        self.run_number += 1
        self._braking = False
        self._can_brake = motion.can_brake
        gc.collect()
        heap.collect_often(0)
        self.running = True
        if features.JOG:
            self._held = flags & START_HELD
            self.hold()
        self.board.engine.start()

    def _withdraw_assumed(self) -> None:
        if self._assumed:
            engine = self.board.engine
            if features.BACKLASH:
                engine.withdrawn |= engine.known & self._assumed
            engine.known &= ~self._assumed
            self._assumed = 0

    def stop(self, now: int) -> None:
        """Brake along the path (``now``, or without brake times: freeze); ends a sequence."""
        if self.sequence:
            self.sequence.stopping = True
            if not self.board.engine.moving:
                return
        self.brake(now)

    def brake(self, now: int) -> None:
        """As ``stop``, but a sequence goes on."""
        self._braking = True
        self._held = 0
        if now or not self._can_brake:
            self.board.engine.freeze()
        else:
            self.board.engine.brake()

    if features.SPEED:

        def change_speed(self, rate: int) -> None:
            """Set the rate of the running motion, or of a host's next run, in thousandths (0: pause, RESUME:
            end of the pause)."""
            if self.moving():
                (self.sequence or self.board.engine).change_rate(rate)
            elif rate in (0, RESUME):
                raise Refused(codes.NOT_MOVING)
            else:
                self._next_rate = rate

        def forget_speed(self) -> None:
            """Reset the rate of the next run: the host's value was used, or that host is gone."""
            self._next_rate = _PERMILLE

    if features.JOG:

        def hold(self) -> None:
            """A held run is still wanted."""
            self._hold_ms = time.ticks_ms()

    def measure_free(self) -> None:
        """Update ``free_flash`` and ``free_heap``; takes milliseconds, so not during a motion."""
        if not self.moving():
            self.free_flash = self.board.store().free()
            self.free_heap = _free_heap()

    def speed(self) -> int:
        """Requested rate of the motion's own time, in thousandths; 0 in a pause."""
        return self.board.engine.rates.wanted if self.moving() else self._next_rate

    def rest_ms(self) -> int:
        """Milliseconds until rest after a stop, given earlier or now; 0: at once."""
        engine = self.board.engine
        return engine.rest_ms() if engine and engine.moving else 0

    def state(self) -> int:
        """Number of the state (messages.STATES)."""
        if self.moving():
            return messages.BRAKING if self._braking else messages.MOVING
        board = self.board
        if board.fault():
            return messages.FAULT
        if not board.engine:
            return messages.UNCONFIGURED
        return messages.IDLE if board.known() == board.all_joints_mask() else messages.UNHOMED


def _free_heap() -> int:
    gc.collect()  # what is no longer in use counts as free
    free = getattr(gc, "mem_free", None)
    return free() if free else 0
