"""Frames of an arm file: what is given in one is the same as when given in the base; a plan of a moved one is old."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import armtempo
import numpy as np
import pytest
from armtempo import pipeline
from armtempo.basics import json_codec, toml_table
from armtempo.basics.errors import InputError, PlanError
from armtempo.cli import main
from armtempo.cli.jog_screen import JogScreen
from armtempo.cli.taught_points import NamedPoints, NewFrame
from armtempo.diagnosis.arm_check import check_arm
from armtempo.encoding import encode
from armtempo.kinematics.of_arm import forward
from armtempo.model import frame, shipped, taught, taught_frame, workspace
from armtempo.model.arm import Arm
from armtempo.model.frame import ArmFrame
from armtempo.model.job import Job
from armtempo.model.plan import Plan
from armtempo.model.pose import to_rpy_deg
from armtempo.model.sequence import Sequence
from armtempo.model.sequence_plan import SequencePlan
from armtempo.model.tool_pose import WHOLE, Pose
from armtempo.planning import via_points
from armtempo.planning.jog import jog_motion
from armtempo.planning.jog.jog_motion import JogMove
from armtempo.robot import arm_state
from armtempo.robot.connection import Connection
from click.testing import CliRunner
from scipy.spatial.transform import Rotation

FRAMES = """
[frame.tray]
frame = "table"
position_mm = [50, 20, 5]
rpy_deg = [10, -20, 90]

