"""Lines, arcs, cut corners and speeds of the tool: plans looked at by code of their own, and what is refused."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError, PlanError
from armtempo.model.arm import Arm
from armtempo.model.job import Job, Stop
from armtempo.model.plan import Plan
from armtempo.model.pose import from_rpy
from armtempo.model.tool_pose import Pose
from armtempo.model.tool_segment import ToolSegment
from armtempo.planning import planner
from armtempo.planning.fixed_path import FixedPath
from armtempo.planning.free.angle_bounds import of_path
from armtempo.planning.line import deviation, line_path, tool_path
from armtempo.planning.line.deviation import LineDeviation, SplinePieces, halved
from armtempo.planning.line.follow import Course, follow, passed
from armtempo.planning.line.tool_path import ToolPath
from armtempo.robot import goto
from armtempo.splines import bspline

from tests.host.arms import PLANAR_3
from tests.host.problems import faults
from tests.host.random_lines import allowed, line_faults, random_arc, random_lines, tool_poses
from tests.plans import changed

ARM = Arm.of("parol6")
START = (90.0, -100.0, 200.0, 5.0, 40.0, 180.0)
HERE = tool_poses(ARM, np.array([START]))[0]


def moved(x: float, y: float, z: float) -> Pose:
    """The tool's pose at the start, moved in mm."""
    pose = HERE.copy()
    pose[:3, 3] += (x, y, z)
    return Pose(tuple(map(tuple, pose.tolist())))


HALF = tuple(np.array(moved(30, 10, -15).matrix)[:3, 3])
FLIPPED = ((90.0, -100.0, 200.0, -90.0, 40.0, 180.0), (95.0, -100.0, 200.0, 90.0, -40.0, 0.0))
"""The wrist turned over on the way."""
JOB = Job(
    "lines",
    via=(START, moved(60, 20, -30), moved(-20, 30, 0)),
    tool_segments=(ToolSegment(1, True), ToolSegment(2, True)),
)


@pytest.mark.slow
@pytest.mark.seeds(1005)
def test_random_lines_hold_when_looked_at_densely(seed: int) -> None:
    """A job that is refused is followed in small steps: where that reaches the end, it is refused wrongly."""
    arm, job = random_lines(seed)
    if not job.tool_segments:
        return
    try:
        plan = planner.plan(arm, job)
    except PlanError:
        plan = None
    if plan is None:
        assert not allowed(arm, job), f"seed {seed}: refused wrongly"
        return
    assert faults(plan, 1e9) + line_faults(plan) == [], f"seed {seed}"


@pytest.fixture(scope="module")
def plan() -> Plan:
    ways = (
        ToolSegment(1, True, speed_mm_s=80.0, acceleration_mm_s2=700.0),
        ToolSegment(2, True, (40.0, 150.0, 440.0)),
    )
    return planner.plan(ARM, replace(JOB, tool_segments=ways, refine=2))


@pytest.mark.slow
def test_a_line_and_an_arc_keep_speed_tolerance_and_rests(plan: Plan, tmp_path: Path) -> None:
    assert faults(plan) + line_faults(plan) == []
    assert any("no more than 80 mm/s" in note or "no more than 79." in note for note in plan.notes)
    spline = plan.trajectory.joints[0]
    assert np.abs(plan.trajectory(spline.via_times_s, 1)).max() < 1e-6
    plan.save(tmp_path / "plan.json")
    again = Plan.load(tmp_path / "plan.json")
    assert again.job == plan.job
    assert again.notes == plan.notes
    assert len(json.loads((tmp_path / "plan.json").read_text())["plan"]["job"]["ways"]) == 2, (
        "as in older files"
    )


