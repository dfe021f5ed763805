"""The parts of an engine for one arm, and what it does between motions: positions, drivers, E-stop, faults."""

from armtempo_shared.messages import NO_JOINT
from micropython import const

from armtempo_board import heap
from armtempo_board.hardware import isr
from armtempo_board.hardware.encoders import EncoderInput, NoEncoder
from armtempo_board.hardware.inputs import Inputs
from armtempo_board.motion.clock import MotionClock
from armtempo_board.motion.following_error import FollowingError
from armtempo_board.motion.joint_drive import JointDrive
from armtempo_board.motion.rate_control import RateControl
from armtempo_board.motion.readings import Readings
from armtempo_board.motion.workspace import Workspace

_PULSE_SPARE_US = const(5)
_TICKS_PER_US = const(84)
_LIMITS = ("min_steps", "max_steps", "max_rate")  # what of a joint's row in the arm record is needed later


class EngineParts:
    """``head`` and ``joints`` as ``armrecord.unpack`` gives them. Nothing moves, drivers are off.

    ``workspace``: what the engine before worked in and this one takes over; MemoryError where it is too small.
    """

    def __init__(self, head: "dict[str, int]", joints: "list[dict[str, int]]", workspace: Workspace) -> None:
        from armtempo_shared import armrecord  # here, so that they can be forgotten

        from armtempo_board.hardware import registers

        self.feeder = workspace.feeder

        rows = [row for row in joints if row["encoder"] != armrecord.NONE]
        fitted = [EncoderInput(row["encoder"], row["encoder_inverted"]) for row in rows]
        self._sampler = workspace.sampler
        self._sampler.configure(len(joints), tuple([encoder.address for encoder in fitted]))
        self.block = self._sampler.block
        self._sampler.connect()
        registers.apply(registers.CLOCKS)
        registers.apply(registers.TIMERS)
        rings = workspace.rings([row["max_rate"] for row in joints])
        heap.forget("room", "engine_memory")
        arm = head, joints
        self.drives = [
            JointDrive(n, arm, self._sampler, ring, workspace.memory) for n, ring in enumerate(rings)
        ]
        self._encoders = [fitted[rows.index(row)] if row in rows else NoEncoder() for row in joints]
        slots = [isr.RAW_ENCODERS + rows.index(row) if row in rows else 0 for row in joints]
        self.clock = MotionClock()
        self.rates = RateControl(self.clock)
        self._readings = Readings(self._sampler, self.clock, self.drives, self._encoders, slots)
        self._following = [FollowingError(row) for row in joints]
        self.inputs = Inputs(head, joints, self._sampler)
        self.feeder.connect(self.inputs, self.drives, [row["max_rate"] for row in joints])
        registers.apply(registers.PRIORITIES)
        self.limits = [{name: row[name] for name in _LIMITS} for row in joints]
        self._pulse_us = head["pulse_ticks"] // _TICKS_PER_US + _PULSE_SPARE_US
        self.moving = False
        self.fault = 0
        self.fault_joint = NO_JOINT
        self.known = 0

    def home(self, mask: int, steps: "list[int]") -> None:
        """The joints of ``mask`` stand at ``steps`` (one number for every joint)."""
        for number, joint in enumerate(self.drives):
            if mask >> number & 1:
                joint.declare(steps[number])
                self._encoders[number].declare(self._following[number].expected(steps[number]))
        self.known |= mask

    def drivers(self, on: int) -> None:
        """The drivers on, or off: then the arm can be moved by hand, and only its encoders know where to."""
        self.inputs.enable(on != 0)
        if not on:
            self.known = 0

    def clear(self) -> bool:
        """Clear the fault, unless its cause is still there; True where it is cleared."""
        if self.moving or self.inputs.estop_active():
            return False
        self.block[isr.FAULT] = 0
        self.fault = 0
        self.fault_joint = NO_JOINT
        return True

    def _watch_idle(self) -> None:
        """While nothing moves: follow the encoders, and look at the E-stop."""
        for encoder in self._encoders:
            encoder.update()
        if self.inputs.estop_active():
            self.inputs.trip_estop()
        self._note_trip()
        if self.block[isr.FAULT] and not self.fault:
            self._take_fault()

    def _note_trip(self) -> None:
        """A switch may have tripped: know of it, and that an E-stop released the drivers."""
        if self.inputs.note_trip() and self.inputs.releases:
            self.known = 0

    def _take_fault(self) -> None:
        self.fault = self.block[isr.FAULT]
        self.fault_joint = self.block[isr.FAULT_JOINT]
