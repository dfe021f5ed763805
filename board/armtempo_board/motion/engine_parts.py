"""The parts of an engine for one arm, made from its record: hardware and joint drives."""

from armtempo_shared import armrecord
from micropython import const

from armtempo_board import features
from armtempo_board.hardware import isr, registers
from armtempo_board.hardware.encoders import EncoderInput, NoEncoder
from armtempo_board.hardware.inputs import Inputs
from armtempo_board.motion.clock import MotionClock
from armtempo_board.motion.engine_memory import EngineMemory
from armtempo_board.motion.following_error import FollowingError
from armtempo_board.motion.joint_drive import JointDrive
from armtempo_board.motion.rate_control import RateControl
from armtempo_board.motion.readings import Readings

TYPE_CHECKING = False
if TYPE_CHECKING:
    from armtempo_board.hardware.sampler import Sampler
    from armtempo_board.memory import Memory

    Rows = list[dict[str, int]] | tuple[()]

_PULSE_SPARE_US = const(5)
_TICKS_PER_US = const(84)
# fields of a joint's row in the arm record that are needed later
_LIMITS = (
    "min_steps",
    "max_steps",
    "max_rate",
)


class EngineParts:
    """``head`` and ``joints``: from ``armrecord.unpack``. Nothing moves, drivers are off.

    ``engine_memory``: memory taken over from the engine before; raises MemoryError if it is too small.
    ``backlash``: from ``armrecord.unpack_backlash``.
    """

    def __init__(
        self,
        head: "dict[str, int]",
        joints: "list[dict[str, int]]",
        engine_memory: EngineMemory,
        backlash: "Rows" = (),
    ) -> None:
        self.feeder = engine_memory.feeder
        self.is_short = engine_memory.is_short
        rows = [row for row in joints if row["encoder"] != armrecord.NONE]
        fitted = [EncoderInput(row["encoder"], row["encoder_inverted"]) for row in rows]
        self.sampler = engine_memory.sampler
        self.sampler.configure(len(joints), tuple([encoder.address for encoder in fitted]))
        self.block = self.sampler.block
        self.sampler.connect()
        registers.apply(registers.CLOCKS)
        registers.apply(registers.TIMERS)
        rings = engine_memory.rings([row["max_rate"] for row in joints])
        arm = head, joints
        self.clock = MotionClock()
        self.rates = RateControl(self.clock, len(joints))
        self.drives = [
            _drive(n, arm, self.sampler, ring, engine_memory.memory, backlash, self.rates)
            for n, ring in enumerate(rings)
        ]
        self.encoders = [fitted[rows.index(row)] if row in rows else NoEncoder() for row in joints]
        slots = [isr.RAW_ENCODERS + rows.index(row) if row in rows else 0 for row in joints]
        self.readings = Readings(self.sampler, self.clock, self.drives, self.encoders, slots)
        self.following = [FollowingError(row) for row in joints]
        self.inputs = Inputs(head, joints, self.sampler)
        self.feeder.connect(self.inputs, self.drives, [row["max_rate"] for row in joints])
        registers.apply(registers.PRIORITIES)
        self.limits = [{name: row[name] for name in _LIMITS} for row in joints]
        self.pulse_us = head["pulse_ticks"] // _TICKS_PER_US + _PULSE_SPARE_US


def _drive(
    number: int,
    arm: "tuple[dict[str, int], list[dict[str, int]]]",
    sampler: "Sampler",
    ring: "memoryview",
    memory: "Memory",
    backlash: "Rows",
    rates: RateControl,
) -> JointDrive:
    if features.BACKLASH:  # noqa: SIM102  the core is without what is behind a constant alone
        if backlash and backlash[number]["steps"]:
            # here, as few arms need its memory
            from armtempo_board.motion.backlash_drive import BacklashDrive

            return BacklashDrive(number, arm, sampler, ring, memory, backlash[number], rates)
    return JointDrive(number, arm, sampler, ring, memory)
