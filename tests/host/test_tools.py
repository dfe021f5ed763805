"""Tools of an arm file: the same as constant rows after the last joint; chosen by a job, and part of the last link."""

from __future__ import annotations

import itertools
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
from armtempo.cli.taught_points import NamedPoints
from armtempo.encoding import encode, planned_for
from armtempo.kinematics import dynamics
from armtempo.kinematics.forward import forward as of_geometry
from armtempo.kinematics.geometry import Geometry
from armtempo.kinematics.of_arm import forward, inverse, inverse_many
from armtempo.kinematics.solver import PoseSolver
from armtempo.model import taught_tool
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.parts import Dynamics, Joint, Load
from armtempo.model.sequence import Sequence
from armtempo.model.tool import ArmTool
from armtempo.model.tool_pose import Pose
from armtempo.model.tool_segment import ToolSegment
from armtempo.planning import via_points, workspace_check
from armtempo.planning.jog import jog_motion
from armtempo.planning.jog.jog_motion import JogMove
from armtempo.planning.tool import Tool
from armtempo.robot.teaching import NewTool
from armtempo.splines.trajectory import Trajectory
from click.testing import CliRunner
from scipy.spatial.transform import Rotation

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
    plan = pipeline.plan(arm, job)
    np.testing.assert_allclose(plan.via_deg[2], plan.via_deg[1], atol=0.05)
    assert plan.arm.tool == arm.tools[0]
    plan.save(tmp_path / "plan.json")
    assert pipeline.load(tmp_path / "plan.json", arm).arm.tool == arm.tools[0]
    changed = Arm.load(arm_file(tmp_path, TOOL.replace("[15, -8, 70]", "[15, -8, 71]")))
    with pytest.raises(InputError, match=r"is old: tool 'gripper' has changed since, or is gone"):
        pipeline.load(tmp_path / "plan.json", changed)
    with pytest.raises(InputError, match=r"job.toml: tool: .* no tool 'griper'; did you mean 'gripper'"):
        Job.of_table(toml_table.parse(text.replace("gripper", "griper"), "job.toml"), arm)
    planned_for.check("x", arm, (), changed)


def test_a_sequence_has_one_tool(tmp_path: Path) -> None:
    arm = Arm.load(arm_file(tmp_path))
    (tmp_path / "job.toml").write_text(f'tool = "gripper"\n{JOB}', encoding="utf-8")
    pipeline.plan(arm, tmp_path / "job.toml").save(tmp_path / "job.json")
    there = forward(arm.with_tool("gripper"), [20, 10, -10, 5, 40, 8])[:3, 3].tolist()
    for file in ("job.toml", "job.json"):
        text = (
            f'name = "s"\nstart = "home"\n[posture.over]\nposition_mm = {there}\n[[step]]\nrun = "{file}"\n'
        )
        text += '[[step]]\ngoto = "over"\n'
        with pytest.raises(InputError, match=r"run: it is for tool 'gripper', but the sequence has no tool"):
            planned(arm, text, tmp_path)
        found = planned(arm, f'tool = "gripper"\n{text}', tmp_path)
        assert found.arm.tool == arm.tools[0]
        assert len(found.legs) == 2
        end = forward(found.arm, found.legs[1](found.legs[1].duration_s))[:3, 3]
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


def test_a_posture_as_a_pose_is_of_the_tool_that_is_on(tmp_path: Path) -> None:
    there = forward(Arm.load(arm_file(tmp_path)).with_tool("pen"), [20, 10, -10, 5, 40, 8])[:3, 3].tolist()
    arm = Arm.load(arm_file(tmp_path, f"{TOOL}\n[posture.over]\nposition_mm = {there}\n")).with_tool("pen")
    found = via_points.posture_deg(arm, arm.posture("over"))
    np.testing.assert_allclose(forward(arm, found)[:3, 3], there, atol=0.1)
    assert isinstance(
        pipeline.plan(arm, Job("j", via=(arm.home_deg, tuple(found.tolist())))).trajectory, Trajectory
    )


# taught from four postures


TIP = (15.0, -8.0, 70.0)
TURNS = ((180, 0, 0), (150, 10, 60), (200, -25, -60), (170, 30, 20))


def postures_at(tip: np.ndarray, off_mm: float = 0.0, turns: Any = TURNS) -> dict[str, list[float]]:
    """Postures of the AR4, by name, with the point of the tool at a tip; ``off_mm``: the last one beside it."""
    there = np.eye(4)
    there[:3, 3] = TIP
    arm = replace(Arm.load("ar4"), tool=ArmTool("x", tuple(map(tuple, there.tolist()))))
    found = {}
    for number, rpy in enumerate(turns):
        place = tip + np.array([off_mm * (number == 3), 0.0, 0.0])
        pose = Pose.of_angles(
            place.tolist(), dict(zip(("roll", "pitch", "yaw"), map(float, rpy), strict=True))
        )
        found[f"tip{number}"] = via_points.nearest(arm, pose, arm.home_deg).round(4).tolist()
    return found


