"""Tools that are taught from four postures around a tip: the point, what is written, and what is refused."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from armtempo.cli import main
from armtempo.cli.teach import NamedPoints
from armtempo.model import taught_tool
from armtempo.model.arm import Arm
from armtempo.model.tool import ArmTool
from armtempo.model.tool_pose import Pose
from armtempo.planning import via_points
from armtempo.robot.teaching import NewTool
from click.testing import CliRunner
from scipy.spatial.transform import Rotation

from tests.host import arms

AR4 = Arm.load("ar4")
TIP = (15.0, -8.0, 70.0)
TURNS = ((180, 0, 0), (150, 10, 60), (200, -25, -60), (170, 30, 20))


def postures_at(tip: np.ndarray, off_mm: float = 0.0, turns: Any = TURNS) -> dict[str, list[float]]:
    """Postures of the AR4, by name, with the point of the tool at a tip; ``off_mm``: the last one beside it."""
    there = np.eye(4)
    there[:3, 3] = TIP
    arm = replace(AR4, tool=ArmTool("x", tuple(map(tuple, there.tolist()))))
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
    path = arms.write(folder, more, said, like="ar4")
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
    path = arms.write(tmp_path, like="ar4")
    arm = Arm.load(path)
    here = iter(postures_at(PLACE).values())
    points = NamedPoints(arm, lambda: np.array(next(here)), NewTool(path, arm, "gripper", replace_old=False))
    said = [points.take() for _ in range(4)]
    assert said[0] == "the first posture taken; next: the second posture"
    assert said[3] == "the fourth posture taken; next: q writes the tool"
    points.save()
    np.testing.assert_allclose(np.array(Arm.load(path).tools[0].matrix)[:3, 3], TIP, atol=0.05)
