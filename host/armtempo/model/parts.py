"""The parts of an arm: joints with limits, drives, encoders and switches; the drivers' signals; safety."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import pairwise

from armtempo_shared.limits import MAX_ENCODERS, MAX_JOINTS

from armtempo.basics import json_codec
from armtempo.basics.arguments import checked_fields
from armtempo.basics.errors import InputError
from armtempo.basics.toml_section import check, key
from armtempo.model import joint_unit
from armtempo.model.joint_unit import DEG, JointUnit

LEVELS = ("low", "high")
PROGRAM = "program"
AT_POWER_UP = ("nothing", PROGRAM)
NOTHING = "nothing"
"""What an arm holds that holds no load."""
_LEAST_LIMIT = 0.001
_TURN_DEG = 360.0
LEAST_RATIO, MOST_RATIO = 0.1, 10_000.0
LEAST_MM_PER_REV, MOST_MM_PER_REV = 0.01, 1000.0
"""The finest screw and the largest pulley of a sliding joint."""
_MOST_US = 500.0
LIMIT_INPUTS = 3
"""The board's inputs for limit switches."""
END_STEPS = 0.01
"""An angle beyond its range by less, from rounded radians or single precision, is the end of the range."""
Curve = tuple[tuple[float, float], ...]
CURVE = "pairs of rpm and Nm, at least two: speeds increasing from 0, no torque below 0"


def is_curve(curve: Curve) -> bool:
    """Whether pairs are a valid torque curve of a motor, or empty."""
    speeds, torques = [pair[0] for pair in curve], [pair[1] for pair in curve]
    increasing = all(after > before for before, after in pairwise(speeds))
    return len(curve) == 0 or (len(curve) > 1 and speeds[0] == 0.0 and increasing and min(torques) >= 0.0)


@checked_fields
@dataclass(frozen=True)
class Limits:
    """Largest magnitudes of one joint's motion (Table 5), in its unit."""

    speed_deg_s: float = field(metadata=key("largest speed", _LEAST_LIMIT, 1e5))
    acceleration_deg_s2: float = field(metadata=key("largest acceleration", _LEAST_LIMIT, 1e7))
    jerk_deg_s3: float = field(metadata=key("largest jerk", _LEAST_LIMIT, 1e9))

    @property
    def values(self) -> tuple[float, float, float]:
        """Speed, acceleration, jerk."""
        return self.speed_deg_s, self.acceleration_deg_s2, self.jerk_deg_s3


@checked_fields
@dataclass(frozen=True)
class Motor:
    """Stepper, driver and gear of one joint (Table 7)."""

    channel: int = field(metadata=key("STEP/DIR channel of the board, each used once", 1, MAX_JOINTS))
    steps_per_rev: int = field(metadata=key("full steps of the motor shaft", 4, 10_000))
    microsteps: int = field(metadata=key("subdivision of the driver", 1, 256))
    gear_ratio: float = field(
        metadata=key(
            "motor turns for one turn of the joint; of a sliding joint for one of its screw or pulley, by default 1",
            LEAST_RATIO,
            MOST_RATIO,
        )
    )
    direction: int = field(default=1, metadata=key("-1 inverts DIR", choices=(1, -1)))
    curve_rpm_nm: Curve = field(default=(), metadata=json_codec.ADDED)
    """(Shaft speed, torque) pairs; empty: not known."""
    backlash_deg: float = field(
        default=0.0,
        metadata={
            **key(
                "play of its gear, at the joint, that the motor crosses at each reversal; 0: none", 0.0, 10.0
            ),
            **json_codec.ADDED,
        },
    )
    mm_per_rev: float | None = field(default=None, metadata=json_codec.ADDED)
    """Of a sliding joint: how far it moves for a turn of its screw or pulley behind the gear; None: the joint turns."""

    def __post_init__(self) -> None:
        """Raise InputError for values that no motor has."""
        check(self)
        if not is_curve(self.curve_rpm_nm):
            raise InputError(f"Motor: curve_rpm_nm is {self.curve_rpm_nm}", f"give {CURVE}")
        if self.mm_per_rev is not None and not LEAST_MM_PER_REV <= self.mm_per_rev <= MOST_MM_PER_REV:
            raise InputError(
                f"Motor: mm_per_rev is {self.mm_per_rev:g}",
                f"give {LEAST_MM_PER_REV:g} to {MOST_MM_PER_REV:g}",
            )

    @property
    def per_rev(self) -> float:
        """Movement of the joint for a turn behind the gear: 360 degrees, or mm_per_rev."""
        return _TURN_DEG if self.mm_per_rev is None else self.mm_per_rev

    @property
    def steps_per_deg(self) -> float:
        """Step pulses per degree of the joint, or mm of a sliding one."""
        return self.steps_per_rev * self.microsteps * self.gear_ratio / self.per_rev

    @property
    def reduction(self) -> float:
        """Degrees of the shaft per degree of the joint, which is the gear ratio, or per mm of a sliding one."""
        return self.gear_ratio * (_TURN_DEG / self.per_rev)


