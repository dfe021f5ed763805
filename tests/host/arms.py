"""Arms for the tests: small ones, published ones and ones drawn at random; arm files with something changed."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from armtempo.cli import main
from armtempo.kinematics import Geometry, Ranges, forward
from armtempo.kinematics.shape import Shape
from armtempo.kinematics.solver import PoseSolver
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.model.parts import Joint
from armtempo.model.pose import to_rpy_deg
from armtempo.model.tool_pose import APPROACH, WHOLE, Pose
from click.testing import CliRunner, Result

PAPER_ARM = Arm.paper()
"""Six rows, three motors."""

_DRIVE = PAPER_ARM.joints[0]


def joint(
    d_mm: float, a_mm: float, alpha_deg: float, low: float = -170.0, high: float = 170.0, driven: bool = True
) -> Joint:
    """A row of the table."""
    ends, drive = (low, high), (_DRIVE.limits, _DRIVE.motor) if driven else (None, None)
    home_deg = min(max(0.0, low), high)
    return Joint("joint", d_mm, a_mm, alpha_deg, 0.0, ends, home_deg, *drive)


def arm(name: str, *joints: Joint) -> Arm:
    """An arm of these rows, its joints numbered, each motor with a channel of its own."""
    motors = (
        replace(each.motor, channel=number) if each.motor else None for number, each in enumerate(joints, 1)
    )
    named = (
        replace(each, name=f"joint {number}", motor=motor)
        for number, (each, motor) in enumerate(zip(joints, motors, strict=True), 1)
    )
    return Arm(name, tuple(named))


def with_encoder(joint: Any, **changes: Any) -> Any:
    """A joint with these values of its encoder changed."""
    return replace(joint, encoder=replace(joint.encoder, **changes))


ONE = arm("turntable", joint(20, 150, 0))
PLANAR_2 = arm("planar 2", joint(0, 200, 0), joint(0, 150, 0))
PLANAR_3 = arm("planar 3", joint(0, 200, 0), joint(0, 150, 0), joint(0, 50, 0))
SCARA = arm("scara", joint(300, 200, 0), joint(0, 150, 180), joint(50, 0, 0))
"""Its three revolute joints."""
THREE = arm("three", joint(100, 0, 90), joint(0, 200, 0, 0, 180), joint(0, 180, 0, -150, 0))
FOUR = arm("four", *THREE.joints, joint(0, 60, 0, -100, 100))
FIVE = arm(
    "five",
    *THREE.joints[:2],
    joint(0, 180, 0, -150, 150),
    joint(0, 0, 90, -100, 100),
    joint(60, 0, 0),
)
SIX = replace(
    PAPER_ARM,
    name="six",
    joints=tuple(
        replace(each, motor=replace(_DRIVE.motor, channel=number), limits=_DRIVE.limits)
        for number, each in enumerate(PAPER_ARM.joints, 1)
        if _DRIVE.motor
    ),
)
"""The paper's arm with a motor in each joint."""
OFFSET_WRIST = replace(
    SIX,
    name="offset wrist",
    joints=tuple(replace(each, a_mm=15.0) if row == 3 else each for row, each in enumerate(SIX.joints)),
)

FITTING: list[tuple[Arm, tuple[str, ...]]] = [
    (ONE, ()),
    (PLANAR_2, ()),
    (PLANAR_3, ("yaw",)),
    (SCARA, ("yaw",)),
    (THREE, ()),
    (PAPER_ARM, ()),
    (FOUR, ("pitch",)),
    (FIVE, ("roll", "pitch")),
    (OFFSET_WRIST, WHOLE),
]
"""Arms, each with what it can be asked of the orientation to the last freedom."""


def drawn_posture(solver: PoseSolver, rng: np.random.Generator) -> np.ndarray:
    """Angles within the ranges, (joints,); joints without a motor at home."""
    driven = np.isin(np.arange(len(solver.home_rad)), solver.moving.moving)
    inside = rng.uniform(0.95 * solver.ranges.low, 0.95 * solver.ranges.high)
    return np.where(driven, inside, solver.home_rad)


