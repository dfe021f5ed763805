"""The arm in 3-D: links as capsules, via points, the tool's path, a ghost at the target."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from nicegui import ui
from nicegui.elements.scene.scene_object3d import Object3D
from nicegui.events import SceneClickEventArguments

from armtempo.basics.arrays import Array
from armtempo.kinematics.chain import all_angles_deg, outline_mm
from armtempo.kinematics.forward import all_frames
from armtempo.kinematics.geometry import Geometry
from armtempo.kinematics.of_arm import forward
from armtempo.model import mesh_files
from armtempo.model.arm import Arm
from armtempo.model.workspace import FAR_MM
from armtempo.panel import words
from armtempo.planning.workspace_check import Bodies

COLOUR, JOINT, VIA, TOOL, OBSTACLE = "#4477aa", "#78818c", "#a88400", "#228833", "#c2559a"
WAY, RUN, DIAL = "#1f8fb8", "#ee6677", "#888888"
AXES = ("#e0333f", "#22913a", "#3b78f0")
"""All of these are seen on a light page and on a dark one: the contrast is 3 to 1 or more."""
GHOST = ("#222222", "#eeeeee")
"""Of the ghost, which is seen through: on a light page, on a dark one."""
GHOST_OPACITY = 0.55
_THICK = (0.042, 0.016)
"""Radii of the first and the last link of an arm whose file gives none, as fractions of its reach."""
_HOUSING = (1.3, 1.2)
"""Radius, and half the length, of a joint's housing, by the radius of its link."""
_DOT = 0.022
"""Radius of a via point's ball."""
_SHORT_MM = 1e-6
_OPPOSITE = 1e-9
_OBSTACLE_OPACITY = 0.3
"""Of the faces of a box, whose edges are opaque."""
_SHOWN = 1.2
"""Size of the displayed walls, as a fraction of the arm's reach."""
_VIA_NAME = "via "
FOLLOW = "follow"
"""The view that keeps the tool in the middle."""
EYES = {"side": (0.0, -1.4, 0.25), "top": (0.0, -0.001, 1.6), "free": (0.7, -0.85, 0.6)}
"""Where the views look from, from the arm's middle; from above x is to the right and y up."""
_NEAR = 0.6
"""An arm whose home posture reaches further from what they look at is looked at from further away."""
TARGET = (0.0, 0.0, 0.15)
"""What they look at, from there."""
SLOW_TO_FAST = ((0.25, 0.42, 0.80), (0.13, 0.55, 0.35), (0.70, 0.50, 0.05), (0.87, 0.20, 0.28))
"""Colours of a path, sRGB, seen on light and dark as well: blue where it is slow, red where it is fastest."""


class Obstacle(NamedTuple):
    """A box to keep out of, or a wall, which is flat, in parts of the arm's reach."""

    low: Array
    """Its least corner, (3,), along ``axes``."""
    high: Array
    axes: Array
    """Its frame in the base, (4, 4)."""


