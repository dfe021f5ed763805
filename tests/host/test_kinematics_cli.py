"""``armtempo fk`` and ``armtempo ik``: forms of input, tables, JSON, exit codes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from armtempo.cli import main
from armtempo.kinematics import forward
from armtempo.kinematics.forward import all_frames
from armtempo.model import pose, shipped
from click.testing import CliRunner, Result

from tests.host.arms import FOUR, PAPER, toml

EQ_16_AT_1_TO_5 = "0 0 -1 -536.404 0 1 0 0 1 0 0 434.698"
POSITION = ("--position", "-536.404", "0", "434.698")


def run(*arguments: str | Path) -> Result:
    return CliRunner(env={"ARMTEMPO_ARM": str(shipped.arm_path())}).invoke(main, ["ik", *map(str, arguments)])


def solutions(*arguments: str | Path) -> list[dict[str, Any]]:
    result = run(*arguments, "--json")
    assert result.exit_code == 0, result.output
    poses: list[dict[str, Any]] = json.loads(result.stdout)["poses"]
    return poses


def test_table_shows_all_eight_with_reasons_and_the_choice() -> None:
    result = run("--matrix", EQ_16_AT_1_TO_5)
    assert result.exit_code == 0
    head, columns, *rows, tool, driven = result.stdout.splitlines()
    assert head == "pose 1: 4 of 4 arm postures reach the wrist centre (the paper's region II)"
    assert columns.split()[:4] == ["no", "branch", "theta1", "deg"]
    assert len(rows) == 8
    assert [row[0] for row in rows] == ["*"] + [" "] * 7
    assert rows[0].split()[5:8] == ["180.0000", "-37.9997", "-52.0005"]
    assert "rejected: joint 2 at -191.7 deg is 21.66 deg below its range -170 to 10" in rows[6]
    assert tool == (
        "tool at -536.404 0 434.698 mm, roll 0, pitch -90, yaw 0 deg: 0 mm and 0 deg from the pose"
    )
    assert driven.startswith(
        "with the joints that have no motor at home the tool is 0.000106 mm and 0.000152 deg"
    )


@pytest.mark.parametrize(
    "form",
    [
        ("--matrix", EQ_16_AT_1_TO_5 + " 0 0 0 1"),
        (*POSITION, "--rpy", "0", "-90", "0"),
        (*POSITION, "--quaternion", "0.70710678", "0", "-0.70710678", "0"),
    ],
)
def test_every_form_of_a_pose_means_the_same(form: tuple[str, ...]) -> None:
    (by_matrix,), (by_form,) = solutions("--matrix", EQ_16_AT_1_TO_5), solutions(*form)
    assert by_form["chosen"] == by_matrix["chosen"] == 1
    for one, other in zip(by_form["solutions"], by_matrix["solutions"], strict=True):
        np.testing.assert_allclose(
            np.exp(1j * np.radians(one["angles_deg"])),
            np.exp(1j * np.radians(other["angles_deg"])),
            atol=1e-7,
        )


def test_json_names_branch_reasons_and_region() -> None:
    (answer,) = solutions("--matrix", EQ_16_AT_1_TO_5)
    assert (answer["region"], answer["postures"], answer["on_axis_1"]) == ("II", 4, False)
    seventh = answer["solutions"][6]
    assert seventh["branch"] == {"base": "rear", "elbow": "down", "wrist": "plain"}
    assert not seventh["usable"]
    (reason,) = seventh["rejections"]
    assert (reason["kind"], reason["joint"]) == ("range", 2)
    assert reason["amount"] == pytest.approx(-21.662, abs=1e-3)


def test_a_file_of_poses_is_followed_from_posture_to_posture(tmp_path: Path) -> None:
    path = np.radians([[0, -60, 40, 10, 20, 100], [10, -65, 45, 20, 30, 170], [20, -70, 50, 30, 40, 240]])
    file = tmp_path / "poses.txt"
    file.write_text(
        "".join(" ".join(map(repr, pose.ravel().tolist())) + "\n" for pose in forward(PAPER, path))
    )
    answers = solutions("--poses", file)
    chosen = [answer["solutions"][answer["chosen"] - 1]["angles_deg"] for answer in answers]
    # Joint 6 continues past half a turn, because each pose follows the one before.
    np.testing.assert_allclose(chosen, np.degrees(path), atol=1e-6)


def test_previous_posture_chooses_the_branch() -> None:
    (answer,) = solutions("--matrix", EQ_16_AT_1_TO_5, "--previous", "0, -90, -150, 0, -20, 180")
    assert answer["chosen"] == 6


@pytest.mark.slow
def test_out_of_reach_ends_with_1_and_the_inequality() -> None:
    result = run("--position", "900", "0", "300", "--rpy", "0", "0", "0")
    assert result.exit_code == 1
    assert "0 of 4 arm postures reach the wrist centre (the paper's region IV)" in result.stdout
    assert result.stdout.count("(Eq. (3), line 1)") == 8
    assert (
        "rejected: no posture reaches this pose within 0.1 mm and 0.1 deg: the nearest one" in result.stdout
    )
    assert result.stderr.startswith(
        "armtempo: no solution for pose 1; the reasons are listed with it\nhint: move it nearer"
    )
    unreachable = run("--position", "900", "0", "300", "--rpy", "0", "0", "0", "--json")
    assert unreachable.exit_code == 1
    (answer,) = json.loads(unreachable.stdout)["poses"]
    assert answer["chosen"] is None
    assert {solution["angles_deg"] for solution in answer["solutions"]} == {None}


def test_singular_poses_say_so() -> None:
    straight = forward(PAPER, np.radians([20, -60, 40, 0, 0, 25])).ravel().tolist()
    result = run("--matrix", " ".join(map(repr, straight)), "--previous", "0 0 0 12 0 0")
    assert "theta5 = 0: joint 4 kept as before, joint 6 makes up the sum" in result.stdout
    result = run("--position", "0", "0", "600", "--rpy", "0", "0", "0", "--previous", "33 0 0 0 0 0")
    assert "4 of 4 arm postures reach the wrist centre, with any angle of joint 1 (" in result.stdout
    assert "     33.0000" in result.stdout


@pytest.mark.slow
def test_an_arm_outside_the_class_is_searched_numerically(tmp_path: Path) -> None:
    arm = tmp_path / "arm.toml"
    arm.write_text(
        shipped.arm_path().read_text().replace("d_mm = 360.0\na_mm = 0.0", "d_mm = 360.0\na_mm = 10.0")
    )
    form = ("--arm", arm, "--position", "300", "200", "300", "--rpy", "10", "20", "30")
    result = run(*form)
    assert result.exit_code == 0, result.output
    assert "no closed form for this arm: the wrist is not spherical" in result.stdout
    assert "pose 1: whole pose: " in result.stdout
    assert "postures found numerically from " in result.stdout
    assert "0 mm and 0 deg from the pose" in result.stdout
    (answer,) = solutions(*form)
    assert (answer["method"], answer["chosen"]) == ("numerical", 1)
    assert answer["miss"]["position_mm"] < 1e-6


@pytest.fixture
def four(tmp_path: Path) -> Path:
    """The arm file of a four-joint arm."""
    file = tmp_path / "four.toml"
    file.write_text(toml(FOUR))
    return file


def test_a_four_joint_arm_takes_a_pose_whose_yaw_is_typed_with_three_digits(four: Path) -> None:
    form = ("--arm", four, "--position", "345", "120", "60", "--rpy", "90", "0", "19.179")
    result = run(*form)
    assert result.exit_code == 0, result.output
    first, *_, last = result.stdout.splitlines()
    assert first == "no closed form for this arm: it has 4 joints, not 6"
    assert last.startswith("tool at 345 120 60 mm, roll 90, pitch 0, yaw 19.179 deg: ")
    (answer,) = solutions(*form)
    assert 0.0 < answer["miss"]["position_mm"] < 1e-3
    assert 0.0 < answer["miss"]["rotation_deg"] < 1e-3
    assert (answer["tolerance_mm"], answer["tolerance_deg"]) == (0.1, 0.1)


def test_a_miss_has_units_and_tolerances_can_be_given(four: Path) -> None:
    form = ("--arm", four, "--position", "345", "120", "60", "--rpy", "90", "0", "20")
    refused = run(*form)
    assert refused.exit_code == 1
    assert (
        "rejected: no posture reaches this pose within 0.1 mm and 0.1 deg: the nearest one" in refused.stdout
    )
    assert "as it asks for 6 numbers and 4 joints move, ask for less: position and pitch" in refused.stdout
    assert "nearest posture found, deg:" in refused.stdout
    assert "give larger --tolerance-mm and --tolerance-deg" in refused.stderr
    (answer,) = solutions(*form, "--tolerance-mm", "0.5", "--tolerance-deg", "1")
    assert answer["miss"]["position_mm"] <= 0.5
    assert 0.5 < answer["miss"]["rotation_deg"] <= 1.0


@pytest.mark.parametrize(
    ("orientation", "words", "asked"),
    [
        ((), "position only: ", []),
        (("--pitch", "90"), "position and pitch: ", ["pitch"]),
        (("--roll", "0", "--pitch", "90"), "position and roll and pitch: ", ["roll", "pitch"]),
        (("--approach", "0.6", "-0.8", "0"), "position and approach: ", ["approach"]),
    ],
)
def test_a_pose_may_ask_for_less(
    four: Path, orientation: tuple[str, ...], words: str, asked: list[str]
) -> None:
    form = ("--arm", four, "--position", "240", "180", "80", *orientation)
    result = run(*form)
    assert result.exit_code == 0, result.output
    assert f"pose 1: {words}" in result.stdout
    (answer,) = solutions(*form)
    assert answer["asked"] == ["position", *asked]
    np.testing.assert_allclose(answer["tool"]["position_mm"], [240, 180, 80], atol=1e-6)
    if "pitch" in asked:
        assert answer["tool"]["rpy_deg"][1] == pytest.approx(90.0, abs=1e-5)
    if asked == ["approach"]:
        np.testing.assert_allclose(np.array(answer["tool"]["matrix"])[:3, 2], [0.6, -0.8, 0.0], atol=1e-9)


def test_a_position_moves_only_the_joints_with_a_motor() -> None:
    (answer,) = solutions("--position", "-536.404", "0", "434.698")
    assert len(answer["solutions"]) == 4
    assert {tuple(each["angles_deg"][3:]) for each in answer["solutions"]} == {(0.0, 0.0, 0.0)}
    assert answer["chosen"] == 1
    assert [each["usable"] for each in answer["solutions"]] == [True, True, True, False]


def test_a_file_of_poses_may_leave_angles_free(four: Path, tmp_path: Path) -> None:
    file = tmp_path / "poses.txt"
    file.write_text("240 180 80\n240 180 80 - 90 -\n")
    both = solutions("--arm", four, "--poses", file, "--tolerance-mm", "0.2")
    assert [answer["asked"] for answer in both] == [["position"], ["position", "pitch"]]
    assert {answer["tolerance_mm"] for answer in both} == {0.2}


def test_numerical_finds_the_eight_too() -> None:
    form = ("--position", "300", "200", "300", "--rpy", "10", "20", "30")
    (closed,), (searched,) = solutions(*form), solutions(*form, "--numerical")
    assert len(searched["solutions"]) == len(closed["solutions"]) == 8
    chosen = closed["solutions"][closed["chosen"] - 1]
    np.testing.assert_allclose(searched["angles_deg"], chosen["angles_deg"], atol=1e-5)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "give one of --matrix, --position and --poses"),
        (("--matrix", EQ_16_AT_1_TO_5, *POSITION, "--rpy", "0", "0", "0"), "give one of"),
        (("--matrix", EQ_16_AT_1_TO_5, "--rpy", "0", "0", "0"), "--position goes alone or with one of"),
        (("--matrix", EQ_16_AT_1_TO_5, "--pitch", "0"), "--position goes alone or with one of"),
        (("--pitch", "0"), "give one of --matrix, --position and --poses"),
        (
            (*POSITION, "--rpy", "0", "0", "0", "--quaternion", "1", "0", "0", "0"),
            "--position goes alone or with one of",
        ),
        ((*POSITION, "--rpy", "0", "0", "0", "--pitch", "0"), "--position goes alone or with one of"),
        ((*POSITION, "--roll", "0", "--yaw", "0"), "roll and yaw without pitch do not define an orientation"),
        (
            (*POSITION, "--approach", "0", "0", "0"),
            "--approach: the approach has length 0",
        ),
        ((*POSITION, "--pitch", "nan"), "a finite number"),
        ((*POSITION, "--tolerance-mm", "0"), "--tolerance-mm"),
        ((*POSITION, "--tolerance-deg", "181"), "--tolerance-deg"),
        (("--matrix", "1 2 3"), "--matrix: 3 numbers are not a pose\nhint: give 12 (3 rows of a matrix), 16"),
        (("--matrix", "1 0 0 0 0 1 0 0 0 0 x 0"), "--matrix: 'x' is not a number"),
        (("--matrix", "2 0 0 0 0 1 0 0 0 0 1 0"), "--matrix: the 3 x 3 part is not a rotation"),
        ((*POSITION, "--quaternion", "1", "1", "0", "0"), "--quaternion: this quaternion has length 1.41421"),
        ((*POSITION, "--rpy", "nan", "0", "0"), "a finite number"),
        ((*POSITION, "--rpy", "one", "0", "0"), "'one' is not a valid float"),
        (("--poses", "no-such-file.txt"), "no-such-file.txt: cannot be read"),
        (
            ("--matrix", EQ_16_AT_1_TO_5, "--previous", "1 2 3"),
            "--previous: 3 angles given, the arm has 6 joints",
        ),
        (("--matrix", EQ_16_AT_1_TO_5, "--previous", "1 2 3 4 5 b"), "--previous: 'b' is not a number"),
        (("--matrix", EQ_16_AT_1_TO_5, "--previous", "0 0 nan 0 0 0"), "--previous: 'nan' is not a finite"),
        (("--arm", "no-such-arm.toml", "--matrix", EQ_16_AT_1_TO_5), "no-such-arm.toml"),
    ],
)
def test_wrong_input_ends_with_2_and_one_clear_message(arguments: tuple[str, ...], words: str) -> None:
    result = run(*arguments)
    assert result.exit_code == 2, result.output
    assert words in result.stderr
    assert "Traceback" not in result.stderr
    assert result.stdout == ""


# ``armtempo fk``: the tool's pose and every frame, as a table and as JSON


def run_fk(*arguments: str | Path) -> Result:
    return CliRunner().invoke(main, ["fk", *map(str, arguments)])


def fk_values(*arguments: str | Path) -> dict[str, Any]:
    result = run_fk(*arguments, "--json")
    assert result.exit_code == 0, result.output
    found: dict[str, Any] = json.loads(result.stdout)
    return found


def test_the_paper_s_last_via_point_stands_at_eq_16() -> None:
    tool = fk_values("180,-38,-52")["tool"]
    np.testing.assert_allclose(tool["position_mm"], [-536.404, 0.0, 434.698], atol=1e-3)
    np.testing.assert_allclose(
        tool["matrix"], forward(PAPER, np.radians([180, -38, -52, 0, 0, 0])), atol=1e-9
    )
    np.testing.assert_allclose(
        pose.from_rpy((0, 0, 0), tool["rpy_deg"])[:3, :3], np.array(tool["matrix"])[:3, :3], atol=1e-12
    )
    assert tool["quaternion"] == pytest.approx([0.7071068, 0.0, -0.7071068, 0.0], abs=1e-6)


def test_every_frame_is_listed_from_the_base_to_the_tool() -> None:
    found = fk_values("10,-60,40,20,30,170")
    frames = found["frames"]
    assert [frame["name"] for frame in frames] == [
        "base",
        *(f"joint {n}" for n in range(1, 6)),
        "joint 6 (tool)",
    ]
    assert frames[0]["position_mm"] == [0.0, 0.0, 0.0]
    wanted = all_frames(PAPER, np.radians([10.0, -60.0, 40.0, 20.0, 30.0, 170.0]).tolist())
    np.testing.assert_allclose([frame["matrix"] for frame in frames], wanted, atol=1e-9)
    assert frames[-1]["matrix"] == found["tool"]["matrix"]


@pytest.mark.parametrize(
    "form", [("0", "-60", "40"), ("0,-60,40",), ("0 -60 40",), ("0,-60,40,0,0,0",), ("P0",), ()]
)
def test_every_form_of_a_posture_means_the_same(form: tuple[str, ...]) -> None:
    assert fk_values(*form)["angles_deg"] == [0.0, -60.0, 40.0, 0.0, 0.0, 0.0]
    assert fk_values(*form)["tool"] == fk_values("0,-60,40")["tool"]


def test_the_table_has_units_and_a_row_a_frame() -> None:
    result = run_fk("-10", "-60", "40")
    assert result.exit_code == 0
    title, heads, units, *rows = result.stdout.splitlines()
    assert title == "paper-1to5 at -10.0000 -60.0000 40.0000 0.0000 0.0000 0.0000 deg"
    assert heads.split() == ["frame", "x", "y", "z", "roll", "pitch", "yaw"]
    assert units.split() == ["mm", "mm", "mm", "deg", "deg", "deg"]
    assert rows[0].split() == ["base", *["0.0000"] * 6]
    assert " ".join(rows[6].split()) == "joint 6 (tool) 295.0200 -52.0200 54.9730 180.0000 -20.0000 -10.0000"
    assert rows[7] == "tool as a matrix, lengths in mm:"
    assert rows[12].startswith("tool as a quaternion w x y z: 0.0151")


def test_angles_out_of_range_are_shown_with_a_note() -> None:
    result = run_fk("300,-60,40")
    assert result.exit_code == 0
    assert result.stdout.splitlines()[-1] == "note: joint 1 at 300 deg is 110 deg above its range -10 to 190"
    assert fk_values("300,-60,40")["out_of_range"] == [
        "joint 1 at 300 deg is 110 deg above its range -10 to 190"
    ]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            ("1,2",),
            "2 angles given, but arm 'paper-1to5' has 6 joints, of which 3 have a motor\nhint: give one angle",
        ),
        (("1,2,x",), "the angles: 'x' is not a number"),
        (("1,2,nan",), "the angles: 'nan' is not a finite number"),
        (("P99",), "has no via point P99\nhint: give one of P0 to P6"),
        (("none.json",), "none.json: no such file"),
        (("0,0,0", "--arm", "none.toml"), "none.toml: neither a file"),
    ],
)
def test_wrong_input_of_fk_ends_with_2_and_one_clear_message(arguments: tuple[str, ...], words: str) -> None:
    result = run_fk(*arguments)
    assert result.exit_code == 2
    assert words in result.stderr
    assert result.stdout == ""
