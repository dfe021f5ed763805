"""The shapes of a URDF's links, each in the frame of the arm file's row that it moves with."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.kinematics import all_frames
from armtempo.new_arm import urdf_bodies
from armtempo.new_arm.urdf_fitting import Fit
from armtempo.new_arm.urdf_reader import MM, Chain
from armtempo.new_arm.urdf_rows import geometry


def of_rows(chain: Chain, fit: Fit, urdf: Path) -> dict[int, Array]:
    """Triangles (N, 3, 3) in mm of each row that carries something, and 0: of the base.

    InputError for a mesh that cannot be read.
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


def _links(chain: Chain) -> list[set[str]]:
    """Names of the links that move with the base, then with each joint."""
    joints = {joint.name: joint for joint in chain.model.robot.joints}
    moving = [joints[joint.name] for joint in chain.joints]
    of_joints = [
        urdf_bodies.links(chain.model, joint.child, after)
        for joint, after in zip(moving, [*moving[1:], None], strict=True)
    ]
    return [urdf_bodies.links(chain.model, chain.base, moving[0]), *of_joints]


def _corners(chain: Chain, urdf: Path, links: set[str]) -> Any:
    """The triangles of each visible shape of the links, all joints at 0, (N, 3, 3) in mm, in the base's frame."""
    chain.model.update_cfg({joint.name: 0.0 for joint in chain.joints})
    for link in chain.model.robot.links:
        if link.name not in links:
            continue
        for visual in link.visuals:
            origin = np.eye(4) if visual.origin is None else visual.origin
            pose = chain.model.get_transform(link.name, chain.base) @ origin
            corners = np.asarray(_shape(visual.geometry, urdf).triangles, dtype=float)
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