def asked(pose: np.ndarray, fixed: tuple[str, ...], tolerance_mm: float = 0.1) -> Pose:
    """A target that asks of a pose (4, 4) only what ``fixed`` says."""
    if fixed == (APPROACH,):
        found = Pose.of_approach(pose[:3, 3], pose[:3, 2])
    elif fixed == WHOLE:
        found = Pose.of_matrix(pose)
    else:
        angles = dict(zip(WHOLE, to_rpy_deg(pose), strict=True))
        found = Pose.of_angles(pose[:3, 3], {name: angles[name] for name in fixed})
    return replace(found, tolerance_mm=tolerance_mm)


def toml(arm: Arm) -> str:
    """The arm as the text of an arm file: what its kinematics needs."""
    text = f'name = "{arm.name}"\n'
    for each in arm.joints:
        text += (
            f"[[joint]]\nd_mm = {each.d_mm}\na_mm = {each.a_mm}\nalpha_deg = {each.alpha_deg}\n"
            f"range_deg = {list(each.range_deg)}\nhome_deg = {each.home_deg}\n"
        )
        if each.motor:
            channel = each.motor.channel
            text += (
                f"motor = {{ channel = {channel}, steps_per_rev = 200, microsteps = 16, gear_ratio = 10.0 }}\n"
                "limits = { speed_deg_s = 50.0, acceleration_deg_s2 = 50.0, jerk_deg_s3 = 150.0 }\n"
            )
    return text


# arms of the paper's class for the tests: the paper's, published ones, and ones drawn at random


FILE = Path(__file__).parents[1] / "data" / "arms.toml"
PAPER = Geometry.of(Arm.paper())
PAPER_FULL_SIZE = Geometry(
    tuple(5 * length / 10 for length in PAPER.d),
    tuple(5 * length / 10 for length in PAPER.a),
    PAPER.alpha,
    PAPER.offset,
)
"""Table 1: five times the experimental arm, in cm."""


def _read(arm: dict[str, Any]) -> tuple[Geometry, Ranges]:
    assert arm["source"]
    low, high = np.radians(arm["range_deg"]).T
    geometry = Geometry(
        tuple(arm["d"]),
        tuple(arm["a"]),
        tuple(np.radians(arm["alpha_deg"])),
        tuple(np.radians(arm["offset_deg"])),
    )
    return geometry, Ranges(low, high)


def drawn(rng: np.random.Generator) -> Geometry:
    """Any arm of the class: signs, lengths, shoulder offsets, offsets of the joints, a tool on row 6."""
    signs = rng.choice([-1.0, 1.0], 4)
    alpha = [signs[0] * 90, rng.choice([0.0, 180.0, -180.0]), *(signs[1:] * 90), rng.uniform(-180, 180)]
    d = [*rng.uniform(-1, 1, 4), 0.0, rng.uniform(-1, 1)]
    a = [*rng.uniform(-1, 1, 3), 0.0, 0.0, rng.uniform(-1, 1)]
    return Geometry(tuple(d), tuple(a), tuple(np.radians(alpha)), tuple(rng.uniform(-np.pi, np.pi, 6)))


PUBLISHED = {name: _read(arm) for name, arm in tomllib.loads(FILE.read_text()).items()}
NAMED = {"paper": PAPER, **{name: geometry for name, (geometry, _) in PUBLISHED.items()}}
EQ_16 = np.array([[0, 0, -1, -268.202], [0, 1, 0, 0], [1, 0, 0, 217.349], [0, 0, 0, 1]])
TABLE_2 = (
    (180.0, -38.0, -52.0, 0.0, 0.0, 0.0),
    (180.0, -38.0, -52.0, 180.0, 0.0, 180.0),
    (180.0, -16.1, -91.1, 0.0, 17.3, 0.0),
    (180.0, -16.1, -91.1, 180.0, -17.3, 180.0),  # printed with theta6 = 0, a misprint
    (0.0, -93.2, -157.5, 0.0, -19.2, 180.0),
    (0.0, -93.2, -157.5, 180.0, 19.2, 0.0),
    (0.0, 168.3, 14.4, 0.0, 267.3, 180.0),
    (0.0, 168.3, 14.4, 180.0, 92.8, 0.0),
)