@pytest.mark.slow
def test_a_wait_after_a_line_and_a_free_path_after_it() -> None:
    """The arm stands still for as long as asked; then it is faster than on the spline."""
    vias = ((80.0, -90.0, 200.0, 40.0, 60.0, 100.0), (60.0, -80.0, 180.0, 20.0, 20.0, 150.0))
    job = replace(
        JOB, via=(*JOB.via[:2], *vias), tool_segments=(ToolSegment(1, True),),
        stops=(Stop(1, 1.5),), path="free", refine=6, starts=1
    )  # fmt: skip
    plan = planner.plan(ARM, job)
    assert faults(plan) + line_faults(plan) == []
    times_s = plan.trajectory.joints[0].via_times_s
    assert np.ptp(plan.trajectory(np.linspace(times_s[1], times_s[1] + 1.5, 50)), axis=0).max() < 1e-9
    assert plan.searches[0].lower_bound_s < plan.trajectory.duration_s == plan.searches[0].total_s
    spline = planner.plan(ARM, Job("spline", via=(tuple(plan.via_deg[1]), *vias), timing="shared", refine=6))
    assert times_s[-1] - times_s[1] - 1.5 < 0.99 * spline.trajectory.duration_s


@pytest.mark.slow
def test_faults_of_a_line_are_seen(plan: Plan) -> None:
    """The check itself: a plan checked against a line nearby, and against a lower speed."""
    ways = (replace(plan.job.tool_segments[0], speed_mm_s=79.0), plan.job.tool_segments[1])
    assert line_faults(changed(plan, job=replace(plan.job, tool_segments=ways)))
    ways = (replace(plan.job.tool_segments[0], tolerance_mm=0.01), plan.job.tool_segments[1])
    assert line_faults(changed(plan, job=replace(plan.job, tool_segments=ways)))


@pytest.mark.slow
def test_a_redundant_arm_accelerates_its_tool_as_the_closed_form_does() -> None:
    """Its joints move far and the tool hardly, so the proof needs short pieces, which rounding must not hide."""
    here = (10.0, 40.0, 50.0)
    start, end = tool_poses(PLANAR_3, np.array([here, (30.0, 20.0, 40.0)]))
    segment = ToolSegment(1, True, acceleration_mm_s2=3.0)
    to = Pose(tuple(map(tuple, end.tolist())), fixed=())
    plan = planner.plan(PLANAR_3, Job("slow", via=(here, to), tool_segments=(segment,), refine=4))
    distance_mm = float(np.linalg.norm(end[:3, 3] - start[:3, 3]))
    assert 1.0 <= plan.total_s / (2.0 * np.sqrt(distance_mm / 3.0)) < 1.02


@pytest.mark.slow
def test_the_bound_holds_and_is_sharp() -> None:
    """Random splines next to a line: no sample of them is beyond the bound, and it is near to the largest."""
    seed = 31
    rng = np.random.default_rng(seed)
    led = line_path.led_legs(
        ARM, replace(JOB, via=JOB.via[:2], tool_segments=JOB.tool_segments[:1]), _via(JOB)[:2]
    )[0]
    course, tool = led.followed.course, led.followed.tool
    for size in (0.03, 1.0, 5.0):
        angles = bspline.fit(led.followed.at(led.distances(8)), 5)
        angles = angles + size * rng.uniform(-1, 1, angles.shape)
        ways = bspline.fit(led.distances(8), 5)
        pieces = SplinePieces(of_path(angles, 5), of_path(ways[:, None], 5)[:, :, 0])
        arguments = pieces, tool, course.path, course.fixed
        found = deviation.proven(*arguments, LineDeviation(0.5, 0.5))
        u = np.linspace(0.0, 1.0, 201)
        powers = u[:, None] ** np.arange(6)
        dense = np.einsum("up,spj->suj", powers, bspline.polynomials(angles, 5)).reshape(-1, 6)
        along = np.einsum("up,sp->su", powers, bspline.polynomials(ways, 5)).ravel()
        poses = tool_poses(ARM, dense)
        position, rotation = course.path.poses(along)
        away = np.linalg.norm(poses[:, :3, 3] - position, axis=1).max()
        cosine = 0.5 * (np.trace(poses[:, :3, :3] @ np.swapaxes(rotation, 1, 2), axis1=1, axis2=2) - 1.0)
        turned = np.degrees(np.arccos(np.clip(cosine.min(), -1.0, 1.0)))
        assert away <= found.position_mm <= 1.05 * away + 0.02, f"seed {seed}, {size}"
        assert turned <= found.rotation_deg <= 1.05 * turned + 0.05, f"seed {seed}, {size}"
        work = [whether(arguments, part * np.array(found)) for part in (0.3, 0.97, 1.03, 2.0, 5.0)]
        assert np.sum(work, axis=0)[1] < np.sum(work, axis=0)[0], f"seed {seed}, {size}"


