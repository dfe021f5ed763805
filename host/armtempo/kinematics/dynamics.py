"""Inverse dynamics of a serial arm by recursive Newton-Euler, vectorised over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.kinematics.forward import array_frames
from armtempo.kinematics.geometry import Geometry
from armtempo.model.arm import Arm
from armtempo.model.joint_unit import SLIDE_MM
from armtempo.model.parts import Dynamics, Load

GRAVITY_M_S2 = 9.80665
"""Along the base's -z."""
_M = 1e-3
"""Metres in the unit of the geometry, the millimetre."""


def joint_torques(arm: Arm, angles: Array, rates: Array, rate_changes: Array) -> Array:
    """Torque of each joint, including friction, Nm: (N, joints); a row without ``dynamics`` has no mass.

    Of a sliding joint the force, N.

    Tool and load are parts of the last link.

    ``angles``, ``rates`` and ``rate_changes`` of all joints, each (N, joints) in rad, rad/s and rad/s^2.
    Angles of a parallel linkage are relative to the link before the previous one; its rods have no mass.
    """
    bodies = [joint.dynamics or Dynamics(0.0) for joint in arm.joints]
    geometry = Geometry.of(arm)
    if arm.tool:
        bodies[-1] = _with_load(bodies[-1], Load("tool", arm.tool.mass_kg, centre_mm=arm.tool.centre_mm))
    if arm.payload:
        bodies[-1] = _with_load(bodies[-1], _on_tool(arm.payload, geometry))
    geometry = geometry.bare
    by_row = _row_torques(geometry, bodies, angles, rates, rate_changes)
    turns = np.array(geometry.turns(list(np.eye(len(bodies)))))
    friction, damping = np.array([(body.friction_nm, body.viscous_nm_s) for body in bodies]).T
    return np.asarray(by_row @ turns + friction * np.sign(rates) + damping * per_rad(arm) * rates)


def per_rad(arm: Arm) -> Array:
    """Movement of each joint for a radian of the kinematics, in rad, or m of a sliding one: (joints,)."""
    return np.array([_M * SLIDE_MM if joint.slides else 1.0 for joint in arm.joints])


def _on_tool(load: Load, geometry: Geometry) -> Load:
    """A load in the tool's frame, in the frame after the last row."""
    if not geometry.tool:
        return load
    tool = np.reshape(geometry.tool, (3, 4))
    turn = tool[:, :3]
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = turn @ inertia_matrix(load.inertia_kg_m2) @ turn.T
    x, y, z = turn @ np.array(load.centre_mm) + tool[:, 3]
    return replace(load, centre_mm=(x, y, z), inertia_kg_m2=(xx, yy, zz, xy, xz, yz))


def _with_load(link: Dynamics, load: Load) -> Dynamics:
    if not (mass := link.mass_kg + load.mass_kg):
        return link
    both = [
        (each.mass_kg, _M * np.array(each.centre_mm), inertia_matrix(each.inertia_kg_m2))
        for each in (link, load)
    ]
    centre, ((xx, xy, xz), (_, yy, yz), (_, _, zz)) = as_one(mass, both)
    x, y, z = centre / _M
    return replace(link, mass_kg=mass, centre_mm=(x, y, z), inertia_kg_m2=(xx, yy, zz, xy, xz, yz))


def as_one(mass: float, parts: Sequence[tuple[float, Array, Array]]) -> tuple[Array, Array]:
    """Centre of mass (3,) of bodies with the total ``mass``, and their inertia (3, 3) about it.

    ``parts``: mass, centre (3,) in m and inertia (3, 3) about that, of each.
    """
    centre = np.sum([own * place for own, place, _ in parts], axis=0) / mass
    inertia = np.zeros((3, 3))
    for own, place, tensor in parts:
        away = place - centre
        inertia += tensor + own * (away @ away * np.eye(3) - np.outer(away, away))
    return centre, inertia


def _row_torques(
    geometry: Geometry, bodies: Sequence[Dynamics], angles: Array, rates: Array, rate_changes: Array
) -> Array:
    """Torques about the axis of each row, without friction; of a sliding row the force along it.

    Recursive Newton-Euler (Luh, Walker, Paul 1980) with all vectors in the base's frame: speeds outwards; forces, and
    moments about the base's origin, are summed inwards.
    """
    chained = array_frames(geometry, angles)
    slides = {row for row, _ in geometry.slides}
    turning, bending = (np.stack(geometry.turns(list(each.T))) for each in (rates, rate_changes))
    spin, spin_change = np.zeros((len(angles), 3)), np.zeros((len(angles), 3))
    # Gravity as an upward acceleration of the base
    fall = np.tile([0.0, 0.0, GRAVITY_M_S2], (len(angles), 1))
    forces, moments = [], []
    for row, body in enumerate(bodies):
        before, after = chained[row], chained[row + 1]
        axis, origin = np.stack(before.z, axis=-1), _M * np.stack(before.origin, axis=-1)
        rate = turning[row, :, None] * axis
        if row in slides:
            fall = fall + _M * SLIDE_MM * (bending[row, :, None] * axis + 2.0 * np.cross(spin, rate))
        else:
            spin_change = spin_change + bending[row, :, None] * axis + np.cross(spin, rate)
            spin = spin + rate
        end = _M * np.stack(after.origin, axis=-1)
        fall = fall + _carried(end - origin, spin, spin_change)
        rotation = np.stack([np.stack(part, axis=-1) for part in after[:3]], axis=-1)
        arm = _M * rotation @ np.array(body.centre_mm)
        force = body.mass_kg * (fall + _carried(arm, spin, spin_change))
        tensor = rotation @ inertia_matrix(body.inertia_kg_m2) @ np.swapaxes(rotation, 1, 2)
        turned, changed = ((tensor @ each[:, :, None])[:, :, 0] for each in (spin, spin_change))
        forces.append(force)
        moments.append(changed + np.cross(spin, turned) + np.cross(end + arm, force))
    found = []
    force, moment = np.zeros_like(fall), np.zeros_like(fall)
    for row in reversed(range(len(bodies))):
        force, moment = force + forces[row], moment + moments[row]
        axis, origin = (np.stack(part, axis=-1) for part in (chained[row].z, chained[row].origin))
        along = force if row in slides else moment - np.cross(_M * origin, force)
        found.append(np.einsum("ni,ni->n", axis, along))
    return np.stack(found[::-1], axis=1)


def _carried(arm: Array, spin: Array, spin_change: Array) -> Array:
    """Acceleration of a point of a body at ``arm`` from its origin, relative to the origin."""
    return np.asarray(np.cross(spin_change, arm) + np.cross(spin, np.cross(spin, arm)))


def inertia_matrix(inertia: Sequence[float]) -> Array:
    """(3, 3) of xx, yy, zz, xy, xz, yz."""
    xx, yy, zz, xy, xz, yz = inertia
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