SHAPE = Shape.of(PAPER)


def worst_error(geometry: Geometry, angles: np.ndarray, poses: np.ndarray) -> float:
    """Largest element of forward(angles) - pose, lengths relative to the reach; NaN postures left out."""
    difference = np.abs(forward(geometry, angles) - poses[:, None])
    difference[..., :3, 3] /= geometry.reach
    return float(np.nanmax(difference))


def turned(difference: np.ndarray) -> np.ndarray:
    """Size of an angle, whole turns taken off."""
    return np.abs(np.remainder(difference + np.pi, 2 * np.pi) - np.pi)


def with_wrist_at(planar: float, up: float, turn: float = 0.0) -> np.ndarray:
    """A pose of the paper's arm with its wrist centre there and the tool pointing up."""
    pose = np.eye(4)
    pose[:3, 3] = planar * np.cos(turn), planar * np.sin(turn), SHAPE.height + up + 40.0
    return pose


# arm files with something changed, and ``armtempo check`` on them


def replaced(text: str, *changes: tuple[str, str]) -> str:
    """A text with parts of it replaced, each once."""
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    return text


def changed(tmp_path: Path, *changes: tuple[str, str], of: str = shipped.PAPER) -> Path:
    """A shipped arm file with texts replaced, each once."""
    path = tmp_path / "arm.toml"
    path.write_text(replaced(shipped.files()[of].read_text(), *changes))
    return path


def run_check(*arguments: str | Path) -> Result:
    return CliRunner().invoke(main, ["check", *map(str, arguments)])


SLIDE_AND_TURN = """
name = "lift"
[[joint]]
name = "z"
type = "prismatic"
d_mm = 10.0
a_mm = 100.0
alpha_deg = 0.0
range_mm = [0.0, 200.0]
limits = { speed_mm_s = 40.0, acceleration_mm_s2 = 200.0, jerk_mm_s3 = 2000.0 }
motor = { channel = 1, steps_per_rev = 200, microsteps = 4, mm_per_rev = 8.0 }
encoder = { channel = 1, counts_per_rev = 2000, following_error_mm = 2.0 }
[[joint]]
name = "turn"
d_mm = 0.0
a_mm = 50.0
alpha_deg = 0.0
range_deg = [-90.0, 90.0]
limits = { speed_deg_s = 90.0, acceleration_deg_s2 = 90.0, jerk_deg_s3 = 900.0 }
motor = { channel = 2, steps_per_rev = 200, microsteps = 4, gear_ratio = 20.0 }
"""
"""A joint that slides, and one that turns on it."""
GRIPPER = """
[output.gripper]
kind = "servo"
pin = "PB8"
pulse_us = [500, 2500]
angles_deg = [0, 180]
states = { open = 20.0, closed = 95.0 }
safe = "open"
"""
PUMP = '\n[output.pump]\nkind = "switch"\npin = "PD0"\nactive = "low"\n'
FAN = '\n[output.fan]\nkind = "pwm"\npin = "PB9"\nfrequency_hz = 20000\nstates = { slow = 0.25 }\n'
PART = '\n[input.part]\npin = "PD1"\n'
DOOR = '\n[input.door]\npin = "PD3"\nactive = "high"\ndebounce_ms = 0\n'
ALL = GRIPPER + PUMP + FAN + PART + DOOR


def write(folder: Path, *tables: str, board: str = "", like: str = "paper") -> Path:
    """A shipped arm's file with these tables after it."""
    path = folder / "arm.toml"
    head = f'board = "{board}"\n' if board else ""
    text = shipped.find(like).path.read_text(encoding="utf-8")
    path.write_text("".join((head, text, *tables)), encoding="utf-8")
    return path


def load(folder: Path, *tables: str, board: str = "") -> Arm:
    """The same, read."""
    return Arm.load(write(folder, *tables, board=board))
