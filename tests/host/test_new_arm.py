"""``armtempo new``: what it writes can be planned at once, and nothing that is there is touched."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.cli import main
from armtempo.kinematics import of_arm
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.sequence import Sequence
from armtempo.model.workspace import FAR_MM
from armtempo.new_arm import folder as project_folder
from armtempo.new_arm import joint_entry
from click.testing import CliRunner, Result
from numpy.typing import NDArray

FOUR = (
    "d_mm=120,alpha_deg=90,low_deg=-170,high_deg=170,gear_ratio=20",
    "name=shoulder,a_mm=200,low_deg=-10,high_deg=120,gear_ratio=40,speed_deg_s=30",
    "a_mm=180,low_deg=-120,high_deg=0,gear_ratio=30,microsteps=8",
    "a_mm=60,gear_ratio=10,encoder_counts=4000",
)


def new(*arguments: str, text: str | None = None) -> Result:
    return CliRunner().invoke(main, ["new", *arguments], input=text)


@pytest.mark.slow
def test_an_own_arm_of_four_joints_is_planned_at_once(tmp_path: Path) -> None:
    folder = tmp_path / "my arm"
    done = new(str(folder), *(word for joint in FOUR for word in ("--joint", joint)))
    assert done.exit_code == 0, done.output
    arm = Arm.load(folder / "arm.toml")
    assert [joint.name for joint in arm.driven] == ["joint 1", "shoulder", "joint 3", "joint 4"]
    assert arm.driven[1].limits.speed_deg_s == 30.0
    assert arm.driven[2].motor.microsteps == 8
    encoder = arm.driven[3].encoder
    assert encoder is not None
    assert encoder.counts_per_rev == 4000
    out = tmp_path / "first.json"
    planned = CliRunner().invoke(
        main,
        ["plan", "--arm", str(folder / "arm.toml"), "--job", str(folder / "first.toml"), "-o", str(out)],
    )
    assert planned.exit_code == 0, planned.output
    assert out.exists()
    assert "355.56" in done.output  # steps per degree of the shoulder: 200 * 16 * 40 / 360


@pytest.mark.parametrize("name", list(shipped.files()))
def test_the_first_job_of_every_arm_that_ships_is_within_its_ranges(name: str, tmp_path: Path) -> None:
    project_folder.write(tmp_path / name, project_folder.from_shipped(name), "sim:board")
    arm = Arm.load(tmp_path / name / "arm.toml")
    job = Job.load(tmp_path / name / "first.toml", arm)
    sequence = Sequence.load(tmp_path / name / "sequence.toml", arm)
    assert sequence.name == "cycle"
    assert len(job.via) == 3
    for angles in job.via:
        assert isinstance(angles, tuple)
        for angle, joint in zip(angles, arm.driven, strict=True):
            assert joint.range_deg[0] <= angle <= joint.range_deg[1]
    assert job.via[0] == pytest.approx(arm.home_deg)
    assert job.via[2] != job.via[1] != job.via[0]


@pytest.mark.parametrize(
    ("gear_ratio", "joints", "most"),
    [(20.0, 1, 300.0 * 6 / 20), (1.0, 1, 1800.0), (1.0, 6, 1800.0)],
)
def test_speed_that_motor_and_board_allow(gear_ratio: float, joints: int, most: float) -> None:
    entry = joint_entry.JointEntry("j", gear_ratio=gear_ratio)
    assert entry.most_speed_deg_s(joints) == pytest.approx(most)
    fine = joint_entry.JointEntry("j", microsteps=256, gear_ratio=gear_ratio)
    assert fine.most_speed_deg_s(6) * fine.steps_per_deg <= 40_000.0 + 1e-6


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (("--joint", "gear=3"), "'gear=3' is not one of the keys"),
        (("--joint", "a_mm"), "'a_mm' is not one of the keys"),
        (("--joint", "a_mm=1,a_mm=2"), "is given twice"),
        (("--joint", "a_mm=long"), "a_mm = 'long' is not a number"),
        (("--joint", "microsteps=1.5"), "microsteps = '1.5' is not a number"),
        (("--joint", "low_deg=20,high_deg=10"), "range_deg"),
        (("--like", "puma"), "parol6"),
        (("--like", "ar4", "--joint", "a_mm=3"), ""),
        ((), "which arm?"),
    ],
)
def test_what_is_wrong_is_named_and_nothing_written(
    options: tuple[str, ...], named: str, tmp_path: Path
) -> None:
    done = new(str(tmp_path / "x"), *options)
    assert done.exit_code == 2
    assert named in done.output
    assert not list(tmp_path.iterdir())


def test_a_folder_with_something_in_it_is_kept(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    done = new(str(tmp_path), "--like", "ar4")
    assert done.exit_code == 2
    assert "not empty" in done.output
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_an_empty_folder_is_filled(tmp_path: Path) -> None:
    (tmp_path / "here").mkdir()
    assert new(str(tmp_path / "here"), "--like", "scara").exit_code == 0
    assert (tmp_path / "here" / "armtempo.toml").exists()


def test_questions_at_a_terminal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("armtempo.cli.new._asked", lambda: True)
    answers = [
        "own",
        "1",
        "",
        "turntable",
        "",
        "",
        "",
        "",
        "",
        "-180",
        "180",
        "",
        "",
        "5",
        "",
        "20",
        "-5",
        "-300 400",
        "none",
        "sim:table",
    ]
    done = new(str(tmp_path / "x"), text="\n".join(answers) + "\n")
    assert done.exit_code == 0, done.output
    arm = Arm.load(tmp_path / "x" / "arm.toml")
    assert arm.driven[0].name == "turntable"
    assert arm.driven[0].motor.gear_ratio == 5.0
    assert arm.driven[0].limits.speed_deg_s == 20.0
    assert arm.workspace is not None
    assert (arm.workspace.low_mm[0], arm.workspace.high_mm[0], arm.workspace.low_mm[2]) == (
        -300.0,
        400.0,
        -5.0,
    )
    assert arm.workspace.high_mm[1] == FAR_MM
    assert 'port = "sim:table"' in (tmp_path / "x" / "armtempo.toml").read_text()


def test_a_shipped_arm_gets_its_floor_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    done = interview(tmp_path / "x", monkeypatch, ["ar4", "0", "", "", ""])
    assert done.exit_code == 0, done.output
    found = Arm.load(tmp_path / "x" / "arm.toml").workspace
    assert found is not None
    assert found.low_mm == (-FAR_MM, -FAR_MM, 0.0)


def test_a_name_with_quotes_stays_one_line_and_control_characters_are_refused() -> None:
    text = project_folder.from_joints('a"', [joint_entry.JointEntry("b'\\")])
    assert text.arm.name == 'a"'
    assert text.arm.driven[0].name == "b'\\"
    with pytest.raises(InputError, match="control characters"):
        project_folder.from_joints("a\n", [joint_entry.JointEntry("b")])


def test_nothing_is_left_where_it_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        project_folder.write(tmp_path / "file" / "x", project_folder.from_shipped("paper"), "sim")


def interview(folder: Path, monkeypatch: pytest.MonkeyPatch, answers: list[str], *options: str) -> Result:
    monkeypatch.setattr("armtempo.cli.new._asked", lambda: True)
    return new(str(folder), *options, text="\n".join(answers) + "\n")


def test_each_answer_is_checked_where_it_is_given(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    answers = [
        *(
            "?",
            "mine",
            "own",
            "7",
            "1",
            "modified?",
            "?",
            "",
            "?",
            "<",
            "",
            "axis",
            "rolls",
            "",
            "x",
            "12",
            "",
            "1e9",
            "",
            "",
        ),
    ]
    answers += [
        "120",
        "-120",
        "<",
        "-120",
        "120",
        "200.5",
        "",
        "",
        "0",
        "2",
        "3",
        "",
        "1e9",
        "20",
        "table",
        "0",
        "400 -300",
        "",
        "",
        "",
    ]
    done = interview(tmp_path / "x", monkeypatch, answers)
    assert done.exit_code == 0, done.output
    for said in (
        "An arm that ships is a beginning",
        "it must be one of paper",
        "a whole number from 1 to 6, such as 3",
        "modified (Craig)",
        "it must be one of turns, slides",
        "'x' is not a number; write it as 120.5",
        "from -180 to 180, such as -90",
        "above the lowest angle, 120, such as 210; '<' goes back",
        "a whole number from 4 to 10000",
        "it must be from 0.1 to 10000, such as 4.5",
        "a whole number from 4 to 10000000",
        "'table': not a number; e.g. 0, or none",
        "'400 -300': not two numbers, the smaller first; e.g. -300 400, or none",
    ):
        assert said in done.output, said
    (joint,) = Arm.load(tmp_path / "x" / "arm.toml").joints
    assert (joint.name, joint.d_mm, joint.range_deg) == ("axis", 12.0, (-120.0, 120.0))
    assert [path.name for path in tmp_path.iterdir()] == ["x"]  # no draft is left


def test_what_was_answered_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "x"
    left = interview(folder, monkeypatch, ["own", "1", "", "axis"])
    assert left.exit_code == 130
    assert f"continue with: armtempo new {folder} --resume" in left.output
    assert not folder.exists()
    done = interview(folder, monkeypatch, ["", "", "44", *[""] * 12, ""], "--resume")
    assert done.exit_code == 0, done.output
    (joint,) = Arm.load(folder / "arm.toml").joints
    assert (joint.name, joint.a_mm) == ("axis", 44.0)
    assert interview(tmp_path / "y", monkeypatch, [], "--resume").exit_code == 2


def test_a_folder_that_is_taken_is_told_before_the_questions(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mine.txt").touch()
    done = interview(tmp_path, monkeypatch, [])
    assert done.exit_code == 2
    assert "which arm" not in done.output


def test_modified_rows_bring_the_tool_where_craigs_do() -> None:
    rng = np.random.default_rng(20_261)
    rows = rng.uniform(-90, 90, (4, 4)).round(2).tolist()
    joints = [
        joint_entry.JointEntry(f"j{n}", d_mm=d, a_mm=a, alpha_deg=alpha, theta_offset_deg=theta)
        for n, (d, a, alpha, theta) in enumerate(rows)
    ]
    pose = np.eye(4)
    for d, a, alpha, theta in rows:
        pose = pose @ turned(0, alpha) @ shifted(0, a) @ turned(2, theta) @ shifted(2, d)
    made = project_folder.from_joints("craig", joints, modified=True).arm
    np.testing.assert_allclose(of_arm.forward(made, [0.0] * 4), pose, atol=1e-9)


def test_a_parallel_linkage_is_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    joint = ["", "", "", "100", "", "", "", "", "", "", "", "4000", ""]
    answers = ["own", "2", "", *joint, *joint[:6], "yes", *joint[6:], "", "", "", ""]
    done = interview(tmp_path / "x", monkeypatch, answers)
    assert done.exit_code == 0, done.output
    assert [found.parallel_linkage for found in Arm.load(tmp_path / "x" / "arm.toml").joints] == [False, True]
    assert Arm.load(tmp_path / "x" / "arm.toml").driven[1].encoder is not None


def test_a_sliding_joint_is_asked_for_and_given_by_an_option(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    slide = ["rail", "slides", "", "", "-90", "", "", "300", "", "", "2", "10", "", "50"]
    arm_turns = ["", "", "", "100", "", "", "", "", "", "", "", "", ""]
    done = interview(tmp_path / "x", monkeypatch, ["own", "2", "", *slide, *arm_turns, "", "", "", ""])
    assert done.exit_code == 0, done.output
    assert "does a parallelogram turn it" not in done.output
    option = "name=rail,type=prismatic,alpha_deg=-90,high_mm=300,gear_ratio=2,mm_per_rev=10,speed_mm_s=50"
    given = new(str(tmp_path / "y"), "--joint", option, "--joint", "a_mm=100", "--port", "sim:board")
    assert given.exit_code == 0, given.output
    for folder in ("x", "y"):
        arm = Arm.load(tmp_path / folder / "arm.toml")
        rail = arm.driven[0]
        assert (rail.slides, rail.range_deg, rail.limits.speed_deg_s) == (True, (0.0, 300.0), 50.0)
        assert rail.steps_per_deg == pytest.approx(200 * 16 * 2 / 10)
        assert not arm.driven[1].slides
        Job.load(tmp_path / folder / "first.toml", arm)
    wrong = new(str(tmp_path / "z"), "--joint", "type=prismatic,high_deg=3")
    assert wrong.exit_code == 2
    assert "'high_deg=3' is not one of the keys" in wrong.output
    assert "high_mm" in wrong.output


def turned(axis: int, angle_deg: float) -> NDArray[np.float64]:
    pose, angle = np.eye(4), np.radians(angle_deg)
    one, two = [n for n in range(3) if n != axis]
    sign = -1.0 if axis == 1 else 1.0
    pose[one, one] = pose[two, two] = np.cos(angle)
    pose[two, one], pose[one, two] = sign * np.sin(angle), -sign * np.sin(angle)
    return pose


def shifted(axis: int, way_mm: float) -> NDArray[np.float64]:
    pose = np.eye(4)
    pose[axis, 3] = way_mm
    return pose
