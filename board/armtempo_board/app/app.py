"""The board program: one loop from the serial link over store and engine to the samples and back.

::

    link ─▶ commands ─▶ store ─▶ Motion ─▶ engine (evaluator, rings, DMA, pins)
    link ◀─ events ◀─ samples ◀─────────────┘

States, messages and timings: shared/docs/protocol.md. Anything that goes wrong freezes the engine and
becomes a fault that stays until the host clears it.
"""

import gc
import io
import os
import sys
import time
from array import array

import machine
from armtempo_shared import codes, messages
from armtempo_shared.limits import MAX_JOINTS
from armtempo_shared.messages import ARM_RECORD_NAME, SAMPLE_BRAKING, START_HOMING
from armtempo_shared.motion import Motion, MotionError
from micropython import const

from armtempo_board import heap
from armtempo_board.app.commands import Commands
from armtempo_board.app.events import Events
from armtempo_board.app.sample_buffer import Samples
from armtempo_board.buffers import places, spread
from armtempo_board.errors import Refused
from armtempo_board.link.serial_link import Link
from armtempo_board.motion.engine import Engine

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

_MOST_SAMPLES = const(4096)  # bytes to keep samples in,
_LEAST_SAMPLES = const(1024)
_SHARE = const(16)  # in between this part of what is free
_ALONE = const(3)  # while something moves, a turn looks after the engine so many times more
_MOST_FAILURES = const(10)  # failing turns of the loop one after the other, then the program gives up


