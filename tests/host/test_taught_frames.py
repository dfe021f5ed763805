"""Frames taught from three points: what comes out, how far it may be off, and what is refused."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.cli.jog_screen import JogScreen
from armtempo.cli.teach import NamedPoints
from armtempo.model import taught, taught_frame
from armtempo.model.arm import Arm
from armtempo.model.tool_pose import Pose
from armtempo.planning import via_points
from armtempo.robot.teaching import NewFrame
from scipy.spatial.transform import Rotation

from tests.host.test_frames import FRAMES, arm_file, cli, pose

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