[frame.table]
position_mm = [150, -30, 80]
yaw_deg = 20
"""
PAPER = Arm.paper()


def arm_file(folder: Path, more: str = FRAMES, name: str = "paper") -> Path:
    """A shipped arm file with more after it."""
    path = folder / "arm.toml"
    path.write_text(shipped.find(name).path.read_text(encoding="utf-8") + more, encoding="utf-8")
    return path


def pose(position: list[float], turn: Rotation) -> np.ndarray:
    """A matrix, (4, 4), by scipy."""
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = turn.as_matrix(), position
    return found


def rows(matrix: np.ndarray) -> tuple[tuple[float, ...], ...]:
    """As a pose has them."""
    return tuple(map(tuple, matrix.tolist()))


def job(text: str, arm: Arm) -> Job:
    """A job of this text."""
    return Job.of_table(toml_table.parse(f'name = "j"\n{text}', "job.toml"), arm)


# the frames themselves


def test_frames_may_be_in_each_other_in_any_order(tmp_path: Path) -> None:
    arm = Arm.load(arm_file(tmp_path))
    table = pose([150, -30, 80], Rotation.from_euler("z", 20, degrees=True))
    tray = table @ pose([50, 20, 5], Rotation.from_euler("xyz", [10, -20, 90], degrees=True))
    np.testing.assert_allclose(arm.frame("table"), table, atol=1e-12)
    np.testing.assert_allclose(arm.frame("tray"), tray, atol=1e-12)
    np.testing.assert_array_equal(arm.frame("base"), np.eye(4))
    assert encode.arm_record(arm) == encode.arm_record(PAPER), "the board knows nothing of them"
    assert json_codec.decode(Arm, json_codec.encode(arm), "arm") == arm


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("[frame.base]\nposition_mm = [0, 0, 0]", "frame.base: 'base' is the frame of the arm itself"),
        ("[frame.tool]\nposition_mm = [0, 0, 0]", "frame.tool: 'tool' is the frame of its tool"),
        ("[frame.'a b']\nposition_mm = [0, 0, 0]", "frame.a b: the name is not allowed"),
        ("[frame.a]", "frame.a.position_mm is missing"),
        ("[frame.a]\nposition_mm = [0, 0]", "frame.a.position_mm = [0, 0] is not allowed"),
        ("[frame.a]\nposition_mm = [0, 0, 0]\nrpy = [0, 0, 0]", "frame.a.rpy: unknown key"),
        ("[frame.a]\nposition_mm = [0, 0, 0]\ntolerance_mm = 1", "frame.a.tolerance_mm: unknown key"),
        ("[frame.a]\nposition_mm = [0, 0, 0]\napproach = [0, 0, 1]", "frame.a.approach does not say how"),
        (
            "[frame.a]\nposition_mm = [0, 0, 0]\nquaternion = [1, 1, 0, 0]",
            "frame.a.quaternion: this quaternion",
        ),
        ("[frame.a]\nposition_mm = [0, 0, 0]\nframe = 'b'", "frame.a.frame = 'b': there is no frame 'b'"),
        (FRAMES + "[frame.a]\nposition_mm = [0, 0, 0]\nframe = 'trya'", "'trya'; did you mean 'tray'"),
        (
            "[frame.a]\nposition_mm = [0, 0, 0]\nframe = 'a'",
            "frame.a.frame = 'a': these frames are given in each",
        ),
        (
            "[frame.a]\nposition_mm = [0, 0, 0]\nframe = 'b'\n[frame.b]\nposition_mm = [0, 0, 0]\nframe = 'a'",
            "a in b in a; give one of them in the base",
        ),
        ("[frame.a]\nposition_mm = [0, 0, 0]\nframe = 3", "frame.a.frame = 3 is not allowed"),
        ("[frame]\na = 3", "frame.a = 3 is not allowed"),
        ("[[frame]]\nname = 'a'", "frame"),
    ],
)
def test_a_frame_that_cannot_be_is_refused_with_its_key(tmp_path: Path, more: str, said: str) -> None:
    with pytest.raises(InputError) as refused:
        Arm.load(arm_file(tmp_path, "\n" + more + "\n"))
    assert said in str(refused.value)
    assert "arm.toml" in str(refused.value)


def test_frames_made_in_code_are_checked_too() -> None:
    for wrong in (((1.0, 2.0), (3.0,)), ((1.0,),), ()):
        with pytest.raises(InputError, match=r"frame.a: what is given is not the matrix of a pose"):
            ArmFrame("a", wrong)
        with pytest.raises(InputError, match=r"'bin': axes: what is given is not the matrix"):
            workspace.KeepOut("bin", (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), wrong)
    with pytest.raises(InputError, match="not a rotation"):
        ArmFrame("a", rows(2.0 * np.eye(4) - np.diag([0.0, 0.0, 0.0, 1.0])))
    here = rows(np.eye(4))
    with pytest.raises(InputError, match="no frame 'b'"):
        replace(PAPER, frames=(ArmFrame("a", here, "b"),))
    with pytest.raises(InputError, match="two frames are called 'a'"):
        replace(PAPER, frames=(ArmFrame("a", here), ArmFrame("a", here)))


# what is given in one


@pytest.mark.seeds(*range(3))
def test_random_poses_and_arcs_in_a_frame_are_those_in_the_base(seed: int) -> None:
    rng = np.random.default_rng([seed, 43])
    matrices = [pose(rng.normal(0, 200, 3).tolist(), Rotation.random(random_state=rng)) for _ in range(4)]
    outer, inner, point, arc = matrices
    arm = replace(PAPER, frames=(ArmFrame("inner", rows(inner), "outer"), ArmFrame("outer", rows(outer))))
    w, x, y, z = Rotation.from_matrix(point[:3, :3]).as_quat()[[3, 0, 1, 2]].tolist()
    found = job(
        f"""frame = "inner"
        [[via]]
        angles_deg = [0, -60, 40]
        [[via]]
        position_mm = {point[:3, 3].tolist()}
        quaternion = [{w}, {x}, {y}, {z}]
        tolerance_mm = 0.3
        [[via]]
        frame = "outer"
        position_mm = {point[:3, 3].tolist()}
        approach = {point[:3, 2].tolist()}
        arc_through_mm = {arc[:3, 3].tolist()}
        [[via]]
        frame = "base"
        position_mm = {point[:3, 3].tolist()}
        [[via]]
        posture = "home"
        circle_through_mm = [{arc[:3, 3].tolist()}, {point[:3, 3].tolist()}]
        """,
        arm,
    )
    _, whole, towards, there, _ = (cast(Pose, via) for via in found.via)
    np.testing.assert_allclose(whole.matrix, outer @ inner @ point, atol=1e-9)
    np.testing.assert_allclose(np.array(towards.matrix)[:3, 2:], (outer @ point)[:3, 2:], atol=1e-9)
    np.testing.assert_allclose(np.array(there.matrix)[:3, 3], point[:3, 3])
    assert (whole.tolerance_mm, whole.frame, towards.frame, there.frame) == (0.3, "inner", "outer", "base")
    one, two = found.tool_segments
    np.testing.assert_allclose(one.arc_through_mm, (outer @ arc)[:3, 3], atol=1e-9)
    through = np.array([arc[:, 3], point[:, 3]])
    np.testing.assert_allclose(two.circle_through_mm, (through @ (outer @ inner).T)[:, :3], atol=1e-9)
    assert found.frames == ("inner", "outer")
    assert json_codec.decode(Job, json_codec.encode(found), "job") == found


@pytest.mark.parametrize("flipped", [0, 180])
@pytest.mark.parametrize("fixed", [("roll",), ("pitch",), ("yaw",), ("roll", "pitch"), ("pitch", "yaw")])
def test_single_angles_in_a_level_frame_mean_the_same(fixed: tuple[str, ...], flipped: float) -> None:
    """The tool may be turned freely by the other angles: the given ones are those in the frame whatever they are."""
    turn = Rotation.from_euler("xz", [flipped, 35], degrees=True)
    arm = replace(PAPER, frames=(ArmFrame("table", rows(pose([100, 20, 30], turn))),))
    angles = {"roll": 25.0, "pitch": -40.0, "yaw": 70.0}
    given = arm.in_base(Pose.of_angles([0, 0, 0], {name: angles[name] for name in fixed}), "table")
    wanted = dict(zip(WHOLE, to_rpy_deg(given.matrix), strict=True))
    rng = np.random.default_rng(5)
    for _ in range(20):
        free = {name: float(rng.uniform(-80, 80)) for name in WHOLE}
        free |= {name: angles[name] for name in fixed}
        in_base = turn * Rotation.from_euler("xyz", [free[name] for name in WHOLE], degrees=True)
        seen = dict(zip(WHOLE, to_rpy_deg(in_base.as_matrix()), strict=True))
        for name in fixed:
            assert (seen[name] - wanted[name] + 180) % 360 - 180 == pytest.approx(0, abs=1e-9)


def test_single_angles_in_a_tilted_frame_are_refused(tmp_path: Path) -> None:
    arm = Arm.load(arm_file(tmp_path))
    text = 'frame = "{}"\n[[via]]\nposture = "home"\n[[via]]\nposition_mm = [0, 0, 50]\npitch_deg = 90\n'
    with pytest.raises(
        InputError, match=r"job.toml: via P1: pitch alone cannot be given in frame 'tray'.*base"
    ):
        job(text.format("tray"), arm)
    assert job(text.format("table"), arm).frames == ("table",)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            'frame = "tray"',
            'frame = "trai"',
            "job.toml: frame = 'trai': there is no frame 'trai'; did you mean 'tray'",
        ),
        ('frame = "tray"', "frame = 3", "job.toml: frame = 3 is not allowed"),
        ("position_mm", 'frame = "tabel"\nposition_mm', "via P1.frame = 'tabel': there is no frame"),
        ('posture = "home"', 'posture = "home"\nframe = "tray"', "via P0.frame = 'tray' is not allowed"),
    ],
)
def test_a_wrong_frame_of_a_job_is_refused_with_its_key(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    arm = Arm.load(arm_file(tmp_path))
    text = 'frame = "tray"\n[[via]]\nposture = "home"\n[[via]]\nposition_mm = [0, 0, 50]\n'
    assert job(text, arm)
    with pytest.raises(InputError) as refused:
        job(text.replace(old, new), arm)
    assert said in str(refused.value)


def test_a_pose_is_turned_into_the_base_once() -> None:
    arm = replace(PAPER, frames=(ArmFrame("table", rows(pose([1, 2, 3], Rotation.identity()))),))
    there = arm.in_base(Pose.of_angles([0, 0, 0], {}), "table")
    with pytest.raises(InputError, match="was given in frame 'table'"):
        arm.in_base(there, "table")
    with pytest.raises(InputError, match="no frame 'tabel'; did you mean 'table'"):
        arm.in_base(Pose.of_angles([0, 0, 0], {}), "tabel")


# postures, goto, the workspace, ik and fk


def place_of(arm: Arm, angles_deg: list[float], name: str) -> list[float]:
    """The tool's position at a posture, in a frame."""
    seen = np.linalg.inv(arm.frame(name)) @ forward(arm, angles_deg)
    return [round(float(value), 4) for value in seen[:3, 3]]


