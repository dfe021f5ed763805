"""The arm: geometry, limits, drives and encoders, and the file that describes it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path

from armtempo.basics import json_codec, toml_table
from armtempo.basics.arguments import checked, checked_fields
from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.basics.text import did_you_mean
from armtempo.basics.toml_table import Table
from armtempo.model import (
    boards,
    drive_limits,
    home_switches,
    outputs_file,
    parts_file,
    pin_use,
    posture,
    shipped,
    transmission,
    workspace,
)
from armtempo.model import frame as frames_of
from armtempo.model import pallet as pallets_of
from armtempo.model import posture as named
from armtempo.model import tool as tool_of
from armtempo.model.frame import ArmFrame
from armtempo.model.joint_unit import PositionTexts
from armtempo.model.outputs import Input, Output
from armtempo.model.pallet import ArmPallet
from armtempo.model.parts import NOTHING, PROGRAM, DrivenJoint, Driver, Joint, Limits, Load, Motor, Safety
from armtempo.model.posture import ArmPosture
from armtempo.model.tool import ArmTool
from armtempo.model.tool_pose import Pose
from armtempo.model.transmission import Transmission
from armtempo.model.workspace import Workspace

_REACHES_MM = 1e-6
STILL_DEG = 0.01
"""A joint with a range at most this wide is a constant row of the table, such as a tool's."""


