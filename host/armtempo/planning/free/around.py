"""A free path around obstacles: auxiliary via points, found by two rapidly exploring random trees (RRT-connect)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import PlanError
from armtempo.basics.progress import Progress, alive, stage
from armtempo.kinematics.chain import all_angles_deg
from armtempo.kinematics.forward import forward
from armtempo.kinematics.geometry import Geometry
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.tool_pose import Pose
from armtempo.planning import workspace_check
from armtempo.planning.free import free_plan
from armtempo.planning.free.free_plan import Trial
from armtempo.planning.through_plan import Planned
from armtempo.planning.workspace_check import Bodies, Touch

_ROUNDS = 5
"""Largest number of planned motions, each closer to the collision-free path."""
_NODES = 400
"""Largest number of postures in the trees of one path."""
_STEP = 0.15
"""Length of a branch, as a fraction of the sampled space."""
_SHORTCUTS = 100
_ASIDE_DEG = 90.0
"""Postures are sampled up to this far outside of the two via points."""
_CLEAR_MM = 10.0
"""Clearance of the trees' path, so that the motion may cut its corners; less if a via point is closer."""
_SAMPLE_MM = 8.0
"""Largest motion of a link between checked postures."""
_MOST_SAMPLES = 300
_NEARBY_MM = (30.0, 10.0)
"""The tool may pass helping via points by the first of these with which nothing touches."""


def motion(arm: Arm, job: Job, via_deg: Array, progress: Progress, nearest: bool = True) -> Planned:
    """The motion of ``free_plan.motion``, around obstacles if a way is found.

    Otherwise the motion that touches something. ``nearest``: as near to what is in the way as is fastest; else
    with a distance for the changes of a path that becomes part of another.
    """
    first = planned = free_plan.motion(arm, job, via_deg, progress)
    holding = arm.holding(job.holds)
    touch = _touch(arm, job, first)
    fixed = job.timing != "shared" or job.corridor_deg is not None or job.corridor_mm is not None
    if touch is None or fixed:
        return first
    space = _Space(holding)
    if not space.is_free(via_deg):
        return first
    paths = [via_deg[number : number + 2] for number in range(len(via_deg) - 1)]
    names = set()
    rng = np.random.default_rng([job.seed, len(via_deg)])
    for _ in range(_ROUNDS):
        names.add(touch.other)
        stage(f"looking for a way around {touch.other}")
        leg, part = _place(planned, touch, paths)
        if len(paths[leg]) == 2:
            found = space.path(paths[leg][0], paths[leg][1], rng)
            if found is None:
                break
            paths[leg] = found
        else:  # the path cuts a corner too much: keep it closer to the path found
            middle = 0.5 * (paths[leg][part] + paths[leg][part + 1])
            paths[leg] = np.insert(paths[leg], part + 1, middle, axis=0)
        helped = _helped(job, paths)
        angles = np.concatenate([paths[0], *(path[1:] for path in paths[1:])])
        try:
            planned = free_plan.motion(arm, helped, angles, progress, Trial(led=True))
        except PlanError:
            break
        if not (touch := _touch(arm, job, planned)):
            own = set(_places(paths).tolist())
            if nearest:
                planned = _loosened(arm, helped, angles, own, planned, progress)
            return _without_help(first, planned, paths, names)
    return first


def _touch(arm: Arm, job: Job, planned: Planned) -> Touch | None:
    """What a motion touches."""
    return workspace_check.touch_of(arm.holding(job.holds), planned.trajectory, None, job.start_touches)


def _loosened(
    arm: Arm, helped: Job, angles: Array, own: set[int], planned: Planned, progress: Progress
) -> Planned:
    """The motion, faster where the tool may pass its helping via points nearby; those of the job are ``own``."""
    stage("passing nearby")
    poses = forward(Geometry.of(arm), np.radians(all_angles_deg(arm, angles)))
    for tolerance_mm in _NEARBY_MM:
        via = [
            each
            if number in own
            else Pose(tuple(map(tuple, pose.tolist())), fixed=(), tolerance_mm=tolerance_mm)
            for number, (each, pose) in enumerate(zip(helped.via, poses, strict=True))
        ]
        try:
            loose = replace(helped, via=tuple(via))
            found = free_plan.motion(arm, loose, angles, progress, Trial(known=planned, rounds=1))
            if _touch(arm, helped, found) is not None:
                continue
            found = free_plan.motion(arm, loose, angles, progress, Trial(known=found))
        except PlanError:
            continue
        faster = found.trajectory.duration_s < planned.trajectory.duration_s
        if faster and _touch(arm, helped, found) is None:
            return found
    return planned


def _places(paths: Sequence[Array]) -> Array:
    """Indices of the job's via points among all: (n + 1,)."""
    return np.cumsum([0, *(len(path) - 1 for path in paths)])


def _place(planned: Planned, touch: Touch, paths: Sequence[Array]) -> tuple[int, int]:
    """The leg in which a motion touches something, and the part of its path."""
    times = planned.trajectory.joints[0].via_times_s
    part = int(np.clip(np.searchsorted(times, touch.time_s) - 1, 0, len(times) - 2))
    places = _places(paths)
    leg = int(np.searchsorted(places, part, side="right")) - 1
    return leg, part - int(places[leg])


def _helped(job: Job, paths: Sequence[Array]) -> Job:
    """The job with auxiliary via points between its own."""
    places = _places(paths)
    via = [*job.via[:1]]
    for number, path in enumerate(paths, 1):
        via += [*(tuple(map(float, angles)) for angles in path[1:-1]), job.via[number]]
    stops = tuple(replace(stop, via=int(places[stop.via])) for stop in job.stops)
    return replace(job, via=tuple(via), stops=stops)