def test_a_posture_in_a_frame_is_where_the_tool_is_there(tmp_path: Path) -> None:
    place = place_of(Arm.load(arm_file(tmp_path)), [20.0, -40.0, 30.0], "tray")
    arm = Arm.load(arm_file(tmp_path, f'{FRAMES}\n[posture.over]\nframe = "tray"\nposition_mm = {place}\n'))
    found = via_points.posture_deg(arm, arm.posture("over"))
    np.testing.assert_allclose(forward(arm, found)[:3, 3], forward(arm, [20, -40, 30])[:3, 3], atol=0.1)
    near = arm.in_base(Pose.of_angles(place, {}), "tray")
    np.testing.assert_allclose(via_points.nearest(arm, near, [20, -40, 30]), [20, -40, 30], atol=0.05)
    with pytest.raises(PlanError, match="the pose: "):
        via_points.nearest(arm, arm.in_base(Pose.of_angles([0, 0, 3000], {}), "tray"), [20, -40, 30])


def test_a_box_lies_along_the_axes_of_its_frame() -> None:
    text = '[[workspace.keep_out]]\nname = "bin"\nframe = "{}"\nlow_mm = [0, 0, 0]\nhigh_mm = [10, 20, 30]\n'
    frames = frame.read(toml_table.parse(FRAMES, "arm.toml"))
    found = workspace.read(toml_table.parse(text.format("tray"), "arm.toml"), frames)
    assert found is not None
    (box,) = found.keep_out
    corners = np.array([[x, y, z, 1] for x in (0, 10) for y in (0, 20) for z in (0, 30)])
    np.testing.assert_allclose(box.corners_mm, (corners @ frame.in_base(frames, "tray").T)[:, :3], atol=1e-9)
    with pytest.raises(InputError, match=r"keep_out\[1\].frame = 'try': there is no frame"):
        workspace.read(toml_table.parse(text.format("try"), "arm.toml"), frames)


