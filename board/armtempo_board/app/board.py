"""The board's state: store, arm, engine, faults. Nothing here moves anything."""

import gc
import os
import sys
from array import array

import machine
from armtempo_shared import codes
from armtempo_shared.engine_memory import ONCE_BYTES, SHORT_ONCE_BYTES
from armtempo_shared.messages import NO_JOINT
from armtempo_shared.table import offset
from micropython import const

from armtempo_board import features
from armtempo_board.app import memory_shares
from armtempo_board.app.sample_buffer import SampleBuffer
from armtempo_board.buffers import COMMANDED, pack_offsets, sample_to_wire
from armtempo_board.errors import Refused
from armtempo_board.motion.engine import Engine
from armtempo_board.motion.engine_parts import EngineParts
from armtempo_board.storage import store
from armtempo_board.storage.once import Once

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from armtempo_shared.motion import MotionHead


_BYTES_PER_JOINT = const(8)  # in a sample on the wire
_BOOT_BYTES = const(4)
NEVER_MS = const((1 << 30) - 1)


class Board:
    """``root``: the folder of the store. ``fault``: code of a fault that is pending from the start, 0 for none."""

    def __init__(self, root: str, program_crc: int, fault: int) -> None:
        flags_at = offset("E", "sample", "flags") - offset("E", "sample", "ticks")
        self.engine_memory = memory_shares.for_engine()  # before anything fragments the heap
        self.once = Once(SHORT_ONCE_BYTES if self.engine_memory.is_short else ONCE_BYTES)
        self.samples = SampleBuffer(memory_shares.sample_bytes(), flags_at)
        self.root = root
        self._store: "Any" = None
        self.engine: "Any" = None
        self.outputs: "Any" = None  # of an arm that has outputs or inputs,
        self.inputs: "Any" = None  # and these then too,
        self.extra_commands: "dict[int, Any]" = {}  # and their commands
        self.program_crc = program_crc
        self.board_id = board_id()
        # A different number after each power-up
        self.boot = int.from_bytes(os.urandom(_BOOT_BYTES), "little")
        self.joints = 0
        self.arm_crc = 0
        self.all_but_limits = 0  # of the arm record: identity of the arm
        self.arm_record_pending = False  # an arm record was uploaded and is still to be used
        self.arm_problem = 0  # code: why the stored arm record is not used (0: it is used, or there is none),
        self.arm_value = 0  # and its value
        self.silence_ms = NEVER_MS  # of the host's silence, after which a run is stopped
        self.raw = array("i", [0] * COMMANDED)  # a sample of the arm
        self.pending = fault
        if features.SEQUENCES:
            self.starts_alone = 0  # the arm record lets the default start at power-up
            self.taken: "dict[tuple[Any, ...], int]" = {}  # places of this arm's pallets
            self.failure = b""  # what a program failed with: for each host, until the fault is cleared
            self.failure_waits = False  # the present host is to be told

    # the store, there only while needed: it takes memory that a motion needs

    def store(self) -> "Any":
        """The store, made if needed; an upload in progress keeps it."""
        if self._store is None:
            self._store = store.Store(self.root)
        return self._store

    def forget_store(self) -> None:
        """Abort an upload in progress, and drop the store."""
        if self._store is not None:
            self._store.abandon()
            self.drop_store()

    def drop_store(self) -> None:
        """Drop the store; keep the files of an upload in progress."""
        self._store = None

    def make_engine(
        self, head: "dict[str, int]", joints: "list[dict[str, int]]", backlash: "list[dict[str, int]]"
    ) -> None:
        """For an arm, as ``armrecord.unpack`` and ``unpack_backlash`` give it."""
        gc.collect()
        self.engine = Engine(EngineParts(head, joints, self.engine_memory, backlash))

    def checked(self, motion: "MotionHead", crc: "int | None") -> "MotionHead":
        """The motion; raises Refused if it is another than expected (``crc``), or not for this arm."""
        if crc is not None and motion.crc != crc:
            raise Refused(codes.BAD_CHECKSUM)
        if motion.arm_crc != self.arm_crc:
            raise Refused(codes.ARM_MISMATCH)
        if motion.joints != self.joints:
            raise Refused(codes.WRONG_JOINTS, value=motion.joints)
        return motion

    # state

    def engine_bytes(self) -> int:
        """Bytes available for an engine (``armtempo_shared.engine_memory``)."""
        return int(self.engine_memory.size)

    def check_ready(self) -> None:
        """Raise Refused while a fault is pending or no arm is configured."""
        if self.fault():
            raise Refused(codes.FAULT_PENDING, self.fault_joint(), self.fault())
        if not self.engine:
            raise Refused(codes.UNCONFIGURED)

    def known(self) -> int:
        """One bit per joint, set if its position is known."""
        return self.engine.known if self.engine else 0

    def all_joints_mask(self) -> int:
        """One bit per joint, all set."""
        return (1 << self.joints) - 1

    def fault(self) -> int:
        """Code of the pending fault, 0 for none."""
        return self.pending or (self.engine.fault if self.engine else 0)

    def fault_joint(self) -> int:
        """The joint of the fault, or the joint whose switch ended the last homing motion; or NO_JOINT."""
        return int(self.engine.fault_joint) if self.engine and not self.pending else NO_JOINT

    def clear(self) -> None:
        """Clear the pending fault; its cause must be gone."""
        if self.engine and not self.engine.clear():
            raise Refused(codes.FAULT_PENDING, self.fault_joint(), self.fault())
        self.pending = 0
        if features.SEQUENCES:
            self.failure = b""

    def put_snapshot(self, target: bytearray, ticks_at: int, joints_at: int) -> int:
        """Write the present motion clock, steps and counts in wire format; returns the number of bytes of the
        joints."""
        if not self.engine:
            return 0
        self.engine.snapshot(self.raw)
        sample_to_wire(target, self.raw, pack_offsets(ticks_at, joints_at), self.joints)
        return _BYTES_PER_JOINT * self.joints


def board_id() -> bytes:
    """The chip's unique number, and the name of its firmware."""
    return b"".join([b"%02x" % byte for byte in machine.unique_id()]) + b" " + sys.version.encode()
