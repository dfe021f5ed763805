"""What the board does with its arm: takes the stored record, starts and stops runs, keeps their samples.

::

    store ─▶ Motion ─▶ engine (step generator, rings, DMA, pins) ─▶ samples

It knows no link and no messages. Commands, the button and the prompt call it; events read it. States and timings:
shared/docs/protocol.md.
"""

import gc
import os
import sys
import time
from array import array

import machine
from armtempo_shared import codes, messages
from armtempo_shared.limits import HOLD_TIMEOUT_MS
from armtempo_shared.messages import (
    ARM_RECORD_NAME,
    NO_JOINT,
    RESUME,
    SAMPLE_BRAKING,
    START_HELD,
    START_HOMING,
)
from micropython import const

from armtempo_board import heap
from armtempo_board.app.sample_buffer import SampleBuffer
from armtempo_board.buffers import COMMANDED, pack_offsets, sample_to_wire
from armtempo_board.errors import Refused
from armtempo_board.motion.engine import Engine

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from armtempo_board.motion.arm_check import Record as ArmRecord
    from armtempo_board.storage.motion_file import MotionFile

_BYTES_PER_JOINT = const(8)  # in a sample on the wire
_PERMILLE = const(1000)
_BOOT_BYTES = const(4)
_MOTION_CODE_BYTES = const(10_300)  # the large pieces of the code that only a motion needs,
_LAST_PIECES_BYTES = const(1_300)  # and one of them
_NEVER_MS = const((1 << 30) - 1)