def cli(*words: str) -> Any:
    """A command's result."""
    return CliRunner().invoke(main, list(words))


def test_fk_shows_the_tool_in_a_frame_and_ik_takes_it_back(tmp_path: Path) -> None:
    path = str(arm_file(tmp_path, FRAMES, "ar4"))
    arm = Arm.load(path)
    angles = "10,20,-10,5,40,8"
    seen = cli("fk", angles, "--frame", "tray", "--arm", path, "--json")
    assert seen.exit_code == 0, seen.output
    wanted = np.linalg.inv(arm.frame("tray")) @ forward(arm, [float(one) for one in angles.split(",")])

    tool = json.loads(seen.output)["tool"]
    np.testing.assert_allclose(json.loads(seen.output)["frames"][-1]["position_mm"], wanted[:3, 3], atol=1e-6)
    position, rpy = map(str, tool["position_mm"]), map(str, tool["rpy_deg"])
    solved = cli("ik", "--position", *position, "--rpy", *rpy, "--frame", "tray", "--arm", path)
    assert "10.0000" in solved.output, solved.output
    assert "in frame tray" in cli("fk", angles, "--frame", "tray", "--arm", path).output
    for words in (("fk", angles), ("ik", "--position", "0", "0", "0")):
        refused = cli(*words, "--frame", "trya", "--arm", path)
        assert refused.exit_code == 2
        assert "no frame 'trya'; did you mean 'tray'" in refused.output


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--position", "0", "0", "50", "--frame", "trya"], "no frame 'trya'; did you mean 'tray'"),
        (["home", "--frame", "tray"], "--frame is the frame of --position"),
        (["home", "--position", "0", "0", "50"], "give a posture as WHERE, or a pose by --position"),
        ([], "give a posture as WHERE, or a pose by --position"),
        (["--position", "0", "0", "5", "--rpy", "0", "0", "0", "--yaw", "3"], "do not describe a pose"),
        (["home", "--rpy", "0", "0", "0"], "do not describe a pose"),
    ],
)
def test_goto_refuses_a_wrong_pose_before_a_port_is_opened(
    tmp_path: Path, words: list[str], said: str
) -> None:
    result = cli("goto", *words, "--arm", str(arm_file(tmp_path)), "--port", "nowhere")
    assert result.exit_code == 2
    assert said in result.output
    assert "nowhere" not in result.output


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--frame", "trya", "--axis", "x", "--by", "1"], "no frame 'trya'; did you mean 'tray'"),
        (["--frame", "tray", "--joint", "1", "--by", "1"], "--frame says whose x, y or z is meant"),
        (["--frame", "tray", "--axis", "tool-x", "--by", "1"], "--frame says whose x, y or z is meant"),
    ],
)
def test_a_jog_in_a_wrong_frame_is_refused_before_a_port_is_opened(
    tmp_path: Path, words: list[str], said: str
) -> None:
    result = cli("jog", *words, "--arm", str(arm_file(tmp_path)), "--port", "nowhere")
    assert result.exit_code == 2
    assert said in result.output
    assert "nowhere" not in result.output


@pytest.mark.parametrize("axis", ["tray-w", "trya-x", "-x", "tray-", "", "tray-xy"])
def test_a_jog_along_no_axis_is_refused(tmp_path: Path, axis: str) -> None:
    arm = Arm.load(arm_file(tmp_path))
    with pytest.raises(InputError, match=r"there is no axis|there is no frame|either a joint or the tool"):
        jog_motion.plan("j", arm, [0, -60, 40], JogMove(1.0, axis=axis))