@checked_fields
@dataclass(frozen=True)
class Encoder:
    """Incremental encoder of one joint."""

    channel: int = field(metadata=key("encoder channel of the board, each used once", 1, MAX_ENCODERS))
    counts_per_rev: int = field(
        metadata=key("counts, all edges, for a turn of the shaft it is mounted on", 4, 10_000_000)
    )
    on: str = field(default="joint", metadata=key("the shaft it is mounted on", choices=("joint", "motor")))
    direction: int = field(default=1, metadata=key("-1 counts the other way", choices=(1, -1)))
    following_error_deg: float = field(
        default=0.0,
        metadata=key("largest deviation from the command, of the joint; 0: not watched", 0.0, 360.0),
    )

    def __post_init__(self) -> None:
        """Raise InputError for values that no encoder has."""
        check(self)


@checked_fields
@dataclass(frozen=True)
class LimitSwitches:
    """Switches of one joint.

    Each is one of the board's limit switch inputs 1 to 3, which stops a joint that moves towards it; or a pin
    (``"PD0"``), which is only read while homing; or None.
    """

    low: int | str | None = None
    high: int | str | None = None
    active: str = "low"
    low_deg: float | None = None
    """Joint angle at which the low switch trips, for homing."""
    high_deg: float | None = None

    def __post_init__(self) -> None:
        """Raise InputError for an input or a level that the board has not, or an angle that is no number."""
        for side, pin, trip_deg in (("low", self.low, self.low_deg), ("high", self.high, self.high_deg)):
            if isinstance(pin, int) and not 1 <= pin <= LIMIT_INPUTS:
                raise InputError(
                    f"LimitSwitches: {side} is {pin}",
                    f'give an input from 1 to {LIMIT_INPUTS}, or a pin such as "PD0"',
                )
            if trip_deg is not None and not math.isfinite(trip_deg):
                raise InputError(
                    f"LimitSwitches: {side}_deg is {trip_deg}", "give where it trips, or leave it out"
                )
        if self.active not in LEVELS:
            raise InputError(f"LimitSwitches: active is {self.active!r}", f"give {' or '.join(LEVELS)}")


@checked_fields
@dataclass(frozen=True)
class JointModel:
    """The virtual arm's model of one joint beyond its drive.

    The bounds are far above the values of any small arm: a value beyond them has a wrong unit or decimal point.
    """

    holding_torque_nm: float = field(
        default=0.0, metadata=key("of the motor, at its shaft; 0: an ideal motor, which never lags", 0.0, 1e3)
    )
    rotor_inertia_kg_m2: float = field(default=0.0, metadata=key("of the motor", 0.0, 1.0))
    inertia_kg_m2: float = field(default=0.0, metadata=key("of what the joint moves, at the joint", 0.0, 1e4))
    damping_nm_s: float = field(
        default=0.0, metadata=key("viscous, of the motor shaft against its turning field", 0.0, 1e3)
    )
    corner_speed_rad_s: float = field(
        default=0.0,
        metadata=key("motor speed at which the torque has fallen to 0.71; 0: it does not fall", 0.0, 1e5),
    )
    gravity_torque_nm: float = field(
        default=0.0, metadata=key("at the joint, at angle 0; falls with the cosine of its angle", -1e4, 1e4)
    )
    backlash_deg: float = field(default=0.0, metadata=key("of the joint against its motor", 0.0, 90.0))
    encoder_phase_counts: float = field(
        default=0.0, metadata=key("how far the encoder is beyond its last count at power-up", 0.0, 1.0)
    )
    scatter_deg: float = field(
        default=0.0,
        metadata=key(
            "standard deviation of the joint's offset from one motion to the next, drawn from the seed",
            0.0,
            90.0,
        ),
    )


