"""Frames of the arm file: which may be, and that what is given in one is where it should be in the base."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import armtempo
import numpy as np
import pytest
from armtempo.basics import json_codec, toml_table
from armtempo.basics.errors import InputError, PlanError
from armtempo.cli import main
from armtempo.diagnosis.arm_check import check_arm
from armtempo.encoding import encode
from armtempo.kinematics.of_arm import forward
from armtempo.model import frame, workspace
from armtempo.model.arm import Arm
from armtempo.model.frame import ArmFrame
from armtempo.model.job import Job
from armtempo.model.pose import to_rpy_deg
from armtempo.model.tool_pose import WHOLE, Pose
from armtempo.planning import via_points
from armtempo.planning.jog import jog_motion
from armtempo.planning.jog.jog_motion import JogMove
from click.testing import CliRunner
from scipy.spatial.transform import Rotation

from tests.host import arms

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
    """A shipped arm file with frames after it."""
    return arms.write(folder, more, like=name)


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
        ('[frame."a\\nb\\u001b"]\nposition_mm = [0, 0, 0]', r"frame.a\nb\x1b: the name is not allowed"),
        ('[frame.a]\nposition_mm = [0, 0, 0]\n"b\\nc" = 1', r"frame.a.b\nc: unknown key"),
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
        ("[frame.a]\nposition_mm = [0, 0, 0]\nrpy_degs = [0, 0, 0]", "unknown key; did you mean 'rpy_deg'"),
        (
            "[frame.a]\nmatrix = [[1, 0, 0, 0], [0, 1], [0, 0, 1, 0], [0, 0, 0, 1]]",
            "frame.a.matrix row 2 = [0, 1] is not",
        ),
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


@pytest.mark.slow
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
        (["--position", "0", "0", "5", "--quaternion", "1", "1", "0", "0"], "this quaternion has length"),
        (["--position", "0", "0", "5", "--pitch", "0", "--frame", "tray"], "pitch alone cannot be given"),
        (["home", "--tool", "pen"], "no tool 'pen'"),
        (["home", "--tool", ""], "the name is empty"),
        (["home", "--holds", "cup"], "no load 'cup'"),
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
        (["--holds", "cup", "--axis", "x", "--by", "1"], "no load 'cup'"),
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
    more = "\n[frame.far]\nposition_mm = [3000, 0, 0]\n[tool.pen]\nposition_mm = [0, 0, 0.09]\n"
    (near,) = [each for each in check_arm(Arm.load(arm_file(tmp_path, more))) if each.where == "tool pen"]
    assert near.what == "its origin is 0.09 mm from that of the frame after the last row: is it in metres?"
    assert near.next_step.endswith("position_mm = [0, 0, 90]")
    far = [
        [each for each in check_arm(Arm.load(arm_file(tmp_path, text))) if each.where == "frame far"]
        for text in (more, more.replace("0.09]", "3000]"))
    ]
    assert [len(each) for each in far] == [1, 0], "a long tool reaches it"


def test_the_library_takes_frames_and_gives_poses_in_them() -> None:
    there = armtempo.Pose.of_angles([100, 0, 200], {"roll": 0, "pitch": 0, "yaw": 30})
    arm = replace(PAPER, frames=(armtempo.ArmFrame("tray", there.matrix),))
    over = arm.in_base(armtempo.Pose.of_angles([0, 0, 50], {}), "tray")
    np.testing.assert_allclose(np.array(over.matrix)[:3, 3], [100, 0, 250])
    assert Job("j", via=((0, -60, 40), over)).frames == ("tray",)