def test_poses_of_a_table_are_imported_into_a_frame(tmp_path: Path) -> None:
    path = arm_file(tmp_path)
    table, out = tmp_path / "points.csv", tmp_path / "points.toml"
    place = place_of(Arm.load(path), [20.0, -40.0, 30.0], "tray")
    table.write_text("x_mm,y_mm,z_mm\n" + 2 * (",".join(map(str, place)) + "\n"), encoding="utf-8")
    words = ["import", str(table), "--arm", str(path), "--frame", "tray", "-o", str(out)]
    assert cli(*words).exit_code == 0
    arm = Arm.load(path)
    found = Job.load(out, arm)
    assert found.frames == ("tray",)
    np.testing.assert_allclose(
        np.array(cast(Pose, found.via[0]).matrix)[:3, 3], forward(arm, [20, -40, 30])[:3, 3], atol=1e-3
    )
    out.unlink()
    for said, change in (
        ("no frame 'trya'; did you mean 'tray'", lambda: words.__setitem__(5, "trya")),
        (
            "has angles, which are in no frame",
            lambda: table.write_text("10,-50,30\n11,-51,31\n", encoding="utf-8"),
        ),
        ("--own-timing is for angles", lambda: words.append("--own-timing")),
    ):
        change()
        result = cli(*words)
        assert result.exit_code == 2
        assert said in " ".join(result.output.split())
        assert not out.exists()


def test_check_finds_frames_in_metres_or_out_of_reach(tmp_path: Path) -> None:
    more = "\n[frame.far]\nposition_mm = [3000, 0, 0]\n[frame.small]\nframe = 'far'\nposition_mm = [0.25, 0, 0.1]\n"
    found = {
        (each.where, each.level.value): each.what for each in check_arm(Arm.load(arm_file(tmp_path, more)))
    }
    assert "3000 mm from the base" in found["frame far", "note"]
    assert "0.269 mm from that of frame 'far': is it in metres?" in found["frame small", "warning"]
    assert not [each for each in check_arm(Arm.load(arm_file(tmp_path))) if "frame" in each.where]


# plans that are old


def moved(folder: Path, old: str, new: str) -> Arm:
    """The arm after a change of its file."""
    path = folder / "arm.toml"
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    return Arm.load(path)


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Plan, SequencePlan]:
    """A motion and a sequence with a pose in the tray."""
    folder = tmp_path_factory.mktemp("planned")
    place = place_of(Arm.load(arm_file(folder)), [20.0, -55.0, 30.0], "tray")
    posture = f'\n[posture.over]\nframe = "tray"\nposition_mm = {place}\n'
    arm = Arm.load(arm_file(folder, FRAMES + posture))
    text = f'frame = "tray"\n[[via]]\nposture = "home"\n[[via]]\nposition_mm = {place}\n'
    plan = pipeline.plan(arm, replace(job(text, arm), path="through", population=4, iterations=1, refine=1))
    np.testing.assert_allclose(
        forward(arm, plan.trajectory(plan.total_s))[:3, 3], forward(arm, [20, -55, 30])[:3, 3], atol=0.15
    )
    steps = 'name = "s"\nstart = "home"\n[[step]]\ngoto = "over"\n'
    sequence = Sequence.of_table(toml_table.parse(steps, "s.toml"), arm)
    return plan, pipeline.plan_sequence(arm, sequence)


def loaded(plan: Plan, sequence: SequencePlan, arm: Arm, folder: Path) -> list[Callable[[], object]]:
    """The ways in which a plan meets an arm."""
    plan.save(folder / "plan.json", force=True)
    board = Connection(cast(Any, None), "sim")
    board.arm = arm
    return [
        lambda: pipeline.load(folder / "plan.json", arm),
        lambda: board.configure_for(plan),
        lambda: board.configure_for(sequence),
    ]


