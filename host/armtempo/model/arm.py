"""The arm: geometry, limits, drives and encoders."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from pathlib import Path

from armtempo.basics.errors import InputError
from armtempo.formats import json_codec
from armtempo.formats.spelling import did_you_mean
from armtempo.model import boards
from armtempo.model import posture as named
from armtempo.model.outputs import Input, Output
from armtempo.model.posture import ArmPosture


@dataclass(frozen=True)
class Limits:
    """Largest magnitudes of one joint's motion (Table 5)."""

    speed_deg_s: float
    acceleration_deg_s2: float
    jerk_deg_s3: float

    @property
    def values(self) -> tuple[float, float, float]:
        """Speed, acceleration, jerk."""
        return self.speed_deg_s, self.acceleration_deg_s2, self.jerk_deg_s3


@dataclass(frozen=True)
class Motor:
    """Stepper, driver and gear of one joint (Table 7)."""

    channel: int
    """STEP/DIR channel on the board, 1 to 6."""
    steps_per_rev: int
    """Full steps of the motor shaft."""
    microsteps: int
    gear_ratio: float
    """Motor revolutions per joint revolution."""
    direction: int = 1
    """1, or -1 where the DIR signal is inverted."""

    @property
    def steps_per_deg(self) -> float:
        """Step pulses per degree of the joint."""
        return self.steps_per_rev * self.microsteps * self.gear_ratio / 360.0


@dataclass(frozen=True)
class Encoder:
    """Incremental encoder of one joint."""

    channel: int
    """Encoder channel on the board, 1 to 4."""
    counts_per_rev: int
    """Counts, all edges, per revolution of the shaft it sits on."""
    on: str = "joint"
    """``"joint"`` or ``"motor"``."""
    direction: int = 1
    following_error_deg: float = 0.0
    """Largest deviation from the command, in degrees of the joint; 0: not watched."""


@dataclass(frozen=True)
class LimitSwitches:
    """Switches of one joint.

    Each is one of the board's limit switch inputs 1 to 3, where it stops what moves towards it at once; or a pin
    (``"PD0"``), which is only looked at while homing; or None.
    """

    low: int | str | None = None
    high: int | str | None = None
    active: str = "low"
    low_deg: float | None = None
    """Joint angle at which the low switch trips, for homing."""
    high_deg: float | None = None


@dataclass(frozen=True)
class JointModel:
    """What the virtual arm simulates of one joint beyond its drive."""

    holding_torque_nm: float = 0.0
    """Of the motor, at its shaft; 0: an ideal motor, which never lags."""
    rotor_inertia_kg_m2: float = 0.0
    inertia_kg_m2: float = 0.0
    """Of what the joint moves, at the joint."""
    damping_nm_s: float = 0.0
    """Viscous, of the motor shaft against its turning field."""
    corner_speed_rad_s: float = 0.0
    """Of the motor shaft; there the torque has fallen to 0.71 of the holding torque. 0: it does not fall."""
    gravity_torque_nm: float = 0.0
    """At the joint, at angle 0; falls with the angle's cosine."""
    backlash_deg: float = 0.0
    """Of the joint against its motor."""
    encoder_phase_counts: float = 0.0
    """Fraction of a count by which the encoder is beyond its last edge at power-up, 0 to 1."""
    scatter_deg: float = 0.0
    """Standard deviation between repetitions."""


@dataclass(frozen=True)
class Joint:
    """One Denavit-Hartenberg row (standard convention) and what moves it; ``motor`` None: not driven."""

    name: str
    d_mm: float
    a_mm: float
    alpha_deg: float
    theta_offset_deg: float
    range_deg: tuple[float, float]
    home_deg: float = 0.0
    limits: Limits | None = None
    motor: Motor | None = None
    encoder: Encoder | None = None
    switches: LimitSwitches = field(default_factory=LimitSwitches)
    model: JointModel = field(default_factory=JointModel)
    parallel_linkage: bool = field(default=False, metadata=json_codec.ADDED)
    """The drive stands on the link before the previous one and turns this link by a parallelogram: the angle
    is counted from that link, so it stays when the previous joint turns. The row turns by the difference."""


@dataclass(frozen=True)
class DrivenJoint:
    """A joint with a motor, and therefore with limits: the joints of every motion are of this type."""

    name: str
    range_deg: tuple[float, float]
    home_deg: float
    limits: Limits
    motor: Motor
    encoder: Encoder | None
    switches: LimitSwitches
    model: JointModel

    @property
    def steps_per_deg(self) -> float:
        """Step pulses per degree of the joint."""
        return self.motor.steps_per_deg

    @property
    def counts_per_step(self) -> Fraction:
        """Encoder counts per step pulse, exactly as the arm file's decimals say; 0 without an encoder."""
        if self.encoder is None:
            return Fraction(0)
        gear = Fraction(str(self.motor.gear_ratio))
        counts = Fraction(self.encoder.counts_per_rev)
        if self.encoder.on == "motor":
            counts *= gear
        return counts / (self.motor.steps_per_rev * self.motor.microsteps * gear)

    @property
    def counts_per_deg(self) -> float:
        """Encoder counts per degree of the joint; 0 without an encoder."""
        return float(self.counts_per_step) * self.steps_per_deg


