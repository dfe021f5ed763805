"""The meshes of a URDF's links, each in the frame of its row in the arm file."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.kinematics import all_frames
from armtempo.new_arm import urdf_bodies
from armtempo.new_arm.urdf_chain import MM, Chain
from armtempo.new_arm.urdf_fitting import Fit
from armtempo.new_arm.urdf_rows import geometry
from armtempo.planning.capsules import point_distance


def of_rows(chain: Chain, fit: Fit, urdf: Path) -> dict[int, Array]:
    """Triangles (N, 3, 3) in mm of each row with a mesh; key 0: the base.

    Raises InputError for a mesh that cannot be read.
    """
    frames = all_frames(geometry(fit.rows), [0.0] * len(fit.rows))
    row_of = {row.joint: number for number, row in enumerate(fit.rows, 1) if row.joint is not None}
    found: dict[int, list[Array]] = {}
    for joint, links in enumerate(_links(chain), -1):
        row = row_of.get(joint, 0)
        to_row = np.linalg.inv(frames[row])
        for corners_mm in _corners(chain, urdf, links):
            found.setdefault(row, []).append(corners_mm @ to_row[:3, :3].T + to_row[:3, 3])
    return {row: np.concatenate(parts) for row, parts in found.items()}


def radii_mm(chain: Chain, fit: Fit, urdf: Path) -> dict[int, float]:
    """Radii of rows, from 1, about whose d and a the links' shapes for collision are, or those that are seen.

    A triangle is within a capsule if its corners are; constant rows carry what the one before them does. A sliding
    joint's d is taken where it is shortest. Rows without shapes are left out. Raises InputError for a mesh that
    cannot be read.
    """
    frames = all_frames(geometry(fit.rows), [0.0] * len(fit.rows))
    found: dict[int, float] = {}
    for joint, links in enumerate(_links(chain)[1:]):
        moved = chain.joints[joint]
        first = next(number for number, row in enumerate(fit.rows) if row.joint == joint)
        rows = [
            first,
            *itertools.takewhile(lambda n: fit.rows[n].joint is None, range(first + 1, len(fit.rows))),
        ]
        for corners_mm in _corners(chain, urdf, links, collision=True):
            away = []
            for row in rows:
                begin, end = frames[row][:3, 3], frames[row + 1][:3, 3]
                axis, d_mm = frames[row][:3, 2], fit.rows[row].d_mm
                turn = begin + d_mm * axis
                if row == first and moved.slides:  # the shapes go with the end of its d
                    low, high = moved.range_deg
                    begin = turn - np.clip(0.0, d_mm + low, d_mm + high) * axis
                away += [_farthest(corners_mm, *each) for each in ((begin, turn), (turn, end))]
            nearest = np.argmin(away, axis=0)
            for number, corners in enumerate(away):
                far = float(corners[nearest == number].max(initial=0.0))
                row = rows[number // 2] + 1
                found[row] = max(far, found.get(row, 0.0))
    return found


def _farthest(corners_mm: Array, begin: Array, end: Array) -> Array:
    """Distance of the farthest corner of triangles (N, 3, 3) from a segment: (N,)."""
    found = point_distance(corners_mm.reshape(-1, 3), begin[None], (end - begin)[None])
    return np.asarray(found.reshape(-1, 3).max(axis=1))


def _links(chain: Chain) -> list[set[str]]:
    """Names of the links that move with the base, then with each joint."""
    joints = {joint.name: joint for joint in chain.model.robot.joints}
    moving = [joints[joint.name] for joint in chain.joints]
    of_joints = [
        urdf_bodies.links(chain.model, joint.child, after)
        for joint, after in zip(moving, [*moving[1:], None], strict=True)
    ]
    return [urdf_bodies.links(chain.model, chain.base, moving[0]), *of_joints]


def _corners(chain: Chain, urdf: Path, links: set[str], collision: bool = False) -> Any:
    """The triangles of each shape of the links, all joints at 0, (N, 3, 3) in mm, in the base's frame.

    Those that are seen; with ``collision`` those for that, of links that have some.
    """
    chain.model.update_cfg({joint.name: 0.0 for joint in chain.joints})
    for link in chain.model.robot.links:
        if link.name not in links:
            continue
        for part in (collision and link.collisions) or link.visuals:
            origin = np.eye(4) if part.origin is None else part.origin
            pose = chain.model.get_transform(link.name, chain.base) @ origin
            corners = np.asarray(_shape(part.geometry, urdf).triangles, dtype=float)
            yield MM * (corners @ pose[:3, :3].T + pose[:3, 3])


def _shape(given: Any, urdf: Path) -> Any:
    """A trimesh, in m."""
    import trimesh
    from yourdfpy.urdf import filename_handler_magic

    if given.box is not None:
        return trimesh.creation.box(given.box.size)
    if given.cylinder is not None:
        return trimesh.creation.cylinder(given.cylinder.radius, given.cylinder.length)
    if given.sphere is not None:
        return trimesh.creation.icosphere(2, given.sphere.radius)
    name = given.mesh.filename
    try:
        mesh: Any = trimesh.load_mesh(filename_handler_magic(name, str(urdf.parent)), process=False)
        mesh.apply_scale(1.0 if given.mesh.scale is None else given.mesh.scale)
        if not len(mesh.faces) or not np.isfinite(mesh.vertices).all():
            raise ValueError("it has no triangles")
    except Exception as error:  # each of trimesh's readers raises its own
        raise InputError(
            f"{urdf}: mesh {name!r} cannot be read: {type(error).__name__}: {error}",
            "put the file there (package:// is searched for in the folders above), or leave --meshes out",
        ) from None
    return mesh