@checked
@checked_fields
@dataclass(frozen=True)
class Arm:
    """An arm; ``source``: the file that it was read from."""

    name: str
    joints: tuple[Joint, ...]
    driver: Driver = field(default_factory=Driver)
    safety: Safety = field(default_factory=Safety)
    source: str = ""
    board: str = field(default=boards.DEFAULT, metadata=json_codec.ADDED)
    """Name in ``boards.BOARDS``."""
    outputs: tuple[Output, ...] = field(default=(), metadata=json_codec.ADDED)
    """In the order of the file, which is also the order on the board."""
    inputs: tuple[Input, ...] = field(default=(), metadata=json_codec.ADDED)
    postures: tuple[ArmPosture, ...] = field(default=(), metadata=json_codec.ADDED)
    """In the order of the file; not sent to the board."""
    workspace: Workspace | None = field(default=None, metadata={**json_codec.ADDED, json_codec.KEY: "room"})
    """The space in which it may move; not sent to the board."""
    loads: tuple[Load, ...] = field(default=(), metadata=json_codec.ADDED)
    """What its tool may hold; the board knows nothing of them."""
    payload: Load | None = field(default=None, metadata={**json_codec.ADDED, json_codec.KEY: "held"})
    """What it holds; see ``holding``."""
    homing: tuple[tuple[str, ...], ...] = field(default=(), metadata=json_codec.ADDED)
    """Names of the joints in the order of homing, joints of an entry together; the other joints follow one by one."""
    coupling: transmission.Matrix = field(default=(), metadata=json_codec.ADDED)
    """Angles of the motors behind their gears (rows) by those of the driven joints (columns); (): each turns its own
    joint."""
    frames: tuple[ArmFrame, ...] = field(default=(), metadata=json_codec.ADDED)
    """Frames of what is around it; not sent to the board."""
    tools: tuple[ArmTool, ...] = field(default=(), metadata=json_codec.ADDED)
    """What may be on it; the board knows nothing of them."""
    pallets: tuple[ArmPallet, ...] = field(default=(), metadata=json_codec.ADDED)
    """What is around it with many places; not sent to the board."""
    tool: ArmTool | None = field(default=None, metadata=json_codec.ADDED)
    """What is on it, so that poses are of its point; None: they are of the frame after the last row. See
    ``with_tool``."""

    def __post_init__(self) -> None:
        """Raise InputError for values that a file may not have either."""
        object.__setattr__(self, "joints", tuple(self.joints))
        if not self.joints:
            raise InputError(f"arm {self.name!r} has no joints", "give at least one Joint")
        if self.board not in boards.BOARDS:
            raise InputError(
                f"arm {self.name!r}: board {self.board!r} is not known",
                f"give one of {', '.join(boards.BOARDS)}",
            )
        light = [joint.name for joint in self.joints if joint.motor is not None and joint.dynamics is None]
        if light and any(joint.dynamics for joint in self.joints):
            raise InputError(
                f"{self.source or f'arm {self.name!r}'}: no dynamics of {', '.join(light)}, but of other joints",
                "give each joint with a motor its dynamics, mass_kg = 0 for one without a mass; or none of them",
            )
        for before, joint in pairwise(self.joints):
            if before.slides and joint.parallel_linkage:
                raise InputError(
                    f"{self.source or f'arm {self.name!r}'}: {joint.name} has a parallel linkage, but {before.name} "
                    "before it slides",
                    "leave parallel_linkage out: a sliding joint does not turn the next one",
                )
        if self.coupling:
            self._check_coupling()
        where = self.source or f"arm {self.name!r}"
        frames_of.check(self.frames, where)
        pallets_of.check(self.pallets, self.frames, where)
        tool_of.check(self.tools, where)

    def _check_coupling(self) -> None:
        """Raise InputError for a coupling that is none, or for what the board cannot do with coupled joints."""
        joints = self.table_joints
        names = [joint.name for joint in joints]
        problem = transmission.coupling_problem(self.coupling, names) or transmission.board_problem(
            joints, self.homing, Transmission((1.0,) * len(joints), (), self.coupling)
        )
        if problem:
            raise InputError(f"{self.source or f'arm {self.name!r}'}: {problem[0]}", problem[1])

    @classmethod
    def of(cls, arm: Arm | Path | str) -> Arm:
        """The arm itself, or the arm of a file or name as in ``load``."""
        return arm if isinstance(arm, Arm) else cls.load(arm)

    @classmethod
    def load(cls, path: Path | str) -> Arm:
        """The arm of a TOML file, or the shipped arm of that name, such as ``"ar4"``; a file has precedence.

        At least one joint has a motor. Raises InputError, naming file, key and value, for anything missing,
        unknown or not allowed; and, naming the shipped arms, if there is neither a file nor a shipped arm.
        """
        path = shipped.find(path).path
        arm = cls.read(path)
        _check_channels(arm, path)
        for problem in pin_use.problems(arm):
            raise InputError(f"{path}: {problem.where}: {problem.what}", problem.next_step)
        _check_power_up(arm, path)
        return arm

    @classmethod
    def shape(cls, arm: Arm | Path | str) -> Arm:
        """The arm for kinematics: as ``of``, but if no joint has a motor yet, each that can move gets one."""
        if not isinstance(arm, Arm):
            path = shipped.find(arm).path
            arm = cls.read(path)
            if arm.driven_indices:
                return cls.load(path)
        if arm.driven_indices:
            return arm
        motor, limits = Motor(1, 200, 16, 1.0), Limits(1.0, 1.0, 1.0)
        moving = [
            replace(joint, motor=replace(motor, mm_per_rev=1.0 if joint.slides else None), limits=limits)
            if joint.range_deg[1] - joint.range_deg[0] > STILL_DEG
            else joint
            for joint in arm.joints
        ]
        return replace(arm, joints=tuple(moving))

    @classmethod
    def read(cls, path: Path | str) -> Arm:
        """The arm of a TOML file, even if no joint has a motor yet, or two have the same channel or pin.

        Otherwise raises InputError as ``load``.
        """
        return cls.of_table(toml_table.read(path))

    @classmethod
    def of_table(cls, top: Table) -> Arm:
        """The arm in the top table of a file, as ``read``."""
        name = top.text("name")
        driver = parts_file.driver(top.table("driver"))
        safety = parts_file.safety(top.table("safety"))
        tables = top.tables("joint")
        joints = tuple(parts_file.joint(table, number) for number, table in enumerate(tables, 1))
        board = top.choice("board", tuple(boards.BOARDS), boards.DEFAULT)
        outputs, inputs = outputs_file.outputs(top), outputs_file.inputs(top)
        postures = top.table("posture")
        frames = frames_of.read(top)
        tools = tool_of.read(top)
        pallets = pallets_of.read(top, frames)
        around = workspace.read(top, frames)
        loads = parts_file.loads(top)
        homing = parts_file.homing(top, [joint.name for joint in joints])
        driven = [joint.name for joint in joints if joint.motor is not None]
        coupling = transmission.read(top.table("coupling"), driven, [joint.name for joint in joints])
        top.done()
        arm = cls(
            name,
            joints,
            driver,
            safety,
            top.file,
            board,
            outputs,
            inputs,
            workspace=around,
            loads=loads,
            homing=homing,
            coupling=coupling,
            frames=frames,
            tools=tools,
            pallets=pallets,
        )
        if not postures:
            return arm
        return replace(arm, postures=tuple(arm.read_posture(postures, name) for name in postures.names()))

    @classmethod
    def paper(cls) -> Arm:
        """The shipped arm of the paper: its 1:5 model, three of six joints driven."""
        return cls.load(shipped.arm_path())

    @cached_property
    def table_joints(self) -> tuple[Joint, ...]:
        """The joints with a motor, in order, as the arm file has them."""
        return tuple(joint for joint in self.joints if joint.motor is not None)

    @cached_property
    def driven(self) -> tuple[DrivenJoint, ...]:
        """The joints with a motor, in order; raises InputError if one of them has no limits."""
        joints = self.table_joints
        for joint in joints:
            if joint.limits is None:
                raise InputError(
                    f"arm {self.name!r}: {joint.name} has a motor but no limits", "add a limits table"
                )
        limits = drive_limits.kept(joints, self.coupling, self.driver)
        found = [_driven(joint, kept) for joint, kept in zip(joints, limits, strict=True)]
        if not self.coupling:
            return tuple(found)
        per_deg = [joint.motor.steps_per_deg for joint in found]
        step_deg = Transmission(tuple(per_deg), (), self.coupling).step_deg.tolist()
        return tuple(
            replace(joint, step_share=step * own)
            for joint, step, own in zip(found, step_deg, per_deg, strict=True)
        )

    @cached_property
    def motors(self) -> tuple[DrivenJoint, ...]:
        """The driven joints; those that are coupled have range and limits of their motors behind the gears."""
        return transmission.motors(self.driven, self.transmission)

    @cached_property
    def crossings(self) -> tuple[drive_limits.Crossing | None, ...]:
        """How each motor crosses its backlash; None without."""
        return tuple(drive_limits.crossings(self.table_joints, self.coupling, self.driver))

    @cached_property
    def transmission(self) -> Transmission:
        """From the driven joints to their motors' steps and counts, and back."""
        return Transmission(
            tuple(joint.motor.steps_per_deg for joint in self.driven),
            tuple(joint.counts_per_deg for joint in self.driven),
            self.coupling,
        )

    @cached_property
    def driven_indices(self) -> tuple[int, ...]:
        """Indices of the joints with a motor among all joints, from 0."""
        return tuple(index for index, joint in enumerate(self.joints) if joint.motor is not None)

    def output(self, name: str) -> int:
        """The number of an output, from 0; raises InputError if the arm has no output of this name."""
        return self._number("output", name, [output.name for output in self.outputs])

    def input(self, name: str) -> int:
        """The number of an input, from 0; raises InputError if the arm has no input of this name."""
        return self._number("input", name, [entry.name for entry in self.inputs])

    def holding(self, load: str | None) -> Arm:
        """The arm with a load of its file in its tool; "nothing": with none, "" or None: unchanged.

        InputError if it has no such load.
        """
        if not load:
            return self
        if load == NOTHING:
            return replace(self, payload=None)
        return replace(
            self, payload=self.loads[self._number("load", load, [each.name for each in self.loads])]
        )

    def frame(self, name: str) -> Array:
        """The pose of a frame in the base, (4, 4); "base": the base itself. InputError if the arm has no such frame."""
        return frames_of.in_base(self.frames, name)

    def in_base(self, pose: Pose, frame: str) -> Pose:
        """A pose that is given in a frame of the arm, as jobs take it.

        Raises InputError if the arm has no such frame, or the pose gives single angles in a tilted frame.
        """
        return frames_of.pose_in_base(pose, self.frames, frame, f"arm {self.name!r}")

    def with_tool(self, name: str | None) -> Arm:
        """The arm with a tool of its file on it; "nothing": with none, "" or None: unchanged.

        InputError if it has no such tool.
        """
        if not name:
            return self
        if name == NOTHING:
            return replace(self, tool=None)
        return replace(self, tool=self.tools[self._number("tool", name, [each.name for each in self.tools])])

    def pallet(self, name: str) -> ArmPallet:
        """The pallet of that name; raises InputError if the arm has none."""
        return self.pallets[self._number("pallet", name, [each.name for each in self.pallets])]

    def _number(self, what: str, name: str, names: list[str]) -> int:
        if name in names:
            return names.index(name)
        there = f"it has {', '.join(names)}" if names else f"write a table [{what}.{name}] in its file"
        raise InputError(f"arm {self.name!r} has no {what} {name!r}{did_you_mean(name, names)}", there)

    @cached_property
    def slides(self) -> bool:
        """Whether it has a sliding joint, so that lists of its joints' positions are not all in degrees."""
        return any(joint.slides for joint in self.joints)

    @cached_property
    def texts(self) -> PositionTexts:
        """How positions of its driven joints are called and written."""
        return PositionTexts(
            tuple(joint.name for joint in self.table_joints),
            tuple(joint.unit for joint in self.table_joints),
            tuple(joint.name for joint in self.joints if joint.slides),
        )

    @property
    def all_home_deg(self) -> tuple[float, ...]:
        """The home posture of all joints, also those without a motor: degrees, (joints,)."""
        return tuple(joint.home_deg for joint in self.joints)

    @property
    def home_deg(self) -> tuple[float, ...]:
        """The home posture of the driven joints, degrees (J,)."""
        return tuple(joint.home_deg for joint in self.driven)

    def posture(self, name: str) -> ArmPosture:
        """The posture of that name, or "home"; raises InputError, with the most similar name, if there is none."""
        if name == named.HOME:
            return ArmPosture(name, self.home_deg)
        found = [posture for posture in self.postures if posture.name == name]
        if not found:
            names = [named.HOME, *(posture.name for posture in self.postures)]
            raise InputError(
                f"arm {self.name!r} has no posture {name!r}{did_you_mean(name, names)}",
                f"known: {', '.join(names)}; 'armtempo teach --posture {name}' stores the arm's present position",
            )
        return found[0]

    def read_posture(self, tables: Table, name: str) -> ArmPosture:
        """The posture ``name`` of a file's table [posture]; raises InputError if the arm cannot take it."""
        found = posture.read(tables, name, self.texts, self.frames, self.all_home_deg)
        if problem := self.posture_problem(found):
            raise InputError(
                f"{tables.file}: posture.{name}: {problem}", "give a posture that the arm can take"
            )
        return found

    def placed(self, angles_deg: Iterable[float]) -> tuple[float, ...]:
        """The driven joints' angles, (J,), those that are only by rounding beyond a range at its end.

        Raises InputError if there is not one for each joint.
        """
        angles = tuple(angles_deg)
        if len(angles) != len(self.driven):
            raise InputError(self._size_problem(len(angles)), "give one for each joint with a motor")
        return tuple(joint.placed(float(angle)) for joint, angle in zip(self.driven, angles, strict=True))

    def _size_problem(self, count: int) -> str:
        return f"{count} {self.texts.position}s, but {len(self.driven)} joints have a motor"

    def angles_problem(self, angles_deg: Iterable[float]) -> str:
        """Why the driven joints cannot be at these angles; "" if they can."""
        angles = tuple(angles_deg)
        if len(angles) != len(self.driven):
            return self._size_problem(len(angles))
        problems = (
            joint.range_problem(angle) for joint, angle in zip(self.driven, self.placed(angles), strict=True)
        )
        return next(filter(None, problems), "")

    def posture_problem(self, posture: ArmPosture) -> str:
        """What is wrong with a posture, without solving the inverse kinematics; "" for nothing."""
        if found := named.name_problem(posture.name):
            return found
        if not isinstance(posture.where, Pose):
            return self.angles_problem(posture.where)
        reach_mm = sum((joint.d_mm**2 + joint.a_mm**2) ** 0.5 for joint in self.joints)
        reach_mm += sum(max(map(abs, joint.range_deg)) for joint in self.joints if joint.slides)
        reach_mm += max((each.length_mm for each in self.tools), default=0.0)
        away_mm = sum(row[3] ** 2 for row in posture.where.matrix[:3]) ** 0.5
        if away_mm > reach_mm + posture.where.tolerance_mm + _REACHES_MM:
            return f"{away_mm:g} mm from the base, but all links together are {reach_mm:g} mm long"
        return ""