@dataclass(frozen=True)
class Driver:
    """Timing and polarity of the signals that the stepper drivers need."""

    pulse_us: float = 2.0
    low_us: float = 2.0
    dir_setup_us: float = 5.0
    dir_hold_us: float = 5.0
    enable_active: str = "low"


@dataclass(frozen=True)
class Safety:
    """E-stop input, and what the board does when it trips or the host disappears."""

    estop_fitted: bool = False
    estop_active: str = "low"
    estop_releases_enable: bool = False
    on_link_loss: str = "finish"
    """``"finish"`` the motion or ``"stop"``."""
    link_timeout_ms: int = 1000


@dataclass(frozen=True)
class Arm:
    """An arm; ``source`` is the file that it was read from."""

    name: str
    joints: tuple[Joint, ...]
    driver: Driver = field(default_factory=Driver)
    safety: Safety = field(default_factory=Safety)
    source: str = ""
    board: str = field(default=boards.DEFAULT, metadata=json_codec.ADDED)
    """Name in ``boards.BOARDS``."""
    outputs: tuple[Output, ...] = field(default=(), metadata=json_codec.ADDED)
    """In the order of the file, which is also the board's."""
    inputs: tuple[Input, ...] = field(default=(), metadata=json_codec.ADDED)
    postures: tuple[ArmPosture, ...] = field(default=(), metadata=json_codec.ADDED)
    """In the order of the file; the board knows nothing of them."""
    homing: tuple[tuple[str, ...], ...] = field(default=(), metadata=json_codec.ADDED)
    """Names of the joints that are homed first, together those of an entry; the others follow one by one."""

    @classmethod
    def load(cls, path: Path | str) -> Arm:
        """The arm described by a TOML file, or the one of that name that ships, such as ``"ar4"``; a file wins.

        Raises InputError, naming file, key and value, for anything missing, unknown or not allowed; naming the arms
        that ship where there is neither file nor arm.
        """
        from armtempo.model import arm_file, shipped

        return arm_file.load(shipped.find(path).path)

    @classmethod
    def paper(cls) -> Arm:
        """The arm that ships with armtempo: the paper's 1:5 model, three of its six joints driven."""
        from armtempo.model import arm_file

        return arm_file.load(arm_file.default_path())

    @cached_property
    def driven(self) -> tuple[DrivenJoint, ...]:
        """The joints with a motor, in order. InputError where one of them has no limits."""
        return tuple(
            _driven(self.name, joint, joint.motor) for joint in self.joints if joint.motor is not None
        )

    @cached_property
    def driven_indices(self) -> tuple[int, ...]:
        """Where the joints with a motor stand among all joints, from 0."""
        return tuple(index for index, joint in enumerate(self.joints) if joint.motor is not None)

    def output(self, name: str) -> int:
        """The number of an output, from 0; InputError where the arm has none of this name."""
        return self._number("output", name, [output.name for output in self.outputs])

    def input(self, name: str) -> int:
        """The number of an input, from 0; InputError where the arm has none of this name."""
        return self._number("input", name, [entry.name for entry in self.inputs])

    def _number(self, what: str, name: str, names: list[str]) -> int:
        if name in names:
            return names.index(name)
        there = f"it has {', '.join(names)}" if names else f"write a table [{what}.{name}] in its file"
        raise InputError(f"arm {self.name!r} has no {what} {name!r}{did_you_mean(name, names)}", there)

    @property
    def all_home_deg(self) -> tuple[float, ...]:
        """The home posture with the joints that have no motor: degrees, (joints,)."""
        return tuple(joint.home_deg for joint in self.joints)

    @property
    def home_deg(self) -> tuple[float, ...]:
        """The home posture: an angle for each driven joint, degrees (J,)."""
        return tuple(joint.home_deg for joint in self.driven)

    def posture(self, name: str) -> ArmPosture:
        """The posture of that name, "home" among them; InputError, naming the nearest, where there is none."""
        if name == named.HOME:
            return ArmPosture(name, self.home_deg)
        found = [posture for posture in self.postures if posture.name == name]
        if not found:
            raise named.unknown(self, name)
        return found[0]


def _driven(arm: str, joint: Joint, motor: Motor) -> DrivenJoint:
    if joint.limits is None:
        raise InputError(f"arm {arm!r}: {joint.name} has a motor but no limits", "add a limits table")
    return DrivenJoint(
        joint.name,
        joint.range_deg,
        joint.home_deg,
        joint.limits,
        motor,
        joint.encoder,
        joint.switches,
        joint.model,
    )
