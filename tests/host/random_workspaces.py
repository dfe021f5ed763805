"""Random motions in random workspaces, and their distances at dense samples by code of its own.

Straight motions of arms that ship, links and loads of random radii, boxes; distances of points on the links from the
boxes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from armtempo.kinematics.chain import chains_mm
from armtempo.model.arm import Arm
from armtempo.model.parts import Load
from armtempo.model.workspace import KeepOut, Workspace
from armtempo.planning import point_to_point, workspace_check
from armtempo.splines.trajectory import Trajectory
from scipy.spatial.transform import Rotation

from tests.host.random_lines import with_random_tool

ARMS = ("parol6", "ar4", "thor", "community", "moveo", "scara", "paper")
_POINTS = 41
"""Points on a link."""


def random_workspace(seed: int) -> tuple[Arm, Trajectory]:
    """An arm in a workspace, and a motion from a posture that touches nothing."""
    rng, turns = np.random.default_rng([seed, 32]), np.random.default_rng([seed, 33])
    for _ in range(1000):
        name = ARMS[int(rng.integers(len(ARMS)))]
        arm = Arm.paper() if name == "paper" else Arm.of(name)
        low, high = np.array([joint.range_deg for joint in arm.driven]).T
        start, end = rng.uniform(low, high, (2, len(low)))
        reach = sum(abs(joint.d_mm) + abs(joint.a_mm) for joint in arm.joints)
        end = start + 0.4 * (end - start)
        boxes = []
        for number in range(int(rng.integers(1, 4))):
            links = chains_mm(arm, start + rng.random() * (end - start))[2:]
            centre = links[rng.integers(len(links))] + rng.normal(0.0, 0.1, 3) * reach
            half = rng.uniform(0.01, 0.1, 3) * reach
            axes = np.eye(4)
            if seed % 2:  # along the axes of a frame
                axes[:3, :3] = Rotation.random(random_state=turns).as_matrix()
                axes[:3, 3] = turns.normal(0.0, reach, 3)
            middle = axes[:3, :3].T @ (centre - axes[:3, 3])
            ends = tuple(middle - half), tuple(middle + half)
            boxes.append(KeepOut(f"box {number}", *ends, tuple(map(tuple, axes.tolist()))))
        radius = float(rng.choice([0.0, 0.01, 0.04])) * reach
        joints = tuple(replace(joint, radius_mm=radius) for joint in arm.joints)
        load = None
        if rng.random() < 0.5:
            figures = reach * rng.uniform(0.0, (0.05, 0.2))
            centre = tuple(map(float, 0.1 * reach * rng.uniform(-1.0, 1.0, 3)))
            load = Load("random", 0.0, *map(float, figures), "xyz"[rng.integers(3)], centre)
        arm = replace(arm, joints=joints, workspace=Workspace(tuple(boxes)), payload=load)
        if seed % 3 == 1:
            arm = with_random_tool(arm, turns)
        if not workspace_check.posture_touches(arm, start):
            return arm, point_to_point.straight("random", start, end, arm)
    raise AssertionError("no posture is free")


def dense_least(arm: Arm, trajectory: Trajectory, count: int) -> float:
    """Least distance of the links, and of what is held, from the boxes at this many times, less the radius."""
    driven = trajectory(np.linspace(0.0, trajectory.duration_s, count))
    angles = np.tile([joint.home_deg for joint in arm.joints], (count, 1)).astype(float)
    angles[:, list(arm.driven_indices)] = driven
    pose, part = np.tile(np.eye(4), (count, 1, 1)), np.linspace(0.0, 1.0, _POINTS)
    least, moved = np.inf, False
    for number, joint in enumerate(arm.joints):
        turn = angles[:, number] - (angles[:, number - 1] if joint.parallel_linkage else 0.0)
        theta, alpha = np.radians(turn + joint.theta_offset_deg), np.radians(joint.alpha_deg)
        c, s, zero = np.cos(theta), np.sin(theta), np.zeros(count)
        up = pose[:, :3, 3, None] + part * joint.d_mm * pose[:, :3, 2, None]
        out_axis = np.einsum("nij,jn->ni", pose[:, :3, :3], np.array([c, s, zero]))
        out = up[:, :, -1:] + part * joint.a_mm * out_axis[:, :, None]
        if moved:
            least = min(least, _least(arm, up) - joint.radius_mm)
        moved = moved or joint.motor is not None
        if moved:
            least = min(least, _least(arm, out) - joint.radius_mm)
        across = np.einsum("nij,jn->ni", pose[:, :3, :3], np.array([-s, c, zero]))
        z = pose[:, :3, 2].copy()
        pose[:, :3, 0] = out_axis
        pose[:, :3, 1] = np.cos(alpha) * across + np.sin(alpha) * z
        pose[:, :3, 2] = np.cos(alpha) * z - np.sin(alpha) * across
        pose[:, :3, 3] = out[:, :, -1]
    if arm.tool:
        tool = pose @ np.array(arm.tool.matrix)
        shaft = pose[:, :3, 3:] + part * (tool[:, :3, 3:] - pose[:, :3, 3:])
        least = min(least, _least(arm, shaft) - arm.tool.radius_mm)
        pose = tool
    if load := arm.payload:
        held = np.tile(np.array(load.centre_mm)[:, None], (1, _POINTS))
        held["xyz".index(load.along)] += load.length_mm * (part - 0.5)
        least = min(least, _least(arm, pose[:, :3, :3] @ held + pose[:, :3, 3:]) - load.radius_mm)
    return least


def _least(arm: Arm, points: np.ndarray) -> float:
    """Of points (N, 3, P) from all boxes; they count as 0 inside."""
    found = np.inf
    for box in (arm.workspace or Workspace()).keep_out:
        low, high, axes = np.array(box.low_mm)[:, None], np.array(box.high_mm)[:, None], np.array(box.axes)
        local = axes[:3, :3].T @ (points - axes[:3, 3:])
        away = np.maximum(np.maximum(low - local, local - high), 0.0)
        found = min(found, float(np.linalg.norm(away, axis=1).min()))
    return found