def whether(arguments: tuple[Any, ...], enough: Array) -> tuple[int, int]:
    """Pieces that are halved for the deviation, and for whether it is within bounds, which comes out the same."""
    pieces: list[int] = []
    most = LineDeviation(*enough)

    def counted(angles: Array) -> Array:
        pieces.append(len(angles))
        return halved(angles)

    with patch.object(deviation, "halved", counted):
        whole = deviation.proven(*arguments, most)
        count = sum(pieces)
        quick = deviation.proven(*arguments, most, whether=True)
    assert np.all(np.array(whole) <= enough) == np.all(np.array(quick) <= enough), (enough, whole, quick)
    assert sum(pieces) <= 2 * count
    return count, sum(pieces) - count


def _via(job: Job) -> np.ndarray:
    return planner.via_angles(ARM, job)[0]


def test_a_cut_corner_is_smooth_and_near() -> None:
    first = tool_path.line(HERE, np.array(moved(60, 0, 0).matrix), np.array([0.0, 0.0, 0.4]), "")
    corner = np.array(moved(60, 0, 0).matrix)
    corner[:3, :3] = first.turned(np.array([first.length]))[0] @ HERE[:3, :3]
    end = np.array(moved(60, 40, 0).matrix)
    path = ToolPath((first, tool_path.line(corner, end, np.array([0.3, 0.0, 0.0]), "")), (15.0,))
    ways = np.linspace(0.0, path.length, 20_001)
    position, rotation = path.poses(ways)
    speed = np.linalg.norm(np.diff(position, axis=0), axis=1) / np.diff(ways)
    assert speed.max() <= 1.0 + 1e-9
    assert np.linalg.norm(np.diff(position, 2, axis=0), axis=1).max() / ways[1] ** 2 <= path.bounds.bend
    turned = tool_path.rotation_vectors(rotation[1:] @ np.swapaxes(rotation[:-1], 1, 2)) / ways[1]
    assert np.linalg.norm(turned, axis=1).max() <= path.bounds.turn * (1 + 1e-6)
    assert np.linalg.norm(np.diff(turned, axis=0), axis=1).max() / ways[1] <= path.bounds.turn_bend * (
        1 + 1e-3
    )
    inside = np.abs(ways - 60.0) < 15.0
    away = np.min(np.linalg.norm(position[inside, None] - position[None, ~inside][:, ::50], axis=2))
    assert away < 1.0
    assert 1.0 < np.linalg.norm(position - corner[:3, 3], axis=1).min() < 15.0


def test_arcs_go_through_their_point() -> None:
    start, end = np.eye(4), np.eye(4)
    end[:3, 3] = (0.0, 20.0, 0.0)
    piece = tool_path.arc(start, (-10.0, 10.0, 0.0), end, np.zeros(3), "", 0.5)
    assert piece.length == pytest.approx(10.0 * np.pi)
    half = piece.moved(np.array([0.5 * piece.length, piece.length]))
    assert half == pytest.approx(np.array([[-10.0, 10.0, 0.0], [0.0, 20.0, 0.0]]))