def test_a_plan_is_old_when_its_frame_is_elsewhere(
    tmp_path: Path, planned: tuple[Plan, SequencePlan], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(arm_state, "configure", lambda *_: None)
    plan, sequence = planned
    assert plan.job.frames == sequence.frames == ("tray",)
    arm_file(tmp_path)
    for old, new in (("[frame.table]", "[frame.bin]\nposition_mm = [1, 2, 3]\n[frame.table]"), ("", "")):
        for call in loaded(plan, sequence, moved(tmp_path, old, new), tmp_path):
            call()
    # the tray stands on the table
    for old, new, said in (
        ("yaw_deg = 20", "yaw_deg = 21.5", "frame 'tray' has changed since, by 1.41 mm and 1.5 degrees"),
        ("frame.tray", "frame.trays", "frame 'tray' is no longer in the arm file"),
    ):
        for call in loaded(plan, sequence, moved(tmp_path, old, new), tmp_path):
            with pytest.raises(InputError, match="plan it again") as refused:
                call()
            assert said in str(refused.value)


def test_a_sequence_takes_a_plan_unless_its_own_frame_is_elsewhere(
    tmp_path: Path, planned: tuple[Plan, SequencePlan]
) -> None:
    """Teaching a posture or a frame makes no other plan old."""
    plan, _ = planned
    plan.save(tmp_path / "plan.json")
    text = 'name = "s"\n[[step]]\nrun = "plan.json"\n'
    more = postures(new=[1.0, -60.0, 40.0]) + "[frame.new]\nposition_mm = [5, 6, 7]\n"
    source = Path(plan.arm.source)
    before = source.read_text(encoding="utf-8")
    try:
        for change in (more, more.replace("[5, 6", "[6, 6")):
            source.write_text(before + change, encoding="utf-8")
            arm = Arm.load(source)
            sequence = Sequence.of_table(toml_table.parse(text, str(tmp_path / "s.toml")), arm)
            assert pipeline.plan_sequence(arm, sequence).frames == ("tray",)
        source.write_text(before.replace("yaw_deg = 20", "yaw_deg = 22"), encoding="utf-8")
        arm = Arm.load(source)
        sequence = Sequence.of_table(toml_table.parse(text, str(tmp_path / "s.toml")), arm)
        with pytest.raises(InputError, match=r"step\[1\].run: it is old: frame 'tray' has changed"):
            pipeline.plan_sequence(arm, sequence)
    finally:
        source.write_text(before, encoding="utf-8")


def test_run_and_upload_refuse_an_old_plan_before_a_port_is_opened(
    tmp_path: Path, planned: tuple[Plan, SequencePlan]
) -> None:
    plan, sequence = planned
    plan.save(tmp_path / "plan.json")
    sequence.save(tmp_path / "sequence.json")
    arm_file(tmp_path)
    moved(tmp_path, "position_mm = [50, 20, 5]", "position_mm = [50, 20, 6]")
    for command in ("run", "upload"):
        for name in ("plan.json", "sequence.json"):
            path = str(tmp_path / name)
            result = cli(command, path, "--arm", str(tmp_path / "arm.toml"), "--port", "nowhere")
            assert result.exit_code == 2, result.output
            assert f"{path} is old: frame 'tray' has changed since, by 1 mm and 0 degrees" in " ".join(
                result.output.split()
            )
            assert "nowhere" not in result.output


def test_the_library_takes_frames_and_gives_poses_in_them() -> None:
    there = armtempo.Pose.of_angles([100, 0, 200], {"roll": 0, "pitch": 0, "yaw": 30})
    arm = replace(PAPER, frames=(armtempo.ArmFrame("tray", there.matrix),))
    over = arm.in_base(armtempo.Pose.of_angles([0, 0, 50], {}), "tray")
    np.testing.assert_allclose(np.array(over.matrix)[:3, 3], [100, 0, 250])
    assert Job("j", via=((0, -60, 40), over)).frames == ("tray",)


# taught from three points


def taught_points(arm: Arm, matrix: np.ndarray, *local: list[float]) -> list[list[float]]:
    """Angles with the tool at points of a frame."""
    found = []
    for point in local:
        place = Pose.of_angles((matrix @ [*point, 1.0])[:3].tolist(), {})
        found.append(via_points.nearest(arm, replace(place, tolerance_mm=1e-3), arm.home_deg).tolist())
    return found


def postures(**angles_deg: list[float]) -> str:
    """Postures of an arm file."""
    return "".join(f"\n[posture.{name}]\nangles_deg = {angles}\n" for name, angles in angles_deg.items())


AR4 = Arm.load("ar4")
TILTED = pose([280, 40, 120], Rotation.from_euler("xyz", [4, -3, 30], degrees=True))


@pytest.mark.parametrize("level", [False, True])
def test_a_frame_is_taught_from_three_postures(tmp_path: Path, level: bool) -> None:
    o, x, y = taught_points(AR4, TILTED, [0, 0, 0], [90, 0, 0], [-20, 60, 0])
    before = "\n# the tray\n[frame.tray]\n# old\nposition_mm = [1, 2, 3]\nyaw_deg = 4 # old\n# end\n"
    path = arm_file(tmp_path, before + postures(o=o, x=x, y=y), "ar4")
    words = ["teach", "frame", "tray", "--at", "o,x,y", "--arm", str(path)] + ["--level"] * level
    refused = cli(*words)
    assert refused.exit_code == 2
    assert "already has a frame 'tray'" in " ".join(refused.output.split())
    assert "[1, 2, 3]" in path.read_text(encoding="utf-8")
    result = cli(*words, "--replace")
    assert result.exit_code == 0, result.output
    said = " ".join(result.output.split())
    assert "90 and 63.25 mm from the origin, 108 degrees apart" in said
    assert ("made level, it was tilted by 5 degrees" if level else "it is tilted by 5 degrees") in said
    found = Arm.load(path).frame("tray")
    x_axis = TILTED[:3, 0] * [1, 1, 0 if level else 1]
    np.testing.assert_allclose(found[:3, 0], x_axis / np.linalg.norm(x_axis), atol=1e-4)
    np.testing.assert_allclose(found[:3, 2], [0, 0, 1] if level else TILTED[:3, 2], atol=1e-4)
    np.testing.assert_allclose(found[:3, 3], TILTED[:3, 3], atol=0.01)
    text = path.read_text(encoding="utf-8")
    assert all(comment in text for comment in ("# the tray", "\n# old\n", "# end"))


@pytest.mark.seeds(*range(2))
def test_random_errors_of_the_points_turn_the_axes_by_no_more_than_is_said(seed: int) -> None:
    rng = np.random.default_rng([seed, 44])
    worst = 0.0
    for _ in range(30):
        turn, error_mm = Rotation.random(random_state=rng).as_matrix(), 10 ** rng.uniform(-3, -1)
        along = rng.uniform(-150, 250)
        local = np.array([[0, 0, 0], [rng.uniform(50, 100), 0, 0], [along, 40 + abs(along), 0]])
        points = local @ turn.T + rng.normal(0, 300, 3)
        found = taught_frame.of_points(points, error_mm)
        np.testing.assert_allclose(found.matrix[:3, :3], turn, atol=1e-9)
        for _ in range(8):
            off = rng.normal(size=(3, 3))
            off *= error_mm / np.linalg.norm(off, axis=1, keepdims=True)
            there = taught_frame.of_points(points + off, error_mm).matrix[:3, :3]
            turned_deg = np.degrees(Rotation.from_matrix(there @ turn.T).magnitude())
            worst = max(worst, turned_deg / found.axes_error_deg)
    assert 0.5 < worst < 1.01


def test_a_frame_that_is_in_another_one_stays_in_it(tmp_path: Path) -> None:
    o, x, y = taught_points(AR4, TILTED, [0, 0, 0], [90, 0, 0], [20, 60, 0])
    path = arm_file(tmp_path, FRAMES + postures(o=o, x=x, y=y), "ar4")
    assert cli("teach", "frame", "tray", "--at", "o,x,y", "--arm", str(path), "--replace").exit_code == 0
    arm = Arm.load(path)
    assert [each.frame for each in arm.frames if each.name == "tray"] == ["table"]
    np.testing.assert_allclose(arm.frame("tray"), TILTED, atol=0.02)


@pytest.mark.parametrize(
    "text",
    [
        "[frame.a]\nmatrix = [\n [1,0,0,5],\n [0, 1, 0, 6],\n [0,0,1,7],\n [0, 0, 0, 1]\n]\n# end\n",
        '[frame.a]\nframe = "b" # on it\n# c\nposition_mm = [1,\n 2, 3]\nrpy_deg = [1,2,3]\n',
        '[frame.a]\nrpy_deg = [1,2,3] # r\n# p\nframe = "b"\nposition_mm = [1, 2, 3]\n',
        "[frame.a] # a\nposition_mm = [1, 2, 3]\n# turned\nyaw_deg = 5\n",
    ],
)
def test_only_the_table_of_the_frame_changes(text: str) -> None:
    values = {"frame": "b", "position_mm": [7.0, 8.5, -9.0], "rpy_deg": [0.0, 0.0, 1.0]}
    after = "\n[frame.b]\nposition_mm = [1, 2, 3]\n"
    changed = taught.with_table(text + after, ("frame", "a"), values, Path("arm.toml"))
    assert tomllib.loads(changed) == {"frame": {"a": values, "b": {"position_mm": [1, 2, 3]}}}
    assert changed.endswith(after)
    assert changed.count("#") == text.count("#")


@pytest.mark.parametrize(
    ("points", "more", "said"),
    [
        ([[90, 0, 0], [45, 1, 0]], [], "the three points are almost on a line: the third is 1 mm beside"),
        ([[90, 0, 0], [-40, 5, 0]], [], "almost on a line"),
        (
            [[3, 0, 0], [0, 60, 0]],
            [],
            "a point on the x axis is 3 mm from the origin, too near for the steps",
        ),
        ([[90, 0, 0], [0, 2, 0]], [], "a point on the side of y is 2 mm from the origin"),
        ([[90, 0, 0], [0, 20, 60]], ["--level"], "which is not made level"),
    ],
)
def test_points_that_say_too_little_are_refused(
    tmp_path: Path, points: list[list[float]], more: list[str], said: str
) -> None:
    o, x, y = taught_points(AR4, TILTED, [0, 0, 0], *points)
    path = arm_file(tmp_path, postures(o=o, x=x, y=y), "ar4")
    before = path.read_text(encoding="utf-8")
    result = cli("teach", "frame", "tray", "--at", "o,x,y", "--arm", str(path), *more)
    assert result.exit_code == 2
    assert said in " ".join(result.output.split())
    assert path.read_text(encoding="utf-8") == before


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["frame"], "give one thing to teach"),
        (["frame", "tray", "more"], "give one thing to teach"),
        (["frame", "tray", "--posture", "park"], "give one thing to teach"),
        (["frame", "base", "--at", "home,home,home"], "'base' is the frame of the arm itself"),
        (["frame", "a b", "--at", "home,home,home"], "the name is not allowed"),
        (["frame", "bin", "--at", "home,home"], "2 postures; give 3"),
        (["frame", "bin", "--at", "home,homme,home"], "no posture 'homme'; did you mean 'home'"),
        (["frame", "bin", "--at", "home,home,home"], "is 0 mm from the origin"),
        (["frame", "bin", "--at", "home,home,home", "--by-hand"], "--by-hand is for points"),
        (["frame", "bin"], "teach by keys needs a terminal"),
        (["job.toml", "--level"], "--level and --tool are for frames"),
    ],
)
def test_a_frame_is_taught_only_as_far_as_it_makes_sense(tmp_path: Path, words: list[str], said: str) -> None:
    result = cli("teach", *words, "--arm", str(arm_file(tmp_path)), "--port", "nowhere")
    assert result.exit_code == 2
    assert said in " ".join(result.output.replace("\nhint: ", "; ").split())
    assert "nowhere" not in result.output
    refused = cli("teach", "frame", "tray", "--at", "home,home,home", "--arm", "ar4")
    assert "belongs to armtempo" in refused.output


