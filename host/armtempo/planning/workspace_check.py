"""Collision check of a whole motion, proven: links are capsules that touch neither obstacles nor each other.

At the middle of a time interval, the distances of all links from all obstacles, and from each other, are
computed exactly. Within the interval no point of a link moves farther than half the interval times the sum of
the joints' speeds times their reach to it. If something might touch, the interval is halved.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.basics.errors import PlanError
from armtempo.basics.progress import alive
from armtempo.kinematics.chain import all_angles_deg, outline_mm
from armtempo.kinematics.forward import forward
from armtempo.kinematics.geometry import Geometry
from armtempo.model import home_switches
from armtempo.model.arm import Arm
from armtempo.model.joint_unit import SLIDE_MM
from armtempo.model.workspace import KeepOut, Workspace
from armtempo.planning import point_to_point
from armtempo.planning.capsules import box_distance, segment_distance
from armtempo.splines import extremes
from armtempo.splines.trajectory import Trajectory

_STRETCH_S = 0.25
"""Initial length of the intervals."""
_CLOSE_MM = 0.01
"""Smaller distances count as touching: the proof ends there."""
_DEEPER_MM = 0.5
"""What touches at the start may do so by this much more; less would take many halvings to prove."""
_APART_MM = 2.0 * _CLOSE_MM
"""From this distance on a pair has come apart."""
_TIMES = 2000
"""Number of times at which that is looked for."""
LOG = logging.getLogger("armtempo")
_MOST = 4000
"""Largest number of intervals at a time."""


@dataclass(frozen=True)
class Touch:
    """Two things that touch."""

    link: str
    other: str
    """The obstacle, or another link."""
    depth_mm: float
    time_s: float

    @property
    def description(self) -> str:
        """Describe the touch."""
        depth = f"is {self.depth_mm:.1f} mm inside of" if self.depth_mm > _CLOSE_MM else "touches"
        return f"{self.link} {depth} {self.other}"


@dataclass(frozen=True, eq=False)
class Bodies:
    """The links of an arm: two segments per row of the table, along its d and its a; the tool; and the load."""

    arm: Arm

    @cached_property
    def obstacles(self) -> tuple[KeepOut, ...]:
        """Boxes and walls."""
        return (self.arm.workspace or Workspace()).obstacles

    @cached_property
    def names(self) -> list[str]:
        """Of each segment, (S,)."""
        found = [f"the link of {joint.name}" for joint in self.arm.joints for _ in range(2)]
        found += [f"the tool {self.arm.tool.name}"] if self.arm.tool else []
        return [*found, *([f"the load {self.arm.payload.name}"] if self.arm.payload else [])]

    @cached_property
    def radius_mm(self) -> Array:
        """Of each segment, (S,)."""
        found = np.repeat([joint.radius_mm for joint in self.arm.joints], 2)
        found = np.append(found, self.arm.tool.radius_mm) if self.arm.tool else found
        return np.append(found, self.arm.payload.radius_mm) if self.arm.payload else found

    @cached_property
    def load_ends_mm(self) -> Array:
        """The ends of the load's segment in the tool's frame: (2, 3), or (0, 3)."""
        if not (load := self.arm.payload):
            return np.empty((0, 3))
        way = np.zeros(3)
        way["xyz".index(load.along)] = 0.5 * load.length_mm
        return np.array(load.centre_mm) + np.stack([-way, way])

    def ends(self, driven_deg: Array) -> tuple[Array, Array]:
        """Start and end of the segments at postures (N, J): both (S, N, 3)."""
        angles = all_angles_deg(self.arm, driven_deg)
        points = np.moveaxis(outline_mm(self.arm, angles), 1, 0)
        starts, ends = points[:-1], points[1:]
        if not (self.arm.tool or self.arm.payload):
            return starts, ends
        tool = forward(Geometry.of(self.arm), np.radians(angles))
        if self.arm.tool:
            starts = np.concatenate([starts, points[-1:]])
            ends = np.concatenate([ends, tool[None, :, :3, 3]])
        if self.arm.payload:
            load = tool[:, None, :3, 3] + self.load_ends_mm @ np.swapaxes(tool[:, :3, :3], 1, 2)
            starts, ends = (
                np.concatenate([both, load[None, :, end]]) for end, both in enumerate((starts, ends))
            )
        return starts, ends

    @cached_property
    def turned(self) -> Array:
        """Largest turn of each row per degree of each driven joint, or of sliding by its mm: (joints, J)."""
        identity = np.eye(len(self.arm.joints))[:, list(self.arm.driven_indices)]
        return np.asarray(np.abs(np.array(Geometry.of(self.arm).turns(list(identity)))))

    @cached_property
    def reach_mm(self) -> Array:
        """Largest distance of a segment from the axis of a row, (S, joints); 0 if the row does not move it.

        It bounds how far a radian of the row moves the segment; a sliding row moves the end of its own d too.
        """
        geometry = Geometry.of(self.arm)
        lengths = np.stack([geometry.lengths, np.abs(geometry.a)], axis=1).ravel()
        lengths = np.append(lengths, [self.arm.tool.length_mm] if self.arm.tool else [])
        lengths = np.append(lengths, np.linalg.norm(self.load_ends_mm, axis=1).max(initial=0.0))[
            : len(self.names)
        ]
        found = np.zeros((len(lengths), len(self.arm.joints)))
        for segment in range(len(lengths)):
            for row in range(len(self.arm.joints)):
                if segment > 2 * row:  # the d of a row is on its axis
                    found[segment, row] = lengths[2 * row + 1 : segment + 1].sum()
        for row, _ in geometry.slides:
            found[2 * row :, row] = SLIDE_MM
        return found

    @cached_property
    def moves(self) -> NDArray[np.intp]:
        """Moving segments."""
        return np.flatnonzero((self.reach_mm @ self.turned).any(axis=1))

    @cached_property
    def pairs(self) -> list[tuple[int, int]]:
        """Pairs of segments to check: at least two rows apart, both with a radius, and not touching at home."""
        if not self.radius_mm.any():
            return []
        found = []
        starts, ends = self.ends(np.array([self.arm.home_deg]))
        # The tool and the load belong to the last row
        row = np.minimum(np.arange(len(self.radius_mm)) // 2, len(self.arm.joints) - 1)
        for one in range(len(self.radius_mm)):
            for other in range(one + 1, len(self.radius_mm)):
                between = self.turned[row[one] + 1 : row[other] + 1].any()
                if row[other] - row[one] < 2 or not between or not self.radius_mm[[one, other]].all():
                    continue
                apart = segment_distance(starts[one], ends[one], starts[other], ends[other])[0]
                if apart > self.radius_mm[one] + self.radius_mm[other]:
                    found.append((one, other))
        return found

    def distances(self, driven_deg: Array) -> Array:
        """Distances at postures (N, J), minus radii: moving segments from obstacles, then pairs, (N, M)."""
        starts, ends = self.ends(driven_deg)
        count, found = len(driven_deg), []
        if self.obstacles and len(self.moves):
            flat = starts[self.moves].reshape(-1, 3), ends[self.moves].reshape(-1, 3)
            away = np.stack([_away(box, *flat) for box in self.obstacles])
            away = away.reshape(len(self.obstacles), -1, count) - self.radius_mm[self.moves, None]
            found.append(np.swapaxes(away, 0, 1).reshape(-1, count))
        if self.pairs:
            one, other = np.array(self.pairs).T
            four = (each.reshape(-1, 3) for each in (starts[one], ends[one], starts[other], ends[other]))
            thick = self.radius_mm[one] + self.radius_mm[other]
            found.append(segment_distance(*four).reshape(-1, count) - thick[:, None])
        return np.concatenate(found).T

    @cached_property
    def named(self) -> list[tuple[str, str]]:
        """The names of the two objects of each distance."""
        found = [(self.names[segment], box.name) for segment in self.moves for box in self.obstacles]
        return found + [(self.names[one], self.names[other]) for one, other in self.pairs]

    def speeds_mm_s(self, speeds_deg_s: Array) -> Array:
        """Largest rate of decrease of each distance at speeds of the driven joints, (J,): (M,)."""
        rows = self.turned @ np.radians(speeds_deg_s)
        found = [float(self.reach_mm[segment] @ rows) for segment in self.moves for _ in self.obstacles]
        for one, other in self.pairs:  # relative to the first segment, only rows after it move the other
            after = np.arange(len(rows)) >= one // 2 + one % 2
            reach_mm = self.reach_mm[other, after] + self.reach_mm[one, after]  # the d of a sliding row grows
            found.append(float(reach_mm @ rows[after]))
        return np.array(found)


def _away(box: KeepOut, starts: Array, ends: Array) -> Array:
    """Distance of segments (N, 3) to (N, 3) from a box, (N,)."""
    axes = np.array(box.axes)
    start, end = ((points - axes[:3, 3]) @ axes[:3, :3] for points in (starts, ends))
    return box_distance(start, end, box.low_mm, box.high_mm)


def can_touch(arm: Arm) -> bool:
    """Whether there is anything that the arm could touch."""
    thick = sum(joint.radius_mm > 0.0 for joint in arm.joints) + bool(arm.payload and arm.payload.radius_mm)
    thick += bool(arm.tool and arm.tool.radius_mm)
    return bool(arm.workspace and arm.workspace.obstacles) or thick > 1


def posture_touches(arm: Arm, driven_deg: Iterable[float]) -> list[Touch]:
    """All touches at a posture (J,)."""
    bodies = Bodies(arm)
    if not bodies.named:
        return []
    distances = bodies.distances(np.array([list(driven_deg)], dtype=float))[0]
    return [
        Touch(*bodies.named[number], -float(distances[number]), 0.0)
        for number in np.flatnonzero(distances < _CLOSE_MM)
    ]


def first_touch(
    arm: Arm, trajectory: Trajectory, speeds_deg_s: Array, outwards: bool = False
) -> Touch | None:
    """What touches in a motion, None if it is proven that nothing does.

    ``speeds_deg_s``: the joints' largest speeds in it, (J,). If it leads ``outwards``, what touches at its start may do
    so until it has come apart, by ``_DEEPER_MM`` more at most.
    """
    bodies = Bodies(arm)
    if not bodies.named:
        return None
    start = bodies.distances(trajectory(np.zeros(1)))[0]
    if not outwards and start.min() < _CLOSE_MM:
        what = int(start.argmin())
        return Touch(*bodies.named[what], -float(start[what]), 0.0)
    allowed = np.where(start < _APART_MM, start - _DEEPER_MM, 0.0)
    apart_s = _apart_s(bodies, trajectory, start)
    shrink = bodies.speeds_mm_s(speeds_deg_s)
    count = max(1, int(np.ceil(trajectory.duration_s / _STRETCH_S)))
    half = 0.5 * trajectory.duration_s / count
    middles = half * (2.0 * np.arange(count) + 1.0)
    touch = None
    while len(middles):
        alive()
        still_open = []
        for first in range(0, len(middles), _MOST):
            part = middles[first : first + _MOST]
            still = np.where(part[:, None] - half < apart_s, allowed, 0.0)
            distances = bodies.distances(trajectory(part)) - still
            clear = distances - half * shrink
            close = distances < _CLOSE_MM
            for number in np.flatnonzero(close.any(axis=1))[:1]:
                what = int(np.argmin(distances[number]))
                depth = -float(distances[number, what] + still[number, what])
                found = Touch(*bodies.named[what], depth, float(part[number]))
                touch = found if touch is None or found.time_s < touch.time_s else touch
            still_open.append(part[(clear <= 0.0).any(axis=1) & ~close.any(axis=1)])
        left = np.concatenate(still_open)
        if touch is not None:
            return touch
        half *= 0.5
        middles = np.sort(np.concatenate([left - half, left + half]))
    return None


def _apart_s(bodies: Bodies, trajectory: Trajectory, start: Array) -> Array:
    """When each pair that touches at the start has come apart, (M,): 0 for the others, infinite if it does not."""
    touching = np.flatnonzero(start < _APART_MM)
    found = np.zeros(len(start))
    if len(touching):
        times = np.linspace(0.0, trajectory.duration_s, _TIMES)
        away = bodies.distances(trajectory(times))[:, touching] >= _APART_MM
        found[touching] = np.where(away.any(axis=0), times[away.argmax(axis=0)], np.inf)
    return found


def touch_of(
    arm: Arm, trajectory: Trajectory, speeds_deg_s: Array | None = None, outwards: bool = False
) -> Touch | None:
    """As ``first_touch``; skips arms without a workspace, and computes unknown speeds."""
    if not can_touch(arm):
        return None
    if speeds_deg_s is None:
        speeds_deg_s = np.array([each.speed_deg_s for each in extremes.of_joints(trajectory.joints)])
    return first_touch(arm, trajectory, speeds_deg_s, outwards)


def tell_start(arm: Arm, driven_deg: Iterable[float]) -> None:
    """Log what touches most at a posture (J,) from which the arm moves out."""
    touches = posture_touches(arm, driven_deg) if can_touch(arm) else []
    if touches:
        touch = max(touches, key=lambda each: each.depth_mm)
        LOG.warning(f"{touch.description} where it starts; it may move out only, and not back")


def check(arm: Arm, trajectory: Trajectory, outwards: bool = False) -> None:
    """Raise PlanError if a motion leaves the workspace, with objects and time; ``outwards``: see ``first_touch``."""
    if touch := touch_of(arm, trajectory, None, outwards):
        raise _refused(arm, trajectory, touch, f"at {touch.time_s:.2f} s")


def check_plan(arm: Arm, trajectory: Trajectory, speeds_deg_s: Array, outwards: bool) -> None:
    """As ``check``, with the joints' largest speeds (J,); the error also names via points."""
    touch = touch_of(arm, trajectory, speeds_deg_s, outwards)
    if touch is None:
        return
    place = f"at {touch.time_s:.2f} s"
    via_times_s = trajectory.joints[0].via_times_s
    if len(via_times_s) > 2 and touch.time_s > 0.0:
        after = int(np.clip(np.searchsorted(via_times_s, touch.time_s), 1, len(via_times_s) - 1))
        place += f", between P{after - 1} and P{after}"
    raise _refused(arm, trajectory, touch, place)


def _refused(arm: Arm, trajectory: Trajectory, touch: Touch, place: str) -> PlanError:
    if touch.time_s == 0.0:
        return PlanError(
            f"{trajectory.name}: {touch.description} where it starts",
            "start elsewhere: 'armtempo jog' and 'goto' move out; or, in a job that leads out, start_touches = true",
        )
    return PlanError(
        f"{trajectory.name}: {touch.description} ({place})",
        f"add or move a via point, take another branch with {arm.texts.list_key('posture_deg')}, or correct "
        "[workspace] in the arm file",
    )


def touching(arm: Arm) -> list[str]:
    """The moves that would leave the workspace, one group of joints after the other, while the others are at home."""
    if not can_touch(arm):
        return []
    problems = []
    home_deg = np.array(arm.home_deg)
    for group in home_switches.groups(arm):
        end_deg = home_deg.copy()
        for index, switch in group.items():
            end_deg[index] = switch.edge_deg
        names = ", ".join(arm.driven[index].name for index in group)
        try:
            check(arm, point_to_point.straight("home", home_deg, end_deg, arm))
        except PlanError as error:
            problems.append(f"between home and the switch of {names}: {error.problem}")
    return problems
