"""From the angles of the joints to the steps and counts of their motors, and back: gears, and coupled joints.

The angle of a motor is that of its gear's output. It is the joint's own angle; of coupled joints it is a sum of their
angles: motors = coupling x joints, as in the table ``[coupling]`` of an arm file. The board knows only motors.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.basics.text import did_you_mean
from armtempo.basics.toml_table import Table
from armtempo.model.parts import DrivenJoint, Joint, Limits

Matrix = tuple[tuple[float, ...], ...]
MOST_FACTOR = 1000.0
"""Largest factor of a joint's angle in that of a motor."""
MOST_CONDITION = 1e4
"""Condition number above which a coupling counts as singular: rounding to steps would move the joints too far."""
_NOTHING = 1e-12
"""An entry of the inverse below this fraction of its largest one is 0."""


def read(table: Table | None, driven: Sequence[str], all_names: Sequence[str]) -> Matrix:
    """The coupling of an arm file: rows of the motors, columns of the joints, of all ``driven`` ones; () without.

    A motor without a row turns its own joint. InputError for a row or an entry that is not of a driven joint.
    """
    if table is None:
        return ()
    rows = {name: [float(name == other) for other in driven] for name in driven}
    for name in table.names():
        _check_driven(table, name, driven, all_names)
        row = table.table(name)
        if row is None or not row.names():
            raise table.fail(
                name, 'the joints that its motor turns, such as { "joint 5" = 1.0, "joint 6" = 2.0 }'
            )
        for other in row.names():
            _check_driven(row, other, driven, all_names)
        rows[name] = [
            row.number(other, least=-MOST_FACTOR, most=MOST_FACTOR) if row.has(other) else 0.0
            for other in driven
        ]
    found = tuple(tuple(rows[name]) for name in driven)
    if problem := coupling_problem(found, driven):
        raise InputError(f"{table.file}: {table.place.rstrip('.')}: {problem[0]}", problem[1])
    return found if np.any(np.array(found) != np.eye(len(driven))) else ()


def _check_driven(table: Table, name: str, driven: Sequence[str], all_names: Sequence[str]) -> None:
    if name in driven:
        return
    place = f"{table.file}: {table.place}{name!r}"
    if name in all_names:
        raise InputError(
            f"{place}: this joint has no motor", "give it a [joint.motor] and limits, or leave it out"
        )
    raise InputError(
        f"{place}: no joint has this name{did_you_mean(name, driven)}",
        f"joints with a motor: {', '.join(driven)}",
    )


def coupling_problem(coupling: Matrix, names: Sequence[str]) -> tuple[str, str] | None:
    """What is wrong with a coupling of the joints of these names, and what to do; None for nothing."""
    count = len(names)
    if len(coupling) != count or any(len(row) != count for row in coupling):
        return (
            f"the coupling is not a matrix of {count} rows and columns",
            "give a row for each joint with a motor",
        )
    matrix = np.array(coupling)
    for name, row, own in zip(names, coupling, np.diag(matrix), strict=True):
        if own == 0.0:
            return (
                f"the motor of {name} does not turn {name}: {list(row)}",
                "give each joint the motor that turns it, among others",
            )
    if np.linalg.cond(matrix) > MOST_CONDITION:
        return (
            "the coupling is singular: different postures of the joints have the same motor positions",
            "check its numbers: the motors of a differential turn by the sum and the difference of two joints",
        )
    return None


