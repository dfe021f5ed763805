"""A board's state in the units of the arm file, as 'armtempo status' prints it.

It is sent to other programs as JSON, so it holds plain values only. It imports little, as 'armtempo stop' loads it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any

from armtempo.basics.errors import LinkError
from armtempo.model.joint_unit import DEG, MM, JointUnit

if TYPE_CHECKING:
    from armtempo.link import Client
    from armtempo.link.board_messages import Hello
    from armtempo.model.arm import Arm
    from armtempo.model.parts import DrivenJoint


@dataclass(frozen=True)
class JointState:
    """Position of one joint."""

    name: str
    """Name in the arm file; "joint N" if the arm is not known."""
    known: bool
    """Whether the position is known."""
    steps: int
    """Steps commanded, of its own motor."""
    angle_deg: float | None
    """The commanded angle; None if the arm is not known, or the joint slides."""
    counts: int
    """Encoder counts; 0 without an encoder. Of a coupled joint: of its own motor."""
    encoder_deg: float | None
    """The angle by the encoders; None without one, or if the arm is not known, or the joint slides."""
    position_mm: float | None = None
    """Of a sliding joint: the commanded position; None if the arm is not known."""
    encoder_mm: float | None = None
    """Of a sliding joint: the position by the encoders; None without one."""

    @property
    def position(self) -> float | None:
        """The commanded position in its unit; None if the arm is not known."""
        return self.angle_deg if self.position_mm is None else self.position_mm

    @property
    def by_encoder(self) -> float | None:
        """The same by the encoders; None without one too."""
        return self.encoder_deg if self.encoder_mm is None else self.encoder_mm

    @property
    def unit(self) -> JointUnit:
        """Of both."""
        return DEG if self.position_mm is None else MM


@dataclass(frozen=True)
class SequenceStand:
    """State of the running sequence or program, or of the last one since the board's start."""

    name: str
    """Of a program with the ending ``.py``."""
    ending: str
    """One of ``armtempo_shared.sequence.ENDINGS``."""
    step: int
    """Step of the sequence file, or line of the program, from 1."""
    cycle: int
    """Finished passes of its outermost repeats."""
    counters: dict[str, int]


@dataclass(frozen=True)
class ToolPlace:
    """Pose of the tool from the commanded steps, in the frame of the base."""

    position_mm: tuple[float, float, float]
    rpy_deg: tuple[float, float, float]
    """Roll, pitch and yaw: about x, then y, then z of the base."""


@dataclass(frozen=True)
class BoardState:
    """A board, the arm that it is set up for, and the arm's position."""

    port: str
    virtual: bool
    """Whether it is a virtual board."""
    board_id: str
    program_crc: int
    program_current: bool
    """Whether its program is the one installed here."""
    protocol: int
    arm_crc: int
    """Checksum of its arm record; 0 if it has none."""
    arm: str
    """Name of the arm of that record; "" if it is not known."""
    arm_source: str
    """File of that arm."""
    free_flash: int
    free_heap: int
    max_rate: int
    """Highest step rate of one joint, steps/s."""
    max_rate_sum: int
    """Highest step rate of all joints together, steps/s."""
    rates_measured: bool
    """Whether the step rates were measured by its self-test; otherwise they are estimates."""
    engine_memory: str
    """Text: which arms fit into its memory."""
    arm_problem: str
    """Why a stored arm record is not used; "" if it is used, or there is none."""
    state: str
    """One of ``armtempo_shared.messages.STATES``."""
    moving: bool
    """Whether the board may still make steps."""
    speed_percent: float
    """Requested speed in percent of the planned one; 0 in a pause."""
    rest_s: float
    """Time until the arm is at rest, after a stop given earlier or now; 0: at once."""
    fault: str
    """Name of the pending fault, "" for none."""
    frames_bad: int
    """Number of damaged messages that reached the board."""
    samples_lost: int
    joints: tuple[JointState, ...]
    sequence: SequenceStand | None
    """None if none was started since the board's start."""
    tool: ToolPlace | None = None
    """None if the arm or a position is not known."""
    said: str = ""
    """The last text that the board sent and nobody took: a program's failure, or why the button or the power-up started
    nothing."""
    erasures: dict[str, int] = field(default_factory=dict)
    """Of a virtual board: how often each sector of its flash was erased; a chip's is good for 10 000."""

    def to_json(self) -> dict[str, Any]:
        """Plain values; of each joint only those in its unit."""
        found = asdict(self)
        for joint in found["joints"]:
            turns = joint["position_mm"] is None
            for key in ("position_mm", "encoder_mm") if turns else ("angle_deg", "encoder_deg"):
                del joint[key]
        return found

    @classmethod
    def of_json(cls, values: Mapping[str, Any]) -> BoardState:
        """The state from ``to_json``; raises LinkError if another version of armtempo wrote it."""
        try:
            joints = tuple(JointState(**{**_IN_MM, **joint}) for joint in values["joints"])
            stand = SequenceStand(**values["sequence"]) if values["sequence"] else None
            tool = ToolPlace(*map(tuple, values["tool"].values())) if values["tool"] else None
            return cls(**{**values, "joints": joints, "sequence": stand, "tool": tool})
        except (TypeError, KeyError, AttributeError) as error:
            raise LinkError(
                "the program that has the port is of another version of armtempo", "end it and start it again"
            ) from error

    def named(self, arm: Arm | None) -> BoardState:
        """The state in degrees and with the joints' names, if the board is set up for ``arm``; else unchanged."""
        if arm is None or self.arm or record_crc(arm) != self.arm_crc:
            return self
        gears = arm.transmission
        known = gears.known(joint.known for joint in self.joints)
        angles = gears.angles_of_steps([joint.steps for joint in self.joints]).tolist()
        measured = gears.angles_of_counts([joint.counts for joint in self.joints]).tolist()
        joints = tuple(
            replace(
                joint,
                name=driven.name,
                known=known[number],
                **_of_unit(driven, angles[number], measured[number] if gears.measured[number] else None),
            )
            for number, (joint, driven) in enumerate(zip(self.joints, arm.driven, strict=True))
        )
        tool = _tool(arm, joints) if all(joint.known for joint in joints) else None
        return replace(self, arm=arm.name, arm_source=arm.source, joints=joints, tool=tool)