@pytest.mark.parametrize(
    ("through", "end"),
    [
        ((30.0, 20.0, 0.0), (0.0, 0.0, 0.0)),
        ((30.0, 20.0, 0.0), (1e-7, 0.0, 0.0)),
        ((0.0, 0.0, 0.0), (60.0, 0.0, 0.0)),
        ((60.0, 0.0, 0.0), (60.0, 0.0, 0.0)),
        ((0.0, 1e-7, 0.0), (60.0, 0.0, 0.0)),
        ((60.0, 0.0, 1e-7), (60.0, 0.0, 0.0)),
        ((90.0, 0.0, 0.0), (60.0, 0.0, 0.0)),
        ((90.0, 1e-5, 0.0), (60.0, 0.0, 0.0)),
        ((-40.0, 0.0, -1e-4), (60.0, 0.0, 0.0)),
        ((30.0, 0.0, 0.0), (60.0, 0.0, 0.0)),
    ],
)
def test_arcs_that_their_points_do_not_define_are_refused(
    through: tuple[float, float, float], end: tuple[float, float, float]
) -> None:
    there = np.eye(4)
    there[:3, 3] = end
    with pytest.raises(
        PlanError, match=r"P0 to P1: the start, arc_through_mm and the end do not define an arc"
    ):
        tool_path.arc(np.eye(4), through, there, np.zeros(3), "P0 to P1", 0.5)


@pytest.mark.parametrize("aside", [1e-7, 1e-4, 5e-3])
def test_circles_through_points_nearly_on_a_line_are_refused(aside: float) -> None:
    points = ((20.0, aside, 0.0), (40.0, 0.0, 0.0))
    with pytest.raises(PlanError, match=r"circle_through_mm do not define a circle within 0\.5 mm"):
        tool_path.full_circle(np.eye(4), points, np.eye(4), np.zeros(3), "P0 to P1", 0.5)
    round_ones = ((20.0, 20.0, 0.0), (40.0, 0.0, 0.0))
    circle = tool_path.full_circle(np.eye(4), round_ones, np.eye(4), np.zeros(3), "", 0.5)
    assert circle.length == pytest.approx(40.0 * np.pi)


@pytest.mark.slow
def test_ordinary_arcs_are_defined() -> None:
    rng = np.random.default_rng(41)
    for _ in range(200):
        start, end = np.eye(4), np.eye(4)
        turn, radius = rng.uniform(0.1, 6.0), rng.uniform(5.0, 500.0)
        start[:2, 3] = radius, 0.0
        end[:2, 3] = radius * np.cos(turn), radius * np.sin(turn)
        middle = (radius * np.cos(turn / 2), radius * np.sin(turn / 2), 0.0)
        piece = tool_path.arc(start, middle, end, np.zeros(3), "", 0.5)
        assert piece.length == pytest.approx(radius * turn), "seed 41"


@pytest.mark.slow
def test_a_full_circle_comes_back(tmp_path: Path) -> None:
    points = tuple(tuple(np.array(moved(*by).matrix)[:3, 3]) for by in ((20, 20, 0), (40, 0, 0)))
    ways = (ToolSegment(1, True, circle_through_mm=points),)
    plan = planner.plan(ARM, Job("circle", via=(START, moved(0, 0, 0)), tool_segments=ways, refine=2))
    assert faults(plan) == []
    middle = HERE[:3, 3] + (20.0, 0.0, 0.0)
    poses = tool_poses(ARM, plan.trajectory(np.linspace(0.0, plan.trajectory.duration_s, 400)))
    assert np.linalg.norm(poses[:, :3, 3] - middle, axis=1) == pytest.approx(20.0, abs=0.5)
    angles = np.unwrap(np.arctan2(*(poses[:, :2, 3] - middle[:2]).T[::-1]))
    assert abs(angles[-1] - angles[0]) == pytest.approx(2 * np.pi, abs=1e-6)
    plan.save(tmp_path / "plan.json")
    assert Plan.load(tmp_path / "plan.json").job == plan.job


@pytest.mark.parametrize(
    "axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.6, -0.8, 0), (-1, 2, -3), (1e-9, -1, 0)]
)
@pytest.mark.parametrize("short_of", [0.0, 1e-13, 1e-9, 1e-4])
def test_half_turns_have_a_rotation_vector(axis: tuple[float, float, float], short_of: float) -> None:
    vector = (np.pi - short_of) * np.array(axis) / np.linalg.norm(axis)
    matrix = tool_path.rotations(vector[None])
    found = tool_path.rotation_vectors(matrix)
    assert np.linalg.norm(found) == pytest.approx(np.pi, abs=2e-4)
    np.testing.assert_allclose(tool_path.rotations(found), matrix, atol=1e-8)