class Controller:
    """``root``: the folder of the store. ``fault``: what is pending from the start, 0 for none."""

    def __init__(self, root: str, program_crc: int, fault: int) -> None:
        from armtempo_shared.table import offset  # here, so that it can be forgotten

        from armtempo_board.app import room

        flags_at = offset("E", "sample", "flags") - offset("E", "sample", "ticks")
        heap.forget()
        self._workspace = room.workspace()  # before anything can stand in the way of the largest pieces
        self.samples = SampleBuffer(room.sample_bytes(), flags_at)
        self._root = root
        self._store: "Any" = None
        self.engine: "Any" = None
        self.outputs: "Any" = None  # of an arm that has outputs or inputs,
        self.inputs: "Any" = None  # and these then too,
        self.rows: "dict[int, Any]" = {}  # and their commands
        self.program_crc = program_crc
        self.board_id = _board_id()
        self.boot = int.from_bytes(os.urandom(_BOOT_BYTES), "little")  # another number after each power-up
        self.joints = 0
        self.arm_crc = 0
        self._all_but_limits = 0  # of the arm record: what makes two of them the same arm
        self.arm_waits = False  # an arm record has been stored, and is to be taken
        self.arm_problem = (
            0  # code: why the stored arm record is not in force, 0 where it is or there is none,
        )
        self.arm_value = 0  # and its value
        self.free_flash = 0
        self.free_heap = 0
        self.run_number = 0
        self.duration_ticks = 0
        self.done = False  # a run has ended without a fault, and the host has not been told
        self._silence_ms = _NEVER_MS  # of the host, after which a run is stopped
        self._raw = array("i", [0] * COMMANDED)
        self.pending = fault
        self._running = False  # a run has begun and its end has not been noticed
        self._braking = False
        self._can_brake = False  # the motion can come to rest along its path
        self._next_rate = _PERMILLE  # of the next run that a host starts
        self._by_host = False  # the run was started by a command
        self.sequence: "Any" = None  # the one under way
        self._held = 0  # the run goes on only while the host says hold,
        self._hold_ms: "Any" = 0  # which it did then
        self._assumed = 0  # joints whose position a homing motion took for granted

    # the loop

    def service(self, silent_ms: int) -> None:
        """Keep steps and samples coming; notice the end of a run, or that the host was silent for too long."""
        self.engine.service()
        self._collect()
        if self.outputs:
            if self.fault():
                self.outputs.safe()
            self.inputs.poll(time.ticks_ms())
        if self._running:
            if not self.engine.moving:
                self._end()
            elif silent_ms > self._silence_ms and self._by_host and not self._braking:
                self.pending = codes.LINK_LOST
                self.stop(0)
            elif self._held and time.ticks_diff(time.ticks_ms(), self._hold_ms) > HOLD_TIMEOUT_MS:
                self.stop(0)
        if self.sequence and not self.engine.moving:
            self.sequence.go_on()

    def refill(self) -> None:
        """What cannot wait for the end of longer work while something moves."""
        if self.engine:
            self.engine.refill()

    def _collect(self) -> None:
        while self.engine.next_sample(self._raw):
            self.samples.add(self._raw, SAMPLE_BRAKING if self._braking else 0)

    def _end(self) -> None:
        self._collect()
        self._withdraw_assumed()
        heap.collect_often()
        self._running = False
        self._braking = False
        if not self.fault():
            self.done = True

    def fail(self) -> None:
        """The program has failed: freeze, and INTERNAL is the pending fault."""
        self.pending = codes.INTERNAL
        if self.outputs:
            self.outputs.safe()
        if self.engine:
            self.engine.freeze()
            self._withdraw_assumed()

    def halt(self) -> None:
        """Freeze what still moves, outputs to their safe values; the position stays known."""
        if self.sequence:
            self.sequence.stopping = True
        if self.outputs:
            self.outputs.safe()
        if self.engine and self.engine.moving:
            self.engine.freeze()

    # the store, which is there only while it is needed: its code takes memory that a motion needs

    def store(self) -> "Any":
        """The store; an upload that is under way keeps it."""
        if self._store is None:
            heap.forget()
            from armtempo_board.storage import store

            self._store = store.Store(self._root)
        return self._store

    def forget_store(self) -> None:
        """Give up an upload that is under way."""
        if self._store is not None:
            self._store.abandon()
            self._store = None

    # what commands, button and prompt ask for

    def configure(self) -> None:
        """Take the stored arm record; without one, or where it cannot be used, the board stays unconfigured.

        What stands in the flash never keeps the program from starting: ``arm_problem`` says what is wrong with it.
        """
        self.arm_waits = False
        self.arm_problem = self.arm_value = 0
        try:
            self._take_arm(self._stored_arm())
        except Refused as refused:
            if refused.code != codes.NOT_FOUND:
                self.arm_problem, self.arm_value = refused.code, refused.value
        except Exception as error:
            self._drop_engine()
            self.arm_problem = codes.NO_MEMORY if isinstance(error, MemoryError) else codes.FAILED
        heap.forget()

    def take_new_arm(self) -> None:
        """Take the arm record that was uploaded; Refused where it cannot be, and the one in force stays that.

        Step by step, so that never more than one of store, check and engine needs memory. Each step is a function of
        its own: what its frame leaves on the stack would keep its modules in memory.
        """
        self.arm_waits = False
        try:
            record = self._judged(self._new_arm())
        except Refused:
            self._decide(False)
            raise
        self._decide(True)
        self.arm_problem = self.arm_value = 0
        try:
            self._take_arm(record)
        except Exception:
            self._drop_engine()
            raise
        heap.forget()

    def _new_arm(self) -> bytes:
        try:
            return bytes(self.store().new_arm())
        finally:
            self._store = None
            heap.forget()

    def _decide(self, is_fit: bool) -> None:
        heap.forget()
        from armtempo_board.storage import store  # here, so that it can be forgotten

        store.Store(self._root, recover=False).take_arm(is_fit)
        heap.forget()

    def _stored_arm(self) -> "ArmRecord":
        return self._judged(self._stored_bytes())

    def _stored_bytes(self) -> bytes:
        try:
            return bytes(self.store().read(ARM_RECORD_NAME))
        finally:
            self.forget_store()
            heap.forget()

    def _judged(self, data: bytes) -> "ArmRecord":
        """An arm record that can be taken, unpacked; else Refused."""
        from armtempo_board.motion import arm_check  # here, so that it can be forgotten

        return arm_check.checked(data, self._workspace.words, self._workspace.joints)

    def _take_arm(self, record: "ArmRecord") -> None:
        from armtempo_shared.armrecord import (
            FLAG_STOP_ON_LINK_LOSS,
        )  # here, so that its module can be forgotten

        head, joints, crc, outputs, inputs = record
        if crc == self.arm_crc:
            return
        all_but_limits = _all_but_limits(record)
        known, steps = 0, []
        if self.engine and all_but_limits == self._all_but_limits:  # the same arm: it stands where it stood
            known, steps = self.engine.known, [self.engine.commanded(joint) for joint in range(self.joints)]
        self._drop_engine()
        self._share_room(len(outputs), len(inputs))
        heap.forget("room", "engine_memory")
        gc.collect()
        heap.hold(_MOTION_CODE_BYTES)
        try:
            self.engine = Engine(head, joints, self._workspace)
        except MemoryError:  # rather an arm whose motions may be refused for want of a large piece than none
            heap.release()
            gc.collect()
            self.engine = Engine(head, joints, self._workspace)
        finally:
            heap.release()
        self._all_but_limits = all_but_limits
        if known:
            self.engine.home(known, steps)
        stops = head["flags"] & FLAG_STOP_ON_LINK_LOSS
        self._silence_ms = head["link_timeout_ms"] if stops else _NEVER_MS
        self.joints = len(joints)
        self.arm_crc = crc
        self._raw = array("i", [0] * (COMMANDED + 2 * self.joints))
        self.samples.configure(self.joints)
        if outputs or inputs:
            from armtempo_board.app import output_setup  # here, so that it can be forgotten

            output_setup.attach(self, outputs, inputs)

    def _share_room(self, outputs: int, inputs: int) -> None:
        from armtempo_board.app import room  # here, so that it can be forgotten

        room.share(self._workspace, outputs, inputs)

    def _drop_engine(self) -> None:
        """Before another takes its place: the heap is to be as it was without one."""
        if self.engine:
            self.engine.close()
        if self.outputs:
            from armtempo_board.app import output_setup  # here, so that it can be forgotten

            output_setup.detach(self)
        self.engine = None
        self.joints = self.arm_crc = 0
        self.samples.configure(0)
        self._raw = array("i", [0] * COMMANDED)
        heap.forget()
        gc.collect()

    def engine_room(self) -> int:
        """Bytes of memory that an engine can have (``armtempo_shared.engine_memory``)."""
        return int(4 * self._workspace.words)

    def engine_joints(self) -> int:
        """Joints that an engine can have."""
        return int(self._workspace.joints)

    def check_ready(self) -> None:
        """Refuses while a fault is pending or no arm is configured."""
        if self.fault():
            raise Refused(codes.FAULT_PENDING, self.fault_joint(), self.fault())
        if not self.engine:
            raise Refused(codes.UNCONFIGURED)

    def home(self, mask: int, steps: "Sequence[int]") -> None:
        """Declare where the joints of ``mask`` stand; ``steps`` has a number for every joint."""
        for joint in range(self.joints):
            row = self.engine.limits[joint]
            if mask >> joint & 1 and not row["min_steps"] <= steps[joint] <= row["max_steps"]:
                raise Refused(codes.OUT_OF_RANGE, joint, steps[joint])
        self.engine.home(mask, steps)

    def begin(self, name: str, flags: int, crc: "int | None" = None) -> None:
        """Start a stored motion or sequence, or refuse. ``crc``: of the record that the host means; None: there is no
        host.
        """
        self.check_ready()
        homing = bool(flags & START_HOMING)
        unknown = self.everyone() & ~self.known()
        if unknown and not homing:
            raise Refused(codes.UNHOMED, _lowest(unknown))
        self._by_host = crc is not None
        rate, self._next_rate = self._next_rate if self._by_host else _PERMILLE, _PERMILLE
        if self.store().is_sequence(name):
            self._new_sequence(name, crc, rate, flags)
            self.sequence.begin()
            return
        self.begin_motion(name, crc, rate, flags, unknown)

    def _new_sequence(self, name: str, crc: "int | None", rate: int, flags: int) -> None:
        self.forget_store()
        heap.forget()
        gc.collect()
        try:
            from armtempo_board.app import sequence_start  # here, so that it can be forgotten

            self.sequence = sequence_start.sequencer(self, name, crc, rate, flags)
        except MemoryError:
            raise Refused(codes.NO_SEQUENCE_ROOM)

    def begin_motion(self, name: str, crc: "int | None", rate: int, flags: int = 0, unknown: int = 0) -> None:
        """Start a stored motion at ``rate`` thousandths of its speed, or refuse.

        ``flags``, ``crc`` as for ``begin``; ``unknown``: joints of unknown position.
        """
        homing = bool(flags & START_HOMING)
        self.forget_store()
        heap.forget()
        gc.collect()
        heap.hold(_MOTION_CODE_BYTES, _LAST_PIECES_BYTES, _LAST_PIECES_BYTES)
        try:
            motion = self.load(name, crc)
            self.forget_store()
            heap.forget()
            gc.collect()
            if homing:
                self._assume(motion, unknown)
            self.engine.load(motion, rate)
        except Refused:
            self._withdraw_assumed()
            raise
        finally:
            heap.release()
        self.samples.clear()
        self.done = False
        self.duration_ticks = self.engine.duration_ticks
        self.run_number += 1
        self._braking = False
        self._can_brake = motion.brake_ticks > 0
        heap.forget()
        gc.collect()
        heap.collect_often(False)
        self._running = True
        self._held = flags & START_HELD
        self.hold()
        self.engine.start(homing)

    def _assume(self, motion: "MotionFile", mask: int) -> None:
        """A homing motion may begin anywhere; joints that are not known to stand there are unknown after it."""
        from armtempo_board.motion import endpoints  # here, so that it can be forgotten

        self.engine.snapshot(self._raw)
        for joint in range(self.joints):
            if endpoints.start_offset(motion, joint, self._raw[COMMANDED + joint]):
                mask |= 1 << joint
        self.home(mask, [endpoints.start_offset(motion, joint, 0) for joint in range(self.joints)])
        self._assumed = mask

    def _withdraw_assumed(self) -> None:
        if self._assumed:
            self.engine.known &= ~self._assumed
            self._assumed = 0

    def load(self, name: str, crc: "int | None" = None) -> "MotionFile":
        """The stored motion, checked as far as its head and checksum go, or refused."""
        motion: MotionFile = self.store().motion(name)
        if crc is not None and motion.crc != crc:
            raise Refused(codes.BAD_CHECKSUM)
        if motion.arm_crc != self.arm_crc:
            raise Refused(codes.ARM_MISMATCH)
        if motion.joints != self.joints:
            raise Refused(codes.WRONG_JOINTS, value=motion.joints)
        return motion

    def stop(self, now: int) -> None:
        """Brake along the path; freeze where ``now``, or where the motion has no way to. A sequence ends there."""
        if self.sequence:
            self.sequence.stopping = True
            if not self.engine.moving:
                return
        self._braking = True
        self._held = 0
        if now or not self._can_brake:
            self.engine.freeze()
        else:
            self.engine.brake()

    def change_speed(self, rate: int) -> None:
        """What moves goes on at ``rate`` thousandths (0: pause, RESUME: as before), or a host's next run begins so."""
        if self.moving():
            (self.sequence or self.engine).change_rate(rate)
        elif rate in (0, RESUME):
            raise Refused(codes.NOT_MOVING)
        else:
            self._next_rate = rate

    def forget_speed(self) -> None:
        """A new host: what another one wanted for its next run is no longer meant."""
        self._next_rate = _PERMILLE

    def hold(self) -> None:
        """A held run is still wanted."""
        self._hold_ms = time.ticks_ms()

    def clear(self) -> None:
        """Clear what is pending; the cause must be gone."""
        if self.engine and not self.engine.clear():
            raise Refused(codes.FAULT_PENDING, self.fault_joint(), self.fault())
        self.pending = 0

    def measure_free(self) -> None:
        """Bring ``free_flash`` and ``free_heap`` up to date; costs milliseconds, so not while moving."""
        if not self.moving():
            self.free_flash = self.store().free()
            self.free_heap = _free_heap()

    # what the board tells

    def moving(self) -> bool:
        """Whether steps may still come; a sequence has more to come while it waits."""
        return self.engine is not None and (self.engine.moving or self.sequence is not None)

    def known(self) -> int:
        """Bit a joint: its position is known."""
        return self.engine.known if self.engine else 0

    def everyone(self) -> int:
        """Bit a joint, all set."""
        return (1 << self.joints) - 1

    def fault(self) -> int:
        """Code of the pending fault, 0 for none."""
        return self.pending or (self.engine.fault if self.engine else 0)

    def fault_joint(self) -> int:
        """The joint that the fault is about, or NO_JOINT."""
        return self.engine.fault_joint if self.engine and self.engine.fault else NO_JOINT

    def speed(self) -> int:
        """The rate that is wanted of the motion's own time, in thousandths; 0 in a pause."""
        return self.engine.rate if self.moving() else self._next_rate

    def state(self) -> int:
        """Number of the state (messages.STATES)."""
        if self.moving():
            return messages.BRAKING if self._braking else messages.MOVING
        if self.fault():
            return messages.FAULT
        if not self.engine:
            return messages.UNCONFIGURED
        return messages.IDLE if self.known() == self.everyone() else messages.UNHOMED

    def put_snapshot(self, target: bytearray, ticks_at: int, joints_at: int) -> int:
        """Write motion clock, commanded steps and counts of this moment as the wire has them; bytes of the joints."""
        if not self.engine:
            return 0
        self.engine.snapshot(self._raw)
        sample_to_wire(target, self._raw, pack_offsets(ticks_at, joints_at), self.joints)
        return _BYTES_PER_JOINT * self.joints


def _board_id() -> bytes:
    return b"".join([b"%02x" % byte for byte in machine.unique_id()]) + b" " + sys.version.encode()


def _all_but_limits(record: "ArmRecord") -> int:
    from armtempo_shared import armrecord  # here, so that it can be forgotten

    head, joints, _, _, _ = record
    return armrecord.without_limits(head, joints)


def _lowest(mask: int) -> int:
    joint = 0
    while not mask >> joint & 1:
        joint += 1
    return joint


def _free_heap() -> int:
    free = getattr(gc, "mem_free", None)
    return free() if free else 0