@dataclass(frozen=True)
class Transmission:
    """Gears and coupling of J motors and J joints. Angles are in degrees, arrays (..., J)."""

    steps_per_deg: tuple[float, ...]
    """Step pulses of each motor per degree of its angle."""
    counts_per_deg: tuple[float, ...]
    """Encoder counts per degree of the motor's angle; 0 without an encoder."""
    coupling: Matrix = ()
    """Rows of motors, columns of joints; (): each motor turns its own joint, and angles stay bit by bit."""

    @cached_property
    def matrix(self) -> Array:
        """(J, J): angles of the motors from those of the joints."""
        return np.array(self.coupling) if self.coupling else np.eye(len(self.steps_per_deg))

    @cached_property
    def inverse(self) -> Array:
        """(J, J): angles of the joints from those of the motors."""
        if not self.coupling:
            return self.matrix
        found = np.linalg.inv(self.matrix)
        return np.where(np.abs(found) < _NOTHING * np.abs(found).max(), 0.0, found)

    @cached_property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """The joints that are coupled with each other, from 0, in order; not those that have their motor alone."""
        linked = (self.matrix != 0.0) | (self.matrix.T != 0.0)
        for _ in linked:
            linked = linked @ linked  # also those that are linked by another joint
        found = dict.fromkeys(tuple(np.flatnonzero(row).tolist()) for row in linked)
        return tuple(group for group in found if len(group) > 1)

    def group(self, joint: int) -> tuple[int, ...]:
        """The joint with those that it is coupled with."""
        return next((group for group in self.groups if joint in group), (joint,))

    def is_alone(self, joint: int) -> bool:
        """Whether a joint's angle is that of its motor, whatever other motors do."""
        return bool(np.array_equal(self.inverse[joint], np.eye(len(self.inverse))[joint]))

    def motors_deg(self, joints_deg: ArrayLike) -> Array:
        """Angles of the motors."""
        angles = np.asarray(joints_deg, dtype=float)
        return np.asarray(angles @ self.matrix.T) if self.coupling else angles

    def joints_deg(self, motors_deg: ArrayLike) -> Array:
        """Angles of the joints; NaN for those that a motor of unknown angle (NaN) turns."""
        angles = np.asarray(motors_deg, dtype=float)
        if not self.coupling:
            return angles
        parts = np.where(self.inverse != 0.0, self.inverse * angles[..., None, :], 0.0)
        return np.asarray(parts.sum(axis=-1))

    def largest_motors_deg(self, joints: ArrayLike) -> Array:
        """Bounds of the motors' magnitudes (speed, acceleration) from those of the joints."""
        values = np.asarray(joints, dtype=float)
        return np.asarray(values @ np.abs(self.matrix).T) if self.coupling else values

    def motor_loads(self, torques: Array) -> Array:
        """Torques of the motors behind their gears that do the same work as these of the joints."""
        return np.asarray(torques @ self.inverse) if self.coupling else torques

    def steps(self, joints_deg: ArrayLike) -> Array:
        """The motors' positions in steps, not rounded."""
        return np.asarray(self.motors_deg(joints_deg) * np.array(self.steps_per_deg))

    def whole_steps(self, joints_deg: ArrayLike) -> list[int]:
        """The motors' positions (J,) in steps."""
        return [round(steps) for steps in self.steps(joints_deg).tolist()]

    def angles_of_steps(self, steps: ArrayLike) -> Array:
        """The joints' angles from the motors' positions in steps."""
        return self.joints_deg(np.asarray(steps, dtype=float) / np.array(self.steps_per_deg))

    def angles_of_counts(self, counts: ArrayLike) -> Array:
        """The joints' angles from the encoders; NaN where an encoder is missing."""
        per_deg = np.array(self.counts_per_deg)
        blind = np.where(per_deg == 0.0, np.nan, per_deg)
        return self.joints_deg(np.asarray(counts, dtype=float) / blind)

    @cached_property
    def measured(self) -> tuple[bool, ...]:
        """Whether encoders give each joint's angle."""
        return tuple((~np.isnan(self.angles_of_counts(np.zeros(len(self.counts_per_deg))))).tolist())

    def known(self, motors: Iterable[bool]) -> list[bool]:
        """Whether each joint's angle is known, by the motors whose positions are."""
        angles = np.where(list(motors), 0.0, np.nan)
        return [not np.isnan(angle) for angle in self.joints_deg(angles).tolist()]

    @cached_property
    def step_deg(self) -> Array:
        """How far each joint turns at most if each motor that turns it makes a step: (J,)."""
        return self._turned(1.0 / np.array(self.steps_per_deg))

    @cached_property
    def count_deg(self) -> Array:
        """How far each joint turns at most for a count of each encoder that measures it: (J,); NaN without one."""
        per_deg = np.array(self.counts_per_deg)
        return self._turned(1.0 / np.where(per_deg == 0.0, np.nan, per_deg))

    def _turned(self, motors: Array) -> Array:
        """Bounds of the joints' magnitudes from those of the motors."""
        if not self.coupling:
            return motors
        return np.asarray(np.where(self.inverse != 0.0, np.abs(self.inverse) * motors, 0.0).sum(axis=1))

    def within(self, steps: ArrayLike, low_deg: Array, high_deg: Array) -> Array:
        """The joints' angles (J,) within these ranges that are nearest to the motors' positions in whole steps.

        A posture at the end of a range may lie between two steps of each motor, so that the angles of whole steps lie
        beyond the range, by different distances for each joint.
        """
        angles = self.angles_of_steps(steps)
        if np.all((low_deg <= angles) & (angles <= high_deg)):
            return angles
        from scipy.optimize import linprog  # here, as it is seldom needed

        count = len(angles)
        scaled = self.matrix * np.array(self.steps_per_deg)[:, None]
        here = np.asarray(steps, dtype=float)
        # unknowns: the angles' distances from ``angles``, and the largest distance in steps, which is the objective
        off = np.hstack([np.vstack([scaled, -scaled]), -np.ones((2 * count, 1))])
        rest = here - scaled @ angles
        found = linprog(
            np.eye(count + 1)[count],
            A_ub=off,
            b_ub=np.concatenate([rest, -rest]),
            bounds=[*zip(low_deg - angles, high_deg - angles, strict=True), (0.0, None)],
        )
        return np.asarray(np.clip(angles + found.x[:count], low_deg, high_deg))


