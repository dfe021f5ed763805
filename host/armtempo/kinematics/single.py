"""All eight solutions of one pose with floats.

It uses ``formulas`` and handles borders, singular poses and the order of the solutions. About 30 us per pose,
with numpy 200 us.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from armtempo.kinematics import formulas
from armtempo.kinematics.formulas import FLOATS
from armtempo.kinematics.shape import STRAIGHT_WRIST, Shape
from armtempo.kinematics.solutions import (
    DUPLICATE,
    ELBOW_STRETCHED,
    IN_OFFSET,
    OK,
    ON_AXIS_1,
    TOO_FAR,
    TOO_NEAR,
    WRIST_STRAIGHT,
    PoseSolutions,
)

Pair = tuple[float, float]
Three = tuple[float, float, float]
Six = tuple[float, float, float, float, float, float]
NOWHERE = (math.nan,) * 6


class _Plane(NamedTuple):
    """The tool's axes relative to the arm's plane, for one direction of the base; ``y3``: across it."""

    theta1: float
    along: Three
    y3: Three
    height: Three


def solve_pose(shape: Shape, pose: Sequence[float], previous: Sequence[float]) -> PoseSolutions:
    """Find the solutions for a pose as its 12 or 16 elements in row order.

    ``previous``, 6 Denavit-Hartenberg angles, determines the free angles of a singular pose.
    """
    n_x, o_x, a_x, p_x, n_y, o_y, a_y, p_y, n_z, o_z, a_z, p_z = pose[:12]
    x = formulas.wrist_centre(shape, n_x, o_x, a_x, p_x)
    y = formulas.wrist_centre(shape, n_y, o_y, a_y, p_y)
    z = formulas.wrist_centre(shape, n_z, o_z, a_z, p_z)
    planar = math.sqrt(x * x + y * y)
    axis = formulas.on_axis(shape, planar)
    square = 0.0 if axis else formulas.square_of_forward(shape, planar)
    found = PoseSolutions([], [], [])
    if square < 0.0:
        _leave_out(found, IN_OFFSET, 8)
        return found
    if shape.flange_twist != (1.0, 0.0):
        o_x, a_x = formulas.before_flange(shape, o_x, a_x)
        o_y, a_y = formulas.before_flange(shape, o_y, a_y)
        o_z, a_z = formulas.before_flange(shape, o_z, a_z)
    free = axis and not shape.offset
    for sign in (1.0, -1.0):
        forward = sign * math.sqrt(square)
        if free:
            cos, sin = sign * math.cos(previous[0]), sign * math.sin(previous[0])
        else:
            cos, sin = formulas.base_turn(shape, x, y, forward)
        n = formulas.in_arm_plane(cos, sin, n_x, n_y)
        o = formulas.in_arm_plane(cos, sin, o_x, o_y)
        a = formulas.in_arm_plane(cos, sin, a_x, a_y)
        theta1 = _joint(shape, 0, math.atan2(sin, cos))
        y3 = formulas.along_y3(shape, n[1]), formulas.along_y3(shape, o[1]), formulas.along_y3(shape, a[1])
        plane = _Plane(theta1, (n[0], o[0], a[0]), y3, (n_z, o_z, a_z))
        wrist = formulas.to_shoulder(shape, forward, z)
        _both_elbows(found, shape, plane, wrist, -sign * shape.sign1, previous)
    if axis:
        _mark_axis(found, shape)
    return found


def _both_elbows(
    found: PoseSolutions, shape: Shape, plane: _Plane, wrist: Pair, up_sign: float, previous: Sequence[float]
) -> None:
    """Add four solutions: elbow up and down for the wrist centre seen from the shoulder."""
    out, up = wrist
    r = math.sqrt(out * out + up * up)
    border = True
    if formulas.on_outer_border(shape, r):
        r = shape.farthest
    elif formulas.on_inner_border(shape, r):
        r = shape.nearest
    else:
        border = False
    if r > shape.farthest or r < shape.nearest:
        _leave_out(found, TOO_FAR if r > shape.farthest else TOO_NEAR, 4)
        return
    elbow, sine = formulas.triangle(FLOATS, shape, r)
    square = r * r
    for sign in (up_sign, -up_sign):
        bent = formulas.bent(shape, sign * elbow)
        if r <= shape.near:
            theta2 = previous[1]
            fore = math.cos(theta2 + bent), shape.sign1 * math.sin(theta2 + bent)
        else:
            theta2 = formulas.upper_arm(FLOATS, shape, out, up, square, sign * sine)
            fore = formulas.forearm(shape, out, up, square, sign * sine)
        theta3 = FLOATS.wrapped(shape.sign2 * bent - shape.joint_offset[2])
        arm = plane.theta1, _joint(shape, 1, theta2), theta3
        _both_wrists(found, shape, plane, fore, arm, previous[3])
    if border:
        found.outcome[-2:] = DUPLICATE, DUPLICATE
        for i in range(-4, 0):
            found.singular[i] |= ELBOW_STRETCHED


def _both_wrists(
    found: PoseSolutions, shape: Shape, plane: _Plane, fore: Pair, arm: Three, previous4: float
) -> None:
    """Add two solutions for the joint angles ``arm`` of joints 1 to 3: theta5 >= 0 and flipped."""
    cos, sin = fore
    _, along, y3, height = plane
    n = formulas.along_x3(cos, sin, along[0], height[0]), y3[0]
    o = formulas.along_x3(cos, sin, along[1], height[1]), y3[1]
    a = formulas.along_x3(cos, sin, along[2], height[2]), y3[2]
    a_z = formulas.along_z3(shape, cos, sin, along[2], height[2])
    sin5 = math.sqrt(a[0] * a[0] + a[1] * a[1])
    singular = sin5 <= STRAIGHT_WRIST
    if singular:
        a = shape.sign5 * math.cos(previous4), shape.sign5 * math.sin(previous4)
    theta4 = formulas.theta4(FLOATS, shape, *a)
    theta5 = formulas.theta5(FLOATS, shape, sin5, a_z)
    theta6 = formulas.theta6(FLOATS, shape, a, n, o)
    flipped4, flipped6 = theta4 - math.copysign(math.pi, theta4), theta6 - math.copysign(math.pi, theta6)
    plain, flipped = (*arm, theta4, theta5, theta6), (*arm, flipped4, -theta5, flipped6)
    if shape.wrist_offset:
        plain, flipped = _wrist_joints(shape, plain), _wrist_joints(shape, flipped)
    found.angles_rad.extend((plain, flipped))
    found.outcome.extend((OK, OK))
    found.singular.extend((WRIST_STRAIGHT * singular,) * 2)


def _wrist_joints(shape: Shape, posture: Six) -> Six:
    """The posture with offsets taken off its joints 4 to 6."""
    joint1, joint2, joint3, theta4, theta5, theta6 = posture
    _, _, _, offset4, offset5, offset6 = shape.joint_offset
    joint4 = math.remainder(theta4 - offset4, math.tau) if offset4 else theta4
    joint5 = math.remainder(theta5 - offset5, math.tau) if offset5 else theta5
    joint6 = math.remainder(theta6 - offset6, math.tau) if offset6 else theta6
    return joint1, joint2, joint3, joint4, joint5, joint6


def _joint(shape: Shape, index: int, theta: float) -> float:
    """The joint's angle for a Denavit-Hartenberg angle."""
    offset = shape.joint_offset[index]
    return FLOATS.wrapped(theta - offset) if offset else theta


def _leave_out(found: PoseSolutions, outcome: int, count: int) -> None:
    """Add solutions that are out of reach."""
    found.angles_rad.extend([NOWHERE] * count)
    found.outcome.extend([outcome] * count)
    found.singular.extend([0] * count)


def _mark_axis(found: PoseSolutions, shape: Shape) -> None:
    """Mark a wrist centre on axis 1, or on the border of the shoulder offset, where front and rear coincide."""
    if not shape.offset:
        found.singular[:] = [bits | ON_AXIS_1 for bits in found.singular]
        return
    found.outcome[4:] = [DUPLICATE if outcome == OK else outcome for outcome in found.outcome[4:]]