class App:
    """Holds the parts together; ``stream`` is the serial port, ``root`` the folder of the store.

    ``fault``: what the program begins with, 0 for none.
    """

    def __init__(self, stream: object, root: str, program_crc: int = 0, fault: int = 0) -> None:
        self._root = root
        self._store: "Any" = None
        self.link = Link(stream)
        self.engine: "Any" = None
        self.samples = Samples(MAX_JOINTS, 0)
        self.joints = 0
        self.arm_crc = 0
        self.program_crc = program_crc
        self.boot = int.from_bytes(os.urandom(4), "little")
        self.board_id = _board_id()
        self.free_flash = 0
        self.free_heap = 0
        self.run_number = 0
        self.duration = 0
        self._leaving = False
        self._link_timeout_ms = 0
        self._needs_link = False
        self._raw = array("i", [0] * 2)
        self._fault = fault
        self._running = False  # a run has begun and its end has not been noted
        self._braking = False
        self._brakes = False  # the motion can come to rest along its path
        self._by_host = False  # the run was started by a command
        self._assumed = 0  # joints whose position a homing motion took for granted
        self.turns = self._failed = 0  # turns of the loop, and the last of them that failed
        self._failures = 0
        self._make_parts()
        heap.forget()
        self.configure()

    def _make_parts(self) -> None:
        from armtempo_shared.table import rows  # here, so that it can be forgotten

        self.commands = Commands(self, rows)
        self.events = Events(self, rows)

    # the loop

    def enter(self) -> None:
        """The program begins, perhaps again after it was left."""
        self._leaving = False
        self.commands.greeted = False
        self.link.forget()

    def left(self) -> int:
        """Whether somebody has asked for the REPL, and the reply is out."""
        return self._leaving and self.link.idle()

    def turn(self) -> None:
        """One turn of the loop; an exception in it becomes a fault."""
        self.turns = (self.turns + 1) & 0xFFFF
        try:
            self._turn()
        except Exception as error:
            self.fail(error)

    def _turn(self) -> None:
        if self.link.poll():
            self.refill()
            self.commands.act()
        if self.engine:
            self.engine.service()
            self._collect()
            self._watch()
        if self.commands.greeted and self.events.push():
            self.refill()
        self.link.flush()
        self._watch_escape()
        for _ in range(_ALONE):
            if self.moving():
                self.engine.service()

    def refill(self) -> None:
        """What cannot wait for the end of longer work while something moves."""
        if self.engine:
            self.engine.refill()

    def _collect(self) -> None:
        while self.engine.next_sample(self._raw):
            self.samples.add(self._raw, SAMPLE_BRAKING if self._braking else 0)

    def _watch(self) -> None:
        if self._running:
            if not self.engine.moving:
                self._end()
            elif self._by_host and not self._braking:
                self._watch_link()
        self.events.note_fault(self.fault())

    def _watch_link(self) -> None:
        silent_ms = time.ticks_diff(time.ticks_ms(), self.link.heard_ms)
        if silent_ms > self._link_timeout_ms and self._needs_link:
            self._fault = codes.LINK_LOST
            self.stop(0)

    def _watch_escape(self) -> None:
        if self.link.escape:
            self.link.escape = False
            if not self.moving():
                self.link.forget()
                self._leaving = True

    def _end(self) -> None:
        self._collect()
        self._forget()
        heap.collect_often()
        self._running = False
        self._braking = False
        if not self.fault():
            self.events.note_done()

    def fail(self, error: "BaseException") -> None:
        """Freeze and keep the fault; raises where one turn after the other fails."""
        again = (self.turns - self._failed) & 0xFFFF <= 1
        self._failures = self._failures + 1 if again else 1
        self._failed = self.turns
        self._fault = codes.INTERNAL
        if self.engine:
            self.engine.freeze()
            self._forget()
        self.events.note(_traceback(error))
        self.events.note_fault(codes.INTERNAL)
        if self._failures >= _MOST_FAILURES:
            raise error

    def halt(self) -> None:
        """Freeze what still moves; the position stays known."""
        if self.engine and self.engine.moving:
            self.engine.freeze()

    # the store, which is there only while it is needed: its code takes memory that a motion needs

    def store(self) -> "Any":
        """The store; an upload that is under way keeps it."""
        if self._store is None:
            from armtempo_board.storage import store

            self._store = store.Store(self._root)
        return self._store

    def forget_store(self) -> None:
        """Give up an upload that is under way."""
        if self._store is not None:
            self._store.abandon()
            self._store = None

    # what commands and the button ask for

    def configure(self) -> None:
        """Take the stored arm record; without one the board stays unconfigured."""
        from armtempo_shared.armrecord import FLAG_STOP_ON_LINK_LOSS  # here, so that it can be forgotten

        record = self._arm_record()
        if record is None or record[2] == self.arm_crc:
            return
        head, joints, crc = record
        self.forget_store()
        heap.forget()
        if self.engine:
            self.engine.close()
            self.engine = None
            self.arm_crc = 0
        self.engine = Engine(head, joints)
        self._link_timeout_ms = head["link_timeout_ms"]
        self._needs_link = bool(head["flags"] & FLAG_STOP_ON_LINK_LOSS)
        self.joints = len(joints)
        self.arm_crc = crc
        self._raw = array("i", [0] * (2 + 2 * self.joints))
        self.samples = Samples(self.joints, _sample_memory())

    def _arm_record(self) -> "tuple[dict[str, int], list[dict[str, int]], int] | None":
        """The stored one: head, joints, crc32; None where there is none."""
        from armtempo_shared import armrecord  # here, so that it can be forgotten

        try:
            return armrecord.unpack(self.store().read(ARM_RECORD_NAME))
        except (Refused, armrecord.ArmRecordError):
            return None

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
        """Start a stored motion, or refuse. ``crc``: of the record that the host means; None: there is none."""
        self.check_ready()
        homing = bool(flags & START_HOMING)
        missing = self.everyone() & ~self.known()
        if missing and not homing:
            raise Refused(codes.UNHOMED, _lowest(missing))
        motion = self.load(name, crc)
        self.forget_store()
        heap.forget()
        gc.collect()
        if homing:
            self._assume(motion, missing)
        refused = self.engine.load(motion)
        if refused:
            self._forget()
            raise Refused(*refused)
        self.samples.clear()
        self.events.clear()
        self.duration = self.engine.duration_ticks
        self.run_number += 1
        self._by_host = crc is not None
        self._braking = False
        self._brakes = motion.brake_ticks > 0
        heap.forget()
        gc.collect()
        heap.collect_often(False)
        self._running = True
        self.engine.start(homing)

    def _assume(self, motion: "Motion", mask: int) -> None:
        """A homing motion may begin anywhere; joints that are not known to stand there are unknown after it."""
        from armtempo_board.motion import endpoints  # here, so that it can be forgotten

        self.engine.snapshot(self._raw)
        for joint in range(self.joints):
            if endpoints.start_offset(motion, joint, self._raw[2 + joint]):
                mask |= 1 << joint
        self.home(mask, [endpoints.start_offset(motion, joint, 0) for joint in range(self.joints)])
        self._assumed = mask

    def _forget(self) -> None:
        if self._assumed:
            self.engine.known &= ~self._assumed
            self._assumed = 0

    def load(self, name: str, crc: "int | None" = None) -> "Motion":
        """The stored motion, checked as far as that needs no evaluator, or refused."""
        data = self.store().read(name)
        try:
            motion = Motion(data)
        except MotionError:
            raise Refused(codes.BAD_RECORD)
        if crc is not None and int.from_bytes(data[-4:], "little") != crc:
            raise Refused(codes.BAD_CHECKSUM)
        if motion.arm_crc != self.arm_crc:
            raise Refused(codes.ARM_MISMATCH)
        if motion.joints != self.joints:
            raise Refused(codes.WRONG_JOINTS, value=motion.joints)
        return motion

    def stop(self, now: int) -> None:
        """Brake along the path; freeze where ``now``, or where the motion has no way to brake."""
        self._braking = True
        if now or not self._brakes:
            self.engine.freeze()
        else:
            self.engine.brake()

    def clear(self) -> None:
        """Clear what is pending; the cause must be gone."""
        if self.engine and not self.engine.clear():
            raise Refused(codes.FAULT_PENDING, self.fault_joint(), self.fault())
        self._fault = 0

    def leave(self) -> None:
        """End the program once the reply is out; the port becomes the REPL."""
        self._leaving = True

    # what the board tells

    def moving(self) -> bool:
        """Whether steps may still come."""
        return self.engine is not None and self.engine.moving

    def known(self) -> int:
        """Bit a joint: its position is known."""
        return self.engine.known if self.engine else 0

    def fault(self) -> int:
        """Code of the pending fault, 0 for none."""
        return self._fault or (self.engine.fault if self.engine else 0)

    def fault_joint(self) -> int:
        """The joint that the fault is about; 255: none."""
        return self.engine.fault_joint if self.engine and self.engine.fault else 255

    def state(self) -> int:
        """Number of the state (messages.STATES)."""
        if self.moving():
            return messages.BRAKING if self._braking else messages.MOVING
        if self.fault():
            return messages.FAULT
        if not self.engine:
            return messages.UNCONFIGURED
        return messages.IDLE if self.known() == self.everyone() else messages.UNHOMED

    def look_around(self) -> None:
        """Bring ``free_flash`` and ``free_heap`` up to date; costs milliseconds, so not while moving."""
        if not self.moving():
            self.free_flash = self.store().free()
            self.free_heap = _free_heap()

    def stand(self, target: bytearray, ticks_at: int, joints_at: int) -> int:
        """Write motion clock and per joint commanded steps and counts as the wire has them; bytes a tail."""
        if not self.engine:
            return 0
        self.engine.snapshot(self._raw)
        spread(target, self._raw, places(ticks_at, joints_at), self.joints)
        return 8 * self.joints

    def everyone(self) -> int:
        """Bit a joint, all set."""
        return (1 << self.joints) - 1


def _lowest(mask: int) -> int:
    joint = 0
    while not mask >> joint & 1:
        joint += 1
    return joint


def _board_id() -> bytes:
    return b"".join([b"%02x" % byte for byte in machine.unique_id()]) + b" " + sys.version.encode()


def _free_heap() -> int:
    free = getattr(gc, "mem_free", None)
    return free() if free else 0


def _sample_memory() -> int:
    gc.collect()
    free = _free_heap()
    return min(max(free // _SHARE, _LEAST_SAMPLES), _MOST_SAMPLES) if free else _MOST_SAMPLES


def _traceback(error: "BaseException") -> str:
    text = io.StringIO()
    sys.print_exception(error, text)
    return str(text.getvalue())