def _without_help(first: Planned, planned: Planned, paths: Sequence[Array], names: set[str]) -> Planned:
    """The motion described by the job's own via points only, with the bounds of the ``first``, which touches."""
    places = _places(paths)
    joints = []
    for joint in planned.trajectory.joints:
        assert joint.via_segments is not None  # a free path has these
        joints.append(replace(joint, via_segments=tuple(joint.via_segments[place] for place in places)))
    searches = tuple(
        replace(search, lower_bound_s=of.lower_bound_s, lower_bound_kind=of.lower_bound_kind)
        for search, of in zip(planned.searches, first.searches, strict=True)
    )
    note = f"the path goes around {', '.join(sorted(names))}"
    trajectory = replace(planned.trajectory, joints=tuple(joints))
    return Planned(trajectory, searches, (*planned.notes, note))


@dataclass(frozen=True, eq=False)
class _Space:
    """The space of postures of an arm."""

    arm: Arm

    @cached_property
    def bodies(self) -> Bodies:
        """Its links and its load."""
        return Bodies(self.arm)

    def is_free(self, driven_deg: Array, clear_mm: Array | float = 0.02) -> bool:
        """Whether all clearances at postures (N, J) are at least ``clear_mm``."""
        return bool(np.all(self.bodies.distances(driven_deg) > clear_mm))

    def path(self, start: Array, end: Array, rng: np.random.Generator) -> Array | None:
        """Collision-free postures (K, J) from one to another, connected by straight lines; None if none is found."""
        clear = np.minimum(_CLEAR_MM, 0.5 * self.bodies.distances(np.stack([start, end])).min(axis=0))
        low, high = np.array([joint.range_deg for joint in self.arm.driven]).T
        inside = 0.01 * (high - low)
        low = np.maximum(low + inside, np.minimum(start, end) - _ASIDE_DEG)
        high = np.minimum(high - inside, np.maximum(start, end) + _ASIDE_DEG)
        tree, other = _Tree(self, clear, high - low, start), _Tree(self, clear, high - low, end)
        forwards = True
        while len(tree.postures) + len(other.postures) < _NODES:
            alive()
            new = tree.grown(rng.uniform(low, high))
            if new is not None and other.reaches(tree.postures[new]):
                found = np.concatenate([tree.branch(new), other.branch(len(other.postures) - 1)[-2::-1]])
                return self._shortened(found if forwards else found[::-1], clear, rng)
            tree.tries += 1
            if tree.tries > 10 * _NODES:
                break
            if len(tree.postures) > len(other.postures):
                tree, other, forwards = other, tree, not forwards
        return None

    def leads(self, start: Array, end: Array, clear: Array) -> bool:
        """Whether the straight line between two postures is free, checked in small steps."""
        farthest = float(self.bodies.speeds_mm_s(np.abs(end - start)).max())
        count = min(_MOST_SAMPLES, int(np.ceil(farthest / _SAMPLE_MM)) + 2)
        return self.is_free(start + np.linspace(0.0, 1.0, count)[:, None] * (end - start), clear)

    def _shortened(self, path: Array, clear: Array, rng: np.random.Generator) -> Array:
        """The path with random straight shortcuts."""
        speeds = np.array([joint.limits.speed_deg_s for joint in self.arm.driven])
        for _ in range(_SHORTCUTS):
            alive()
            takes = np.abs(np.diff(path, axis=0) / speeds).max(axis=1)
            passed = np.concatenate([[0.0], np.cumsum(takes)])
            if len(path) == 2:
                break
            first, last = np.sort(rng.uniform(0.0, passed[-1], 2))
            before, after = (int(np.searchsorted(passed, each, side="right")) for each in (first, last))
            if before == after:
                continue
            begin, end = (
                np.array([np.interp(each, passed, angles) for angles in path.T]) for each in (first, last)
            )
            if self.leads(begin, end, clear):
                path = np.concatenate([path[:before], begin[None], end[None], path[after:]])
        return self._straightened(path, clear)

    def _straightened(self, path: Array, clear: Array) -> Array:
        """The path without unnecessary postures."""
        number = 1
        while number < len(path) - 1:
            if self.leads(path[number - 1], path[number + 1], clear):
                path = np.delete(path, number, axis=0)
            else:
                number += 1
        return path


class _Tree:
    """A tree of postures connected by straight lines."""

    def __init__(self, space: _Space, clear: Array, size: Array, root: Array) -> None:
        self.space, self.clear, self.size = space, clear, size
        self.postures, self.parents, self.tries = [root], [-1], 0

    def grown(self, towards: Array) -> int | None:
        """Add a posture, one step from the nearest one ``towards`` a posture; returns its number, None if it
        is not free."""
        away = (np.array(self.postures) - towards) / self.size
        nearest = int(np.argmin(np.sum(away**2, axis=1)))
        length = float(np.linalg.norm(away[nearest]))
        here = self.postures[nearest]
        new = here + (towards - here) * min(1.0, _STEP / max(length, 1e-9))
        if not self.space.leads(here, new, self.clear):
            return None
        self.postures.append(new)
        self.parents.append(nearest)
        return len(self.postures) - 1

    def reaches(self, posture: Array) -> bool:
        """Grow step by step towards a posture; returns whether it is reached."""
        for _ in range(_NODES):
            new = self.grown(posture)
            if new is None:
                return False
            if np.allclose(self.postures[new], posture):
                return True
        return False

    def branch(self, number: int) -> Array:
        """The postures from the root to one."""
        found = []
        while number >= 0:
            found.append(self.postures[number])
            number = self.parents[number]
        return np.array(found[::-1])
