"""The workspace of an arm: distances, motions against dense samples of their own, and what is refused in words."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from armtempo.basics import json_codec, toml_table
from armtempo.basics.errors import InputError, PlanError
from armtempo.diagnosis.arm_check import check_arm
from armtempo.kinematics.chain import outline_mm
from armtempo.model.arm import Arm
from armtempo.model.job import Job, Stop
from armtempo.model.parts import NOTHING, Load
from armtempo.model.sequence import Sequence
from armtempo.model.steps import Goto, Hold
from armtempo.model.tool_segment import ToolSegment
from armtempo.model.workspace import FAR_MM, KeepOut, Workspace, read
from armtempo.planning import lower_bounds, planner, point_to_point, sequence_planner, workspace_check
from armtempo.planning.capsules import box_distance, segment_distance
from armtempo.planning.free import free_path
from armtempo.planning.jog import jog_motion
from armtempo.planning.jog.jog_motion import JogMove
from armtempo.robot import goto

from tests.host import arms
from tests.host.random_workspaces import dense_least, random_workspace

PAPER = Arm.paper()
FEEDER = KeepOut("feeder", (-50.0, 150.0, -FAR_MM), (50.0, 400.0, FAR_MM))
OVER = r"over: the link of joint . is .* mm inside of feeder \(at .* s, between P0 and P1\)"


def thick(arm: Arm, radius_mm: float, workspace: Workspace | None) -> Arm:
    """The arm with links of this radius in a workspace."""
    return replace(
        arm, workspace=workspace, joints=tuple(replace(joint, radius_mm=radius_mm) for joint in arm.joints)
    )


def test_distances_are_exact() -> None:
    seed = 7
    rng = np.random.default_rng(seed)
    ends = rng.uniform(-3.0, 3.0, (4, 40, 3))
    part = np.linspace(0.0, 1.0, 401)[:, None, None]
    points = ends[0] + part * (ends[1] - ends[0])
    low, high = (-1.0, -0.5, -FAR_MM), (1.0, 1.5, 0.3)
    outside = np.maximum(np.maximum(np.array(low) - points, points - np.array(high)), 0.0)
    sampled = np.linalg.norm(outside, axis=2).min(axis=0)
    found = box_distance(ends[0], ends[1], low, high)
    assert np.all(np.maximum(found, 0.0) <= sampled + 1e-12), f"seed {seed}"
    assert np.abs(np.maximum(found, 0.0) - sampled).max() < 0.01
    others = ends[2] + part * (ends[3] - ends[2])
    pairs = np.array([np.linalg.norm(points - other, axis=2).min(axis=0) for other in others[::8]]).min(
        axis=0
    )
    apart = segment_distance(*ends)
    assert np.all(apart <= pairs + 1e-12)
    assert np.abs(apart - pairs).max() < 0.06


def test_inside_a_box_says_how_deep() -> None:
    start, end = np.array([[0.0, 0.0, 0.4]]), np.array([[0.0, 0.0, 3.0]])
    assert box_distance(start, end, (-1, -1, 0), (1, 1, 1))[0] == pytest.approx(-0.5, abs=0.15)


@pytest.mark.slow
@pytest.mark.seeds(*range(4))
def test_motions_in_random_workspaces_agree_with_dense_samples(seed: int) -> None:
    arm, trajectory = random_workspace(seed)
    touch = workspace_check.touch_of(arm, trajectory)
    least = dense_least(arm, trajectory, 200)
    if touch is None:
        assert least > 0.0, f"seed {seed}: accepted, {least:.3f} mm"
    else:
        assert least < 1.0, f"seed {seed}: {touch.description}, but {least:.3f} mm apart"


@pytest.mark.slow
@pytest.mark.seeds
def test_free_paths_in_random_workspaces_touch_nothing(seed: int) -> None:
    arm, trajectory = random_workspace(seed)
    via = trajectory(np.array([0.0, trajectory.duration_s]))
    if not workspace_check.touch_of(arm, trajectory) or workspace_check.posture_touches(arm, via[1]):
        return
    job = Job("free", via_deg=via.tolist(), path="free", holds=arm.payload.name if arm.payload else "")
    try:
        plan = planner.plan(replace(arm, loads=(arm.payload,) * bool(arm.payload)), job)
    except PlanError:
        return  # no path around is found
    assert dense_least(arm, plan.trajectory, 1500) > 0.0, f"seed {seed}"


def test_links_do_not_touch_each_other() -> None:
    """A planar arm folds its third link towards its first: accepted if all sampled points are apart."""
    seed, refused = 5, 0
    rng = np.random.default_rng(seed)
    links = (
        arms.joint(0.0, 100.0, 0.0),
        arms.joint(0.0, 100.0, 0.0),
        arms.joint(0.0, 100.0, 0.0),
    )
    arm = thick(arms.arm("fold", *links), 10.0, None)
    assert (1, 5) in workspace_check.Bodies(arm).pairs
    for _ in range(8):
        end = np.array([20.0, *rng.uniform(95.0, 130.0, 2)])
        trajectory = point_to_point.straight("fold", np.zeros(3), end, arm)
        points = outline_mm(arm, trajectory(np.linspace(0.0, trajectory.duration_s, 120)))
        third = (
            points[:, 4, None] + np.linspace(0.0, 1.0, 41)[:, None] * (points[:, 6] - points[:, 4])[:, None]
        )
        first = (
            points[:, 1, None] + np.linspace(0.0, 1.0, 41)[:, None] * (points[:, 2] - points[:, 1])[:, None]
        )
        apart = np.linalg.norm(first[:, :, None] - third[:, None], axis=3).min()
        touch = workspace_check.touch_of(arm, trajectory)
        refused += touch is not None
        assert (apart > 20.0) if touch is None else (apart < 21.0), f"seed {seed}: {apart}, {touch}"
    assert 0 < refused < 8


@pytest.mark.slow
def test_a_plan_names_link_obstacle_depth_time_and_via_points() -> None:
    job = Job(
        "over", via_deg=[[20, -60, 40], [90, -60, 40], [160, -60, 40]], refine=1, iterations=2, path="through"
    )
    assert planner.plan(PAPER, job)
    with pytest.raises(PlanError, match=OVER):
        planner.plan(thick(PAPER, 20.0, Workspace((FEEDER,))), job)


@pytest.mark.long
def test_a_free_path_goes_around_what_is_between_its_via_points(monkeypatch: pytest.MonkeyPatch) -> None:
    """Over a box, as seen by dense samples; if walls leave no way, it is refused as before."""
    calls: list[str] = []
    for module, name in ((lower_bounds, "of_vias"), (free_path, "_starts")):
        own = getattr(module, name)
        monkeypatch.setattr(
            module, name, lambda *given, own=own, name=name: calls.append(name) or own(*given)
        )
    via = [[20, -60, 40], [160, -60, 40], [100, -90, 20]]
    job = Job("over", via_deg=via, stops=(Stop(1, 0.5),), path="free", refine=5, starts=1)
    arm = thick(PAPER, 20.0, Workspace((replace(FEEDER, high_mm=(50.0, 400.0, 250.0)),)))
    plan = planner.plan(arm, job)
    assert "the path goes around feeder" in plan.notes
    assert dense_least(arm, plan.trajectory, 2000) > 0.0
    assert calls.count("of_vias") == 2, "of the first motion and of the last"
    assert calls.count("_starts") <= 4, "the tool may pass nearby: no plan from new starts"
    assert plan.searches[0].lower_bound_s <= plan.total_s < 10.0
    spline = plan.trajectory.joints[0]
    assert spline.via_segments is not None
    assert len(spline.via_segments) == 3
    np.testing.assert_allclose(plan.trajectory(np.array(spline.via_times_s)), via, atol=1e-6)
    seam = replace(
        job,
        via=(*job.via[:2], (165.0, -50.0, 30.0)),
        stops=(),
        tool_segments=(ToolSegment(2, line=True),),
        refine=3,
    )
    led = planner.plan(arm, seam)
    assert dense_least(arm, led.trajectory, 2000) > 0.0
    wall = replace(FEEDER, low_mm=(-20.0, 40.0, -FAR_MM), high_mm=(20.0, FAR_MM, FAR_MM))
    with pytest.raises(PlanError, match=OVER):
        planner.plan(replace(arm, workspace=Workspace((wall,))), job)


@pytest.mark.slow
def test_goto_and_jog_keep_to_the_room_and_lead_out_of_it(caplog: pytest.LogCaptureFixture) -> None:
    start = np.array([20.0, -60.0, 40.0])
    arm = thick(PAPER, 20.0, Workspace((FEEDER,)))
    with pytest.raises(PlanError, match="inside of feeder"):
        goto.motion(arm, start, np.array([160.0, -60.0, 40.0]), goto.MovePace())
    jog = jog_motion.plan("jog", arm, start, JogMove(np.inf, joint=0))
    assert "would touch feeder" in jog.ends
    assert workspace_check.touch_of(arm, jog.trajectory) is None
    assert start[0] + 5.0 < jog.end_deg[0] < 90.0
    inside = np.array([90.0, -60.0, 40.0])
    assert workspace_check.posture_touches(arm, inside)
    out = point_to_point.straight("out", inside, start, arm)
    assert workspace_check.touch_of(arm, out) is not None
    assert workspace_check.touch_of(arm, out, outwards=True) is None
    goto.motion(arm, inside, start, goto.MovePace())
    (told,) = {record.message for record in caplog.records}
    assert "where it starts; it may move out only" in told


@pytest.mark.slow
def test_a_plan_that_starts_where_it_touches_is_refused_unless_it_says_so_and_never_comes_back() -> None:
    arm = thick(PAPER, 20.0, Workspace((FEEDER,)))
    inside, outside = (90.0, -60.0, 40.0), (20.0, -60.0, 40.0)
    out = Job("out", via=(inside, outside), path="through", optimiser="gradient", starts=1)
    touch = max(workspace_check.posture_touches(arm, inside), key=lambda each: each.depth_mm)
    with pytest.raises(PlanError, match=f"out: {touch.description} where it starts"):
        planner.plan(arm, out)
    plan = planner.plan(arm, replace(out, start_touches=True))
    assert dense_least(arm, plan.trajectory, 200) < 0.0
    with pytest.raises(PlanError, match=r"feeder \(at [1-9]"):
        planner.plan(arm, replace(out, start_touches=True, via=(inside, outside, inside)))


@pytest.mark.slow
def test_what_the_tool_holds_keeps_to_the_room_from_the_step_on_that_says_so() -> None:
    """Below the tool of the turning arm, which is 79 mm above the box."""
    cup = Load("cup", radius_mm=10.0, length_mm=100.0, along="x", centre_mm=(0.0, 0.0, 30.0))
    arm = replace(thick(PAPER, 20.0, None), loads=(cup,))
    start, end = (20.0, -60.0, 40.0), (160.0, -60.0, 40.0)
    low = workspace_check.Bodies(arm.holding("cup")).ends(np.array([[90.0, -60.0, 40.0]]))
    box = KeepOut("box", (-150.0, 60.0, -FAR_MM), (150.0, 400.0, float(low[0][-1, 0, 2]) - 15.0))
    assert workspace_check.Bodies(arm).ends(np.array([start]))[0].shape == (12, 1, 3)
    for top, refused in ((0.0, False), (10.0, True)):
        raised = replace(box, high_mm=(150.0, 400.0, box.high_mm[2] + top))
        there = replace(arm, workspace=Workspace((raised,)))
        touch = workspace_check.touch_of(
            there.holding("cup"), point_to_point.straight("over", start, end, arm)
        )
        assert (touch is not None) == refused
    for line in (False, True):
        with pytest.raises(PlanError, match="the load cup is"):
            goto.motion(there.holding("cup"), np.array(start), np.array(end), goto.MovePace(line=line))
    steps = (Goto(start), Goto(end), Hold("cup"), Goto(start))
    with pytest.raises(PlanError, match="goto: the load cup is"):
        sequence_planner.plan(there, Sequence("carry", steps))
    found = sequence_planner.plan(there, Sequence("carry", (*steps[:3], Hold(NOTHING), steps[3])))
    assert tuple(leg.load for leg in found.legs) == ("", "nothing")


def test_check_names_postures_that_touch() -> None:
    arm = thick(PAPER, 20.0, Workspace(high_mm=(FAR_MM, FAR_MM, 200.0)))
    assert any("the ceiling" in finding.what and "home" in finding.what for finding in check_arm(arm))
    assert not any(finding.where == "workspace" for finding in check_arm(PAPER))


FILE = """
[workspace]
floor_mm = 0
x_mm = [-100, 300]
[[workspace.keep_out]]
name = "feeder"
low_mm = [1, 2, 3]
high_mm = [4, 5, 6]
"""


def test_a_file_says_walls_and_boxes() -> None:
    found = read(toml_table.parse(FILE, "arm.toml"))
    assert found is not None
    assert read(toml_table.parse(FILE.replace("workspace", "room"), "arm.toml")) == found, (
        "as older files call it"
    )
    there = replace(PAPER, workspace=found)
    assert json_codec.encode(there)["room"], "as in older trajectory files"
    assert json_codec.decode(Arm, json_codec.encode(there), "arm") == there
    names = [obstacle.name for obstacle in found.obstacles]
    assert names == ["feeder", "the wall at x = -100", "the wall at x = 300", "the floor"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[4, 5, 6]", "[4, 5, 3]", "not corners"),
        ("[-100, 300]", "[300, -100]", "smaller first"),
        ("floor_mm = 0", "ceiling_mm = 0\nfloor_mm = 1", "above floor_mm"),
        ("floor_mm", "flor_mm", "unknown key"),
    ],
)
def test_what_a_workspace_may_not_say(old: str, new: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read(toml_table.parse(FILE.replace(old, new), "arm.toml"))


def test_an_arm_file_has_radii_workspace_and_loads(tmp_path: Path) -> None:
    text = Path(PAPER.source).read_text(encoding="utf-8")
    file = tmp_path / "arm.toml"
    file.write_text(
        text.replace("d_mm", "radius_mm = 12\nd_mm", 1)
        + "\n[workspace]\nfloor_mm = -5\n[load.cup]\nradius_mm = 30\ncentre_mm = [0, 0, 40]\n",
        encoding="utf-8",
    )
    arm = Arm.load(file)
    assert arm.workspace == Workspace(low_mm=(-FAR_MM, -FAR_MM, -5.0))
    assert arm.joints[0].radius_mm == 12.0
    assert arm.holding("cup").payload == Load("cup", radius_mm=30.0, centre_mm=(0.0, 0.0, 40.0))
    file.write_text(file.read_text(encoding="utf-8") + "[room]\n", encoding="utf-8")
    with pytest.raises(InputError, match="room: unknown key"):
        Arm.load(file)
    file.write_text(file.read_text(encoding="utf-8").removesuffix("[room]\n"), encoding="utf-8")
    job = 'name = "j"\nvia_deg = [[0, 0, 0], [1, 1, 1]]\nholds = '
    assert Job.of_table(toml_table.parse(job + '"cup"', "job.toml"), arm).holds == "cup"
    with pytest.raises(InputError, match=r"job\.toml: holds: .* no load 'cub'; did you mean 'cup'"):
        Job.of_table(toml_table.parse(job + '"cub"', "job.toml"), arm)
    text = file.read_text(encoding="utf-8")
    for old, new, message in (
        (".cup", f".{NOTHING}", "means no load"),
        ("s_mm = 30", "s_mm = -1", "radius_mm = -1 is not"),
    ):
        file.write_text(text.replace(old, new), encoding="utf-8")
        with pytest.raises(InputError, match=message):
            Arm.load(file)