def test_a_line_that_turns_the_tool_by_half_a_turn_is_refused() -> None:
    arm = Arm.of("ar4")
    here = from_rpy((250.0, 0.0, 300.0), (180.0, 0.0, 0.0))
    there = from_rpy((290.0, 0.0, 300.0), (180.0, 0.0, 180.0))
    job = Job(
        "half", via=(Pose.of_matrix(here), Pose.of_matrix(there)), tool_segments=(ToolSegment(1, True),)
    )
    with pytest.raises(PlanError, match="turns by 180 degrees"):
        planner.plan(arm, job)


def test_a_line_that_does_not_end_at_its_pose_is_refused() -> None:
    """Of pitch alone nothing is kept on the way."""
    pose = Pose.of_angles(HERE[:3, 3] + (10.0, 0.0, 0.0), {"pitch": 70.0})
    with pytest.raises(PlanError, match=r"P1: the line ends .* deg from the pose"):
        planner.plan(ARM, Job("pitch", via=(START, pose), tool_segments=(ToolSegment(1, True),)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"via": (START, moved(400, 0, 0))}, "P0 to P1, at .* of 400.0 mm"),
        ({"via": (START, moved(0, 0, 0))}, "the tool is at this point already"),
        ({"tool_segments": (ToolSegment(1, True, blend_mm=80.0), ToolSegment(2, True))}, "more than half"),
        ({"via": FLIPPED}, "joint 4 at -90 degrees, not 90"),
        ({"tool_segments": (ToolSegment(1, True, HALF),)}, "one line"),
        ({"tool_segments": (ToolSegment(1, True, circle_through_mm=(HALF, HALF)),)}, "ends where it began"),
    ],
)  # fmt: skip
def test_what_cannot_be_followed_says_where(change: dict[str, object], message: str) -> None:
    job = replace(JOB, **change)  # type: ignore[arg-type]
    job = replace(job, tool_segments=tuple(way for way in job.tool_segments if way.via < len(job.via)))
    with pytest.raises(PlanError, match=message):
        planner.plan(ARM, job)


def test_a_straight_wrist_on_the_way_is_named() -> None:
    """A line on which joint 5 passes 0: the arm changes its branch, and the place is said."""
    start = np.array([90.0, -100.0, 200.0, 0.0, 8.0, 180.0])
    pose = tool_poses(ARM, start[None])[0]
    end = tool_poses(ARM, np.array([[90.0, -100.0, 200.0, 0.0, -8.0, 180.0]]))[0]
    turn = tool_path.turn_between(pose[:3, :3], end[:3, :3], "")
    path = ToolPath((tool_path.line(pose, end, turn, ""),))
    found = follow(Course(ARM, path, ("roll", "pitch", "yaw"), "P0 to P1"), start)
    words = passed(found)
    assert len(words) == 1
    assert "changes its branch (wrist)" in words[0]
    assert f"of {path.length:.1f} mm" in words[0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"path": "free", "corridor_deg": 1.0}, "with a corridor"),
        ({"timing": "per-joint"}, 'need timing = "shared"'),
        ({"degree": 3}, "degree 5"),
        ({"tool_segments": (ToolSegment(3, True),)}, "tool_segments lead to via points"),
        ({"tool_segments": (ToolSegment(1, True, blend_mm=5.0),)}, "needs a line on both sides"),
    ],
)
def test_jobs_that_do_not_fit_are_refused(change: dict[str, object], message: str) -> None:
    with pytest.raises(InputError) as raised:
        planner.plan(ARM, replace(JOB, **change))  # type: ignore[arg-type]
    assert message in f"{raised.value.problem} {raised.value.hint}"


@pytest.mark.slow
def test_goto_in_a_line_is_as_slow_as_asked() -> None:
    end = tuple(np.array(START) + np.array([2.0, 2.0, -2.0, 0.0, 1.0, 0.0]))
    whole, half = (
        goto.motion(ARM, np.array(START), np.array(end), goto.MovePace(speed, True)) for speed in (1.0, 0.5)
    )
    assert half.duration_s == pytest.approx(2.0 * whole.duration_s)
    assert half(half.duration_s) == pytest.approx(np.array(end), abs=1e-6)
    times = np.linspace(0.0, half.duration_s, 301)
    way = tool_poses(ARM, half(times))[:, :3, 3]
    along = (way[-1] - way[0]) / np.linalg.norm(way[-1] - way[0])
    assert np.abs(np.cross(way - way[0], along)).max() < 0.5


