"""Postures by name: in the arm file, in a job, for goto; and how teaching writes one into the file."""

from __future__ import annotations

import random
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.cli import main
from armtempo.cli.posture import NamedPosture
from armtempo.encoding import encode
from armtempo.kinematics.of_arm import forward
from armtempo.model import arm_json, taught
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.planning import planner, via_points
from click.testing import CliRunner

from tests.host import arms

PARK = "\n[posture.park]\nangles_deg = [0, -60, 40]\n"
POSE = "\n[posture.over]\nposition_mm = {}\ntolerance_mm = 0.01\n"


def with_pose(tmp_path: Path, angles_deg: list[float]) -> Path:
    """The shipped arm with the posture "over": the position of the tool at these angles."""
    position = forward(Arm.paper(), angles_deg)[:3, 3].round(4).tolist()
    return arms.write(tmp_path, POSE.format(position))


def test_a_posture_is_read_and_found_by_name(tmp_path: Path) -> None:
    arm = Arm.load(arms.write(tmp_path, PARK + "[posture.up]\nangles_deg = [10, -30, 0]\n"))
    assert [posture.name for posture in arm.postures] == ["park", "up"]
    assert arm.posture("park").where == (0.0, -60.0, 40.0)
    assert arm.posture("home").where == arm.home_deg
    with pytest.raises(InputError, match="no posture 'prak'; did you mean 'park'"):
        arm.posture("prak")


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("[posture.home]\nangles_deg = [0, 0, 0]", "posture.home: 'home' is the posture"),
        ("[posture.P1]\nangles_deg = [0, 0, 0]", "posture.P1: 'P1' is the name of a job's via point"),
        ("[posture.nan]\nangles_deg = [0, 0, 0]", "posture.nan: 'nan' is not a valid name"),
        ("[posture.'1st']\nangles_deg = [0, 0, 0]", "posture.1st: '1st' is not a valid name"),
        ("[posture.park]\nangles_deg = [0, 0]", "posture.park.angles_deg"),
        ("[posture.park]\nangles_deg = [0, 500, 0]", "posture.park: joint 2: 500 degrees is outside"),
        ("[posture.park]\nangle_deg = [0, 0, 0]", "posture.park: exactly one of"),
        ("[posture.park]\nangles_deg = [0, 0, 0]\nspeed = 1", "posture.park.speed: unknown key"),
        ("[posture.park]\nposition_mm = [2000, 0, 0]", "posture.park: 2000 mm from the base, but all links"),
        ("[posture]\npark = 3", "posture.park = 3"),
        ("[[posture]]\nname = 'park'", "posture"),
    ],
)
def test_a_posture_that_cannot_be_is_refused_by_name(tmp_path: Path, more: str, said: str) -> None:
    with pytest.raises(InputError) as refused:
        Arm.load(arms.write(tmp_path, "\n" + more + "\n"))
    assert said in str(refused.value)


def test_a_pose_that_the_arm_cannot_take_is_refused_before_a_port_is_opened(tmp_path: Path) -> None:
    path = arms.write(tmp_path, POSE.format([0.0, 0.0, -500.0]))
    result = CliRunner().invoke(main, ["goto", "over", "--arm", str(path), "--port", "nowhere"])
    assert result.exit_code == 2
    assert "posture 'over'" in result.output
    assert "nowhere" not in result.output


def test_postures_change_neither_record_nor_identity_and_survive_json(tmp_path: Path) -> None:
    arm = Arm.load(with_pose(tmp_path, [20.0, -40.0, 30.0]))
    assert encode.arm_record(arm) == encode.arm_record(Arm.paper())
    file = tmp_path / "arm.json"
    arm_json.save(arm, file)
    assert arm_json.load(file) == arm
    broken = replace(arm, postures=(replace(arm.postures[0], where=(0.0, 500.0, 0.0)),))
    arm_json.save(broken, file)
    with pytest.raises(InputError, match=r"posture 'over'.*outside"):
        arm_json.load(file)


def test_a_pose_means_the_same_angles_in_a_job_and_for_goto(tmp_path: Path) -> None:
    path = with_pose(tmp_path, [20.0, -40.0, 30.0])
    arm = Arm.load(path)
    angles_deg = via_points.posture_deg(arm, arm.posture("over"))
    np.testing.assert_allclose(
        forward(arm, angles_deg)[:3, 3], forward(arm, [20.0, -40.0, 30.0])[:3, 3], atol=0.02
    )
    job_file = tmp_path / "job.toml"
    job_file.write_text(
        'name = "there"\n[[via]]\nangles_deg = [170, -80, 60]\n[[via]]\nposture = "over"\n'
        '[[via]]\nposture = "home"\n'
    )
    via_deg, _ = planner.via_angles(arm, Job.load(job_file, arm))
    np.testing.assert_allclose(via_deg[1], angles_deg, atol=1e-9)
    np.testing.assert_allclose(via_deg[2], arm.home_deg, atol=1e-9)
    named = NamedPosture.of("over", path, False)
    np.testing.assert_array_equal(named.angles_deg(arm, None), angles_deg)


def test_a_job_with_an_unknown_posture_says_which_is_meant(tmp_path: Path) -> None:
    arm = Arm.load(arms.write(tmp_path, PARK))
    file = tmp_path / "job.toml"
    file.write_text('name = "x"\n[[via]]\nposture = "parc"\n[[via]]\nposture = "home"\n')
    with pytest.raises(InputError, match=r"via P0.*no posture 'parc'; did you mean 'park'"):
        Job.load(file, arm)
    file.write_text(
        'name = "x"\n[[via]]\nposture = "park"\nangles_deg = [0, 0, 0]\n[[via]]\nposture = "home"\n'
    )
    with pytest.raises(InputError, match="exactly one of"):
        Job.load(file, arm)