@checked_fields
@dataclass(frozen=True)
class Dynamics:
    """Mass and inertia of a row of the table, and the friction of its joint."""

    mass_kg: float = field(
        metadata=key("of the link with all that is fixed to it: motors, the tool", 0.0, 1e3)
    )
    centre_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Its centre of mass in the frame after the row."""
    inertia_kg_m2: tuple[float, float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    """About the centre of mass along the axes of that frame: xx, yy, zz, xy, xz, yz."""
    friction_nm: float = field(
        default=0.0, metadata=key("at the joint, against its motion whatever the speed (Coulomb)", 0.0, 1e4)
    )
    viscous_nm_s: float = field(default=0.0, metadata=key("at the joint, for a rad/s", 0.0, 1e4))

    def __post_init__(self) -> None:
        """Raise InputError for values that no link has."""
        check(self)


@checked_fields
@dataclass(frozen=True)
class Load:
    """What the tool may hold: its mass, and the capsule that contains it, in the frame after the last row."""

    name: str
    mass_kg: float = field(default=0.0, metadata=key("of it", 0.0, 1e3))
    radius_mm: float = field(default=0.0, metadata=key("of the capsule that contains it", 0.0, 1e4))
    length_mm: float = field(
        default=0.0, metadata=key("of the capsule, between the centres of its ends; 0: a ball", 0.0, 1e4)
    )
    along: str = field(
        default="z", metadata=key("axis of the tool along which the capsule lies", choices=("x", "y", "z"))
    )
    centre_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Of the capsule, and of mass."""
    inertia_kg_m2: tuple[float, float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    """As of ``Dynamics``."""

    def __post_init__(self) -> None:
        """InputError for figures that nothing has."""
        check(self)
        if self.name == NOTHING:
            raise InputError(f"[load.{NOTHING}]: {NOTHING!r} means no load", "choose another name")


@checked_fields
@dataclass(frozen=True)
class Joint:
    """One Denavit-Hartenberg row (standard convention) and its drive; ``motor`` None: not driven.

    A turning joint adds its angle to ``theta_offset_deg``, a sliding one its position to ``d_mm``. The fields of a
    sliding joint and its parts that are called ``_deg`` are in mm (joint_unit.py).
    """

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
    """The drive is on the link before the previous one and turns this link by a parallelogram: the angle is
    relative to that link, so the previous joint does not change it. The row turns by the difference."""
    radius_mm: float = field(default=0.0, metadata=json_codec.ADDED)
    """Of the link about its d and its a."""
    dynamics: Dynamics | None = field(default=None, metadata=json_codec.ADDED)
    type: str = field(default=joint_unit.REVOLUTE, metadata=json_codec.ADDED)
    """Of joint_unit.TYPES."""

    def __post_init__(self) -> None:
        """InputError for a type that is none, or a motor of another one."""
        if self.type not in joint_unit.TYPES:
            raise InputError(
                f"{self.name}: type {self.type!r} is not known", f"give {' or '.join(joint_unit.TYPES)}"
            )
        if self.motor is not None and self.slides != (self.motor.mm_per_rev is not None):
            raise InputError(
                f"{self.name}: mm_per_rev is of the motor of a sliding joint, and this one is {self.type}",
                "give it to each sliding joint with a motor, and to no other",
            )
        if self.slides and self.parallel_linkage:
            raise InputError(f"{self.name}: a sliding joint has no parallel linkage", "leave it out")

    @property
    def slides(self) -> bool:
        """Whether it is a sliding joint."""
        return self.type == joint_unit.PRISMATIC

    @property
    def unit(self) -> JointUnit:
        """Of its position, limits and so on."""
        return joint_unit.of_type(self.type)


@dataclass(frozen=True)
class DrivenJoint:
    """A joint with a motor, and therefore with limits: the joints of every motion are of this type."""

    name: str
    range_deg: tuple[float, float]
    home_deg: float
    limits: Limits
    """Those of the table, or what the driver, the encoder and its backlash leave, if that is less (drive_limits.py)."""
    motor: Motor
    encoder: Encoder | None
    switches: LimitSwitches
    model: JointModel
    step_share: float = 1.0
    """How far it turns for a step of its motors, in steps of its own motor; not 1 for a coupled joint."""

    @property
    def slides(self) -> bool:
        """Whether it is a sliding joint."""
        return self.motor.mm_per_rev is not None

    @property
    def unit(self) -> JointUnit:
        """Of its position, limits and so on."""
        return joint_unit.MM if self.slides else DEG

    @property
    def moved_kg_m2(self) -> float:
        """Inertia of what it moves, by its model; a sliding joint's mass as that of a "radian" (joint_unit.py)."""
        moved = self.model.inertia_kg_m2
        return moved * (1e-3 * joint_unit.SLIDE_MM) ** 2 if self.slides else moved

    @property
    def weight_nm(self) -> float:
        """Gravity torque by its model; a sliding joint's force as the torque of a "radian"."""
        weight = self.model.gravity_torque_nm
        return weight * 1e-3 * joint_unit.SLIDE_MM if self.slides else weight

    @property
    def labelled(self) -> str:
        """Its name where a table mixes units: with the unit if that is not degrees."""
        return self.unit.labelled(self.name)

    def range_problem(self, angle_deg: float) -> str:
        """Say that a position is outside of its range; "" if it is not."""
        low, high = self.range_deg
        if low <= angle_deg <= high:
            return ""
        return f"{self.name}: {angle_deg:g} {self.unit.word} is outside of its range {low:g} to {high:g}"

    @property
    def switches_within(self) -> tuple[tuple[str, float], ...]:
        """("low" or "high", position) of each switch that stops the joint within its range."""
        low, high = self.range_deg
        ends = (
            ("low", self.switches.low, self.switches.low_deg),
            ("high", self.switches.high, self.switches.high_deg),
        )
        return tuple(
            (side, at_deg)
            for side, number, at_deg in ends
            if isinstance(number, int) and at_deg is not None and low < at_deg < high
        )

    @property
    def travel_deg(self) -> tuple[float, float]:
        """Its range, as far as a switch within it lets it go."""
        switches = dict(self.switches_within)
        low, high = self.range_deg
        return switches.get("low", low), switches.get("high", high)

    def end_of_travel(self, side: str) -> str:
        """What ends its travel on a side, "low" or "high"."""
        return f"its {side} switch" if side in dict(self.switches_within) else "the end of its range"

    @property
    def steps_per_deg(self) -> float:
        """Steps per degree of the joint: how finely it can be placed. Positions of motors: ``Arm.transmission``."""
        return self.motor.steps_per_deg / self.step_share

    def placed(self, angle_deg: float, within_steps: float = END_STEPS) -> float:
        """The angle, or the end of the range if it is beyond it by no more than ``within_steps``."""
        nearest = min(max(angle_deg, self.range_deg[0]), self.range_deg[1])
        return nearest if abs(angle_deg - nearest) * self.steps_per_deg <= within_steps else angle_deg

    @property
    def counts_per_step(self) -> Fraction:
        """Encoder counts per step pulse, exact for the arm file's decimals; 0 without an encoder."""
        if self.encoder is None:
            return Fraction(0)
        gear = Fraction(str(self.motor.gear_ratio))
        counts = Fraction(self.encoder.counts_per_rev)
        if self.encoder.on == "motor":
            counts *= gear
        return counts / (self.motor.steps_per_rev * self.motor.microsteps * gear)

    @property
    def counts_per_deg(self) -> float:
        """Encoder counts per degree of the joint, of a coupled one: of its motor behind the gear; 0 without an
        encoder."""
        return float(self.counts_per_step) * self.motor.steps_per_deg


@checked_fields
@dataclass(frozen=True)
class Driver:
    """Timing and polarity of the signals that the stepper drivers need."""

    pulse_us: float = field(default=2.0, metadata=key("least time that STEP is high", 0.1, _MOST_US))
    low_us: float = field(default=2.0, metadata=key("least time that STEP is low", 0.1, _MOST_US))
    dir_setup_us: float = field(default=5.0, metadata=key("DIR is stable before a step", 0.1, _MOST_US))
    dir_hold_us: float = field(default=5.0, metadata=key("DIR is stable after a step", 0.1, _MOST_US))
    enable_active: str = field(default="low", metadata=key("level of ENABLE with current", choices=LEVELS))

    def __post_init__(self) -> None:
        """Raise InputError for values that no driver has."""
        check(self)


@checked_fields
@dataclass(frozen=True)
class Safety:
    """E-stop input, and what the board does when it trips or the host disappears."""

    estop_fitted: bool = field(default=False, metadata=key("an E-stop is wired to its input"))
    estop_active: str = field(default="low", metadata=key("level that trips it", choices=LEVELS))
    estop_releases_enable: bool = field(
        default=False, metadata=key("it also switches the motors' current off")
    )
    on_link_loss: str = field(
        default="finish",
        metadata=key("what a motion does when the host disappears", choices=("finish", "stop")),
    )
    link_timeout_ms: int = field(
        default=1000, metadata=key("time without a message after which the host counts as lost", 200, 60_000)
    )
    at_power_up: str = field(
        default="nothing",
        metadata={
            **key("what starts by itself at power-up: the default, if it is a program", choices=AT_POWER_UP),
            **json_codec.ADDED,
        },
    )

    def __post_init__(self) -> None:
        """Raise InputError for values that the board does not know."""
        check(self)
