"""Random jobs with lines, arcs, cut corners, waits and speeds of the tool, and plans of them checked by other code.

For arms that ship: forward kinematics by plain matrix products, scipy's B-splines and rotations, 40 samples a segment.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from armtempo.model.arm import Arm
from armtempo.model.job import Job, Stop
from armtempo.model.plan import Plan
from armtempo.model.tool import ArmTool
from armtempo.model.tool_pose import APPROACH, WHOLE, Pose
from armtempo.model.tool_segment import ToolSegment
from scipy.spatial.transform import Rotation

from tests.host.problems import sampled

ARMS = ("parol6", "ar4", "thor", "community", "moveo", "scara", "paper")
_FOLLOWED = 400
"""Steps in which a refused line is followed."""
_LARGEST_STEP_DEG = 5.0


def tool_poses(arm: Arm, driven_deg: np.ndarray) -> np.ndarray:
    """Poses (N, 4, 4) for angles (N, J), link by link."""
    angles = np.tile([joint.home_deg for joint in arm.joints], (len(driven_deg), 1)).astype(float)
    angles[:, list(arm.driven_indices)] = driven_deg
    poses = np.tile(np.eye(4), (len(driven_deg), 1, 1))
    for number, joint in enumerate(arm.joints):
        turn = angles[:, number] - (angles[:, number - 1] if joint.parallel_linkage else 0.0)
        theta, alpha = np.radians(turn + joint.theta_offset_deg), np.radians(joint.alpha_deg)
        c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        link = np.zeros((len(theta), 4, 4))
        link[:, 0, 0], link[:, 0, 1], link[:, 0, 2], link[:, 0, 3] = c, -s * ca, s * sa, joint.a_mm * c
        link[:, 1, 0], link[:, 1, 1], link[:, 1, 2], link[:, 1, 3] = s, c * ca, -c * sa, joint.a_mm * s
        link[:, 2, 1], link[:, 2, 2], link[:, 2, 3], link[:, 3, 3] = sa, ca, joint.d_mm, 1.0
        poses = poses @ link
    return poses @ np.array(arm.tool.matrix) if arm.tool else poses


def with_random_tool(arm: Arm, rng: np.random.Generator) -> Arm:
    """The arm with a tool on it."""
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.random(random_state=rng).as_matrix()
    matrix[:3, 3] = rng.uniform(-0.2, 0.2, 3) * sum(abs(joint.d_mm) + abs(joint.a_mm) for joint in arm.joints)
    rows = tuple(map(tuple, matrix.tolist()))
    return replace(arm, tool=ArmTool("random", rows, radius_mm=float(rng.uniform(0.0, 20.0))))


@dataclass(frozen=True)
class Way:
    """A line, or the arc through a point, between two poses."""

    start: np.ndarray
    end: np.ndarray
    through: np.ndarray | None
    fixed: tuple[str, ...]

    def nearest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distance of points (N, 3), and the part of the way at the nearest place."""
        first, last = self.start[:3, 3], self.end[:3, 3]
        if self.through is None:
            way = last - first
            part = np.clip((points - first) @ way / max(way @ way, 1e-12), 0.0, 1.0)
            return np.linalg.norm(points - first - part[:, None] * way, axis=1), part
        centre, across, along, angle = circle(first, self.through, last)
        radius = np.linalg.norm(across)
        x, y = (points - centre) @ across / radius, (points - centre) @ along
        turned = np.arctan2(y, x) % (2.0 * np.pi)
        beyond = turned > angle  # nearer to which end?
        turned = np.where(beyond, np.where(turned - angle < 2.0 * np.pi - turned, angle, 0.0), turned)
        near = centre + np.cos(turned)[:, None] * across + radius * np.sin(turned)[:, None] * along
        return np.linalg.norm(points - near, axis=1), turned / angle

    def pose(self, part: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions and rotations at parts of it; the orientation turns evenly."""
        first, last = self.start[:3, 3], self.end[:3, 3]
        if self.through is None:
            position = first + part[:, None] * (last - first)
        else:
            centre, across, along, angle = circle(first, self.through, last)
            radius = np.linalg.norm(across)
            position = centre + np.cos(angle * part)[:, None] * across
            position = position + radius * np.sin(angle * part)[:, None] * along
        begin, end = self.start[:3, :3], self.end[:3, :3]
        if self.fixed == (APPROACH,):
            turn = Rotation.align_vectors([end[:, 2]], [begin[:, 2]])[0].as_rotvec()
            normal = np.cross(begin[:, 2], end[:, 2])
            size = np.linalg.norm(normal)
            turn = normal / size * np.arctan2(size, begin[:, 2] @ end[:, 2]) if size > 1e-12 else 0.0 * turn
        else:
            turn = Rotation.from_matrix(end @ begin.T).as_rotvec()
        return position, Rotation.from_rotvec(part[:, None] * turn).as_matrix() @ begin

    def turned_deg(self, rotation: np.ndarray, part: np.ndarray) -> np.ndarray:
        """How far orientations (N, 3, 3) are from the one there, as far as it counts."""
        wanted = self.pose(part)[1]
        if self.fixed == (APPROACH,):
            sine = np.linalg.norm(np.cross(rotation[:, :, 2], wanted[:, :, 2]), axis=1)
            return np.degrees(np.arctan2(sine, np.sum(rotation[:, :, 2] * wanted[:, :, 2], axis=1)))
        if not self.fixed:
            return np.zeros(len(part))
        return np.degrees(Rotation.from_matrix(rotation @ np.swapaxes(wanted, 1, 2)).magnitude())


def circle(
    first: np.ndarray, middle: np.ndarray, last: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Centre, the vector from it to the first point, the direction there, and the angle to the last."""
    normal = np.cross(middle - first, last - first)
    normal /= np.linalg.norm(normal)
    rows = np.array([middle - first, last - first, normal])
    right = [
        0.5 * (middle @ middle - first @ first), 0.5 * (last @ last - first @ first), normal @ first
    ]  # fmt: skip
    centre = np.linalg.solve(rows, right)
    across = first - centre
    along = np.cross(normal, across / np.linalg.norm(across))
    angle = np.arctan2((last - centre) @ along, (last - centre) @ across / np.linalg.norm(across))
    return centre, across, along, float(angle % (2.0 * np.pi))


def random_lines(seed: int) -> tuple[Arm, Job]:
    """An arm and a job with lines."""
    rng = np.random.default_rng([seed, 31])
    name = ARMS[int(rng.integers(len(ARMS)))]
    arm = Arm.paper() if name == "paper" else Arm.of(name)
    if seed % 2:
        arm = with_random_tool(arm, np.random.default_rng([seed, 32]))
    low, high = np.array([joint.range_deg for joint in arm.driven]).T
    low, high = np.maximum(low, -170.0), np.minimum(high, 288.0)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    here = middle + half * rng.uniform(-0.7, 0.7, len(middle))
    count = int(rng.integers(1, 4))
    far = 10.0 ** rng.uniform(0.3, 1.6)
    fixed = WHOLE if len(middle) >= 6 else (APPROACH,) if len(middle) == 5 else ()
    if rng.random() < 0.1:
        fixed = ()
    vias: list[tuple[float, ...] | Pose] = [tuple(here)]
    ways = []
    for via in range(1, count + 1):
        before = here
        here = np.clip(here + rng.uniform(-far, far, len(here)), low, high)
        if rng.random() < 0.15:
            here = np.clip(here, middle - 0.8 * half, middle + 0.8 * half)  # the spline may swing out there
            vias.append(tuple(here))
            continue
        pose = tool_poses(arm, here[None])[0]
        vias.append(Pose(tuple(map(tuple, pose.tolist())), fixed=fixed))
        through = None
        if rng.random() < 0.3:
            between = 0.5 * (before + here) + rng.uniform(-0.2, 0.2, len(here)) * far
            through = tuple(tool_poses(arm, between[None])[0, :3, 3].tolist())
        limited = rng.random() < 0.3
        ways.append(
            ToolSegment(
                via, True, through,
                tolerance_mm=float(10.0 ** rng.uniform(-1.5, 0.7)),
                tolerance_deg=float(10.0 ** rng.uniform(-1.5, 0.7)),
                speed_mm_s=float(10.0 ** rng.uniform(0.7, 2.7)) if limited else None,
                acceleration_mm_s2=float(10.0 ** rng.uniform(1.5, 3.5)) if limited else None,
            )
        )  # fmt: skip
    job = Job("lines", via=tuple(vias), tool_segments=_with_cuts(ways, vias, arm, rng))
    stops = tuple(
        Stop(via, float(10.0 ** rng.uniform(-2.0, 1.0)))
        for via in range(1, count)
        if rng.random() < 0.3 and not any(way.blend_mm and way.via == via for way in job.tool_segments)
    )
    return arm, replace(job, stops=stops, path="free" if rng.random() < 0.3 else "through")


def _with_cuts(
    ways: list[ToolSegment], vias: list[tuple[float, ...] | Pose], arm: Arm, rng: np.random.Generator
) -> tuple[ToolSegment, ...]:
    led = {way.via for way in ways}
    found = []
    for way in ways:
        ends = [
            np.array(via.matrix)[:3, 3]
            if isinstance(via, Pose)
            else tool_poses(arm, np.array([via]))[0, :3, 3]
            for via in vias[way.via - 1 : way.via + 2]
        ]
        if way.via + 1 in led and rng.random() < 0.4:
            shorter = min(np.linalg.norm(ends[1] - ends[0]), np.linalg.norm(ends[2] - ends[1]))
            if shorter > 1.0:
                way = replace(way, blend_mm=float(rng.uniform(0.05, 0.45) * shorter))
        found.append(way)
    return tuple(found)


def ways_of(plan: Plan) -> dict[int, Way]:
    """The lines of a plan's job by their via points, from where its postures bring the tool."""
    poses = tool_poses(plan.arm, plan.via_deg)
    found: dict[int, Way] = {}
    for way in plan.job.tool_segments:
        if not way.line:
            continue
        via = plan.job.via[way.via]
        end = np.array(via.matrix) if isinstance(via, Pose) else poses[way.via]
        fixed = via.fixed if isinstance(via, Pose) else WHOLE if len(plan.arm.driven) >= 6 else ()
        through = None if way.arc_through_mm is None else np.array(way.arc_through_mm)
        start = poses[way.via - 1].copy()
        before = plan.job.via[way.via - 1]
        if isinstance(before, Pose) and way.via - 1 in found and before.fixed != ():
            start = np.array(before.matrix)
        found[way.via] = Way(start, end, through, fixed)
    return found


def line_faults(plan: Plan) -> list[str]:
    """What is wrong with the lines of a plan; empty if nothing is."""
    found = []
    joints = [sampled(spline) for spline in plan.trajectory.joints]
    poses = tool_poses(plan.arm, np.stack([joint.angle_deg for joint in joints], axis=1))
    spline = plan.trajectory.joints[0]
    arrivals = np.array(spline.via_segments)
    u, seconds = joints[0].u, joints[0].time_s
    ways = ways_of(plan)
    cuts = {way.via: way.blend_mm for way in plan.job.tool_segments}
    for asked in plan.job.tool_segments:
        own = (u >= arrivals[asked.via - 1]) & (u <= arrivals[asked.via])
        points, rotation = poses[own, :3, 3], poses[own, :3, :3]
        found += _limit_faults(asked, points, seconds[own])
        if not asked.line:
            continue
        way = ways[asked.via]
        distance, part = way.nearest(points)
        clear = np.ones(len(points), dtype=bool)
        for corner, place in ((asked.via - 1, way.start[:3, 3]), (asked.via, way.end[:3, 3])):
            cut = cuts.get(corner, 0.0)
            if cut > 0.0:
                clear &= np.linalg.norm(points - place, axis=1) > 1.5 * cut + asked.tolerance_mm
        if np.any(distance[clear] > asked.tolerance_mm):
            found.append(f"P{asked.via}: {distance[clear].max():.3g} mm off its line")
        turned = way.turned_deg(rotation, part)
        # Where the tool leaves its line along it, the even turn there is another one.
        if np.any(turned[clear] > asked.tolerance_deg + _along_deg(way, asked)):
            found.append(f"P{asked.via}: turned {turned[clear].max():.3g} deg off")
    return found


def _along_deg(way: Way, asked: ToolSegment) -> float:
    """How far the orientation turns on a way as long as the tolerance."""
    length = np.linalg.norm(way.end[:3, 3] - way.start[:3, 3])
    whole = way.turned_deg(way.end[None, :3, :3], np.zeros(1))[0]
    return float(whole * min(1.0, asked.tolerance_mm / max(length, 1e-9)))


def _limit_faults(asked: ToolSegment, points: np.ndarray, seconds: np.ndarray) -> list[str]:
    found = []
    speed = np.diff(points, axis=0) / np.diff(seconds)[:, None]
    if asked.speed_mm_s and np.linalg.norm(speed, axis=1).max() > asked.speed_mm_s * (1 + 1e-6):
        found.append(
            f"P{asked.via}: {np.linalg.norm(speed, axis=1).max():.4g} mm/s of {asked.speed_mm_s:.4g}"
        )
    middle = 0.5 * (seconds[1:] + seconds[:-1])
    bend = np.linalg.norm(np.diff(speed, axis=0) / np.diff(middle)[:, None], axis=1)
    if asked.acceleration_mm_s2 and bend.max() > asked.acceleration_mm_s2 * 1.003:
        found.append(f"P{asked.via}: {bend.max():.4g} mm/s2 of {asked.acceleration_mm_s2:.4g}")
    return found


def allowed(arm: Arm, job: Job) -> bool:
    """Whether a dense check follows all lines of a job within the ranges, in small steps from posture to posture."""
    low, high = np.array([joint.range_deg for joint in arm.driven]).T
    here = np.array(job.via[0], dtype=float)
    led = {way.via: way for way in job.tool_segments}
    for via in range(1, len(job.via)):
        target = job.via[via]
        if via not in led:
            here = np.array(target, dtype=float)
            continue
        through = led[via].arc_through_mm
        start = tool_poses(arm, here[None])[0]
        way = Way(
            start, np.array(target.matrix), None if through is None else np.array(through), target.fixed
        )
        for part in np.linspace(0.0, 1.0, _FOLLOWED + 1)[1:]:
            after = _step(arm, here, way, part)
            if after is None or np.abs(after - here).max() > _LARGEST_STEP_DEG:
                return False
            if np.any(after < low - 1e-6) or np.any(after > high + 1e-6):
                return False
            here = after
    return True


def _step(arm: Arm, here: np.ndarray, way: Way, part: float) -> np.ndarray | None:
    position, rotation = (each[0] for each in way.pose(np.array([part])))
    angles = here.copy()
    for _ in range(20):
        turned = np.vstack([angles, angles + 1e-4 * np.eye(len(angles))])
        poses = tool_poses(arm, turned)
        gaps = (position - poses[:, :3, 3]) / 300.0
        if way.fixed == (APPROACH,):
            gaps = np.concatenate([gaps, rotation[:, 2] - poses[:, :3, 2]], axis=1)
        elif way.fixed:
            off = Rotation.from_matrix(rotation @ np.swapaxes(poses[:, :3, :3], 1, 2)).as_rotvec()
            gaps = np.concatenate([gaps, off], axis=1)
        if np.abs(gaps[0]).max() < 1e-7:
            return angles
        slope = (gaps[1:] - gaps[0]).T / 1e-4
        angles = angles - np.linalg.lstsq(slope, gaps[0], rcond=1e-6)[0]
        if not np.all(np.isfinite(angles)) or np.abs(angles - here).max() > 60.0:
            return None
    return None


class RandomArc(NamedTuple):
    """An arc of the tool."""

    arm: Arm
    start_deg: tuple[float, ...]
    end: Pose
    through_mm: tuple[float, float, float]


def random_arc(seed: int) -> RandomArc:
    """An arc of the SCARA or of the paper's arm, whose orientation is free."""
    rng = np.random.default_rng(seed)
    arm = Arm.paper() if seed % 2 else Arm.of("scara")
    low, high = np.array([joint.range_deg for joint in arm.driven]).T
    low, high = np.maximum(low, -170.0), np.minimum(high, 288.0)
    here = 0.5 * (low + high) + 0.3 * (high - low) * rng.uniform(-1.0, 1.0, len(low))
    there = np.clip(here + rng.uniform(-30.0, 30.0, len(here)), low, high)
    between = 0.5 * (here + there) + rng.uniform(-4.0, 4.0, len(here))
    end, through = tool_poses(arm, np.array([there, between]))
    x, y, z = through[:3, 3].tolist()
    end_pose = Pose(tuple(map(tuple, end.tolist())), fixed=())
    return RandomArc(arm, tuple(here.tolist()), end_pose, (x, y, z))