# coupled joints
def board_problem(
    joints: tuple[Joint, ...], homing: tuple[tuple[str, ...], ...], gears: Transmission
) -> tuple[str, str] | None:
    """What the board cannot do with coupled joints, and what to do; None for nothing.

    It knows motors only: it compares an encoder with its own motor, and sees by the direction of one motor whether a
    joint moves towards its switch.
    """
    for number, joint in enumerate(joints):
        if gears.is_alone(number):
            continue
        others = ", ".join(joints[other].name for other in gears.group(number) if other != number)
        if joint.encoder is not None and joint.encoder.on == "joint":
            return (
                f"{joint.name} is coupled with {others}, so its encoder cannot be on the joint",
                'mount it on the motor, with on = "motor"',
            )
        if isinstance(joint.switches.low, int) or isinstance(joint.switches.high, int):
            return (
                f"{joint.name} is coupled with {others}, so its switches can be used for homing only",
                'connect them to free pins such as "PD0" instead of the inputs 1 to 3',
            )
    for group in gears.groups:
        names = {joints[number].name for number in group}
        together = next((entry for entry in homing if len(names.intersection(entry)) > 1), ())
        if together:
            listed = ", ".join(name for name in together if name in names)
            return (
                f"homing: {listed} are coupled, so they cannot be homed together",
                "list them one after the other",
            )
    return None


def motors(driven: tuple[DrivenJoint, ...], gears: Transmission) -> tuple[DrivenJoint, ...]:
    """The driven joints with range and limits of their motors behind the gears: what these reach with each joint
    anywhere in its own."""
    if not gears.coupling:
        return driven
    reached = (
        np.array([joint.range_deg for joint in driven]).T[:, None, :] * gears.matrix
    )  # (2, motors, joints)
    ranges = np.stack([reached.min(axis=0).sum(axis=1), reached.max(axis=0).sum(axis=1)], axis=1).tolist()
    limits = gears.largest_motors_deg(np.array([joint.limits.values for joint in driven]).T).T.tolist()
    return tuple(
        replace(
            joint,
            name=_motor_name(driven, row, joint),
            range_deg=tuple(span),
            limits=Limits(*most),
            step_share=1.0,
        )
        for joint, row, span, most in zip(driven, gears.coupling, ranges, limits, strict=True)
    )


def _motor_name(driven: tuple[DrivenJoint, ...], row: tuple[float, ...], own: DrivenJoint) -> str:
    others = [joint.name for joint, factor in zip(driven, row, strict=True) if factor and joint is not own]
    return f"{own.name} (its motor, which also moves {' and '.join(others)})" if others else own.name
