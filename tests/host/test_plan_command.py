"""``armtempo plan``: what it prints, writes and refuses."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from armtempo.cli import main
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.model.plan import Plan
from armtempo.planning import planner
from click.testing import CliRunner, Result

POINT_TO_POINT = """
name = "move"
via_deg = [[0.0, -60.0, 40.0], [20.0, -75.0, 50.0]]
path = "through"
iterations = 10
"""


def run(*arguments: str) -> Result:
    """The command's outcome; a job is for the arm that ships with armtempo."""
    arm = {"ARMTEMPO_ARM": str(shipped.arm_path())} if "--job" in arguments else {}
    return CliRunner(env=arm).invoke(main, ["plan", *arguments])


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("move.toml").write_text(POINT_TO_POINT)


@pytest.mark.slow
def test_plans_the_shipped_job_without_options() -> None:
    result = run("--iterations", "20")
    assert result.exit_code == 0, result.output
    assert "joint 3" in result.output
    assert "written: feed.json" in result.output
    assert len(result.output.splitlines()) <= 12
    assert result.output.count("at least") == 2, "of the motion, and of each joint in the table"
    assert Plan.load("feed.json").job.iterations == 20


@pytest.mark.slow
def test_what_the_board_has_to_do_and_how_it_was_searched_is_printed_with_v() -> None:
    said = run("--job", "move.toml", "-v").output
    for words in (
        "steps/s; the board supports 240000 (estimated; 'armtempo selftest'",
        "lower bound: ",
        "record: ",
    ):
        assert words in said
        assert words not in run("--job", "move.toml", "--force").output


def test_help_loads_no_numbers() -> None:
    """Half of its time was the planner's import."""
    code = (
        "import sys; from armtempo.cli import main; main(['plan', '--help'], standalone_mode=False); "
        "print('numpy' in sys.modules)"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.splitlines()[-1] == "False"


@pytest.mark.slow
def test_json_is_one_document_and_quiet_leaves_it_alone() -> None:
    result = CliRunner().invoke(main, ["--quiet", "plan", "--iterations", "5", "--json"])
    assert result.exit_code == 0, result.output
    assert result.stderr == ""
    (found,) = json.loads(result.stdout)["plans"]
    saved = Plan.load("feed.json")
    assert (found["file"], found["duration_s"]) == ("feed.json", saved.trajectory.duration_s)
    assert [joint["name"] for joint in found["joints"]] == ["joint 1", "joint 2", "joint 3"]
    for joint in found["joints"]:
        assert joint["lower_bound_s"] <= joint["duration_s"] <= found["duration_s"]
        assert all(value <= joint["limits"][name] * (1 + 1e-9) for name, value in joint["extremes"].items())
    assert "no arm and no job given" in run("--iterations", "5").stderr


COARSE_JOINT_2 = ("microsteps = 8, gear_ratio = 20.0", "microsteps = 1, gear_ratio = 0.5")


@pytest.mark.slow
def test_coarse_steps_are_told_with_what_to_do() -> None:
    fine = run("--job", "move.toml", "--arm", "paper")
    assert "warning" not in fine.output
    text = shipped.files()[shipped.PAPER].read_text()
    assert COARSE_JOINT_2[0] in text
    Path("coarse.toml").write_text(text.replace(*COARSE_JOINT_2))
    result = run("--job", "move.toml", "--arm", "coarse.toml")
    assert result.exit_code == 0, result.output
    told = [line for line in result.output.splitlines() if line.startswith("warning: ")]
    assert len(told) == 2
    assert told[0].startswith(
        "warning: joint 2: its smallest step, 3.6 deg, is more than its following_error_deg of 2"
    )
    assert told[1].startswith("warning: joint 2: its smallest step, 3.6 deg, moves the tool by up to")
    assert all("use more microsteps or a larger gear ratio" in line for line in told)
    assert Plan.load("move.json").arm.joints[1].motor is not None


def test_an_arm_that_ships_is_taken_by_its_name() -> None:
    Path("ar4.toml").write_text(
        'name = "lift"\nvia_deg = [[0,0,0,0,0,0],[10,5,5,0,5,0]]\npath = "through"\niterations = 5\n'
    )
    result = run("--job", "ar4.toml", "--arm", "ar4")
    assert result.exit_code == 0, result.output
    assert "arm: AR4-MK3 (ships with armtempo)" in result.stdout
    assert Plan.load("lift.json").arm == Arm.load("ar4")


def test_options_go_before_the_file() -> None:
    options = "--timing shared --degree 3 --seed 5 --polish"
    result = run("--job", "move.toml", "-o", "out.json", *options.split())
    assert result.exit_code == 0, result.output
    plan = Plan.load("out.json")
    assert (plan.job.timing, plan.job.degree, plan.job.seed, plan.job.polish) == ("shared", 3, 5, True)
    assert plan.trajectory.shared
    assert plan.searches[0].optimum_s > 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("via_deg = [[0.0, -60.0, 40.0]]", "2"),
        ("via_deg = [[0.0, -60.0, nan], [1.0, -60.0, 40.0]]", "nan"),
        ("via_deg = [[0.0, -60.0, 40.0], [500.0, -75.0, 50.0]]", "500"),
        ("colour = 'red'", "colour"),
    ],
)
def test_says_what_is_wrong_with_a_job(change: str, message: str) -> None:
    lines = [line for line in POINT_TO_POINT.splitlines() if not line.startswith(change.split(" =")[0])]
    Path("wrong.toml").write_text("\n".join([*lines, change]))
    result = run("--job", "wrong.toml")
    assert result.exit_code == 2
    assert "wrong.toml" in result.output
    assert message in result.output
    assert "Traceback" not in result.output
    assert not Path("move.json").exists()


