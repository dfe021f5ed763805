"""Tools of an arm file: the same as constant rows after the last joint; chosen by a job, and part of the last link."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from armtempo import pipeline
from armtempo.basics import json_codec, toml_table
from armtempo.basics.errors import InputError
from armtempo.cli import main
from armtempo.encoding import encode, made_with
from armtempo.kinematics import dynamics
from armtempo.kinematics.forward import forward as of_geometry
from armtempo.kinematics.geometry import Geometry
from armtempo.kinematics.of_arm import forward, inverse, inverse_many
from armtempo.kinematics.solver import PoseSolver
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.parts import Dynamics, Joint, Load
from armtempo.model.sequence import Sequence
from armtempo.model.tool import ArmTool
from armtempo.model.tool_pose import Pose
from armtempo.model.tool_segment import ToolSegment
from armtempo.planning import planner, via_points, workspace_check
from armtempo.planning.jog import jog_motion
from armtempo.planning.jog.jog_motion import JogMove
from armtempo.planning.tool import Tool
from armtempo.splines.trajectory import Trajectory
from click.testing import CliRunner

from tests.host import arms
from tests.host.arms import FIVE, FOUR, OFFSET_WRIST, SIX, THREE

TOOL = """
[tool.gripper]
position_mm = [15, -8, 70]
rpy_deg = [20, -30, 40]
mass_kg = 0.2
radius_mm = 20