# writing one


def test_a_new_posture_is_put_behind_and_the_rest_stays(tmp_path: Path) -> None:
    path = arms.write(tmp_path, "# the end")
    before = path.read_text()
    arm = Arm.load(path)
    taught.save(path, arm, "park", [0.0, -60.0, 40.5], replace=False)
    assert path.read_text() == before + "\n\n[posture.park]\nangles_deg = [0, -60, 40.5]\n"
    assert Arm.load(path).posture("park").where == (0.0, -60.0, 40.5)
    with pytest.raises(InputError, match="has a posture 'park'"):
        taught.save(path, arm, "park", [1.0, -60.0, 40.5], replace=False)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (
            "# one\n[posture.park] # two\n# three\nangles_deg = [1, 2, 3] # four\n# five\n\n[driver]\nx = 3\n",
            "# one\n[posture.park] # two\n# three\nangles_deg = [7, 8.5, -9] # four\n# five\n\n[driver]\nx = 3\n",
        ),
        (
            "[posture.park]\nangles_deg = [\n  1,\n  2, # two\n  3,\n]\n# end\n",
            "[posture.park]\nangles_deg = [7, 8.5, -9]\n# end\n",
        ),
        (
            "[posture.park]\n# pose\nposition_mm = [\n 1,\n 2, 3]\nrpy_deg = [0, 0, 0]\n# end\n[posture.up]\nx = 1\n",
            "[posture.park]\n# pose\nangles_deg = [7, 8.5, -9]\n# end\n[posture.up]\nx = 1\n",
        ),
        (
            'x = 1\r\n[ posture . "park" ]\r\nangles_deg=[1,2,3]\r\n',
            'x = 1\r\n[ posture . "park" ]\r\nangles_deg=[7, 8.5, -9]\r\n',
        ),
        ("\ufeffx = 1\n", "\ufeffx = 1\n\n[posture.park]\nangles_deg = [7, 8.5, -9]\n"),
    ],
)
def test_only_the_one_table_changes(old: str, new: str) -> None:
    assert (
        taught.with_table(old, ("posture", "park"), {"angles_deg": [7.0, 8.5, -9.0]}, Path("arm.toml")) == new
    )


@pytest.mark.parametrize(
    "text",
    [
        "posture = { park = { angles_deg = [1, 2, 3] } }\n",
        "posture.park.angles_deg = [1, 2, 3]\n",
        "[posture]\npark = { angles_deg = [1, 2, 3] }\n",
        'x = """\n[posture.park]\nangles_deg = [1, 2, 3]\n"""\n[posture.park]\nangles_deg = [1, 2, 3]\n',
    ],
)
def test_a_layout_that_cannot_be_changed_safely_is_left_alone(text: str) -> None:
    with pytest.raises(InputError, match="cannot be changed here") as refused:
        taught.with_table(text, ("posture", "park"), {"angles_deg": [7.0, 8.5, -9.0]}, Path("arm.toml"))
    assert "[posture.park] angles_deg = [7, 8.5, -9]" in str(refused.value)


def test_random_files_change_in_the_one_table_only() -> None:
    seed = 15
    print("seed", seed)
    rng = random.Random(seed)
    for _ in range(300):
        names = rng.sample(["park", "up", "over", "rest"], rng.randint(1, 4))
        parts = [f"a = {rng.randint(0, 9)}\n", *(_table(rng, name) for name in names)]
        parts += rng.choice([[], ["[driver]\npulse_us = 3.0 # wide\n"]])
        text = "".join([parts[0], *rng.sample(parts[1:], len(parts) - 1)])
        name = rng.choice(["park", "new"])
        angles = [round(rng.uniform(-90, 90), 3) for _ in range(3)]
        after = taught.with_table(text, ("posture", name), {"angles_deg": angles}, Path("arm.toml"))
        expected = tomllib.loads(text)
        expected["posture"][name] = {"angles_deg": angles}
        assert tomllib.loads(after) == expected
        assert after.count("#") == text.count("#")


def _table(rng: random.Random, name: str) -> str:
    comment = rng.choice(["", "# first\n"])
    values = rng.choice(["[1, 2, 3]", "[1,\n 2,\n 3]"])
    last = rng.choice(["", " # last"])
    return f"{comment}[posture.{name}]\n{comment}angles_deg = {values}{last}\n" + rng.choice(["", "\n"])


@pytest.mark.parametrize("name", ["paper", "thor"])
def test_the_digits_written_mean_the_same_steps(name: str) -> None:
    """Thor's wrist has two motors for two joints."""
    arm, rng = Arm.load(name), np.random.default_rng(3)
    low, high = np.array([joint.range_deg for joint in arm.driven]).T
    for angles in rng.uniform(low, high, (100, len(arm.driven))):
        steps = arm.transmission.whole_steps(angles)
        for given in (angles, np.clip(arm.transmission.angles_of_steps(steps), low, high)):
            found = taught.digits(arm, given.tolist())
            assert arm.transmission.whole_steps(found) == arm.transmission.whole_steps(given)
        assert all(len(f"{value:.12g}") <= 9 for value in found)


def test_an_arm_that_ships_is_not_written_to() -> None:
    result = CliRunner().invoke(main, ["teach", "--posture", "park", "--arm", "ar4", "--port", "sim"])
    assert result.exit_code == 2
    assert "belongs to armtempo" in result.output
    assert "armtempo new FOLDER --like ar4" in result.output