def _check_power_up(arm: Arm, path: Path) -> None:
    """Raise InputError for an arm that must not move by itself at power-up, although its file says so."""
    if arm.safety.at_power_up != PROGRAM:
        return
    where = f'{path}: safety.at_power_up = "{PROGRAM}"'
    if not arm.safety.estop_fitted:
        raise InputError(
            f"{where}: the arm would move by itself, without an E-stop that the board knows",
            "wire one and set estop_fitted = true",
        )
    try:
        home_switches.check_board_can_home(arm)
    except InputError as error:
        raise InputError(f"{where}: {error.problem}", error.hint) from None


def _driven(joint: Joint, limits: Limits) -> DrivenJoint:
    assert joint.motor is not None
    return DrivenJoint(
        joint.name,
        joint.range_deg,
        joint.home_deg,
        limits,
        joint.motor,
        joint.encoder,
        joint.switches,
        joint.model,
    )


def _check_channels(arm: Arm, path: Path | str) -> None:
    if not arm.driven:
        raise InputError(f"{path}: no joint has a motor", "add at least one [joint.motor]")
    for key, channel, joints in pin_use.shared(arm.joints):
        raise InputError(
            f"{path}: {key}.channel = {channel} is used by {' and '.join(joints)}", "give each joint its own"
        )