[tool.pen]
position_mm = [0, 0, 90]
"""


def row(name: str, theta: float, d: float, a: float, alpha: float) -> Joint:
    """A row of the table that never turns."""
    return Joint(name, d, a, alpha, theta, (-0.001, 0.001))


ROWS = (
    row("t1", 25.0, 40.0, 12.0, -35.0),
    row("t2", -70.0, -18.0, 30.0, 80.0),
    row("t3", 15.0, 22.0, 0.0, 0.0),
)


def both(arm: Arm) -> tuple[Arm, Arm]:
    """An arm with a tool, and one whose table has rows for it."""
    with_rows = replace(arm, joints=(*arm.joints, *ROWS))
    bare, more = (Geometry.of(each) for each in (arm, with_rows))
    zero = np.zeros(len(arm.joints))
    there = np.linalg.inv(of_geometry(bare, zero)) @ of_geometry(more, np.zeros(len(with_rows.joints)))
    rows = tuple(map(tuple, there.tolist()))
    return replace(arm, tool=ArmTool("gripper", rows)), with_rows


ARMS = (Arm.load("ar4"), SIX, OFFSET_WRIST, FIVE, FOUR, THREE, Arm.paper())


@pytest.mark.parametrize("arm", ARMS, ids=lambda arm: arm.name)
def test_a_tool_is_as_rows_after_the_last_joint(arm: Arm) -> None:
    rng = np.random.default_rng(17)
    tooled, rows = both(arm)
    assert encode.arm_record(tooled) == encode.arm_record(arm), "the board knows nothing of it"
    low, high = np.array([joint.range_deg for joint in arm.driven]).T
    postures = rng.uniform(0.9 * low, 0.9 * high, (6, len(low)))
    poses = forward(tooled, postures)
    np.testing.assert_allclose(poses, forward(rows, postures), atol=1e-9)
    np.testing.assert_allclose(poses[0], forward(tooled, postures[0]), atol=1e-12)
    driven = list(range(len(low)))
    one, other = (Tool(each, driven, postures[0]) for each in (tooled, rows))
    for name in ("position_mm", "rotation", "slope_mm_deg", "axes_deg"):
        np.testing.assert_allclose(
            getattr(one.at(postures), name), getattr(other.at(postures), name), atol=1e-9, err_msg=name
        )
    moved, wanted = (each.moved(postures, postures + 1.0, postures - 2.0) for each in (one, other))
    np.testing.assert_allclose(moved, wanted, rtol=1e-9, atol=1e-9)
    flange = forward(arm, postures)[:, :3, 3]
    assert np.all(one.reach_mm >= np.linalg.norm(poses[:, :3, 3] - flange, axis=1).max() - 1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("arm", [Arm.load("ar4"), SIX, OFFSET_WRIST], ids=lambda arm: arm.name)
def test_the_inverse_brings_the_tool_to_the_pose(arm: Arm) -> None:
    rng = np.random.default_rng(18)
    tooled, rows = both(arm)
    assert PoseSolver(tooled).refusals == PoseSolver(arm).refusals, "a closed form stays one"
    low, high = np.array([joint.range_deg for joint in arm.driven]).T
    postures = rng.uniform(0.6 * low, 0.6 * high, (2, len(low)))
    poses = forward(tooled, postures)
    for pose, posture in zip(poses, postures, strict=True):
        found = inverse(tooled, pose, posture)
        np.testing.assert_allclose(forward(tooled, found[0].angles_deg), pose, atol=1e-3)
        assert min(np.abs(each.angles_deg - posture).max() for each in found) < 1e-3
        same = inverse(rows, pose, posture)
        assert len(same) == len(found)
    if not PoseSolver(tooled).refusals:
        many = inverse_many(tooled, poses, postures[0])
        np.testing.assert_allclose(forward(tooled, many.nearest_deg), poses, atol=1e-6)


@pytest.mark.slow
def test_jogs_turn_about_the_tools_point_and_lines_are_of_it() -> None:
    tooled, _ = both(Arm.load("ar4"))
    here = [10.0, 10.0, -20.0, 5.0, 60.0, 0.0]
    turned = jog_motion.plan("j", tooled, here, JogMove(8.0, axis="tool-y", about=True)).trajectory
    places = forward(tooled, turned(np.linspace(0, turned.duration_s, 50)))[:, :3, 3]
    assert np.abs(places - places[0]).max() < 0.25
    start = forward(tooled, here)
    end = start.copy()
    end[:3, 3] += (0.0, 20.0, -10.0)
    job = Job(
        "j", via=(tuple(here), Pose.of_matrix(end)), tool_segments=(ToolSegment(1, line=True),), refine=4
    )
    plan = pipeline.plan(tooled, job)
    path = forward(tooled, plan.trajectory(np.linspace(0, plan.total_s, 60)))[:, :3, 3] - start[:3, 3]
    way = np.array((0.0, 20.0, -10.0)) / np.hypot(20.0, 10.0)
    assert np.linalg.norm(path - (path @ way)[:, None] * way, axis=1).max() < 0.5
    np.testing.assert_allclose(path[-1], (0.0, 20.0, -10.0), atol=0.05)


def test_torque_and_touch_have_the_tool() -> None:
    rng = np.random.default_rng(19)
    heavy = tuple(replace(joint, dynamics=Dynamics(1.0, (1.0, 2.0, 3.0))) for joint in Arm.load("ar4").joints)
    arm, rows = both(replace(Arm.load("ar4"), joints=heavy))
    assert arm.tool
    loads = (
        None,
        Load("cup", 0.7, centre_mm=(5.0, 6.0, 7.0), inertia_kg_m2=(1e-3, 2e-3, 3e-3, 1e-4, 0.0, 2e-4)),
    )
    angles, rates, changes = rng.uniform(-1, 1, (3, 4, 6))
    zeros = np.zeros((4, 3))
    for load in loads:
        wanted = dynamics.joint_torques(
            replace(rows, payload=load), *(np.hstack([each, zeros]) for each in (angles, rates, changes))
        )[:, :6]
        found = dynamics.joint_torques(replace(arm, payload=load), angles, rates, changes)
        np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9)
    massive = replace(arm, tool=replace(arm.tool, mass_kg=0.4, centre_mm=(3.0, 4.0, 5.0)))
    as_load = replace(arm, tool=None, payload=Load("x", 0.4, centre_mm=(3.0, 4.0, 5.0)))
    np.testing.assert_allclose(
        dynamics.joint_torques(massive, angles, rates, changes),
        dynamics.joint_torques(as_load, angles, rates, changes),
        rtol=1e-12,
    )


def test_the_tools_capsule_touches(tmp_path: Path) -> None:
    arm = Arm.load(arm_file(tmp_path, TOOL + "\n[workspace]\nfloor_mm = 0\n"))
    down = [0.0, 20.0, 30.0, 0.0, 40.0, 0.0]
    for name in ("nothing", "gripper", "pen"):
        chosen = arm.with_tool(name)
        tip = forward(chosen, down)[:3, 3]
        flange = forward(arm, down)[:3, 3]
        radius = chosen.tool.radius_mm if chosen.tool else 0.0
        bodies = workspace_check.Bodies(chosen)
        starts, ends = bodies.ends(np.array([down]))
        assert len(bodies.names) == len(starts) == 12 + bool(chosen.tool)
        np.testing.assert_allclose(ends[-1, 0], tip, atol=1e-9)
        if chosen.tool:
            np.testing.assert_allclose(starts[-1, 0], flange, atol=1e-9)
            assert bodies.names[-1] == f"the tool {name}"
        number = len(bodies.names) - 1
        named = bodies.named.index((bodies.names[number], "the floor"))
        least = min(tip[2], flange[2] if chosen.tool else tip[2])
        if chosen.tool:
            assert bodies.distances(np.array([down]))[0, named] == pytest.approx(least - radius, abs=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_the_bound_of_a_links_speed_holds_for_the_tool(seed: int) -> None:
    rng = np.random.default_rng([seed, 45])
    arm, _ = both(Arm.load("ar4"))
    assert arm.tool
    arm = replace(
        arm,
        tool=replace(arm.tool, radius_mm=10.0),
        payload=Load("ball", radius_mm=5.0, centre_mm=(9.0, 0.0, 4.0)),
    )
    bodies = workspace_check.Bodies(arm)
    low, high = np.array([joint.range_deg for joint in arm.driven]).T
    here, step = rng.uniform(low, high), 1e-4 * rng.uniform(-1, 1, len(low))
    before, after = (np.stack(bodies.ends(np.array([each]))) for each in (here, here + step))
    moved = np.linalg.norm(after - before, axis=-1)[:, :, 0].max(axis=0)
    bound = bodies.reach_mm @ bodies.turned @ np.radians(np.abs(step))
    assert np.all(moved <= bound * (1 + 1e-6) + 1e-12)


def arm_file(folder: Path, more: str = TOOL) -> Path:
    """The AR4 with tools."""
    return arms.write(folder, more, like="ar4")


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("[tool.nothing]\nposition_mm = [0, 0, 0]", "arm.toml: tool.nothing: 'nothing' means no tool"),
        ("[tool.a]\nmass_kg = 1", "tool.a.position_mm is missing"),
        ("[tool.a]\nposition_mm = [0, 0, 0]\nmass_kg = -1", "tool.a.mass_kg = -1 is not allowed"),
        ("[tool.a]\nposition_mm = [0, 0, 0]\napproach = [0, 0, 1]", "tool.a.approach does not say how"),
        ("[tool.a]\nposition_mm = [0, 0, 0]\nframe = 'b'", "tool.a.frame: unknown key"),
        ("[tool.a]\nposition_mm = [0, 0, 0]\ncentre_mm = [1]", "tool.a.centre_mm = [1] is not allowed"),
        (
            "[tool.a]\nposition_mm = [0, 0, 0]\ncentre_mm = [0, 0, 1e300]",
            "centre_mm = [0, 0, 1e+300] is not allowed",
        ),
        ("[tool.'a b']\nposition_mm = [0, 0, 0]", "tool.a b: the name is not allowed"),
        ("[tool]\na = 3", "tool.a = 3 is not allowed"),
    ],
)
def test_a_tool_that_cannot_be_is_refused_with_its_key(tmp_path: Path, more: str, said: str) -> None:
    with pytest.raises(InputError) as refused:
        Arm.load(arm_file(tmp_path, "\n" + more + "\n"))
    assert said in str(refused.value)


def test_two_tools_made_in_code_have_two_names() -> None:
    pen = ArmTool("pen", tuple(map(tuple, np.eye(4).tolist())))
    with pytest.raises(InputError, match="two tools are called 'pen'"):
        replace(Arm.paper(), tools=(pen, pen))


JOB = """name = "j"
path = "through"
population = 4
iterations = 1
refine = 1
[[via]]
posture = "home"
[[via]]
angles_deg = [20, 10, -10, 5, 40, 8]
"""


def test_a_job_chooses_its_tool_and_a_plan_is_old_without_it(tmp_path: Path) -> None:
    arm = Arm.load(arm_file(tmp_path))
    with pytest.raises(InputError, match="did you mean 'tool'"):
        Job.of_table(toml_table.parse(f'tol = "gripper"\n{JOB}', "job.toml"), arm)
    assert arm.tools[0].centre_mm == (7.5, -4.0, 35.0)
    assert json_codec.decode(Arm, json_codec.encode(arm.with_tool("pen")), "arm") == arm.with_tool("pen")
    there = forward(arm.with_tool("gripper"), [20, 10, -10, 5, 40, 8])[:3, 3].tolist()
    text = f'tool = "gripper"\n{JOB}[[via]]\nposition_mm = {there}\n'
    job = Job.of_table(toml_table.parse(text, "job.toml"), arm)
    via_deg, _ = planner.via_angles(arm, job)
    np.testing.assert_allclose(via_deg[2], via_deg[1], atol=0.05)
    plan = pipeline.plan(arm, job)
    np.testing.assert_allclose(plan.via_deg, via_deg[[0, 2]])  # less than a step apart, they are one
    assert plan.arm.tool == arm.tools[0]
    plan.save(tmp_path / "plan.json")
    assert pipeline.load(tmp_path / "plan.json", arm).arm.tool == arm.tools[0]
    changed = Arm.load(arm_file(tmp_path, TOOL.replace("[15, -8, 70]", "[15, -8, 71]")))
    with pytest.raises(InputError, match=r"is old: tool 'gripper' has changed since, or is gone"):
        pipeline.load(tmp_path / "plan.json", changed)
    with pytest.raises(InputError, match=r"job.toml: tool: .* no tool 'griper'; did you mean 'gripper'"):
        Job.of_table(toml_table.parse(text.replace("gripper", "griper"), "job.toml"), arm)
    made_with.check_plan("x", replace(plan, arm=arm), changed)


@pytest.mark.slow
def test_a_sequence_begins_with_its_tool(tmp_path: Path) -> None:
    arm = Arm.load(arm_file(tmp_path))
    (tmp_path / "job.toml").write_text(f'tool = "gripper"\n{JOB}', encoding="utf-8")
    pipeline.plan(arm, tmp_path / "job.toml").save(tmp_path / "job.json")
    there = forward(arm.with_tool("gripper"), [20, 10, -10, 5, 40, 8])[:3, 3].tolist()
    for file in ("job.toml", "job.json"):
        text = (
            f'name = "s"\nstart = "home"\n[posture.over]\nposition_mm = {there}\n[[step]]\nrun = "{file}"\n'
        )
        text += '[[step]]\ngoto = "over"\n'
        with pytest.raises(
            InputError, match=r"run: it is for tool 'gripper', but the sequence has no tool here"
        ):
            planned(arm, text, tmp_path)
        found = planned(arm, f'tool = "gripper"\n{text}', tmp_path)
        assert found.arm.tool == arm.tools[0]
        assert len(found.legs) == 2
        end = forward(found.arm, found.legs[1].trajectory(found.legs[1].trajectory.duration_s))[:3, 3]
        np.testing.assert_allclose(end, there, atol=0.1)


def planned(arm: Arm, text: str, folder: Path) -> Any:
    """A planned sequence."""
    return pipeline.plan_sequence(arm, Sequence.of_table(toml_table.parse(text, str(folder / "s.toml")), arm))


def test_commands_take_a_tool(tmp_path: Path) -> None:
    path = str(arm_file(tmp_path))
    arm = Arm.load(path).with_tool("gripper")
    seen = CliRunner().invoke(main, ["fk", "10,20,-10,5,40,8", "--tool", "gripper", "--arm", path, "--json"])
    found = json.loads(seen.output)["tool"]["position_mm"]
    np.testing.assert_allclose(found, forward(arm, [10, 20, -10, 5, 40, 8])[:3, 3], atol=1e-6)
    for words in ("goto home", "jog --axis x --by 1", "fk home", "ik --position 1 2 3"):
        result = CliRunner().invoke(main, [*words.split(), "--tool", "griper", "--arm", path])
        assert result.exit_code == 2
        assert "no tool 'griper'; did you mean 'gripper'" in " ".join(result.output.split())


@pytest.mark.slow
def test_a_posture_as_a_pose_is_of_the_tool_that_is_on(tmp_path: Path) -> None:
    there = forward(Arm.load(arm_file(tmp_path)).with_tool("pen"), [20, 10, -10, 5, 40, 8])[:3, 3].tolist()
    arm = Arm.load(arm_file(tmp_path, f"{TOOL}\n[posture.over]\nposition_mm = {there}\n")).with_tool("pen")
    found = via_points.posture_deg(arm, arm.posture("over"))
    np.testing.assert_allclose(forward(arm, found)[:3, 3], there, atol=0.1)
    assert isinstance(
        pipeline.plan(arm, Job("j", via=(arm.home_deg, tuple(found.tolist())))).trajectory, Trajectory
    )
