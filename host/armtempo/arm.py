"""The arm: geometry, limits, drives and encoders, as read from its TOML file."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Limits:
    """Largest magnitudes of one joint's motion (Table 5)."""

    speed_deg_s: float
    acceleration_deg_s2: float
    jerk_deg_s3: float


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
    """Limit switch inputs of one joint: board inputs 1 to 3, or None."""

    low: int | None = None
    high: int | None = None
    active: str = "low"
    low_deg: float | None = None
    """Joint angle at which the low switch trips, for homing."""
    high_deg: float | None = None


@dataclass(frozen=True)
class JointModel:
    """What the virtual arm needs to know of one joint beyond its data sheet; ideal where 0."""

    inertia_kg_m2: float = 0.0
    """Load inertia at the joint."""
    holding_torque_nm: float = 0.0
    """Of the motor, at its shaft."""
    rotor_inertia_kg_m2: float = 0.0
    damping_nm_s: float = 0.0
    """Viscous, at the motor shaft."""
    gravity_torque_nm: float = 0.0
    """At the joint, arm horizontal."""
    backlash_deg: float = 0.0
    encoder_phase_counts: float = 0.0
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


@dataclass(frozen=True)
class Driver:
    """What the stepper drivers ask of the signals."""

    pulse_us: float = 2.0
    low_us: float = 2.0
    dir_setup_us: float = 5.0
    dir_hold_us: float = 5.0
    enable_active: str = "low"


@dataclass(frozen=True)
class Safety:
    """What the board does when something goes wrong."""

    estop_fitted: bool = False
    estop_active: str = "low"
    estop_releases_enable: bool = False
    on_link_loss: str = "finish"
    """``"finish"`` the motion or ``"stop"``."""
    link_timeout_ms: int = 1000


@dataclass(frozen=True)
class Arm:
    """A whole arm; ``source`` names the file it was read from."""

    name: str
    joints: tuple[Joint, ...]
    driver: Driver = field(default_factory=Driver)
    safety: Safety = field(default_factory=Safety)
    source: str = ""

    @property
    def driven(self) -> tuple[Joint, ...]:
        """The joints with a motor, in order: the joints of every motion."""
        return tuple(joint for joint in self.joints if joint.motor is not None)