class ArmShape:
    """Poses of an arm's parts at joint angles; lengths as fractions of the reach about ``middle``."""

    def __init__(self, arm: Arm) -> None:
        self.arm = arm
        self.reach_mm = sum(abs(joint.d_mm) + abs(joint.a_mm) for joint in arm.joints)
        middle_mm = np.zeros(3)
        frames = all_frames(self._geometry, np.radians(all_angles_deg(arm, np.array(arm.home_deg))).tolist())
        turns = False
        for row, joint in enumerate(arm.joints):
            low, high = joint.range_deg
            turns |= row in arm.driven_indices and not joint.slides
            if joint.slides and not turns:  # it carries the whole arm to and fro
                self.reach_mm += (high - low) / 2
                middle_mm += frames[row][:3, 2] * (low + high) / 2
            elif joint.slides:
                self.reach_mm += max(abs(low), abs(high))
        self.reach_mm = self.reach_mm or 1.0
        self.middle = middle_mm / self.reach_mm
        """What the arm's base is next to when each rail that carries it is in the middle of its range, (3,)."""

    def eye(self, view: str) -> Array:
        """Where a view looks from, (3,), so that the home posture is in it."""
        target = self.middle + TARGET
        away = np.linalg.norm(self.outline(np.array(self.arm.home_deg)) - target, axis=1).max()
        found: Array = target + max(1.0, away / _NEAR) * (np.array(EYES[view]) - TARGET)
        return found

    def outline(self, angles_deg: Array) -> Array:
        """Points of the arm's line, (K, 3), for driven angles (J,)."""
        return outline_mm(self.arm, all_angles_deg(self.arm, np.asarray(angles_deg))) / self.reach_mm

    @cached_property
    def meshes(self) -> dict[int, Path]:
        """STL files in mm by the number of the row that they move with, 0 for the base."""
        return mesh_files.of_arm(self.arm)

    @cached_property
    def _geometry(self) -> Geometry:
        return Geometry.of(self.arm).bare  # a tool is drawn by itself

    def dials(self, angles_deg: Array) -> list[list[float]]:
        """For each driven joint 10 numbers: centre, directions of its zero and of its axis, angle in rad.

        A sliding joint has no dial: all its numbers are 0.
        """
        angles_rad = np.radians(all_angles_deg(self.arm, np.asarray(angles_deg)))
        poses = all_frames(self._geometry, angles_rad.tolist())
        found = []
        for joint in self.arm.driven_indices:
            if self.arm.joints[joint].slides:
                found.append([0.0] * 10)
                continue
            axis, now, angle = poses[joint, :3, 2], poses[joint + 1, :3, 0], angles_rad[joint]
            zero = now * np.cos(angle) - np.cross(axis, now) * np.sin(angle)
            numbers = (*poses[joint, :3, 3] / self.reach_mm, *zero, *axis, angle)
            found.append([round(float(number), 5) for number in numbers])
        return found

    def tool(self, angles_deg: Array) -> dict[str, Any]:
        """The tool that is on the arm, for the page's script: its name, "" for none, its frame as ``_columns``, where
        it begins and its radius."""
        tool = self.arm.tool
        pose = forward(self.arm, np.asarray(angles_deg))
        flange = pose if tool is None else pose @ np.linalg.inv(tool.matrix)
        radius_mm = tool.radius_mm if tool is not None and tool.radius_mm else _THICK[1] * self.reach_mm / 2
        return {
            "name": "" if tool is None else words.plain(tool.name),
            "frame": self._columns(pose),
            "from": (flange[:3, 3] / self.reach_mm).round(5).tolist(),
            "radius": round(radius_mm / self.reach_mm, 5),
        }

    def frames(self) -> list[tuple[str, list[float]]]:
        """The names of the arm's frames, and each as ``_columns``."""
        return [(words.plain(one.name), self._columns(self.arm.frame(one.name))) for one in self.arm.frames]

    def _columns(self, pose: Array) -> list[float]:
        """A frame for the page's script: directions of its x, y and z, then its place, 12 numbers."""
        columns = pose[:3].T / np.array([[1.0], [1.0], [1.0], [self.reach_mm]])
        found: list[float] = columns.ravel().round(5).tolist()
        return found

    @cached_property
    def pieces(self) -> list[tuple[int, float, float]]:
        """Index in the outline, length and radius of each link; without links of length 0."""
        radii = self._radii
        points = self.outline(np.array(self.arm.home_deg))
        lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
        for row, (low, high) in self._rails.items():
            lengths[2 * row] = high - low
        return [
            (index, float(length), radii[index])
            for index, length in enumerate(lengths)
            if length * self.reach_mm > _SHORT_MM
        ]

    @cached_property
    def _rails(self) -> dict[int, tuple[float, float]]:
        """Of each sliding joint, by its row: where its frame can be along its axis, which is drawn as its link."""
        return {
            row: (
                (joint.d_mm + joint.range_deg[0]) / self.reach_mm,
                (joint.d_mm + joint.range_deg[1]) / self.reach_mm,
            )
            for row, joint in enumerate(self.arm.joints)
            if joint.slides
        }

    @cached_property
    def _radii(self) -> list[float]:
        """Of each segment of the outline, two for each row: the arm file's, else thinner from row to row."""
        given = Bodies(self.arm).radius_mm / self.reach_mm
        rows = np.minimum(np.arange(len(given)) // 2, len(self.arm.joints) - 1)
        usual = np.interp(rows, (0, max(1, len(self.arm.joints) - 1)), _THICK)
        found: list[float] = np.where(given > 0.0, given, usual).tolist()
        return found

    @cached_property
    def housings(self) -> list[tuple[float, float]]:
        """Radius and length of the cylinder about the axis of each driven joint."""
        radius, half = _HOUSING
        links = [self._radii[2 * joint] for joint in self.arm.driven_indices]
        return [(radius * link, 2 * half * radius * link) for link in links]

    @property
    def workspace(self) -> list[Obstacle]:
        """The boxes to keep out of, and the walls."""
        found = []
        for box in Bodies(self.arm).obstacles:
            low, high = np.array(box.low_mm), np.array(box.high_mm)
            below, above = low <= -FAR_MM, high >= FAR_MM
            low, high = np.where(below & ~above, high, low), np.where(above & ~below, low, high)
            axes = np.array(box.axes)
            axes[:3, 3] /= self.reach_mm
            seen = axes[:3, :3].T @ (self.middle - axes[:3, 3])
            low, high = np.clip(np.array((low, high)) / self.reach_mm, seen - _SHOWN, seen + _SHOWN)
            found.append(Obstacle(low, high, axes))
        return found

    def poses(self, angles_deg: Array) -> list[list[float]]:
        """x, y, z and the quaternion x, y, z, w of the middle of each piece, then of each housing, their y axes along
        them, then of each mesh."""
        frames = all_frames(
            self._geometry, np.radians(all_angles_deg(self.arm, np.asarray(angles_deg))).tolist()
        )
        points, first = self.outline(angles_deg), [index for index, *_ in self.pieces]
        begin, end = points[first], points[np.array(first) + 1]
        for row, ends in self._rails.items():
            if 2 * row in first:
                at, axis = first.index(2 * row), frames[row][:3, 2]
                begin[at], end[at] = (points[2 * row] + place * axis for place in ends)
        along = (end - begin) / np.linalg.norm(end - begin, axis=1, keepdims=True)
        axes = frames[list(self.arm.driven_indices)]
        middles = np.vstack(((begin + end) / 2, axes[:, :3, 3] / self.reach_mm))
        turns = _from_y(np.vstack((along, axes[:, :3, 2])))
        found: list[list[float]] = np.hstack((middles, turns)).round(5).tolist()
        return found + self._mesh_poses(frames)

    def _mesh_poses(self, frames: Array) -> list[list[float]]:
        """The same of each mesh."""
        if not self.meshes:
            return []
        from scipy.spatial.transform import Rotation  # here, as most arms have no meshes

        chosen = frames[list(self.meshes)]
        turns = Rotation.from_matrix(chosen[:, :3, :3]).as_quat()
        found: list[list[float]] = np.hstack((chosen[:, :3, 3] / self.reach_mm, turns)).round(5).tolist()
        return found


def _from_y(along: Array) -> Array:
    """Quaternions x, y, z, w, (K, 4), of the shortest rotations from y to unit vectors, (K, 3)."""
    turns = np.column_stack((along[:, 2], np.zeros(len(along)), -along[:, 0], 1.0 + along[:, 1]))
    turns[turns[:, 3] < _OPPOSITE] = (1.0, 0.0, 0.0, 0.0)
    found: Array = turns / np.linalg.norm(turns, axis=1, keepdims=True)
    return found


def colours_of_speed(points_mm: Array, times_s: Array) -> tuple[Array, float]:
    """Colours, red, green and blue, (N, 3), of the points of a path, (N, 3), by its speed, and the highest, mm/s."""
    speeds = np.linalg.norm(np.gradient(points_mm, times_s, axis=0), axis=1)
    fastest = float(speeds.max())
    parts = speeds / (fastest or 1.0) * (len(SLOW_TO_FAST) - 1)
    scale = np.array(SLOW_TO_FAST)
    columns = [np.interp(parts, np.arange(len(scale)), scale[:, one]) for one in range(3)]
    return np.column_stack(columns), fastest


class ArmScene:
    """The scene of one page."""

    def __init__(self, shape: ArmShape) -> None:
        self._shape = shape
        self.picked: Callable[[int], object] = lambda number: None
        """Called with the number of a via point that was clicked; what it returns is awaited, if it can be."""
        self.dragged: Callable[[int, Array], object] = lambda number, position_mm: None
        """The same of one that was dragged, and where to, (3,)."""
        with ui.scene(
            width=800,
            height=500,
            grid=(4, 16),
            background_color="#ffffff",
            on_click=self._clicked,
            on_drag_end=lambda event: self._moved(event.object_name, [event.x, event.y, event.z]),
        ) as self.scene:
            # as simple shapes, or as the meshes that the arm has, whose poses come after those of the shapes
            simple = len(shape.pieces) + len(shape.housings)
            self._links = [""] * simple + self._meshes() if shape.meshes else self._body(COLOUR, JOINT, 1.0)
            self._ghost = self._body(GHOST[0], GHOST[0], GHOST_OPACITY)
        self._walls: list[Object3D] = []
        self.draw_workspace()
        self.draw_frames()
        self._dots: list[Object3D] = []
        """A ball for each via point, which the page's script names."""
        self.look("free")

    def _body(self, colour: str, colour_of_joints: str, opacity: float) -> list[str]:
        """A capsule for each piece, a cylinder for each joint; their numbers in the scene."""
        found = []
        for _, length, radius in self._shape.pieces:
            with self.scene.group() as capsule:
                self.scene.cylinder(radius, radius, length, 16).material(colour, opacity)
                for end in (-length / 2, length / 2):
                    self.scene.sphere(radius, 16, 12).material(colour, opacity).move(0, end, 0)
            found.append(str(capsule.id))
        for radius, length in self._shape.housings:
            with self.scene.group() as housing:
                self.scene.cylinder(radius, radius, length, 24).material(colour_of_joints, opacity)
            found.append(str(housing.id))
        return found

    def _meshes(self) -> list[str]:
        """The meshes; their numbers in the scene."""
        found = []
        for number in self._shape.meshes:
            with self.scene.group() as mesh:
                self.scene.stl(f"/mesh/{number}").material(COLOUR).scale(1.0 / self._shape.reach_mm)
            found.append(str(mesh.id))
        return found

    def draw_workspace(self) -> None:
        """The boxes to keep out of, and frames for the walls, as the arm has them now."""
        while self._walls:
            self._walls.pop().delete()
        with self.scene:
            for low, high, axes in self._shape.workspace:
                middle = axes[:3, :3] @ ((low + high) / 2) + axes[:3, 3]
                width, height, depth = (high - low).tolist()
                with self.scene.group() as box:
                    self.scene.box(width, height, depth, wireframe=True).material(OBSTACLE)
                    if width and height and depth:  # no wall
                        self.scene.box(width, height, depth).material(OBSTACLE, _OBSTACLE_OPACITY)
                self._walls.append(box.move(*middle.tolist()).rotate_R(axes[:3, :3].tolist()))

    def draw_frames(self) -> None:
        """The arm's frames as it has them now, each with its name."""
        ui.run_javascript(f"armtempo.named = {json.dumps(self._shape.frames())}")

    @property
    def parts(self) -> str:
        """The scene for the page's script, as JSON: its links and its ghost, the joints' ranges in rad, colours."""
        ranges = [
            [0.0, 0.0] if joint.slides else np.radians(joint.range_deg).round(4).tolist()
            for joint in self._shape.arm.driven
        ]
        colours = {"axes": AXES, "dial": DIAL, "ghost": GHOST, "tool": TOOL}
        found = {"scene": self.scene.id, "links": self._links, "ghost": self._ghost, "ranges": ranges}
        return json.dumps({**found, "colours": colours})

    def look(self, view: str) -> None:
        """Look from the side, from above, from in front and above, or follow the tool."""
        if view != FOLLOW:
            names = ("x", "y", "z", "look_at_x", "look_at_y", "look_at_z")
            eye, target = self._shape.eye(view), self._shape.middle + TARGET
            places = dict(zip(names, (*eye.tolist(), *target.tolist()), strict=True))
            self.scene.move_camera(**places, duration=0.3)
        ui.run_javascript(f"armtempo.follow = {json.dumps(view == FOLLOW)}")

    def draw(self, name: str, points_mm: Array, colour: str | Array) -> None:
        """Draw a line through points (N, 3), replacing the line of that name.

        ``colour``: of the line, or of each point, (N, 3).
        """
        points = (np.asarray(points_mm) / self._shape.reach_mm).round(4).tolist()
        given = colour if isinstance(colour, str) else colour.round(3).ravel().tolist()
        ui.run_javascript(f"armtempo.line({json.dumps(name)}, {json.dumps(points)}, {json.dumps(given)})")

    def dots(self, points_mm: Array) -> None:
        """Draw a ball at each via point, (N, 3), that can be clicked and dragged."""
        points = (np.asarray(points_mm) / self._shape.reach_mm).tolist()
        while len(self._dots) > len(points):
            self._dots.pop().delete()
        with self.scene:
            while len(self._dots) < len(points):
                number = len(self._dots)
                ball = self.scene.sphere(_DOT, 16, 12).material(VIA).with_name(f"{_VIA_NAME}{number}")
                self._dots.append(ball.draggable())
        for dot, place in zip(self._dots, points, strict=True):
            dot.move(*place)
        names = json.dumps([[x, y, z + 2 * _DOT] for x, y, z in points])
        ui.run_javascript(f"armtempo.vias = {names}; armtempo.changes += 1")

    def _clicked(self, event: SceneClickEventArguments) -> object:
        numbers = [_via_number(hit.object_name) for hit in event.hits]
        return next((self.picked(number) for number in numbers if number is not None), None)

    def _moved(self, name: str, position: list[float]) -> object:
        number = _via_number(name)
        return None if number is None else self.dragged(number, np.array(position) * self._shape.reach_mm)


def _via_number(name: str | None) -> int | None:
    """The number in the name of a via point's ball; None for something else."""
    number = (name or "").removeprefix(_VIA_NAME)
    return int(number) if name != number and number.isdigit() else None
