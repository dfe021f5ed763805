"""The parts of an arm: joints with limits, drives, encoders and switches; the drivers' signals; safety."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import pairwise

from armtempo_shared.limits import MAX_ENCODERS, MAX_JOINTS

from armtempo.basics.arguments import checked_fields
from armtempo.basics.errors import InputError
from armtempo.formats import json_codec

Range = tuple[float, float]
MOTOR: dict[str, Range] = {
    "channel": (1, MAX_JOINTS),
    "steps_per_rev": (4, 10_000),
    "microsteps": (1, 256),
    "gear_ratio": (0.1, 10_000.0),
}
ENCODER: dict[str, Range] = {
    "channel": (1, MAX_ENCODERS),
    "counts_per_rev": (4, 10_000_000),
    "following_error_deg": (0.0, 360.0),
}
"""Least and largest value of each figure."""


Curve = tuple[tuple[float, float], ...]
CURVE = "pairs of rpm and Nm, at least two: speeds increasing from 0, no torque below 0"


def is_curve(curve: Curve) -> bool:
    """Whether pairs are a motor's torque over its speed, or none at all."""
    speeds, torques = [pair[0] for pair in curve], [pair[1] for pair in curve]
    increasing = all(after > before for before, after in pairwise(speeds))
    return len(curve) == 0 or (len(curve) > 1 and speeds[0] == 0.0 and increasing and min(torques) >= 0.0)


def _check(part: Motor | Encoder, ranges: Mapping[str, Range]) -> None:
    """InputError for a figure that no drive has."""
    for key, (least, most) in ranges.items():
        if not least <= (value := getattr(part, key)) <= most:
            raise InputError(f"{type(part).__name__}: {key} is {value:g}", f"give {least:g} to {most:g}")
    if part.direction not in (1, -1):
        raise InputError(f"{type(part).__name__}: direction is {part.direction}", "give 1 or -1")


@checked_fields
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


@checked_fields
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
    """1, or -1 if the DIR signal is inverted."""
    curve_rpm_nm: Curve = field(default=(), metadata=json_codec.ADDED)
    """Speed of its shaft and torque that it holds there; empty: not known."""

    def __post_init__(self) -> None:
        """InputError for figures that no motor has."""
        _check(self, MOTOR)
        if not is_curve(self.curve_rpm_nm):
            raise InputError(f"Motor: curve_rpm_nm is {self.curve_rpm_nm}", f"give {CURVE}")

    @property
    def steps_per_deg(self) -> float:
        """Step pulses per degree of the joint."""
        return self.steps_per_rev * self.microsteps * self.gear_ratio / 360.0


@checked_fields
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

    def __post_init__(self) -> None:
        """InputError for figures that no encoder has."""
        _check(self, ENCODER)
        if self.on not in ("joint", "motor"):
            raise InputError(f"Encoder: on is {self.on!r}", "give 'joint' or 'motor'")


@checked_fields
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


@checked_fields
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


@checked_fields
@dataclass(frozen=True)
class Dynamics:
    """What a row of the table carries, and the friction of its joint."""

    mass_kg: float
    """Of the link with all that is fixed to it: motors, the tool and what it holds."""
    centre_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Its centre of mass in the frame after the row."""
    inertia_kg_m2: tuple[float, float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    """About the centre of mass along the axes of that frame: xx, yy, zz, xy, xz, yz."""
    friction_nm: float = 0.0
    """At the joint, against its motion whatever the speed (Coulomb)."""
    viscous_nm_s: float = 0.0
    """At the joint, for a rad/s."""


@checked_fields
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
    radius_mm: float = field(default=0.0, metadata=json_codec.ADDED)
    """Of the link about its d and its a; what it holds included."""
    dynamics: Dynamics | None = field(default=None, metadata=json_codec.ADDED)


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


@checked_fields
@dataclass(frozen=True)
class Driver:
    """Timing and polarity of the signals that the stepper drivers need."""

    pulse_us: float = 2.0
    low_us: float = 2.0
    dir_setup_us: float = 5.0
    dir_hold_us: float = 5.0
    enable_active: str = "low"


@checked_fields
@dataclass(frozen=True)
class Safety:
    """E-stop input, and what the board does when it trips or the host disappears."""

    estop_fitted: bool = False
    estop_active: str = "low"
    estop_releases_enable: bool = False
    on_link_loss: str = "finish"
    """``"finish"`` the motion or ``"stop"``."""
    link_timeout_ms: int = 1000