def test_the_keys_take_the_three_points_one_by_one(tmp_path: Path) -> None:
    o, x, near, line, y = taught_points(
        AR4, TILTED, [0, 0, 0], [90, 0, 0], [2, 0, 0], [150, 0.5, 0], [20, 60, 0]
    )
    path = arm_file(tmp_path, "", "ar4")
    new = NewFrame(path, AR4, "tray", level=False, replace_old=False)
    here = iter([o, near, x, line, y, y])
    points = NamedPoints(AR4, lambda: np.array(next(here)), new)
    with pytest.raises(InputError, match="0 of 3 points, so no frame"):
        points.save()
    said = [points.take() for _ in range(6)]
    for one, wanted in zip(
        said,
        (
            "the origin taken; next: a point on the x axis",
            "not taken: a point on the x axis is 2 mm",
            "a point on the x axis taken; next: a point on the side of y",
            "not taken: the three points are almost on a line",
            "a point on the side of y taken; next: q writes the frame",
            "not taken: all 3 are there",
        ),
        strict=True,
    ):
        assert one.startswith(wanted), one
    points.save()
    np.testing.assert_allclose(Arm.load(path).frame("tray"), TILTED, atol=0.03)


def test_the_screen_says_the_whole_reason_why_a_point_is_not_taken(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    class Keys:
        """Takes two points at the same place, and ends."""

        def __init__(self) -> None:
            self._left = iter("ppq")

        def read(self, timeout_s: float) -> str:
            return next(self._left)

    class Here:
        """A board whose arm stays at home."""

        arm = AR4

        def posture_deg(self) -> np.ndarray:
            return np.array(AR4.home_deg)

    new = NewFrame(arm_file(tmp_path, "", "ar4"), AR4, "tray", level=False, replace_old=False)
    moved_a_step = iter([0.0, 0.1])
    points = NamedPoints(AR4, lambda: np.array(AR4.home_deg) + next(moved_a_step), new)
    JogScreen(cast(Any, Here()), cast(Any, Keys()), more=points.keys).loop()
    said = capsys.readouterr().out
    assert "too near for the steps of this arm; take it at least" in said
    assert "…" not in said
