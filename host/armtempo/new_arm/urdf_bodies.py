"""Masses of a URDF: the links that move with each joint of a chain as one body."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.kinematics.dynamics import as_one
from armtempo.model.parts import Dynamics

_MM = 1000.0


class Body(NamedTuple):
    """Links that move together, at joint angles 0, in the base link's frame; and the friction of their joint."""

    mass_kg: float
    centre_mm: Array
    """(3,)."""
    inertia_kg_m2: Array
    """(3, 3), about the centre."""
    friction_nm: float
    viscous_nm_s: float

    def in_frame(self, frame: Array) -> Dynamics:
        """The body in a frame (4, 4), mm, given in the base link's frame."""
        turn = frame[:3, :3].T
        x, y, z = turn @ (self.centre_mm - frame[:3, 3])
        tensor = turn @ self.inertia_kg_m2 @ turn.T
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = tensor
        return Dynamics(
            self.mass_kg, (x, y, z), (xx, yy, zz, xy, xz, yz), self.friction_nm, self.viscous_nm_s
        )


def of_joint(model: Any, base: str, joint: Any, after: Any) -> Body | None:
    """The links that turn with a joint but not with the one ``after`` it in the chain; fingers at 0.

    None if the URDF has no mass for them. Raises InputError for values that no body has.
    """
    parts = [*_parts(model, base, links(model, joint.child, after))]
    if not parts:
        return None
    mass = sum(part[0] for part in parts)
    centre, inertia = as_one(mass, parts)
    try:
        friction, viscous = (
            float(getattr(joint.dynamics, key, None) or 0.0) for key in ("friction", "damping")
        )
    except ValueError:
        friction = viscous = np.nan
    figures = [mass, *centre, *inertia.flat, friction, viscous]
    if not np.all(np.isfinite(figures)) or min(mass, friction, viscous) < 0.0:
        raise InputError(
            f"joint {joint.name!r}: a mass, an inertia or the friction of what it moves is no such number",
            "correct <inertial> and <dynamics> there in the URDF",
        )
    return Body(mass, _MM * centre, inertia, friction, viscous)


def links(model: Any, first: str, after: Any) -> set[str]:
    """Names of a link and of all its descendants, except those of joint ``after``."""
    found, names = set(), [first]
    while names:
        name = names.pop()
        found.add(name)
        names += [each.child for each in model.robot.joints if each.parent == name and each is not after]
    return found


def _parts(model: Any, base: str, names: set[str]) -> Any:
    """Mass, centre of mass (3,) in m and inertia about it (3, 3) of each link that has a mass, in the base's frame."""
    for link in model.robot.links:
        if link.name not in names or link.inertial is None or not link.inertial.mass:
            continue
        origin = np.eye(4) if link.inertial.origin is None else link.inertial.origin
        tensor = np.zeros((3, 3)) if link.inertial.inertia is None else link.inertial.inertia
        place = model.get_transform(link.name, base) @ origin
        yield link.inertial.mass, place[:3, 3], place[:3, :3] @ tensor @ place[:3, :3].T