def test_too_little_memory_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise MemoryError("Unable to allocate 44.7 GiB")

    monkeypatch.setattr(planner, "plan", full)
    result = run("--job", "move.toml")
    assert (result.exit_code, result.output) == (
        1,
        "armtempo: not enough memory: Unable to allocate 44.7 GiB\n"
        "hint: close other programs, or lower refine or the population\n",
    )


def test_says_why_there_is_no_plan() -> None:
    Path("still.toml").write_text('name = "still"\nvia_deg = [[1.0, -60.0, 40.0], [1.0, -60.0, 40.0]]\n')
    result = run("--job", "still.toml")
    assert result.exit_code == 1
    assert "nothing moves" in result.output


RESTING = """
name = "rests"
timing = "shared"
refine = 4
path = "through"
iterations = 5
starts = 1
[[via]]
angles_deg = [0, -60, 40]
[[via]]
angles_deg = [20, -75, 50]
stop = true
dwell_s = 0.5
[[via]]
angles_deg = [40, -60, 40]
"""


@pytest.mark.slow
def test_plans_a_free_path_with_a_stop_and_says_its_starts_and_record() -> None:
    Path("rests.toml").write_text(RESTING)
    result = run("--job", "rests.toml", "--path", "free", "--refine", "auto", "-v")
    assert result.exit_code == 0, result.output
    assert "free path, shared timing" in result.output
    assert "1 starts, driven joint" in result.output
    assert "bytes of the 16384 that the board takes" in result.output
    plan = Plan.load("rests.json")
    assert plan.trajectory.joints[0].via_segments is not None
    assert plan.job.stops[0].dwell_s == 0.5


@pytest.mark.slow
def test_a_spline_stops_and_split_makes_two_motions_of_it() -> None:
    Path("rests.toml").write_text(RESTING)
    whole = run("--job", "rests.toml", "-o", "whole.json")
    assert whole.exit_code == 0, whole.output
    assert "with stops, shared timing" in whole.output
    spline = Plan.load("whole.json").trajectory.joints[0]
    assert abs(spline(spline.via_times_s[1], 1)) < 1e-6
    result = run("--job", "rests.toml", "--split")
    assert result.exit_code == 0, result.output
    first, second = (Plan.load(f"rests-{number}.json") for number in (1, 2))
    assert first.via_deg[-1].tolist() == second.via_deg[0].tolist() == [20.0, -75.0, 50.0]
    assert not Path("rests.json").exists()


SLOW = """
name = "slow"
refine = 32
path = "through"
polish = false
iterations = 5
[[via]]
angles_deg = [0, -60, 40]
[[via]]
angles_deg = [20, -75, 50]
stop = true
[[via]]
angles_deg = [40, -60, 40]
"""


def test_no_part_is_written_where_a_later_one_would_be_refused() -> None:
    Path("rests.toml").write_text(RESTING)
    Path("move-2.json").write_text("mine")
    refused = run("--job", "rests.toml", "--split", "-o", "move.json")
    assert refused.exit_code == 2
    assert "move-2.json exists" in refused.output
    assert not Path("move-1.json").exists()
    assert Path("move-2.json").read_text() == "mine"


@pytest.mark.slow
def test_a_motion_too_long_for_the_board_ends_with_1_and_is_split_on_request() -> None:
    """Beyond 3272 s; joint 1 at 0.012 deg/s takes about 1700 s to each via point."""
    text = shipped.files()[shipped.PAPER].read_text()
    assert text.count("speed_deg_s = 50.0") == 1
    Path("slow_arm.toml").write_text(text.replace("speed_deg_s = 50.0", "speed_deg_s = 0.012"))
    Path("slow.toml").write_text(SLOW.replace("stop = true\n", ""))
    whole = run("--job", "slow.toml", "--arm", "slow_arm.toml")
    assert whole.exit_code == 1
    assert "--split" in whole.output
    assert not Path("slow.json").exists()
    Path("slow.toml").write_text(SLOW)
    parts = run("--job", "slow.toml", "--arm", "slow_arm.toml", "--split")
    assert parts.exit_code == 0, parts.output
    assert Path("slow-1.json").exists()
    assert Path("slow-2.json").exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        *(
            (f"--refine {value}", "give auto or a whole number from 1 to 64")
            for value in ("0", "65", "many", "1.5")
        ),
        ("--population 1000000000", "population 1000000000 must be a whole number from"),
        ("--iterations 10000000", "iterations 10000000 must be a whole number from"),
    ],
)
def test_says_what_is_wrong_with_an_option(options: str, message: str) -> None:
    result = run("--job", "move.toml", *options.split())
    assert result.exit_code == 2
    assert message in result.output


@pytest.mark.slow
def test_a_job_that_does_not_say_otherwise_is_planned_on_a_free_path() -> None:
    Path("bent.toml").write_text('name = "bent"\nvia_deg = [[0, -60, 40], [20, -75, 50], [25, -75, 50]]\n')
    result = run("--job", "bent.toml")
    assert result.exit_code == 0, result.output
    assert "free path, shared timing" in result.output
    plan = Plan.load("bent.json")
    assert (plan.job.path, plan.job.timing, plan.job.refine) == ("free", "shared", "auto")
    assert plan.trajectory.shared