def taught(folder: Path, more: str, postures: dict[str, list[float]], *options: str) -> Any:
    """The command's result."""
    said = "".join(f"\n[posture.{name}]\nangles_deg = {angles}\n" for name, angles in postures.items())
    path = arm_file(folder, more + said)
    words = ["teach", "tool", "gripper", "--at", ",".join(postures), "--arm", str(path), *options]
    return CliRunner().invoke(main, words)


PLACE = np.array([330.0, 20.0, 150.0])


def test_a_tool_is_taught_from_four_postures_around_a_tip(tmp_path: Path) -> None:
    result = taught(tmp_path, "", postures_at(PLACE))
    assert result.exit_code == 0, result.output
    assert "the postures meet within 0.0" in " ".join(result.output.split())
    tool = Arm.load(tmp_path / "arm.toml").tools[0]
    np.testing.assert_allclose(np.array(tool.matrix)[:3, 3], TIP, atol=0.05)
    matrix = "[[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]"
    old = f"\n[tool.gripper]\n# mine\nmatrix = {matrix}\nmass_kg = 0.25\n"
    refused = taught(tmp_path, old, postures_at(PLACE))
    assert refused.exit_code == 2
    assert "already has a tool 'gripper'" in " ".join(refused.output.split())
    result = taught(tmp_path, old, postures_at(PLACE, 1.0), "--replace")
    assert result.exit_code == 0, result.output
    apart = float(" ".join(result.output.split()).split("meet within ")[1].split(" mm")[0])
    assert 0.1 < apart < 1.0, "the residual of a posture 1 mm beside the tip"
    tool = Arm.load(tmp_path / "arm.toml").tools[0]
    assert tool.mass_kg == 0.25
    np.testing.assert_allclose(np.array(tool.matrix)[:3, 0], (0, 1, 0), atol=1e-9)
    np.testing.assert_allclose(np.array(tool.matrix)[:3, 3], TIP, atol=3.0)
    assert "# mine" in (tmp_path / "arm.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("postures", "said"),
    [
        (lambda: postures_at(PLACE, 60.0), "the postures do not meet in one point: it is up to"),
        (
            lambda: postures_at(PLACE, turns=((180, 0, 0), (180, 0, 20), (180, 0, 40), (180, 0, -30))),
            "the postures turn the tool too little to find its point",
        ),
        (lambda: dict([*postures_at(PLACE).items()][:3]), "3 postures give 4: at the first posture"),
    ],
)
def test_postures_that_give_no_tool_are_refused(tmp_path: Path, postures: Any, said: str) -> None:
    result = taught(tmp_path, "", postures())
    assert result.exit_code == 2
    assert said in " ".join(result.output.replace("hint: ", "").replace("armtempo: ", "").split())
    assert "[tool." not in (tmp_path / "arm.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize("seed", range(2))
def test_random_errors_of_the_postures_move_the_point_by_no_more_than_is_said(seed: int) -> None:
    rng = np.random.default_rng([seed, 46])
    worst = 0.0
    for _ in range(60):
        around = np.array([*itertools.product((-40.0, 40.0), repeat=2)]) + rng.uniform(-15, 15, (4, 2))
        turns = Rotation.from_euler("zxy", np.column_stack([rng.uniform(-90, 90, 4), around]), degrees=True)
        turns = turns.as_matrix()
        point, tip, error_mm = rng.normal(0, 60, 3), rng.normal(0, 300, 3), 10 ** rng.uniform(-2, 0)
        flanges = np.tile(np.eye(4), (4, 1, 1))
        flanges[:, :3, :3] = turns
        flanges[:, :3, 3] = tip - turns @ point
        exact = taught_tool.of_postures(flanges, 0.0)
        np.testing.assert_allclose(exact.position_mm, point, atol=1e-8)
        assert exact.apart_mm < 1e-8
        off = rng.normal(size=(4, 3))
        flanges[:, :3, 3] += error_mm * off / np.linalg.norm(off, axis=1, keepdims=True)
        found = taught_tool.of_postures(flanges, error_mm)
        assert found.apart_mm <= 2.0 * error_mm
        worst = max(worst, np.linalg.norm(found.position_mm - point) / found.error_mm)
    assert 0.2 < worst < 1.0


def test_the_keys_take_the_four_postures(tmp_path: Path) -> None:
    path = arm_file(tmp_path, "")
    arm = Arm.load(path)
    here = iter(postures_at(PLACE).values())
    points = NamedPoints(arm, lambda: np.array(next(here)), NewTool(path, arm, "gripper", replace_old=False))
    said = [points.take() for _ in range(4)]
    assert said[0] == "the first posture taken; next: the second posture"
    assert said[3] == "the fourth posture taken; next: q writes the tool"
    points.save()
    np.testing.assert_allclose(np.array(Arm.load(path).tools[0].matrix)[:3, 3], TIP, atol=0.05)