_IN_MM: dict[str, None] = {"angle_deg": None, "encoder_deg": None}
"""What ``to_json`` leaves out of a sliding joint."""


def _of_unit(joint: DrivenJoint, at: float, measured: float | None) -> dict[str, Any]:
    """The fields of a joint's positions."""
    return dict(
        zip(
            ("position_mm", "encoder_mm") if joint.slides else ("angle_deg", "encoder_deg"),
            (at, measured),
            strict=True,
        )
    )


def _tool(arm: Arm, joints: tuple[JointState, ...]) -> ToolPlace:
    from armtempo.kinematics.of_arm import forward
    from armtempo.model.pose import to_rpy_deg

    pose = forward(arm, [joint.position or 0.0 for joint in joints])
    x, y, z = (round(float(value), 3) + 0.0 for value in pose[:3, 3])
    roll, pitch, yaw = (round(value, 3) + 0.0 for value in to_rpy_deg(pose))
    return ToolPlace((x, y, z), (roll, pitch, yaw))


def read(client: Client, port: str) -> BoardState:
    """The board's present state, in steps and counts."""
    from armtempo.encoding.engine_heap import EngineHeap
    from armtempo.link.program_version import own_crc
    from armtempo.robot.running import fault_name

    info, status = client.info, client.status()
    pairs = zip(status.positions.commanded_steps, status.positions.counts, strict=True)
    return BoardState(
        port=port,
        virtual=info.virtual,
        board_id=info.board_id,
        program_crc=info.program_crc,
        program_current=info.program_crc == own_crc(),
        protocol=info.protocol,
        arm_crc=info.arm_crc,
        arm="",
        arm_source="",
        free_flash=info.free_flash,
        free_heap=info.free_heap,
        max_rate=info.max_rate,
        max_rate_sum=info.max_rate_sum,
        rates_measured=info.rates_measured,
        engine_memory=EngineHeap(info.engine_bytes).describe(),
        arm_problem=_arm_problem(info),
        state=status.state,
        moving=status.moving,
        speed_percent=status.rate / 10,
        rest_s=status.rest_ms / 1000,
        fault=fault_name(status.fault),
        frames_bad=status.frames_bad,
        samples_lost=status.samples_lost,
        joints=tuple(
            JointState(f"joint {number}", status.joint_known(number - 1), steps, None, counts, None)
            for number, (steps, counts) in enumerate(pairs, 1)
        ),
        sequence=_sequence(client),
        said=_said(client),
        erasures=_erasures(port) if info.virtual else {},
    )


def _said(client: Client) -> str:
    from armtempo.link.board_messages import Notice  # here, as 'armtempo stop' does not need it
    from armtempo.link.refusal import describe_notice

    texts = [event.text for event in client.session.events if isinstance(event, Notice)]
    return describe_notice(texts[-1]) if texts else ""


def _erasures(port: str) -> dict[str, int]:
    from armtempo.simulator.launcher import erasures  # here, as 'armtempo stop' does not need it

    return erasures(port)


def _sequence(client: Client) -> SequenceStand | None:
    found = client.sequence()
    if found.ending == "none":
        return None
    return SequenceStand(found.name, found.ending, found.step, found.cycle, client.counters())


def _arm_problem(info: Hello) -> str:
    """Why the record in the board's flash is not used."""
    if not info.arm_problem:
        return ""
    from armtempo.link.refusal import refusal

    return str(refusal("the stored arm record is not used", info.arm_problem, value=info.arm_value))


def record_crc(arm: Arm) -> int:
    """The checksum by which a board identifies an arm."""
    from armtempo_shared import wire

    from armtempo.encoding import encode

    return int(wire.record_crc(encode.arm_record(arm)))