FILE = """
name = "glue"
speed_mm_s = 50
[[via]]
angles_deg = [90, -100, 200, 5, 40, 180]
[[via]]
position_mm = [58, 156, 418]
approach = [0.056, -0.343, -0.9376]
line = true
tolerance_mm = 0.2
blend_mm = 5
[[via]]
position_mm = [-22, 166, 448]
arc_through_mm = [20, 170, 440]
speed_mm_s = 20
"""


def test_a_job_file_says_all_of_it(tmp_path: Path) -> None:
    file = tmp_path / "glue.toml"
    file.write_text(FILE, encoding="utf-8")
    job = Job.load(file, ARM)
    assert job.tool_segments == (
        ToolSegment(1, True, tolerance_mm=0.2, blend_mm=5.0),
        ToolSegment(2, True, (20.0, 170.0, 440.0), speed_mm_s=20.0),
    )
    assert job.speed_mm_s == 50.0
    assert isinstance(job.via[1], Pose)
    assert job.via[1].tolerance_mm == Pose.tolerance_mm


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("line = true\n", "", "blend_mm"),
        ("blend_mm = 5", "blend_mm = 0", "blend_mm"),
        ("blend_mm = 5", "speed_mm_s = -1", "speed_mm_s"),
        ("arc_through_mm = [20, 170, 440]", "arc_through_mm = [20, 170]", "arc_through_mm"),
        ("5, 40, 180]", "5, 40, 180]\nline = true", "first via point"),
    ],
)  # fmt: skip
def test_what_a_file_may_not_say(tmp_path: Path, old: str, new: str, message: str) -> None:
    file = tmp_path / "glue.toml"
    file.write_text(FILE.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=message):
        Job.load(file, ARM)


@pytest.mark.long
@pytest.mark.seeds(1)
def test_a_wider_tolerance_of_an_arc_is_never_slower(seed: int) -> None:
    """Nor is any plan much slower than the optimal time axis of the spline through many postures on the exact arc."""
    arm, start_deg, end, through_mm = random_arc(seed)
    segment = ToolSegment(1, True, through_mm, tolerance_mm=1.3, tolerance_deg=90.0)
    job = Job("arc", via=(start_deg, end), tool_segments=(segment,))
    jobs = [
        replace(job, tool_segments=(replace(segment, tolerance_mm=tolerance_mm),))
        for tolerance_mm in (1.3, 0.3, 0.03)
    ]
    try:
        line_path.led_legs(arm, jobs[-1], planner.via_angles(arm, job)[0])
    except PlanError:  # what can be followed must be planned, whatever the tolerance
        pytest.skip(f"seed {seed}: the arm cannot follow this arc, or its points do not define it")
    times = []
    for each in jobs:
        plan = planner.plan(arm, each)
        assert faults(plan, at_via_deg=1e-3) + line_faults(plan) == [], f"seed {seed}"
        times.append(plan.total_s)
    (led,) = line_path.led_legs(arm, plan.job, plan.via_deg).values()
    angles = led.followed.at(led.distances(256))
    moving = np.ptp(angles, axis=0) > 1e-9
    limits = [joint.limits for joint, moves in zip(arm.driven, moving, strict=True) if moves]
    exact = FixedPath(bspline.fit(angles[:, moving], line_path.DEGREE), line_path.DEGREE, limits, 4)
    exact_s = exact.optimum(np.ones(exact.variables.differences), 1e-4).total_s
    assert times[0] <= times[1] * (1.0 + 1e-9) <= times[2] * (1.0 + 2e-9), f"seed {seed}: {times}"
    assert max(times) <= 1.005 * exact_s, f"seed {seed}: {times}, {exact_s}"
