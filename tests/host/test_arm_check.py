"""``armtempo check`` and ``armtempo doctor``: each finding where it is deserved, with a cure; nothing is changed."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import LinkError
from armtempo.cli import doctor, main, state
from armtempo.diagnosis import drives, figures, torque
from armtempo.diagnosis.arm_check import check, check_arm
from armtempo.diagnosis.finding import Level
from armtempo.kinematics.chain import chains_mm, outline_mm
from armtempo.kinematics.of_arm import forward
from armtempo.link.program_version import own_crc
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.model.frame import ArmFrame
from armtempo.model.parts import JointModel
from armtempo.ports.board_port import Port
from armtempo.robot.board_state import BoardState
from click.testing import CliRunner

from tests.host.arms import changed, run_check

STANDS_STILL = "\n[[joint]]\nd_mm = 0\na_mm = 0\nalpha_deg = 0\nrange_deg = [-1, 1]\n"
MOTOR_2 = "motor = { channel = 2, steps_per_rev = 200, microsteps = 8, gear_ratio = 20.0 }"
ENCODER_1 = 'encoder = { channel = 1, counts_per_rev = 4000, on = "joint", following_error_deg = 2.0 }'
FOUND = [
    ("a motor's steps", [("steps_per_rev = 200", "steps_per_rev = 201")], "warning", "joint 1: steps_per_rev = 201"),
    ("microsteps", [("microsteps = 32", "microsteps = 17")], "warning", "joint 1: microsteps = 17"),
    ("too many steps", [("speed_deg_s = 40.0", "speed_deg_s = 3000.0")], "error", "at its speed limit of 3000"),
    ("all together", [("speed_deg_s = 40.0", "speed_deg_s = 2690.0")], "warning",
     "all joints: the joints together need up to"),
    ("pulses", [("speed_deg_s = 40.0", "speed_deg_s = 2000.0"), ("pulse_us = 2.0", "pulse_us = 4.0")],
     "warning", "joint 2: speed_deg_s = 2000, but pulse_us and low_us allow a step every 6 us, 166667 steps/s"),
    ("reversals", [("dir_hold_us = 5.0", "dir_hold_us = 500.0"),
                   ("acceleration_deg_s2 = 50", "acceleration_deg_s2 = 50000")],
     "warning", "dir_hold_us allow opposite steps 707 us apart: motions keep to"),
    ("a slow motor", [("speed_deg_s = 50.0", "speed_deg_s = 0.2")], "warning", "the motor makes only 7.1 steps/s"),
    ("a fast motor", [("speed_deg_s = 40.0", "speed_deg_s = 500.0")], "warning", "the motor turns at 1667 rpm"),
    ("a sudden start", [("acceleration_deg_s2 = 50", "acceleration_deg_s2 = 9000")], "warning",
     "full speed in 5.6 ms"),
    ("no range", [("range_deg = [-10.0, 190.0]", "range_deg = [-0.1, 0.1]")], "error", "is 7.1 steps"),
    ("a step over its watch", [("microsteps = 32, gear_ratio = 2.0", "microsteps = 1, gear_ratio = 0.5")], "warning",
     "joint 1: its smallest step, 3.6 deg, is more than its following_error_deg of 2"),
    ("a coarse tool", [("microsteps = 32, gear_ratio = 2.0", "microsteps = 16, gear_ratio = 2.0")], "warning",
     "joint 1: its smallest step, 0.0562 deg, moves the tool by up to 0.8 mm (more than 0.5)"),
    ("a blind encoder", [("following_error_deg = 2.0", "following_error_deg = 0.05")], "error",
     "less than one count"),
    ("a nervous encoder", [("following_error_deg = 2.0", "following_error_deg = 1.0")], "warning", "a healthy joint"),
    ("an idle encoder", [("following_error_deg = 2.0", "following_error_deg = 0")], "note", "lost steps stop nothing"),
    ("a fast encoder", [("counts_per_rev = 4000", "counts_per_rev = 9000000")], "warning",
     "read up to 1e+06 counts/s: motions keep to 40"),
    ("no encoder", [(ENCODER_1, "")], "note", "encoders: no encoder: joint 1"),
    ("gravity", [("gravity_torque_nm = 1.5", "gravity_torque_nm = 15")], "error",
     "which holds 0.65: the joint falls"),
    ("weak", [("gravity_torque_nm = 1.5", "gravity_torque_nm = 12.9")], "error", "at its limits: it loses steps"),
    ("nearly weak", [("gravity_torque_nm = 1.5", "gravity_torque_nm = 9")], "warning", "has 1.3 times the torque"),
    ("torque", [("holding_torque_nm = 0.65", "holding_torque_nm = 0")], "note", "not checked for joint 1: no"),
    ("one channel", [("channel = 2, steps", "channel = 1, steps")], "error", "joint 1 and joint 2: share motor"),
    ("one encoder", [("{ channel = 2, counts", "{ channel = 1, counts")], "error", "share encoder.channel = 1"),
    ("the button", [("channel = 2, steps", "channel = 6, steps")], "note", "takes the pin of the board's button"),
    ("no E-stop", [], "note", "safety: no E-stop is fitted"),
    ("levels",
     [("home_deg = 0.0", 'switches = { low = 1, low_deg = -11, active = "high" }'),
      ("home_deg = -60.0", "home_deg = -60\nswitches = { high = 1, high_deg = 12 }")],
     "error", "switches: input 1 is set to trip both at low and at high level"),
    ("switches crossed", [("home_deg = 0.0", "switches = { low = 1, high = 2, low_deg = 191, high_deg = -11 }")],
     "error", "joint 1: its low switch trips at 191 deg, not below"),
    ("no input", [("home_deg = 0.0", "switches = { low_deg = -11 }")], "warning", "but no input for that switch"),
    ("no angle", [("home_deg = 0.0", "switches = { low = 1 }")], "note", "its low switch protects, but cannot home"),
    ("inside", [("home_deg = 0.0", "switches = { high = 1, high_deg = 180 }")], "warning",
     "joint 1: its high switch trips at 180 deg, within its range of -10 to 190"),
    ("a switch alone", [("range_deg = [-180.0, 180.0]", "range_deg = [-180.0, 180.0]\nswitches = { low = 1 }")],
     "warning", "joint 4: has switches but no motor"),
    ("below", [("d_mm = 130.0", "d_mm = 0.0")], "warning", "the home posture goes 75 mm below the base plane"),
    ("through itself", [("home_deg = 40.0", "home_deg = 97.0")], "warning", "in the home posture links come within"),
    ("ends below", [], "note", "ranges: from home, the arm goes below its base plane with joint 2 at 10 (271 mm)"),
    ("ends meet", [], "note", "ranges: from home, links collide with"),
    ("a wide range", [("-10.0, 190.0", "-190.0, 190.0")], "note",
     "joint 1: its range of 380 deg is more than a turn"),
    ("metres", [("a_mm = 300.0", "a_mm = 0.3")], "warning", "joint 2: a_mm = 0.3: is it in metres?"),
    ("radians", [("alpha_deg = -90.0", "alpha_deg = -1.5708")], "warning", "alpha_deg = -1.5708: is it in radians?"),
    ("a range in radians", [("range_deg = [-10.0, 190.0]", "range_deg = [-0.17, 2.79]")], "warning",
     "joint 1: range_deg = [-0.17, 2.79]: is it in radians?"),
    ("a speed in degrees/s", [("speed_deg_s = 50.0", "speed_deg_s = 2865.0")], "warning",
     "joint 1: speed_deg_s = 2865, 50 rad/s: were degrees/s taken as rad/s?"),
    ("still joints", [], "note", "motors: no motor: joint 4, joint 5, joint 6"),
]  # fmt: skip


@pytest.mark.parametrize("name", shipped.files())
def test_nothing_looks_wrong_about_the_arms_that_ship(name: str) -> None:
    result = run_check("--arm", name)
    assert result.exit_code == 0, result.output
    assert "\n0 errors, 0 warnings, " in result.output
    assert "steps/s; the board supports 240000 (estimated; 'armtempo selftest'" in result.output
    assert all(finding.level is Level.NOTE for finding in check_arm(Arm.load(name)))


@pytest.mark.parametrize(
    ("changes", "level", "said"), [row[1:] for row in FOUND], ids=[row[0] for row in FOUND]
)
def test_what_looks_wrong_is_found(
    tmp_path: Path, changes: list[tuple[str, str]], level: str, said: str
) -> None:
    _, found = check(changed(tmp_path, *changes))
    texts = [f"{finding.where}: {finding.what}" for finding in found if finding.level.value == level]
    assert any(said in text for text in texts), found
    assert all(finding.next_step and finding.what and finding.where for finding in found)
    assert [finding.level for finding in found] == sorted((f.level for f in found), key=list(Level).index)


def test_lengths_of_0_are_an_error(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    joint = STANDS_STILL + "limits = { speed_deg_s = 10, acceleration_deg_s2 = 10, jerk_deg_s3 = 40 }\n"
    path.write_text('name = "point"\n' + joint + MOTOR_2 + "\n")
    _, found = check(path)
    assert found[0].what == "all lengths are 0"


def test_what_the_board_refuses_is_an_error(tmp_path: Path) -> None:
    path = changed(tmp_path, ("range_deg = [-10.0, 190.0]", "range_deg = [-36000, 36000]"))
    path.write_text(
        path.read_text().replace("gear_ratio = 2.0", "gear_ratio = 10000", 1).replace("50.0,", "0.5,", 1)
    )
    _, found = check(path)
    assert any("more than the board can count" in finding.what for finding in found)


def test_an_unreadable_file_is_a_finding_with_exit_code_1(tmp_path: Path) -> None:
    path = changed(tmp_path, ("gear_ratio = 20.0", "gear_ratio = 1e-308"))
    result = run_check("--arm", path)
    assert result.exit_code == 1
    assert "joint[2].motor.gear_ratio = 1e-308 is not allowed" in result.output
    assert "1 error, 0 warnings" in result.output


def test_warnings_leave_the_exit_code_0(tmp_path: Path) -> None:
    result = run_check("--arm", changed(tmp_path, ("microsteps = 32", "microsteps = 33")))
    assert result.exit_code == 0
    assert "0 errors, 1 warning" in result.output
    assert "nothing looks wrong" not in result.output


def test_an_arm_without_motors_is_told_what_is_missing(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    path.write_text('name = "still"\n' + STANDS_STILL.replace("a_mm = 0", "a_mm = 50"))
    result = run_check("--arm", path)
    assert result.exit_code == 1
    assert "no joint has a motor" in result.output


def test_an_arm_that_is_not_there_is_a_usage_error(tmp_path: Path) -> None:
    assert run_check("--arm", tmp_path / "none.toml").exit_code == 2


def test_json_says_the_same(tmp_path: Path) -> None:
    path = changed(tmp_path, ("microsteps = 32", "microsteps = 33"))
    arm, found = check(path)
    assert arm is not None
    values = json.loads(run_check("--arm", path, "--json").output)
    assert values["arm"] == "paper-1to5"
    assert values["file"] == str(path)
    assert [finding["what"] for finding in values["findings"]] == [finding.what for finding in found]
    assert {finding["level"] for finding in values["findings"]} == {"warning", "note"}
    assert [joint["name"] for joint in values["joints"]] == ["joint 1", "joint 2", "joint 3"]
    assert values["joints"][1]["steps_per_deg"] == pytest.approx(200 * 8 * 20 / 360)
    path.write_text("name = 3")
    values = json.loads(run_check("--arm", path, "--json").output)
    assert values["arm"] is None
    assert values["joints"] == []


def test_a_range_of_hardly_a_step_names_its_joint() -> None:
    joint = replace(Arm.paper().driven[1], range_deg=(0.0, 0.001))
    (found,) = drives._range(joint)
    assert found.where == joint.name
    assert found.what.startswith("its whole range, 0 to 0.001 deg, is 0.0")


def test_a_position_in_metres_is_suspected(tmp_path: Path) -> None:
    job = tmp_path / "job.toml"
    job.write_text(
        'name = "m"\n[[via]]\nposition_mm = [0.3, 0.1, 0.2]\n[[via]]\nangles_deg = [0.0, -60.0, 40.0]\n'
    )
    _, found = check(shipped.arm_path(), job)
    assert any("P0: its position is 0.374 mm from the origin" in finding.what for finding in found), found
    assert any(finding.next_step == "give it in mm: [300, 100, 200]" for finding in found)


# ``armtempo check`` with a job: what looks wrong about it for its arm


def changed_job(tmp_path: Path, old: str = "", new: str = "") -> Path:
    text = shipped.job_path().read_text()
    assert old in text
    path = tmp_path / "job.toml"
    path.write_text(text.replace(old, new, 1))
    return path


def test_the_feeding_job_fits(tmp_path: Path) -> None:
    result = run_check("--job", changed_job(tmp_path))
    assert result.exit_code == 0
    assert "\n0 errors, 0 warnings, " in result.output
    assert "nothing looks wrong" not in result.output  # after a list of what is missing


@pytest.mark.parametrize(
    ("via", "level", "said"),
    [
        (
            "[[0, -60, 40], [0, -60, 400], [0, -60, 40]]",
            "error",
            "within the range of joint 3, -160 to 100",
        ),
        (
            "[[0, -60, 40], [0.01, -50, 40], [0, -60, 40]]",
            "warning",
            "joint 1 is to move by 0.01 deg, less than a step",
        ),
        ("[[0, -60, 40], [0, -60, 40]]", "error", "all via points are the same"),
        ("[[0, -60], [0, -50]]", "error", "a list of 3 numbers"),
    ],
)
def test_what_looks_wrong_about_a_job(tmp_path: Path, via: str, level: str, said: str) -> None:
    path = tmp_path / "job.toml"
    path.write_text(f'name = "j"\nvia_deg = {via}\n')
    _, found = check(shipped.arm_path(), path)
    assert any(said in finding.what and finding.level.value == level for finding in found), found
    assert run_check("--job", path).exit_code == (1 if level == "error" else 0)


@pytest.mark.slow
def test_an_arc_that_the_arm_cannot_follow_is_an_error(tmp_path: Path) -> None:
    arm = Arm.load("ar4")
    here = arm.placed([10.0, 20.0, 10.0, 10.0, 40.0, 20.0])
    x_mm, y_mm, z_mm = forward(arm, here)[:3, 3].tolist()
    path = tmp_path / "job.toml"
    for off_mm, errors in ((20.0, 0), (2000.0, 1)):
        path.write_text(
            f'name = "j"\n[[via]]\nangles_deg = {list(here)}\n[[via]]\nposition_mm = [{x_mm}, {y_mm + 40}, {z_mm}]\n'
            f"arc_through_mm = [{x_mm}, {y_mm + 20}, {z_mm + off_mm}]\n"
        )
        _, found = check(shipped.find("ar4").path, path)
        told = [one for one in found if one.where == "job" and one.level.value == "error"]
        assert len(told) == errors, found
        assert all("P0 to P1" in one.what for one in told)


def test_a_job_is_not_looked_at_before_its_arm_is_right(tmp_path: Path) -> None:
    path = changed(tmp_path, ("channel = 2, steps", "channel = 1, steps"))
    _, found = check(path, changed_job(tmp_path))
    assert found[-1].what == "not checked"


def test_the_longest_lever_is_that_of_the_stretched_arm() -> None:
    scara = [found.lever_mm for found in figures.resolutions(Arm.load("scara"))]
    np.testing.assert_allclose(scara, [228 + 136.5, 136.5, 0], rtol=1e-4, atol=1e-6)
    lower = figures.resolutions(Arm.load("community"))[1]
    # The rods keep forearm and hand from turning with it
    assert lower.lever_mm == pytest.approx(120, rel=1e-4)


def test_the_torque_margin_is_that_of_the_model() -> None:
    """Joint 2: inertia and gravity through the gear, torque at 0.71 of the holding torque at the corner speed."""
    joint = Arm.paper().driven[1]
    gear, acceleration = 20, math.radians(30)
    asked = (8.2e-6 + 0.08 / gear**2) * acceleration * gear + 1.5 / gear
    available = 0.65 / math.sqrt(1 + (math.radians(40) * gear / 30.0) ** 2)
    assert torque.margin(joint) == pytest.approx(available / asked)
    assert torque.margin(replace(joint, model=JointModel())) is None


def test_gravity_counts_where_the_range_lets_it() -> None:
    joint = Arm.paper().driven[1]
    upright = replace(joint, range_deg=(60.0, 100.0), home_deg=90.0)
    assert torque.gravity_nm(joint) == pytest.approx(1.5 / 20)
    assert torque.gravity_nm(upright) == pytest.approx(1.5 / 20 * math.cos(math.radians(60)))


def test_figures_without_a_load_know_no_infinity(tmp_path: Path) -> None:
    path = changed(
        tmp_path, ("rotor_inertia_kg_m2 = 8.2e-6\ninertia_kg_m2 = 0.15", "rotor_inertia_kg_m2 = 0")
    )
    found = figures.of(Arm.read(path))[0]
    assert found.torque_margin == math.inf
    assert found.values["torque_margin"] is None
    assert "inf x" in figures.table([found])[1]


def test_the_outline_goes_through_the_frames() -> None:
    arm = Arm.paper()
    home = np.array(arm.all_home_deg)
    outline = outline_mm(arm, home)
    np.testing.assert_allclose(outline[::2], chains_mm(arm, np.array(arm.home_deg)), atol=1e-9)
    np.testing.assert_allclose(outline[1], [0, 0, 130])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["paper", "ar4", "scara_z", "community_rail"])
def test_the_picture_shows_home_every_driven_joint_and_frames(name: str) -> None:
    from armtempo.report.arm_picture import arm_picture

    there = ((1.0, 0.0, 0.0, 90.0), (0.0, 1.0, 0.0, 20.0), (0.0, 0.0, 1.0, 5.0), (0.0, 0.0, 0.0, 1.0))
    arm = replace(Arm.load(name), frames=(ArmFrame("tray", there),))
    figure = arm_picture(arm)
    titles = [axis.get_title() for axis in figure.axes if axis.axison]
    assert titles[:2] == ["home, from the side", "home, from above"]
    assert [title.split(":")[0] for title in titles[2:]] == [joint.name for joint in arm.driven]
    named = [{text.get_text(): text.xy for text in axis.texts}.get("tray") for axis in figure.axes[:3]]
    assert named[1:] == [(90.0, 20.0), None]
    assert named[0] in ((90.0, 5.0), (20.0, 5.0)), "as the arm is seen from the side"


@pytest.mark.slow
def test_the_picture_is_written_once(tmp_path: Path) -> None:
    path = tmp_path / "arm.png"
    assert run_check("--picture", path).exit_code == 0
    assert path.read_bytes().startswith(b"\x89PNG")
    path.write_text("mine")
    result = run_check("--picture", path)
    assert result.exit_code == 2
    assert path.read_text() == "mine"
    assert run_check("--picture", path, "--force").exit_code == 0
    assert path.read_bytes().startswith(b"\x89PNG")
    assert run_check("--picture", tmp_path / "arm.txt").exit_code == 2


@pytest.mark.slow
def test_a_dollar_in_a_name_is_no_formula(tmp_path: Path) -> None:
    path = changed(tmp_path, ('name = "joint 1"', 'name = "$$ \\\\theta"'), ('"paper-1to5"', '"$x^$"'))
    result = run_check("--arm", path, "--picture", tmp_path / "arm.svg")
    assert result.exit_code == 0, result.output
    assert ">$$ \\theta: " in (tmp_path / "arm.svg").read_text()


# ``armtempo doctor``: what is wrong is named with a cure, and ends with code 1; nothing is changed


STATE = BoardState(
    port="/dev/ttyACM0",
    virtual=False,
    board_id="1234 1.26",
    program_crc=0xABCD,
    program_current=True,
    protocol=2,
    arm_crc=5,
    arm="mine",
    arm_source="arm.toml",
    free_flash=50_000,
    free_heap=40_000,
    max_rate=240_000,
    max_rate_sum=240_000,
    rates_measured=False,
    engine_memory="5820 bytes: 3 x 5000 steps/s",
    arm_problem="",
    state="idle",
    moving=False,
    speed_percent=100.0,
    rest_s=0.0,
    fault="",
    frames_bad=0,
    samples_lost=0,
    sequence=None,
    joints=(),
)


@pytest.mark.parametrize("unread", [0, 2326])  # of a run that nobody watched
def test_a_sound_board_has_nothing_wrong(unread: int) -> None:
    found = doctor.examine_board(replace(STATE, samples_lost=unread))
    assert {item.level for item in found} == {Level.GOOD}


@pytest.mark.parametrize(
    ("change", "level", "words", "cure"),
    [
        ({"program_current": False}, Level.ERROR, "differs from", "armtempo flash"),
        ({"fault": "estop"}, Level.ERROR, "estop", "armtempo clear"),
        (
            {"arm_problem": "not used: the record is damaged"},
            Level.ERROR,
            "damaged",
            "armtempo configure",
        ),
        ({"free_heap": 3_000}, Level.NOTE, "3000 bytes of heap", "firmware"),
        ({"frames_bad": 7}, Level.NOTE, "7 damaged messages", "cable"),
    ],
)
def test_what_is_wrong_with_a_board(change: dict[str, object], level: Level, words: str, cure: str) -> None:
    found = [item for item in doctor.examine_board(replace(STATE, **change)) if item.level is not Level.GOOD]  # type: ignore[arg-type]
    assert [item.level for item in found] == [level]
    assert words in found[0].what
    assert cure in found[0].next_step


def test_another_version_of_the_program_is_told_with_both_and_what_to_do() -> None:
    other = replace(STATE, program_current=False)
    said = "\n".join(state.lines(other))
    assert f"{other.program_crc:08x}" in said
    assert f"installed here is {own_crc():08x}: 'armtempo flash'" in said


def test_a_board_that_does_not_answer() -> None:
    (item,) = doctor.examine_board(LinkError("no answer within 2 s; check power and cable"))
    assert item.level is Level.ERROR
    assert "no answer" in item.what


def test_a_port_that_may_not_be_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor.board_port, "find_ports", lambda: [Port("/dev/ttyACM0", "board", True)])
    monkeypatch.setattr(doctor.os, "access", lambda *_: False)
    monkeypatch.setattr(doctor.sys, "platform", "linux")
    (item,) = doctor.ports()
    assert item.level is Level.ERROR
    assert "dialout" in item.next_step


def test_packages_that_are_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(name: str) -> str:
        raise doctor.PackageNotFoundError(name)

    monkeypatch.setattr(doctor, "version", nothing)
    levels = {item.where: item.level for item in doctor.packages()}
    assert levels["numpy"] is Level.ERROR
    assert levels["matplotlib"] is Level.NOTE
    assert "sphinx" not in levels


def test_the_command_examines_a_virtual_board(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(main, ["doctor", "--arm", "paper", "--port", f"sim:{tmp_path / 'b'}", "--json"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert {item["what"] for item in found["machine"]} == {"armtempo", "Python", "flash tool", "system"}
    assert "(virtual)" in found["board"][0]["found"]
    assert "as installed here" in found["board"][1]["found"]


def test_a_broken_arm_file_is_named_and_ends_with_1(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("arm.toml").write_text("name = 3\n")
    done = CliRunner().invoke(main, ["doctor", "--arm", "arm.toml"])
    assert done.exit_code == 1, done.output
    assert "armtempo check --arm arm.toml" in done.output


def test_an_arm_that_is_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(main, ["doctor", "--arm", "nowhere.toml"])
    assert done.exit_code == 1
    assert "nowhere.toml" in done.output
    assert "Traceback" not in done.output
